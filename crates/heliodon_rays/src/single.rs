//! One ray at a time.

use crate::beam::{Entry, packet_of, usable};
use crate::scene::TriangleScene;
use crate::shear::Shear;
use crate::simd::{Engine, Vector, Work};
use crate::triangle::{cross, met};
use crate::types::{Hit, Ray};
use crate::view::{Region, View, depth_at};

/// [`TriangleScene::closest`], and with `ANY` the first triangle found for [`TriangleScene::occluded`].
pub(crate) struct Trace<'a, const ANY: bool, F> {
    pub scene: &'a TriangleScene,
    pub rays: &'a [Ray],
    /// Takes each ray's answer.
    pub answer: F,
}

impl<const ANY: bool, F: FnMut(usize, Hit)> Work for Trace<'_, ANY, F> {
    type Output = ();

    #[inline(always)]
    fn run<E: Engine>(mut self, engine: E) {
        let mut stack = Vec::with_capacity(self.scene.stack);
        for (i, ray) in self.rays.iter().enumerate() {
            let hit = trace::<E, ANY>(engine, self.scene, ray, &mut stack);
            (self.answer)(i, if hit.is_some() { hit } else { Hit::MISS });
        }
    }
}

/// Walks the hierarchy; with `ANY` stops at the first triangle found.
#[inline(always)]
fn trace<E: Engine, const ANY: bool>(engine: E, scene: &TriangleScene, ray: &Ray, stack: &mut Vec<Entry>) -> Hit {
    let origin = ray.origin - scene.center;
    let mut hit = Hit { t: ray.t_max, ..Hit::MISS };
    let Some(shear) = Shear::new(ray.direction) else { return hit };
    if !usable(origin) {
        return hit;
    }
    let view = View::new(engine, &shear);
    let point = shear.apply(origin);
    let [p, q, depth, i, j] = point;
    // Deeper than the origin, or than a bit before the least distance.
    let region = Region { p: [p; 2], q: [q; 2], depth: depth_at(depth, ray.t_min, &shear, -1.0), reach: [i, j] };
    let mut far = depth_at(depth, ray.t_max, &shear, 1.0);
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
        let mut mask = met(engine, &corners, &boxes, point);
        while mask != 0 {
            let lane = mask.trailing_zeros() as usize % 8;
            mask &= mask - 1;
            if cross(&shear, packet, lane, point).is_some_and(|c| hit.take(&c, &shear, packet.id[lane], ray.t_min)) {
                if ANY {
                    return hit;
                }
                far = depth_at(depth, hit.t, &shear, 1.0);
            }
        }
    }
    hit
}
