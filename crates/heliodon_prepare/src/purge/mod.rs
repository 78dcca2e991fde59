//! The view-cell purge: which faces no eye in any room can see.
//!
//! The rooms are view cells, and what is kept is their potentially visible set (J. Airey, J. Rohlf, F. Brooks, "Towards Image Realism with
//! Interactive Update Rates in Complex Virtual Building Environments", 1990), as M. Callieri, P. Debevec, J. Pair, R. Scopigno, "A realtime immersive
//! application with realistic lighting: The Parthenon", Computers & Graphics 30(3), 2006, section 5.2, purge their temple from 2 million triangles to 700,000.
//!
//! 1. What is certain: faces of closed bodies that turn their backs on a whole box, and what lies beside all that windows show. These
//!    two are exact, and need not be looked for.
//! 2. Item buffers, whole cubes of them, from eyes spread over each box, until new ones show nothing new worth speaking of.
//! 3. Rays from many eyes to many points of the faces that no buffer showed, most of them to the neighbours of what is seen.
//! 4. A ring of neighbours is kept around all that was seen.
//! 5. Frames from random eyes are compared with the model before. What they miss is put back until they miss little enough.
//!
//! Step 2 ends early because steps 3 and 4 are worth more than further buffers: of the procedural temple (1,997,162 triangles, its own room)
//! buffers from 160 eyes show 1,379,066, 2.8 million rays find another 35,281, the ring adds 82,330, and 3 of 17.8 million pixels of 4,000
//! other frames are wrong (`cargo run -p heliodon_prepare --example purge_cost`); with 96 eyes it is 2. All of it takes about 35 seconds of
//! one thread, a third of them for the check.
//!
//! Only geometry that is drawn is purged: what is dropped still occludes and reflects light in the bake.

mod bits;
mod clusters;
mod eyes;
mod face;
mod facing;
mod probe;
mod raster;
mod report;
mod search;
mod sight;
mod verify;
mod weld;
mod windows;

pub use eyes::stone_share;
pub use report::{PurgeReport, RoomReport};
pub use verify::{CheckParams, Verified, WorstFrame, verify};

use crate::{Tell, Views};
use bits::Bits;
use clusters::Clusters;
use facing::Bodies;
use glam::Vec3;
use heliodon_math::random::hash2_u32;
use heliodon_rays::TriangleScene;
use search::Search;
use verify::verify_telling;
use weld::Weld;
use windows::Outside;

/// The model that is drawn.
#[derive(Clone, Copy, Debug)]
pub struct Surface<'a> {
    /// Vertices, metres; fewer than 2^31.
    pub positions: &'a [Vec3],
    /// Vertex indices, counter-clockwise seen from the front.
    pub triangles: &'a [[u32; 3]],
    /// For each triangle whether only its front is drawn; empty: both sides of all are.
    pub single_sided: &'a [bool],
}

impl Surface<'_> {
    pub(crate) fn is_single_sided(&self, triangle: usize) -> bool {
        self.single_sided.get(triangle).is_some_and(|&single| single)
    }
}

/// How much is looked at before a face counts as unseen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PurgeParams {
    /// Pixels of item buffers for each pixel of the display, along one side. More find smaller faces from each eye; time grows with its square.
    pub resolution: f32,
    /// Item buffers are drawn until the part of their pixels that show something new is at most this, twice in a row. Less takes more eyes.
    pub fresh_share: f64,
    /// Eyes of a room at most.
    pub max_eyes: u32,
    /// Rays to each face that no item buffer showed.
    pub face_rays: u8,
    /// Rays to each neighbour of a face that is seen. More find the rims of gaps.
    pub border_rays: u8,
    /// Rings of neighbours (by a vertex's position) that are kept around what is seen. More is safer and keeps more.
    pub ring: u32,
    /// What the viewer's near plane cuts off, metres: whoever puts an eye to a wall looks through it. Half of all eyes look without one.
    pub near_m: f32,
    /// Frames of a check.
    pub frames: u32,
    /// Pixels of each of a check's frames.
    pub pixels: u32,
    /// The part of a check's pixels that may be wrong.
    pub wrong_share: f64,
    /// Checks at most: after each but the last, what it found missing is put back.
    pub max_checks: u32,
    /// Another seed looks from other eyes in other directions.
    pub seed: u32,
}

impl PurgeParams {
    /// For a first look: one pixel in 10,000 may be wrong.
    #[must_use]
    pub fn preview() -> Self {
        Self {
            resolution: 0.25,
            fresh_share: 1e-2,
            face_rays: 1,
            border_rays: 4,
            frames: 500,
            wrong_share: 1e-4,
            ..Self::default()
        }
    }

    /// For what is kept for good: one pixel in a million may be wrong. Item buffers have four times the pixels, and more of them are drawn.
    #[must_use]
    pub fn archival() -> Self {
        Self {
            resolution: 1.0,
            fresh_share: 1e-4,
            face_rays: 16,
            border_rays: 64,
            frames: 10_000,
            wrong_share: 1e-6,
            max_checks: 8,
            ..Self::default()
        }
    }
}

impl Default for PurgeParams {
    /// For delivery: one pixel in 200,000 may be wrong.
    fn default() -> Self {
        Self {
            resolution: 0.5,
            fresh_share: 5e-4,
            max_eyes: 4096,
            face_rays: 4,
            border_rays: 16,
            ring: 1,
            near_m: 0.05,
            frames: 3000,
            pixels: 4096,
            wrong_share: 5e-6,
            max_checks: 4,
            seed: 1,
        }
    }
}

/// What a purge leaves.
#[derive(Clone, Debug, PartialEq)]
pub struct Purged {
    /// For each triangle whether it is kept.
    pub keep: Vec<bool>,
    /// For each triangle whether somebody was found to see it; empty where nothing is known of where eyes are.
    pub seen: Vec<bool>,
    /// How it came about.
    pub report: PurgeReport,
}

/// Why a face is certain to be seen by nobody.
#[derive(Clone, Copy, PartialEq)]
enum Certain {
    No,
    FacingAway,
    OutsideWindows,
}

/// Finds the faces that somebody in one of the rooms may see; `scene` holds the triangles of `surface`. Without rooms, and where nobody sees
/// anything from any (they are in stone, or look elsewhere), nothing is known of where eyes are, and all faces are kept. Runs on the current rayon pool; the same for any number
/// of threads.
///
/// # Panics
/// If `single_sided` is neither empty nor one for each triangle, or a triangle names a vertex that is not there.
#[must_use]
pub fn purge(scene: &TriangleScene, surface: &Surface, views: &Views, params: &PurgeParams) -> Purged {
    purge_telling(scene, surface, views, params, Tell::NOBODY)
}

/// As [`purge`], and tells how far it is: by what usually is still to come, for how long an eye finds something new nobody knows.
///
/// # Panics
/// As [`purge`].
#[must_use]
pub fn purge_telling(scene: &TriangleScene, surface: &Surface, views: &Views, params: &PurgeParams, tell: Tell) -> Purged {
    let count = surface.triangles.len();
    assert!(surface.single_sided.is_empty() || surface.single_sided.len() == count, "one answer for each triangle");
    let weld = Weld::new(surface.positions);
    let certain = certain(scene, surface, views, &weld);
    let is_certain = |t: usize| certain[t] != Certain::No;
    let model = Clusters::new(surface);
    let seen = Bits::new(count);
    let mut rooms = Vec::new();
    for (room, cell) in views.cells.iter().enumerate() {
        let share = |room: usize| CERTAIN + (SEARCHED - CERTAIN) * room as f64 / views.cells.len() as f64;
        let tell = tell.within(share(room), share(room + 1));
        let search = Search { scene, surface, weld: &weld, model: &model, views, params, tell };
        rooms.push(search.room(cell, hash2_u32(params.seed, room as u32), is_certain, &seen));
    }
    let mut report = PurgeReport { triangles: count as u64, rooms, ..PurgeReport::default() };
    if report.rooms.iter().all(RoomReport::is_blind) {
        report.kept = count as u64;
        return Purged { keep: vec![true; count], seen: Vec::new(), report };
    }
    let mut keep = vec![false; count];
    for check in 0..params.max_checks.max(1) {
        keep = with_rings(surface, &weld, &seen, params.ring, is_certain);
        let seed = hash2_u32(params.seed.wrapping_add(check), 0x7665_7269);
        let frames = CheckParams { frames: params.frames, pixels: params.pixels, near_m: params.near_m, seed };
        let tell = tell.within(SEARCHED, 1.0).within(1.0 - LATER.powi(check as i32), 1.0 - LATER.powi(check as i32 + 1));
        let verified = verify_telling(scene, surface.single_sided, &keep, views, &frames, tell);
        report.passed = verified.iter().all(|room| room.wrong_share() <= params.wrong_share);
        report.checks += 1;
        if !report.passed && report.checks < params.max_checks {
            verified.iter().flat_map(|room| &room.missing).for_each(|&t| seen.insert(t as usize));
        }
        report.rooms.iter_mut().zip(verified).for_each(|(room, verified)| room.verified = verified);
        if report.passed {
            break;
        }
    }
    report.kept = keep.iter().filter(|&&kept| kept).count() as u64;
    report.seen = seen.count();
    let dropped = |why: Certain| (0..count).filter(|&t| !keep[t] && certain[t] == why).count() as u64;
    report.facing_away = dropped(Certain::FacingAway);
    report.outside_windows = dropped(Certain::OutsideWindows);
    report.occluded = dropped(Certain::No);
    tell.done(1.0);
    Purged { keep, seen: (0..count).map(|t| seen.contains(t)).collect(), report }
}

/// The parts of the time after which it is known what is certain, and after which all rooms have been searched; of the rest, what is left after a check.
const CERTAIN: f64 = 0.03;
const SEARCHED: f64 = 0.7;
const LATER: f64 = 0.3;

/// Which faces are certain to be seen from none of the rooms.
fn certain(scene: &TriangleScene, surface: &Surface, views: &Views, weld: &Weld) -> Vec<Certain> {
    let mut certain = vec![Certain::No; surface.triangles.len()];
    if views.cells.is_empty() {
        return certain;
    }
    let bodies = Bodies::new(surface, weld);
    let margin_m = scene.start_offset();
    // Of every room the same reason or another: the last room's is told.
    let mut hidden = vec![true; surface.triangles.len()];
    for cell in &views.cells {
        let away = bodies.turned_away(surface, cell, margin_m);
        let outside = Outside::new(cell, margin_m);
        for (t, triangle) in surface.triangles.iter().enumerate() {
            let beside = || outside.as_ref().is_some_and(|o| o.holds(triangle.map(|i| surface.positions[i as usize])));
            certain[t] = match (hidden[t], away[t]) {
                (false, _) => Certain::No,
                (true, true) => Certain::FacingAway,
                (true, false) if beside() => Certain::OutsideWindows,
                (true, false) => Certain::No,
            };
            hidden[t] = certain[t] != Certain::No;
        }
    }
    certain
}

/// What is seen, and its neighbours but for those that are certain to be unseen.
fn with_rings(surface: &Surface, weld: &Weld, seen: &Bits, rings: u32, certain: impl Fn(usize) -> bool) -> Vec<bool> {
    let mut keep: Vec<bool> = (0..surface.triangles.len()).map(|t| seen.contains(t)).collect();
    for _ in 0..rings {
        let inner = keep.clone();
        weld.around(surface.triangles, |t| inner[t], |t| keep[t] |= !certain(t));
    }
    keep
}

#[cfg(test)]
mod tests;
