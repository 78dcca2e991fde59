//! Patches of a part that stand for all of it: what is done to them is timed and counted, and all of the part is reckoned from it.

use super::part::{LEAST_ACROSS, LONGEST_EDGE};
use crate::estimate::largest_texture_bytes;
use glam::Vec3;
use heliodon_mesh::Mesh;
use heliodon_prepare::Views;
use heliodon_prepare::simplify::SimplifyParams;
use heliodon_prepare::split::split;
use rayon::prelude::*;

/// Patches of a part, in balls around triangles that are spread over it by how many pieces splitting makes of them.
const PATCHES: usize = 8;
/// Triangles of a patch once it is split.
const PATCH_TRIANGLES: f64 = 12_000.0;
/// Triangles of a part, evenly spread over its files, that tell where its others are and what splitting makes of them.
const SAMPLE: usize = 16_384;
/// The most triangles that splitting may make of these.
const MOST_PIECES: usize = 4_000_000;

/// What is known of a part before it is prepared.
#[derive(Debug, Default)]
pub(super) struct Looked {
    /// Triangles in its files.
    pub triangles: f64,
    /// Triangles after splitting.
    pub original: f64,
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

/// Looks at a part that was read. `splits` says whether it is split.
pub(super) fn look(mesh: &Mesh, views: &Views, params: &SimplifyParams, splits: bool) -> Looked {
    let target_m = |place| {
        let edge_m =
            if views.cells.is_empty() { params.edge_m } else { params.edge_px * views.pixel_m(place, params.nearest_m) };
        LONGEST_EDGE * edge_m
    };
    let longest_m = |place, along| target_m(place) / views.across(place, along).max(LEAST_ACROSS);
    let splits = splits && target_m(Vec3::ZERO) > 0.0;
    let all = mesh.triangles.len();
    let sample: Vec<u32> = (0..all as u32).step_by(all.div_ceil(SAMPLE).max(1)).collect();
    let pieces = |&t: &u32| if splits { pieces(mesh.corners(t as usize), &longest_m) } else { 1.0 };
    let weights: Vec<f64> = sample.iter().map(pieces).collect();
    let mut times = 1.0;
    if splits && !sample.is_empty() {
        let (mut some, _) = mesh.with_triangles(&sample);
        // what would be too many is reckoned from lengths
        let made = split(&mut some, longest_m, MOST_PIECES).map(|report| report.triangles_after as f64);
        times = made.unwrap_or_else(|_| weights.iter().sum()) / sample.len() as f64;
    }
    let patches = balls(mesh, &sample, &weights).into_iter().map(|triangles| {
        let (mut patch, _) = mesh.with_triangles(&triangles);
        if splits {
            // a patch that comes out too large is taken as it is
            let _ = split(&mut patch, longest_m, MOST_PIECES);
        }
        patch
    });
    let patches: Vec<Mesh> = patches.collect();
    let per_vertex = |there: bool, bytes: usize| if there { bytes as f64 } else { 0.0 };
    let original = all as f64 * times;
    Looked {
        triangles: all as f64,
        original,
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
