//! What simplification really did to the surface.

use super::SimplifyParams;
use super::closest::{Query, Surface, center};
use super::fineness::Fineness;
use super::nearest::{Found, Nearest, RUN, RUNS};
use crate::interim::{NUMBERS, made_or_kept};
use crate::{Interim, Nowhere, Tell, Views};
use glam::Vec3;
use heliodon_mesh::Mesh;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// The parts of the time after which the simplified surface can be asked, all of the original's vertices have asked it, and the original surface can
/// be asked.
const BUILT: [f64; 3] = [0.1, 0.6, 0.85];

/// How far two surfaces are apart, over points of one of them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize)]
pub struct Distances {
    /// How many points were measured.
    pub points: usize,
    /// The mean distance, metres.
    pub mean_m: f32,
    /// What 95 of 100 points do not exceed, metres.
    pub p95_m: f32,
    /// The greatest distance, metres.
    pub max_m: f32,
    /// The mean distance, in pixels of the nearest eye; 0 where no boxes for eyes are known, as the next two.
    pub mean_px: f32,
    /// What 95 of 100 points do not exceed, in pixels of the nearest eye.
    pub p95_px: f32,
    /// The greatest distance in pixels of the nearest eye.
    pub max_px: f32,
}

/// How far a simplified mesh departs from its original, both ways: what was cut off, and what was filled in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize)]
pub struct MeasureReport {
    /// From every vertex that the original's triangles use to the simplified surface.
    pub from_original: Distances,
    /// From the middle of every simplified triangle to the original surface. Its corners lie on it.
    pub from_simplified: Distances,
    /// The longest edge of the simplified mesh, metres.
    pub longest_edge_m: f32,
    /// What 95 of 100 of its edges do not exceed, in pixels of the nearest eye; 0 where no boxes for eyes are known.
    pub p95_edge_px: f32,
}

/// What [`measure`] finds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Measured {
    /// For each vertex of the simplified mesh, how far the original surface departs from the triangles around it, metres, at
    /// least 0: the greatest distance of the original's vertices that lie nearest to one of these triangles. Rays of light that
    /// start so far off the surface start outside of what the simplified surface does not show.
    pub clearance_m: Vec<f32>,
    /// In numbers.
    pub report: MeasureReport,
}

/// Measures how far a simplified mesh departs from its original. Distances are exact but for rounding, in pixels they are seen
/// from the nearest place an eye can be and no nearer than [`SimplifyParams::nearest_m`].
///
/// All vertices of the original are measured, and the middles of all simplified triangles; what lies between original vertices
/// is no farther off than these but where a triangle of the original spans a crease of the simplified mesh.
///
/// # Panics
/// When a triangle names a vertex that does not exist.
#[must_use]
pub fn measure(original: &Mesh, simplified: &Mesh, views: &Views, params: &SimplifyParams) -> Measured {
    measure_telling(original, simplified, views, params, Tell::NOBODY)
}

/// As [`measure`], and tells how far it is.
///
/// # Panics
/// As [`measure`].
#[must_use]
pub fn measure_telling(original: &Mesh, simplified: &Mesh, views: &Views, params: &SimplifyParams, tell: Tell) -> Measured {
    measure_resuming(original, simplified, views, params, (&Nowhere, tell))
}

/// As [`measure_telling`], and leaves what it has done so far to an [`Interim`], by which whoever measures the same goes on.
///
/// # Panics
/// As [`measure`].
#[must_use]
pub fn measure_resuming(
    original: &Mesh,
    simplified: &Mesh,
    views: &Views,
    params: &SimplifyParams,
    (interim, tell): (&dyn Interim, Tell),
) -> Measured {
    let fineness = Fineness::new(views, params);
    let mut used = vec![false; original.positions.len()];
    original.triangles.as_flattened().iter().for_each(|&v| used[v as usize] = true);
    let points: Vec<u32> = (0..used.len() as u32).filter(|&v| used[v as usize]).collect();
    drop(used);
    let surface = Surface::new(simplified);
    tell.done(BUILT[0]);
    let told = tell.within(BUILT[0], BUILT[1]);
    let place = |i: usize| original.positions[points[i] as usize];
    let found = nearest_to(&surface, (0, points.len()), place, (interim, told));
    let mut clearance_m = vec![0.0_f32; simplified.positions.len()];
    for &(triangle, distance_m) in found.iter().flat_map(|run| &run.0).filter(|(triangle, _)| *triangle != Nearest::NONE) {
        for vertex in simplified.triangles[triangle as usize] {
            let clearance_m = &mut clearance_m[vertex as usize];
            *clearance_m = clearance_m.max(distance_m);
        }
    }
    let from_original = distances(found, &fineness, place);
    drop((surface, points));
    let surface = Surface::new(original);
    tell.done(BUILT[2]);
    let told = tell.within(BUILT[2], 1.0);
    let middle = |i| center(simplified, i);
    let found = nearest_to(&surface, (NUMBERS, simplified.triangles.len()), middle, (interim, told));
    let from_simplified = distances(found, &fineness, middle);
    let (longest_edge_m, p95_edge_px) = edges(simplified, &fineness);
    Measured { clearance_m, report: MeasureReport { from_original, from_simplified, longest_edge_m, p95_edge_px } }
}

/// For each of many points the triangle that is nearest, or [`Nearest::NONE`], in runs of [`RUN`]. Numbers begin with `first`.
fn nearest_to(
    surface: &Surface,
    (first, count): (usize, usize),
    point: impl Fn(usize) -> Vec3 + Sync,
    (interim, tell): (&dyn Interim, Tell),
) -> Vec<Found> {
    let done = tell.count(count);
    let run = |start: usize| {
        let mut near = None;
        let find = |index| {
            let query = Query { point: point(index), normal: Vec3::ZERO, least_cosine: -1.0 };
            let closest = surface.closest(&query, f32::INFINITY, near);
            near = closest.map(|closest| closest.triangle).or(near);
            closest.map_or((Nearest::NONE, 0.0), |closest| (closest.triangle, closest.distance_squared.sqrt()))
        };
        Found((start..(start + RUN).min(count)).map(find).collect())
    };
    made_or_kept(interim, (first, count.div_ceil(RUN)), RUNS, |i| run(i * RUN), |i| done.add(RUN.min(count - i * RUN)))
}

/// How far points lie from what was found for them.
fn distances(found: Vec<Found>, fineness: &Fineness, point: impl Fn(usize) -> Vec3 + Sync) -> Distances {
    let of_run = |(run, found): (usize, Found)| {
        let placed = found.0.into_iter().enumerate().filter(|(_, (triangle, _))| *triangle != Nearest::NONE);
        placed.map(move |(i, (_, distance_m))| (distance_m, run * RUN + i)).collect::<Vec<_>>()
    };
    let (meters, pixels): (Vec<f32>, Vec<f32>) = found
        .into_par_iter()
        .enumerate()
        .flat_map_iter(of_run)
        .map(|(distance_m, i)| (distance_m, distance_m / fineness.pixel_m(point(i))))
        .unzip();
    let points = meters.len();
    let [mean_m, p95_m, max_m] = summary(meters);
    let [mean_px, p95_px, max_px] = summary(pixels);
    Distances { points, mean_m, p95_m, max_m, mean_px, p95_px, max_px }
}

/// Mean, 95th percentile and maximum; zero of nothing.
fn summary(mut values: Vec<f32>) -> [f32; 3] {
    let Some(last) = values.len().checked_sub(1) else { return [0.0; 3] };
    let mean = values.iter().map(|&v| f64::from(v)).sum::<f64>() / values.len() as f64;
    let greatest = values.iter().copied().fold(0.0, f32::max);
    let (_, &mut p95, _) = values.select_nth_unstable_by(last * 95 / 100, f32::total_cmp);
    [mean as f32, p95, greatest]
}

/// The longest edge in metres, and the 95th percentile in pixels at the edges' nearer ends.
fn edges(mesh: &Mesh, fineness: &Fineness) -> (f32, f32) {
    let edge = |t: &[u32; 3]| {
        let corners = t.map(|v| mesh.positions[v as usize]);
        [0, 1, 2].map(|i| {
            let (a, b) = (corners[i], corners[(i + 1) % 3]);
            let length = a.distance(b);
            (length, length / fineness.pixel_m(a).min(fineness.pixel_m(b)))
        })
    };
    let (meters, pixels): (Vec<f32>, Vec<f32>) = mesh.triangles.par_iter().flat_map_iter(edge).unzip();
    (summary(meters)[2], summary(pixels)[1])
}
