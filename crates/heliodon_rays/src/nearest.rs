//! What is met first? For beams.

use glam::Vec3;

use crate::beam::{Beam, Entry, GROUPS, each_beam, packet_of, push_children};
use crate::layout::Packet;
use crate::scene::TriangleScene;
use crate::shear::Shear;
use crate::simd::{Engine, Work};
use crate::triangle::{cross, met};
use crate::types::Hit;
use crate::view::{View, depth_at, greatest};

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
        let mut found = Found { limit: [[0.0; 16]; GROUPS], group: [0.0; GROUPS], all: 0.0, hits: [[Hit::MISS; 16]; GROUPS] };
        each_beam(
            engine,
            scene,
            origins,
            active,
            &shear,
            #[inline(always)]
            |view, beam| {
                found.reset(beam);
                walk(scene, view, &shear, beam, &mut found, &mut stack);
                let asked = beam.alive.count_ones() as usize;
                for (origin, hit) in beam.index[..asked].iter().zip(found.hits.as_flattened()) {
                    hits[*origin as usize] = *hit;
                }
            },
        );
    }
}

/// The nearest hits so far.
struct Found {
    /// A depth beyond which each ray needs nothing more.
    limit: [[f32; 16]; GROUPS],
    group: [f32; GROUPS],
    all: f32,
    hits: [[Hit; 16]; GROUPS],
}

impl Found {
    #[inline(always)]
    fn reset(&mut self, beam: &Beam) {
        self.hits = [[Hit::MISS; 16]; GROUPS];
        for group in 0..GROUPS {
            for lane in 0..16 {
                let asks = beam.alive_in(group) >> lane & 1 == 1;
                self.limit[group][lane] = if asks { f32::INFINITY } else { f32::NEG_INFINITY };
            }
        }
        self.update();
    }

    #[inline(always)]
    fn update(&mut self) {
        self.group = core::array::from_fn(|g| greatest(&self.limit[g]));
        self.all = self.group.into_iter().fold(f32::NEG_INFINITY, f32::max);
    }
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
        if near > found.all {
            continue;
        }
        match packet_of(reference) {
            None => push_children::<E, true>(
                view,
                &scene.nodes[reference as usize],
                rays,
                beam,
                &regions,
                Some(&found.group),
                stack,
            ),
            Some(packet) => test(view, shear, &scene.packets[packet], near, rays, beam, found),
        }
    }
}

#[inline(always)]
fn test<E: Engine>(view: &View<E>, shear: &Shear, packet: &Packet, near: f32, rays: u64, beam: &Beam, found: &mut Found) {
    let (corners, boxes) = view.corners(packet);
    let (mut left, mut any) = (rays, false);
    while left != 0 {
        let ray = left.trailing_zeros() as usize % 64;
        left &= left - 1;
        let (group, lane) = (ray / 16, ray % 16);
        if near > found.limit[group][lane] {
            continue;
        }
        let point = beam.point(ray);
        let mut triangles = met(view.engine, &corners, &boxes, point);
        while triangles != 0 {
            let triangle = triangles.trailing_zeros() as usize % 8;
            triangles &= triangles - 1;
            let hit = &mut found.hits[group][lane];
            if cross(shear, packet, triangle, point).is_some_and(|c| hit.take(&c, shear, packet.id[triangle], 0.0)) {
                found.limit[group][lane] = depth_at(point[2], hit.t, shear, 1.0);
                any = true;
            }
        }
    }
    if any {
        found.update();
    }
}
