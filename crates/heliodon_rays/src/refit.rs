//! Triangles that move: the hierarchy keeps its shape and gets new bounds (I. Wald, S. Boulos, P. Shirley: "Ray Tracing Deformable Scenes Using
//! Dynamic Bounding Volume Hierarchies", ACM Transactions on Graphics 26(1), 2007), until that has made it so much worse that building pays.

use glam::Vec3;
use rayon::prelude::*;

use crate::build::{BuildError, BuildParams, usable_corners};
use crate::layout::{LEAF, Node, Packet};
use crate::scene::TriangleScene;

/// A hierarchy that costs so many times what it cost when it was built is built anew.
const WORN: f32 = 1.5;

impl TriangleScene {
    /// The same triangles with other positions: answers are to the bit those of a scene built from them, at a small part of the time. Where the
    /// hierarchy would become slow to ask, it is built. `triangles` must be those that the scene was built from.
    ///
    /// # Errors
    /// See [`BuildError`].
    pub fn refit(&mut self, positions: &[Vec3], triangles: &[[u32; 3]], params: &BuildParams) -> Result<(), BuildError> {
        let named = triangles.par_iter().all(|corners| corners.iter().all(|&c| (c as usize) < positions.len()));
        let kept = self.packets.iter().flat_map(Packet::triangles).map(|(_, id)| id);
        let known = kept.clone().chain(self.left_out.iter().copied()).all(|id| (id as usize) < triangles.len())
            && kept.count() + self.left_out.len() == triangles.len();
        if !(named && known && self.move_triangles(positions, triangles)) {
            *self = Self::build(positions, triangles, params)?.with_instructions(self.instructions());
        }
        Ok(())
    }

    /// Gives packets and nodes their new bounds; answers whether the hierarchy is still good.
    fn move_triangles(&mut self, positions: &[Vec3], triangles: &[[u32; 3]]) -> bool {
        let corners = |id: u32| triangles[id as usize].map(|c| positions[c as usize]);
        // What had no extent is in no packet.
        if self.left_out.iter().any(|&id| usable_corners(&corners(id))) {
            return false;
        }
        let nothing = || (Vec3::INFINITY, Vec3::NEG_INFINITY);
        let (low, high) = self
            .packets
            .par_iter()
            .map(|packet| {
                let kept = packet.triangles().map(|(_, id)| corners(id)).filter(usable_corners);
                kept.flatten().fold(nothing(), |(low, high), x| (low.min(x), high.max(x)))
            })
            .reduce(nothing, |a, b| (a.0.min(b.0), a.1.max(b.1)));
        if !low.cmple(high).all() {
            return false;
        }
        let center = 0.5 * low + 0.5 * high;
        let bounds: Vec<[Vec3; 2]> = self
            .packets
            .par_iter_mut()
            .map(|packet| {
                let mut bounds = [Vec3::INFINITY, Vec3::NEG_INFINITY];
                *packet = Packet { id: packet.id, ..Packet::EMPTY };
                for (lane, id) in packet.triangles() {
                    let corners = corners(id);
                    if usable_corners(&corners) {
                        packet.set(lane, corners.map(|x| x - center), &mut bounds);
                    }
                }
                bounds
            })
            .collect();
        // Children come after their parents.
        for i in (0..self.nodes.len()).rev() {
            for slot in 0..8 {
                let reference = self.nodes[i].child[slot];
                if reference != Node::NO_CHILD {
                    let of_leaf = || bounds[(reference & !LEAF) as usize];
                    let of_node = || self.nodes[reference as usize].all_bounds();
                    let child = if reference & LEAF != 0 { of_leaf() } else { of_node() };
                    self.nodes[i].set(slot, child, reference);
                }
            }
        }
        self.place(center, (low, high));
        self.wear() <= WORN
    }
}

/// What a ray may be expected to visit: the areas of all children's boxes over that of the whole (the surface area heuristic).
pub(crate) fn cost(nodes: &[Node]) -> f32 {
    let half_area = |[low, high]: [Vec3; 2]| {
        let e = (high - low).max(Vec3::ZERO);
        e.x * e.y + e.y * e.z + e.z * e.x
    };
    let whole = half_area(nodes[0].all_bounds());
    let children: f32 = nodes.iter().flat_map(|node| (0..8).map(|slot| half_area(node.child_bounds(slot)))).sum();
    if whole > 0.0 { children / whole } else { 0.0 }
}
