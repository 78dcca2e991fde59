//! From the original's triangles to those that stand for them.

use super::SimplifyParams;
use super::closest::{Query, Surface, center};
use super::fineness::Fineness;
use crate::interim::{Kept, made_or_kept};
use crate::{Interim, Nowhere, Tell, Views};
use glam::Vec3;
use heliodon_math::frame::unit_or;
use heliodon_mesh::Mesh;

/// Places asked in turn by one thread, each beginning at the triangle that the one before it found.
pub(super) const RUN: usize = 4096;
/// Runs of each thread before it is asked whether they are to be kept: a second or two.
pub(super) const RUNS: usize = 256;
/// The part of the time after which the simplified surface can be asked.
const BUILT: f64 = 0.08;
/// Normals agree when they are less than 60 degrees apart ...
const AGREES: f32 = 0.5;
/// ... and at least face the same side when less than 90.
const SAME_SIDE: f32 = 0.0;

/// For each triangle of the original one of the simplified mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Nearest {
    /// Its index; [`Nearest::NONE`] for all where the simplified mesh has no triangle.
    pub triangle: Vec<u32>,
    /// The distance from the original triangle's middle to it, metres.
    pub distance_m: Vec<f32>,
}

impl Nearest {
    /// No triangle.
    pub const NONE: u32 = u32::MAX;
}

/// Finds, for every triangle of the original, the triangle of the simplified mesh that is nearest to its middle: where light
/// that was stored at the simplified mesh is found by a ray that hits the original.
///
/// Among the triangles that are no farther than the edges that are allowed at the place, one whose normal is less than 60
/// degrees from the original triangle's is taken if there is any, else one on the same side, so that the two faces of a thin
/// wall are not taken for one another; else the nearest of all. Of equally near ones the first is taken.
///
/// # Panics
/// When a triangle names a vertex that does not exist.
#[must_use]
pub fn nearest_triangles(original: &Mesh, simplified: &Mesh, views: &Views, params: &SimplifyParams) -> Nearest {
    nearest_triangles_telling(original, simplified, views, params, Tell::NOBODY)
}

/// As [`nearest_triangles`], and tells how far it is.
///
/// # Panics
/// As [`nearest_triangles`].
#[must_use]
pub fn nearest_triangles_telling(
    original: &Mesh,
    simplified: &Mesh,
    views: &Views,
    params: &SimplifyParams,
    tell: Tell,
) -> Nearest {
    nearest_triangles_resuming(original, simplified, views, params, (&Nowhere, tell))
}

/// As [`nearest_triangles_telling`], and leaves what it has done so far to an [`Interim`], by which whoever asks the same goes on.
///
/// # Panics
/// As [`nearest_triangles`].
#[must_use]
pub fn nearest_triangles_resuming(
    original: &Mesh,
    simplified: &Mesh,
    views: &Views,
    params: &SimplifyParams,
    (interim, tell): (&dyn Interim, Tell),
) -> Nearest {
    let fineness = Fineness::new(views, params);
    let surface = Surface::new(simplified);
    let count = original.triangles.len();
    tell.done(BUILT);
    let done = tell.within(BUILT, 1.0).count(count);
    let run = |start: usize| {
        let mut near = None;
        let find = |triangle: usize| {
            let [a, b, c] = original.corners(triangle);
            let normal = unit_or((b - a).cross(c - a), Vec3::ZERO);
            let point = center(original, triangle);
            let reach_m = fineness.at_distance(fineness.distance_m(point)).edge_m;
            let query = |least_cosine| Query { point, normal, least_cosine };
            let closest = surface
                .closest(&query(AGREES), reach_m, near)
                .or_else(|| surface.closest(&query(SAME_SIDE), reach_m, near))
                .or_else(|| surface.closest(&query(-1.0), f32::INFINITY, near));
            near = closest.map(|closest| closest.triangle).or(near);
            closest.map_or((Nearest::NONE, f32::INFINITY), |closest| (closest.triangle, closest.distance_squared.sqrt()))
        };
        Found((start..(start + RUN).min(count)).map(find).collect())
    };
    let runs = made_or_kept(interim, (0, count.div_ceil(RUN)), RUNS, |i| run(i * RUN), |i| done.add(RUN.min(count - i * RUN)));
    let mut nearest = Nearest { triangle: Vec::with_capacity(count), distance_m: Vec::with_capacity(count) };
    for (triangle, distance_m) in runs.into_iter().flat_map(|run| run.0) {
        nearest.triangle.push(triangle);
        nearest.distance_m.push(distance_m);
    }
    nearest
}

/// Of some places a triangle each, and how far it is.
pub(super) struct Found(pub Vec<(u32, f32)>);

impl Kept for Found {
    fn put(&self, into: &mut Vec<u32>) {
        into.push(self.0.len() as u32);
        into.extend(self.0.iter().flat_map(|&(triangle, distance_m)| [triangle, distance_m.to_bits()]));
    }

    fn get(from: &mut impl Iterator<Item = u32>) -> Option<Self> {
        let count = from.next()?;
        (0..count).map(|_| Some((from.next()?, f32::from_bits(from.next()?)))).collect::<Option<_>>().map(Self)
    }
}
