//! Building: obvhs makes a binary hierarchy, which is then widened to eight children a node.
//!
//! The only module that knows obvhs (whose glam differs from the workspace's; boxes cross as plain numbers).

use glam::Vec3;
use obvhs::{
    Boundable,
    aabb::Aabb,
    bvh2::{Bvh2, reinsertion::ReinsertionOptimizer},
    ploc::{PlocBuilder, PlocSearchDistance, SortPrecision},
};

use crate::build::Quality;
use crate::layout::{LEAF, Node, Packet};

/// Nodes (the root first) and packets, both in the order of a walk from the root, and the depth of the tree.
pub(crate) struct Hierarchy {
    pub nodes: Vec<Node>,
    pub packets: Vec<Packet>,
    pub depth: usize,
}

/// Subtrees of at most this many triangles become one node of evenly filled packets. Cutting where the tree does instead
/// filled them less than half, which cost more memory and more time.
const PACKED: usize = 64;

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
        Quality::High => (PlocSearchDistance::High, 2, 0.15),
    };
    let indices = (0..corners.len() as u32).collect();
    let mut tree = PlocBuilder::new().build(distance, &bounds, indices, SortPrecision::U64, threshold);
    ReinsertionOptimizer::default().run(&mut tree, reinsertion, None);
    tree
}

/// Triangles under every node.
fn triangle_counts(tree: &Bvh2) -> Vec<u32> {
    let mut order = Vec::with_capacity(tree.nodes.len());
    let mut stack = vec![0u32];
    while let Some(i) = stack.pop() {
        order.push(i);
        let node = &tree.nodes[i as usize];
        if !node.is_leaf() {
            stack.extend([node.first_index, node.first_index + 1]);
        }
    }
    let mut counts = vec![0; tree.nodes.len()];
    for &i in order.iter().rev() {
        let node = &tree.nodes[i as usize];
        let first = node.first_index as usize;
        counts[i as usize] = if node.is_leaf() { node.prim_count } else { counts[first] + counts[first + 1] };
    }
    counts
}

/// Corner positions and the original index of each triangle; `corners` must not be empty.
pub(crate) fn build(corners: &[[Vec3; 3]], ids: &[u32], quality: Quality) -> Hierarchy {
    let tree = binary(corners, quality);
    let counts = triangle_counts(&tree);
    let mut out = Hierarchy { nodes: vec![Node::EMPTY], packets: Vec::new(), depth: 1 };
    // (binary node, wide node to fill, its depth)
    let mut work = vec![(0u32, 0usize, 1usize)];
    let (mut slots, mut triangles) = (Vec::with_capacity(8), Vec::with_capacity(PACKED));
    while let Some((binary, wide, depth)) = work.pop() {
        out.depth = out.depth.max(depth);
        if counts[binary as usize] as usize <= PACKED {
            triangles.clear();
            gather(&tree, binary, &mut triangles);
            let packets = triangles.len().div_ceil(8);
            for slot in 0..packets {
                let part = &triangles[slot * triangles.len() / packets..(slot + 1) * triangles.len() / packets];
                let (packet, bounds) = packet(part, corners, ids);
                out.nodes[wide].set(slot, bounds, LEAF | out.packets.len() as u32);
                out.packets.push(packet);
            }
            continue;
        }
        open(&tree, &counts, binary, &mut slots);
        for (slot, &child) in slots.iter().enumerate() {
            if counts[child as usize] <= 8 {
                triangles.clear();
                gather(&tree, child, &mut triangles);
                let (packet, bounds) = packet(&triangles, corners, ids);
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

/// Up to eight descendants of a node that cover it: the largest is opened as long as there is room.
fn open(tree: &Bvh2, counts: &[u32], root: u32, slots: &mut Vec<u32>) {
    slots.clear();
    slots.push(root);
    while slots.len() < 8 {
        let largest = slots
            .iter()
            .enumerate()
            .filter(|(_, s)| counts[**s as usize] as usize > PACKED)
            .max_by(|a, b| {
                let area = |s: u32| tree.nodes[s as usize].aabb().half_area();
                area(*a.1).total_cmp(&area(*b.1))
            })
            .map(|(at, _)| at);
        let Some(at) = largest else { break };
        let first = tree.nodes[slots[at] as usize].first_index;
        slots[at] = first;
        slots.insert(at + 1, first + 1);
    }
}

/// The triangles under a node, in the tree's order.
fn gather(tree: &Bvh2, root: u32, triangles: &mut Vec<u32>) {
    let mut stack = vec![root];
    while let Some(i) = stack.pop() {
        let node = &tree.nodes[i as usize];
        if node.is_leaf() {
            let first = node.first_index as usize;
            triangles.extend_from_slice(&tree.primitive_indices[first..first + node.prim_count as usize]);
        } else {
            stack.extend([node.first_index + 1, node.first_index]);
        }
    }
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
