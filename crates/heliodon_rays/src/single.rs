//! One ray at a time.

use crate::beam::{Entry, packet_of, usable};
use crate::scene::TriangleScene;
use crate::shear::Shear;
use crate::simd::{Engine, Vector, Work};
use crate::triangle::{Crossing, cross, met};
use crate::types::{Hit, Ray};
use crate::view::{Region, View, depth_at};
use std::marker::PhantomData;

/// What is asked of the triangles along a ray.
pub(crate) trait Question {
    /// What it is while nothing has been met.
    fn new(ray: &Ray) -> Self;

    /// Takes note of a triangle that is met.
    fn take(&mut self, crossing: &Crossing, shear: &Shear, triangle: u32, ray: &Ray);

    /// The distance from which on triangles no longer matter.
    fn far(&self, ray: &Ray) -> f32 {
        ray.t_max
    }

    /// Whether nothing more needs to be met.
    fn is_settled(&self) -> bool {
        false
    }
}

/// [`TriangleScene::closest`]
pub(crate) struct Closest(Hit);

/// [`TriangleScene::occluded`]
pub(crate) struct Any(bool);

/// [`TriangleScene::enclosures`]
pub(crate) struct Enclosures(i32);

impl Question for Closest {
    fn new(ray: &Ray) -> Self {
        Self(Hit { t: ray.t_max, ..Hit::MISS })
    }

    #[inline(always)]
    fn take(&mut self, crossing: &Crossing, shear: &Shear, triangle: u32, ray: &Ray) {
        self.0.take(crossing, shear, triangle, ray.t_min);
    }

    #[inline(always)]
    fn far(&self, _: &Ray) -> f32 {
        self.0.t
    }
}

impl Closest {
    pub fn hit(self) -> Hit {
        if self.0.is_some() { self.0 } else { Hit::MISS }
    }
}

impl Question for Any {
    fn new(_: &Ray) -> Self {
        Self(false)
    }

    #[inline(always)]
    fn take(&mut self, crossing: &Crossing, shear: &Shear, _: u32, ray: &Ray) {
        self.0 |= crossing.between(shear, ray);
    }

    #[inline(always)]
    fn is_settled(&self) -> bool {
        self.0
    }
}

impl Any {
    pub fn found(self) -> bool {
        self.0
    }
}

impl Question for Enclosures {
    fn new(_: &Ray) -> Self {
        Self(0)
    }

    #[inline(always)]
    fn take(&mut self, crossing: &Crossing, shear: &Shear, _: u32, ray: &Ray) {
        if crossing.between(shear, ray) {
            self.0 += if crossing.is_back(shear) { 1 } else { -1 };
        }
    }
}

impl Enclosures {
    pub fn count(self) -> i32 {
        self.0
    }
}

/// One question for each of some rays.
pub(crate) struct Trace<'a, Q, F> {
    scene: &'a TriangleScene,
    rays: &'a [Ray],
    answer: F,
    question: PhantomData<Q>,
}

impl<'a, Q: Question, F: FnMut(usize, Q)> Trace<'a, Q, F> {
    /// `answer` takes each ray's answer.
    pub fn new(scene: &'a TriangleScene, rays: &'a [Ray], answer: F) -> Self {
        Self { scene, rays, answer, question: PhantomData }
    }
}

impl<Q: Question, F: FnMut(usize, Q)> Work for Trace<'_, Q, F> {
    type Output = ();

    #[inline(always)]
    fn run<E: Engine>(mut self, engine: E) {
        let mut stack = Vec::with_capacity(self.scene.stack);
        for (i, ray) in self.rays.iter().enumerate() {
            (self.answer)(i, trace::<E, Q>(engine, self.scene, ray, &mut stack));
        }
    }
}

/// Walks the hierarchy.
#[inline(always)]
fn trace<E: Engine, Q: Question>(engine: E, scene: &TriangleScene, ray: &Ray, stack: &mut Vec<Entry>) -> Q {
    let origin = ray.origin - scene.center;
    let mut question = Q::new(ray);
    let Some(shear) = Shear::new(ray.direction) else { return question };
    if !usable(origin) {
        return question;
    }
    let view = View::new(engine, &shear);
    let start = shear.start(origin, scene.extent);
    let [p, q, depth, i, j, low, high] = start;
    // Deeper than the origin, or than a bit before the least distance.
    let region =
        Region { p: [p; 2], q: [q; 2], depth: depth_at(depth, ray.t_min, &shear, -1.0), reach: [i, j], across: [low, high] };
    let mut far = depth_at(depth, question.far(ray), &shear, 1.0);
    stack.clear();
    stack.push(Entry::root(1));
    while let Some(Entry { near, reference, .. }) = stack.pop() {
        if near > far {
            continue;
        }
        let Some(packet) = packet_of(reference) else {
            let node = &scene.nodes[reference as usize];
            let boxes = view.boxes(node);
            let mut mask = view.overlap(&boxes, &region) & view.nearer(&boxes, far);
            let near = boxes.depth[0].store();
            let first = stack.len();
            while mask != 0 {
                let child = mask.trailing_zeros() as usize % 8;
                mask &= mask - 1;
                Entry { near: near[child], reference: node.child[child], rays: 1 }.push(stack, first);
            }
            continue;
        };
        let packet = &scene.packets[packet];
        let (corners, boxes) = view.corners(packet);
        let mut mask = met(engine, &corners, &boxes, start);
        while mask != 0 {
            let lane = mask.trailing_zeros() as usize % 8;
            mask &= mask - 1;
            if let Some(crossing) = cross(&shear, packet, lane, start) {
                question.take(&crossing, &shear, packet.id[lane], ray);
                if question.is_settled() {
                    return question;
                }
                far = depth_at(depth, question.far(ray), &shear, 1.0);
            }
        }
    }
    question
}
