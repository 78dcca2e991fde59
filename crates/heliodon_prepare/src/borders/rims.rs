//! Places at which a surface ends, or what it shares with others.

use crate::simplify::place_bits;
use crate::topology::mix;
use glam::Vec3;
use heliodon_mesh::Mesh;
use rayon::prelude::*;

/// No place that is asked for.
const NONE: u32 = u32::MAX;

/// Which of some places, given in order, lie at a rim: at an open border of the mesh (where, around a place, not every edge that comes in also goes out),
/// or at the rim of what these places are to the mesh, where a triangle has another corner besides. In surfaces that are not wound one way, more are taken
/// for such.
///
/// Why sums and not a table of edges: one pass over the triangles, and 9 bytes a place.
pub(super) fn rims(mesh: &Mesh, places: &[[u32; 3]]) -> Vec<[u32; 3]> {
    if places.is_empty() {
        return Vec::new();
    }
    let around = |(low, high): (Vec3, Vec3), place: &[u32; 3]| {
        let p = Vec3::from(place.map(f32::from_bits));
        (low.min(p), high.max(p))
    };
    let (low, high) = places.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), around);
    let number = |&p: &Vec3| {
        let near = low.cmple(p).all() && high.cmpge(p).all();
        let found = near.then(|| places.binary_search(&place_bits(p)).ok()).flatten();
        found.map_or(NONE, |number| number as u32)
    };
    let numbers: Vec<u32> = mesh.positions.par_iter().map(number).collect();
    let (mut balance, mut is_rim) = (vec![0_u64; places.len()], vec![false; places.len()]);
    for triangle in &mesh.triangles {
        let of = triangle.map(|v| numbers[v as usize]);
        if of == [NONE; 3] {
            continue;
        }
        // mixed, for sums of numbers in a row come out alike by chance
        let words = triangle.map(|v| mix(place_bits(mesh.positions[v as usize]).map(u64::from)));
        for (k, number) in of.into_iter().enumerate().filter(|&(_, number)| number != NONE) {
            let sum = &mut balance[number as usize];
            *sum = sum.wrapping_add(words[(k + 1) % 3]).wrapping_sub(words[(k + 2) % 3]);
            is_rim[number as usize] |= of.contains(&NONE);
        }
    }
    let rims = places.iter().zip(balance.into_iter().zip(is_rim));
    rims.filter(|&(_, (balance, is_rim))| is_rim || balance != 0).map(|(&place, _)| place).collect()
}
