//! Weathering against what is known in closed form, and what must hold of it anywhere.
#![expect(clippy::unwrap_used, reason = "helpers of tests")]

use glam::Vec3;
use heliodon_lightmap::weathering::{Amounts, Climate, Exposure, WeatherError, exposures, weather};
use heliodon_rays::{BuildParams, TriangleScene};
use proptest::prelude::*;
use std::f32::consts::FRAC_1_SQRT_2;

/// Rectangles, each a corner and two sides.
fn scene(all: &[(Vec3, Vec3, Vec3)]) -> TriangleScene {
    let positions: Vec<Vec3> = all.iter().flat_map(|&(o, a, b)| [o, o + a, o + a + b, o + b]).collect();
    let triangles: Vec<[u32; 3]> =
        (0..all.len() as u32).flat_map(|i| [[4 * i, 4 * i + 1, 4 * i + 2], [4 * i, 4 * i + 2, 4 * i + 3]]).collect();
    TriangleScene::build(&positions, &triangles, &BuildParams::default()).unwrap()
}

fn ground() -> (Vec3, Vec3, Vec3) {
    (Vec3::new(-500.0, -1.0, 500.0), Vec3::X * 1000.0, Vec3::NEG_Z * 1000.0)
}

/// A horizontal square about the y axis.
fn roof(height: f32, half: f32) -> (Vec3, Vec3, Vec3) {
    (Vec3::new(-half, height, half), Vec3::X * 2.0 * half, Vec3::NEG_Z * 2.0 * half)
}

fn at(scene: &TriangleScene, origin: Vec3, normal: Vec3, climate: &Climate) -> Exposure {
    exposures(scene, &[origin], &[normal], climate).unwrap()[0]
}

fn left_at(scene: &TriangleScene, origin: Vec3, normal: Vec3, climate: &Climate) -> Amounts {
    weather(scene, &[origin], &[normal], climate).unwrap()[0]
}

const EAST: Option<f64> = Some(std::f64::consts::FRAC_PI_2);

#[test]
fn an_open_plane_is_washed_and_corrodes() {
    let open = scene(&[ground()]);
    for wind_from_rad in [None, EAST] {
        let climate = Climate { wind_from_rad, wind_m_per_s: 3.0, ..Climate::default() };
        let exposure = at(&open, Vec3::ZERO, Vec3::Y, &climate);
        assert!((exposure.sky - 1.0).abs() < 1e-5 && (exposure.rain - 1.0).abs() < 1e-5, "{exposure:?}");
        assert_eq!(exposure.wind, 1.0);
        let left = exposure.amounts(Vec3::Y);
        assert!(left.dust < 1e-5 && left.corrosion > 1.0 - 1e-5, "{left:?}");
    }
}

#[test]
fn a_wall_sees_half_the_sky_and_the_rain_that_is_driven_against_it() {
    let open = scene(&[ground()]);
    for wind_m_per_s in [1.5, 3.0, 4.5] {
        let climate = Climate { wind_from_rad: EAST, wind_m_per_s, directions: 4096 };
        let east = at(&open, Vec3::ZERO, Vec3::X, &climate);
        assert!((east.sky - 0.5).abs() < 0.005, "{east:?}");
        // ISO 15927-3: 2/9 of the speed; what gusts bring from behind the vertical is more than nothing in weak wind
        let driven = (wind_m_per_s * 2.0 / 9.0) as f32;
        let behind = at(&open, Vec3::ZERO, Vec3::NEG_X, &climate).rain;
        assert!((east.rain - behind - driven).abs() < 0.02 * driven, "{} {behind} {driven}", east.rain);
        assert!(behind < 0.06, "{behind}");
        // 60 degrees aside: half of it
        let aside = Vec3::new(0.5, 0.0, 0.75_f32.sqrt());
        let difference = at(&open, Vec3::ZERO, aside, &climate).rain - at(&open, Vec3::ZERO, -aside, &climate).rain;
        assert!((difference - 0.5 * driven).abs() < 0.02 * driven, "{difference} {driven}");
        assert_eq!(left_at(&open, Vec3::ZERO, Vec3::X, &climate).dust, 0.0, "walls hold none");
    }
    // from nowhere in particular: all walls alike
    let climate = Climate { directions: 4096, ..Climate::default() };
    let four = [Vec3::X, Vec3::NEG_X, Vec3::Z, Vec3::NEG_Z].map(|wall| at(&open, Vec3::ZERO, wall, &climate).rain);
    assert!(four.iter().all(|rain| (rain / four[0] - 1.0).abs() < 0.02), "{four:?}");
}

#[test]
fn a_ceiling_is_exposed_to_nothing() {
    let open = scene(&[ground()]);
    let below = at(&open, Vec3::ZERO, Vec3::NEG_Y, &Climate::default());
    assert_eq!((below.sky, below.rain), (0.0, 0.0));
    assert_eq!(below.amounts(Vec3::NEG_Y), Amounts::default());
}

#[test]
fn beneath_a_roof_dust_lies_and_nothing_corrodes() {
    let climate = Climate::default();
    let wide = scene(&[ground(), roof(3.0, 400.0)]);
    let left = left_at(&wide, Vec3::ZERO, Vec3::Y, &climate);
    assert!(left.dust > 0.99 && left.corrosion < 1e-3, "{left:?}");
    // a small roof: dry beneath it, but the horizon is open
    let small = scene(&[ground(), roof(3.0, 5.0)]);
    let exposure = at(&small, Vec3::ZERO, Vec3::Y, &climate);
    assert!(exposure.rain < 0.02 && exposure.wind > 0.9, "{exposure:?}");
    // what a square hides of the sky in the cosine's measure: the form factor of a rectangle to a patch below its corner, four times
    // (Howell, "A Catalog of Radiation Heat Transfer Configuration Factors", B-4)
    let a = 5.0_f32 / 3.0;
    let root = (1.0 + a * a).sqrt();
    let hidden = 4.0 / std::f32::consts::TAU * (2.0 * a / root * (a / root).atan());
    assert!((exposure.sky - (1.0 - hidden)).abs() < 0.01, "{} {}", exposure.sky, 1.0 - hidden);
    let left = exposure.amounts(Vec3::Y);
    assert!((0.4..0.6).contains(&left.dust), "{left:?}");
}

#[test]
fn driven_rain_reaches_beneath_an_overhang_from_its_side_only() {
    // the roof ends a metre to the east; the rain falls at 45 degrees
    let overhang = scene(&[ground(), (Vec3::new(-50.0, 3.0, 50.0), Vec3::X * 51.0, Vec3::NEG_Z * 100.0)]);
    let rain = |wind_from_rad| {
        let climate = Climate { wind_from_rad, wind_m_per_s: 4.5, ..Climate::default() };
        let exposure = at(&overhang, Vec3::ZERO, Vec3::Y, &climate);
        (exposure.rain, exposure.wind)
    };
    let ((from_east, wind_east), (from_west, wind_west)) = (rain(EAST), rain(EAST.map(|east| -east)));
    assert!(from_east > 0.9 && from_west < 0.01, "{from_east} {from_west}");
    assert!(wind_east > wind_west, "{wind_east} {wind_west}");
}

#[test]
fn slopes_hold_less_the_steeper_they_are() {
    let sheltered = Exposure::default();
    let dust = |degrees: f32| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        sheltered.amounts(Vec3::new(sin, cos, 0.0)).dust
    };
    assert_eq!(dust(0.0), 1.0);
    assert!((dust(30.0) - 0.866).abs() < 1e-3);
    let all: Vec<f32> = (0..=18).map(|i| dust(5.0 * i as f32)).collect();
    assert!(all.windows(2).all(|pair| pair[0] >= pair[1]), "{all:?}");
    assert!(dust(45.0) > 0.2 && dust(60.1) == 0.0 && dust(120.0) == 0.0);
}

#[test]
fn numbers_out_of_range_are_refused() {
    let open = scene(&[ground()]);
    let refused = |climate: Climate| exposures(&open, &[Vec3::ZERO], &[Vec3::Y], &climate).unwrap_err().to_string();
    let climate = Climate::default();
    assert!(refused(Climate { wind_m_per_s: f64::NAN, ..climate }).contains("wind_m_per_s"));
    assert!(refused(Climate { wind_m_per_s: -1.0, ..climate }).contains("-1"));
    assert!(refused(Climate { wind_from_rad: Some(f64::INFINITY), ..climate }).contains("wind_from_rad"));
    assert!(refused(Climate { directions: 3, ..climate }).contains("directions is 3"));
    let lengths = exposures(&open, &[Vec3::ZERO], &[], &climate).unwrap_err();
    assert_eq!(lengths, WeatherError::Lengths { places: 1, normals: 0 });
    for climate in [climate, Climate::preview(), Climate::archival()] {
        climate.validate().unwrap();
    }
    // places that are nowhere: nothing, and no panic
    let nowhere = exposures(&open, &[Vec3::NAN, Vec3::ZERO], &[Vec3::Y, Vec3::ZERO], &climate).unwrap();
    assert_eq!(nowhere, [Exposure::default(); 2]);
}

#[test]
fn threads_change_no_bit() {
    let sheltered = scene(&[ground(), roof(3.0, 5.0)]);
    let origins: Vec<Vec3> =
        (0..3000).map(|i| Vec3::new((i % 60) as f32 * 0.2 - 6.0, 0.0, (i / 60) as f32 * 0.2 - 5.0)).collect();
    let normals = vec![Vec3::Y; origins.len()];
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| exposures(&sheltered, &origins, &normals, &Climate::preview()).unwrap())
    };
    let (one, many) = (with(1), with(5));
    assert_eq!(one, many);
    let alone = exposures(&sheltered, &origins[700..701], &normals[..1], &Climate::preview()).unwrap();
    assert_eq!(one[700], alone[0]);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn amounts_are_within_bounds_and_shelter_only_adds_dust(
        height in 0.2_f32..20.0, half in 0.1_f32..40.0, more in 0.0_f32..20.0,
        x in -10.0_f32..10.0, z in -10.0_f32..10.0, tilt in -1.0_f32..1.0, turn in 0.0_f32..6.3,
        wind in 0.0_f64..20.0, from in prop::option::of(0.0_f64..6.3),
    ) {
        let climate = Climate { wind_from_rad: from, wind_m_per_s: wind, directions: 128 };
        let (smaller, larger) = (scene(&[ground(), roof(height, half)]), scene(&[ground(), roof(height, half + more)]));
        let flat = (1.0 - tilt * tilt).sqrt();
        let normal = Vec3::new(flat * turn.cos(), tilt, flat * turn.sin());
        let place = Vec3::new(x, 0.0, z);
        let (a, b) = (left_at(&smaller, place, normal, &climate), left_at(&larger, place, normal, &climate));
        for left in [a, b] {
            prop_assert!((0.0..=1.0).contains(&left.dust) && (0.0..=1.0).contains(&left.corrosion), "{left:?}");
        }
        prop_assert!(b.dust >= a.dust && b.corrosion <= a.corrosion, "{a:?} {b:?}");
    }

    #[test]
    fn amounts_follow_the_exposure(sky in 0.0_f32..1.0, rain in 0.0_f32..3.0, wind in 0.0_f32..1.0, more in 0.0_f32..1.0) {
        let normal = Vec3::new(FRAC_1_SQRT_2, FRAC_1_SQRT_2, 0.0);
        let left = Exposure { sky, rain, wind }.amounts(normal);
        for exposed in [
            Exposure { sky, rain: rain + more, wind },
            Exposure { sky, rain, wind: (wind + more).min(1.0) },
            Exposure { sky: (sky + more).min(1.0), rain, wind },
        ] {
            let then = exposed.amounts(normal);
            prop_assert!(then.dust <= left.dust && then.corrosion >= left.corrosion, "{left:?} {then:?}");
        }
    }
}
