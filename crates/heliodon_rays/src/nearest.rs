//! What is met first? For beams.

use glam::Vec3;

use crate::beam::{Beam, GROUPS, RAYS, each_beam, packet_of, push_children};
use crate::layout::Packet;
use crate::scene::TriangleScene;
use crate::shear::Shear;
use crate::simd::{Engine, Work};
use crate::triangle::{covers, cross};
use crate::types::Hit;
use crate::view::{Region, View, depth_at, greatest};

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
        let view = View::new(engine, &self.shear);
        let mut stack = Vec::with_capacity(self.scene.stack);
        let mut found = Found { limit: [[0.0; 16]; GROUPS], group: [0.0; GROUPS], all: 0.0, hits: [Hit::MISS; RAYS] };
        each_beam(
            self.origins,
            self.active,
            self.scene.center,
            &self.shear,
            #[inline(always)]
            |beam| {
                found.reset(beam);
                walk(self.scene, &view, &self.shear, beam, &mut found, &mut stack);
                for (ray, hit) in found.hits.iter().enumerate() {
                    if beam.alive[ray / 16] >> (ray % 16) & 1 == 1 {
                        self.hits[beam.origin[ray] as usize] = *hit;
                    }
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
    hits: [Hit; RAYS],
}

impl Found {
    #[inline(always)]
    fn reset(&mut self, beam: &Beam) {
        self.hits = [Hit::MISS; RAYS];
        for group in 0..GROUPS {
            for lane in 0..16 {
                let asks = beam.alive[group] >> lane & 1 == 1;
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
    stack: &mut Vec<(f32, u32)>,
) {
    let regions: [Region; GROUPS] = core::array::from_fn(|group| match beam.alive[group] {
        0 => Region::NOTHING,
        _ => Region::around(&beam.points[group]),
    });
    let all = regions.into_iter().fold(Region::NOTHING, Region::union);
    stack.clear();
    stack.push((f32::NEG_INFINITY, 0));
    while let Some((near, reference)) = stack.pop() {
        if near > found.all {
            continue;
        }
        match packet_of(reference) {
            None => push_children(view, &scene.nodes[reference as usize], &all, found.all, stack),
            Some(packet) => test(view, shear, &scene.packets[packet], beam, &regions, found),
        }
    }
}

#[inline(always)]
fn test<E: Engine>(view: &View<E>, shear: &Shear, packet: &Packet, beam: &Beam, regions: &[Region; GROUPS], found: &mut Found) {
    let (corners, boxes) = view.corners(packet);
    let mut any = false;
    for group in 0..GROUPS {
        let mut mask = view.overlap(&boxes, &regions[group]) & view.nearer(&boxes, found.group[group]);
        while mask != 0 {
            let lane = mask.trailing_zeros() as usize % 8;
            mask &= mask - 1;
            let points = &beam.points[group];
            let mut through = covers::<E, false>(view.engine, &corners, lane, points, beam.alive[group]);
            while through != 0 {
                let ray = through.trailing_zeros() as usize % 16;
                through &= through - 1;
                let point = core::array::from_fn(|x| points[x][ray]);
                let hit = &mut found.hits[group * 16 + ray];
                if cross(&corners, lane, point).is_some_and(|c| hit.take(&c, shear, packet.id[lane], 0.0)) {
                    found.limit[group][ray] = depth_at(point[2], hit.t, shear, 1.0);
                    any = true;
                }
            }
        }
    }
    if any {
        found.update();
    }
}
