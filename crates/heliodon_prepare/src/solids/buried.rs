//! Triangles of open surfaces that lie in solids whole.

use super::among::overlap;
use super::near::Boxes;
use super::{Fate, SolidsReport};
use crate::topology::{DIRECTIONS, Patches, Sense, scene, within};
use glam::Vec3;
use heliodon_mesh::Mesh;
use heliodon_rays::{BuildParams, Hit, NO_HIT, Ray, TriangleScene};
use rayon::prelude::*;

/// Points are asked for this part of the triangle's longest edge on either side of it, so that one that lies in a solid's very face
/// has a side outside, and stays.
const ASIDE: f32 = 1.0e-3;

/// And this part of the largest coordinate at least, which is some 16 times what f32 rounds.
const ASIDE_OF_COORDINATE: f32 = 1.0e-6;

/// Corners are moved this part of the way to the middle at most, off the edges, which neighbours share.
const INWARDS: f32 = 0.01;

/// Marks them.
pub(super) fn mark(mesh: &Mesh, patches: &Patches, senses: &[Sense], report: &mut SolidsReport) {
    let bounds = patches.closed_bounds(&mesh.positions, &mesh.triangles);
    let solid = |patch: usize| matches!(senses[patch], Sense::Body | Sense::Hollow);
    let boxes: Vec<(Vec3, Vec3)> = (0..senses.len())
        .filter(|&patch| senses[patch] == Sense::Body)
        .map(|patch| (bounds[patch].0.as_vec3(), bounds[patch].1.as_vec3()))
        .collect();
    let Some(boxes) = Boxes::new(&boxes) else { return };
    let candidates: Vec<u32> = (0..mesh.triangles.len() as u32)
        .into_par_iter()
        .filter(|&t| {
            let corners = || mesh.corners(t as usize);
            // several solids together may hide what none of them does
            patches
                .of(t as usize)
                .is_some_and(|(patch, _)| matches!(senses[patch], Sense::Open | Sense::OneSided | Sense::Sheet))
                && corners().into_iter().all(|p| boxes.are_around(p))
                && corners().into_iter().any(|p| boxes.hold(p))
        })
        .collect();
    if candidates.is_empty() {
        return;
    }
    let Some(scene) = scene(mesh, patches, solid) else { return };
    let of_solids = |t: &usize| patches.of(*t).is_some_and(|(patch, _)| solid(patch));
    let solids: Vec<[u32; 3]> = (0..mesh.triangles.len()).filter(of_solids).map(|t| mesh.triangles[t]).collect();
    let solids = Solids { scene: &scene, positions: &mesh.positions, triangles: &solids };
    for t in solids.buried(mesh, candidates, |longest_m| ASIDE * longest_m) {
        report.fates[t as usize] = Fate::Buried;
        report.buried.add(mesh, t as usize);
    }
}

/// Solids that may bury something.
pub(super) struct Solids<'s> {
    /// Their surfaces for rays.
    pub scene: &'s TriangleScene,
    /// The same.
    pub positions: &'s [Vec3],
    pub triangles: &'s [[u32; 3]],
}

impl Solids<'_> {
    /// Those of some triangles of a mesh that have the inside of solids all over both sides, in order. `aside_m` tells how far off a triangle is asked, by
    /// its longest edge.
    pub fn buried(&self, mesh: &Mesh, candidates: Vec<u32>, aside_m: impl Fn(f32) -> f32 + Sync) -> Vec<u32> {
        let within = |t: u32| Some((t, copies(mesh.corners(t as usize), &aside_m).filter(|copies| self.hold(copies))?));
        let held: Vec<(u32, Copies)> = candidates.into_par_iter().filter_map(within).collect();
        let copies: Vec<Copies> = held.iter().map(|&(_, copies)| copies).collect();
        let is_pierced = self.pierce(&copies);
        held.into_iter().zip(is_pierced).filter(|&(_, is_pierced)| !is_pierced).map(|((t, _), _)| t).collect()
    }

    /// Whether points of a triangle's copies lie within solids in every direction, and no solid's surface cuts their edges.
    fn hold(&self, copies: &Copies) -> bool {
        let all = |points: &[Vec3]| within(self.scene, points).into_iter().all(|directions| directions == DIRECTIONS.len());
        let around = |[a, b, c]: [Vec3; 3]| [a, b, c, (a + b) * 0.5, (b + c) * 0.5, (c + a) * 0.5];
        // the middle first: most end there
        if !all(&copies.map(|[a, b, c]| (a + b + c) / 3.0)) || !all(&copies.map(around).concat()) {
            return false;
        }
        let mut cut = [0];
        self.scene.occluded(&copies.map(|corners| edges(corners).map(along)).concat(), &mut cut);
        cut == [0]
    }

    /// Which of some triangles an edge of a solid goes through: with their own edges, which cut no solid, that is all ways in which two triangles can meet,
    /// so that nothing looks out between the points that were asked.
    fn pierce(&self, copies: &[Copies]) -> Vec<bool> {
        let mut is_pierced = vec![false; copies.len()];
        let corners = copies.iter().flatten().flatten().map(|&p| (p, p));
        let Some(around) = corners.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1))) else { return is_pierced };
        let near = |[a, b]: &[Vec3; 2]| overlap((a.min(*b), a.max(*b)), around);
        let of_triangle = |triangle: &[u32; 3]| edges(triangle.map(|v| self.positions[v as usize]));
        let mut asked: Vec<[Vec3; 2]> = self.triangles.par_iter().flat_map_iter(of_triangle).filter(near).collect();
        // one edge may go through several at one distance, of which a ray meets one: those are left for another round
        while !asked.is_empty() {
            let left: Vec<usize> = (0..copies.len()).filter(|&index| !is_pierced[index]).collect();
            let positions: Vec<Vec3> = left.iter().flat_map(|&index| copies[index]).flatten().collect();
            let triangles: Vec<[u32; 3]> = (0..2 * left.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
            let Ok(scene) = TriangleScene::build(&positions, &triangles, &BuildParams::default()) else {
                // nothing is known of them, so they stay
                left.into_iter().for_each(|index| is_pierced[index] = true);
                break;
            };
            let met: Vec<Vec<u32>> = asked.par_iter().map(|&edge| all_met(&scene, edge)).collect();
            met.iter().flatten().for_each(|&copy| is_pierced[left[copy as usize / 2]] = true);
            asked = asked.into_iter().zip(met).filter(|(_, met)| !met.is_empty()).map(|(edge, _)| edge).collect();
        }
        is_pierced
    }
}

/// A triangle a little off either side of it, and a little smaller.
type Copies = [[Vec3; 3]; 2];

/// None of a triangle without area. The copies are smaller than the triangle by twice as much as they are off it, so that walls which meet its edges do not cut them,
/// but by [`INWARDS`] at most.
fn copies([a, b, c]: [Vec3; 3], aside_m: impl Fn(f32) -> f32) -> Option<Copies> {
    let twice_area = (b - a).cross(c - a);
    let normal = twice_area.try_normalize()?;
    let middle = (a + b + c) / 3.0;
    let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
    let aside = aside_m(longest).max(ASIDE_OF_COORDINATE * middle.abs().max_element());
    // edges are a third of the heights from the middle
    let inwards = (2.0 * aside * 3.0 * longest / twice_area.length()).min(INWARDS);
    let corners = [a, b, c].map(|p| p.lerp(middle, inwards));
    Some([aside, -aside].map(|aside| corners.map(|p| p + normal * aside)))
}

fn edges([a, b, c]: [Vec3; 3]) -> [[Vec3; 2]; 3] {
    [[a, b], [b, c], [c, a]]
}

fn along([from, to]: [Vec3; 2]) -> Ray {
    Ray { origin: from, direction: to - from, t_min: 0.0, t_max: 1.0 }
}

/// The triangles that an edge goes through, one of several at the same distance.
fn all_met(scene: &TriangleScene, edge: [Vec3; 2]) -> Vec<u32> {
    let (mut ray, mut met) = (along(edge), Vec::new());
    if ray.direction == Vec3::ZERO {
        return met;
    }
    loop {
        let mut hit = [Hit::MISS];
        scene.closest(&[ray], &mut hit);
        if hit[0].triangle == NO_HIT {
            return met;
        }
        met.push(hit[0].triangle);
        ray.t_min = hit[0].t;
    }
}
