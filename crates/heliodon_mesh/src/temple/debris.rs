//! What fell: drums, blocks and capitals on the ground and in the cella, boulders of the rock, gravel before the visitor.

use super::State;
use super::block::{Block, Wear};
use super::column::fallen_drum;
use super::ground::Ground;
use super::marble::{Look, Stone};
use super::measures::{CELLA_PLATFORM, COLUMN_LOWER_DIAMETER, STYLOBATE_LENGTH, STYLOBATE_TOP, STYLOBATE_WIDTH, curvature};
use super::yard::Yard;
use glam::Vec3;
use heliodon_math::frame::unit_or;
use std::f32::consts::TAU;

/// Adds the fallen stones. `eye` is the middle of the visitor's room, `forward` where it looks.
pub fn build(yard: &mut Yard, state: State, ground: &Ground, eye: Vec3, forward: Vec3) {
    let stand = Vec3::new(eye.x, 0.0, eye.z);
    let mut taken: Vec<(Vec3, f32)> = vec![(stand, 6.5)];
    let fallen = if state == State::Ruined { 1.0 } else { 0.12 };
    let few = yard.merge;
    // beams and broken shafts first: they need room
    for _ in 0..(26.0 * fallen) as u32 / few {
        let beyond = 2.5 + 16.0 * yard.random();
        let place = around_temple(yard, beyond);
        // nothing large bars the view
        if (place - stand).length() > 19.0 && claim(&mut taken, place, 2.2) {
            if yard.random() < 0.6 { beam(yard, ground, place) } else { shaft(yard, ground, place) }
        }
    }
    for _ in 0..(170.0 * fallen) as u32 / few {
        // more lie near the steps than far from them
        let beyond = 3.0 + 26.0 * squared(yard.random());
        let place = around_temple(yard, beyond);
        let kind = yard.random();
        let size = if kind < 0.22 { 1.15 } else { 0.8 };
        let clear = if kind < 0.22 { 18.0 } else { 12.0 };
        if (place - stand).length() < clear || !claim(&mut taken, place, size) {
            continue;
        }
        if kind < 0.22 {
            drum(yard, ground, place);
        } else {
            block(yard, ground, place);
        }
    }
    for _ in 0..(46.0 * fallen) as u32 / few {
        let place = Vec3::new(yard.range(-19.0, 21.0), 0.0, yard.range(-8.6, 8.6));
        if claim(&mut taken, place, 0.9) {
            on_floor(yard, place);
        }
    }
    for _ in 0..150 / few {
        let beyond = 5.0 + 60.0 * yard.random();
        let place = around_temple(yard, beyond);
        let size = 0.25 + 1.1 * squared(squared(yard.random()));
        if claim(&mut taken, place, size) {
            boulder(yard, ground, place, size);
        }
    }
    if few <= 2 {
        gravel(yard, ground, eye, forward);
    }
}

/// A place `beyond` the lowest step, anywhere around.
fn around_temple(yard: &mut Yard, beyond: f32) -> Vec3 {
    let (x, z) = (0.5 * STYLOBATE_LENGTH + 1.8 + beyond, 0.5 * STYLOBATE_WIDTH + 1.8 + beyond);
    let t = yard.random() * 2.0 - 1.0;
    let sign = if yard.random() < 0.5 { -1.0 } else { 1.0 };
    // the west and the north, where visitors look from, are a little richer
    if yard.random() < 0.42 { Vec3::new(sign * x, 0.0, t * z) } else { Vec3::new(t * x, 0.0, sign * z) }
}

fn claim(taken: &mut Vec<(Vec3, f32)>, place: Vec3, radius: f32) -> bool {
    let free = taken.iter().all(|&(other, r)| (other - place).length() > r + radius);
    if free {
        taken.push((place, radius));
    }
    free
}

fn marble(yard: &mut Yard) -> Look {
    yard.marble(0.08, 0.0)
}

/// Axes that stand on the slope of the ground, turned about and tilted a little.
fn rest_axes(yard: &mut Yard, up: Vec3, tilt: f32) -> [Vec3; 3] {
    let turn = TAU * yard.random();
    let up = unit_or(up + Vec3::new(yard.range(-tilt, tilt), 0.0, yard.range(-tilt, tilt)), Vec3::Y);
    let flat = Vec3::new(libm::cosf(turn), 0.0, libm::sinf(turn));
    let x = unit_or(flat - up * up.dot(flat), Vec3::X);
    [x, up, x.cross(up)]
}

fn drum(yard: &mut Yard, ground: &Ground, place: Vec3) {
    let diameter = COLUMN_LOWER_DIAMETER * yard.range(0.79, 1.0);
    let height = yard.range(0.75, 1.05);
    let standing = yard.random() < 0.35;
    let (low, normal) = ground.seat(place.x, place.z, 0.8);
    let [x, up, z] = rest_axes(yard, normal, 0.06);
    let base = Vec3::new(place.x, low, place.z);
    let look = marble(yard);
    if standing {
        fallen_drum(yard, base + up * (0.5 * height - 0.17), [x, up, z], diameter, height, look);
    } else {
        // on its side: its own axis lies along the ground
        fallen_drum(yard, base + up * (0.5 * diameter - 0.24), [up, x, up.cross(x)], diameter, height, look);
    }
}

fn block(yard: &mut Yard, ground: &Ground, place: Vec3) {
    let long = yard.range(0.45, 0.95);
    let half = Vec3::new(long, yard.range(0.20, 0.36), yard.range(0.28, 0.52));
    let (low, normal) = ground.seat(place.x, place.z, 0.6);
    let axes = rest_axes(yard, normal, 0.13);
    let base = Vec3::new(place.x, low, place.z);
    let look = marble(yard);
    let wear = Wear::fallen(yard.erosion);
    let mut stone = Block::oriented(base + axes[1] * (half.y - 0.11), axes, half, wear, look, 0);
    stone.seed = yard.seed();
    yard.push_block(stone);
}

/// A beam of the architrave, broken in two as often as not.
fn beam(yard: &mut Yard, ground: &Ground, place: Vec3) {
    let (low, normal) = ground.seat(place.x, place.z, 1.0);
    let axes = rest_axes(yard, normal, 0.07);
    let base = Vec3::new(place.x, low, place.z);
    let look = marble(yard);
    let half = Vec3::new(yard.range(1.0, 2.0), yard.range(0.42, 0.62), yard.range(0.34, 0.45));
    let wear = Wear { breaks: 2, ..Wear::fallen(yard.erosion) };
    let mut stone = Block::oriented(base + axes[1] * (half.y - 0.16), axes, half, wear, look, 0);
    stone.seed = yard.seed();
    yard.push_block(stone);
}

/// Two or three drums of a shaft as they came down, one behind the other.
fn shaft(yard: &mut Yard, ground: &Ground, place: Vec3) {
    let (_, normal) = ground.seat(place.x, place.z, 1.5);
    let [along, _, _] = rest_axes(yard, normal, 0.0);
    let diameter = COLUMN_LOWER_DIAMETER * yard.range(0.80, 0.98);
    let count = 2 + u32::from(yard.random() < 0.5);
    let mut at = -0.95 * count as f32 * 0.5;
    for _ in 0..count {
        let height = yard.range(0.78, 0.98);
        let gap = yard.range(0.04, 0.25);
        let middle = place + along * (at + 0.5 * height);
        let (low, _) = ground.seat(middle.x, middle.z, 0.5);
        let base = Vec3::new(middle.x, low, middle.z);
        let axis = unit_or(along + Vec3::new(yard.range(-0.12, 0.12), 0.0, yard.range(-0.12, 0.12)), along);
        let up = unit_or(Vec3::Y - axis * axis.y, Vec3::Y);
        let look = marble(yard);
        fallen_drum(yard, base + up * (0.5 * diameter - 0.24), [up, axis, up.cross(axis)], diameter, height, look);
        at += height + gap;
    }
}

fn on_floor(yard: &mut Yard, place: Vec3) {
    let half = Vec3::new(yard.range(0.35, 0.8), yard.range(0.2, 0.32), yard.range(0.25, 0.5));
    let axes = rest_axes(yard, Vec3::Y, 0.08);
    let floor = STYLOBATE_TOP + CELLA_PLATFORM + curvature(place.x, place.z);
    let look = marble(yard);
    let wear = Wear::fallen(yard.erosion);
    let mut stone = Block::oriented(Vec3::new(place.x, floor + half.y - 0.05, place.z), axes, half, wear, look, 0);
    stone.seed = yard.seed();
    stone.coarser = 1.5;
    yard.push_block(stone);
}

/// A piece of the rock, most of it in the ground.
fn boulder(yard: &mut Yard, ground: &Ground, place: Vec3, size: f32) {
    let half = Vec3::new(yard.range(0.7, 1.2), yard.range(0.4, 0.75), yard.range(0.6, 1.0)) * size;
    let (low, normal) = ground.seat(place.x, place.z, 0.5 * size);
    let axes = rest_axes(yard, normal, 0.35);
    let base = Vec3::new(place.x, low, place.z);
    let look = Look { stone: Stone::Rock, seed: yard.seed(), shelter: 0.0, age: 1.0 };
    let least = half.min_element();
    let wear = Wear { round: 0.55 * least, chip: 0.35 * least, rough: 0.07 * least, breaks: 5 };
    let mut stone = Block::oriented(base + axes[1] * (0.25 * half.y), axes, half, wear, look, 0);
    stone.seed = yard.seed();
    yard.push_block(stone);
}

/// Small stones where the visitor looks down, in drifts.
fn gravel(yard: &mut Yard, ground: &Ground, eye: Vec3, forward: Vec3) {
    let side = Vec3::new(-forward.z, 0.0, forward.x);
    for _ in 0..46 / yard.merge {
        let ahead = 4.0 + 20.0 * yard.random();
        let drift = eye + forward * ahead + side * (ahead * yard.range(-0.9, 0.9));
        let spread = yard.range(0.3, 1.6);
        for _ in 0..(1.0 + 9.0 * squared(yard.random())) as u32 {
            let place = drift + forward * (spread * yard.range(-1.0, 1.0)) + side * (spread * yard.range(-1.0, 1.0));
            let size = 0.018 + 0.11 * squared(squared(yard.random()));
            let stone = if yard.random() < 0.25 { Stone::Marble } else { Stone::Rock };
            let look = Look { stone, seed: yard.seed(), shelter: 0.0, age: 1.0 };
            let axes = rest_axes(yard, Vec3::Y, 0.5);
            let half = Vec3::new(yard.range(0.8, 1.5), yard.range(0.45, 0.8), yard.range(0.6, 1.1)) * size;
            let base = Vec3::new(place.x, ground.height(place.x, place.z) + 0.2 * half.y, place.z);
            let least = half.min_element();
            let wear = Wear { round: 0.6 * least, chip: 0.3 * least, rough: 0.05 * least, breaks: 4 };
            let mut stone = Block::oriented(base, axes, half, wear, look, 0);
            stone.seed = yard.seed();
            stone.ornament = true;
            yard.push_block(stone);
        }
    }
}

fn squared(x: f32) -> f32 {
    x * x
}
