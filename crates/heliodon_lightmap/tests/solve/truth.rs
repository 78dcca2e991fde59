//! Cases whose light is known in closed form.

use crate::bench::{Bench, WHITE, emissive, errors, light, sun};
use glam::Vec3;
use heliodon_lightmap::lights::{Amount, LightSpec, MeshSpec, PointSpec, RectangleSpec};
use heliodon_lightmap::solve::SolveParams;
use heliodon_math::dome::{LatLongSky, OvercastSky};
use heliodon_testkit::scenes::{ball, corner_form_factor, cuboid, ground, rectangle};
use std::f32::consts::PI;

fn params() -> SolveParams {
    SolveParams { error: 0.01, bounces: 0, ..SolveParams::default() }
}

#[test]
fn a_furnace_holds_what_it_emits_times_all_its_reflections() {
    let room = cuboid(Vec3::ZERO, Vec3::new(2.0, 1.5, 1.0), 1).inside_out();
    let amount = Amount::Radiance(1.0);
    let file = "room".to_owned();
    let glow = LightSpec::Mesh(MeshSpec { name: None, file, two_sided: false, colour: [1.0; 3], amount });
    let bench = Bench::new(room.clone(), 128).reflecting(0.5).lit(emissive(&glow, room));
    for (bounces, truth) in [(0, 1.0), (1, 1.5), (3, 1.875), (30, 2.0)] {
        let map = bench.solve(&SolveParams { bounces, ..params() });
        let (most, mean) = errors(&bench.at(&map, |_, _| true), |_| truth);
        assert!(most < 0.03 && mean < 0.002, "{bounces}: {most}, {mean}");
        // those that cannot be seen are left out
        assert!(map.notes.sampled.len() <= 14, "{:?}", map.notes.sampled);
    }
}

#[test]
fn what_stands_free_has_all_of_an_even_sky() {
    let bench = Bench::new(ball(1.0, 24), 128).under(WHITE).reflecting(0.8);
    let map = bench.solve(&SolveParams { bounces: 3, ..params() });
    assert!(map.light.iter().all(|light| (light.x - 1.0).abs() < 1e-3), "{:?}", map.notes);
    assert_eq!(map.notes.inside, 0);
}

#[test]
fn a_lamp_over_a_plane_falls_off_as_it_must() {
    let lamp = PointSpec { name: None, place: [0.2, 1.0, 0.1], colour: [1.0; 3], amount: Amount::RadiantIntensity(3.0) };
    let bench = Bench::new(ground(6.0, 1), 256).lit(light(&LightSpec::Point(lamp)));
    let map = bench.solve(&params());
    let truth = |p: Vec3| {
        let to = Vec3::new(0.2, 1.0, 0.1) - p;
        3.0 / PI / to.length_squared().powf(1.5)
    };
    let (most, rms) = errors(&bench.at(&map, |_, _| true), truth);
    assert!(most < 0.02 && rms < 0.005, "{most}, {rms}");
    assert!(map.notes.sampled[0] * 3 < map.notes.texels, "{:?}", map.notes);
}

#[test]
fn a_window_gives_its_form_factor_whole_and_half_hidden() {
    let corners = [[-0.5, 1.0, -0.5], [0.5, 1.0, -0.5], [-0.5, 1.0, 0.5]];
    let pane = RectangleSpec { name: None, corners, two_sided: false, colour: [1.0; 3], amount: Amount::Radiance(2.0) };
    let pane = light(&LightSpec::Rectangle(pane));
    // a signed sum of rectangles with a corner above the place
    let seen = |p: Vec3, x: [f32; 2]| {
        let corner = |x: f32, z: f32| {
            let factor = corner_form_factor(f64::from(x.abs()), f64::from(z.abs()), 1.0) as f32;
            if x == 0.0 || z == 0.0 { 0.0 } else { factor * x.signum() * z.signum() }
        };
        let along = |x: f32| corner(x - p.x, 0.5 - p.z) - corner(x - p.x, -0.5 - p.z);
        2.0 * (along(x[1]) - along(x[0]))
    };
    let open = Bench::new(ground(3.0, 1), 200).lit(pane.clone());
    let map = open.solve(&params());
    let (most, rms) = errors(&open.at(&map, |_, _| true), |p| seen(p, [-0.5, 0.5]));
    assert!(most < 0.02 && rms < 0.005, "{most}, {rms}");
    // a screen that lies on the pane hides half of it from everywhere
    let screen = rectangle(Vec3::new(-2.0, 0.99, -2.0), Vec3::Z * 4.0, Vec3::X * 2.0, 1);
    let half = Bench::with_texels_on(ground(1.0, 1).and(screen), 100, 2).lit(pane);
    let map = half.solve(&SolveParams { error: 0.005, light_samples: 1024, first_stride: 1, ..params() });
    // its edge at x = 0, a hundredth lower, hides what lies beyond where the place sees it
    let (most, rms) = errors(&half.at(&map, |p, _| p.length() < 0.4), |p| seen(p, [p.x - p.x / 0.99, 0.5]));
    assert!(most < 0.03 && rms < 0.01, "{most}, {rms}");
}

#[test]
fn a_hole_in_a_roof_is_as_bright_in_the_mean_as_it_is() {
    let half = 0.15;
    let far = 300.0;
    // four sheets leave it open, seen from below
    let sheet = |low: [f32; 2], high: [f32; 2]| {
        let corner = Vec3::new(low[0], 1.0, low[1]);
        rectangle(corner, Vec3::X * (high[0] - low[0]), Vec3::Z * (high[1] - low[1]), 1)
    };
    let roof = sheet([-far, -far], [-half, far])
        .and(sheet([half, -far], [far, far]))
        .and(sheet([-half, -far], [half, -half]))
        .and(sheet([-half, half], [half, far]));
    let bench = Bench::with_texels_on(ground(1.0, 1).and(roof), 96, 2).under(WHITE);
    let truth = |p: Vec3| {
        let corner = |x: f32, z: f32| {
            let factor = corner_form_factor(f64::from(x.abs()), f64::from(z.abs()), 1.0) as f32;
            if x == 0.0 || z == 0.0 { 0.0 } else { factor * x.signum() * z.signum() }
        };
        let along = |x: f32| corner(x - p.x, half - p.z) - corner(x - p.x, -half - p.z);
        along(half) - along(-half)
    };
    let (mut squares, mut means) = (0.0, 0.0);
    for seed in 1..=8 {
        let params = SolveParams { bounces: 0, error: 0.1, samples: 128, first_stride: 1, seed, ..SolveParams::default() };
        let found = bench.at(&bench.solve(&params), |p, _| p.length() < 0.5);
        let (_, rms) = errors(&found, truth);
        squares += rms * rms / 8.0;
        means += found.iter().map(|(p, light)| light.x / truth(*p)).sum::<f32>() / found.len() as f32 / 8.0;
    }
    // of 128 directions three or four go through
    assert!(squares.sqrt() < 0.35 && (means - 1.0).abs() < 0.02, "{}, {means}", squares.sqrt());
}

#[test]
fn the_ground_before_an_endless_wall_sees_what_the_wall_leaves() {
    let wall = rectangle(Vec3::new(-300.0, 0.0, 0.0), Vec3::X * 600.0, Vec3::Y * 2.0, 1);
    let ground = rectangle(Vec3::new(-1.5, 0.0, 3.2), Vec3::X * 3.0, Vec3::NEG_Z * 3.0, 1);
    for (sky, name) in [(false, "even"), (true, "lat-long")] {
        let bench = Bench::with_texels_on(ground.clone().and(wall.clone()), 200, 2);
        let upper = |i: usize| Vec3::splat(if i < 64 * 16 { 1.0 } else { 0.0 });
        let bench = if sky {
            bench.under(LatLongSky::new(64, 32, (0..64 * 32).map(upper).collect()).unwrap())
        } else {
            bench.under(WHITE)
        };
        let map = bench.solve(&params());
        let truth = |p: Vec3| 0.5 + 0.5 * p.z / (p.z * p.z + 4.0).sqrt();
        let (most, rms) = errors(&bench.at(&map, |_, _| true), truth);
        assert!(most < 0.03 && rms < 0.01, "{name}: {most}, {rms}");
    }
}

#[test]
fn walls_have_half_of_an_even_sky_and_less_of_an_overcast_one() {
    let wall = rectangle(Vec3::new(-2.0, 0.01, 0.0), Vec3::X * 4.0, Vec3::Y, 1);
    let bench = Bench::with_texels_on(wall.clone().and(ground(2000.0, 1)), 100, 2).under(WHITE);
    let map = bench.solve(&params());
    let (most, rms) = errors(&bench.at(&map, |_, _| true), |_| 0.5);
    assert!(most < 0.015 && rms < 0.01, "{most}, {rms}");
    // the integral of (1 + 2 sin e) / 3 over half of the sky: 1/6 + 4/(9 pi)
    let bench = Bench::new(wall, 100).under(OvercastSky { zenith: Vec3::ONE });
    let map = bench.solve(&params());
    let (most, rms) = errors(&bench.at(&map, |_, _| true), |_| 1.0 / 6.0 + 4.0 / (9.0 * PI));
    assert!(most < 0.015 && rms < 0.01, "{most}, {rms}");
}

#[test]
fn the_sun_has_a_disc_and_shadows_its_edges() {
    // the straight edge of a roof, two metres up; the sun's disc is a degree in radius, so shadows are 7 cm soft
    let roof = rectangle(Vec3::new(-40.0, 2.0, -20.0), Vec3::Z * 40.0, Vec3::X * 40.0, 1);
    let radius = 1.0_f32.to_radians();
    let bench = Bench::with_texels_on(ground(0.5, 1).and(roof), 160, 2);
    let sharp =
        Bench { lights: vec![sun([0.0, 1.0, 0.0], 0.0, f64::from(PI))], ..Bench::with_texels_on(bench.scene.clone(), 160, 2) };
    let bench = bench.lit(sun([0.0, 1.0, 0.0], 1.0, f64::from(PI)));
    let map = bench.solve(&params());
    // of a disc the part beyond a line at this part of its radius
    let seen = |p: Vec3| {
        let at = (-p.x / (2.0 * radius.tan())).clamp(-1.0, 1.0);
        (libm::acosf(at) - at * (1.0 - at * at).sqrt()) / PI
    };
    let off = bench.at(&map, |_, _| true).into_iter().map(|(p, light)| (light.x - seen(p)).abs());
    let (most, sum) = off.fold((0.0_f32, 0.0), |(most, sum), off| (most.max(off), sum + off));
    assert!(most < 0.03 && sum / (map.light.len() as f32) < 0.003, "{most}, {sum}");
    let map = sharp.solve(&params());
    for (p, light) in sharp.at(&map, |p, _| p.x.abs() > 1e-3) {
        assert_eq!(light.x, if p.x > 0.0 { 1.0 } else { 0.0 }, "{p}");
    }
}

#[test]
fn any_number_of_threads_finds_the_same() {
    let scene = ground(4.0, 1).and(cuboid(Vec3::new(-0.5, 0.0, -0.5), Vec3::new(0.5, 1.0, 0.3), 1));
    let bench = Bench::new(scene, 96).under(WHITE).reflecting(0.6).lit(sun([0.4, 1.0, 0.2], 0.3, 2.0));
    let solve = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| bench.solve(&SolveParams { bounces: 2, ..params() }))
    };
    assert_eq!(solve(1), solve(3));
}
