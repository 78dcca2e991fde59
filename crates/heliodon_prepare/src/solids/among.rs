//! What solids of several meshes bury of each other: walls that they share, and faces that lie within another's solid whole.
//!
//! Parts of a site stay apart, so that each keeps its own light, name and place in the cache; hence their solids are not united. But nobody can see
//! a face that has the inside of some solid on either side, and which one does not matter: a wall between two bodies has one's inside before it and
//! the other's behind it, however differently both are triangulated, and what stands in a body has that on both sides.
//!
//! Why not sheets back to back as well: triangles are seen from both sides, so one of the two shows its light on each.

use super::buried::Solids;
use super::near::Boxes;
use super::solids;
use crate::clean::Finding;
use crate::topology::Sense;
use glam::Vec3;
use heliodon_mesh::Mesh;
use heliodon_mesh::topology::places;
use heliodon_rays::{BuildParams, TriangleScene};
use rayon::prelude::*;

/// Bodies that are no farther apart than this touch, metres: twice what [`crate::clean::CleanParams::modelled`] welds.
const TOUCH_M: f32 = 2.0e-5;

/// A mesh among others.
#[derive(Clone, Copy)]
pub struct Member<'m> {
    /// Its geometry, clean ([`crate::clean`]).
    pub mesh: &'m Mesh,
    /// Whether its closed patches are solids.
    pub has_solids: bool,
    /// Its triangles that somebody is known to see, whatever solids say; empty where nothing is known.
    pub seen: &'m [bool],
}

/// What solids bury of a mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BuriedAmong {
    /// Its triangles that nobody can see, in order.
    pub triangles: Vec<u32>,
    /// In numbers.
    pub found: Finding,
}

pub(super) type Bounds = (Vec3, Vec3);

/// Whether the box of any mesh that has solids meets another's: where not, nothing is buried.
#[must_use]
pub fn meet(members: &[Member]) -> bool {
    !met(members).is_empty()
}

/// For each mesh what lies within the solids of all meshes together, where another one's are near. Eyes are places where eyes can be, in metres: a closed surface around one is
/// a room and no solid.
///
/// # Panics
/// Where a triangle names a vertex that does not exist.
#[must_use]
pub fn buried_among(members: &[Member], eyes: &[Vec3]) -> Vec<BuriedAmong> {
    let mut buried = vec![BuriedAmong::default(); members.len()];
    let mut bodies: Vec<Vec<Bounds>> = vec![Vec::new(); members.len()];
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for index in met(members) {
        let mesh = members[index].mesh;
        let (patches, senses) = solids(mesh, &places(&mesh.positions, 0.0), eyes);
        let bounds = patches.closed_bounds(&mesh.positions, &mesh.triangles);
        let of_bodies = bounds.into_iter().zip(&senses).filter(|(_, sense)| **sense == Sense::Body);
        bodies[index] = of_bodies.map(|((low, high), _)| (low.as_vec3() - TOUCH_M, high.as_vec3() + TOUCH_M)).collect();
        let is_solid = |t: usize| patches.of(t).is_some_and(|(patch, _)| matches!(senses[patch], Sense::Body | Sense::Hollow));
        let first = positions.len() as u32;
        let of_solids = (0..mesh.triangles.len()).filter(|&t| is_solid(t)).map(|t| mesh.triangles[t].map(|v| v + first));
        triangles.extend(of_solids);
        positions.extend_from_slice(&mesh.positions);
    }
    // none where rays cannot be asked: too many triangles
    let scene = TriangleScene::build(&positions, &triangles, &BuildParams::default()).ok();
    let Some(scene) = scene.filter(|_| !triangles.is_empty()) else { return buried };
    let solids = Solids { scene: &scene, positions: &positions, triangles: &triangles };
    for (index, (member, buried)) in members.iter().zip(&mut buried).enumerate() {
        let others = bodies.iter().enumerate().filter(|&(other, _)| other != index).flat_map(|(_, bodies)| bodies);
        let own = member.mesh.bounds();
        let near: Vec<Bounds> = others.copied().filter(|&other| own.is_some_and(|own| overlap(own, other))).collect();
        let Some(near) = Boxes::new(&near) else { continue };
        let is_near = |t: u32| member.mesh.corners(t as usize).into_iter().any(|p| near.hold(p));
        let is_seen = |t: u32| member.seen.get(t as usize).copied().unwrap_or(false);
        let all = (0..member.mesh.triangles.len() as u32).into_par_iter();
        let candidates = all.filter(|&t| !is_seen(t) && is_near(t)).collect();
        buried.triangles = solids.buried(member.mesh, candidates, |_| TOUCH_M);
        for &t in &buried.triangles {
            buried.found.add(member.mesh, t as usize);
        }
    }
    buried
}

/// The meshes whose solids can bury something of others, or share a wall with them.
fn met(members: &[Member]) -> Vec<usize> {
    let bounds: Vec<Option<Bounds>> = members.iter().map(|member| member.mesh.bounds()).collect();
    let meets = |&index: &usize| {
        let others = bounds.iter().enumerate().filter(|&(other, _)| other != index);
        let grown = bounds[index].map(|(low, high)| (low - TOUCH_M, high + TOUCH_M));
        grown.is_some_and(|own| others.filter_map(|(_, other)| *other).any(|other| overlap(own, other)))
    };
    (0..members.len()).filter(|&index| members[index].has_solids).filter(meets).collect()
}

pub(super) fn overlap(a: Bounds, b: Bounds) -> bool {
    a.0.cmple(b.1).all() && b.0.cmple(a.1).all()
}
