//! Beams: up to 64 rays of one direction, walked together.
//!
//! A beam is four groups of sixteen neighbours. A node is tested once for the whole beam, a packet once for each group
//! (eight boxes against one region: a handful of vector operations), and a triangle for sixteen rays at once.

use glam::Vec3;

use crate::build::MAX_COORDINATE;
use crate::layout::{LEAF, Node};
use crate::shear::Shear;
use crate::simd::{Engine, Vector};
use crate::view::{Region, View};

/// Groups of a beam.
pub(crate) const GROUPS: usize = 4;
/// Rays of a beam.
pub(crate) const RAYS: usize = 16 * GROUPS;

/// Rays of one direction.
#[repr(align(64))]
pub(crate) struct Beam {
    /// p, q and depth of the origins. Lanes without a ray repeat the last one.
    pub points: [[[f32; 16]; 3]; GROUPS],
    /// Bits of the rays that still ask.
    pub alive: [u16; GROUPS],
    /// Which origin each ray has.
    pub origin: [u32; RAYS],
}

/// Calls `walk` with one beam after another of the active origins, in their order.
#[inline(always)]
pub(crate) fn each_beam(origins: &[Vec3], active: &[u64], center: Vec3, shear: &Shear, mut walk: impl FnMut(&mut Beam)) {
    let mut beam = Beam { points: [[[0.0; 16]; 3]; GROUPS], alive: [0; GROUPS], origin: [0; RAYS] };
    let mut count = 0;
    for (word, &bits) in active.iter().enumerate() {
        let mut bits = bits;
        while bits != 0 {
            let index = word * 64 + bits.trailing_zeros() as usize;
            bits &= bits - 1;
            let Some(&origin) = origins.get(index) else { break };
            let relative = origin - center;
            if !usable(relative) {
                continue;
            }
            let point = shear.apply(relative);
            for (x, value) in point.into_iter().enumerate() {
                beam.points[count / 16][x][count % 16] = value;
            }
            beam.origin[count] = index as u32;
            count += 1;
            if count == RAYS {
                beam.alive = [u16::MAX; GROUPS];
                walk(&mut beam);
                count = 0;
            }
        }
    }
    if count > 0 {
        finish(&mut beam, count);
        walk(&mut beam);
    }
}

/// Whether rays from here are answered.
#[inline(always)]
pub(crate) fn usable(origin: Vec3) -> bool {
    origin.abs().cmple(Vec3::splat(MAX_COORDINATE)).all()
}

/// Fills the lanes behind the last ray.
fn finish(beam: &mut Beam, count: usize) {
    for lane in 0..RAYS {
        let (group, at) = (lane / 16, lane % 16);
        if lane >= count {
            for x in 0..3 {
                beam.points[group][x][at] = beam.points[(count - 1) / 16][x][(count - 1) % 16];
            }
        }
    }
    for group in 0..GROUPS {
        let rays = count.saturating_sub(16 * group).min(16);
        beam.alive[group] = ((1u32 << rays) - 1) as u16;
    }
}

/// Children of a node that a beam meets, nearest last.
#[inline(always)]
pub(crate) fn push_children<E: Engine>(view: &View<E>, node: &Node, region: &Region, limit: f32, stack: &mut Vec<(f32, u32)>) {
    let boxes = view.boxes(node);
    let mut mask = view.overlap(&boxes, region);
    if mask == 0 {
        return;
    }
    let near = boxes.depth[0].store();
    let first = stack.len();
    while mask != 0 {
        let child = mask.trailing_zeros() as usize % 8;
        mask &= mask - 1;
        let entry = (near[child], node.child[child]);
        if entry.0 > limit {
            continue;
        }
        stack.push(entry);
        let mut at = stack.len() - 1;
        while at > first && stack[at - 1].0 < entry.0 {
            stack[at] = stack[at - 1];
            at -= 1;
        }
        stack[at] = entry;
    }
}

/// The packet that a reference means, if it means one.
#[inline(always)]
pub(crate) fn packet_of(reference: u32) -> Option<usize> {
    (reference & LEAF != 0).then_some((reference & !LEAF) as usize)
}
