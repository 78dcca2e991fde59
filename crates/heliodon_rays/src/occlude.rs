//! Is anything in the way? For beams.

use glam::Vec3;

use crate::beam::{ALL, Beam, Entry, GROUPS, each_beam, fill, packet_of, push_children};
use crate::layout::Packet;
use crate::scene::TriangleScene;
use crate::shear::Shear;
use crate::simd::{Engine, Work};
use crate::triangle::{boxed, covers};
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
        let view = View::new(engine, &self.shear);
        let mut stack = Vec::with_capacity(self.scene.stack);
        each_beam(
            self.origins,
            self.active,
            self.scene.center,
            &self.shear,
            #[inline(always)]
            |beam| {
                let asked = beam.alive;
                walk(self.scene, &view, beam, &mut stack);
                for group in 0..GROUPS {
                    let first = beam.first[group];
                    let hit = u64::from(asked[group] & !beam.alive[group]);
                    self.occluded[first / 64] |= hit << (first % 64);
                }
            },
        );
    }
}

/// Takes the rays that meet something out of `beam.alive`.
#[inline(always)]
fn walk<E: Engine>(scene: &TriangleScene, view: &View<E>, beam: &mut Beam, stack: &mut Vec<Entry>) {
    let mut regions = Regions::new(beam);
    stack.clear();
    stack.push(Entry::root(ALL));
    while let Some(Entry { reference, groups, .. }) = stack.pop() {
        match packet_of(reference) {
            None => push_children(view, &scene.nodes[reference as usize], groups, &regions.group, None, stack),
            Some(packet) => {
                if test(view, &scene.packets[packet], groups, beam, &regions) && regions.shrink(beam) {
                    return;
                }
            }
        }
    }
}

/// Whether any ray met a triangle of the packet.
#[inline(always)]
fn test<E: Engine>(view: &View<E>, packet: &Packet, groups: u32, beam: &mut Beam, regions: &Regions) -> bool {
    let (corners, boxes) = view.corners(packet);
    let (numbers, spans) = (View::<E>::store(&corners), View::<E>::spans(&boxes));
    let mut any = 0;
    let mut groups = groups;
    while groups != 0 {
        let group = groups.trailing_zeros() as usize % GROUPS;
        groups &= groups - 1;
        let mut mask = view.overlap(&boxes, &regions.group[group]);
        while mask != 0 {
            let lane = mask.trailing_zeros() as usize % 8;
            mask &= mask - 1;
            let boxed = boxed(view.engine, &spans, lane, &beam.points[group]) & beam.alive[group];
            if boxed == 0 {
                continue;
            }
            let hit = covers::<E, true>(view.engine, &numbers, lane, &beam.points[group], boxed);
            beam.alive[group] &= !hit;
            any |= hit;
        }
    }
    any != 0
}

/// Where a beam's rays are, kept up as they end.
struct Regions {
    group: [Region; GROUPS],
    /// Rays of each group when its region was computed.
    rays: [u32; GROUPS],
}

impl Regions {
    #[inline(always)]
    fn new(beam: &Beam) -> Self {
        let mut regions = Self { group: [Region::NOTHING; GROUPS], rays: [0; GROUPS] };
        for group in 0..GROUPS {
            regions.rays[group] = beam.alive[group].count_ones();
            if beam.alive[group] != 0 {
                regions.group[group] = Region::around(&beam.points[group]);
            }
        }
        regions
    }

    /// Shrinks the regions of groups that lost half their rays; whether none is left at all. (Every time would cost more
    /// than it saves.)
    #[inline(always)]
    fn shrink(&mut self, beam: &mut Beam) -> bool {
        let mut changed = false;
        for group in 0..GROUPS {
            let alive = beam.alive[group];
            let rays = alive.count_ones();
            if rays * 2 <= self.rays[group] && self.rays[group] != 0 {
                self.rays[group] = rays;
                changed = true;
                if rays == 0 {
                    self.group[group] = Region::NOTHING;
                } else {
                    fill(&mut beam.points[group], alive);
                    self.group[group] = Region::around(&beam.points[group]);
                }
            }
        }
        changed && self.rays == [0; GROUPS]
    }
}
