//! Where a body may begin: a hand reaches through walls, a body that begins there would not come out.

use super::space::{Motion, Space, layer};
use avian3d::character_controller::move_and_slide::DepenetrationConfig;
use avian3d::prelude::*;
use bevy::prelude::*;

/// Deeper in something is inside it, metres: what a hand lays onto a table sinks in less.
const INSIDE_M: f32 = 0.02;
/// The distance to stone at which a body is put before it, metres.
const CLEAR_M: f32 = 0.005;
/// Times that a body is pushed out of what it is in.
const PUSHES: usize = 4;
/// The farthest that a hand reaches from the eyes, metres.
const REACH_M: f32 = 3.0;
/// What is moved by less is no news, metres.
const NEWS_M: f32 = 0.03;

/// The place nearest to that of a motion at which a body can begin: as far as it gets from the nearest of the eyes where stone is between, and out of
/// what it is in.
#[must_use]
pub fn free(space: &mut Space, body: &Collider, motion: Motion, eyes: &[Vec3]) -> Vec3 {
    let wanted = motion.place;
    let near = eyes.iter().copied().filter(|eye| eye.distance(wanted) < REACH_M);
    let eye = near.min_by(|a, b| a.distance(wanted).total_cmp(&b.distance(wanted)));
    // The middle of a body sees and is seen; a model's origin may lie in what it stands on.
    let to_middle = body.aabb(Vec3::ZERO, motion.turn).center();
    let place = space.ask(|sweep| {
        let stone = SpatialQueryFilter::from_mask(layer::STONE);
        let mut place = wanted;
        if let Some((from, way)) = eye.map(|eye| (eye - to_middle, wanted + to_middle - eye))
            && (is_inside(sweep, body, wanted, motion.turn, &stone) || is_hidden(sweep, from + to_middle, way, &stone))
            && let Some(hit) = sweep.cast_move(body, from, motion.turn, way, CLEAR_M, &stone)
        {
            place = from + way.clamp_length_max(hit.distance);
        }
        let solid = SpatialQueryFilter::from_mask(layer::STONE | layer::THING);
        let push = DepenetrationConfig { skin_width: 0.0, ..DepenetrationConfig::default() };
        for _ in 0..PUSHES {
            let by = sweep.depenetrate(body, place, motion.turn, &push, &solid);
            // Other things do not push it through a wall: rather they part later.
            if by.length() < CLEAR_M || !by.is_finite() || is_hidden(sweep, place + to_middle, by, &stone) {
                break;
            }
            place += by;
        }
        place
    });
    let place = place.unwrap_or(wanted);
    if place.distance(wanted) > NEWS_M {
        warn_once!("a thing was let go inside something, and was put beside it");
    }
    place
}

/// Tells, once, of a thing that rests inside another: they part gently when something touches them.
pub fn tell_of_overlap(space: &mut Space, name: &str, body: &Collider, at: Motion) {
    let things = SpatialQueryFilter::from_mask(layer::THING);
    if space.ask(|sweep| is_inside(sweep, body, at.place, at.turn, &things)).unwrap_or(false) {
        warn_once!("{name} stands inside another thing; they part when something touches them");
    }
}

fn is_inside(sweep: &MoveAndSlide, body: &Collider, place: Vec3, turn: Quat, solid: &SpatialQueryFilter) -> bool {
    let mut deepest = 0.0_f32;
    sweep.intersections(body, place, turn, 0.0, solid, |_, point, _| {
        deepest = deepest.max(point.penetration);
        true
    });
    deepest > INSIDE_M
}

fn is_hidden(sweep: &MoveAndSlide, eye: Vec3, way: Vec3, stone: &SpatialQueryFilter) -> bool {
    let Ok((ahead, distance)) = Dir3::new_and_length(way) else { return false };
    sweep.spatial_query.cast_ray(eye, ahead, distance, true, stone).is_some()
}
