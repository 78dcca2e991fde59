//! The directions of a gather: one lattice on the sphere, the same for every point.
//!
//! Why one set and not random ones per point: the rays of all points in one direction are parallel, which the ray engine
//! answers several times as fast as scattered ones; neighbouring points err alike, so that no noise is seen between them; and
//! a lattice's error falls faster than the square root of its count. The price is that each direction draws the faint edge of
//! its own shadow, `2 / samples` of the light at most.

use glam::{Mat3, Quat, Vec3};
use heliodon_math::random::{hash2_u32, unit_f32};
use heliodon_math::sphere::fibonacci_sphere;
use std::f32::consts::TAU;

/// `count` even directions, turned as a whole by a rotation that `seed` picks.
#[must_use]
pub fn gather_directions(count: u32, seed: u32) -> Vec<Vec3> {
    let turn = rotation(seed);
    fibonacci_sphere(count).into_iter().map(|d| turn * d).collect()
}

/// A rotation drawn evenly from all rotations (K. Shoemake: "Uniform Random Rotations", Graphics Gems III, 1992).
fn rotation(seed: u32) -> Mat3 {
    let [a, b, c] = [1, 2, 3].map(|k| unit_f32(hash2_u32(seed, k)));
    let (r1, r2) = ((1.0 - a).sqrt(), a.sqrt());
    let (t1, t2) = (TAU * b, TAU * c);
    Mat3::from_quat(Quat::from_xyzw(r1 * libm::sinf(t1), r1 * libm::cosf(t1), r2 * libm::sinf(t2), r2 * libm::cosf(t2)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turned_directions_stay_units_and_even() {
        for seed in 0..4 {
            let d = gather_directions(512, seed);
            assert!(d.iter().all(|d| (d.length() - 1.0).abs() < 1e-5));
            // a lattice of n points integrates the linear functions to about 1/n
            assert!((d.iter().sum::<Vec3>() / 512.0).length() < 2.0 / 512.0);
        }
        assert_ne!(gather_directions(16, 0), gather_directions(16, 1));
    }
}
