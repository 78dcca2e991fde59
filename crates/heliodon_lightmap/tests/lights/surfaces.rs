//! Places where formulas divide by zero: on lights, in their planes, at their edges, and beyond the world.

use crate::scenes::{Dice, disc, light, mesh, rectangle};
use glam::Vec3;
use heliodon_lightmap::lights::{Amount, EmitterHit, Light};
use heliodon_math::random::Pcg32;
use proptest::prelude::*;

/// Whatever is asked, answers are finite and not negative.
fn check(light: &Light, at: Vec3, normal: Vec3, numbers: [f32; 2]) {
    let told = || format!("{} at {at}, {normal}, {numbers:?}", light.title());
    if let Some(s) = light.sample(at, numbers) {
        assert!(s.light.is_finite() && s.light.min_element() >= 0.0, "{}: {s:?}", told());
        assert!((s.direction.length() - 1.0).abs() < 1e-5 && s.distance_m >= 0.0, "{}: {s:?}", told());
        assert!(s.pdf_sr.is_none_or(|pdf| pdf.is_finite() && pdf > 0.0), "{}: {s:?}", told());
        let weight = s.mis_weight(0.3);
        assert!((0.0..=1.0).contains(&weight), "{}", told());
    }
    if let Some(all) = light.closed_form(at, normal) {
        assert!(all.is_finite() && all.min_element() >= 0.0, "{}: {all}", told());
    }
    let hit = EmitterHit { triangle: 0, position: at };
    assert!(light.pdf_sr(at, &hit) >= 0.0 && light.pdf_sr(Vec3::ONE, &hit) >= 0.0, "{}", told());
    assert!(light.radiance_towards(&hit, normal).is_finite(), "{}", told());
    assert!(light.upper_bound(at, normal) >= 0.0, "{}", told());
    if let Some((t, hit)) = light.intersect(at, normal) {
        assert!(t >= 0.0 && hit.position.is_finite(), "{}", told());
    }
}

const EDGES: [f32; 5] = [0.0, 0.25, 0.5, 0.75, 0.999_999_94];

#[test]
fn places_on_lights_are_no_trouble() {
    let amount = Amount::LuminanceCdM2(5.0);
    let corners = [[-1.0, 1.0, -1.0], [1.0, 1.0, -1.0], [-1.0, 1.0, 1.0]];
    let mut dice = Dice(Pcg32::new(21, 1));
    let mut specs = dice.lights();
    for both in [false, true] {
        specs.push(rectangle(corners, both, amount));
        specs.push(disc([0.0, 1.0, 0.0], [0.0, 0.0, 0.0], 1.0, both, amount));
        specs.push(mesh("pane", both, amount));
        specs.push(mesh("sheet", both, amount));
    }
    for spec in &specs {
        let light = light(spec);
        let bounds = light.bounds();
        let mut places = vec![Vec3::ZERO, Vec3::NAN, Vec3::INFINITY, Vec3::splat(3e38), Vec3::splat(-1e30), Vec3::splat(1e-40)];
        for x in [-3.0, -1.0, 0.0, 1.0, 3.0] {
            for z in [-3.0, -1.0, 0.0, 0.8, 1.0] {
                places.extend([0.0, 0.999, 0.999_999_94, 1.0, 1.000_000_1, 1.5].map(|y| Vec3::new(x, y, z)));
            }
        }
        if let Some(bounds) = bounds {
            places.extend([bounds.min, bounds.max, bounds.centre()]);
        }
        for &at in &places {
            for normal in [Vec3::Y, Vec3::NEG_Y, Vec3::X, Vec3::ZERO, Vec3::NAN] {
                for u in EDGES {
                    for v in EDGES {
                        check(&light, at, normal, [u, v]);
                    }
                }
            }
        }
        assert_eq!(light.sample(Vec3::NAN, [0.5, 0.5]), None);
    }
}

#[test]
fn dark_sides_and_planes_send_nothing() {
    let amount = Amount::LuminanceCdM2(5.0);
    // both face down
    let corners = [[-1.0, 1.0, -1.0], [1.0, 1.0, -1.0], [-1.0, 1.0, 1.0]];
    for both in [false, true] {
        for spec in [rectangle(corners, both, amount), disc([0.0, 1.0, 0.0], [0.0; 3], 1.0, both, amount)] {
            let light = light(&spec);
            let (below, above, beside) = (Vec3::new(0.2, 0.0, 0.1), Vec3::new(0.2, 2.0, 0.1), Vec3::new(5.0, 1.0, 0.1));
            assert!(light.sample(below, [0.5, 0.5]).is_some() && light.closed_form(below, Vec3::Y).unwrap().x > 0.0);
            assert_eq!(light.sample(above, [0.5, 0.5]).is_some(), both);
            assert_eq!(light.closed_form(above, Vec3::NEG_Y).unwrap().x > 0.0, both);
            assert_eq!(light.sample(beside, [0.5, 0.5]), None);
            assert_eq!(light.closed_form(beside, Vec3::NEG_X), Some(Vec3::ZERO));
            let hit = EmitterHit { triangle: 0, position: Vec3::Y };
            assert!(light.radiance_towards(&hit, Vec3::NEG_Y).x > 0.0);
            assert_eq!(light.radiance_towards(&hit, Vec3::Y).x > 0.0, both);
            assert_eq!(light.radiance_towards(&hit, Vec3::X), Vec3::ZERO);
            assert_eq!(light.pdf_sr(above, &hit) > 0.0, both);
        }
    }
    // bent inwards, it may hide parts of itself
    assert_eq!(light(&mesh("sheet", false, amount)).closed_form(Vec3::ONE, Vec3::Y), None);
}

proptest! {
    #[test]
    fn random_lights_answer_random_places(seed in any::<u64>(), exponent in -8.0_f32..8.0, u in 0.0_f32..1.0, v in 0.0_f32..1.0) {
        let mut dice = Dice(Pcg32::new(seed, 7));
        let size = libm::powf(10.0, exponent);
        for spec in dice.lights() {
            let light = light(&spec);
            let bounds = light.bounds();
            let near = bounds.map_or(Vec3::ZERO, |b| b.min) + dice.vector(size);
            check(&light, near, dice.unit(), [u, v]);
            check(&light, dice.vector(size), dice.unit(), [u, v]);
        }
    }
}
