//! Moments and the light of a vertex.
#![expect(clippy::unwrap_used, reason = "helpers of tests")]

use crate::common::{MONO, RGB, chunk, lapse};
use glam::Vec3;
use heliodon_bundle::moment::{Blend, Day, Moment, Shading};
use heliodon_bundle::shade::vertex_light;
use heliodon_bundle::{LightLayout, VertexLight, check_lapse};
use heliodon_math::sh::open_transfer9;
use heliodon_sky::lapse::Fitted;
use std::f32::consts::PI;

fn seconds(hhmm: &str) -> f64 {
    f64::from(hhmm.parse::<heliodon_bundle::site::TimeOfDay>().unwrap().seconds())
}

#[test]
fn at_the_time_of_a_sun_step_both_blends_give_that_step() {
    let lapse = lapse(MONO);
    let day = Day::new(&lapse);
    for (i, step) in lapse.steps.iter().enumerate().step_by(2) {
        for blend in [Blend::Smooth, Blend::Hard] {
            let moment = day.at(seconds(&step.time), blend);
            assert_eq!((moment.entries[0], moment.entry_fraction), (i, 0.0));
            assert_eq!((moment.mask_bits[0], moment.exposure_stops), (step.mask_bit, step.exposure_stops));
            assert_eq!(moment.sky, step.sky.iter().map(|&c| Vec3::from_array(c)).collect::<Vec<_>>());
            let functions = &lapse.sun_bounce_basis.as_ref().unwrap().functions;
            match &step.sun {
                Some(sun) => {
                    assert_eq!(moment.sun_direction, Vec3::from_array(sun.direction));
                    assert_eq!(moment.sun_irradiance, Vec3::from_array(sun.irradiance));
                    assert_eq!(moment.bounce[1], functions[1][step.mask_bit as usize]);
                    assert_eq!(moment.mask_weights, [1.0, 0.0]);
                }
                None => assert_eq!(moment.sun_irradiance, Vec3::ZERO),
            }
        }
    }
}

#[test]
fn between_two_steps_smooth_light_is_between_and_hard_light_waits() {
    let lapse = lapse(MONO);
    let day = Day::new(&lapse);
    // entries 10 minutes apart, sun steps 20; five minutes after entry 1 is three quarters of the first sun step
    let moment = day.at(seconds("07:12"), Blend::Smooth);
    assert_eq!((moment.entries, moment.entry_fraction), ([1, 2], 0.5));
    assert_eq!((moment.mask_bits, moment.mask_weights), ([0, 1], [0.25, 0.75]));
    let [a, b] = [0, 2].map(|i| Vec3::from_array(lapse.steps[i].sun.unwrap().irradiance));
    assert!((moment.sun_irradiance - a.lerp(b, 0.75)).length() < 1e-6);
    assert!((moment.sun_direction.length() - 1.0).abs() < 1e-6);
    let hard = day.at(seconds("07:12"), Blend::Hard);
    assert_eq!((hard.entries, hard.mask_bits, hard.mask_weights), ([1, 1], [0, 0], [1.0, 0.0]));
    assert_eq!(hard.sun_irradiance, a);
    assert_eq!(hard.sky, day.at(seconds("07:07"), Blend::Smooth).sky);
}

#[test]
fn a_setting_sun_fades_with_its_own_shadow() {
    let lapse = lapse(MONO);
    let day = Day::new(&lapse);
    // the last sun step has none
    let moment = day.at(seconds("08:12"), Blend::Smooth);
    let last = lapse.steps[6].sun.unwrap();
    assert_eq!((moment.mask_bits, moment.mask_weights), ([3, 4], [1.0, 0.0]));
    assert_eq!(moment.sun_direction, Vec3::from_array(last.direction));
    assert!((moment.sun_irradiance - Vec3::from_array(last.irradiance) * 0.25).length() < 1e-6);
}

#[test]
fn beyond_the_day_its_ends_hold() {
    let lapse = lapse(RGB);
    let day = Day::new(&lapse);
    let (first, last) = day.span_seconds();
    for blend in [Blend::Smooth, Blend::Hard] {
        assert_eq!(day.at(0.0, blend), day.at(first, blend));
        assert_eq!(day.at(f64::NAN, blend), day.at(first, blend));
        assert_eq!(day.at(86_400.0, blend), day.at(last, blend));
        assert_eq!(day.at(last, blend).mask_bits[0], lapse.steps.last().unwrap().mask_bit);
    }
    let mut single = lapse.clone();
    single.steps.truncate(1);
    assert_eq!(Day::new(&single).at(0.0, Blend::Smooth), Day::new(&single).at(50_000.0, Blend::Hard).clone());
}

#[test]
fn an_open_vertex_under_a_uniform_sky_of_one_holds_one() {
    let layout = LightLayout { sun_steps: 1, coefficients: 9, channels: 1, sun_bounce_functions: 0 };
    let mut light = VertexLight::zeros(layout, 1);
    light.sky_transfer = open_transfer9(Vec3::Y).to_vec();
    let mut lapse = lapse(layout);
    lapse.steps.truncate(1);
    lapse.steps[0].sun = None;
    lapse.steps[0].sky = vec![[0.0; 3]; 9];
    lapse.steps[0].sky[0] = [(4.0 * PI).sqrt(); 3];
    let moment = Day::new(&lapse).at(0.0, Blend::Smooth);
    assert!((vertex_light(&moment, &light, 0, Vec3::Y).total() - Vec3::ONE).length() < 1e-6);
}

#[test]
fn what_was_fitted_is_shaded_with_and_what_was_not_is_as_it_was() {
    let mut lapse = lapse(MONO);
    let bare = Day::new(&lapse).at(seconds("07:12"), Blend::Smooth);
    assert_eq!(bare.shading, Shading { sun_irradiance: bare.sun_irradiance, sky: bare.sky.clone() });
    // of the two entries around 07:12 only the second is fitted
    let fitted = Fitted { glow: [4.0, 2.0, 1.0], sky: vec![[1.0, 2.0, 3.0]; 4] };
    lapse.steps[2].fitted = Some(fitted);
    let moment = Day::new(&lapse).at(seconds("07:12"), Blend::Smooth);
    assert_eq!(Moment { shading: bare.shading.clone(), ..moment.clone() }, bare, "sun, sky and maps stay what they are");
    assert!((moment.shading.sun_irradiance - bare.sun_irradiance - Vec3::new(2.0, 1.0, 0.5)).length() < 1e-6);
    for (i, shaded) in moment.shading.sky.iter().enumerate() {
        let first = Vec3::from_array(lapse.steps[1].sky[i]);
        assert!((*shaded - first.lerp(Vec3::new(1.0, 2.0, 3.0), 0.5)).length() < 1e-5);
    }
    let mut chunk = chunk(MONO, 0, None, 6, 0.0);
    let words = MONO.mask_words();
    for (v, mask) in chunk.light.sun_mask.chunks_exact_mut(words).enumerate() {
        mask[0] = if v % 2 == 0 { 0b11 } else { 0 };
    }
    let lights = |moment: &Moment| {
        chunk.normals.iter().enumerate().map(|(v, &n)| vertex_light(moment, &chunk.light, v, n)).collect::<Vec<_>>()
    };
    let (before, after) = (lights(&bare), lights(&moment));
    for (v, (before, after)) in before.iter().zip(&after).enumerate() {
        assert_eq!(after.sun.x > before.sun.x, v % 2 == 0, "the glow comes through the sun's mask");
        assert_eq!(after.sun == Vec3::ZERO, v % 2 == 1);
    }
}

#[test]
fn fits_that_cannot_be_are_refused() {
    let good = lapse(MONO);
    let sunless = good.steps.iter().position(|step| step.sun.is_none()).unwrap();
    let fitted = |glow: [f32; 3], count: usize| Some(Fitted { glow, sky: vec![[1.0; 3]; count] });
    let verdict = |step: usize, fitted: Option<Fitted>| {
        let mut lapse = good.clone();
        lapse.steps[step].fitted = fitted;
        check_lapse(&lapse, MONO)
    };
    assert_eq!(verdict(0, fitted([1.0; 3], 4)), Ok(()));
    assert_eq!(verdict(sunless, fitted([0.0; 3], 4)), Ok(()));
    assert!(verdict(0, fitted([1.0; 3], 9)).unwrap_err().contains("4 coefficients"));
    assert!(verdict(0, fitted([-1.0, 0.0, 0.0], 4)).unwrap_err().contains("negative"));
    assert!(verdict(0, fitted([f32::NAN; 3], 4)).unwrap_err().contains("finite"));
    assert!(verdict(sunless, fitted([1.0; 3], 4)).unwrap_err().contains("no sun"));
}

#[test]
fn light_is_the_sum_that_the_format_says() {
    for layout in [MONO, RGB] {
        let chunk = chunk(layout, 0, None, 6, 0.0);
        let mut lapse = lapse(layout);
        for step in lapse.steps.iter_mut().step_by(2).filter(|step| step.sun.is_some()) {
            step.fitted = Some(Fitted { glow: [0.5, 0.25, 0.75], sky: step.sky.iter().rev().copied().collect() });
        }
        let moment = Day::new(&lapse).at(seconds("07:12"), Blend::Smooth);
        let ch = layout.channels as usize;
        for v in 0..chunk.vertex_count() {
            let light = vertex_light(&moment, &chunk.light, v, chunk.normals[v]);
            for c in 0..3 {
                let own = |values: &[f32], count: usize, i: usize| f64::from(values[v * count + i * ch + c % ch]);
                let sky: f64 = (0..layout.coefficients as usize)
                    .map(|i| own(&chunk.light.sky_transfer, layout.transfer_floats(), i) * f64::from(moment.shading.sky[i][c]))
                    .sum();
                let bounce: f64 = (0..layout.sun_bounce_functions as usize)
                    .map(|r| own(&chunk.light.sun_bounce, layout.bounce_floats(), r) * f64::from(moment.bounce[r]))
                    .sum();
                let bit = |k: usize| f64::from(u8::from(chunk.light.sun_reaches(v, moment.mask_bits[k])));
                let reached = f64::from(moment.mask_weights[0]) * bit(0) + f64::from(moment.mask_weights[1]) * bit(1);
                let e = f64::from(moment.shading.sun_irradiance[c]);
                let cosine = f64::from(chunk.normals[v].dot(moment.sun_direction).max(0.0));
                let expected = reached * cosine * e / std::f64::consts::PI + sky.max(0.0) + e * bounce.max(0.0);
                assert!((f64::from(light.total()[c]) - expected).abs() < 1e-4 * (1.0 + expected), "{expected}");
            }
        }
    }
}
