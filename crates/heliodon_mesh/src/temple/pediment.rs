//! The two pediments: tympanum, raking cornice, and the figures that remain in the corners.

use super::State;
use super::block::{Block, FACE_BACK, FACE_BOTTOM, FACE_LEFT, FACE_RIGHT, FACE_TOP, Wear};
use super::entablature::FACE;
use super::figures;
use super::measures::{GEISON_PROJECTION, GEISON_TOP, HALF_AXES, ROOF_SLOPE};
use super::yard::{Frame, Yard};
use glam::Vec3;

/// Half the width of the tympanum.
const HALF: f32 = 14.3;

/// Height of the tympanum's edge over the cornice.
fn slope(s: f32) -> f32 {
    (HALF - s.abs()) * ROOF_SLOPE
}

/// What the ruin keeps of the tympanum at a place: a part of its height.
fn kept(state: State, east: bool, s: f32) -> f32 {
    match (state, east) {
        (State::Intact, _) => 1.0,
        (_, false) if (-1.9..3.6).contains(&s) => 0.62,
        (_, false) => 1.0,
        (_, true) if s.abs() < 8.5 => 0.0,
        (_, true) if s.abs() < 10.5 => 0.5,
        _ => 1.0,
    }
}

/// Whether the raking cornice lies at a place of the slope.
fn has_rake(state: State, east: bool, s: f32) -> bool {
    match (state, east) {
        (State::Intact, _) => true,
        // `s` runs from north to south in the west, and from south to north in the east
        (_, false) => !(-5.2..=8.8).contains(&s),
        (_, true) => s.abs() > 10.6,
    }
}

/// Adds both pediments.
pub fn build(yard: &mut Yard, state: State) {
    for (east, out) in [(false, Vec3::NEG_X), (true, Vec3::X)] {
        let frame = Frame::facing(out, out * HALF_AXES.0);
        tympanum(yard, &frame, state, east);
        rakes(yard, &frame, state, east);
        figures::pediment(yard, &frame, state, east);
    }
}

fn tympanum(yard: &mut Yard, frame: &Frame, state: State, east: bool) {
    let count = 9_u32.div_ceil(yard.merge);
    for side in [-1.0_f32, 1.0] {
        for i in 0..count {
            let at = |i: u32| HALF * i as f32 / count as f32;
            let (near, far) = (at(i), at(i + 1) - 0.001);
            let middle = side * 0.5 * (near + far);
            let keep = kept(state, east, middle);
            if keep <= 0.0 {
                continue;
            }
            let torn = keep < 1.0;
            let keep = keep * if torn { yard.range(0.8, 1.1) } else { 1.0 };
            let thick = [(0.36, 0.80), (-0.45, 0.38)];
            for (layer, (back, face)) in thick.into_iter().enumerate() {
                if layer == 1 && torn && yard.random() < 0.5 {
                    continue;
                }
                let look = yard.marble(0.35, 0.05);
                let proud = yard.range(-0.004, 0.004);
                let corner = |c: usize| {
                    let s = if c & 1 == 0 { near - 0.004 } else { far + 0.004 };
                    // the corner stone ends in a blunt edge, not in a point
                    let top = if c & 2 == 0 { -0.03 } else { (slope(s) * keep).max(0.02) + 0.02 };
                    frame.point(side * s, GEISON_TOP + top, if c & 4 == 0 { back } else { face + proud })
                };
                let wear = if torn { Wear::torn(yard.erosion) } else { Wear::dressed(yard.erosion) };
                let mut covered = FACE_BOTTOM | FACE_LEFT | FACE_RIGHT | if layer == 0 { FACE_BACK } else { 0 };
                if !torn {
                    covered |= FACE_TOP;
                }
                let mut slab = Block::new(std::array::from_fn(corner), wear, look, covered);
                slab.seed = yard.seed();
                yard.push_block(slab);
            }
        }
    }
}

/// The raking cornice: stones along the slopes, standing out as far as the horizontal one.
fn rakes(yard: &mut Yard, frame: &Frame, state: State, east: bool) {
    let reach = HALF + 2.0;
    let count = 13_u32.div_ceil(yard.merge);
    for side in [-1.0_f32, 1.0] {
        for i in 0..count {
            let at = |i: u32| reach * i as f32 / count as f32;
            let (near, far) = (at(i), at(i + 1));
            if !has_rake(state, east, side * 0.5 * (near + far)) {
                continue;
            }
            let look = yard.marble(0.3, 0.05);
            let hurt = yard.random() < 0.3 * yard.erosion;
            let wear = if hurt { Wear { breaks: 1, ..Wear::torn(yard.erosion) } } else { Wear::dressed(yard.erosion) };
            let out = FACE + GEISON_PROJECTION + 0.012 + yard.range(-0.006, 0.006);
            stone(yard, frame, (side, near, far), (0.0, 0.52), (-0.6, out), wear, look);
            if state == State::Intact {
                stone(yard, frame, (side, near, far), (0.515, 0.86), (out - 0.35, out + 0.12), wear, look);
            }
        }
    }
}

/// A stone that follows the slope between two places, from and to heights over it.
fn stone(
    yard: &mut Yard,
    frame: &Frame,
    (side, near, far): (f32, f32, f32),
    over: (f32, f32),
    o: (f32, f32),
    wear: Wear,
    look: super::marble::Look,
) {
    let corner = |c: usize| {
        let s = if c & 1 == 0 { near - 0.004 } else { far + 0.004 };
        let h = if c & 2 == 0 { over.0 } else { over.1 };
        frame.point(side * s, GEISON_TOP + slope(s) + h, if c & 4 == 0 { o.0 } else { o.1 })
    };
    let covered = FACE_LEFT | FACE_RIGHT | FACE_BACK;
    let mut block = Block::new(std::array::from_fn(corner), wear, look, covered);
    block.seed = yard.seed();
    yard.push_block(block);
}
