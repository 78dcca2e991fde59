//! Places of the original that must stay near to the surface.
//!
//! Meshoptimizer's error is a mean over the planes that a vertex has stood for, so single places lie farther off than it says, and small
//! closed stones may vanish whole. Hence every vertex of the original is a witness: it knows a face that is no farther from it than it may be.
//! When none is left after a tile was simplified, the corners of the face that the witness had are held, and the tile is simplified again. A face
//! of which all corners stay stays itself, so what is near before a pass is near after it, and in the beginning every witness is a corner.
//!
//! Why not put original triangles back where the limit is exceeded: between them and the simplified ones cracks would open.

use super::closest::{Query, Surface};
use super::fineness::Fineness;
use super::nearest::{RUN, RUNS};
use super::tile::Face;
use crate::Interim;
use crate::interim::{NUMBERS, made_or_kept};
use glam::Vec3;
use heliodon_mesh::Mesh;

/// Numbers under which is kept what was found come after those of all passes.
const AFTER_PASSES: usize = 8;
/// A place that is on no face.
pub(super) const NOWHERE: u32 = u32::MAX;

/// Places of the original, each with a face that is near to it.
pub(super) struct Witnesses<'a> {
    pub places: &'a [Vec3],
    /// Face of each, or [`NOWHERE`].
    pub on: Vec<u32>,
}

impl<'a> Witnesses<'a> {
    /// The corners of the faces, one of each position.
    pub fn corners(places: &'a [Vec3], faces: &[Face], point_of: &[u32]) -> Self {
        let mut on = vec![NOWHERE; places.len()];
        for (index, face) in faces.iter().enumerate() {
            face.corners.iter().for_each(|&v| on[point_of[v as usize] as usize] = index as u32);
        }
        Self { places, on }
    }

    /// Places beside a mesh that stands for them: each takes the triangle that is closest. What was found is left to `interim`, and taken from there.
    pub fn beside(places: &'a [Vec3], mesh: &Mesh, interim: &dyn Interim) -> Self {
        let surface = Surface::new(mesh);
        let run = |some: &[Vec3]| -> Vec<u32> {
            let mut near = None;
            let find = |&point: &Vec3| {
                let query = Query { point, normal: Vec3::ZERO, least_cosine: -1.0 };
                near = surface.closest(&query, f32::INFINITY, near).map(|closest| closest.triangle).or(near);
                near.unwrap_or(NOWHERE)
            };
            some.iter().map(find).collect()
        };
        let runs = places.chunks(RUN).collect::<Vec<_>>();
        let runs = made_or_kept(interim, (AFTER_PASSES * NUMBERS, runs.len()), RUNS, |index| run(runs[index]), |_| ());
        Self { places, on: runs.concat() }
    }

    /// The witnesses face by face.
    pub fn by_face(&self, faces: usize) -> ByFace {
        let mut ends = vec![0_u32; faces + 1];
        let placed = || (0..self.on.len()).filter(|&w| self.on[w] != NOWHERE);
        placed().for_each(|w| ends[self.on[w] as usize] += 1);
        let mut sum = 0;
        for end in &mut ends {
            sum += *end;
            *end = sum;
        }
        // from the back, so that each face's are in order and its end becomes its beginning
        let mut order = vec![0; sum as usize];
        for w in (0..self.on.len()).rev().filter(|&w| self.on[w] != NOWHERE) {
            let place = &mut ends[self.on[w] as usize];
            *place -= 1;
            order[*place as usize] = w as u32;
        }
        ByFace { begins: ends, order }
    }
}

/// Witnesses by the faces that they have.
pub(super) struct ByFace {
    begins: Vec<u32>,
    order: Vec<u32>,
}

impl ByFace {
    pub fn of(&self, face: u32) -> &[u32] {
        &self.order[self.begins[face as usize] as usize..self.begins[face as usize + 1] as usize]
    }
}

/// For each of some witnesses a triangle of the mesh that is no farther off than may be, or [`NOWHERE`].
pub(super) fn settle(mesh: &Mesh, fineness: &Fineness, places: impl Iterator<Item = Vec3>) -> Vec<u32> {
    let surface = Surface::new(mesh);
    let mut near = None;
    let find = |place: Vec3| {
        let found = surface.any_within(place, fineness.error_m(place), near);
        near = found.or(near);
        found.unwrap_or(NOWHERE)
    };
    places.map(find).collect()
}
