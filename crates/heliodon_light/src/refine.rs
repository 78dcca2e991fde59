//! Which triangles are divided because they are seen much: light that bounces off them is then known finely.
//!
//! A floor of a few large triangles may have no vertex in the patch of sunlight that lights the colonnade above it. A look around from
//! some of the points finds the triangles that fill their views, each hit weighed by how large the triangle shows from there,
//! and these are divided first, as long as the number of cells allows.

use crate::gather::{bits, for_each_direction};
use crate::{LightParams, PointSet, Surfaces, gather_directions};
use heliodon_rays::NO_HIT;
use rayon::prelude::*;
use std::ops::Range;
use std::sync::atomic::{AtomicU32, Ordering};

/// Points that look around together, neighbours in space, and every how-maniest such run does.
const RUN: usize = 64;
const RUN_STRIDE: usize = 4;
/// Directions that they look in, over the whole sphere.
const DIRECTIONS: u32 = 64;
/// The weight of a hit from as far as the triangle is long.
const UNIT_WEIGHT: f32 = 16.0;
/// The most that one hit weighs.
const MAX_WEIGHT: f32 = 64.0;
/// Cells made so are at most this part of the vertices.
const CELLS_PER_VERTEX: f32 = 0.125;

/// Into how many parts each edge of each triangle is divided; `longest` are the lengths of their longest edges, 0 for what is not
/// to be divided, and `finest_m` is the least length of a part.
pub(crate) fn parts_by_sight(surfaces: &Surfaces, longest: &[f32], finest_m: f32, params: &LightParams) -> Vec<u32> {
    let most: Vec<u32> = longest.iter().map(|&l| ((l / finest_m) as u32).clamp(1, 64)).collect();
    if most.iter().all(|&m| m == 1) {
        return most;
    }
    let weights = sight(surfaces, longest, params);
    let parts = |per_cell: u64| {
        let of = move |(&w, &most): (&u32, &u32)| (u64::from(w) / per_cell).isqrt().clamp(1, u64::from(most)) as u32;
        weights.iter().zip(&most).map(of)
    };
    let cells = |per_cell: u64| parts(per_cell).filter(|&m| m > 1).map(|m| u64::from(m).pow(2)).sum::<u64>();
    let limit = ((surfaces.positions.len() as f32 * CELLS_PER_VERTEX) as u64).min(params.max_sub_cells as u64);
    // the least weight of a cell that keeps within the limit; all weights together are a bound
    let (mut low, mut high) = (1, weights.iter().map(|&w| u64::from(w)).sum::<u64>() + 1);
    while low < high {
        let middle = low + (high - low) / 2;
        if cells(middle) <= limit {
            high = middle;
        } else {
            low = middle + 1;
        }
    }
    parts(low).collect()
}

/// How much of the views of some points each triangle fills.
fn sight(surfaces: &Surfaces, longest: &[f32], params: &LightParams) -> Vec<u32> {
    let points = PointSet::at_vertices(surfaces, params.offset_m);
    let directions = gather_directions(DIRECTIONS, params.seed);
    // sums of whole numbers are the same in any order
    let weights: Vec<AtomicU32> = longest.iter().map(|_| AtomicU32::new(0)).collect();
    let look = |range: Range<usize>| {
        let (origins, normals) = points.run(range);
        for_each_direction(surfaces, origins, normals, directions.iter().copied(), |at| {
            for hit in bits(at.active).map(|point| &at.hits[point]).filter(|hit| hit.triangle != NO_HIT) {
                let shown = longest[hit.triangle as usize] / hit.t;
                let weight = (UNIT_WEIGHT * shown * shown).min(MAX_WEIGHT) as u32;
                weights[hit.triangle as usize].fetch_add(weight, Ordering::Relaxed);
            }
        });
    };
    let runs: Vec<Range<usize>> =
        (0..points.len()).step_by(RUN * RUN_STRIDE).map(|first| first..(first + RUN).min(points.len())).collect();
    runs.into_par_iter().for_each(look);
    weights.into_iter().map(AtomicU32::into_inner).collect()
}
