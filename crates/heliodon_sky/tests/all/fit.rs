//! Light fitted to receivers, held against the light that the sky itself gives them.

#![expect(clippy::unwrap_used, reason = "a test may panic")]

use glam::{DVec3, Vec3};
use heliodon_image::HdrImage;
use heliodon_math::color::luminance;
use heliodon_math::sh::basis9;
use heliodon_math::sphere::{direction_from_azimuth_elevation, fibonacci_sphere};
use heliodon_sky::day::{LapseParams, ModelDay, SkySource, build};
use heliodon_sky::fit::{ReceiverFit, Surroundings};
use heliodon_sky::lapse::{Fitted, Sun};
use heliodon_sky::mapping::{BelowHorizon, Mapping};
use heliodon_sky::model::ModelParams;
use heliodon_sky::probe::Probe;
use std::f32::consts::{FRAC_1_PI, PI};

const LOOKS: u32 = 8_000;

/// Light (irradiance / pi) that `radiance` gives surfaces of these normals: over ground, only from above the horizon.
fn light(normals: &[Vec3], surroundings: Surroundings, radiance: impl Fn(Vec3) -> Vec3) -> Vec<Vec3> {
    let seen = |d: &Vec3| surroundings == Surroundings::Open || d.y > 0.0;
    let looks: Vec<(Vec3, Vec3)> = fibonacci_sphere(LOOKS).into_iter().filter(seen).map(|d| (d, radiance(d))).collect();
    let of = |n: &Vec3| looks.iter().map(|&(d, l)| l * n.dot(d).max(0.0)).sum::<Vec3>() * (4.0 / LOOKS as f32);
    normals.iter().map(of).collect()
}

/// The same light as vertices are shaded: transfer times coefficients, and the glow from the sun's direction.
fn shaded(normals: &[Vec3], surroundings: Surroundings, sky: &[[f32; 3]], glow: [f32; 3], sun: Vec3) -> Vec<Vec3> {
    let rebuilt = |d: Vec3| sky.iter().zip(basis9(d)).map(|(&s, y)| Vec3::from_array(s) * y).sum();
    let glow = |n: &Vec3| Vec3::from_array(glow) * (n.dot(sun).max(0.0) * FRAC_1_PI);
    light(normals, surroundings, rebuilt).iter().zip(normals).map(|(&sky, n)| sky + glow(n)).collect()
}

/// Root mean square of the error over all orientations, as a part of the mean light.
fn error(truth: &[Vec3], got: &[Vec3]) -> f32 {
    let squares: f32 = truth.iter().zip(got).map(|(t, g)| (*t - *g).length_squared()).sum();
    (squares / truth.len() as f32).sqrt() / (truth.iter().map(|t| t.length()).sum::<f32>() / truth.len() as f32)
}

fn probe(radiance: impl Fn(Vec3) -> Vec3) -> Probe {
    let geometry = Probe::new(HdrImage::filled(256, 128, Vec3::ZERO), Mapping::LatLong, 0.0).unwrap();
    let at = |x: u32, y: u32| geometry.geometry().direction(f64::from(x) + 0.5, f64::from(y) + 0.5).unwrap_or(DVec3::Y);
    Probe::new(HdrImage::from_fn(256, 128, |x, y| radiance(at(x, y).as_vec3())), Mapping::LatLong, 0.0).unwrap()
}

fn fit(sky: &Probe, coefficients: usize, surroundings: Surroundings, sun: Option<&Sun>) -> (Vec<Vec3>, Option<Fitted>) {
    let projected = sky.coefficients(coefficients, BelowHorizon::Keep);
    let fitted = ReceiverFit::new(coefficients, surroundings).fit(sky, BelowHorizon::Keep, &projected, sun);
    (projected, fitted)
}

fn low_sun() -> Sun {
    let direction = direction_from_azimuth_elevation(1.2, 12.0_f64.to_radians());
    Sun { direction: direction.to_array(), irradiance: [60.0, 45.0, 25.0], clipped: false }
}

#[test]
fn a_sky_that_coefficients_hold_is_left_alone() {
    for surroundings in [Surroundings::Open, Surroundings::Ground] {
        for coefficients in [4, 9] {
            let even = probe(|_| Vec3::new(1.0, 2.0, 0.5));
            assert_eq!(fit(&even, coefficients, surroundings, Some(&low_sun())).1, None);
            let tilted = probe(|d| Vec3::ONE + Vec3::new(0.3, 0.2, 0.1) * d.dot(Vec3::new(0.6, 0.8, 0.0)));
            assert_eq!(fit(&tilted, coefficients, surroundings, None).1, None);
        }
    }
}

#[test]
fn a_glow_is_counted_once_and_reaches_those_who_face_it() {
    let sun = low_sun();
    let to_sun = Vec3::from_array(sun.direction);
    // 12 of irradiance about the sun, half of it within 7 degrees, over an even sky that stops at the horizon
    const SPREAD: f32 = 0.01;
    let middle = 12.0 / (2.0 * PI * SPREAD * (1.0 - SPREAD));
    let sky = |d: Vec3| {
        let even = if d.y > 0.0 { Vec3::new(1.0, 1.5, 2.0) } else { Vec3::splat(0.3) };
        even + Vec3::new(1.0, 0.8, 0.5) * (middle * ((d.dot(to_sun) - 1.0) / SPREAD).exp())
    };
    let probe = probe(sky);
    for surroundings in [Surroundings::Open, Surroundings::Ground] {
        for coefficients in [4, 9] {
            let (projected, fitted) = fit(&probe, coefficients, surroundings, Some(&sun));
            let fitted = fitted.unwrap();
            let projected: Vec<[f32; 3]> = projected.iter().map(Vec3::to_array).collect();
            let normals = fibonacci_sphere(60);
            let truth = light(&normals, surroundings, sky);
            let with = |sky: &[[f32; 3]], glow: [f32; 3]| shaded(&normals, surroundings, sky, glow, to_sun);
            let before = error(&truth, &with(&projected, [0.0; 3]));
            let after = error(&truth, &with(&fitted.sky, fitted.glow));
            let what = format!("{surroundings:?} {coefficients}: {before} -> {after}, glow {:?}", fitted.glow);
            // nine coefficients have little to gain where all of the sphere is seen
            let gained = if coefficients == 4 { 0.35 } else { 0.9 };
            assert!(after < 0.06 && after < gained * before, "{what}");
            // counted a second time, the glow would be an error of its own size
            assert!(error(&truth, &with(&projected, fitted.glow)) > 1.5 * after, "{what}");
            let level = light(&[Vec3::Y], surroundings, sky)[0];
            let got = shaded(&[Vec3::Y], surroundings, &fitted.sky, fitted.glow, to_sun)[0];
            assert!(((got - level) / level).abs().max_element() < 0.01, "{what}: level {got} for {level}");
            if coefficients == 4 {
                let part = Vec3::from_array(fitted.glow) / (Vec3::new(1.0, 0.8, 0.5) * 12.0);
                assert!(part.min_element() > 0.6 && part.max_element() < 1.2, "{what}");
            }
        }
    }
}

#[test]
fn a_glow_is_no_brighter_than_half_its_sun_and_never_negative() {
    let faint = Sun { irradiance: [0.5; 3], ..low_sun() };
    let to_sun = Vec3::from_array(faint.direction);
    let bright = probe(|d| Vec3::splat(if d.dot(to_sun) > 0.99 { 50.0 } else { 1.0 }));
    let glow = fit(&bright, 4, Surroundings::Ground, Some(&faint)).1.unwrap().glow;
    assert_eq!(glow, [0.25; 3]);
    let away = probe(|d| Vec3::splat(if d.dot(to_sun) < -0.9 { 50.0 } else { 1.0 }));
    assert_eq!(fit(&away, 4, Surroundings::Open, Some(&low_sun())).1.unwrap().glow, [0.0; 3]);
    assert_eq!(fit(&bright, 4, Surroundings::Ground, None).1.unwrap().glow, [0.0; 3]);
}

/// From dawn to noon, close enough to the true light at every step that there is no room for jumps; sun steps change every second entry, so
/// that entries also stand at sun steps which have no sun yet.
#[test]
fn a_clear_morning_is_shaded_as_it_is() {
    let day = ModelDay {
        model: ModelParams::default(),
        latitude_deg: 37.9715,
        longitude_deg: 23.7267,
        utc_offset_hours: 3.0,
        date: "2006-05-20".parse().unwrap(),
    };
    let params = LapseParams {
        sun_steps: 14,
        sky_steps: 28,
        first: Some("05:50".parse().unwrap()),
        last: Some("08:05".parse().unwrap()),
        map_width: 256,
        surroundings: Surroundings::Ground,
        ..LapseParams::new(SkySource::Model(day))
    };
    let mut maps = Vec::new();
    let built = build(&params, &mut |map| {
        maps.push(map.image.clone());
        Ok(())
    })
    .unwrap();
    let normals = fibonacci_sphere(40);
    let (mut worst, mut worst_projected) = (0.0_f32, 0.0_f32);
    for (step, map) in built.lapse.steps.iter().zip(maps) {
        let sky = Probe::new(map, Mapping::LatLong, 0.0).unwrap();
        let truth = light(&normals, Surroundings::Ground, |d| sky.radiance(d.as_dvec3()));
        let fitted = step.fitted.clone().unwrap();
        let to_sun = step.sun.map_or(Vec3::ZERO, |sun| Vec3::from_array(sun.direction));
        assert!(step.sun.is_some() || fitted.glow == [0.0; 3], "{}: a glow without a sun", step.time);
        let with = |sky: &[[f32; 3]], glow: [f32; 3]| shaded(&normals, Surroundings::Ground, sky, glow, to_sun);
        worst = worst.max(error(&truth, &with(&fitted.sky, fitted.glow)));
        worst_projected = worst_projected.max(error(&truth, &with(&step.sky, [0.0; 3])));
    }
    assert!(worst < 0.16 && worst_projected > 0.3, "{worst} fitted, {worst_projected} projected");
    let glows: Vec<f32> =
        built.lapse.steps.iter().map(|s| luminance(Vec3::from_array(s.fitted.clone().unwrap().glow))).collect();
    let brightest = glows.iter().copied().fold(0.0, f32::max);
    assert!(brightest > 4.0 && glows[0] == 0.0);
    assert!(glows.windows(2).all(|w| (w[1] - w[0]).abs() < 0.25 * brightest), "the glow comes slowly: {glows:?}");
}
