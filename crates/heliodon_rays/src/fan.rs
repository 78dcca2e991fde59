//! Is anything in the way, for many directions? Beams that share where they enter the hierarchy.
//!
//! After A. Reshetov, A. Soupikov, J. Hurley, "Multi-Level Ray Tracing Algorithm", SIGGRAPH 2005: neighbouring directions from
//! one beam's origins fill a volume, which is walked once, as far as nodes are larger than the beam. What it meets, the
//! entries, is where each direction then begins. Over open ground there are none, and all its rays are free at once.
//!
//! Why this may leave nodes out without changing an answer: see [`Sweep::new`].

use glam::Vec3;

use crate::beam::{each_beam, push_children, usable};
use crate::layout::{LEAF, Node};
use crate::occlude::{Regions, walk};
use crate::scene::TriangleScene;
use crate::shear::Shear;
use crate::simd::{Engine, Mask, Vector, Work};

/// Directions that share their entries at most.
const SHARED: usize = 8;
/// Entries at most (but for one node's children); nodes that are left then are entries as they are.
const ENTRIES: usize = 32;

/// [`TriangleScene::occluded_fan`].
pub(crate) struct Fan<'a> {
    pub scene: &'a TriangleScene,
    pub origins: &'a [Vec3],
    pub directions: &'a [Vec3],
    pub active: &'a [u64],
    pub occluded: &'a mut [u64],
}

impl Work for Fan<'_> {
    type Output = ();

    #[inline(always)]
    fn run<E: Engine>(self, engine: E) {
        let Self { scene, origins, directions, active, occluded } = self;
        let words = origins.len().div_ceil(64);
        let shears: Vec<Option<Shear>> = directions.iter().map(|&d| Shear::new(d)).collect();
        let mut stack = Vec::with_capacity(scene.stack + 8 * ENTRIES);
        let mut entries = Entries::default();
        for (word, origins) in origins.chunks(64).enumerate() {
            let mut first = 0;
            while first < directions.len() {
                let Some(of_first) = &shears[first] else {
                    first += 1;
                    continue;
                };
                let like = |s: &&Option<Shear>| s.is_some_and(|s| s.axes == of_first.axes && s.forward == of_first.forward);
                let shared = shears[first..].iter().take(SHARED).take_while(like).count();
                let steps = first..first + shared;
                first += shared;
                let any = steps.clone().fold(0, |any, step| any | active[step * words + word]);
                let Some(sweep) = Sweep::new(engine, scene, origins, any, &shears[steps.clone()]) else { continue };
                entries.find(scene, &sweep);
                if entries.nodes.is_empty() {
                    continue;
                }
                for step in steps {
                    let at = step * words + word;
                    let Some(shear) = &shears[step] else { continue };
                    if active[at] == 0 {
                        continue;
                    }
                    each_beam(
                        engine,
                        scene,
                        origins,
                        &active[at..=at],
                        shear,
                        #[inline(always)]
                        |view, beam| {
                            let regions = &mut Regions::new(beam);
                            stack.clear();
                            for node in &entries.nodes {
                                push_children::<E, false>(view, node, beam.alive, beam, &regions.group, None, &mut stack);
                            }
                            let mut hit = walk(scene, view, beam, regions, &mut stack);
                            while hit != 0 {
                                occluded[at] |= 1 << beam.index[hit.trailing_zeros() as usize % 64];
                                hit &= hit - 1;
                            }
                        },
                    );
                }
            }
        }
    }
}

/// The volume that rays from a box of origins in a range of directions fill.
struct Sweep<E: Engine> {
    engine: E,
    axes: [usize; 3],
    near: usize,
    sign: E::F8,
    /// Least and greatest of the origins along axes i and j, the margin included.
    origins: [[E::F8; 2]; 2],
    /// And of their depths.
    depth: [E::F8; 2],
    /// Least and greatest slopes along axes i and j, for each unit of depth.
    slopes: [[E::F8; 2]; 2],
    /// Nodes no larger than this are entered by each direction.
    size: f32,
}

impl<E: Engine> Sweep<E> {
    /// Around those of up to 64 origins that `any` has a bit for; `None` if there are none.
    ///
    /// A ray's predicate asks that its sheared origin lies between the least and greatest sheared corners. With u = 2^-24 and
    /// M the greatest coordinate, either carries at most 3 u M (a product of values up to M, a difference up to 2 M), and
    /// what is computed here 2 u M of depth, 4 u M of its product with a slope of at most 1, and 3 u M of the sum. The margin
    /// of 32 u M exceeds the 15 u M of all these, so what lies outside fails the predicate of every ray.
    #[inline(always)]
    fn new(engine: E, scene: &TriangleScene, origins: &[Vec3], any: u64, shears: &[Option<Shear>]) -> Option<Self> {
        let asked = |i: usize| any >> i & 1 == 1;
        let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for (i, &origin) in origins.iter().enumerate() {
            let relative = origin - scene.center;
            if asked(i) && usable(relative) {
                (low, high) = (low.min(relative), high.max(relative));
            }
        }
        if low.x > high.x {
            return None;
        }
        let shear = shears.first()?.as_ref()?;
        let [i, j, k] = shear.axes;
        let sign = if shear.forward { 1.0 } else { -1.0 };
        let mut slopes = [[f32::INFINITY, f32::NEG_INFINITY]; 2];
        for shear in shears.iter().flatten() {
            for (of, slope) in slopes.iter_mut().zip(shear.slope) {
                *of = [of[0].min(sign * slope), of[1].max(sign * slope)];
            }
        }
        let margin = 16.0 * f32::EPSILON * scene.extent.max(low.abs().max(high.abs()).max_element());
        let splat = |x: f32| E::F8::splat(engine, x);
        let depth = if shear.forward { [low[k], high[k]] } else { [-high[k], -low[k]] };
        Some(Self {
            engine,
            axes: shear.axes,
            near: usize::from(!shear.forward),
            sign: splat(sign),
            origins: [i, j].map(|axis| [splat(low[axis] - margin), splat(high[axis] + margin)]),
            depth: depth.map(splat),
            slopes: slopes.map(|of| of.map(splat)),
            size: (high - low).max_element(),
        })
    }

    /// Which of a node's children lie in the volume.
    #[inline(always)]
    fn meets(&self, node: &Node) -> u32 {
        let [i, j, k] = self.axes;
        let load = |from: &[f32; 8]| E::F8::load(self.engine, from);
        let near = self.sign * load(&node.bounds[self.near][k]);
        let far = self.sign * load(&node.bounds[1 - self.near][k]);
        let way = [(near - self.depth[1]).max(E::F8::splat(self.engine, 0.0)), far - self.depth[0]];
        let mut met = self.depth[0].le(far);
        for (side, axis) in [i, j].into_iter().enumerate() {
            let [flat, steep] = self.slopes[side];
            let low = self.origins[side][0] + (flat * way[0]).min(flat * way[1]);
            let high = self.origins[side][1] + (steep * way[0]).max(steep * way[1]);
            met = met & load(&node.bounds[0][axis]).le(high) & low.le(load(&node.bounds[1][axis]));
        }
        met.bits()
    }
}

/// Where beams enter the hierarchy: copies of the children that their volume meets, packed into nodes.
#[derive(Default)]
struct Entries {
    nodes: Vec<Node>,
    count: usize,
    /// Nodes that are still to be opened.
    open: Vec<u32>,
}

impl Entries {
    #[inline(always)]
    fn find<E: Engine>(&mut self, scene: &TriangleScene, sweep: &Sweep<E>) {
        self.nodes.clear();
        self.open.clear();
        self.count = 0;
        self.open.push(0);
        let mut at = 0;
        while let Some(&reference) = self.open.get(at) {
            at += 1;
            let node = &scene.nodes[reference as usize];
            let mut met = sweep.meets(node);
            while met != 0 {
                let child = met.trailing_zeros() as usize % 8;
                met &= met - 1;
                let bounds = node.child_bounds(child);
                let large = (bounds[1] - bounds[0]).max_element() > sweep.size;
                if node.child[child] & LEAF == 0 && large && self.count + self.open.len() - at < ENTRIES {
                    self.open.push(node.child[child]);
                } else {
                    self.add(bounds, node.child[child]);
                }
            }
        }
    }

    #[inline(always)]
    fn add(&mut self, bounds: [Vec3; 2], reference: u32) {
        if self.count.is_multiple_of(8) {
            self.nodes.push(Node::EMPTY);
        }
        if let Some(node) = self.nodes.last_mut() {
            node.set(self.count % 8, bounds, reference);
        }
        self.count += 1;
    }
}
