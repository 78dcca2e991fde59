//! Splitting triangles whose edges are longer than a target that depends on the place, without T-junctions.
//!
//! Whether an edge is halved, and where, depends on the positions of its two ends only, in whatever order: on each side of it, across
//! seams, parts and files, the same happens to the bit. So the mesh's edges are halved first, and their halves, until none is too
//! long; then each triangle is cut for itself, on any thread:
//!
//! - one edge too long: halved there;
//! - two: rungs between all middles of both, for halving a needle again and again makes three of it each time (3^n thin triangles for
//!   2^n pieces of an edge, where rungs make 2^(n+1));
//! - three: into four triangles of its own shape, or, where it is blunt, from the blunt corner into two that are less so.

mod edges;
mod halving;
mod inside;
mod vertex;

use crate::Tell;
use edges::Middles;
use glam::Vec3;
use halving::too_long;
use heliodon_mesh::Mesh;
use inside::{Cutter, Pieces};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::sync::atomic::AtomicUsize;

/// What splitting did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize)]
pub struct SplitReport {
    /// Vertices before.
    pub vertices_before: u64,
    /// Triangles before.
    pub triangles_before: u64,
    /// Vertices after.
    pub vertices_after: u64,
    /// Triangles after.
    pub triangles_after: u64,
    /// Triangles that had an edge too long.
    pub split_triangles: u64,
    /// The middle of the first triangle that was split, metres.
    pub first: Option<[f32; 3]>,
}

impl fmt::Display for SplitReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { triangles_before, triangles_after, split_triangles, .. } = self;
        match self.first {
            None => write!(f, "{triangles_before} triangles, none with an edge too long"),
            Some([x, y, z]) => write!(
                f,
                "{triangles_before} triangles, {split_triangles} of them with edges too long, now {triangles_after}; \
                 first at ({x:.3}, {y:.3}, {z:.3})"
            ),
        }
    }
}

/// Why a mesh was not split.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum SplitError {
    /// More triangles than asked for would come of it.
    #[error(
        "splitting edges, as to {longest_m} m at ({0:.2}, {1:.2}, {2:.2}), makes more than {most} triangles; \
         ask for longer edges, keep eyes further away, or allow more triangles",
        place[0], place[1], place[2]
    )]
    TooMany {
        /// Triangles allowed.
        most: u64,
        /// The middle of the first edge that is too long, metres.
        place: [f32; 3],
        /// How long it may be, metres.
        longest_m: f32,
    },
}

/// Splits triangles until no edge is longer than `longest_m` says for its middle and its direction (from one end to the other; the same answer is
/// wanted for the opposite), in metres, or its ends are neighbours in f32. Texture
/// coordinates and colours are interpolated, normals as well and made unit; pieces keep their triangle's material and stand where it
/// stood. Areas keep to rounding. A target that is not a number, or infinite, splits nothing there.
///
/// # Errors
/// When more than `most_triangles` come of it, or more vertices than a `u32` counts; the mesh is then as it was. Stopping halfway
/// would leave gaps to meshes that were split apart from this one.
///
/// # Panics
/// Where a triangle names a vertex that does not exist.
pub fn split(
    mesh: &mut Mesh,
    longest_m: impl Fn(Vec3, Vec3) -> f32 + Sync,
    most_triangles: usize,
) -> Result<SplitReport, SplitError> {
    split_telling(mesh, longest_m, most_triangles, Tell::NOBODY)
}

/// As [`split`], and tells how far it is.
///
/// # Errors
/// As [`split`].
///
/// # Panics
/// As [`split`].
pub fn split_telling(
    mesh: &mut Mesh,
    longest_m: impl Fn(Vec3, Vec3) -> f32 + Sync,
    most_triangles: usize,
    tell: Tell,
) -> Result<SplitReport, SplitError> {
    let vertices = mesh.positions.len();
    let mut report = SplitReport {
        vertices_before: vertices as u64,
        triangles_before: mesh.triangles.len() as u64,
        ..SplitReport::default()
    };
    let long_edge = |t: u32| {
        let [a, b, c] = mesh.corners(t as usize);
        [(a, b), (b, c), (c, a)].into_iter().find_map(|(a, b)| Some((too_long(a, b, &longest_m)?, b - a)))
    };
    let long: Vec<u32> = (0..mesh.triangles.len() as u32).into_par_iter().filter(|&t| long_edge(t).is_some()).collect();
    let first = long.first().and_then(|&t| long_edge(t));
    report.first = first.map(|(place, _)| place.to_array());
    report.split_triangles = long.len() as u64;
    tell.done(FOUND);
    if let Some((place, along)) = first {
        let error =
            SplitError::TooMany { most: most_triangles as u64, place: place.to_array(), longest_m: longest_m(place, along) };
        if let Err(TooMany) = split_some(mesh, &long, &longest_m, most_triangles, tell.within(FOUND, 1.0)) {
            truncate(mesh, vertices);
            return Err(error);
        }
    }
    (report.vertices_after, report.triangles_after) = (mesh.positions.len() as u64, mesh.triangles.len() as u64);
    tell.done(1.0);
    Ok(report)
}

/// The part of the time after which the triangles with an edge too long are found; of what follows, that after which the mesh's edges are halved, and
/// that after which all triangles are cut.
const FOUND: f64 = 0.1;
const HALVED: f64 = 0.35;
const CUT: f64 = 0.8;
/// Triangles that are cut in turn by one thread before it tells.
const RUN: usize = 1024;

/// More triangles or vertices than may be.
struct TooMany;

/// Splits the triangles that have an edge too long; on failure vertices are left over at the end.
fn split_some(
    mesh: &mut Mesh,
    long: &[u32],
    longest_m: &(impl Fn(Vec3, Vec3) -> f32 + Sync),
    most: usize,
    tell: Tell,
) -> Result<(), TooMany> {
    // every middle of an edge makes a triangle more, on either side
    let most_vertices = mesh.positions.len().saturating_add(most).min(u32::MAX as usize);
    let middles = Middles::append(mesh, long, longest_m, most_vertices).ok_or(TooMany)?;
    let left = AtomicUsize::new((most + long.len()).checked_sub(mesh.triangles.len()).ok_or(TooMany)?);
    let cutter = Cutter { mesh, middles: &middles, longest_m, left: &left };
    tell.done(HALVED);
    let cut = tell.within(HALVED, CUT).count(long.len());
    let of_run = |run: &[u32]| -> Option<Vec<Pieces>> {
        let pieces = run.iter().map(|&t| cutter.cut(t)).collect();
        cut.add(run.len());
        pieces
    };
    let pieces: Option<Vec<Vec<Pieces>>> = long.par_chunks(RUN).map(of_run).collect();
    let pieces = pieces.map(|runs| runs.into_iter().flatten().collect());
    drop(middles);
    put_in_place(mesh, long, pieces.ok_or(TooMany)?)
}

/// Puts all pieces where the triangles stood that they came from, and their own vertices at the end, in that order.
fn put_in_place(mesh: &mut Mesh, long: &[u32], pieces: Vec<Pieces>) -> Result<(), TooMany> {
    let made: usize = pieces.iter().map(|pieces| pieces.triangles.len()).sum();
    let own: usize = pieces.iter().map(|pieces| pieces.own.len()).sum();
    let shared = mesh.positions.len();
    if shared + own > u32::MAX as usize {
        return Err(TooMany);
    }
    let mut triangles = Vec::with_capacity(mesh.triangles.len() - long.len() + made);
    let mut materials = Vec::new();
    let mut pieces = long.iter().zip(pieces).peekable();
    for (t, triangle) in std::mem::take(&mut mesh.triangles).into_iter().enumerate() {
        match pieces.next_if(|(long, _)| **long as usize == t) {
            None => triangles.push(triangle),
            Some((_, pieces)) => {
                let moved = (mesh.positions.len() - shared) as u32;
                let place = |v: u32| if (v as usize) < shared { v } else { v + moved };
                triangles.extend(pieces.triangles.into_iter().map(|t| t.map(place)));
                for vertex in pieces.own {
                    vertex.push(mesh);
                }
            }
        }
        if let Some(&material) = mesh.triangle_material.get(t) {
            materials.resize(triangles.len(), material);
        }
    }
    (mesh.triangles, mesh.triangle_material) = (triangles, materials);
    Ok(())
}

fn truncate(mesh: &mut Mesh, vertices: usize) {
    mesh.positions.truncate(vertices);
    mesh.normals.truncate(vertices);
    mesh.uvs.truncate(vertices);
    mesh.colors_linear.truncate(vertices);
}

#[cfg(test)]
mod tests;
