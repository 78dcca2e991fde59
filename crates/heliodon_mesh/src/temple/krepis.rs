//! The platform: euthynteria, three curved steps, the pavement, and the core below it.

use super::block::{FACE_BACK, FACE_BOTTOM, FACE_LEFT, FACE_RIGHT, Wear};
use super::measures::{
    AXIAL_SPACING, CELLA_LENGTH, CELLA_PLATFORM, CELLA_WIDTH, STEP_HEIGHTS, STEP_TREAD, STYLOBATE_LENGTH, STYLOBATE_TOP,
    STYLOBATE_WIDTH,
};
use super::yard::{Frame, Span, Yard};
use glam::Vec3;

/// Depth of the stylobate's stones, on which the columns stand.
const STYLOBATE_DEPTH: f32 = 1.55;
/// How far the stones of the lower steps reach below those above.
const STEP_BEHIND: f32 = 0.30;
/// How far the core reaches into the stones before it.
const CORE_REACH: f32 = 0.25;

/// The four outward directions, north first: it and the south side are long.
pub const SIDES: [Vec3; 4] = [Vec3::NEG_Z, Vec3::Z, Vec3::NEG_X, Vec3::X];

/// Adds the whole platform.
pub fn build(yard: &mut Yard) {
    let tread = |step: usize| STEP_TREAD * (2 - step) as f32;
    let mut top = 0.0;
    course(yard, (-0.62, 0.0), tread(0) + 0.22, 0.22 + STEP_BEHIND, 0.0);
    for (step, height) in STEP_HEIGHTS.into_iter().enumerate() {
        let last = step == 2;
        let (depth, sunk) = if last { (STYLOBATE_DEPTH, 0.15) } else { (STEP_TREAD + STEP_BEHIND, 0.0) };
        course(yard, (top, top + height), tread(step), depth, sunk);
        top += height;
    }
    pavement(yard);
    cella_platform(yard);
}

/// One course of stones of a depth around the platform, its face `beyond` the stylobate's edge, and the core within, its top
/// that much `sunk`.
fn course(yard: &mut Yard, (bottom, top): Span, beyond: f32, depth: f32, sunk: f32) {
    let stones = depth;
    let (half_x, half_z) = (0.5 * STYLOBATE_LENGTH + beyond, 0.5 * STYLOBATE_WIDTH + beyond);
    for (side, out) in SIDES.into_iter().enumerate() {
        let (length, depth) = if side < 2 { (half_x, half_z) } else { (half_z - stones + 0.01, half_x) };
        let frame = Frame::facing(out, out * depth);
        // three stones a bay, as on the monument, so that each column stands on the middle of one
        let count = ((2.0 * length / (AXIAL_SPACING / 3.0)).round() as u32).div_ceil(yard.merge).max(1);
        let joints: Vec<f32> = (0..=count)
            .map(|i| {
                let even = (2.0 * i as f32 / count as f32 - 1.0) * length;
                if i == 0 || i == count { even } else { even + yard.range(-0.06, 0.06) }
            })
            .collect();
        for pair in joints.windows(2) {
            let look = yard.marble(0.0, 0.06);
            let hurt = yard.random();
            let mut wear = Wear::dressed(yard.erosion);
            // feet and frost: the treads' edges are the most worn of all
            wear.round *= 1.5;
            if hurt < 0.20 * yard.erosion {
                wear = Wear { breaks: 1, ..Wear::torn(yard.erosion * 0.7) };
            }
            let covered = FACE_BOTTOM | FACE_BACK | FACE_LEFT | FACE_RIGHT;
            yard.stone(&frame, (pair[0], pair[1]), (bottom, top), (-stones, 0.0), covered, look, wear);
        }
    }
    let within = CORE_REACH - stones;
    core(yard, (half_x + within, half_z + within), (bottom, top - sunk));
}

/// Slabs between two rectangles' edges: `s` and `o` ranges of a frame.
fn slabs(yard: &mut Yard, frame: &Frame, s: Span, o: Span, y: Span, size: f32) {
    let size = size * yard.merge as f32;
    let (columns, rows) = (((s.1 - s.0) / size).ceil().max(1.0) as u32, ((o.1 - o.0) / size).ceil().max(1.0) as u32);
    for row in 0..rows {
        for column in 0..columns {
            let at = |range: Span, i: u32, n: u32| range.0 + (range.1 - range.0) * i as f32 / n as f32;
            let span = (at(s, column, columns), at(s, column + 1, columns));
            let depth = (at(o, row, rows), at(o, row + 1, rows));
            let sunk = yard.range(0.0, 0.006 + 0.02 * yard.erosion);
            let look = yard.marble(0.0, 0.03);
            let covered = FACE_BOTTOM | FACE_BACK | FACE_LEFT | FACE_RIGHT | super::block::FACE_FRONT;
            yard.ashlar(frame, span, (y.0, y.1 - sunk), depth, covered, look);
        }
    }
}

fn pavement(yard: &mut Yard) {
    let (half_x, half_z) = (0.5 * STYLOBATE_LENGTH - STYLOBATE_DEPTH + 0.02, 0.5 * STYLOBATE_WIDTH - STYLOBATE_DEPTH + 0.02);
    let (cella_x, cella_z) = (0.5 * CELLA_LENGTH - 0.3, 0.5 * CELLA_WIDTH - 0.3);
    let frame = Frame::facing(Vec3::Z, Vec3::ZERO);
    let y = (STYLOBATE_TOP - 0.3, STYLOBATE_TOP - 0.004);
    for sign in [-1.0, 1.0] {
        let ordered = |a: f32, b: f32| if a < b { (a, b) } else { (b, a) };
        slabs(yard, &frame, (-half_x, half_x), ordered(sign * cella_z, sign * half_z), y, 1.45);
        slabs(yard, &frame, ordered(sign * cella_x, sign * half_x), (-cella_z, cella_z), y, 1.45);
    }
}

/// Rubble and poros behind a course: nothing of it is seen, all of it is dark.
fn core(yard: &mut Yard, (half_x, half_z): (f32, f32), y: Span) {
    let frame = Frame::facing(Vec3::Z, Vec3::ZERO);
    // in pieces, so that it follows the curvature
    let part = |half: f32, i: u32, pieces: u32| half * (2.0 * i as f32 / pieces as f32 - 1.0);
    for i in 0..12 {
        for j in 0..6 {
            let s = (part(half_x, i, 12), part(half_x, i + 1, 12));
            let o = (part(half_z, j, 6), part(half_z, j + 1, 6));
            let look = yard.marble(0.0, 0.0);
            yard.ashlar(&frame, s, y, o, 0x3F, look);
        }
    }
}

/// The two steps on which the cella and its porches stand, and its floor.
fn cella_platform(yard: &mut Yard) {
    let step = 0.5 * CELLA_PLATFORM;
    for level in 0..2 {
        let beyond = 0.36 * (1 - level) as f32;
        let (half_x, half_z) = (0.5 * CELLA_LENGTH + beyond, 0.5 * CELLA_WIDTH + beyond);
        let stones = 1.2 + beyond;
        // the lower step's bed lies in the pavement
        let bed = if level == 0 { 0.22 } else { 0.0 };
        let y = (STYLOBATE_TOP + step * level as f32 - bed, STYLOBATE_TOP + step * (level + 1) as f32);
        for (side, out) in SIDES.into_iter().enumerate() {
            let (length, depth) = if side < 2 { (half_x, half_z) } else { (half_z - stones + 0.01, half_x) };
            let frame = Frame::facing(out, out * depth);
            let count = ((2.0 * length / 1.8).round() as u32).div_ceil(yard.merge).max(1);
            for i in 0..count {
                let at = |i: u32| (2.0 * i as f32 / count as f32 - 1.0) * length;
                let look = yard.marble(0.2, 0.03);
                yard.ashlar(
                    &frame,
                    (at(i), at(i + 1)),
                    y,
                    (-stones, 0.0),
                    FACE_BOTTOM | FACE_BACK | FACE_LEFT | FACE_RIGHT,
                    look,
                );
            }
        }
    }
    let frame = Frame::facing(Vec3::Z, Vec3::ZERO);
    let (half_x, half_z) = (0.5 * CELLA_LENGTH - 1.18, 0.5 * CELLA_WIDTH - 1.18);
    let top = STYLOBATE_TOP + CELLA_PLATFORM;
    slabs(yard, &frame, (-half_x, half_x), (-half_z, half_z), (STYLOBATE_TOP - 0.22, top - 0.006), 2.1);
}
