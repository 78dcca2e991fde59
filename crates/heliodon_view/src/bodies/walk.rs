//! Someone on foot among bodies: a capsule that slides along stone, things and whoever stands about.
//!
//! The capsule begins just above the highest step that feet take and ends above the eyes; below it, feet find the ground by a ray as they do where there
//! are no bodies, and so climb steps alike. What the capsule meets holds it like an upright wall whatever its slope is: nobody is lifted by a hip. Each part
//! of a step is swept by avian's `cast_move`, so that no speed carries anyone through a wall, however thin; the loop about it is that of its
//! `move_and_slide` in the plane.

use super::space::{Space, layer};
use super::stone::Bounds;
use crate::navigation::walk::{BODY_RADIUS_M, EYE_HEIGHT_M, FALL_M, Fall, STEP_UP_M, stand};
use crate::stage::ground::Ground;
use avian3d::character_controller::move_and_slide::DepenetrationConfig;
use avian3d::prelude::*;
use glam::{Quat, Vec3};

/// The crown of the head above the eyes, metres.
const CROWN_M: f32 = 0.1;
/// Between the highest step and the capsule, metres: a step's edge is not yet felt.
const CLEAR_OF_STEPS_M: f32 = 0.05;
/// The distance that is kept from walls, metres.
const SKIN_M: f32 = 0.01;
/// Walls that one step may slide along.
const SLIDES: usize = 4;
/// What comes too near pushes by this much in a frame at most, metres.
const PUSH_M: f32 = 0.1;
/// The highest and the lowest of the capsule, below the eyes.
const SPAN_M: (f32, f32) = (-CROWN_M, EYE_HEIGHT_M - STEP_UP_M - CLEAR_OF_STEPS_M);
/// A wall whose normal is more upright than this has no side that it faces: it is a floor or a ceiling. A twentieth is 3 degrees.
const LEAST_LEAN: f32 = 0.05;

/// What a step may touch.
#[must_use]
pub fn around(eye: Vec3, wish: Vec3) -> Bounds {
    let far = Vec3::new(BODY_RADIUS_M + 0.1, 0.1, BODY_RADIUS_M + 0.1);
    let low = eye - Vec3::Y * SPAN_M.1;
    let high = eye - Vec3::Y * SPAN_M.0;
    (low.min(low + wish) - far, high.max(high + wish) + far)
}

/// Where an eye gets that wants to move by the horizontal `wish` in `seconds`, as [`crate::navigation::walk::walk`] says it without bodies.
#[must_use]
pub fn walk(space: &mut Space, ground: &Ground, eye: Vec3, wish: Vec3, seconds: f32, fall: &mut Fall) -> Vec3 {
    let wish = Vec3::new(wish.x, 0.0, wish.z);
    let to_middle = Vec3::NEG_Y * (0.5 * (SPAN_M.0 + SPAN_M.1));
    let moved = space.ask(|sweep| slide(sweep, eye + to_middle, wish) - to_middle).filter(|moved| moved.is_finite());
    let moved = moved.unwrap_or(eye);
    let knee = moved + Vec3::NEG_Y * (EYE_HEIGHT_M - STEP_UP_M);
    let on_thing = space.resting_below(knee, FALL_M);
    stand(ground, moved, on_thing, seconds, fall)
}

/// The middle of the capsule after a horizontal step.
fn slide(sweep: &MoveAndSlide, middle: Vec3, wish: Vec3) -> Vec3 {
    let body = Collider::capsule(BODY_RADIUS_M, SPAN_M.1 - SPAN_M.0 - 2.0 * BODY_RADIUS_M);
    let filter = SpatialQueryFilter::from_mask(layer::ALL);
    let near = DepenetrationConfig { skin_width: SKIN_M, ..DepenetrationConfig::default() };
    let push = sweep.depenetrate(&body, middle, Quat::IDENTITY, &near, &filter);
    let mut at = middle + Vec3::new(push.x, 0.0, push.z).clamp_length_max(PUSH_M);
    let mut step = wish;
    let mut walls: Vec<Vec3> = Vec::with_capacity(SLIDES);
    for _ in 0..SLIDES {
        let Some((ahead, length)) = step.try_normalize().map(|ahead| (ahead, step.length())) else { break };
        let Some(hit) = sweep.cast_move(&body, at, Quat::IDENTITY, step, SKIN_M, &filter) else { return at + step };
        let gone = hit.distance.min(length);
        at += ahead * gone;
        step -= ahead * gone;
        walls.push(wall(hit.normal1, ahead));
        step = along(step, &walls);
    }
    at
}

/// The upright wall that something met counts as: its normal, towards whoever comes.
fn wall(normal: Vec3, ahead: Vec3) -> Vec3 {
    let level = Vec3::new(normal.x, 0.0, normal.z);
    let facing = if level.dot(ahead) > 0.0 { -level } else { level };
    Some(facing).filter(|facing| facing.length() > LEAST_LEAN).and_then(Vec3::try_normalize).unwrap_or(-ahead)
}

/// What of a step no wall takes away; nothing in a corner.
fn along(step: Vec3, walls: &[Vec3]) -> Vec3 {
    let free = |step: Vec3| walls.iter().all(|wall| step.dot(*wall) >= -1e-6);
    let slid = walls.iter().map(|wall| step - *wall * step.dot(*wall).min(0.0));
    let best = std::iter::once(step).chain(slid).filter(|slid| free(*slid));
    best.max_by(|a, b| a.dot(step).total_cmp(&b.dot(step))).unwrap_or(Vec3::ZERO)
}
