//! [`TriangleScene`] and the batched questions.

use glam::Vec3;

use crate::fan::Fan;
use crate::hierarchy::Hierarchy;
use crate::layout::{Node, Packet};
use crate::nearest::Nearest;
use crate::occlude::Occlude;
use crate::refit::cost;
use crate::shear::Shear;
use crate::simd::{Instructions, dispatch};
use crate::single::{Any, Closest, Enclosures, Trace};
use crate::types::{Hit, Ray};

/// Entries of a walk's stack: for each level all children of a node but the one that is gone to, and a whole node's.
const STACK_BY_DEPTH: usize = 7;
const STACK: usize = 8;

/// Triangles in a hierarchy of bounding volumes, ready for rays.
///
/// All questions take `&self`, and threads are the caller's: cut the rays where you like, the answers are the same.
pub struct TriangleScene {
    pub(crate) nodes: Vec<Node>,
    pub(crate) packets: Vec<Packet>,
    /// Subtracted from everything.
    pub(crate) center: Vec3,
    /// The greatest coordinate of any triangle relative to the centre.
    pub(crate) extent: f32,
    /// Entries that a walk's stack may need.
    pub(crate) stack: usize,
    /// Triangles in no packet.
    pub(crate) left_out: Vec<u32>,
    bounds: Option<(Vec3, Vec3)>,
    /// [`cost`] of the hierarchy when it was built.
    built_cost: f32,
    instructions: Instructions,
}

impl TriangleScene {
    pub(crate) fn empty(left_out: Vec<u32>) -> Self {
        Self {
            left_out,
            built_cost: 0.0,
            nodes: vec![Node::EMPTY],
            packets: Vec::new(),
            center: Vec3::ZERO,
            extent: 0.0,
            stack: STACK,
            bounds: None,
            instructions: Instructions::best(),
        }
    }

    pub(crate) fn new(hierarchy: Hierarchy, left_out: Vec<u32>, center: Vec3, bounds: (Vec3, Vec3)) -> Self {
        let Hierarchy { nodes, packets, depth } = hierarchy;
        let built_cost = cost(&nodes);
        let stack = STACK_BY_DEPTH * depth + STACK;
        let mut scene = Self { nodes, packets, stack, built_cost, ..Self::empty(left_out) };
        scene.place(center, bounds);
        scene
    }

    /// How deep the hierarchy is.
    pub(crate) fn depth(&self) -> usize {
        (self.stack - STACK) / STACK_BY_DEPTH
    }

    /// Where the triangles lie: their bounds, and what is subtracted from them.
    pub(crate) fn place(&mut self, center: Vec3, bounds: (Vec3, Vec3)) {
        self.center = center;
        self.extent = (bounds.1 - center).max(center - bounds.0).max_element();
        self.bounds = Some(bounds);
    }

    /// How many times as much the hierarchy costs to ask as when it was built.
    pub(crate) fn wear(&self) -> f32 {
        cost(&self.nodes) / self.built_cost.max(f32::MIN_POSITIVE)
    }

    pub(crate) fn instructions(&self) -> Instructions {
        self.instructions
    }

    /// Lets the scene use these instructions, or the nearest that the processor has. Answers stay the same to the bit.
    #[must_use]
    pub fn with_instructions(mut self, instructions: Instructions) -> Self {
        self.instructions = instructions;
        self
    }

    /// The smallest and largest coordinates of the triangles that rays can meet; `None` without any.
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        self.bounds
    }

    /// What all coordinates are relative to where rays are answered: it decides how they are rounded. The same triangles give the same
    /// answers in two scenes if these have the same centre, and no others are in the way.
    #[must_use]
    pub fn center(&self) -> Vec3 {
        self.center
    }

    /// One more than the highest index of any triangle that it was built from: how many there were.
    pub fn triangle_count(&self) -> usize {
        let met = self.packets.iter().flat_map(Packet::triangles).map(|(_, id)| id);
        met.chain(self.left_out.iter().copied()).max().map_or(0, |last| last as usize + 1)
    }

    /// Bytes that the hierarchy and its triangles occupy.
    pub fn memory_bytes(&self) -> usize {
        self.nodes.capacity() * size_of::<Node>() + self.packets.capacity() * size_of::<Packet>()
    }

    /// Sets bit i % 64 of word i / 64 where ray i meets anything between its `t_min` and `t_max`, and clears the others.
    ///
    /// # Panics
    /// If `occluded` is not `rays.len().div_ceil(64)` words long.
    pub fn occluded(&self, rays: &[Ray], occluded: &mut [u64]) {
        assert_eq!(occluded.len(), rays.len().div_ceil(64), "one bit for each ray");
        occluded.fill(0);
        let answer = |i: usize, any: Any| occluded[i / 64] |= u64::from(any.found()) << (i % 64);
        dispatch(self.instructions, Trace::new(self, rays, answer));
    }

    /// The nearest triangle that each ray meets; of several at the same distance the one with the lowest index.
    /// Rays in no order are answered 1.3 to 1.5 times as fast if sorted by [`crate::morton_order`] of their origins, which takes a
    /// twentieth of their time or less.
    ///
    /// # Panics
    /// If there are not as many hits as rays.
    pub fn closest(&self, rays: &[Ray], hits: &mut [Hit]) {
        assert_eq!(hits.len(), rays.len(), "one hit for each ray");
        let answer = |i: usize, closest: Closest| hits[i] = closest.hit();
        dispatch(self.instructions, Trace::new(self, rays, answer));
    }

    /// How many more backs than fronts each ray meets, anywhere between its `t_min` and `t_max`. Along a ray without an end that is the
    /// number of closed surfaces which its start lies within (and of open ones, one for each that it leaves by the back without
    /// having come in): the winding number, seen in one direction. Its mean over directions tells inside from outside of surfaces
    /// that are not quite closed, or run into each other (A. Jacobson, L. Kavan, O. Sorkine-Hornung, "Robust Inside-Outside
    /// Segmentation Using Generalized Winding Numbers", ACM Transactions on Graphics 32(4), 2013).
    ///
    /// A ray through an edge may meet two triangles for one, so ask in several directions.
    ///
    /// # Panics
    /// If there are not as many counts as rays.
    pub fn enclosures(&self, rays: &[Ray], counts: &mut [i32]) {
        assert_eq!(counts.len(), rays.len(), "one count for each ray");
        let answer = |i: usize, enclosures: Enclosures| counts[i] = enclosures.count();
        dispatch(self.instructions, Trace::new(self, rays, answer));
    }

    /// Rays of one direction (the sun's, a sky direction's) from many origins, without an end: sets bit i % 64 of word
    /// i / 64 where `active` has it and the ray from origin i meets anything beyond the origin, and clears the others.
    /// Origins in the order of [`crate::beam_order`] are fastest, asked in runs of some 64 to 512: direction after direction for
    /// one run keeps what the run sees in the cache. For many directions see [`Self::occluded_fan`].
    ///
    /// # Panics
    /// If `active` and `occluded` are not `origins.len().div_ceil(64)` words long.
    pub fn occluded_parallel(&self, origins: &[Vec3], direction: Vec3, active: &[u64], occluded: &mut [u64]) {
        assert_eq!(active.len(), origins.len().div_ceil(64), "one bit for each origin");
        assert_eq!(occluded.len(), active.len(), "one bit for each origin");
        occluded.fill(0);
        let Some(shear) = Shear::new(direction) else { return };
        dispatch(self.instructions, Occlude { scene: self, origins, shear, active, occluded });
    }

    /// [`Self::occluded_parallel`] for many directions, best in an order in which neighbours are alike (the suns of a day): they
    /// share the way through the top of the hierarchy. Direction d has words `d * w..(d + 1) * w` of `active` and `occluded`,
    /// w being `origins.len().div_ceil(64)`. Origins in the order of [`crate::beam_order`] are fastest.
    ///
    /// # Panics
    /// If `active` and `occluded` are not w words long for each direction.
    pub fn occluded_fan(&self, origins: &[Vec3], directions: &[Vec3], active: &[u64], occluded: &mut [u64]) {
        assert_eq!(active.len(), origins.len().div_ceil(64) * directions.len(), "one bit for each origin and direction");
        assert_eq!(occluded.len(), active.len(), "one bit for each origin and direction");
        occluded.fill(0);
        dispatch(self.instructions, Fan { scene: self, origins, directions, active, occluded });
    }

    /// The nearest triangle beyond each origin in one direction, asked only where `active` has the bit; the other hits
    /// become [`Hit::MISS`]. Of several triangles at the same distance the one with the lowest index.
    ///
    /// # Panics
    /// If there are not as many hits as origins, or `active` is not `origins.len().div_ceil(64)` words long.
    pub fn closest_parallel(&self, origins: &[Vec3], direction: Vec3, active: &[u64], hits: &mut [Hit]) {
        assert_eq!(active.len(), origins.len().div_ceil(64), "one bit for each origin");
        assert_eq!(hits.len(), origins.len(), "one hit for each origin");
        hits.fill(Hit::MISS);
        let Some(shear) = Shear::new(direction) else { return };
        dispatch(self.instructions, Nearest { scene: self, origins, shear, active, hits });
    }
}
