//! What a photograph can see: whether a place is in it, how finely, and how near to the outline of something that stands before something else.

use super::surface::Surface;
use crate::camera::Camera;
use glam::{DVec2, DVec3, Vec3};
use heliodon_rays::{Hit, NO_HIT, Ray};
use rayon::prelude::*;

/// How a photograph shows a place.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shown {
    pub pixel: DVec2,
    /// Pixels for a metre of the surface, the geometric mean of both directions.
    pub px_per_m: f32,
    /// Cosine of the angle under which it is seen.
    pub cosine: f32,
}

/// The part of its distance by which a place is moved to see how its pixel moves.
const NUDGE: f64 = 1.0e-5;

/// How a camera shows a place of a surface that faces along `normal`, if nothing is in the way; none from behind or out of the picture.
pub(super) fn shown(camera: &Camera, place: Vec3, normal: Vec3) -> Option<Shown> {
    let (at, normal) = (place.as_dvec3(), normal.as_dvec3());
    let to_eye = camera.centre() - at;
    let distance = to_eye.length();
    let cosine = to_eye.dot(normal) / distance;
    if cosine.is_nan() || cosine <= 0.0 {
        return None;
    }
    let pixel = camera.project(at)?;
    let size = DVec2::new(f64::from(camera.intrinsics.width), f64::from(camera.intrinsics.height));
    if pixel.cmplt(DVec2::ZERO).any() || pixel.cmpgt(size).any() {
        return None;
    }
    let step = NUDGE * distance;
    let right = normal.any_orthonormal_vector();
    let along = |way: DVec3| camera.project(at + way * step).map(|moved| (moved - pixel) / step);
    let px2_per_m2 = along(right)?.perp_dot(along(normal.cross(right))?).abs();
    Some(Shown { pixel, px_per_m: px2_per_m2.sqrt() as f32, cosine: cosine as f32 })
}

/// A ray from off the surface to the camera, as long as 1.
pub(super) fn to_camera(camera: &Camera, place: Vec3, normal: Vec3, offset_m: f32) -> Ray {
    let origin = place + normal * offset_m;
    Ray { origin, direction: (camera.centre() - origin.as_dvec3()).as_vec3(), t_min: 0.0, t_max: 1.0 }
}

/// The most pixels of a map of outlines: a photograph of 24 megapixels gets one of half its width.
const MOST_PIXELS: f64 = 6.0e6;
/// A jump in depth is an outline if it is larger than this part of the depth ...
const JUMP: f64 = 0.003;
/// ... and than so many pixels are wide there: a slope is none.
const JUMP_PIXELS: f64 = 4.0;

/// What a pixel's ray met.
struct Met {
    along: Vec3,
    triangle: u32,
    t: f32,
}

impl Met {
    fn is_some(&self) -> bool {
        self.triangle != NO_HIT
    }
}

/// How far each pixel is from outlines, in pixels of the photograph.
pub(super) struct Outlines {
    scale: u32,
    width: usize,
    height: usize,
    /// From the pixels on both sides of an outline.
    away: Vec<f32>,
    /// For pixels right behind an outline, how far off the camera that is which stands before; infinite for all others.
    before_m: Vec<f32>,
    /// From where faces meet at an angle.
    creases: Vec<f32>,
    /// What a jump is to be larger than, as a part of the distance.
    jump: f64,
}

/// Next to an outline pixels mix what is on both its sides: the one that it runs through, and with it all that are interpolated from that.
const MIXED_PX: f32 = 1.5;

impl Outlines {
    pub fn new(camera: &Camera, surface: &Surface) -> Self {
        let lens = &camera.intrinsics;
        let pixels = f64::from(lens.width) * f64::from(lens.height);
        let scale = (pixels / MOST_PIXELS).sqrt().ceil().max(1.0) as u32;
        let (width, height) = (lens.width.div_ceil(scale) as usize, lens.height.div_ceil(scale) as usize);
        let centre = camera.centre();
        let rows: Vec<Vec<Met>> = (0..height)
            .into_par_iter()
            .map(|y| {
                let ray = |x: usize| {
                    let (origin, direction) = camera.ray((DVec2::new(x as f64, y as f64) + 0.5) * f64::from(scale));
                    Ray { origin: origin.as_vec3(), direction: direction.as_vec3(), t_min: 0.0, t_max: f32::INFINITY }
                };
                let rays: Vec<Ray> = (0..width).map(ray).collect();
                let mut hits = vec![Hit::MISS; width];
                surface.scene.closest(&rays, &mut hits);
                let met = |(ray, hit): (&Ray, &Hit)| Met { along: ray.direction, triangle: hit.triangle, t: hit.t };
                rays.iter().zip(&hits).map(met).collect()
            })
            .collect();
        let least = JUMP + JUMP_PIXELS * f64::from(scale) / lens.focal_px[0].min(lens.focal_px[1]);
        // how far along b's ray a's surface would be
        let beyond = |a: &Met, b: &Met| {
            let [p, q, r] = surface.corners(a.triangle)?.map(Vec3::as_dvec3);
            let normal = (q - p).cross(r - p);
            let t = normal.dot(p - centre) / normal.dot(b.along.as_dvec3());
            (t.is_finite() && t > 0.0).then_some(t)
        };
        // whether b is behind (1) or before (-1) a, or goes on from it (0)
        let jump = |a: &Met, b: &Met| -> i8 {
            match (a.is_some(), b.is_some()) {
                (false, false) => return 0,
                (true, false) => return 1,
                (false, true) => return -1,
                (true, true) if a.triangle == b.triangle => return 0,
                (true, true) => (),
            }
            let (at_a, at_b) = (f64::from(a.t), f64::from(b.t));
            let least = at_a.min(at_b) * least;
            let of_a = beyond(a, b).map_or(f64::INFINITY, |t| (t - at_b).abs());
            let of_b = beyond(b, a).map_or(f64::INFINITY, |t| (t - at_a).abs());
            if of_a.min(of_b).min((at_a - at_b).abs()) <= least { 0 } else { (at_b - at_a).signum() as i8 }
        };
        let seeds: Vec<Vec<(bool, bool, f32)>> = (0..height)
            .into_par_iter()
            .map(|y| {
                let of_pixel = |x: usize| {
                    let hit = &rows[y][x];
                    let around = [(x > 0).then(|| (x - 1, y)), (x + 1 < width).then_some((x + 1, y))];
                    let over = [(y > 0).then(|| (x, y - 1)), (y + 1 < height).then_some((x, y + 1))];
                    let mut seed = (false, false, f32::INFINITY);
                    for (nx, ny) in around.into_iter().chain(over).flatten() {
                        let neighbor = &rows[ny][nx];
                        let jump = jump(neighbor, hit);
                        seed.0 |= jump != 0;
                        if jump > 0 {
                            seed.2 = seed.2.min(neighbor.t);
                        }
                        let both = jump == 0 && hit.is_some() && neighbor.is_some();
                        seed.1 |= both && surface.is_crease(hit.triangle, neighbor.triangle);
                    }
                    seed
                };
                (0..width).map(of_pixel).collect()
            })
            .collect();
        let far = |seeds: &[bool]| {
            let mut away = distances(seeds, width, height);
            away.iter_mut().for_each(|d| *d *= scale as f32);
            away
        };
        let away = far(&seeds.iter().flatten().map(|seed| seed.0).collect::<Vec<bool>>());
        let creases = far(&seeds.iter().flatten().map(|seed| seed.1).collect::<Vec<bool>>());
        let before_m = seeds.into_iter().flatten().map(|seed| seed.2).collect();
        Self { scale, width, height, away, before_m, creases, jump: least }
    }

    fn cell(&self, pixel: DVec2) -> [usize; 2] {
        let cell = |x: f64, count: usize| ((x / f64::from(self.scale)).max(0.0) as usize).min(count - 1);
        [cell(pixel.x, self.width), cell(pixel.y, self.height)]
    }

    /// Whether a pixel is so near to where faces meet at an angle that it shows something of both.
    pub fn is_mixed(&self, pixel: DVec2) -> bool {
        let [x, y] = self.cell(pixel);
        self.creases[y * self.width + x] < MIXED_PX.max(self.scale as f32)
    }

    /// How many pixels are between a pixel and what an outline spoils, for what is so far off the camera: of what is behind the outline all within
    /// `edge_px`, of what is before only those that it runs through. Not above 0 where it is spoilt.
    pub fn clear_px(&self, pixel: DVec2, distance_m: f64, edge_px: f32) -> f32 {
        let [x, y] = self.cell(pixel);
        let away = self.away[y * self.width + x];
        let mixed = MIXED_PX.max(self.scale as f32);
        if away > edge_px.max(mixed) {
            return away - edge_px;
        }
        let reach = (edge_px / self.scale as f32).ceil() as usize;
        let rows = y.saturating_sub(reach)..(y + reach + 1).min(self.height);
        let columns = x.saturating_sub(reach)..(x + reach + 1).min(self.width);
        let mut is_behind = false;
        for row in rows {
            for column in columns.clone() {
                let before_m = f64::from(self.before_m[row * self.width + column]);
                let (dx, dy) = (column.abs_diff(x) as f32, row.abs_diff(y) as f32);
                let is_near = (dx * dx + dy * dy).sqrt() * self.scale as f32 <= edge_px;
                is_behind |= is_near && distance_m > before_m * (1.0 + self.jump);
            }
        }
        if is_behind { 0.0 } else { away - mixed }
    }
}

/// From each pixel's middle to the middle of the nearest seed, exactly (P. Felzenszwalb, D. Huttenlocher, "Distance Transforms of Sampled Functions",
/// Theory of Computing 8, 2012): along columns, then the lower envelope of parabolas along rows.
fn distances(seeds: &[bool], width: usize, height: usize) -> Vec<f32> {
    const FAR: f64 = 1.0e9;
    let mut squares = vec![FAR; width * height];
    for x in 0..width {
        let mut since = FAR;
        for y in 0..height {
            since = if seeds[y * width + x] { 0.0 } else { since + 1.0 };
            squares[y * width + x] = since;
        }
        since = FAR;
        for y in (0..height).rev() {
            since = if seeds[y * width + x] { 0.0 } else { since + 1.0 };
            let best = squares[y * width + x].min(since);
            squares[y * width + x] = if best >= FAR { FAR * FAR } else { best * best };
        }
    }
    let row = |row: &[f64]| -> Vec<f32> {
        let mut lowest: Vec<(usize, f64)> = Vec::with_capacity(width);
        for (q, &value) in row.iter().enumerate().filter(|(_, value)| **value < FAR * FAR) {
            let height_at = value + (q * q) as f64;
            loop {
                let Some(&(p, from)) = lowest.last() else {
                    lowest.push((q, f64::NEG_INFINITY));
                    break;
                };
                let crossing = (height_at - row[p] - (p * p) as f64) / (2.0 * (q - p) as f64);
                if crossing > from {
                    lowest.push((q, crossing));
                    break;
                }
                lowest.pop();
            }
        }
        if lowest.is_empty() {
            return vec![f32::INFINITY; width];
        }
        let mut k = 0;
        (0..width)
            .map(|x| {
                while k + 1 < lowest.len() && lowest[k + 1].1 < x as f64 {
                    k += 1;
                }
                let away = x as f64 - lowest[k].0 as f64;
                (row[lowest[k].0] + away * away).sqrt() as f32
            })
            .collect()
    };
    squares.par_chunks(width).flat_map_iter(row).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use heliodon_math::random::Pcg32;

    #[test]
    fn distances_are_those_to_the_nearest_seed() {
        let mut random = Pcg32::new(3, 3);
        let (width, height) = (37, 23);
        for part in [0.0, 0.002, 0.05, 0.5] {
            let seeds: Vec<bool> = (0..width * height).map(|_| random.next_f32() < part).collect();
            let found = distances(&seeds, width, height);
            for (i, found) in found.into_iter().enumerate() {
                let away = |j: usize| {
                    let (dx, dy) = ((i % width) as f64 - (j % width) as f64, (i / width) as f64 - (j / width) as f64);
                    dx.hypot(dy) as f32
                };
                let truth = (0..seeds.len()).filter(|&j| seeds[j]).map(away).fold(f32::INFINITY, f32::min);
                assert!(found == truth || (found - truth).abs() < 1e-4, "{found} {truth}");
            }
        }
    }
}
