//! Measuring a small bright disc before a sky that varies.

use super::SUN_RADIUS_DEG;
use crate::mapping::Geometry;
use crate::probe::Probe;
use glam::{DVec2, DVec3, Vec3};

/// Looks into a pixel are this many across: pixels of a mirror ball's rim or of a lat-long map's pole are long.
const LOOKS: u32 = 4;

/// How far around the peak pixels are gathered.
const PATCH_RADIUS_DEG: f64 = 9.0;

/// A pixel near the peak.
pub(crate) struct Element {
    pub index: u32,
    pub solid_angle: f64,
    pub color: DVec3,
    pub luminance: f64,
    /// Directions that lie evenly over the pixel.
    pub looks: [DVec3; (LOOKS * LOOKS) as usize],
    /// Their mean, a unit vector.
    pub middle: DVec3,
}

impl Element {
    /// The sides along the image's rows and columns.
    fn sides(&self) -> [DVec3; 2] {
        let last = LOOKS as usize - 1;
        [last, last * LOOKS as usize].map(|end| (self.looks[end] - self.looks[0]) * (f64::from(LOOKS) / f64::from(LOOKS - 1)))
    }

    /// The longer side: pixels of a mirror ball's rim and of a lat-long map's pole are long and narrow.
    fn long_side(&self) -> DVec3 {
        let [across, down] = self.sides();
        if across.length() > down.length() { across } else { down }
    }
}

/// The surroundings of the brightest pixel.
pub(crate) struct Patch {
    pub elements: Vec<Element>,
    pub peak: f64,
    peak_direction: DVec3,
}

/// What was measured.
pub(super) struct Measured {
    pub direction: DVec3,
    pub irradiance: DVec3,
    /// Half-angle of the aperture's disc, in radians.
    pub radius: f64,
    /// Median luminance of the ring.
    pub ring: f64,
    pub replaced: Vec<(u32, Vec3)>,
}

/// The angle between unit vectors, exact for small ones.
pub(crate) fn angle(a: DVec3, b: DVec3) -> f64 {
    2.0 * libm::asin((0.5 * (a - b).length()).min(1.0))
}

fn luminance(c: DVec3) -> f64 {
    0.2126 * c.x + 0.7152 * c.y + 0.0722 * c.z
}

/// `a + b angle` of the logarithm of radiance.
struct Behind {
    intercept: DVec3,
    slope: DVec3,
}

impl Behind {
    fn at(&self, angle: f64) -> DVec3 {
        (self.intercept + self.slope * angle).map(libm::exp)
    }
}

impl Patch {
    pub(crate) fn gather(probe: &Probe, peak_direction: DVec3, peak: f64) -> Self {
        let geometry = probe.geometry();
        let (grid, image) = (probe.grid(), probe.image());
        let near = libm::cos(PATCH_RADIUS_DEG.to_radians()) as f32;
        let towards = peak_direction.as_vec3();
        let mut elements = Vec::new();
        for (index, (direction, &solid_angle)) in grid.directions().iter().zip(grid.solid_angles()).enumerate() {
            if solid_angle == 0.0 || direction.dot(towards) < near {
                continue;
            }
            let (x, y) = (index as u32 % image.width, index as u32 / image.width);
            let looks = std::array::from_fn(|k| {
                let at = |k: u32| (f64::from(k) + 0.5) / f64::from(LOOKS);
                let k = k as u32;
                geometry.direction_drawn_in(f64::from(x) + at(k % LOOKS), f64::from(y) + at(k / LOOKS))
            });
            let mean: DVec3 = geometry.pixel_nodes(x, y).iter().map(|&(d, share)| d * share).sum();
            let color = image.pixels[index].as_dvec3();
            elements.push(Element {
                index: index as u32,
                solid_angle: f64::from(solid_angle),
                color,
                luminance: luminance(color),
                looks,
                middle: mean.try_normalize().unwrap_or(direction.as_dvec3()),
            });
        }
        Self { elements, peak, peak_direction }
    }

    /// Measures the disc; `None` where what is bright is larger than `max_radius_deg`.
    pub(super) fn measure(&self, geometry: &Geometry, max_radius_deg: f64) -> Option<Measured> {
        let max_radius = max_radius_deg.to_radians();
        let ring = self.median_luminance(self.peak_direction, 5.0_f64.to_radians(), PATCH_RADIUS_DEG.to_radians());
        let half = ring + 0.5 * (self.peak - ring);
        let bright = || self.elements.iter().filter(|e| e.luminance > half);
        // everything that is brighter than half belongs to one small spot
        if bright().any(|e| angle(e.middle, self.peak_direction) > 2.0 * max_radius) {
            return None;
        }
        let mut direction =
            bright().map(|e| e.middle * (e.solid_angle * (e.luminance - ring))).sum::<DVec3>().try_normalize()?;
        let core = bright().map(|e| angle(e.middle, direction)).fold(0.0, f64::max);
        if core > max_radius {
            return None;
        }
        // half a pixel more: what the sun grazes belongs to it, and would spoil the fit of the sky behind
        let pixel = bright().map(|e| e.long_side().length()).fold(0.0, f64::max).min(1.5_f64.to_radians());
        let radius = core.max(SUN_RADIUS_DEG.to_radians()) + 0.5 * pixel + 0.03_f64.to_radians();
        let mut result = None;
        for _ in 0..6 {
            let (irradiance, moment, replaced) = self.photometry(direction, radius);
            let next = moment.try_normalize()?;
            let moved = angle(next, direction);
            direction = next;
            result = Some((irradiance, replaced));
            if moved < 1e-7 {
                break;
            }
        }
        let (irradiance, replaced) = result?;
        let direction = if core < 2.0 * SUN_RADIUS_DEG.to_radians() + pixel {
            self.refined(geometry, direction, radius)
        } else {
            direction
        };
        Some(Measured { direction, irradiance, radius, ring, replaced })
    }

    /// Irradiance, first moment (solid angle times luminance above the sky behind, times direction), and the pixels without the
    /// sun, of the aperture about `direction`.
    fn photometry(&self, direction: DVec3, radius: f64) -> (DVec3, DVec3, Vec<(u32, Vec3)>) {
        let touches = |e: &Element| e.looks.iter().any(|&look| angle(look, direction) <= radius);
        let (inside, outside): (Vec<&Element>, Vec<&Element>) = self.elements.iter().partition(|e| touches(e));
        let behind = fit_behind(&outside, direction, radius);
        let mut irradiance = DVec3::ZERO;
        let mut moment = DVec3::ZERO;
        let mut replaced = Vec::with_capacity(inside.len());
        for e in inside {
            let sky = e.looks.iter().map(|&look| behind.at(angle(look, direction))).sum::<DVec3>() / e.looks.len() as f64;
            let above = e.color - sky;
            // ground before the sun's foot is darker than the sky behind it
            let above = if e.middle.y < 0.0 { above.max(DVec3::ZERO) } else { above };
            irradiance += above * e.solid_angle;
            moment += e.middle * (e.solid_angle * luminance(above).max(0.0));
            replaced.push((e.index, e.color.min(sky).as_vec3()));
        }
        (irradiance.max(DVec3::ZERO), moment, replaced)
    }

    /// The place of a sharp disc of the sun's size that explains the aperture's pixels best, by least squares, if it explains them well; else
    /// `direction`. The centroid of pixels' middles errs by up to half a pixel's excess over the sun where pixels are larger.
    fn refined(&self, geometry: &Geometry, direction: DVec3, radius: f64) -> DVec3 {
        let touches = |e: &&Element| e.looks.iter().any(|&look| angle(look, direction) <= radius);
        let outside: Vec<&Element> = self.elements.iter().filter(|e| !touches(e)).collect();
        let behind = fit_behind(&outside, direction, radius);
        let spots: Vec<Spot> =
            self.elements.iter().filter(touches).map(|e| Spot::new(e, geometry, &behind, direction)).collect();
        let whole: f64 = spots.iter().map(|s| s.value * s.value).sum();
        // along the longer side of the brightest pixel and across it: what is told ill and what is told well
        let brightest = self.elements.iter().filter(touches).max_by(|a, b| a.luminance.total_cmp(&b.luminance));
        let Some(right) = brightest.and_then(|e| e.long_side().reject_from(direction).try_normalize()) else {
            return direction;
        };
        let up = direction.cross(right);
        let at = |x: f64, y: f64| (direction + right * x + up * y).try_normalize().unwrap_or(direction);
        let misfit = |x: f64, y: f64| {
            let sun = at(x, y);
            let covered: Vec<f64> = spots.iter().map(|s| s.covered(sun)).collect();
            let squares: f64 = covered.iter().map(|c| c * c).sum();
            let along: f64 = covered.iter().zip(&spots).map(|(c, s)| c * s.value).sum();
            // the best amplitude is along / squares
            if squares > 0.0 { whole - along * along / squares } else { whole }
        };
        // A long pixel that holds nearly all of the disc explains it nearly as well anywhere along it; the neighbour that a sliver of it touches tells
        // where. That valley is narrow, so it is looked for before anything is followed downhill.
        let narrow = 0.02_f64.to_radians();
        let reach = (radius / narrow) as i32;
        let (mut best, mut x) = (-reach..=reach)
            .map(|k| (f64::from(k) * narrow, k.abs()))
            .map(|(x, off)| (misfit(x, 0.0), off, x))
            .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))
            .map_or((whole, 0.0), |found| (found.0, found.2));
        let mut y = 0.0;
        let mut step = 0.15_f64.to_radians();
        while step > 0.002_f64.to_radians() {
            // in the corners too: a slanted pixel makes a slanted valley
            let tries = (0..9).map(|k| (step * f64::from(k % 3 - 1), step * f64::from(k / 3 - 1)));
            let better = tries
                .map(|(dx, dy)| (misfit(x + dx, y + dy), x + dx, y + dy))
                .min_by(|a, b| a.0.total_cmp(&b.0))
                .filter(|found| found.0 < best - 1e-6 * whole);
            match better {
                Some(found) if libm::hypot(found.1, found.2) < radius => (best, x, y) = found,
                _ => step *= 0.5,
            }
        }
        if best >= 0.02 * whole {
            return direction;
        }
        // Where one pixel holds all of the disc (pixels of a mirror ball's rim are degrees long), many places along it explain it as well: the
        // middle of them errs least.
        let step = 0.005_f64.to_radians();
        for axis in [DVec2::X, DVec2::Y, DVec2::X] {
            let reach = |sign: f64| {
                let as_good =
                    |k: f64| misfit(x + sign * k * step * axis.x, y + sign * k * step * axis.y) <= best + 2e-5 * whole;
                let mut steps = 0.0;
                while steps * step < radius && as_good(steps + 1.0) {
                    steps += 1.0;
                }
                steps
            };
            let middle = 0.5 * (reach(1.0) - reach(-1.0)) * step;
            (x, y) = (x + axis.x * middle, y + axis.y * middle);
        }
        at(x, y)
    }

    fn median_luminance(&self, about: DVec3, from: f64, to: f64) -> f64 {
        let mut values: Vec<f64> = self
            .elements
            .iter()
            .filter(|e| e.middle.y > -0.01 && (from..=to).contains(&angle(e.middle, about)))
            .map(|e| e.luminance)
            .collect();
        if values.is_empty() {
            return 0.0;
        }
        values.sort_by(f64::total_cmp);
        values[values.len() / 2]
    }
}

/// A pixel of the aperture, for fitting a disc.
struct Spot {
    /// Luminance above the sky behind.
    value: f64,
    looks: Vec<DVec3>,
}

impl Spot {
    fn new(e: &Element, geometry: &Geometry, behind: &Behind, sun: DVec3) -> Self {
        // a look every 0.02 degrees along each side, as far as that is many
        let [across, down] = e.sides().map(|side| ((side.length().to_degrees() / 0.02) as u32).clamp(12, 256));
        let (x, y) = (f64::from(e.index % geometry.width()), f64::from(e.index / geometry.width()));
        let at = |k: u32, of: u32| (f64::from(k) + 0.5) / f64::from(of);
        let look = |k: u32| geometry.direction_drawn_in(x + at(k % across, across), y + at(k / across, down));
        let looks = (0..across * down).map(look).collect();
        Self { value: e.luminance - luminance(behind.at(angle(e.middle, sun))), looks }
    }

    /// The part of the pixel that a disc of the sun's size covers; its edge is as soft as the looks are apart.
    fn covered(&self, sun: DVec3) -> f64 {
        let radius = SUN_RADIUS_DEG.to_radians();
        let soft = 0.02_f64.to_radians();
        let sum: f64 = self.looks.iter().map(|&look| (0.5 + (radius - angle(look, sun)) / (2.0 * soft)).clamp(0.0, 1.0)).sum();
        sum / self.looks.len() as f64
    }
}

/// Fits the sky behind by least squares, weighted with solid angle, in the narrowest ring about the aperture that holds enough pixels.
fn fit_behind(outside: &[&Element], direction: DVec3, radius: f64) -> Behind {
    const ENOUGH: usize = 24;
    let above = |e: &&Element| e.middle.y > -0.002 || direction.y < 0.0;
    let mut ring: Vec<(f64, &Element)> =
        outside.iter().copied().filter(above).map(|e| (angle(e.middle, direction), e)).collect();
    ring.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.index.cmp(&b.1.index)));
    let width = (3.0 * radius).max(1.5_f64.to_radians());
    let count = ring.partition_point(|(d, _)| *d < radius + width).max(ENOUGH.min(ring.len()));
    ring.truncate(count);
    let floor = ring.iter().map(|(_, e)| e.color.max_element()).fold(0.0, f64::max) * 1e-6 + 1e-30;
    let (mut w, mut wx, mut wxx) = (0.0, 0.0, 0.0);
    let (mut wy, mut wxy) = (DVec3::ZERO, DVec3::ZERO);
    for (_, e) in &ring {
        let x = angle(e.middle, direction);
        let y = e.color.max(DVec3::splat(floor)).map(libm::log);
        w += e.solid_angle;
        wx += e.solid_angle * x;
        wxx += e.solid_angle * x * x;
        wy += y * e.solid_angle;
        wxy += y * (e.solid_angle * x);
    }
    if w <= 0.0 {
        return Behind { intercept: DVec3::splat(libm::log(floor)), slope: DVec3::ZERO };
    }
    let spread = wxx - wx * wx / w;
    // never rising outward: that is a cloud's edge or the ground, not the aureole; and not steeper than tenfold a degree
    let steepest = -10.0_f64.ln().max(0.0) * 1.0_f64.to_degrees();
    let slope = if spread > 1e-12 * w { (wxy - wy * (wx / w)) / spread } else { DVec3::ZERO };
    let slope = slope.clamp(DVec3::splat(steepest), DVec3::ZERO);
    Behind { intercept: (wy - slope * wx) / w, slope }
}
