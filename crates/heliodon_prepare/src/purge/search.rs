//! Looking for what one room sees.

use crate::purge::bits::Bits;
use crate::purge::clusters::Clusters;
use crate::purge::eyes::{eye_point, is_in_stone};
use crate::purge::face::cube;
use crate::purge::probe::{Looks, probe};
use crate::purge::raster::Picture;
use crate::purge::report::RoomReport;
use crate::purge::weld::Weld;
use crate::purge::windows::{Gates, SLACK};
use crate::purge::{PurgeParams, Surface};
use crate::{Tell, ViewCell, Views};
use glam::Vec3;
use heliodon_math::random::hash2_u32;
use heliodon_rays::TriangleScene;
use rayon::prelude::*;

/// Eyes whose item buffers are drawn before it is asked whether they show anything new.
const BATCH: u32 = 32;
/// Batches that still come, as it is told; more come where more is new.
const USUAL_BATCHES: u32 = 3;
/// The part of a room's time after which its item buffers are drawn.
pub(super) const DRAWN: f64 = 0.7;
/// Near planes are at least this far, metres: corners nearer to the eye have no place on a picture.
const NEAREST_M: f32 = 1e-3;

/// What a room is searched with.
#[derive(Clone, Copy)]
pub(super) struct Search<'a> {
    pub scene: &'a TriangleScene,
    pub surface: &'a Surface<'a>,
    pub weld: &'a Weld,
    pub model: &'a Clusters,
    pub views: &'a Views,
    pub params: &'a PurgeParams,
    /// Told of the room's search.
    pub tell: Tell<'a>,
}

/// Counts of pixels.
#[derive(Clone, Copy, Default)]
struct Pixels {
    met: u64,
    fresh: u64,
}

impl Search<'_> {
    /// Adds to `seen` what the room sees.
    pub fn room(&self, cell: &ViewCell, seed: u32, certain: impl Fn(usize) -> bool, seen: &Bits) -> RoomReport {
        let mut report = RoomReport::default();
        let mut eyes: Vec<Vec3> = Vec::new();
        let before = seen.count();
        let (mut asked, mut settled) = (0, 0);
        let share = |batches: u32| DRAWN * f64::from(batches) / f64::from(batches + USUAL_BATCHES);
        while asked < self.params.max_eyes && settled < 2 {
            let batch = asked..(asked + BATCH).min(self.params.max_eyes);
            asked = batch.end;
            let awake: Vec<Vec3> =
                batch.into_par_iter().map(|k| eye_point(cell, k, seed)).filter(|&eye| !is_in_stone(self.scene, eye)).collect();
            let batches = asked.div_ceil(BATCH);
            let tell = self.tell.within(share(batches - 1), share(batches));
            let pixels = self.draw(cell, &awake, hash2_u32(seed, asked), seen, tell);
            eyes.extend(awake);
            report.pixels += pixels.met;
            report.fresh_share = pixels.fresh as f64 / pixels.met.max(1) as f64;
            settled = if report.fresh_share <= self.params.fresh_share { settled + 1 } else { 0 };
        }
        report.eyes = eyes.len() as u64;
        report.in_stone = 1.0 - eyes.len() as f64 / f64::from(asked.max(1));
        let shown = seen.count();
        report.seen = shown - before;
        if !eyes.is_empty() {
            let looks = Looks { cell, eyes: &eyes };
            report.rays = probe(self, &looks, certain, seen);
        }
        report.found_by_rays = seen.count() - shown;
        report
    }

    /// Draws what some eyes see, and adds it to `seen`.
    fn draw(&self, cell: &ViewCell, eyes: &[Vec3], seed: u32, seen: &Bits, tell: Tell) -> Pixels {
        let before = seen.clone();
        let side = self.side_px();
        let looks: Vec<(usize, usize)> = (0..eyes.len()).flat_map(|eye| (0..6).map(move |face| (eye, face))).collect();
        let drawn = tell.count(looks.len());
        let pixels = looks.into_par_iter().map_init(
            || Picture::new(side),
            |picture, (i, side)| {
                let eye = eyes[i];
                let near_m = if i % 2 == 0 { NEAREST_M } else { self.params.near_m.max(NEAREST_M) };
                let face = &cube(eye, near_m, hash2_u32(seed, i as u32))[side];
                let gates = Gates::new(eye, cell, SLACK);
                picture.draw(face, &gates, self.model, |t| self.surface.is_single_sided(t as usize));
                let mut pixels = Pixels::default();
                let [right, up, forward] = face.axes;
                for (y, row) in picture.rows().enumerate() {
                    let middle = |i: usize| (2 * i + 1) as f32 / row.len() as f32 - 1.0;
                    for (x, &id) in row.iter().enumerate() {
                        if id != heliodon_raster::NOTHING
                            && (gates.is_open() || gates.passes(forward + middle(x) * right + middle(y) * up))
                        {
                            pixels.met += 1;
                            pixels.fresh += u64::from(!before.contains(id as usize));
                            seen.insert(id as usize);
                        }
                    }
                }
                drawn.add(1);
                pixels
            },
        );
        pixels.reduce(Pixels::default, |a, b| Pixels { met: a.met + b.met, fresh: a.fresh + b.fresh })
    }

    /// Pixels along a side of a picture, whose half width is seen under a slope of 1.
    fn side_px(&self) -> usize {
        let wanted = f64::from(self.params.resolution) * 2.0 / f64::from(self.views.screen.pixel_m(1.0));
        // Neither so few that nothing small is ever seen, nor more than memory is worth.
        if wanted.is_finite() { wanted.clamp(64.0, 4096.0) as usize } else { 64 }
    }
}
