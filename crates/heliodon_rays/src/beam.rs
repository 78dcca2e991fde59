//! Beams: up to 64 rays of one direction, walked together.
//!
//! A beam is four groups of sixteen neighbours. The boxes of a node's children are computed once for the beam, and compared
//! with the region of each group that got there (eight boxes against one region: five comparisons), and the boxes that
//! pass with each of its rays (sixteen rays against one box: the same). A packet is sheared once for the beam, and its eight
//! triangles tested against one ray at a time.

use glam::Vec3;

use crate::build::MAX_COORDINATE;
use crate::layout::{LEAF, Node};
use crate::shear::Shear;
use crate::simd::{Engine, Vector};
use crate::triangle::boxed;
use crate::view::{Region, View};

/// Groups of a beam.
pub(crate) const GROUPS: usize = 4;

/// Rays of one direction.
#[repr(align(64))]
pub(crate) struct Beam {
    /// p, q and depth of the origins. Lanes without a ray repeat another one's.
    pub points: [[[f32; 16]; 3]; GROUPS],
    /// Bits of the rays that still ask, sixteen for each group.
    pub alive: u64,
    /// The origin that each group begins with.
    pub first: [usize; GROUPS],
}

/// Calls `walk` with one beam after another. Groups are sixteen origins in the order that they come in, so that their
/// tightness is the caller's to arrange; those in which nothing is active are left out.
#[inline(always)]
pub(crate) fn each_beam(origins: &[Vec3], active: &[u64], center: Vec3, shear: &Shear, mut walk: impl FnMut(&mut Beam)) {
    let mut beam = Beam { points: [[[0.0; 16]; 3]; GROUPS], alive: 0, first: [0; GROUPS] };
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
        beam.alive |= u64::from(alive) << (16 * count);
        beam.first[count] = 16 * group;
        count += 1;
        if count == GROUPS {
            walk(&mut beam);
            (beam.alive, count) = (0, 0);
        }
    }
    if count > 0 {
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

impl Beam {
    /// Bits of a group's rays that still ask.
    #[inline(always)]
    pub fn alive_in(&self, group: usize) -> u16 {
        (self.alive >> (16 * group)) as u16
    }

    /// Where each group's rays are.
    #[inline(always)]
    pub fn regions(&self) -> [Region; GROUPS] {
        let mut regions = [Region::NOTHING; GROUPS];
        for (group, region) in regions.iter_mut().enumerate() {
            if self.alive_in(group) != 0 {
                *region = Region::around(&self.points[group]);
            }
        }
        regions
    }

    /// (p, q, depth) of a ray's origin.
    #[inline(always)]
    pub fn point(&self, ray: usize) -> [f32; 3] {
        let [p, q, depth] = &self.points[ray / 16];
        [p[ray % 16], q[ray % 16], depth[ray % 16]]
    }
}

/// What a walk has still to do.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Entry {
    /// Depth at which it begins.
    pub near: f32,
    /// A node or a packet.
    pub reference: u32,
    /// Bits of the rays that pass through its box.
    pub rays: u64,
}

impl Entry {
    /// The root, for these rays.
    pub fn root(rays: u64) -> Self {
        Self { near: f32::NEG_INFINITY, reference: 0, rays }
    }

    /// Puts the entry on the stack, below those of the ones from `first` that begin nearer.
    #[inline(always)]
    pub fn push(self, stack: &mut Vec<Self>, first: usize) {
        stack.push(self);
        let mut at = stack.len() - 1;
        while at > first && stack[at - 1].near < self.near {
            stack[at] = stack[at - 1];
            at -= 1;
        }
        stack[at] = self;
    }
}

/// Pushes the children of a node that rays of a beam meet, with `SORTED` nearest last. A group's region rules out most
/// children at once, and what is left is asked of each of its rays; `limits` are depths beyond which groups need nothing.
///
/// Asking each ray is what makes beams faster than rays: nodes near the leaves are smaller than a group, and of some 55
/// packets that a group's region meets on a scan each is passed by one or two of its sixteen rays.
#[inline(always)]
pub(crate) fn push_children<E: Engine, const SORTED: bool>(
    view: &View<E>,
    node: &Node,
    rays: u64,
    beam: &Beam,
    regions: &[Region; GROUPS],
    limits: Option<&[f32; GROUPS]>,
    stack: &mut Vec<Entry>,
) {
    let boxes = view.boxes(node);
    let mut met = [0; GROUPS];
    let mut union = 0;
    for (group, met) in met.iter_mut().enumerate() {
        if (rays >> (16 * group)) as u16 != 0 {
            *met = view.overlap(&boxes, &regions[group]);
            if let Some(limits) = limits {
                *met &= view.nearer(&boxes, limits[group]);
            }
            union |= *met;
        }
    }
    if union == 0 {
        return;
    }
    let (near, spans) = (boxes.depth[0].store(), View::spans(&boxes));
    let first = stack.len();
    while union != 0 {
        let child = union.trailing_zeros() as usize % 8;
        union &= union - 1;
        let reference = node.child[child];
        let mut passing = 0;
        for (group, met) in met.iter().enumerate() {
            if met >> child & 1 == 1 {
                let of_group = boxed(view.engine, &spans, child, &beam.points[group]);
                passing |= u64::from(of_group) << (16 * group);
            }
        }
        passing &= beam.alive;
        if passing != 0 {
            let entry = Entry { near: near[child], reference, rays: passing };
            if SORTED {
                entry.push(stack, first);
            } else {
                stack.push(entry);
            }
        }
    }
}

/// The packet that a reference means, if it means one.
#[inline(always)]
pub(crate) fn packet_of(reference: u32) -> Option<usize> {
    (reference & LEAF != 0).then_some((reference & !LEAF) as usize)
}
