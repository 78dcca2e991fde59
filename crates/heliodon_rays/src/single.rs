//! One ray at a time.

use crate::beam::{packet_of, usable};
use crate::line::Line;
use crate::scene::TriangleScene;
use crate::shear::Shear;
use crate::simd::{Engine, Work};
use crate::triangle::{Crossing, cross};
use crate::types::{Hit, Ray};
use crate::view::depth_at;
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
        let mut stack = vec![Ahead::default(); self.scene.stack];
        for (i, ray) in self.rays.iter().enumerate() {
            (self.answer)(i, trace::<E, Q>(engine, self.scene, ray, &mut stack));
        }
    }
}

/// What a walk has still to do.
#[derive(Clone, Copy, Debug, Default)]
struct Ahead {
    /// Depth at which it begins.
    near: f32,
    /// A node or a packet.
    reference: u32,
}

/// Walks the hierarchy, what begins nearest first.
#[inline(always)]
fn trace<E: Engine, Q: Question>(engine: E, scene: &TriangleScene, ray: &Ray, stack: &mut [Ahead]) -> Q {
    let origin = ray.origin - scene.center;
    let mut question = Q::new(ray);
    let Some(shear) = Shear::new(ray.direction) else { return question };
    if !usable(origin) {
        return question;
    }
    let line = Line::new(engine, &shear, origin, scene.extent);
    let start = shear.start(origin, scene.extent);
    let mut far = depth_at(start[2], question.far(ray), &shear, 1.0);
    let (mut left, mut reference) = (0, 0);
    loop {
        if let Some(packet) = packet_of(reference) {
            let packet = &scene.packets[packet];
            let mut mask = line.met(packet, far);
            while mask != 0 {
                let lane = mask.trailing_zeros() as usize % 8;
                mask &= mask - 1;
                if let Some(crossing) = cross(&shear, packet, lane, start) {
                    question.take(&crossing, &shear, packet.id[lane], ray);
                    if question.is_settled() {
                        return question;
                    }
                    far = depth_at(start[2], question.far(ray), &shear, 1.0);
                }
            }
        } else {
            let node = &scene.nodes[reference as usize];
            let (mut mask, near) = line.passes(node, far);
            let first = left;
            while mask != 0 {
                let child = mask.trailing_zeros() as usize % 8;
                mask &= mask - 1;
                let ahead = Ahead { near: near[child], reference: node.child[child] };
                let mut at = left;
                while at > first && stack[at - 1].near < ahead.near {
                    stack[at] = stack[at - 1];
                    at -= 1;
                }
                stack[at] = ahead;
                left += 1;
            }
        }
        loop {
            if left == 0 {
                return question;
            }
            left -= 1;
            if stack[left].near <= far {
                reference = stack[left].reference;
                break;
            }
        }
    }
}
