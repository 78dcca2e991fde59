//! What is met first? For beams.

use glam::Vec3;

use crate::beam::{Beam, Entry, GROUPS, Limits, each_beam, packet_of, push_children};
use crate::layout::Packet;
use crate::scene::TriangleScene;
use crate::shear::Shear;
use crate::simd::{Engine, Work};
use crate::triangle::{cross, met};
use crate::types::Hit;
use crate::view::{View, depth_at};

/// [`TriangleScene::closest_parallel`].
pub(crate) struct Nearest<'a> {
    pub scene: &'a TriangleScene,
    pub origins: &'a [Vec3],
    pub shear: Shear,
    pub active: &'a [u64],
    pub hits: &'a mut [Hit],
}

impl Work for Nearest<'_> {
    type Output = ();

    #[inline(always)]
    fn run<E: Engine>(self, engine: E) {
        let Self { scene, origins, shear, active, hits } = self;
        let mut stack = Vec::with_capacity(scene.stack);
        each_beam(
            engine,
            scene,
            origins,
            active,
            &shear,
            #[inline(always)]
            |view, beam| {
                let mut found = Found { limits: Limits::new(beam), hits: [[Hit::MISS; 16]; GROUPS] };
                walk(scene, view, &shear, beam, &mut found, &mut stack);
                let asked = beam.alive.count_ones() as usize;
                for (origin, hit) in beam.index[..asked].iter().zip(found.hits.as_flattened()) {
                    hits[*origin as usize] = *hit;
                }
            },
        );
    }
}

/// The nearest hits so far, and the depths that they leave to be asked about.
struct Found {
    limits: Limits,
    hits: [[Hit; 16]; GROUPS],
}

#[inline(always)]
fn walk<E: Engine>(
    scene: &TriangleScene,
    view: &View<E>,
    shear: &Shear,
    beam: &Beam,
    found: &mut Found,
    stack: &mut Vec<Entry>,
) {
    let regions = beam.regions();
    stack.clear();
    stack.push(Entry::root(beam.alive));
    while let Some(Entry { near, reference, rays }) = stack.pop() {
        if near > found.limits.of_all {
            continue;
        }
        let rays = found.limits.asking(view.engine, near, rays);
        if rays == 0 {
            continue;
        }
        match packet_of(reference) {
            None => push_children::<E, true>(
                view,
                &scene.nodes[reference as usize],
                rays,
                beam,
                &regions,
                Some(&found.limits),
                stack,
            ),
            Some(packet) => test(view, shear, &scene.packets[packet], rays, beam, found),
        }
    }
}

#[inline(always)]
fn test<E: Engine>(view: &View<E>, shear: &Shear, packet: &Packet, rays: u64, beam: &Beam, found: &mut Found) {
    let (corners, boxes) = view.corners(packet);
    let (mut left, mut any) = (rays, false);
    while left != 0 {
        let ray = left.trailing_zeros() as usize % 64;
        left &= left - 1;
        let (group, lane) = (ray / 16, ray % 16);
        let start = beam.start(ray);
        let mut triangles = met(view.engine, &corners, &boxes, start, found.limits.of_ray[group][lane]);
        while triangles != 0 {
            let triangle = triangles.trailing_zeros() as usize % 8;
            triangles &= triangles - 1;
            let hit = &mut found.hits[group][lane];
            if cross(shear, packet, triangle, start).is_some_and(|c| hit.take(&c, shear, packet.id[triangle], 0.0)) {
                found.limits.of_ray[group][lane] = depth_at(start[2], hit.t, shear, 1.0);
                any = true;
            }
        }
    }
    if any {
        found.limits.update();
    }
}
