//! Sparks and water: what flies and falls.

use super::births::{Births, Born};
use super::light::Reached;
use super::quad::{Quad, Shape};
use super::source::Source;
use glam::{Vec2, Vec3};
use heliodon_math::frame::unit_or;
use std::f32::consts::TAU;

/// Gravity, metres a second squared.
pub const GRAVITY: f32 = 9.81;
/// How long a picture is taken: streaks are as long as what moves goes meanwhile.
pub const SHUTTER_S: f32 = 1.0 / 48.0;
/// Sparks a second.
const SPARKS_PER_S: f64 = 42.0;
/// The longest that a spark glows.
pub const SPARK_S: f32 = 1.7;
/// Half the width of a spark: a splinter of charcoal.
pub const SPARK_M: f32 = 0.0022;
/// Of the gravity what pulls it in the hot air that it rises with.
pub const SPARK_WEIGHT: f32 = 0.34;
/// How fast air brakes it, a second.
pub const SPARK_DRAG: f32 = 1.3;
/// Drops a second from a source of the usual extent; wider ones have more, as their area.
const DROPS_PER_S: f64 = 90.0;
/// Half the width of a drop.
pub const DROP_M: f32 = 0.0034;
/// How long what splashes from a drop is seen.
pub const SPLASH_S: f32 = 0.32;
/// Droplets that splash from a drop.
const DROPLETS: u32 = 4;
/// How much brighter a drop is than a white plane that faces where most light comes from: it is a lens that shows the window itself.
pub const DROP_SHINES: f32 = 1.5;
/// How much brighter than white a drop is that turns the sun to the eye.
pub const GLINT: f32 = 3.0;

/// The births of sparks.
#[must_use]
pub fn spark_births(source: &Source, share: f32) -> Births {
    let per_s = SPARKS_PER_S * f64::from(source.density);
    Births { seed: source.seed, per_s, most_s: f64::from(SPARK_S), share, span: source.span }
}

/// The births of drops.
#[must_use]
pub fn drop_births(source: &Source, share: f32) -> Births {
    let area = f64::from(source.extent.x * source.extent.z / 0.04).clamp(0.25, 40.0);
    let most_s = f64::from(fall_s(source) + SPLASH_S);
    Births { seed: source.seed, per_s: DROPS_PER_S * area * f64::from(source.density), most_s, share, span: source.span }
}

/// The longest that a drop of a source falls.
fn fall_s(source: &Source) -> f32 {
    let (low, high) = source.bounds();
    (2.0 * (high.y - low.y) / GRAVITY).sqrt().min(4.0)
}

/// Sparks at a time.
pub fn sparks(source: &Source, share: f32, now_s: f64, reached: &Reached, out: &mut Vec<Quad>) {
    for Born { mut random, own, age_s } in spark_births(source, share).at(now_s) {
        let life_s = SPARK_S * random.range_f32(0.35, 1.0);
        let age = age_s / life_s;
        if age >= 1.0 {
            continue;
        }
        let base = [0, 1, 2].map(|_| random.range_f32(-1.0, 1.0));
        let (turn, tilt) = (Vec2::from_angle(random.range_f32(0.0, TAU)), random.next_f32().sqrt() * 0.75);
        let speed = random.range_f32(1.2, 3.6) * source.size.sqrt();
        let thrown = Vec3::new(turn.x * tilt.sin(), tilt.cos(), turn.y * tilt.sin()) * speed;
        // with linear drag k towards the velocity of falling g / k
        let falling = Vec3::NEG_Y * (GRAVITY * SPARK_WEIGHT / SPARK_DRAG);
        let braked = (-SPARK_DRAG * age_s).exp();
        let phase = random.range_f32(0.0, TAU);
        let whirl = Vec3::new((9.0 * age_s + phase).sin(), 0.0, (8.0 * age_s + 2.0 * phase).sin()) * (0.05 * age_s);
        let place = source.place
            + Vec3::from(base) * source.extent
            + (thrown - falling) * ((1.0 - braked) / SPARK_DRAG)
            + falling * age_s
            + whirl;
        if place.y < source.floor(place.x, place.z) {
            continue;
        }
        let velocity = (thrown - falling) * braked + falling;
        let radius = SPARK_M * source.size * random.range_f32(0.6, 1.3);
        let streak = 1.0 + velocity.length() * SHUTTER_S / (2.0 * radius);
        // it cools from yellow to red, and flares up now and then
        let heat = (1.0 - age).powf(0.7);
        let flare = 1.0 + 0.5 * (31.0 * age_s + 40.0 * own).sin() * (17.0 * age_s).sin();
        let color = Vec3::new(1.0, 0.52 * heat.powf(1.3), 0.16 * heat.powi(3));
        // the streak is as bright as the spark that is everywhere on it for a moment
        let radiance = color * (13.0 * reached.air.flame * heat * flare.max(0.2) / streak.sqrt());
        let quad = Quad::new(Shape::Mote, place, radius, own).stretched(unit_or(velocity, Vec3::Y), streak);
        out.push(quad.glowing(radiance, 0.0).aged(age));
    }
}

/// Water at a time.
pub fn water(source: &Source, share: f32, now_s: f64, reached: &Reached, out: &mut Vec<Quad>) {
    for Born { mut random, own, age_s } in drop_births(source, share).at(now_s) {
        let base = [0, 1, 2].map(|_| random.range_f32(-1.0, 1.0));
        let from = source.place + Vec3::from(base) * source.extent;
        let floor = source.floor(from.x, from.z);
        let lands_s = (2.0 * (from.y - floor).max(0.0) / GRAVITY).sqrt();
        let radius = DROP_M * source.size * random.range_f32(0.7, 1.25);
        if age_s < lands_s {
            let place = from - Vec3::Y * (0.5 * GRAVITY * age_s * age_s);
            let speed = GRAVITY * age_s;
            let streak = 1.0 + speed * SHUTTER_S / (2.0 * radius);
            out.push(drop(place, radius, own, reached).stretched(Vec3::Y, streak));
            continue;
        }
        let since_s = age_s - lands_s;
        if since_s >= SPLASH_S {
            continue;
        }
        for _ in 0..DROPLETS {
            let turn = Vec2::from_angle(random.range_f32(0.0, TAU));
            let (outward, upward) = (random.range_f32(0.25, 0.9), random.range_f32(0.7, 1.5));
            let thrown = Vec3::new(turn.x * outward, upward, turn.y * outward) * source.size.sqrt();
            let own = random.next_f32();
            let off = thrown * since_s - Vec3::Y * (0.5 * GRAVITY * since_s * since_s);
            if off.y >= 0.0 {
                let velocity = thrown - Vec3::Y * (GRAVITY * since_s);
                let small = radius * 0.55;
                let streak = 1.0 + velocity.length() * SHUTTER_S / (2.0 * small);
                let quad = drop(Vec3 { y: floor, ..from } + off, small, own, reached);
                out.push(quad.stretched(unit_or(velocity, Vec3::Y), streak));
            }
        }
    }
}

/// A drop in the light.
fn drop(place: Vec3, radius: f32, own: f32, reached: &Reached) -> Quad {
    // few of them at a time turn the sun to the eye
    let turned = ((own * 57.0 + place.y * 3.1).fract() - 0.8).max(0.0) * 5.0;
    let sun = reached.air.sun * (reached.sun_at(place) * (0.15 + GLINT * turned * turned));
    let given = if reached.lamps_reach(place, radius) { 0.25 * DROP_SHINES } else { 0.0 };
    let quad = Quad::new(Shape::Mote, place, radius, own).glowing(reached.brightest * DROP_SHINES, 0.5);
    quad.in_sun(sun).under_lamps(Vec3::splat(given))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::daylight::chunk::KeptChunk;
    use crate::daylight::cluster::cluster;
    use crate::particles::light::tests::noon;
    use crate::particles::source::tests::source;
    use crate::stage::ground::Ground;
    use heliodon_bundle::site::ParticleKind;
    use std::sync::Arc;

    fn floor() -> Ground {
        let corners = [[-5.0, -5.0], [5.0, -5.0], [5.0, 5.0], [-5.0, 5.0]].map(|[x, z]| Vec3::new(x, 0.0, z));
        let made = cluster(&corners, &[[0, 2, 1], [0, 3, 2]]);
        let positions = made.vertices.iter().map(|&v| corners[v as usize]).collect();
        let bounds = (Vec3::new(-5.0, 0.0, -5.0), Vec3::new(5.0, 0.0, 5.0));
        let kept = KeptChunk { positions, indices: made.indices, clusters: made.clusters, bounds, albedo: Vec::new() };
        let mut ground = Ground::default();
        ground.push(Arc::new(kept));
        ground
    }

    #[test]
    fn water_falls_to_the_ground_and_splashes_there() {
        let mut source = source(ParticleKind::Water, Vec3::Y * 2.0);
        source.look_around(&floor());
        assert!(source.floor(0.1, -0.1).abs() < 1e-4);
        let mut out = Vec::new();
        water(&source, 1.0, 11.0, &noon(), &mut out);
        assert!(out.len() > 40, "{}", out.len());
        assert!(out.iter().all(|quad| quad.middle().y >= -1e-3 && quad.middle().y <= 2.2));
        // beside where drops fall is only what splashes
        let beside = out.iter().filter(|quad| quad.middle().x.abs() > 0.21 || quad.middle().z.abs() > 0.21);
        let heights: Vec<f32> = beside.map(|quad| quad.middle().y).collect();
        assert!(!heights.is_empty() && heights.iter().all(|y| *y < 0.3), "{heights:?}");
        // all of it is there from the beginning, and again
        let mut again = Vec::new();
        water(&source, 1.0, 11.0, &noon(), &mut again);
        assert_eq!(out, again);
    }

    #[test]
    fn sparks_cool_and_end_at_the_ground() {
        let mut source = source(ParticleKind::Sparks, Vec3::Y * 0.4);
        source.look_around(&floor());
        let mut out = Vec::new();
        sparks(&source, 1.0, 3.0, &noon(), &mut out);
        assert!((15..60).contains(&out.len()), "{}", out.len());
        let (low, high) = source.bounds();
        for quad in &out {
            let at = quad.middle();
            assert!(at.y >= -1e-3 && at.cmpge(low).all() && at.cmple(high).all(), "{at}");
            assert!(quad.radiance().x > quad.radiance().y && quad.radiance().y > quad.radiance().z);
        }
    }
}
