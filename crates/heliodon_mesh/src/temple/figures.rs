//! Statues: draped bodies about an axis with limbs and heads of pebbles, worn as those of the pediments are.

use super::State;
use super::block::{Block, Wear};
use super::marble::Look;
use super::measures::GEISON_TOP;
use super::tube::{End, Knot, ShaftWear, Tube};
use super::yard::{Frame, Yard};
use glam::Vec3;

/// The figures of a pediment. The ruin keeps a few in the corners.
pub fn pediment(yard: &mut Yard, frame: &Frame, state: State, east: bool) {
    let places: &[(f32, f32, bool)] = match (state, east) {
        // place, height, reclining
        (State::Ruined, false) => &[(-12.0, 0.62, true), (-9.6, 1.15, false), (-8.9, 1.0, false), (11.6, 0.68, true)],
        (State::Ruined, true) => &[(-11.6, 0.7, true), (11.8, 0.65, true)],
        (State::Intact, _) => &[
            (-12.3, 0.55, true),
            (-10.4, 0.95, true),
            (-8.6, 1.25, false),
            (-7.0, 1.6, false),
            (-5.4, 1.95, false),
            (-3.7, 2.3, false),
            (-1.5, 2.9, false),
            (1.4, 2.95, false),
            (3.6, 2.3, false),
            (5.3, 2.0, false),
            (7.1, 1.6, false),
            (8.7, 1.25, false),
            (10.4, 0.95, true),
            (12.3, 0.55, true),
        ],
    };
    for &(s, height, reclining) in places {
        let foot = frame.point(s, GEISON_TOP - 0.02, 1.12);
        let look = yard.marble(0.3, 0.0);
        if reclining {
            recline(yard, frame, foot, height, -s.signum(), look);
        } else {
            stand(yard, frame, foot, height, look);
        }
    }
}

/// A draped figure `height` tall on its feet.
fn stand(yard: &mut Yard, frame: &Frame, foot: Vec3, height: f32, look: Look) {
    let lean = frame.along * yard.range(-0.12, 0.12);
    let up = Vec3::Y + lean;
    let up = up / up.length();
    let depth = frame.out;
    let depth = depth - up * up.dot(depth);
    let z = depth / depth.length();
    let x = up.cross(z);
    body(yard, foot, [x * 1.15, up, z * 0.85], height, look);
    let head = foot + up * (0.93 * height) + frame.along * (0.02 * height);
    pebble(yard, head, [x, up, z], Vec3::new(0.065, 0.085, 0.075) * height, look);
    for side in [-1.0_f32, 1.0] {
        let bend = yard.range(-0.3, 0.9);
        let arm = x * (0.17 * side) + up * (0.66 + 0.05 * bend) + z * 0.05;
        let along = x * (0.6 * side) + up * (bend - 0.6) + z * yard.range(0.0, 0.7);
        let axis = along / along.length();
        let right = axis.cross(z);
        let right = right / right.length();
        let axes = [right, axis, right.cross(axis)];
        if yard.random() > 0.35 * yard.erosion {
            pebble(yard, foot + arm * height, axes, Vec3::new(0.05, 0.15, 0.05) * height, look);
        }
    }
}

/// A figure that lies along the corner of the pediment with its trunk raised; `towards` is the side of its head.
fn recline(yard: &mut Yard, frame: &Frame, foot: Vec3, height: f32, towards: f32, look: Look) {
    let side = frame.along * towards;
    let z = frame.out;
    let x = Vec3::Y.cross(z);
    let flat = [x, Vec3::Y, z];
    let size = height / 0.75;
    for (along, up, half) in [
        (0.05, 0.16, Vec3::new(0.34, 0.17, 0.24)),
        (-0.42, 0.20, Vec3::new(0.36, 0.14, 0.13)),
        (-0.72, 0.13, Vec3::new(0.30, 0.11, 0.11)),
        (0.20, 0.40, Vec3::new(0.20, 0.32, 0.18)),
        (0.27, 0.74, Vec3::new(0.095, 0.12, 0.10)),
        (0.42, 0.36, Vec3::new(0.09, 0.24, 0.09)),
    ] {
        pebble(yard, foot + (side * along + Vec3::Y * up) * size, flat, half * size, look);
    }
}

/// A trunk in a long garment, from the hem to the neck.
fn body(yard: &mut Yard, foot: Vec3, axes: [Vec3; 3], height: f32, look: Look) {
    let seed = yard.seed();
    let knots = [
        (-0.01, 0.165, 0.9),
        (0.10, 0.150, 1.0),
        (0.35, 0.135, 0.9),
        (0.52, 0.125, 0.5),
        (0.60, 0.100, 0.3),
        (0.72, 0.140, 0.4),
        (0.82, 0.120, 0.2),
        (0.88, 0.055, 0.0),
        (0.95, 0.040, 0.0),
    ];
    yard.push_tube(Tube {
        origin: foot,
        axes,
        knots: knots
            .into_iter()
            .map(|(y, r, folds)| Knot { y: y * height, radius: r * height, flute: folds * 1.4, joint: false })
            .collect(),
        sides: 12,
        fluted: true,
        wear: ShaftWear { arris: 0.5, spall: 0.5 * yard.erosion, rough: 0.01 * height * (0.3 + yard.erosion), shift: 0.0 },
        look,
        seed,
        coarser: 1.0,
        ornament: false,
        ends: [End::Covered, End::Covered],
    });
}

/// A rounded stone.
fn pebble(yard: &mut Yard, centre: Vec3, axes: [Vec3; 3], half: Vec3, look: Look) {
    let smallest = half.min_element();
    let wear = Wear { round: 1.2 * smallest, chip: 0.3 * smallest, rough: 0.05 * smallest * (0.5 + yard.erosion), breaks: 0 };
    let mut block = Block::oriented(centre, axes, half, wear, look, 0);
    block.seed = yard.seed();
    yard.push_block(block);
}
