//! Beams: up to 64 rays of one direction, walked together.
//!
//! A beam is four groups of sixteen neighbours. The boxes of a node's children, and of a packet's triangles, are computed
//! once for the beam and compared with the region of each group that got there (eight boxes against one region: five
//! comparisons), and a triangle is tested against sixteen rays at once.

use glam::Vec3;

use crate::build::MAX_COORDINATE;
use crate::layout::{LEAF, Node};
use crate::shear::Shear;
use crate::simd::{Engine, Vector};
use crate::view::{Region, View};

/// Groups of a beam.
pub(crate) const GROUPS: usize = 4;
/// All of them.
pub(crate) const ALL: u32 = (1 << GROUPS) - 1;

/// Rays of one direction.
#[repr(align(64))]
pub(crate) struct Beam {
    /// p, q and depth of the origins. Lanes without a ray repeat another one's.
    pub points: [[[f32; 16]; 3]; GROUPS],
    /// Bits of the rays that still ask.
    pub alive: [u16; GROUPS],
    /// The origin that each group begins with.
    pub first: [usize; GROUPS],
}

/// Calls `walk` with one beam after another. Groups are sixteen origins in the order that they come in, so that their
/// tightness is the caller's to arrange; those in which nothing is active are left out.
#[inline(always)]
pub(crate) fn each_beam(origins: &[Vec3], active: &[u64], center: Vec3, shear: &Shear, mut walk: impl FnMut(&mut Beam)) {
    let mut beam = Beam { points: [[[0.0; 16]; 3]; GROUPS], alive: [0; GROUPS], first: [0; GROUPS] };
    let mut count = 0;
    for (group, origins) in origins.chunks(16).enumerate() {
        let asked = (active[group / 4] >> (16 * (group % 4))) as u16;
        if asked == 0 {
            continue;
        }
        let alive = gather(origins, asked, center, shear, &mut beam.points[count]);
        if alive == 0 {
            continue;
        }
        beam.alive[count] = alive;
        beam.first[count] = 16 * group;
        count += 1;
        if count == GROUPS {
            walk(&mut beam);
            count = 0;
        }
    }
    if count > 0 {
        beam.alive[count..].fill(0);
        walk(&mut beam);
    }
}

/// The points of one group; which of them can be asked about.
#[inline(always)]
fn gather(origins: &[Vec3], asked: u16, center: Vec3, shear: &Shear, points: &mut [[f32; 16]; 3]) -> u16 {
    let mut alive = 0;
    for (lane, &origin) in origins.iter().enumerate() {
        let relative = origin - center;
        let [p, q, depth] = shear.apply(relative);
        points[0][lane] = p;
        points[1][lane] = q;
        points[2][lane] = depth;
        alive |= u16::from(usable(relative)) << lane;
    }
    alive &= asked;
    fill(points, alive);
    alive
}

/// Puts the first ray of `alive` into all lanes that are not alive, so that they do not widen anything.
#[inline(always)]
pub(crate) fn fill(points: &mut [[f32; 16]; 3], alive: u16) {
    let survivor = alive.trailing_zeros() as usize % 16;
    for points in points {
        let value = points[survivor];
        for (lane, point) in points.iter_mut().enumerate() {
            *point = if alive >> lane & 1 == 1 { *point } else { value };
        }
    }
}

/// Whether rays from here are answered.
#[inline(always)]
pub(crate) fn usable(origin: Vec3) -> bool {
    origin.abs().cmple(Vec3::splat(MAX_COORDINATE)).all()
}

/// What a walk has still to do.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Entry {
    /// Depth at which it begins.
    pub near: f32,
    /// A node or a packet.
    pub reference: u32,
    /// Bits of the groups that meet its box.
    pub groups: u32,
}

impl Entry {
    /// The root, for these groups.
    pub fn root(groups: u32) -> Self {
        Self { near: f32::NEG_INFINITY, reference: 0, groups }
    }
}

/// Pushes the children of a node that any of the groups meets before their `limit`s, nearest last.
#[inline(always)]
pub(crate) fn push_children<E: Engine, const N: usize>(
    view: &View<E>,
    node: &Node,
    groups: u32,
    regions: &[Region; N],
    limits: Option<&[f32; N]>,
    stack: &mut Vec<Entry>,
) {
    let boxes = view.boxes(node);
    let mut met = [0; N];
    let mut union = 0;
    for group in 0..N {
        if groups >> group & 1 == 1 {
            met[group] = view.overlap(&boxes, &regions[group]);
            if let Some(limits) = limits {
                met[group] &= view.nearer(&boxes, limits[group]);
            }
            union |= met[group];
        }
    }
    if union == 0 {
        return;
    }
    let near = boxes.depth[0].store();
    let first = stack.len();
    while union != 0 {
        let child = union.trailing_zeros() as usize % 8;
        union &= union - 1;
        let groups = (0..N).fold(0, |bits, group| bits | (met[group] >> child & 1) << group);
        let entry = Entry { near: near[child], reference: node.child[child], groups };
        stack.push(entry);
        let mut at = stack.len() - 1;
        while at > first && stack[at - 1].near < entry.near {
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
