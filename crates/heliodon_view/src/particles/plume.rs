//! Fire and smoke: what rises.

use super::births::{Births, Born};
use super::light::Reached;
use super::quad::{Quad, Shape};
use super::source::Source;
use crate::lamps::Lamp;
use glam::{Vec2, Vec3};
use heliodon_math::random::{hash2_u32, unit_f32};
use std::f32::consts::TAU;

/// Tongues that a fire has at a time.
const TONGUES: f64 = 64.0;
/// Seconds that they live at most, in a fire whose flames are one metre high; higher ones live longer, as the root of their height.
const TONGUE_S: f32 = 0.95;
/// How many times as high as wide a tongue is.
const TONGUE_TIMES: f32 = 2.1;
/// How much of what is behind it a tongue hides: soot.
const SOOT: f32 = 0.26;
/// What fire's light is like: some 1900 kelvin.
const FIRELIGHT: Vec3 = Vec3::new(1.0, 0.40, 0.09);
/// Puffs of smoke a second.
const PUFFS_PER_S: f64 = 11.0;
/// How long they are there.
pub const PUFF_S: f32 = 7.5;
/// How fast smoke rises at first, metres a second.
pub const RISE_M_PER_S: f32 = 0.95;
/// How much faster or slower than that a puff does, at the least and at the most.
pub const RISES: [f32; 2] = [0.85, 1.15];
/// How long it takes to slow down as it cools, seconds, and how fast it goes on rising, metres a second.
pub const COOLS_S: f32 = 2.4;
pub const RISE_ON_M_PER_S: f32 = 0.18;
/// How far to each side the air of a source streams at the most, of one.
pub const LEAN: f32 = 0.7;
/// How far such a stream of one has carried a puff after a second, metres; it grows with the time to the power of 1.5.
pub const DRIFT_M: f32 = 0.16;
/// How far a puff curls after a second, metres; it grows with the root of the time.
pub const CURL_M: f32 = 0.09;
/// How fast a puff grows, metres a second to each side, and how much faster or slower, at the least and at the most.
pub const SPREAD_M_PER_S: f32 = 0.17;
pub const SPREADS: [f32; 2] = [0.8, 1.2];
/// What smoke gives back of the light that falls on it.
pub const SMOKE_ALBEDO: Vec3 = Vec3::new(0.62, 0.63, 0.66);
/// What a fresh puff takes away in its middle.
pub const THICKNESS: f32 = 0.5;

/// The light that a fire gives to what is around it, where flames have so much radiance.
#[must_use]
pub fn fire_light(source: &Source, now_s: f64, radiance: f32) -> Option<Lamp> {
    let (wide, high) = (source.width_m(), flame_m(source));
    let there = source.span.presence(now_s, f64::from(tongue_s(source)));
    // flames fill a third of the box about them, and embers lie beneath
    let whole = radiance * source.density.sqrt().min(2.0) * there * (1.3 * wide * high);
    (whole > 0.0).then(|| Lamp {
        // higher it would shine through its own smoke, deeper the ground beneath would be all that it lights
        place: source.place + Vec3::Y * (0.5 * high),
        intensity: FIRELIGHT * (whole * flicker(source.seed, now_s)),
        cone: None,
        reach_m: (18.0 * (wide * high).sqrt()).clamp(4.0, 40.0),
        shadows: true,
    })
}

/// How high a fire's flames are, metres.
#[must_use]
pub fn flame_m(source: &Source) -> f32 {
    (2.6 * source.width_m() + 0.18) * source.size
}

/// How long anything of a fire lives.
fn tongue_s(source: &Source) -> f32 {
    TONGUE_S * flame_m(source).sqrt()
}

/// The births of a fire.
#[must_use]
pub fn fire_births(source: &Source, share: f32) -> Births {
    let most_s = f64::from(tongue_s(source));
    // most live two thirds of it
    let per_s = TONGUES * f64::from(source.density) / (0.66 * most_s);
    Births { seed: source.seed, per_s, most_s, share, span: source.span }
}

/// The births of smoke.
#[must_use]
pub fn smoke_births(source: &Source, share: f32) -> Births {
    let per_s = PUFFS_PER_S * f64::from(source.density);
    Births { seed: source.seed, per_s, most_s: f64::from(PUFF_S), share, span: source.span }
}

/// Fire at a time.
pub fn fire(source: &Source, share: f32, now_s: f64, reached: &Reached, out: &mut Vec<Quad>) {
    let (wide, high, most_s) = (source.width_m(), flame_m(source), tongue_s(source));
    let flicker = flicker(source.seed, now_s);
    let whole = reached.air.flame * (1.0 / share.max(0.1)).min(3.0) / source.density.max(0.3).sqrt();
    let before = out.len();
    for Born { mut random, own, age_s } in fire_births(source, share).at(now_s) {
        let (angle, off) = (random.range_f32(0.0, TAU), random.next_f32().sqrt());
        // those at the rim are short
        let life_s = most_s * (1.0 - 0.55 * off * off) * random.range_f32(0.75, 1.0);
        let age = age_s / life_s;
        if age >= 1.0 {
            continue;
        }
        let at = Vec2::from_angle(angle) * off;
        let base = Vec3::new(at.x * source.extent.x, random.range_f32(-1.0, 1.0) * source.extent.y, at.y * source.extent.z);
        // air that streams in from all sides draws it to the middle; it rises the faster the higher it is
        let drawn = 1.0 - 0.62 * age;
        let phase = random.range_f32(0.0, TAU);
        let sway = Vec2::new((7.0 * age_s + phase).sin(), (6.1 * age_s + 1.7 * phase).sin()) * (0.16 * wide * age);
        // all of a fire leans together
        let lean = lean(source.seed, now_s) * (0.22 * high * age * age);
        let rise = high * (life_s / most_s) * (0.25 * age + 0.6 * age * age);
        let radius = (0.42 * wide + 0.03) * source.size * (1.0 - 0.5 * age) * random.range_f32(0.6, 1.2);
        // its foot stands where it was born
        let stands = 0.85 * TONGUE_TIMES * radius;
        let place = source.place
            + Vec3::new(base.x * drawn, base.y * (1.0 - age) + rise + stands, base.z * drawn)
            + Vec3::new(sway.x + lean.x, 0.0, sway.y + lean.y);
        let up = Vec3::new(-base.x * 0.5 + sway.x + lean.x, high * (0.35 + 1.3 * age), -base.z * 0.5 + sway.y + lean.y);
        let up = heliodon_math::frame::unit_or(up, Vec3::Y);
        let begun = (age * 7.0).min(1.0);
        let strength = whole * flicker * begun * (1.0 - age).powf(0.6);
        let quad = Quad::new(Shape::Flame, place, radius, own).stretched(up, TONGUE_TIMES);
        out.push(quad.glowing(Vec3::splat(strength), SOOT * begun * (1.0 - age)).aged(age));
    }
    // the air about it is bright, as in the eye or on film
    let there = (out.len() - before) as f32 / (TONGUES as f32 * source.density * share).max(1.0);
    if out.len() > before {
        let place = source.place + Vec3::Y * (0.38 * high);
        let glare = Vec3::new(1.0, 0.42, 0.12) * (0.05 * reached.air.flame * flicker * there.min(1.0));
        out.push(Quad::new(Shape::Mote, place, 1.5 * (wide + 0.5 * high), 0.0).glowing(glare, 0.0));
    }
}

/// Smoke at a time.
pub fn smoke(source: &Source, share: f32, now_s: f64, reached: &Reached, out: &mut Vec<Quad>) {
    let first = first_m(source);
    let thick = THICKNESS * (1.0 / share.max(0.1)).min(2.0);
    for Born { mut random, own, age_s } in smoke_births(source, share).at(now_s) {
        let life_s = PUFF_S * random.range_f32(0.7, 1.0);
        let age = age_s / life_s;
        if age >= 1.0 {
            continue;
        }
        let [x, y, z] = [0, 1, 2].map(|_| random.range_f32(-1.0, 1.0));
        let base = Vec3::new(x, y, z) * source.extent * Vec3::new(0.6, 1.0, 0.6);
        let drift = lean(source.seed, now_s - f64::from(age_s)) * (DRIFT_M * age_s * age_s.sqrt());
        let phase = random.range_f32(0.0, TAU);
        let curl =
            Vec2::new((1.1 * age_s + phase).sin() - phase.sin(), (0.9 * age_s + 2.0 * phase).cos() - (2.0 * phase).cos())
                * (CURL_M * age_s.sqrt());
        // it slows as it cools
        let rises = random.range_f32(RISES[0], RISES[1]);
        let rise =
            RISE_M_PER_S * source.size.sqrt() * COOLS_S * (1.0 - (-age_s / COOLS_S).exp()) * rises + RISE_ON_M_PER_S * age_s;
        let radius = first + (SPREAD_M_PER_S * source.size * age_s * random.range_f32(SPREADS[0], SPREADS[1])).max(0.0);
        let place = source.place + base + Vec3::new(drift.x + curl.x, rise, drift.y + curl.y);
        // the same smoke in more air
        let thin = (first / radius).powf(0.7);
        let opacity = (thick * thin * (age * 7.0).min(1.0) * (1.0 - age).powf(0.8)).min(0.9);
        let reach = reached.sun_at(place);
        // scattered more than once, the light of the brightest side is that of all
        let around = reached.ambient.lerp(reached.brightest, 0.4) * SMOKE_ALBEDO;
        // a quarter of what is scattered to all sides, as of a ball
        let given = if reached.lamps_reach(place, radius) { SMOKE_ALBEDO * 0.25 } else { Vec3::ZERO };
        let quad = Quad::new(Shape::Smoke, place, radius, own).glowing(around, opacity).under_lamps(given);
        out.push(quad.in_sun(reached.air.sun * SMOKE_ALBEDO * (0.5 * reach)).aged(age));
    }
}

/// Half the width of a fresh puff, metres.
fn first_m(source: &Source) -> f32 {
    (0.5 * source.width_m() + 0.05) * source.size
}

/// The box that no puff of a source leaves any part of, whoever moves it: more than [`Source::bounds`], within which their middles mostly are.
#[must_use]
pub fn puff_bounds(source: &Source) -> (Vec3, Vec3) {
    let radius = first_m(source) + SPREAD_M_PER_S * source.size * PUFF_S * SPREADS[1];
    let aside = LEAN * DRIFT_M * PUFF_S * PUFF_S.sqrt() + 2.0 * CURL_M * PUFF_S.sqrt();
    let rise = RISE_M_PER_S * source.size.sqrt() * COOLS_S * RISES[1] + RISE_ON_M_PER_S * PUFF_S;
    let low = source.place - source.extent - Vec3::new(aside, 0.0, aside) - radius;
    (low, source.place + source.extent + Vec3::new(aside, rise, aside) + radius)
}

/// How bright a fire is beside its mean, now.
fn flicker(seed: u32, now_s: f64) -> f32 {
    1.0 + 0.22 * (wave(seed, now_s * 7.3) - 0.5) + 0.18 * (wave(seed ^ 0x55, now_s * 2.9) - 0.5)
}

/// Whither the air of a source streams, now; of length one at most.
fn lean(seed: u32, now_s: f64) -> Vec2 {
    Vec2::new(wave(seed ^ 0x11, now_s * 0.9), wave(seed ^ 0x22, now_s * 1.1)) * (2.0 * LEAN) - LEAN
}

/// Smooth noise of one number, 0 to 1.
fn wave(seed: u32, at: f64) -> f32 {
    let whole = at.floor();
    let value = |number: i64| unit_f32(hash2_u32(seed, number as u32));
    let part = (at - whole) as f32;
    let eased = part * part * (3.0 - 2.0 * part);
    let (a, b) = (value(whole as i64), value(whole as i64 + 1));
    a + (b - a) * eased
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::particles::births::Span;
    use crate::particles::light::tests::noon;
    use crate::particles::source::tests::source;
    use heliodon_bundle::site::ParticleKind;

    fn quads(kind: ParticleKind, span: Span, now_s: f64) -> (Source, Vec<Quad>) {
        let source = Source { span, ..source(kind, Vec3::new(3.0, 1.0, -2.0)) };
        let mut out = Vec::new();
        match kind {
            ParticleKind::Fire => fire(&source, 1.0, now_s, &noon(), &mut out),
            _ => smoke(&source, 1.0, now_s, &noon(), &mut out),
        }
        (source, out)
    }

    #[test]
    fn what_rises_stays_within_its_box_and_is_the_same_again() {
        for kind in [ParticleKind::Fire, ParticleKind::Smoke] {
            for now_s in [0.0, 1.37, 900.0] {
                let (source, all) = quads(kind, Span::ALWAYS, now_s);
                assert!((25..90).contains(&all.len()), "{kind:?}: {}", all.len());
                let (low, high) = source.bounds();
                for quad in &all {
                    let at = quad.middle();
                    assert!(at.cmpge(low).all() && at.cmple(high).all(), "{kind:?}: {at} of {low} to {high}");
                }
                assert_eq!(all, quads(kind, Span::ALWAYS, now_s).1);
            }
        }
    }

    #[test]
    fn no_part_of_a_puff_leaves_its_box() {
        let mut beyond = Vec3::ZERO;
        for (size, extent) in [(1.0, Vec3::splat(0.2)), (0.3, Vec3::ZERO), (12.0, Vec3::new(2.0, 0.1, 0.3))] {
            let source = Source { size, extent, density: 300.0, ..source(ParticleKind::Smoke, Vec3::new(3.0, 1.0, -2.0)) };
            let (low, high) = puff_bounds(&source);
            let (mut reached_low, mut reached_high) = (source.place, source.place);
            for now_s in [1.0, 33.7, 81.2, 400.0] {
                let mut out = Vec::new();
                smoke(&source, 1.0, now_s, &noon(), &mut out);
                for quad in &out {
                    // round, whichever way it is turned
                    let radius = quad.reach_m() / std::f32::consts::SQRT_2;
                    reached_low = reached_low.min(quad.middle() - radius);
                    reached_high = reached_high.max(quad.middle() + radius);
                }
            }
            let told = format!("{size}: {reached_low} to {reached_high} of {low} to {high}");
            assert!(reached_low.cmpge(low).all() && reached_high.cmple(high).all(), "{told}");
            assert!((reached_high - reached_low).cmpge(0.55 * (high - low)).all(), "it fits: {told}");
            let seen = source.bounds();
            beyond = beyond.max(seen.0 - reached_low).max(reached_high - seen.1);
        }
        assert!(beyond.max_element() > 0.5, "it is needed: {beyond}");
    }

    #[test]
    fn fire_shines_and_smoke_takes_light_away_and_gives_back_less() {
        let mut dark = noon();
        (dark.air.sun, dark.ambient, dark.brightest) = (Vec3::ZERO, Vec3::ZERO, Vec3::ZERO);
        let fire_source = source(ParticleKind::Fire, Vec3::ZERO);
        let (mut flames, mut puffs) = (Vec::new(), Vec::new());
        fire(&fire_source, 1.0, 2.0, &dark, &mut flames);
        smoke(&source(ParticleKind::Smoke, Vec3::ZERO), 1.0, 2.0, &dark, &mut puffs);
        assert!(flames.iter().any(|quad| quad.radiance().x > 0.3));
        assert!(puffs.iter().all(|quad| quad.radiance() == Vec3::ZERO && quad.of_sun() == Vec3::ZERO));
    }

    #[test]
    fn a_fire_lights_what_is_around_it_and_its_smoke_until_it_is_out() {
        let mut burning = source(ParticleKind::Fire, Vec3::ZERO);
        burning.span.stop(4.0);
        let lamp = fire_light(&burning, 3.0, 2.0).unwrap();
        assert!(lamp.place.y > 0.0 && lamp.place.y < flame_m(&burning) && lamp.reach_m > 1.0);
        assert!(lamp.intensity.x > lamp.intensity.y && lamp.intensity.y > lamp.intensity.z);
        let dying = fire_light(&burning, 4.5, 2.0).unwrap();
        assert!(dying.intensity.x < 0.8 * lamp.intensity.x && dying.place == lamp.place, "its shadows stay");
        assert_eq!(fire_light(&burning, 6.0, 2.0), None);
        let given = |lamps: &[Lamp]| {
            let reached = Reached { lamps, ..noon() };
            let mut out = Vec::new();
            smoke(&source(ParticleKind::Smoke, Vec3::ZERO), 1.0, 3.0, &reached, &mut out);
            out.iter().map(Quad::of_lamps).sum::<Vec3>()
        };
        assert_eq!(given(&[]), Vec3::ZERO);
        assert!(given(&[lamp]).min_element() > 0.0);
        assert_eq!(given(&[Lamp { place: Vec3::X * 2.0 * lamp.reach_m, ..lamp }]), Vec3::ZERO, "beyond its reach");
    }

    #[test]
    fn a_fire_that_is_put_out_dies_within_a_second() {
        let span = Span { since_s: 1.0, until_s: 5.0 };
        assert!(quads(ParticleKind::Fire, span, 0.9).1.is_empty());
        let counts = [4.9, 5.3, 7.0].map(|now_s| quads(ParticleKind::Fire, span, now_s).1.len());
        assert!(counts[0] > counts[1] && counts[1] > 0 && counts[2] == 0, "{counts:?}");
    }
}
