//! Is anything in the way? For beams.

use glam::Vec3;

use crate::beam::{Beam, Entry, GROUPS, each_beam, fill, packet_of, push_children};
use crate::layout::Packet;
use crate::scene::TriangleScene;
use crate::shear::Shear;
use crate::simd::{Engine, Work};
use crate::triangle::met;
use crate::view::{Region, View};

/// [`TriangleScene::occluded_parallel`].
pub(crate) struct Occlude<'a> {
    pub scene: &'a TriangleScene,
    pub origins: &'a [Vec3],
    pub shear: Shear,
    pub active: &'a [u64],
    pub occluded: &'a mut [u64],
}

impl Work for Occlude<'_> {
    type Output = ();

    #[inline(always)]
    fn run<E: Engine>(self, engine: E) {
        let Self { scene, origins, shear, active, occluded } = self;
        let mut stack = Vec::with_capacity(scene.stack);
        each_beam(
            engine,
            scene,
            origins,
            active,
            &shear,
            #[inline(always)]
            |view, beam| {
                stack.clear();
                stack.push(Entry::root(beam.alive));
                let mut hit = walk(scene, view, beam, &mut Regions::new(beam), &mut stack);
                while hit != 0 {
                    let origin = beam.index[hit.trailing_zeros() as usize % 64];
                    hit &= hit - 1;
                    occluded[origin as usize / 64] |= 1 << (origin % 64);
                }
            },
        );
    }
}

/// Takes the rays that meet something out of `beam.alive` and returns them; `stack` tells where to look.
#[inline(always)]
pub(crate) fn walk<E: Engine>(
    scene: &TriangleScene,
    view: &View<E>,
    beam: &mut Beam,
    regions: &mut Regions,
    stack: &mut Vec<Entry>,
) -> u64 {
    let asked = beam.alive;
    while let Some(Entry { reference, rays, .. }) = stack.pop() {
        let rays = rays & beam.alive;
        if rays == 0 {
            continue;
        }
        let Some(packet) = packet_of(reference) else {
            push_children::<E, false>(view, &scene.nodes[reference as usize], rays, beam, &regions.group, None, stack);
            continue;
        };
        let occluded = test(view, &scene.packets[packet], rays, beam);
        beam.alive &= !occluded;
        if beam.alive == 0 {
            break;
        }
        if occluded != 0 {
            regions.shrink(beam);
        }
    }
    asked & !beam.alive
}

/// Which of the rays meet a triangle of the packet.
#[inline(always)]
fn test<E: Engine>(view: &View<E>, packet: &Packet, rays: u64, beam: &Beam) -> u64 {
    let (corners, boxes) = view.corners(packet);
    let (mut left, mut occluded) = (rays, 0);
    while left != 0 {
        let ray = left.trailing_zeros() as usize % 64;
        left &= left - 1;
        let hit = met(view.engine, &corners, &boxes, beam.start(ray), f32::INFINITY) != 0;
        occluded |= u64::from(hit) << ray;
    }
    occluded
}

/// Where a beam's rays are, kept up as they end.
pub(crate) struct Regions {
    pub group: [Region; GROUPS],
    /// Rays of each group when its region was computed.
    rays: [u32; GROUPS],
}

impl Regions {
    #[inline(always)]
    pub fn new(beam: &Beam) -> Self {
        Self { group: beam.regions(), rays: core::array::from_fn(|group| beam.alive_in(group).count_ones()) }
    }

    /// Shrinks the regions of groups that lost half their rays. (Every time would cost more than it saves.)
    #[inline(always)]
    fn shrink(&mut self, beam: &mut Beam) {
        for group in 0..GROUPS {
            let alive = beam.alive_in(group);
            let rays = alive.count_ones();
            if rays != 0 && rays * 2 <= self.rays[group] {
                self.rays[group] = rays;
                fill(&mut beam.points[group], alive);
                self.group[group] = Region::around(&beam.points[group]);
            }
        }
    }
}
