//! Marks by hand go to what they were meant for: the corner or the edge nearby, found to a part of a pixel.
//!
//! Corners are where the lines of edges around meet best (W. Foerstner, E. Guelch: A fast operator for detection and precise location of distinct points,
//! corners and centres of circular features, 1987); edges are where brightness changes most along its gradient. Gradients are taken by Gaussian derivatives
//! at any place between pixels, so that nothing is interpolated.

use glam::{DMat2, DVec2};
use std::f64::consts::TAU;

/// The Gaussian that gradients are taken with, pixels: about what a sharp photograph is blurred by anyway.
const GRADIENT_SIGMA_PX: f64 = 0.9;
/// How far its weights reach, pixels.
const GRADIENT_REACH_PX: f64 = 3.5;
/// The window in which edges have to meet in a corner, pixels.
const WINDOW_SIGMA_PX: f64 = 2.0;
const WINDOW_REACH_PX: f64 = 5.0;
/// The steepest gradient below which there is only noise: a step of 6 of 255 grey levels.
const LEAST_GRADIENT: f64 = 6.0 / 255.0 * 0.4;
/// A corner's edges differ in direction: the ratio of a round tensor's eigenvalues is 1, an edge's is 0. Below, the meeting place slides along the edge.
const LEAST_ROUNDNESS: f64 = 0.3;
/// A corner counts beside the most contrasty place around only from this part of its energy.
const LEAST_SHARE: f64 = 0.05;
/// Steps that place a corner; each centres the window anew.
const MOST_STEPS: usize = 12;
/// Settled.
const SETTLED_PX: f64 = 1e-4;

/// Directions in which edges are sought that leave a corner.
const RAYS: usize = 48;
/// Where along them edges are measured, pixels from the corner: beyond what its blur rounds, and in so many steps of a pixel.
const FROM_PX: f64 = 3.5;
const STEPS: usize = 8;
/// How far beside a direction its edge may lie, pixels.
const ASIDE_PX: f64 = 1.6;
/// What is more crooked is no straight edge, pixels.
const CROOKED_PX: f64 = 0.35;
/// How far a rounded corner is from where its edges meet, pixels, at most.
const FARTHEST_PX: f64 = 2.5;

/// Brightness of a piece of a photograph, 0 to 1 as the file has it, row by row. The middle of its first pixel is at 0.5, 0.5.
#[derive(Clone, Debug, PartialEq)]
pub struct Grey {
    width: usize,
    height: usize,
    values: Vec<f32>,
}

/// What a mark went to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SnappedTo {
    /// Where edges meet.
    Corner,
    /// An edge that runs along this unit direction.
    Edge(DVec2),
}

/// Where a mark went.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Snapped {
    /// Where, in pixels of the piece.
    pub pixel: DVec2,
    /// To what.
    pub to: SnappedTo,
}

impl Grey {
    /// A piece of `width` times `height` values; `None` where these are not as many, or not numbers.
    #[must_use]
    pub fn new(width: usize, height: usize, values: Vec<f32>) -> Option<Self> {
        let is_whole = width.checked_mul(height) == Some(values.len()) && values.iter().all(|v| v.is_finite());
        is_whole.then_some(Self { width, height, values })
    }

    /// How far around the pointer a piece has to reach, for marks that snap within `radius_px`.
    #[must_use]
    pub fn reach_px(radius_px: f64) -> f64 {
        radius_px + WINDOW_REACH_PX.max(FROM_PX + STEPS as f64 + ASIDE_PX) + GRADIENT_REACH_PX + 2.0
    }

    fn sees(&self, at: DVec2) -> bool {
        let size = DVec2::new(self.width as f64, self.height as f64);
        (at.cmpge(DVec2::splat(GRADIENT_REACH_PX)) & at.cmple(size - GRADIENT_REACH_PX)).all()
    }

    /// The gradient at any place, per pixel; zero where the piece does not reach around it.
    fn gradient(&self, at: DVec2) -> DVec2 {
        if !self.sees(at) {
            return DVec2::ZERO;
        }
        let from = (at - GRADIENT_REACH_PX).floor().max(DVec2::ZERO);
        let to = (at + GRADIENT_REACH_PX).ceil();
        let columns = from.x as usize..(to.x as usize).min(self.width);
        let rows = from.y as usize..(to.y as usize).min(self.height);
        let weight = |d: f64| libm::exp(-0.5 * d * d / (GRADIENT_SIGMA_PX * GRADIENT_SIGMA_PX));
        let offsets = |range: std::ops::Range<usize>, at: f64| -> Vec<(usize, f64, f64)> {
            range.map(|i| (i, i as f64 + 0.5 - at)).map(|(i, d)| (i, d, weight(d))).collect()
        };
        let (columns, rows) = (offsets(columns, at.x), offsets(rows, at.y));
        // A plane fitted under these weights: its slope is the gradient, of a constant exactly 0.
        let (mut w, mut wd, mut wv) = (0.0, DVec2::ZERO, 0.0);
        let (mut wdd, mut wdv) = (DMat2::ZERO, DVec2::ZERO);
        for &(y, dy, wy) in &rows {
            for &(x, dx, wx) in &columns {
                let (weight, d) = (wx * wy, DVec2::new(dx, dy));
                let value = f64::from(self.values[y * self.width + x]);
                w += weight;
                wd += weight * d;
                wv += weight * value;
                wdd += DMat2::from_cols(d * (weight * dx), d * (weight * dy));
                wdv += d * (weight * value);
            }
        }
        let mean = wd / w;
        let spread = wdd - DMat2::from_cols(wd * mean.x, wd * mean.y);
        let covariance = wdv - mean * wv;
        if spread.determinant() > 0.0 { spread.inverse() * covariance } else { DVec2::ZERO }
    }
}

/// Where a mark set at `start` was meant to be: the corner within `radius_px` if there is one, else the edge. `None` where all is even.
#[must_use]
pub fn snap(grey: &Grey, start: DVec2, radius_px: f64) -> Option<Snapped> {
    if !(start.is_finite() && radius_px > 0.0 && radius_px.is_finite()) {
        return None;
    }
    let field = Field::around(grey, start, radius_px);
    corner(grey, &field, start, radius_px)
        .map(|pixel| Snapped { pixel, to: SnappedTo::Corner })
        .or_else(|| edge(grey, &field, start, radius_px))
}

/// Gradients at the middles of pixels.
struct Field {
    first: [i64; 2],
    columns: usize,
    gradients: Vec<DVec2>,
}

impl Field {
    fn around(grey: &Grey, start: DVec2, radius_px: f64) -> Self {
        let reach = radius_px + WINDOW_REACH_PX + 1.0;
        let limits = DVec2::new(grey.width as f64, grey.height as f64);
        let from = (start - reach).floor().clamp(DVec2::ZERO, limits);
        let to = (start + reach).ceil().clamp(from, limits);
        let (columns, rows) = ((to.x - from.x) as usize, (to.y - from.y) as usize);
        let at = |i: usize| from + 0.5 + DVec2::new((i % columns) as f64, (i / columns) as f64);
        let gradients = (0..columns * rows).map(|i| grey.gradient(at(i))).collect();
        Self { first: [from.x as i64, from.y as i64], columns, gradients }
    }

    fn each(&self) -> impl Iterator<Item = (DVec2, DVec2)> {
        self.gradients.iter().enumerate().map(|(i, g)| {
            let (column, row) = (i % self.columns, i / self.columns);
            let at = DVec2::new(self.first[0] as f64 + column as f64 + 0.5, self.first[1] as f64 + row as f64 + 0.5);
            (at, *g)
        })
    }

    /// The structure tensor about a place, and the place where the edges' lines meet best.
    fn tensor(&self, about: DVec2) -> (DMat2, DVec2) {
        let (mut tensor, mut sum) = (DMat2::ZERO, DVec2::ZERO);
        let near = |x: f64, first: i64| (x - WINDOW_REACH_PX - first as f64).floor().max(0.0) as usize;
        let rows = self.gradients.len() / self.columns.max(1);
        for row in near(about.y, self.first[1])..rows {
            let y = self.first[1] as f64 + row as f64 + 0.5 - about.y;
            if y > WINDOW_REACH_PX {
                break;
            }
            for column in near(about.x, self.first[0])..self.columns {
                let x = self.first[0] as f64 + column as f64 + 0.5 - about.x;
                if x > WINDOW_REACH_PX {
                    break;
                }
                let (d, g) = (DVec2::new(x, y), self.gradients[row * self.columns + column]);
                let weight = libm::exp(-0.5 * d.length_squared() / (WINDOW_SIGMA_PX * WINDOW_SIGMA_PX));
                let outer = DMat2::from_cols(g * (weight * g.x), g * (weight * g.y));
                tensor += outer;
                sum += outer * d;
            }
        }
        (tensor, sum)
    }
}

/// How strong a corner a tensor is, and how round.
fn cornerness(tensor: &DMat2) -> (f64, f64) {
    let trace = tensor.x_axis.x + tensor.y_axis.y;
    let determinant = tensor.determinant().max(0.0);
    if trace > 0.0 { (determinant / trace, 4.0 * determinant / (trace * trace)) } else { (0.0, 0.0) }
}

fn closeness(distance: f64, radius_px: f64) -> f64 {
    libm::exp(-2.0 * (distance / radius_px) * (distance / radius_px))
}

fn corner(grey: &Grey, field: &Field, start: DVec2, radius_px: f64) -> Option<DVec2> {
    let within = |at: DVec2| at.distance(start) <= radius_px;
    let strongest = field.each().filter(|(at, _)| within(*at)).map(|(_, g)| g.length()).fold(0.0, f64::max);
    if strongest < LEAST_GRADIENT {
        return None;
    }
    let mut found: Vec<(f64, DVec2)> = Vec::new();
    let mut most_energy: f64 = 0.0;
    for (at, _) in field.each().filter(|(at, _)| within(*at)) {
        let (tensor, _) = field.tensor(at);
        most_energy = most_energy.max(tensor.x_axis.x + tensor.y_axis.y);
        let (strength, roundness) = cornerness(&tensor);
        if roundness > LEAST_ROUNDNESS {
            found.push((strength, at));
        }
    }
    found.retain(|(strength, _)| *strength > LEAST_SHARE * most_energy);
    let score = |(strength, at): &(f64, DVec2)| strength * closeness(at.distance(start), radius_px);
    found.sort_by(|a, b| score(b).total_cmp(&score(a)));
    // The best may slide out of the window: a few others are tried.
    found.iter().take(4).find_map(|(_, at)| settled(grey, field, *at)).filter(|at| at.distance(start) <= radius_px + 1.0)
}

/// Foerstner's point, with the window centred on it.
fn settled(grey: &Grey, field: &Field, from: DVec2) -> Option<DVec2> {
    let mut at = from;
    for _ in 0..MOST_STEPS {
        let (tensor, sum) = field.tensor(at);
        if cornerness(&tensor).1 <= 0.5 * LEAST_ROUNDNESS || !grey.sees(at) {
            return None;
        }
        let step = tensor.inverse() * sum;
        if !(step.length() < WINDOW_REACH_PX) {
            return None;
        }
        at += step;
        if step.length() < SETTLED_PX {
            break;
        }
    }
    (at.distance(from) < WINDOW_REACH_PX).then(|| sharpened(grey, sharpened(grey, at)))
}

/// Where the lines meet that are fitted to the edges that leave a corner, seen from about where it is. Blur rounds the corner itself and draws
/// Foerstner's point into it; away from it edges are where they are.
fn sharpened(grey: &Grey, about: DVec2) -> DVec2 {
    let ray = |i: usize| {
        let angle = TAU * i as f64 / RAYS as f64;
        DVec2::new(libm::cos(angle), libm::sin(angle))
    };
    let away = |ray: DVec2, step: usize| about + ray * (FROM_PX + step as f64);
    let strength =
        |ray: DVec2| (0..STEPS).map(|step| grey.gradient(away(ray, step)).dot(ray.perp())).sum::<f64>() / STEPS as f64;
    let strengths: Vec<f64> = (0..RAYS).map(|i| strength(ray(i))).collect();
    let strongest = strengths.iter().map(|s| s.abs()).fold(0.0, f64::max);
    let is_edge = |i: usize| {
        let [before, here, after] = [RAYS - 1, 0, 1].map(|step| strengths[(i + step) % RAYS].abs());
        here > 0.35 * strongest && here > before && here >= after
    };
    let (mut tensor, mut sum) = (DMat2::ZERO, DVec2::ZERO);
    for i in (0..RAYS).filter(|i| is_edge(*i)) {
        let (ray, sign) = (ray(i), strengths[i].signum());
        let across = ray.perp() * sign;
        let on_edge = |step: usize| {
            let at = away(ray, step);
            let off = peak(|t| grey.gradient(at + across * t).dot(across)).filter(|off| off.abs() < ASIDE_PX)?;
            (grey.gradient(at + across * off).dot(across) > 0.5 * strongest.min(strengths[i].abs()))
                .then_some(at + across * off - about)
        };
        let places: Vec<DVec2> = (0..STEPS).filter_map(on_edge).collect();
        let count = places.len() as f64;
        if places.len() < STEPS / 2 {
            continue;
        }
        let middle = places.iter().sum::<DVec2>() / count;
        let spread =
            places.iter().map(|p| *p - middle).map(|d| DMat2::from_cols(d * d.x, d * d.y)).fold(DMat2::ZERO, |a, b| a + b);
        // The direction along which they lie is the spread's own, which one step of a power finds from near it.
        let Some(along) = (spread * (spread * ray)).try_normalize() else { continue };
        let normal = along.perp();
        let straightness = places.iter().map(|p| (*p - middle).dot(normal).powi(2)).sum::<f64>() / count;
        if straightness > CROOKED_PX * CROOKED_PX {
            continue;
        }
        let outer = DMat2::from_cols(normal * normal.x, normal * normal.y);
        tensor += outer;
        sum += outer * middle;
    }
    if cornerness(&tensor).1 < 0.1 {
        return about;
    }
    let step = tensor.inverse() * sum;
    if step.length() < FARTHEST_PX { about + step } else { about }
}

fn edge(grey: &Grey, field: &Field, start: DVec2, radius_px: f64) -> Option<Snapped> {
    let score = |(at, g): &(DVec2, DVec2)| g.length() * closeness(at.distance(start), radius_px);
    let near = field.each().filter(|(at, g)| at.distance(start) <= radius_px && g.length() >= LEAST_GRADIENT);
    let (mut at, mut gradient) = near.max_by(|a, b| score(a).total_cmp(&score(b)))?;
    for _ in 0..MOST_STEPS {
        let across = gradient.try_normalize()?;
        // The edge's place beside where the pointer is, not where it happened to be steepest.
        let foot = start + across * (at - start).dot(across);
        let rise = |t: f64| grey.gradient(foot + across * t).dot(across);
        let peak = peak(rise)?;
        let next = foot + across * peak;
        let moved = next.distance(at);
        at = next;
        gradient = grey.gradient(at);
        if gradient.dot(across) < LEAST_GRADIENT {
            return None;
        }
        if moved < SETTLED_PX {
            break;
        }
    }
    let along = gradient.perp().try_normalize()?;
    (at.distance(start) <= radius_px + 1.0).then_some(Snapped { pixel: at, to: SnappedTo::Edge(along) })
}

/// Where a slope is steepest, near 0. A blurred step's slope is a Gaussian, whose logarithm is a parabola.
fn peak(rise: impl Fn(f64) -> f64) -> Option<f64> {
    const STEP_PX: f64 = 0.75;
    let mut at = 0.0;
    for _ in 0..MOST_STEPS {
        let [before, here, after] = [at - STEP_PX, at, at + STEP_PX].map(|t| rise(t).max(1e-6));
        let [before, here, after] = [before, here, after].map(libm::log);
        let bend = before - 2.0 * here + after;
        let step = if bend < -1e-9 {
            (0.5 * STEP_PX * (before - after) / bend).clamp(-STEP_PX, STEP_PX)
        } else {
            STEP_PX.copysign(after - before)
        };
        at += step;
        if step.abs() < SETTLED_PX {
            break;
        }
        if at.abs() > 3.0 {
            return None;
        }
    }
    Some(at)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIDE: usize = 64;
    /// Samples a pixel's side, for its mean.
    const FINE: usize = 24;

    /// A picture whose pixels are means of what `is_bright` says, softened as a lens does.
    fn picture(noise: f64, is_bright: impl Fn(DVec2) -> bool) -> Grey {
        let mean = |i: usize| {
            let corner = DVec2::new((i % SIDE) as f64, (i / SIDE) as f64);
            let place = |k: usize| corner + (DVec2::new((k % FINE) as f64, (k / FINE) as f64) + 0.5) / FINE as f64;
            (0..FINE * FINE).filter(|k| is_bright(place(*k))).count() as f64 / (FINE * FINE) as f64
        };
        let sharp: Vec<f64> = (0..SIDE * SIDE).map(mean).collect();
        let mut seed = 17u64;
        let mut random = || {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (seed >> 33) as f64 / (1u64 << 31) as f64 - 0.5
        };
        let soft = |i: usize| {
            let (x, y) = ((i % SIDE) as i64, (i / SIDE) as i64);
            let value = |dx: i64, dy: i64| {
                let clamped = |v: i64| v.clamp(0, SIDE as i64 - 1) as usize;
                sharp[clamped(y + dy) * SIDE + clamped(x + dx)]
            };
            let weight = |d: i64| [0.5, 0.25][d.unsigned_abs() as usize];
            (-1..=1)
                .flat_map(|dy| (-1..=1).map(move |dx| (dx, dy)))
                .map(|(dx, dy)| weight(dx) * weight(dy) * value(dx, dy))
                .sum::<f64>()
        };
        let values = (0..SIDE * SIDE).map(|i| (0.2 + 0.5 * soft(i) + noise * random()) as f32).collect();
        Grey::new(SIDE, SIDE, values).unwrap()
    }

    fn direction(degrees: f64) -> DVec2 {
        DVec2::from_angle(degrees.to_radians())
    }

    #[test]
    fn corners_of_any_angle_and_turn_are_found_to_a_tenth_of_a_pixel() {
        let mut worst: f64 = 0.0;
        for (i, opening) in [60.0, 90.0, 90.0, 120.0, 90.0, 75.0].into_iter().enumerate() {
            for turn in [0.0, 17.0, 45.0, 200.0, 290.0] {
                let corner = DVec2::new(31.3 + 0.17 * i as f64, 32.9 - 0.21 * i as f64);
                let (a, b) = (direction(turn), direction(turn + opening));
                let grey = picture(0.02, |p| a.perp_dot(p - corner) > 0.0 && (p - corner).perp_dot(b) > 0.0);
                for start in [DVec2::new(2.0, 3.0), DVec2::new(-4.0, 1.0), DVec2::new(0.3, -3.7)] {
                    let found = snap(&grey, corner + start, 7.0).unwrap();
                    assert_eq!(found.to, SnappedTo::Corner, "{opening} {turn} {start}");
                    worst = worst.max(found.pixel.distance(corner));
                }
            }
        }
        assert!(worst < 0.1, "{worst}");
    }

    #[test]
    fn where_four_fields_meet_is_found_most_finely() {
        for turn in [0.0, 30.0, 61.0] {
            let corner = DVec2::new(30.62, 33.21);
            let (a, b) = (direction(turn), direction(turn + 90.0));
            let grey = picture(0.02, |p| (a.dot(p - corner) > 0.0) != (b.dot(p - corner) > 0.0));
            let found = snap(&grey, corner + DVec2::new(3.0, -2.0), 7.0).unwrap();
            assert_eq!(found.to, SnappedTo::Corner);
            assert!(found.pixel.distance(corner) < 0.05, "{}", found.pixel.distance(corner));
        }
    }

    #[test]
    fn an_edge_is_met_beside_the_pointer() {
        let mut worst: f64 = 0.0;
        for turn in [0.0, 12.0, 45.0, 77.0, 90.0, 133.0] {
            for off in [-3.3, -0.4, 0.25, 2.9] {
                let (along, through) = (direction(turn), DVec2::new(31.7, 32.35));
                let grey = picture(0.01, |p| along.perp_dot(p - through) > 0.0);
                let start = through + along * 3.0 + along.perp() * off;
                let found = snap(&grey, start, 7.0).unwrap();
                let SnappedTo::Edge(direction) = found.to else { panic!("no corner is here: {turn} {off}") };
                worst = worst.max(along.perp_dot(found.pixel - through).abs());
                assert!((found.pixel - start).dot(along).abs() < 0.3, "it stays beside the pointer");
                assert!(direction.perp_dot(along).abs() < 0.05);
            }
        }
        assert!(worst < 0.05, "{worst}");
    }

    #[test]
    fn of_two_corners_the_nearer_is_meant_and_beyond_the_radius_none() {
        let corners = [DVec2::new(24.4, 30.6), DVec2::new(39.2, 30.6)];
        let grey = picture(0.0, |p| p.x > corners[0].x && p.x < corners[1].x && p.y > corners[0].y);
        for corner in corners {
            let found = snap(&grey, corner + DVec2::new(1.5, -2.0), 6.0).unwrap();
            assert!(found.pixel.distance(corner) < 0.15, "{}", found.pixel);
        }
        let middle = snap(&grey, DVec2::new(32.0, 32.0), 4.0).unwrap();
        assert!(matches!(middle.to, SnappedTo::Edge(_)) && (middle.pixel.y - 30.6).abs() < 0.1, "{middle:?}");
        assert_eq!(snap(&grey, DVec2::new(32.0, 45.0), 4.0), None);
    }

    #[test]
    fn even_walls_noise_and_margins_hold_no_mark() {
        assert_eq!(snap(&picture(0.0, |_| true), DVec2::splat(32.0), 8.0), None);
        let margin = picture(0.0, |p| p.x > 30.0);
        for start in [DVec2::splat(-50.0), DVec2::new(0.0, 70.0), DVec2::NAN, DVec2::splat(1e12)] {
            assert_eq!(snap(&margin, start, 8.0), None);
        }
        assert_eq!(snap(&margin, DVec2::splat(30.0), f64::NAN), None);
        assert_eq!(Grey::new(3, 3, vec![0.0; 8]), None);
        assert_eq!(Grey::new(1, 1, vec![f32::NAN]), None);
        assert_eq!(snap(&Grey::new(0, 0, Vec::new()).unwrap(), DVec2::ZERO, 5.0), None);
    }
}
