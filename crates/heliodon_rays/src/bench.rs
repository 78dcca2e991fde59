//! The sun-mask benchmark: one occlusion ray for each vertex that faces each sun.

use std::time::{Duration, Instant};

use glam::Vec3;
use heliodon_math::frame::unit_or;
use rayon::prelude::*;

use crate::{TriangleScene, beam_order};

/// What [`sun_rays`] measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SunRays {
    /// Rays asked: pairs of vertex and sun with n.l > 0.
    pub rays: u64,
    /// Of these, how many met something.
    pub occluded: u64,
    /// Time for all of them, without building the scene and ordering its vertices.
    pub elapsed: Duration,
}

impl SunRays {
    /// Million rays a second.
    pub fn mrays_per_second(&self) -> f64 {
        self.rays as f64 * 1e-6 / self.elapsed.as_secs_f64().max(1e-9)
    }
}

/// Directions to the sun over an equinox day at 38 degrees north, from 10 to 170 degrees of its arc.
pub fn equinox_suns(count: usize) -> Vec<Vec3> {
    let (sin_tilt, cos_tilt) = libm::sincos(38.0_f64.to_radians());
    (0..count)
        .map(|step| {
            let (sin, cos) = libm::sincos((10.0 + 160.0 * step as f64 / (count.max(2) - 1) as f64).to_radians());
            Vec3::new(cos as f32, (sin * cos_tilt) as f32, (sin * sin_tilt) as f32)
        })
        .collect()
}

/// Asks the scene for the shadows of all suns at all positions, starting `offset` along the normals, on the current rayon
/// pool. `positions` and `normals` (units) are the vertices'.
///
/// # Panics
/// If there is not one normal for each position.
pub fn sun_rays(scene: &TriangleScene, positions: &[Vec3], normals: &[Vec3], suns: &[Vec3], offset: f32) -> SunRays {
    const BLOCK: usize = 512;
    let order = beam_order(positions, Some(normals));
    let normals: Vec<Vec3> = order.iter().map(|&i| unit_or(normals[i as usize], Vec3::ZERO)).collect();
    let origins: Vec<Vec3> = order.iter().zip(&normals).map(|(&i, &n)| positions[i as usize] + offset * n).collect();
    let start = Instant::now();
    let (rays, occluded) = origins
        .par_chunks(BLOCK)
        .zip(normals.par_chunks(BLOCK))
        .map(|(origins, normals)| {
            let words = origins.len().div_ceil(64);
            let mut active = vec![0u64; words * suns.len()];
            let mut bits = active.clone();
            let count = |bits: &[u64]| bits.iter().map(|b| u64::from(b.count_ones())).sum::<u64>();
            for (sun, active) in suns.iter().zip(active.chunks_mut(words)) {
                for (i, normal) in normals.iter().enumerate() {
                    active[i / 64] |= u64::from(normal.dot(*sun) > 0.0) << (i % 64);
                }
            }
            scene.occluded_fan(origins, suns, &active, &mut bits);
            (count(&active), count(&bits))
        })
        .reduce(|| (0, 0), |a, b| (a.0 + b.0, a.1 + b.1));
    SunRays { rays, occluded, elapsed: start.elapsed() }
}
