//! Static levels of detail: as many triangles at each place as the site's screen can show from where eyes can be.
//!
//! [`simplify`] is meshoptimizer's edge collapse (Arseny Kapoulkine; quadrics after Garland and Heckbert: "Surface
//! Simplification Using Quadric Error Metrics", 1997) on tiles, each with the tolerance of its distance from the nearest eye.
//! Two things limit it: how far the surface may move, and, since light is stored at vertices, how long edges may become, on the
//! plainest wall too. Both are set in pixels.
//!
//! What holds:
//!
//! - Every vertex of the result is one of the original, unmoved, with its normal, colour and texture coordinates.
//! - No crack opens: tiles share vertices that stay in place, and what vertices of one position share is one thing to all of
//!   them. A closed mesh stays closed. Where another mesh goes on, the border between stays ([`Held`], [`crate::borders`]).
//! - Where materials of different looks or names meet, and where vertices of one position part (texture seams, creases), the line
//!   between stays within the tolerance,
//!   and so do the borders of open sheets.
//! - No vertex of the original is farther from the surface than the tolerance at its place, so a small closed shape stays as well.
//! - The result is the same to the bit for any number of threads.
//!
//! [`measure`] then says how far the surface really moved, both ways, [`nearest_triangles`] which triangle stands for which
//! of the original, and [`averages`] what colours and normals make it look most like the original.
//!
//! Why tiles and not one call for all: one tolerance serves a whole call, which also runs on one core and holds quadrics of all
//! vertices at once.

mod averages;
mod closest;
mod collect;
mod evenness;
mod fineness;
mod held;
mod measure;
mod nearest;
mod passes;
#[cfg(test)]
mod tests;
mod tile;
mod tiles;
mod witnesses;

pub use averages::{Averages, Look, averages, look_of};
pub use held::Held;
pub(crate) use held::place_bits;
pub use measure::{Distances, MeasureReport, Measured, measure, measure_resuming, measure_telling};
pub use nearest::{Nearest, nearest_triangles, nearest_triangles_resuming, nearest_triangles_telling};

use crate::{Interim, Nowhere, Tell, Views};
use fineness::Fineness;
use glam::Vec3;
use heliodon_mesh::{Material, Mesh};
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use tile::Context;

/// With edges that may be so many times as long as the surface may move, the latter alone decides: longer ones are not made.
pub const COARSEST_EDGE: f32 = 15.0;

/// How far simplification may go.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
pub struct SimplifyParams {
    /// How far the surface may move, in pixels of the nearest eye, at least 0. More gives fewer triangles on rough surfaces and
    /// a coarser outline. Every vertex of the original keeps it.
    pub error_px: f32,
    /// How long edges may become, in pixels of the nearest eye, at least 0. More gives fewer triangles on plain surfaces, and
    /// softer shadows: an edge of shadow is as wide as a triangle. Kept for 95 of 100 edges, and none is made twice as long;
    /// edges that are longer in the original stay as they are. More than [`COARSEST_EDGE`] times `error_px` changes nothing any more.
    pub edge_px: f32,
    /// No eye comes nearer than this to a surface, metres: what lies in the box where eyes can be would need to be infinitely
    /// fine.
    pub nearest_m: f32,
    /// As `error_px` where no boxes for eyes are known, metres.
    pub error_m: f32,
    /// As `edge_px` where no boxes for eyes are known, metres.
    pub edge_m: f32,
    /// How much normals count, at least 0: normals that differ by this many-th part of a radian over a width count as if the
    /// surface moved by that width. More keeps more triangles where light changes with the slope.
    pub normal_weight: f32,
    /// How much vertex colours count, at least 0, as for normals: differences of the square roots of linear values, which are
    /// in [0, 1].
    pub color_weight: f32,
}

impl SimplifyParams {
    /// For the site's screen: errors of a pixel, shadows sharp to three: half of the edges are shorter than that.
    #[must_use]
    pub fn screen() -> Self {
        Self {
            error_px: 1.0,
            edge_px: 5.0,
            nearest_m: 1.0,
            error_m: 0.005,
            edge_m: 0.025,
            normal_weight: 0.5,
            color_weight: 2.0,
        }
    }

    /// For a look: a quarter of the triangles.
    #[must_use]
    pub fn preview() -> Self {
        Self { error_px: 2.0, edge_px: 10.0, error_m: 0.01, edge_m: 0.05, ..Self::screen() }
    }
}

impl Default for SimplifyParams {
    fn default() -> Self {
        Self::screen()
    }
}

/// What simplification did.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
pub struct SimplifyReport {
    /// Triangles of the original.
    pub triangles_before: usize,
    /// Triangles of the result.
    pub triangles_after: usize,
    /// Vertices of the original.
    pub vertices_before: usize,
    /// Vertices of the result.
    pub vertices_after: usize,
    /// Pass after pass.
    pub passes: Vec<PassReport>,
}

/// What one pass did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize)]
pub struct PassReport {
    /// Tiles that it worked on.
    pub tiles: usize,
    /// Triangles after it.
    pub triangles: usize,
    /// How often tiles were simplified once more, because a place of the original lay too far off.
    pub again: usize,
    /// Places that it could not work on because tiles shared them.
    pub shared_points: usize,
    /// The greatest error that meshoptimizer admits to, attributes and evenness of triangles included, metres. [`measure`] has
    /// the true ones.
    pub error_m: f32,
}

/// A simplified mesh.
#[derive(Clone, Debug)]
pub struct Simplified {
    /// The mesh, with the original's materials; neighbours in space are mostly neighbours in its arrays. Where materials look
    /// the same and have the same name, triangles have the first of these.
    pub mesh: Mesh,
    /// For each of its vertices the index of the original's vertex that it is.
    pub original_vertex: Vec<u32>,
    /// In numbers.
    pub report: SimplifyReport,
}

/// Simplifies a mesh to what the screen can show of it from the boxes where eyes can be; to the tolerances in metres where
/// `views` has no boxes.
///
/// Takes about a second for a million triangles on two cores, and 40 bytes for each beside the mesh and the result.
///
/// # Panics
/// When the mesh contradicts itself ([`Mesh::validate`]).
#[must_use]
pub fn simplify(mesh: &Mesh, views: &Views, params: &SimplifyParams) -> Simplified {
    simplify_telling(mesh, views, params, Tell::NOBODY)
}

/// As [`simplify`], and tells how far it is.
///
/// # Panics
/// As [`simplify`].
#[must_use]
pub fn simplify_telling(mesh: &Mesh, views: &Views, params: &SimplifyParams, tell: Tell) -> Simplified {
    simplify_holding(mesh, &Held::NOTHING, views, params, tell)
}

/// As [`simplify_telling`]; vertices at some places stay.
///
/// # Panics
/// As [`simplify`].
#[must_use]
pub fn simplify_holding(mesh: &Mesh, held: &Held, views: &Views, params: &SimplifyParams, tell: Tell) -> Simplified {
    simplify_for((mesh, held), None, views, params, tiles::MOST, (&Nowhere, tell))
}

/// As [`simplify_holding`], and leaves what it has done so far to `interim`, by which whoever simplifies the same mesh the same way goes on.
///
/// # Panics
/// As [`simplify`].
#[must_use]
pub fn simplify_resuming(
    mesh: &Mesh,
    held: &Held,
    views: &Views,
    params: &SimplifyParams,
    (interim, tell): (&dyn Interim, Tell),
) -> Simplified {
    simplify_for((mesh, held), None, views, params, tiles::MOST, (interim, tell))
}

/// Simplifies further what stands for an original already, so that the places of the original stay within the limits. They are to be within those
/// that the mesh was simplified with before. What was held before is held again. Tells how far it is, and leaves what it has done so far to an
/// [`Interim`], by which whoever simplifies the same mesh the same way goes on.
///
/// # Panics
/// When the mesh contradicts itself ([`Mesh::validate`]).
#[must_use]
pub fn simplify_further(
    mesh: &Mesh,
    held: &Held,
    original: &[Vec3],
    views: &Views,
    params: &SimplifyParams,
    (interim, tell): (&dyn Interim, Tell),
) -> Simplified {
    simplify_for((mesh, held), Some(original), views, params, tiles::MOST, (interim, tell))
}

fn simplify_for(
    (mesh, held): (&Mesh, &Held),
    original: Option<&[Vec3]>,
    views: &Views,
    params: &SimplifyParams,
    most: usize,
    (interim, tell): (&dyn Interim, Tell),
) -> Simplified {
    let point_of = passes::points(&mesh.positions);
    let context = Context { mesh, params, looks: &looks(&mesh.materials), point_of: &point_of, held };
    let (faces, report) =
        passes::run(&context, &Fineness::new(views, params), most, original, interim, tell.within(POINTS, PASSES));
    let simplified = collect::collect(mesh, &faces, report);
    tell.done(1.0);
    simplified
}

/// The parts of the time after which vertices at one position are known, and after which the passes are over.
const POINTS: f64 = 0.05;
const PASSES: f64 = 0.96;

/// For each material the first that looks the same and has the same name: who gives others wants them apart.
fn looks(materials: &[Material]) -> Vec<u16> {
    let same = |a: &Material, b: &Material| {
        let textures = match (&a.texture, &b.texture) {
            (Some(a), Some(b)) => Arc::ptr_eq(a, b),
            (a, b) => a.is_none() && b.is_none(),
        };
        textures && a.base_color_linear == b.base_color_linear && a.name == b.name
    };
    let first = |(index, material)| materials[..index].iter().position(|known| same(known, material)).unwrap_or(index) as u16;
    materials.iter().enumerate().map(first).collect()
}
