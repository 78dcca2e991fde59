//! The judge: frames from random eyes, before and after.

use crate::purge::eyes::is_in_stone;
use crate::purge::sight::Sight;
use crate::purge::windows::Gates;
use crate::{Tell, Views};
use glam::Vec3;
use heliodon_math::frame::unit_or;
use heliodon_math::random::{Pcg32, hash2_u32};
use heliodon_rays::{Ray, TriangleScene};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// How many frames are looked at, and how.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CheckParams {
    /// Frames, by turns from each room. More find rarer differences.
    pub frames: u32,
    /// Random pixels of each frame; all of them cost the display's width times height.
    pub pixels: u32,
    /// What the viewer's near plane cuts off, metres; every second frame is drawn without one.
    pub near_m: f32,
    /// Another seed gives other eyes, directions and pixels.
    pub seed: u32,
}

/// What a check found.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
pub struct Verified {
    /// Frames that were looked at: fewer than asked for if eyes were in stone.
    pub frames: u64,
    /// Their pixels; where a room has windows, those through which it looks out.
    pub pixels: u64,
    /// Of these, how many show a triangle of the model before the purge.
    pub met: u64,
    /// Of these, how many show another one or none after it.
    pub wrong: u64,
    /// The frame with the most wrong pixels, if any has one.
    pub worst: Option<WorstFrame>,
    /// The triangles that are missing, each once, ascending.
    #[serde(skip)]
    pub missing: Vec<u32>,
}

/// A frame with wrong pixels.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
pub struct WorstFrame {
    /// Where the eye is, metres.
    pub eye: [f32; 3],
    /// The unit vector along which it looks.
    pub forward: [f32; 3],
    /// Its pixels that were looked at and show something.
    pub met: u64,
    /// Of these, how many are wrong.
    pub wrong: u64,
}

impl Verified {
    /// Wrong pixels as a part of those that show something; 0 where nothing is seen.
    #[must_use]
    pub fn wrong_share(&self) -> f64 {
        self.wrong as f64 / self.met.max(1) as f64
    }

    fn add(mut self, other: Self) -> Self {
        self.frames += other.frames;
        self.pixels += other.pixels;
        self.met += other.met;
        self.wrong += other.wrong;
        // The first of equals, so that the order of threads does not matter.
        let wrong = |worst: &Option<WorstFrame>| worst.map_or(0, |w| w.wrong);
        if wrong(&other.worst) > wrong(&self.worst) {
            self.worst = other.worst;
        }
        self.missing.extend(other.missing);
        self
    }

    fn sorted(mut self) -> Self {
        self.missing.sort_unstable();
        self.missing.dedup();
        self
    }
}

/// Frames as the display shows them from random eyes of each room in random directions (or through its windows): for each room, how many
/// of their pixels show another triangle once those that are not kept are gone, which is where the first triangle that a ray through the pixel
/// meets is not kept. Eyes in stone do not look. `single_sided` says for each triangle whether only its front is drawn; empty: of none.
///
/// # Panics
/// If triangles of the scene have no entry in `keep`, or in `single_sided` where that is not empty.
#[must_use]
pub fn verify(
    scene: &TriangleScene,
    single_sided: &[bool],
    keep: &[bool],
    views: &Views,
    check: &CheckParams,
) -> Vec<Verified> {
    verify_telling(scene, single_sided, keep, views, check, Tell::NOBODY)
}

/// As [`verify`], and tells how far it is.
pub(super) fn verify_telling(
    scene: &TriangleScene,
    single_sided: &[bool],
    keep: &[bool],
    views: &Views,
    check: &CheckParams,
    tell: Tell,
) -> Vec<Verified> {
    let looked = tell.count(check.frames as usize);
    let sight = Sight { scene, single_sided };
    let rooms = views.cells.len() as u32;
    let of_room = |room: u32| {
        let frames = (0..check.frames).into_par_iter().filter(|frame| frame % rooms == room);
        let seen = |frame| {
            let found = look(sight, keep, views, room as usize, frame, check);
            looked.add(1);
            found
        };
        let found: Vec<Verified> = frames.map(seen).collect();
        found.into_iter().fold(Verified::default(), Verified::add).sorted()
    };
    (0..rooms).map(of_room).collect()
}

/// One frame.
fn look(sight: Sight, keep: &[bool], views: &Views, room: usize, frame: u32, check: &CheckParams) -> Verified {
    let cell = &views.cells[room];
    let mut random = Pcg32::new(u64::from(check.seed), u64::from(hash2_u32(check.seed, frame)) << 32 | u64::from(frame));
    let eye = cell.low + Vec3::from_array(core::array::from_fn(|_| random.next_f32())) * (cell.high - cell.low);
    if is_in_stone(sight.scene, eye) {
        return Verified::default();
    }
    let gates = Gates::new(eye, cell, 0.0);
    let forward = if cell.windows.is_empty() {
        let (y, azimuth) = (random.range_f32(-1.0, 1.0), random.range_f32(0.0, std::f32::consts::TAU));
        let (sin, cos) = libm::sincosf(azimuth);
        let flat = (1.0 - y * y).max(0.0).sqrt();
        Vec3::new(flat * cos, y, flat * sin)
    } else {
        let [corner, right, top] = cell.windows[random.next_u32() as usize % cell.windows.len()];
        unit_or(corner + random.next_f32() * (right - corner) + random.next_f32() * (top - corner) - eye, Vec3::NEG_Z)
    };
    let right = unit_or(forward.cross(Vec3::Y), Vec3::X);
    let up = right.cross(forward);
    let half = (0.5 * views.screen.fov_rad).tan();
    let (width, height) = (views.screen.width_px.max(1), views.screen.height_px.max(1));
    let (across, down) = (half * width as f32 / height as f32, half);
    let near_m = if frame & 1 == 0 { 0.0 } else { check.near_m };
    // One pixel of each of so many bands of rows and columns: as random as any, and neighbours come together.
    let columns = ((f64::from(check.pixels) * f64::from(width) / f64::from(height)).sqrt() as u32).clamp(1, width);
    let rows = (check.pixels / columns).clamp(1, height);
    let mut rays = Vec::with_capacity((columns * rows) as usize);
    for cell in 0..columns * rows {
        let within = |band: u32, bands: u32, of: u32, share: f32| {
            let (from, to) =
                (u64::from(band) * u64::from(of) / u64::from(bands), (u64::from(band) + 1) * u64::from(of) / u64::from(bands));
            let pixel = (from + (share * (to - from) as f32) as u64).min(u64::from(of) - 1);
            (2 * pixel + 1) as f32 / of as f32 - 1.0
        };
        let x = within(cell % columns, columns, width, random.next_f32());
        let y = within(cell / columns, rows, height, random.next_f32());
        // Distances along it are depths.
        let direction = forward + x * across * right + y * down * up;
        if gates.passes(direction) {
            rays.push(Ray { origin: eye, direction, t_min: near_m, t_max: f32::INFINITY });
        }
    }
    let mut hits = Vec::new();
    sight.first(&mut rays, &mut hits);
    let met = hits.iter().filter(|hit| hit.is_some());
    let missing: Vec<u32> = met.clone().map(|hit| hit.triangle).filter(|&t| !keep[t as usize]).collect();
    let (met, wrong) = (met.count() as u64, missing.len() as u64);
    let worst = (wrong > 0).then(|| WorstFrame { eye: eye.into(), forward: forward.into(), met, wrong });
    Verified { frames: 1, pixels: rays.len() as u64, met, wrong, worst, missing }.sorted()
}
