//! Triangles of open surfaces that lie in solids whole.

use super::{Fate, SolidsReport};
use crate::topology::{DIRECTIONS, Patches, Sense, scene, within};
use glam::Vec3;
use heliodon_mesh::Mesh;
use heliodon_rays::{Ray, TriangleScene};
use rayon::prelude::*;

/// Points are asked for this part of the triangle's longest edge on either side of it, so that one that lies in a solid's very face
/// has a side outside, and stays.
const ASIDE: f32 = 1.0e-3;

/// And this part of the largest coordinate at least, which is some 16 times what f32 rounds.
const ASIDE_OF_COORDINATE: f32 = 1.0e-6;

/// Corners are moved this part of the way to the middle, off the edges, which neighbours share.
const INWARDS: f32 = 0.01;

/// Marks them.
pub(super) fn mark(mesh: &Mesh, patches: &Patches, senses: &[Sense], report: &mut SolidsReport) {
    let bounds = patches.closed_bounds(&mesh.positions, &mesh.triangles);
    let solid = |patch: usize| matches!(senses[patch], Sense::Body | Sense::Hollow);
    let boxes: Vec<(Vec3, Vec3)> = (0..senses.len())
        .filter(|&patch| senses[patch] == Sense::Body)
        .map(|patch| (bounds[patch].0.as_vec3(), bounds[patch].1.as_vec3()))
        .collect();
    let Some(around) = boxes.iter().copied().reduce(|a, b| (a.0.min(b.0), a.1.max(b.1))) else { return };
    let holds = |(low, high): &(Vec3, Vec3), p: Vec3| low.cmple(p).all() && high.cmpge(p).all();
    let candidates: Vec<u32> = (0..mesh.triangles.len() as u32)
        .into_par_iter()
        .filter(|&t| {
            let corners = || mesh.corners(t as usize);
            // several solids together may hide what none of them does
            patches
                .of(t as usize)
                .is_some_and(|(patch, _)| matches!(senses[patch], Sense::Open | Sense::OneSided | Sense::Sheet))
                && corners().into_iter().all(|p| holds(&around, p))
                && corners().into_iter().any(|p| boxes.iter().any(|one| holds(one, p)))
        })
        .collect();
    if candidates.is_empty() {
        return;
    }
    let Some(scene) = scene(mesh, patches, solid) else { return };
    let aside_m = |longest_m| ASIDE * longest_m;
    let buried: Vec<u32> =
        candidates.into_par_iter().filter(|&t| is_buried(&scene, mesh.corners(t as usize), aside_m)).collect();
    for t in buried {
        report.fates[t as usize] = Fate::Buried;
        report.buried.add(mesh, t as usize);
    }
}

/// Whether points all over both sides of a triangle lie within solids in every direction, and no solid's surface cuts its edges. `aside_m` tells how
/// far off the triangle they are, by its longest edge.
pub(super) fn is_buried(scene: &TriangleScene, [a, b, c]: [Vec3; 3], aside_m: impl Fn(f32) -> f32) -> bool {
    let Some(normal) = (b - a).cross(c - a).try_normalize() else { return false };
    let middle = (a + b + c) / 3.0;
    let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
    let aside = normal * aside_m(longest).max(ASIDE_OF_COORDINATE * middle.abs().max_element());
    let [a, b, c] = [a, b, c].map(|p| p.lerp(middle, INWARDS));
    // the middle first: most end there
    for points in [&[middle][..], &[a, b, c, (a + b) * 0.5, (b + c) * 0.5, (c + a) * 0.5]] {
        let both: Vec<Vec3> = points.iter().flat_map(|&p| [p + aside, p - aside]).collect();
        if within(scene, &both).into_iter().any(|directions| directions < DIRECTIONS.len()) {
            return false;
        }
    }
    let along =
        |(a, b): (Vec3, Vec3)| [aside, -aside].map(|aside| Ray { origin: a + aside, direction: b - a, t_min: 0.0, t_max: 1.0 });
    let rays: Vec<Ray> = [(a, b), (b, c), (c, a)].into_iter().flat_map(along).collect();
    let mut cut = [0];
    scene.occluded(&rays, &mut cut);
    cut == [0]
}
