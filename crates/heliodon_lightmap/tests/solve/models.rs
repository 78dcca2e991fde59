//! The models that are built in.

use crate::bench::{Bench, WHITE, sun};
use glam::Vec3;
use heliodon_lightmap::solve::models::{Cartoon, Lambertian, OcclusionOnly, Realistic, SkyOnly};
use heliodon_lightmap::solve::{Models, SolveParams};
use heliodon_math::dome::ConstantSky;
use heliodon_testkit::scenes::{cuboid, ground};

fn bench() -> Bench {
    let scene = ground(4.0, 1).and(cuboid(Vec3::new(-0.5, 0.0, -0.5), Vec3::new(0.5, 1.0, 0.3), 1));
    Bench::new(scene, 128).under(WHITE).reflecting(0.5).lit(sun([0.4, 1.0, 0.2], 0.3, 2.0))
}

#[test]
fn sky_and_occlusion_leave_lamps_and_bounces_out() {
    let bench = bench();
    let solve = |illumination: &dyn heliodon_lightmap::solve::models::Illumination| {
        bench.solve_by(&Models { illumination, surface: &Lambertian }, &SolveParams::default())
    };
    let (sky, open, all) = (solve(&SkyOnly), solve(&OcclusionOnly::default()), solve(&Realistic));
    assert_eq!(sky.notes.sampled.len(), 1);
    assert!(all.notes.sampled.len() > 2 && all.notes.mean[0] > sky.notes.mean[0] + 0.1);
    let differ = sky.light.iter().zip(&open.light).map(|(a, b)| (*a - *b).abs().max_element()).fold(0.0, f32::max);
    assert!(differ < 1e-3, "under an even sky both are the same: {differ}");
    let near = solve(&OcclusionOnly { radius_m: 0.2 });
    for (p, light) in bench.at(&near, |p, n| n.y > 0.9 && p.y < 1e-3 && p.abs().max_element() > 0.8) {
        assert!((light.x - 1.0).abs() < 0.01, "{light} at {p}");
    }
    assert!(near.notes.mean[0] > open.notes.mean[0] + 0.01);
}

#[test]
fn a_cartoon_has_few_shades() {
    let bench = bench();
    let surface = Cartoon { bands: 3, white: Some(1.5), softness: 0.0 };
    let params = SolveParams { match_seams: false, ..SolveParams::default() };
    let map = bench.solve_by(&Models { illumination: &Realistic, surface: &surface }, &params);
    for light in &map.light {
        assert!([0.0, 0.5, 1.0, 1.5].iter().any(|band| (light.x - band).abs() < 1e-4), "{light}");
    }
    assert_eq!(map.notes.surface, "cartoon");
}

#[test]
fn a_cartoon_s_bands_do_not_depend_on_how_strong_all_lights_are() {
    let params = SolveParams { match_seams: false, ..SolveParams::default() };
    let surface = Cartoon { softness: 0.0, ..Cartoon::default() };
    let models = Models { illumination: &Realistic, surface: &surface };
    let bands = |scale: f32| -> Vec<f32> {
        let scene = ground(4.0, 1).and(cuboid(Vec3::new(-0.5, 0.0, -0.5), Vec3::new(0.5, 1.0, 0.3), 1));
        let bright = Bench::new(scene, 128).under(ConstantSky(Vec3::splat(6.0 * scale))).reflecting(0.5);
        let map = bright.lit(sun([0.4, 1.0, 0.2], 0.3, f64::from(80.0 * scale))).solve_by(&models, &params);
        let white = map.light.iter().map(|light| light.x).fold(0.0, f32::max);
        map.light.iter().map(|light| 3.0 * light.x / white).collect()
    };
    let once = bands(1.0);
    for band in [1.0, 2.0, 3.0] {
        let share = once.iter().filter(|other| (**other - band).abs() < 1e-3).count() as f32 / once.len() as f32;
        assert!(share > 0.03, "{share} of the texels are of band {band}");
    }
    let differ = once.iter().zip(bands(10.0)).filter(|(a, b)| (**a - b).abs() > 1e-3).count();
    // light that rounding puts on the other side of a band's edge
    assert!(differ <= once.len() / 1000, "{differ} of {}", once.len());
}
