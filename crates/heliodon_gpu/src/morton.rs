//! Neighbours in space, neighbours in memory.

use crate::hierarchy::usable;
use glam::Vec3;
use rayon::prelude::*;

/// Spreads the low 10 bits to every third.
fn spread(x: u32) -> u32 {
    let x = (x | x << 16) & 0x0300_00ff;
    let x = (x | x << 8) & 0x0300_f00f;
    let x = (x | x << 4) & 0x030c_30c3;
    (x | x << 2) & 0x0924_9249
}

/// The order of points along a Morton curve over the cube around them; those that are nowhere come last, and neighbours that look into other octants do not ask
/// together. Only speed depends on it.
pub(crate) fn order(points: &[Vec3], normals: &[Vec3]) -> Vec<u32> {
    let there = || points.iter().copied().filter(|&p| usable(p));
    let (low, high) = there().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
    let side = (high - low).max_element();
    let scale = if side > 0.0 { 1023.0 / side } else { 0.0 };
    let code = |(&p, n): (&Vec3, &Vec3)| {
        if !usable(p) {
            return (u32::MAX, 0);
        }
        let [x, y, z] = ((p - low) * scale).to_array().map(|c| spread(c as u32));
        let octant = u32::from(n.x < 0.0) | u32::from(n.y < 0.0) << 1 | u32::from(n.z < 0.0) << 2;
        let place = x | y << 1 | z << 2;
        // Of a cell in thirty-two along each axis all that look the same way stay together.
        (place >> 15, octant << 15 | place & 0x7fff)
    };
    let mut keyed: Vec<((u32, u32), u32)> = points.par_iter().zip(normals).map(code).zip(0..points.len() as u32).collect();
    keyed.par_sort_unstable();
    keyed.into_iter().map(|(_, i)| i).collect()
}
