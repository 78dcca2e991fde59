//! Small pictures of meshes with a colour at each vertex, without a GPU: what `visibility --animation` films.

use glam::{Mat4, Vec2, Vec3, Vec4};
use heliodon_image::SrgbImage;
use heliodon_math::color::srgb_from_linear;
use heliodon_math::frame::unit_or;
use rayon::prelude::*;

/// Samples along each side of a pixel.
const SAMPLES: u32 = 2;
/// Behind the mesh: a quiet grey-blue, linear.
const BEHIND: Vec3 = Vec3::new(0.16, 0.18, 0.21);
/// What was not drawn.
const NOTHING: (f32, Vec3) = (f32::NEG_INFINITY, BEHIND);

/// A camera that looks at a box from before and above, so that all of it is in the picture.
pub fn three_quarters((low, high): (Vec3, Vec3), (width, height): (u32, u32)) -> Mat4 {
    let (center, size) = ((low + high) * 0.5, low.distance(high).max(1e-6));
    let eye = center + unit_or(Vec3::new(0.55, 0.25, 1.0), Vec3::Z) * (1.35 * size);
    let project = Mat4::perspective_infinite_reverse_rh(0.75, width as f32 / height.max(1) as f32, 0.01 * size);
    project * Mat4::look_at_rh(eye, center, Vec3::Y)
}

/// Draws meshes from one camera.
#[derive(Default)]
pub struct Raster {
    clip_from_world: Mat4,
    width: u32,
    height: u32,
    samples: Vec<(f32, Vec3)>,
}

impl Raster {
    /// Pictures of so many pixels.
    pub fn new((width, height): (u32, u32), clip_from_world: Mat4) -> Self {
        let samples = vec![NOTHING; (width * height * SAMPLES * SAMPLES) as usize];
        Self { clip_from_world, width, height, samples }
    }

    /// The picture of triangles, both sides; `linear` is a colour for each position, clamped to what a display shows. What reaches behind the eye is left out.
    pub fn draw(&mut self, positions: &[Vec3], linear: &[Vec3], triangles: &[[u32; 3]]) -> SrgbImage {
        let across = self.width * SAMPLES;
        let half = Vec2::new(across as f32, (self.height * SAMPLES) as f32) * 0.5;
        let screen = |&p: &Vec3| {
            let clip: Vec4 = self.clip_from_world * p.extend(1.0);
            (clip.w > 1e-6).then(|| Vec3::new((clip.x / clip.w + 1.0) * half.x, (1.0 - clip.y / clip.w) * half.y, 1.0 / clip.w))
        };
        let screen: Vec<Option<Vec3>> = positions.par_iter().map(screen).collect();
        let rows = (self.height.div_ceil(rayon::current_num_threads() as u32) * SAMPLES) as usize;
        self.samples.par_chunks_mut(rows * across as usize).enumerate().for_each(|(band, samples)| {
            samples.fill(NOTHING);
            let top = (band * rows) as f32;
            for t in triangles {
                if let [Some(a), Some(b), Some(c)] = t.map(|i| screen[i as usize]) {
                    fill(samples, across as usize, top, [a, b, c], t.map(|i| linear[i as usize]));
                }
            }
        });
        let pixel = |k: u32| {
            let (x, y) = (k % self.width * SAMPLES, k / self.width * SAMPLES);
            let at = |i: u32| self.samples[((y + i / SAMPLES) * across + x + i % SAMPLES) as usize].1;
            let count = SAMPLES * SAMPLES;
            let mean = (0..count).map(|i| at(i).clamp(Vec3::ZERO, Vec3::ONE)).sum::<Vec3>() / count as f32;
            let [r, g, b] = mean.to_array().map(|v| (srgb_from_linear(v) * 255.0 + 0.5) as u8);
            [r, g, b, u8::MAX]
        };
        let pixels = (0..self.width * self.height).into_par_iter().map(pixel).collect();
        SrgbImage { width: self.width, height: self.height, pixels }
    }
}

/// Fills the samples of a band whose middles lie in a triangle, where it is nearest. Colours are linear over the triangle in space.
fn fill(samples: &mut [(f32, Vec3)], across: usize, top: f32, [a, b, c]: [Vec3; 3], colors: [Vec3; 3]) {
    let down = samples.len() / across;
    let (low, high) = (a.min(b).min(c), a.max(b).max(c));
    if high.x < 0.0 || low.x > across as f32 || high.y < top || low.y > top + down as f32 {
        return;
    }
    let cross = |p: Vec3, q: Vec3, x: f32, y: f32| (q.x - p.x) * (y - p.y) - (q.y - p.y) * (x - p.x);
    let whole = cross(a, b, c.x, c.y);
    if whole == 0.0 || !whole.is_finite() {
        return;
    }
    let range =
        |low: f32, high: f32, most: usize| (low.max(0.0) as usize).min(most - 1)..=(high.max(0.0) as usize).min(most - 1);
    for row in range(low.y - top, high.y - top, down) {
        for column in range(low.x, high.x, across) {
            let (x, y) = (column as f32 + 0.5, top + row as f32 + 0.5);
            let weights = [cross(b, c, x, y) / whole, cross(c, a, x, y) / whole, cross(a, b, x, y) / whole];
            let nearness = weights[0] * a.z + weights[1] * b.z + weights[2] * c.z;
            let sample = &mut samples[row * across + column];
            if weights.iter().all(|&w| w >= 0.0) && nearness > sample.0 {
                let color = colors[0] * (weights[0] * a.z) + colors[1] * (weights[1] * b.z) + colors[2] * (weights[2] * c.z);
                *sample = (nearness, color / nearness);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearer_triangle_is_seen_and_the_rest_is_behind() {
        let square = |z: f32, side: f32| {
            [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| Vec3::new(x * side, y * side, z))
        };
        let positions: Vec<Vec3> = square(0.0, 1.0).into_iter().chain(square(1.0, 0.5)).collect();
        let linear: Vec<Vec3> = [Vec3::X; 4].into_iter().chain([Vec3::Y; 4]).collect();
        let triangles = [[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]];
        let clip = Mat4::perspective_infinite_reverse_rh(1.0, 1.0, 0.1) * Mat4::look_at_rh(Vec3::Z * 4.0, Vec3::ZERO, Vec3::Y);
        let mut raster = Raster::new((64, 64), clip);
        for _ in 0..2 {
            let picture = raster.draw(&positions, &linear, &triangles);
            let at = |x: usize, y: usize| picture.pixels[y * 64 + x];
            assert_eq!(at(32, 32), [0, 255, 0, 255]);
            assert_eq!(at(32, 18), [255, 0, 0, 255]);
            assert_eq!(at(1, 1), at(62, 62));
            assert!(at(1, 1)[0] > 90 && at(1, 1)[0] < 120);
        }
    }

    #[test]
    fn the_camera_sees_all_of_the_box() {
        for (low, high) in
            [(Vec3::ZERO, Vec3::ONE), (Vec3::new(-1.0, 0.0, -9.0), Vec3::new(1.0, 3.0, 9.0)), (Vec3::ONE, Vec3::ONE)]
        {
            let clip = three_quarters((low, high), (1024, 768));
            for i in 0..8 {
                let pick = |bit: usize, a: f32, b: f32| if i & bit == 0 { a } else { b };
                let corner = Vec3::new(pick(1, low.x, high.x), pick(2, low.y, high.y), pick(4, low.z, high.z));
                let at = clip.project_point3(corner);
                assert!(at.x.abs() < 1.0 && at.y.abs() < 1.0, "{low} {high}: {at}");
            }
        }
    }
}
