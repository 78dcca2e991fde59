//! Building: obvhs makes a binary hierarchy, which is then widened to eight children a node.
//!
//! With [`crate::plan`] the only module that knows obvhs (whose glam differs from the workspace's; boxes cross as plain numbers).

use glam::Vec3;
use obvhs::{
    Boundable,
    aabb::Aabb,
    bvh2::{Bvh2, reinsertion::ReinsertionOptimizer},
    ploc::{PlocBuilder, PlocSearchDistance, SortPrecision},
};

use crate::build::Quality;
use crate::layout::{LEAF, Node, Packet};
use crate::plan::{Plan, Shape, even_parts};

/// Nodes (the root first) and packets, both in the order of a walk from the root, and the depth of the tree.
pub(crate) struct Hierarchy {
    pub nodes: Vec<Node>,
    pub packets: Vec<Packet>,
    pub depth: usize,
}

struct Bounds([f32; 8]);

impl Boundable for Bounds {
    fn aabb(&self) -> Aabb {
        obvhs_cast(self.0)
    }
}

fn obvhs_cast(corners: [f32; 8]) -> Aabb {
    bytemuck::cast(corners)
}

fn binary(corners: &[[Vec3; 3]], quality: Quality) -> Bvh2 {
    let bounds: Vec<Bounds> = corners
        .iter()
        .map(|[a, b, c]| {
            let (lo, hi) = (a.min(*b).min(*c), a.max(*b).max(*c));
            Bounds([lo.x, lo.y, lo.z, 0.0, hi.x, hi.y, hi.z, 0.0])
        })
        .collect();
    let (distance, threshold, reinsertion) = match quality {
        Quality::Fast => (PlocSearchDistance::VeryLow, 2, 0.0),
        Quality::Balanced => (PlocSearchDistance::Medium, 3, 0.02),
        Quality::High => (PlocSearchDistance::High, 2, 1.0),
    };
    let indices = (0..corners.len() as u32).collect();
    let mut tree = PlocBuilder::new().build(distance, &bounds, indices, SortPrecision::U64, threshold);
    ReinsertionOptimizer::default().run(&mut tree, reinsertion, None);
    tree
}

/// Corner positions and the original index of each triangle; `corners` must not be empty.
pub(crate) fn build(corners: &[[Vec3; 3]], ids: &[u32], quality: Quality) -> Hierarchy {
    let tree = binary(corners, quality);
    let plan = Plan::new(&tree, corners);
    let mut out = Hierarchy { nodes: vec![Node::EMPTY], packets: Vec::new(), depth: 1 };
    // (binary node, wide node to fill, its depth)
    let mut work = vec![(0u32, 0usize, 1usize)];
    let mut slots = Vec::with_capacity(8);
    while let Some((binary, wide, depth)) = work.pop() {
        out.depth = out.depth.max(depth);
        if plan.shape(binary) != Shape::Node {
            for (slot, part) in even_parts(plan.triangles(binary)).enumerate() {
                let (packet, bounds) = packet(part, corners, ids);
                out.nodes[wide].set(slot, bounds, LEAF | out.packets.len() as u32);
                out.packets.push(packet);
            }
            continue;
        }
        slots.clear();
        plan.open(binary, &mut slots);
        for (slot, &child) in slots.iter().enumerate() {
            if plan.shape(child) == Shape::Packet {
                let (packet, bounds) = packet(plan.triangles(child), corners, ids);
                out.nodes[wide].set(slot, bounds, LEAF | out.packets.len() as u32);
                out.packets.push(packet);
                continue;
            }
            let aabb = tree.nodes[child as usize].aabb();
            let bounds = [aabb.min, aabb.max].map(|x| Vec3::new(x.x, x.y, x.z));
            let reference = out.nodes.len() as u32;
            out.nodes[wide].set(slot, bounds, reference);
            out.nodes.push(Node::EMPTY);
        }
        for (slot, &child) in slots.iter().enumerate().rev() {
            let reference = out.nodes[wide].child[slot];
            if reference & LEAF == 0 {
                work.push((child, reference as usize, depth + 1));
            }
        }
    }
    out.nodes.shrink_to_fit();
    out.packets.shrink_to_fit();
    out
}

/// Up to eight triangles, and their bounds.
fn packet(triangles: &[u32], corners: &[[Vec3; 3]], ids: &[u32]) -> (Packet, [Vec3; 2]) {
    let mut packet = Packet::EMPTY;
    let mut bounds = [Vec3::INFINITY, Vec3::NEG_INFINITY];
    for (lane, &triangle) in triangles.iter().enumerate() {
        packet.set(lane, corners[triangle as usize], &mut bounds);
        packet.id[lane] = ids[triangle as usize];
    }
    (packet, bounds)
}
