//! How much of the sky a model leaves to its own vertices.

use super::fit::Poses;
use glam::Vec3;
use heliodon_math::random::{hash_u32, unit_f32};
use heliodon_math::sphere::sample_cosine_hemisphere;
use heliodon_mesh::Mesh;
use heliodon_rays::{BuildParams, Ray, TriangleScene};
use rayon::prelude::*;

/// Vertices that are asked for at once.
const BLOCK: usize = 256;

/// Asks `rays` rays of each vertex of each frame, spread by the cosine.
pub fn fill(mesh: &Mesh, poses: &mut Poses, rays: u32) {
    let reach = 2.0 * poses.radius_m;
    for frame in &mut poses.frames {
        // A frame that no scene can be built of is as open as can be.
        let Ok(scene) = TriangleScene::build(&frame.positions, &mesh.triangles, &BuildParams::default()) else { continue };
        let offset = scene.start_offset();
        let (positions, normals) = (&frame.positions, &frame.normals);
        frame.openness = vec![1.0; positions.len()];
        frame.openness.par_chunks_mut(BLOCK).enumerate().for_each(|(block, openness)| {
            let first = block * BLOCK;
            let of = |i: usize| -> Vec<Ray> {
                let normal = normals[first + i];
                let turn = unit_f32(hash_u32((first + i) as u32));
                let ray = |k: u32| {
                    let u = [(k as f32 + 0.5) / rays as f32, (radical_inverse(k) + turn).fract()];
                    let direction = sample_cosine_hemisphere(normal, u);
                    Ray { origin: positions[first + i] + normal * offset, direction, t_min: offset, t_max: reach }
                };
                (0..rays).map(ray).collect()
            };
            let asked: Vec<Ray> = (0..openness.len()).flat_map(of).collect();
            let mut occluded = vec![0; asked.len().div_ceil(64)];
            scene.occluded(&asked, &mut occluded);
            for (i, openness) in openness.iter_mut().enumerate() {
                let hidden =
                    (0..rays as usize).map(|k| i * rays as usize + k).filter(|ray| occluded[ray / 64] >> (ray % 64) & 1 == 1);
                *openness = 1.0 - hidden.count() as f32 / rays as f32;
            }
        });
    }
}

/// Van der Corput's sequence.
fn radical_inverse(k: u32) -> f32 {
    unit_f32(k.reverse_bits())
}

/// What a place between three vertices has.
pub fn between(openness: &[f32], corners: [u32; 3], weights: Vec3) -> f32 {
    if openness.is_empty() {
        return 1.0;
    }
    let at = Vec3::from(corners.map(|vertex| openness[vertex as usize]));
    at.dot(weights)
}
