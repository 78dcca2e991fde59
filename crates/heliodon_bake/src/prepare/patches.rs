//! Patches of a part that stand for all of it: what is done to them is timed and counted, and all of the part is reckoned from it.

use super::part::Grain;
use crate::estimate::largest_texture_bytes;
use glam::Vec3;
use heliodon_mesh::Mesh;
use heliodon_prepare::split::{SplitError, split};
use rayon::prelude::*;
use std::collections::HashMap;

/// Patches of a part, in balls around triangles that are spread over it by how many pieces splitting makes of them.
const PATCHES: usize = 8;
/// Triangles of a patch once it is split.
const PATCH_TRIANGLES: f64 = 12_000.0;
/// Triangles of a part, evenly spread over its files, that tell where its others are and what splitting makes of them.
const SAMPLE: usize = 16_384;
/// The least part of a patch that is taken to lie within.
const LEAST_INNER: f64 = 0.02;
/// The most triangles that splitting may make of these.
const MOST_PIECES: usize = 4_000_000;

/// What is known of a part before it is prepared.
#[derive(Debug, Default)]
pub(super) struct Looked {
    /// Triangles in its files.
    pub triangles: f64,
    /// Triangles after splitting.
    pub original: f64,
    /// How many times longer than asked for splitting lets its edges be.
    pub times_split: f64,
    /// Vertices after splitting.
    pub vertices: f64,
    /// Bytes of a vertex with all its attributes, and of a triangle.
    pub vertex_bytes: f64,
    pub triangle_bytes: f64,
    /// Bytes of its textures, each a pixel's four.
    pub texture_bytes: f64,
    pub largest_texture_bytes: u64,
    /// Patches as splitting leaves them.
    pub patches: Vec<Mesh>,
    /// Whether solids of it are united.
    pub unites: bool,
    /// Whether it gives way before others where there are too many triangles.
    pub is_ground: bool,
    /// Bytes of its files, and what reading them took.
    pub file_bytes: u64,
    pub reading_s: f64,
}

impl Looked {
    /// Bytes of the part's mesh over so many triangles.
    pub fn mesh_bytes(&self, triangles: f64) -> f64 {
        triangles * (self.triangle_bytes + self.vertex_bytes * self.vertices / self.original.max(1.0))
    }
}

/// Triangles of a patch but for those that its rim needs: a rim of so many edges takes as many triangles whatever lies within (Euler), and all of a part
/// has hardly any.
pub(super) fn inner_triangles(patch: &Mesh) -> f64 {
    let mut points: HashMap<[u32; 3], u32> = HashMap::new();
    let of: Vec<u32> = patch
        .positions
        .iter()
        .map(|p| {
            let next = points.len() as u32;
            *points.entry(p.to_array().map(f32::to_bits)).or_insert(next)
        })
        .collect();
    let mut edges: HashMap<(u32, u32), u32> = HashMap::new();
    for triangle in &patch.triangles {
        let [a, b, c] = triangle.map(|vertex| of[vertex as usize]);
        for (from, to) in [(a, b), (b, c), (c, a)] {
            *edges.entry((from.min(to), from.max(to))).or_default() += 1;
        }
    }
    let rim = edges.values().filter(|&&sides| sides == 1).count() as f64;
    let all = patch.triangles.len() as f64;
    (all - rim).max(LEAST_INNER * all)
}

/// Looks at a part that was read; `grain` says how it is split, if it is.
pub(super) fn look(mesh: &Mesh, grain: Option<&Grain>) -> Looked {
    let all = mesh.triangles.len();
    let sample: Vec<u32> = (0..all as u32).step_by(all.div_ceil(SAMPLE).max(1)).collect();
    let split_of = split_of(mesh, &sample, grain);
    let longest_m = |place, along| match grain {
        Some(grain) => split_of.times_longer * grain.longest_m(place, along),
        None => f32::INFINITY,
    };
    let weights: Vec<f64> = sample.iter().map(|&t| pieces(mesh.corners(t as usize), &longest_m)).collect();
    let patches = balls(mesh, &sample, &weights).into_iter().map(|triangles| {
        let (mut patch, _) = mesh.with_triangles(&triangles);
        // a patch that comes out too large is taken as it is
        let _ = split(&mut patch, longest_m, MOST_PIECES);
        patch
    });
    let patches: Vec<Mesh> = patches.collect();
    let per_vertex = |there: bool, bytes: usize| if there { bytes as f64 } else { 0.0 };
    let original = all as f64 * split_of.pieces;
    Looked {
        triangles: all as f64,
        original,
        times_split: f64::from(split_of.times_longer),
        // pieces share their corners as a grid's triangles do
        vertices: mesh.positions.len() as f64 + 0.5 * (original - all as f64),
        vertex_bytes: size_of::<Vec3>() as f64
            + per_vertex(!mesh.normals.is_empty(), size_of::<Vec3>())
            + per_vertex(!mesh.uvs.is_empty(), size_of::<glam::Vec2>())
            + per_vertex(!mesh.colors_linear.is_empty(), size_of::<Vec3>()),
        triangle_bytes: size_of::<[u32; 3]>() as f64 + per_vertex(!mesh.triangle_material.is_empty(), size_of::<u16>()),
        texture_bytes: mesh.texture_bytes() as f64,
        largest_texture_bytes: largest_texture_bytes(mesh),
        patches,
        ..Looked::default()
    }
}

/// What splitting makes of a part.
struct SplitOf {
    /// Of each triangle, in the mean.
    pieces: f64,
    /// How many times longer than asked for edges may be, so that it is not too many.
    times_longer: f32,
}

/// Splits the sample as all of the part would be.
fn split_of(mesh: &Mesh, sample: &[u32], grain: Option<&Grain>) -> SplitOf {
    let nothing = SplitOf { pieces: 1.0, times_longer: 1.0 };
    let Some(grain) = grain.filter(|_| !sample.is_empty()) else { return nothing };
    let (some, _) = mesh.with_triangles(sample);
    let share = sample.len() as f64 / mesh.triangles.len() as f64;
    let made = grain.fit(|times, most| -> Result<f64, SplitError> {
        let longest_m = |place, along| times * grain.longest_m(place, along);
        let most = ((most as f64 * share) as usize).min(MOST_PIECES);
        match split(&mut some.clone(), longest_m, most) {
            Ok(report) => Ok(report.triangles_after as f64),
            // splitting itself would not refuse so many: they are reckoned from lengths
            Err(_) if most == MOST_PIECES => Ok((0..some.triangles.len()).map(|t| pieces(some.corners(t), &longest_m)).sum()),
            Err(error) => Err(error),
        }
    });
    made.map_or(nothing, |(made, times_longer)| SplitOf { pieces: made / sample.len() as f64, times_longer })
}

/// About how many pieces are made of a triangle: so many as its two longest edges are too long, each.
fn pieces(corners: [Vec3; 3], longest_m: &impl Fn(Vec3, Vec3) -> f32) -> f64 {
    let mut times = [0, 1, 2].map(|i| {
        let (a, b) = (corners[i], corners[(i + 1) % 3]);
        f64::from(a.distance(b) / longest_m(0.5 * (a + b), b - a)).max(1.0)
    });
    times.sort_by(f64::total_cmp);
    times[1] * times[2]
}

/// For each patch its triangles.
fn balls(mesh: &Mesh, sample: &[u32], weights: &[f64]) -> Vec<Vec<u32>> {
    let center = |t: u32| mesh.corners(t as usize).iter().sum::<Vec3>() / 3.0;
    let centers: Vec<Vec3> = sample.iter().map(|&t| center(t)).collect();
    // each of the sample stands for so many
    let stands_for = mesh.triangles.len() as f64 / sample.len().max(1) as f64;
    let all: f64 = weights.iter().sum();
    let seed = |k: usize| {
        let mut left = (k as f64 + 0.5) / PATCHES as f64 * all;
        weights.iter().position(|weight| {
            left -= weight;
            left <= 0.0
        })
    };
    let mut seeds: Vec<usize> = (0..PATCHES).filter_map(seed).collect();
    seeds.dedup();
    let ball = |seed: usize| {
        let mut near: Vec<(f32, f64)> =
            centers.iter().zip(weights).map(|(c, &weight)| (c.distance_squared(centers[seed]), weight)).collect();
        near.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut held = 0.0;
        let last = near.iter().position(|(_, weight)| {
            held += weight * stands_for;
            held >= PATCH_TRIANGLES
        });
        let last = last.unwrap_or(near.len() - 1);
        // the ball of one alone reaches half way to the next
        let radius_squared = if last == 0 { near.get(1).map_or(0.0, |next| 0.25 * next.0) } else { near[last].0 };
        (0..mesh.triangles.len() as u32)
            .into_par_iter()
            .filter(|&t| center(t).distance_squared(centers[seed]) <= radius_squared)
            .collect()
    };
    seeds.into_iter().map(ball).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rim_s_triangles_are_not_a_part_s() {
        let plate = |side: u32| {
            let at = |i: u32| Vec3::new((i % (side + 1)) as f32, (i / (side + 1)) as f32, 0.0);
            let squares = (0..side * side).map(|i| i / side * (side + 1) + i % side);
            Mesh {
                positions: (0..(side + 1) * (side + 1)).map(at).collect(),
                triangles: squares.flat_map(|v| [[v, v + 1, v + side + 2], [v, v + side + 2, v + side + 1]]).collect(),
                ..Mesh::default()
            }
        };
        assert_eq!(inner_triangles(&plate(10)), 200.0 - 40.0);
        assert_eq!(inner_triangles(&plate(1)), LEAST_INNER * 2.0);
        assert_eq!(inner_triangles(&Mesh::default()), 0.0);
    }
}
