//! Beams: up to 64 rays of one direction, walked together.
//!
//! A beam is four groups of sixteen neighbours. The boxes of a node's children are computed once for the beam, and compared
//! with the region of each group that got there (eight boxes against one region: nine comparisons), and the boxes that
//! pass with each of its rays (sixteen rays against one box: the same). A packet is sheared once for the beam, and its eight
//! triangles tested against one ray at a time. Groups of which at most two rays are left ask with those.

use glam::Vec3;

use crate::build::MAX_COORDINATE;
use crate::layout::{LEAF, Node};
use crate::scene::TriangleScene;
use crate::shear::{LEAST_ACROSS, Shear, Start};
use crate::simd::{Engine, Mask, Vector};
use crate::triangle::boxed;
use crate::view::{Region, View, greatest};

/// Groups of a beam.
pub(crate) const GROUPS: usize = 4;

/// Rays of a group at most that are asked one by one about a node's eight boxes. More is slower on scans.
const FEW: u32 = 2;

/// Rays of one direction.
#[repr(align(64))]
pub(crate) struct Beam {
    /// The origins, sheared. Lanes without a ray repeat another one's.
    pub points: [[[f32; 16]; 7]; GROUPS],
    /// Bits of the rays that still ask, sixteen for each group.
    pub alive: u64,
    /// Which origin each ray starts from.
    pub index: [u32; 16 * GROUPS],
}

/// Calls `walk` with one beam after another: of the origins that are asked about in the order that they come in, so that
/// their tightness is the caller's to arrange, and a few that are asked about among many fill beams as well.
#[inline(always)]
pub(crate) fn each_beam<E: Engine>(
    engine: E,
    scene: &TriangleScene,
    origins: &[Vec3],
    active: &[u64],
    shear: &Shear,
    mut walk: impl FnMut(&View<E>, &mut Beam),
) {
    let view = View::new(engine, shear);
    let mut beam = Beam { points: [[[0.0; 16]; 7]; GROUPS], alive: 0, index: [0; 16 * GROUPS] };
    // By group and axis, relative to the scene's centre.
    let mut lanes = [[[0.0; 16]; 3]; GROUPS];
    let mut count = 0;
    for (word, (&active, origins)) in active.iter().zip(origins.chunks(64)).enumerate() {
        let mut asked = active & u64::MAX >> (64 - origins.len());
        while asked != 0 {
            let bit = asked.trailing_zeros() as usize;
            asked &= asked - 1;
            let relative = origins[bit] - scene.center;
            if !usable(relative) {
                continue;
            }
            for (axis, value) in relative.to_array().into_iter().enumerate() {
                lanes[count / 16][axis][count % 16] = value;
            }
            beam.index[count] = (64 * word + bit) as u32;
            count += 1;
            if count == 16 * GROUPS {
                beam.fill(engine, &mut lanes, count, shear, scene.extent);
                walk(&view, &mut beam);
                count = 0;
            }
        }
    }
    if count > 0 {
        beam.fill(engine, &mut lanes, count, shear, scene.extent);
        walk(&view, &mut beam);
    }
}

/// Puts the first ray of `alive` into all lanes that are not alive, so that they do not widen anything.
#[inline(always)]
pub(crate) fn fill<const N: usize>(points: &mut [[f32; 16]; N], alive: u16) {
    let survivor = alive.trailing_zeros() as usize % 16;
    let mut dead = !alive;
    while dead != 0 {
        let lane = dead.trailing_zeros() as usize % 16;
        dead &= dead - 1;
        for row in &mut *points {
            row[lane] = row[survivor];
        }
    }
}

/// Whether rays from here are answered.
#[inline(always)]
pub(crate) fn usable(origin: Vec3) -> bool {
    origin.abs().cmple(Vec3::splat(MAX_COORDINATE)).all()
}

impl Beam {
    /// Becomes the beam of the first `count` lanes.
    #[inline(always)]
    fn fill<E: Engine>(&mut self, engine: E, lanes: &mut [[[f32; 16]; 3]; GROUPS], count: usize, shear: &Shear, extent: f32) {
        self.alive = u64::MAX >> (64 - count);
        for (group, lanes) in lanes.iter_mut().enumerate().take(count.div_ceil(16)) {
            fill(lanes, self.alive_in(group));
            let [i, j, k] = shear.axes.map(|axis| E::F16::load(engine, &lanes[axis]));
            let splat = |x: f32| E::F16::splat(engine, x);
            let forward = if shear.forward { 1.0 } else { -1.0 };
            let across = splat(shear.slope[1]) * i - splat(shear.slope[0]) * j;
            let zero = splat(0.0);
            let size = i.max(zero - i).max(j.max(zero - j)).max(k.max(zero - k));
            let margin = splat(shear.across_margin()) * splat(extent).max(size) + splat(LEAST_ACROSS);
            self.points[group] = [
                i - splat(shear.slope[0]) * k,
                j - splat(shear.slope[1]) * k,
                splat(forward) * k,
                splat(shear.sign[0]) * i,
                splat(shear.sign[1]) * j,
                across - margin,
                across + margin,
            ]
            .map(|row| row.store());
        }
    }

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

    /// A ray's origin, sheared.
    #[inline(always)]
    pub fn start(&self, ray: usize) -> Start {
        let [p, q, depth, i, j, low, high] = &self.points[ray / 16];
        let lane = ray % 16;
        [p[lane], q[lane], depth[lane], i[lane], j[lane], low[lane], high[lane]]
    }
}

/// Depths beyond which nothing is needed: by each ray, by any of a group, and by any.
pub(crate) struct Limits {
    pub of_ray: [[f32; 16]; GROUPS],
    pub of_group: [f32; GROUPS],
    pub of_all: f32,
}

impl Limits {
    /// Of rays that need whatever there is, and of those that are not there.
    #[inline(always)]
    pub fn new(beam: &Beam) -> Self {
        let mut limits = Self { of_ray: [[f32::NEG_INFINITY; 16]; GROUPS], of_group: [0.0; GROUPS], of_all: 0.0 };
        for (ray, limit) in limits.of_ray.as_flattened_mut().iter_mut().enumerate() {
            if beam.alive >> ray & 1 == 1 {
                *limit = f32::INFINITY;
            }
        }
        limits.update();
        limits
    }

    /// After those of rays have changed.
    #[inline(always)]
    pub fn update(&mut self) {
        self.of_group = core::array::from_fn(|group| greatest(&self.of_ray[group]));
        self.of_all = self.of_group.into_iter().fold(f32::NEG_INFINITY, f32::max);
    }

    /// Those of some rays to which what begins at a depth still matters.
    #[inline(always)]
    pub fn asking<E: Engine>(&self, engine: E, near: f32, rays: u64) -> u64 {
        let near = E::F16::splat(engine, near);
        let mut asking = 0;
        for (group, of_ray) in self.of_ray.iter().enumerate() {
            if rays >> (16 * group) & 0xffff != 0 {
                asking |= u64::from(near.le(E::F16::load(engine, of_ray)).bits()) << (16 * group);
            }
        }
        rays & asking
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
/// children at once, and what is left is asked of each of its rays; what begins beyond their `limits` is passed over.
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
    limits: Option<&Limits>,
    stack: &mut Vec<Entry>,
) {
    let boxes = view.boxes(node);
    // Near the leaves, most nodes are passed by one ray.
    if rays.is_power_of_two() {
        let ray = rays.trailing_zeros() as usize % 64;
        let mut mask = view.overlap_start(&boxes, beam.start(ray));
        if let Some(limits) = limits {
            mask &= view.nearer(&boxes, limits.of_ray[ray / 16][ray % 16]);
        }
        let (near, first) = (boxes.depth[0].store(), stack.len());
        while mask != 0 {
            let child = mask.trailing_zeros() as usize % 8;
            mask &= mask - 1;
            let entry = Entry { near: near[child], reference: node.child[child], rays };
            if SORTED {
                entry.push(stack, first);
            } else {
                stack.push(entry);
            }
        }
        return;
    }
    let mut met = [0; GROUPS];
    let mut passing = [0u64; 8];
    let (mut union, mut sparse) = (0, 0);
    for (group, met) in met.iter_mut().enumerate() {
        let mut few = rays & 0xffff << (16 * group);
        if few == 0 {
            continue;
        }
        if few.count_ones() <= FEW {
            while few != 0 {
                let ray = few.trailing_zeros() as usize % 64;
                few &= few - 1;
                let limit = limits.map_or(u32::MAX, |limits| view.nearer(&boxes, limits.of_ray[ray / 16][ray % 16]));
                let mut mask = limit & view.overlap_start(&boxes, beam.start(ray));
                sparse |= mask;
                while mask != 0 {
                    passing[mask.trailing_zeros() as usize % 8] |= 1 << ray;
                    mask &= mask - 1;
                }
            }
        } else {
            let limit = limits.map_or(u32::MAX, |limits| view.nearer(&boxes, limits.of_group[group]));
            *met = limit & view.overlap(&boxes, &regions[group]);
            union |= *met;
        }
    }
    if union | sparse == 0 {
        return;
    }
    let (near, spans) = (boxes.depth[0].store(), View::spans(&boxes));
    let first = stack.len();
    let mut all = union | sparse;
    while all != 0 {
        let child = all.trailing_zeros() as usize % 8;
        all &= all - 1;
        let reference = node.child[child];
        let mut passing = passing[child];
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
