//! Which triangles are divided because they are seen much: light that bounces off them is then known finely.
//!
//! A floor of a few large triangles may have no vertex in the patch of sunlight that lights the colonnade above it. A look around from
//! some of the points finds the triangles that fill their views, each hit weighed by how large the triangle shows from there,
//! and these are divided first, as long as the number of cells allows: into few cells with points of their own, and into many
//! patches that only the sun is asked for.

use crate::gather::for_each_direction;
use crate::{LightParams, PointSet, Surfaces, gather_directions};
use heliodon_rays::{NO_HIT, set_bits};
use rayon::prelude::*;
use std::ops::Range;
use std::sync::atomic::{AtomicU32, Ordering};

/// Points that look around together, neighbours in space.
const RUN: usize = 64;
/// Where there are more points than this, every so-maniest run looks,
const FEW_POINTS: usize = 1 << 16;
const RUN_STRIDE: usize = 4;
/// and no more than so many points in all: the weights of as many, all of one triangle, are the most that 32 bits hold.
const MOST_POINTS: usize = 1 << 20;
/// Directions that they look in, over the whole sphere.
const DIRECTIONS: u32 = 64;
/// The weight of a hit from as far as the triangle is long.
const UNIT_WEIGHT: f32 = 16.0;
/// The most that one hit weighs.
const MAX_WEIGHT: f32 = 64.0;
const _: () = assert!(MOST_POINTS as u64 * (DIRECTIONS as u64 - 1) * MAX_WEIGHT as u64 <= u32::MAX as u64);
/// Cells made so are at most this part of the vertices.
const CELLS_PER_VERTEX: f32 = 0.125;
/// The most parts of an edge.
const MAX_PARTS: u32 = 64;
/// Patches on which sunlight is told apart: at most one for this many rays of a vertex,
const SAMPLES_PER_PATCH: f32 = 32.0;
/// and never more for a vertex than this,
const PATCHES_PER_VERTEX: f32 = 16.0;
/// but as if there were at least so many vertices, for rooms of few triangles.
const LEAST_VERTICES: f32 = 16_384.0;
/// Half a gigabyte of patches for a day of 92 suns; beyond, every triangle has one.
const MOST_PATCHES: u64 = 1 << 25;

/// Into how many parts each edge of each triangle is divided to make cells, and what each fills of the views (see [`sight`]), empty
/// where no triangle is long enough to be divided; `longest` are the lengths of their longest edges, 0 for what is not to be divided,
/// and `finest_m` is the least length of a part. What they fill may be `known`.
pub(crate) fn cells_by_sight(
    surfaces: &Surfaces,
    longest: &[f32],
    finest_m: f32,
    params: &LightParams,
    known: Option<Vec<u32>>,
) -> (Vec<u32>, Vec<u32>) {
    let most = |&l: &f32| ((l / finest_m) as u32).clamp(1, MAX_PARTS);
    if longest.iter().all(|l| most(l) == 1) {
        return (vec![1; longest.len()], Vec::new());
    }
    let weights = known.filter(|known| known.len() == longest.len()).unwrap_or_else(|| sight(surfaces, longest, params));
    let limit = ((surfaces.positions.len() as f32 * CELLS_PER_VERTEX) as u64).min(params.max_sub_cells as u64);
    // a triangle that stays whole is a cell as it is
    let cells = parts(&weights, longest.iter().map(most), limit, |m| if m > 1 { m * m } else { 0 });
    (cells, weights)
}

/// The same for the patches on which sunlight is told apart, by the `weights` of [`sight`].
pub(crate) fn patches_by_sight(surfaces: &Surfaces, weights: &[u32], params: &LightParams) -> Vec<u32> {
    let per_vertex = (params.samples as f32 / SAMPLES_PER_PATCH).min(PATCHES_PER_VERTEX);
    let limit = ((surfaces.positions.len() as f32).max(LEAST_VERTICES) * per_vertex) as u64;
    let limit = limit.min(MOST_PATCHES);
    parts(weights, weights.iter().map(|_| MAX_PARTS), limit, |m| m * m)
}

/// The finest division in proportion to `weights` of which no more than `limit` pieces come, if any does; `pieces` of so many parts.
fn parts(weights: &[u32], most: impl Iterator<Item = u32> + Clone, limit: u64, pieces: impl Fn(u64) -> u64) -> Vec<u32> {
    let parts = |per_piece: u64| {
        let of = move |(&w, most): (&u32, u32)| (u64::from(w) / per_piece).isqrt().clamp(1, u64::from(most)) as u32;
        weights.iter().zip(most.clone()).map(of)
    };
    // the least weight of a piece that keeps within the limit; all weights together are a bound
    let (mut low, mut high) = (1, weights.iter().map(|&w| u64::from(w)).sum::<u64>() + 1);
    while low < high {
        let middle = low + (high - low) / 2;
        if parts(middle).map(|m| pieces(u64::from(m))).sum::<u64>() <= limit {
            high = middle;
        } else {
            low = middle + 1;
        }
    }
    parts(low).collect()
}

/// How much of the views of some points each triangle fills.
pub(crate) fn sight(surfaces: &Surfaces, longest: &[f32], params: &LightParams) -> Vec<u32> {
    let points = PointSet::at_vertices(surfaces, params.offset_m);
    let directions = gather_directions(DIRECTIONS, params.seed);
    // sums of whole numbers are the same in any order
    let weights: Vec<AtomicU32> = longest.iter().map(|_| AtomicU32::new(0)).collect();
    let look = |range: Range<usize>| {
        let (origins, normals) = points.run(range);
        for_each_direction(surfaces, origins, normals, directions.iter().copied(), |at| {
            for hit in set_bits(at.active).map(|point| &at.hits[point]).filter(|hit| hit.triangle != NO_HIT) {
                let shown = longest[hit.triangle as usize] / hit.t;
                let weight = (UNIT_WEIGHT * shown * shown).min(MAX_WEIGHT) as u32;
                weights[hit.triangle as usize].fetch_add(weight, Ordering::Relaxed);
            }
        });
    };
    let stride = if points.len() > FEW_POINTS { RUN_STRIDE.max(points.len().div_ceil(MOST_POINTS)) } else { 1 };
    let runs: Vec<Range<usize>> =
        (0..points.len()).step_by(RUN * stride).map(|first| first..(first + RUN).min(points.len())).collect();
    runs.into_par_iter().for_each(look);
    weights.into_iter().map(AtomicU32::into_inner).collect()
}
