//! Dust: motes that hang in the air, and the beams that sun and lamps make of air in which they do.
//!
//! Motes too small to be seen one by one are a haze. It is drawn as slices, soft discs that face the eye all through the box; each asks the sun's map where it
//! is pierced, so that few and large ones suffice and beams have edges nevertheless; of lamps' light it asks the maps of their shadows in the same way. Where neither reaches there is
//! nothing to draw.

use super::light::Reached;
use super::quad::{Quad, Shape};
use super::source::Source;
use crate::lamps::Lamp;
use crate::lamps::uniform::may_light;
use glam::{UVec3, Vec3};
use heliodon_math::random::{Pcg32, hash2_u32, hash3_u32, unit_f32};
use std::f32::consts::TAU;

/// Motes of a cubic metre that are large enough to be seen one by one.
const MOTES_PER_M3: f32 = 26.0;
/// The most and the fewest motes of a source of the usual density.
const MOST_MOTES: f32 = 2600.0;
const FEWEST_MOTES: f32 = 40.0;
/// Half the width of a mote: fluff and the coarsest of marble's dust.
pub const MOTE_M: f32 = 0.0011;
/// How long one is followed until another takes its part.
pub const MOTE_S: f32 = 14.0;
/// How fast motes go with the air, metres a second, and how far they sway.
pub const MOTE_DRIFT_M_PER_S: f32 = 0.022;
pub const MOTE_SWAY_M: f32 = 0.03;
/// How large the smallest mote is, and how much more the largest.
pub const MOTE_SIZES: [f32; 2] = [0.6, 1.4];
/// How much brighter than white in the same sun a mote is to whoever looks across the light: its own size is less than that of its glare.
pub const MOTE_SHINES: f32 = 3.0;
/// How long dust takes to rise and to settle.
pub const SETTLES_S: f64 = 3.0;
/// What a metre of air scatters: a workshop in which stone is cut, a tenth of fog.
const SCATTERS_PER_M: f32 = 0.075;
/// Slices of haze in a source's box at most, and the least width of their cells.
const MOST_CELLS: f32 = 3600.0;
const LEAST_CELL_M: f32 = 0.16;
/// A disc is so many times as wide as its cell.
const OVERLAP: f32 = 1.15;

/// Motes of a source.
#[must_use]
pub fn mote_count(source: &Source) -> f32 {
    (source.volume_m3() * MOTES_PER_M3).clamp(FEWEST_MOTES, MOST_MOTES) * source.density
}

/// The box that no mote of a source leaves any part of, whoever moves it: a little more than [`Source::bounds`].
#[must_use]
pub fn mote_bounds(source: &Source) -> (Vec3, Vec3) {
    let (low, high) = source.bounds();
    let drift = 0.5 * MOTE_DRIFT_M_PER_S * MOTE_S;
    let margin = drift + MOTE_SWAY_M + MOTE_M * source.size * (MOTE_SIZES[0] + MOTE_SIZES[1]);
    (low - margin, high + margin)
}

/// How many cells along each side a source's haze has, and the width that they have about.
#[must_use]
pub fn cells(source: &Source, share: f32) -> ([u32; 3], f32) {
    let cell = (source.volume_m3() / MOST_CELLS).cbrt().max(LEAST_CELL_M) / share.max(0.02).cbrt();
    ((2.0 * source.extent / cell).ceil().max(Vec3::ONE).as_uvec3().to_array(), cell)
}

/// Dust at a time; without its motes where those are elsewhere.
pub fn dust(source: &Source, (share, elsewhere): (f32, bool), now_s: f64, reached: &Reached, out: &mut Vec<Quad>) {
    let there = source.span.presence(now_s, SETTLES_S);
    // until it is known where the sun shines, there would be dust in the shade
    let map = reached.map.filter(|_| reached.air.sun != Vec3::ZERO);
    let (low, high) = source.bounds();
    let lamps: Vec<Lamp> = reached.lamps.iter().filter(|lamp| may_light(&[**lamp], (low, high))).copied().collect();
    let reached = Reached { map, lamps: &lamps, ..*reached };
    if there <= 0.0 || (map.is_none() && lamps.is_empty()) {
        return;
    }
    if !elsewhere {
        motes(source, share, now_s, &reached, there, out);
    }
    haze(source, share, now_s, &reached, there, out);
}

impl Quad {
    /// Dust that scatters so much of what the sun sends to it, and of lamps' light where they reach it.
    fn dusty(self, reached: &Reached, lit: f32, scatters: f32, by_lamps: bool) -> Self {
        let given = if by_lamps { scatters } else { 0.0 };
        self.in_sun(reached.air.sun * (lit * scatters)).under_lamps(Vec3::splat(given))
    }
}

fn motes(source: &Source, share: f32, now_s: f64, reached: &Reached, there: f32, out: &mut Vec<Quad>) {
    for number in 0..(mote_count(source) * share) as u32 {
        let own = unit_f32(hash2_u32(source.seed, number));
        let turns = now_s / f64::from(MOTE_S) + f64::from(own);
        let (turn, age) = (turns.floor(), turns.fract() as f32);
        let mut random = Pcg32::new(u64::from(hash3_u32(source.seed, number, turn as i64 as u32)), 1);
        let at = Vec3::from([0, 1, 2].map(|_| random.range_f32(-1.0, 1.0)));
        let phase = random.range_f32(0.0, TAU);
        let age_s = age * MOTE_S;
        // in still air it sinks a millimetre a second, and goes with every draught
        let [x, y, z] = [0, 1, 2].map(|_| random.range_f32(-1.0, 1.0));
        let drift = Vec3::new(x, 0.4 * y - 0.25, z) * (MOTE_DRIFT_M_PER_S * (age_s - 0.5 * MOTE_S));
        let sway = Vec3::new((0.7 * age_s + phase).sin(), (0.5 * age_s + 2.0 * phase).sin(), (0.6 * age_s + 3.0 * phase).cos());
        let place = source.place + at * source.extent + drift + sway * MOTE_SWAY_M;
        let lit = reached.map.map_or(0.0, |(map, _)| map.at(place));
        let by_lamps = reached.lamps_reach(place, 0.0);
        if lit <= 0.0 && !by_lamps {
            continue;
        }
        let radius = MOTE_M * source.size * (MOTE_SIZES[0] + MOTE_SIZES[1] * own * own * own);
        // it turns, and shows now its face and now its edge
        let turned = 0.55 + 0.45 * (random.range_f32(0.8, 3.5) * age_s + phase).sin();
        let ends = (age * 6.0).min(1.0).min((1.0 - age) * 6.0);
        let scatters = MOTE_SHINES * turned * ends * there;
        out.push(Quad::new(Shape::Mote, place, radius, own).dusty(reached, lit, scatters, by_lamps));
    }
}

fn haze(source: &Source, share: f32, now_s: f64, reached: &Reached, there: f32, out: &mut Vec<Quad>) {
    let ([columns, rows, layers], cell) = cells(source, share);
    let radius = OVERLAP * cell;
    // the discs' profile (1 - r^2)^2 covers a third of their area: this thickness makes them as thick as their cell all together
    let widths = 2.0 * source.extent / UVec3::new(columns, rows, layers).as_vec3();
    let thickness = widths.element_product() * 3.0 / (std::f32::consts::PI * radius * radius);
    let scatters = SCATTERS_PER_M * source.density * thickness * there;
    for z in 0..layers {
        for y in 0..rows {
            for x in 0..columns {
                let at = hash3_u32(source.seed ^ x, y, z);
                let off = Vec3::from([1, 2, 3].map(|axis| unit_f32(hash2_u32(at, axis))));
                let grid = Vec3::new(x as f32, y as f32, z as f32) + 0.2 + 0.6 * off;
                let place = source.place - source.extent + grid * widths;
                let map = reached.map.filter(|(map, _)| map.reaches(place, radius));
                let by_lamps = reached.lamps_reach(place, radius);
                if map.is_none() && !by_lamps {
                    continue;
                }
                // clouds of it drift by
                let phase = place.dot(Vec3::new(1.9, 2.3, 1.7)) as f64;
                let cloud = 1.0 + 0.35 * (phase + now_s * 0.31).sin() as f32 * (1.7 * phase - now_s * 0.23).sin() as f32;
                let quad = Quad::new(Shape::Haze, place, radius, off.x).with_map(map.map(|(_, number)| number));
                let lit = if map.is_some() { 1.0 } else { 0.0 };
                out.push(quad.dusty(reached, lit, scatters * cloud, by_lamps));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lamps::Cone;
    use crate::particles::light::tests::noon;
    use crate::particles::source::tests::source;
    use crate::particles::sun_map::SunMap;
    use crate::stage::ground::Ground;
    use heliodon_bundle::site::ParticleKind;

    #[test]
    fn dust_is_seen_in_the_sun_alone() {
        let source = Source { extent: Vec3::new(2.0, 1.0, 2.0), ..source(ParticleKind::Dust, Vec3::ZERO) };
        let map = SunMap::new(&Ground::default(), source.bounds(), Vec3::Y);
        let mut light = noon();
        light.map = Some((&map, 0));
        let mut out = Vec::new();
        dust(&source, (1.0, false), 5.0, &light, &mut out);
        assert!(out.len() > 500 && out.iter().all(|quad| quad.of_sun().x > 0.0 && quad.radiance() == Vec3::ZERO));
        light.air.sun = Vec3::ZERO;
        out.clear();
        dust(&source, (1.0, false), 5.0, &light, &mut out);
        assert!(out.is_empty());
    }

    #[test]
    fn dust_is_seen_in_the_cone_of_a_lamp() {
        let source = Source { extent: Vec3::splat(2.0), ..source(ParticleKind::Dust, Vec3::ZERO) };
        let cone = Some(Cone { direction: Vec3::NEG_Y, half_angle_rad: 0.3, edge: 0.2 });
        let lamp = Lamp { place: Vec3::Y * 3.0, intensity: Vec3::ONE, cone, reach_m: 8.0, shadows: true };
        let dusty = |lamp: Lamp| {
            let mut light = Reached { lamps: &[lamp], ..noon() };
            light.air.sun = Vec3::ZERO;
            let mut out = Vec::new();
            dust(&source, (1.0, false), 5.0, &light, &mut out);
            out
        };
        let lit = dusty(lamp);
        assert!(lit.len() > 200 && lit.iter().all(|quad| quad.of_lamps().x > 0.0 && quad.of_sun() == Vec3::ZERO));
        let off_axis = |quad: &Quad| {
            let away = quad.middle() - lamp.place;
            Vec3::new(away.x, 0.0, away.z).length() - 0.31 * -away.y
        };
        assert!(lit.iter().all(|quad| off_axis(quad) < 1.1 * quad.reach_m()), "none is outside the cone");
        assert!(lit.iter().any(|quad| quad.middle().y > 1.0) && lit.iter().any(|quad| quad.middle().y < -1.0));
        let away = Some(Cone { direction: Vec3::Y, half_angle_rad: 0.3, edge: 0.2 });
        assert!(dusty(Lamp { cone: away, ..lamp }).is_empty(), "it shines elsewhere");
        assert!(dusty(Lamp { intensity: Vec3::splat(1e-4), ..lamp }).is_empty(), "too faint to be seen");
    }

    #[test]
    fn no_mote_leaves_its_box() {
        let source = Source { size: 20.0, density: 100.0, ..source(ParticleKind::Dust, Vec3::ONE) };
        let (low, high) = mote_bounds(&source);
        let map = SunMap::new(&Ground::default(), (low, high), Vec3::Y);
        let light = Reached { map: Some((&map, 0)), ..noon() };
        let mut out = Vec::new();
        motes(&source, 1.0, 5.0, &light, 1.0, &mut out);
        let inside = |(low, high): (Vec3, Vec3)| {
            let radius = |quad: &Quad| quad.reach_m() / std::f32::consts::SQRT_2;
            let is_in = |quad: &&Quad| {
                (quad.middle() - radius(quad)).cmpge(low).all() && (quad.middle() + radius(quad)).cmple(high).all()
            };
            out.iter().filter(is_in).count()
        };
        assert!(out.len() > 3000 && inside((low, high)) == out.len(), "{} of {}", inside((low, high)), out.len());
        assert!(inside(source.bounds()) < out.len(), "it is needed");
        assert!(inside((low + 0.1, high - 0.1)) < out.len(), "and fits");
    }

    #[test]
    fn haze_is_as_thick_however_finely_it_is_cut() {
        let source = Source { extent: Vec3::splat(2.0), ..source(ParticleKind::Dust, Vec3::ZERO) };
        let map = SunMap::new(&Ground::default(), source.bounds(), Vec3::Y);
        let light = Reached { map: Some((&map, 0)), ..noon() };
        let whole = |share: f32| {
            let mut out = Vec::new();
            haze(&source, share, 0.0, &light, 1.0, &mut out);
            // what all discs scatter together: a third of the area of each
            let sum: f32 = out.iter().map(|quad| quad.of_sun().x * quad.reach_m().powi(2)).sum();
            (out.len(), sum)
        };
        let ((many, fine), (few, coarse)) = (whole(1.0), whole(0.1));
        assert!(many > 5 * few && few > 50, "{many} and {few}");
        assert!((fine / coarse - 1.0).abs() < 0.2, "{fine} and {coarse}");
    }

    #[test]
    fn dust_settles() {
        let mut source = Source { extent: Vec3::ONE, ..source(ParticleKind::Dust, Vec3::ZERO) };
        source.span.stop(10.0);
        let map = SunMap::new(&Ground::default(), source.bounds(), Vec3::Y);
        let light = Reached { map: Some((&map, 0)), ..noon() };
        let sum = |now_s: f64| {
            let mut out = Vec::new();
            dust(&source, (1.0, false), now_s, &light, &mut out);
            out.iter().map(|quad| quad.of_sun().x).sum::<f32>()
        };
        let sums = [9.9, 11.5, 13.1].map(sum);
        assert!(sums[0] > sums[1] && sums[1] > 0.0 && sums[2] == 0.0, "{sums:?}");
    }
}
