//! The path tracer against closed forms, and the solver against the path tracer.

#![expect(clippy::unwrap_used, reason = "a test that panics has failed")]

use crate::common::{Lit, UNIFORM_SKY, params};
use glam::Vec3;
use heliodon_light::reference::{
    Camera, ConstantSky, DirectSun, Environment, HarmonicSky, LatLongSky, ReferenceParams, Shape, reference_light_at_points,
    render, render_shape,
};
use heliodon_light::{Baked, Detail, LightParams, Surfaces, bake};
use heliodon_testkit::scenes::{ball, cuboid, ground, rectangle};
use std::f32::consts::FRAC_1_PI;

fn at_vertices(lit: &Lit, vertices: &[usize], sky: &dyn Environment, sun: Option<DirectSun>, p: &ReferenceParams) -> Vec<Vec3> {
    let positions: Vec<Vec3> = vertices.iter().map(|&v| lit.scene.positions[v]).collect();
    let normals: Vec<Vec3> = vertices.iter().map(|&v| lit.scene.normals[v]).collect();
    reference_light_at_points(&lit.surfaces(), sky, sun, &positions, &normals, p).unwrap()
}

#[test]
fn under_an_open_sky_of_one_light_is_one_and_radiance_the_albedo() {
    let lit = Lit::new(ground(100.0, 2), 0.37);
    let sky = ConstantSky(Vec3::ONE);
    let light = at_vertices(&lit, &[4], &sky, None, &ReferenceParams::default())[0];
    assert!((light - Vec3::ONE).abs().max_element() < 1e-5, "{light}");
    let camera = Camera::look_at(Vec3::new(0.0, 2.0, 5.0), Vec3::new(0.0, 2.0, 0.0), Vec3::Y, 1.0, 40, 30);
    let frame = render(&lit.surfaces(), &sky, None, &camera, &ReferenceParams::preview()).unwrap();
    frame.validate().unwrap();
    assert!((frame.radiance[0] - Vec3::ONE).length() < 1e-5 && frame.coverage[0] == 0.0);
    let bottom = 29 * 40 + 20;
    assert!((frame.radiance[bottom] - Vec3::splat(0.37)).length() < 1e-5 && frame.coverage[bottom] == 1.0);
}

/// A closed white-hot furnace as the path tracer can have it: all that is met reflects half, and beyond every hole is 1; with
/// n bounces in a closed room light is 0, so the emission is told by a sky that the room's walls do not keep out: a sheet of
/// holes. What remains exact is the series: from a point that sees the share w of open sky whatever it looks from, light is
/// w sum (a (1 - w))^k. On the inside of a ball with an even spread of holes w is the same everywhere.
#[test]
fn a_ball_full_of_holes_is_a_furnace() {
    // the inside of a ball sees all of its wall alike: the share of sky seen from any place is the share of holes in the area
    let mut scene = ball(1.0, 60).inside_out();
    let (mut open, mut all) = (0.0, 0.0);
    let positions = scene.positions.clone();
    let mut kept = Vec::new();
    for (i, t) in scene.triangles.iter().enumerate() {
        let [a, b, c] = t.map(|i| positions[i as usize]);
        let area = (b - a).cross(c - a).length();
        all += area;
        if i % 7 == 3 {
            open += area;
        } else {
            kept.push(*t);
        }
    }
    scene.triangles = kept;
    let (w, albedo) = (open / all, 0.5);
    let exact = w / (1.0 - albedo * (1.0 - w));
    let lit = Lit::new(scene, albedo);
    let vertices: Vec<usize> = (0..4).map(|k| 60 * 120 / 2 + k * 13).collect();
    let p = ReferenceParams { samples: 2048, max_bounces: 16, offset_m: 1e-3, seed: 0 };
    let traced = at_vertices(&lit, &vertices, &ConstantSky(Vec3::ONE), None, &p);
    // each path's estimate lies between 0 and 1: its deviation is below 1/2
    let tolerance = 5.0 * 0.5 / (2048.0_f32).sqrt();
    for light in &traced {
        assert!((light.x / exact - 1.0).abs() < tolerance / exact, "{light} against {exact}");
    }
    let solved =
        bake(&lit.surfaces(), &[], false, &LightParams { offset_m: 1e-3, max_sub_cells: 0, ..params(128, 16) }).unwrap().light;
    // all vertices but those of the crowded poles
    let belt = 10 * 120..50 * 120;
    let mean = belt.clone().map(|v| solved.sky_transfer[v * 4] * UNIFORM_SKY).sum::<f32>() / belt.len() as f32;
    assert!((mean / exact - 1.0).abs() < 0.02, "solved {mean} against {exact}");
}

#[test]
fn the_sun_and_its_bounce_have_closed_forms() {
    let sun = DirectSun { direction: Vec3::new(-0.6, 0.8, 0.0), irradiance: Vec3::new(3.0, 2.0, 1.0) };
    let wall = rectangle(Vec3::new(0.0, 0.5, 0.01), Vec3::NEG_Z * 0.02, Vec3::Y * 0.02, 1);
    let lit = Lit::new(ground(400.0, 4).and(wall), 0.4);
    let p = ReferenceParams { samples: 4096, max_bounces: 1, ..ReferenceParams::default() };
    let sky = ConstantSky(Vec3::ZERO);
    let light = at_vertices(&lit, &[7, lit.scene.positions.len() - 1], &sky, Some(sun), &p);
    let direct = sun.irradiance * 0.8 * FRAC_1_PI;
    assert!((light[0] / direct - 1.0).abs().max_element() < 1e-5, "{}", light[0]);
    let bounced = direct * 0.4 * 0.5;
    assert!((light[1] / bounced - 1.0).abs().max_element() < 0.01, "{} against {bounced}", light[1]);
}

#[test]
fn image_sampling_and_cosine_sampling_agree() {
    struct Unsampled(LatLongSky);
    impl Environment for Unsampled {
        fn radiance(&self, direction: Vec3) -> Vec3 {
            self.0.radiance(direction)
        }
    }
    let pixels: Vec<Vec3> = (0..64 * 32).map(|i| Vec3::splat(if i % 64 < 20 && i / 64 < 10 { 4.0 } else { 0.3 })).collect();
    let sky = LatLongSky::new(64, 32, pixels).unwrap();
    let lit = Lit::new(ground(4.0, 4).and(cuboid(Vec3::new(0.2, 0.0, 0.2), Vec3::new(0.8, 1.0, 0.8), 1)), 0.5);
    let vertices = [12, 13, 17, 18];
    let p = ReferenceParams { samples: 8192, ..ReferenceParams::default() };
    let both = at_vertices(&lit, &vertices, &sky, None, &p);
    let cosine = at_vertices(&lit, &vertices, &Unsampled(sky), None, &p);
    for (a, b) in both.iter().zip(&cosine) {
        // radiance up to 4, so a deviation below 2 a path
        assert!((*a - *b).abs().max_element() < 5.0 * 2.0 / 8192.0_f32.sqrt(), "{a} against {b}");
    }
}

#[test]
fn the_solver_agrees_with_the_path_tracer() {
    let scene = ground(4.0, 40)
        .and(cuboid(Vec3::new(-0.5, 0.0, -0.5), Vec3::new(0.5, 0.8, 0.5), 14))
        .and(ball(0.4, 24).moved(Vec3::new(1.0, 0.65, 0.2)));
    let lit = Lit::new(scene, 0.6);
    // a sky that is bluer above and never negative
    let sky: Vec<Vec3> = vec![Vec3::new(2.0, 2.2, 2.8), Vec3::new(0.5, 0.7, 0.9), Vec3::splat(0.1), Vec3::splat(-0.2)];
    let sun = DirectSun { direction: Vec3::new(0.5, 0.7, 0.4).normalize_or_zero(), irradiance: Vec3::splat(3.0) };
    let baked =
        bake(&lit.surfaces(), &[sun.direction], true, &LightParams { offset_m: 1e-3, max_sub_cells: 0, ..params(256, 4) })
            .unwrap();
    // the foot of the box lies in the ground's plane, where the reference's rays start as well: theirs is no answer
    let foot = |v: usize| lit.scene.positions[v].y == 0.0 && lit.scene.normals[v].y < 0.5;
    let valid = |v: usize| baked.light.validity.valid[v] == 1 && !foot(v);
    let vertices: Vec<usize> = (0..lit.scene.positions.len()).step_by(29).filter(|&v| valid(v)).collect();
    let p = ReferenceParams { samples: 2048, max_bounces: 4, offset_m: 1e-3, seed: 1 };
    let traced = at_vertices(&lit, &vertices, &HarmonicSky(sky.clone()), Some(sun), &p);
    let mean = traced.iter().map(|l| l.x).sum::<f32>() / traced.len() as f32;
    let mut errors: Vec<f32> = vertices
        .iter()
        .zip(&traced)
        .map(|(&v, exact)| {
            let cos = lit.scene.normals[v].dot(sun.direction).max(0.0);
            let direct = if baked.masks.is_lit(v, 0) { cos * FRAC_1_PI } else { 0.0 };
            let light = baked.light.sky_light(v, &sky) + sun.irradiance * (direct + baked.light.bounced_sun(v, 0));
            (light - *exact).x.abs() / exact.x.max(0.05 * mean)
        })
        .collect();
    errors.sort_unstable_by(f32::total_cmp);
    let (median, p95) = (errors[errors.len() / 2], errors[errors.len() * 95 / 100]);
    assert!(median < 0.015 && p95 < 0.05, "median {median}, 95th percentile {p95} over {} vertices", errors.len());
}

#[test]
fn a_streak_of_sun_between_the_corners_of_a_floor_lights_the_ceiling() {
    // two slabs with a slot between them over a floor of fifty triangles; of those below the slot no corner sees the sun
    let slab = |from: f32, to: f32| cuboid(Vec3::new(-2.0, 1.0, from), Vec3::new(2.0, 1.2, to), 10);
    let lit = Lit::new(ground(4.0, 5).and(slab(-2.0, -0.15)).and(slab(0.15, 2.0)), 0.6);
    let suns = [Vec3::new(0.2, 1.0, 0.1), Vec3::new(-0.1, 1.0, -0.4)].map(Vec3::normalize_or_zero);
    let p = LightParams { offset_m: 1e-3, max_sub_cells: 0, ..params(1024, 1) };
    let once = LightParams { further_lattices: 0, ..p.clone() };
    let [baked, once] = [&p, &once].map(|p| bake(&lit.surfaces(), &suns, true, p).unwrap());
    let above = |v: usize| lit.scene.positions[v].y == 1.0 && lit.scene.normals[v].y < -0.9;
    let within = |v: usize| lit.scene.positions[v].abs().max_element() < 1.7;
    let vertices: Vec<usize> = (0..lit.scene.positions.len()).filter(|&v| above(v) && within(v)).collect();
    for (step, &direction) in suns.iter().enumerate() {
        let sun = Some(DirectSun { direction, irradiance: Vec3::ONE });
        let reference = ReferenceParams { samples: 32_768, max_bounces: 1, offset_m: 1e-3, seed: 1 };
        let traced = at_vertices(&lit, &vertices, &ConstantSky(Vec3::ZERO), sun, &reference);
        let mean = traced.iter().map(|l| l.x).sum::<f32>() / traced.len() as f32;
        assert!(mean > 0.005, "the streak is seen: {mean}");
        let errors = |baked: &Baked| -> Vec<f32> {
            let error = |(&v, exact): (&usize, &Vec3)| (baked.light.bounced_sun(v, step).x - exact.x).abs() / exact.x.max(mean);
            vertices.iter().zip(&traced).map(error).collect()
        };
        let (mut errors, once) = (errors(&baked), errors(&once));
        let sum = |errors: &[f32]| errors.iter().sum::<f32>();
        assert!(sum(&errors) < 0.7 * sum(&once), "step {step}: {} looking again, {} once", sum(&errors), sum(&once));
        errors.sort_unstable_by(f32::total_cmp);
        let (median, worst) = (errors[errors.len() / 2], errors[errors.len() - 1]);
        assert!(median < 0.05 && worst < 0.4, "step {step}: median {median}, worst {worst}");
    }
}

#[test]
fn pictures_are_the_same_for_any_number_of_threads() {
    let lit = Lit::new(ground(4.0, 4).and(ball(0.5, 12)), 0.5);
    let camera = Camera::look_at(Vec3::new(2.0, 1.0, 2.0), Vec3::ZERO, Vec3::Y, 0.9, 33, 21);
    let sun = Some(DirectSun { direction: Vec3::new(0.6, 0.8, 0.0), irradiance: Vec3::ONE });
    let [one, many] = [1, 4].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let p = ReferenceParams::preview();
        pool.install(|| render(&lit.surfaces(), &ConstantSky(Vec3::splat(0.4)), sun, &camera, &p).unwrap())
    });
    assert!(one == many);
}

/// A ground that is meshed a centimetre too low, and without the block that stands on it.
#[test]
fn a_shape_shows_the_light_of_what_it_stands_for() {
    let original = Lit::new(ground(40.0, 1).and(cuboid(Vec3::new(-0.3, 0.0, -0.3), Vec3::new(0.3, 0.6, 0.3), 1)), 0.5);
    let seen = Lit::new(ground(40.0, 1).moved(Vec3::NEG_Y * 0.01), 0.1);
    let camera = Camera::look_at(Vec3::new(0.0, 2.5, 2.5), Vec3::ZERO, Vec3::Y, 0.9, 40, 40);
    let sun = Some(DirectSun { direction: Vec3::new(0.6, 0.8, 0.0), irradiance: Vec3::ONE });
    let sky = ConstantSky(Vec3::splat(0.2));
    let p = ReferenceParams::preview();
    let truth = render(&original.surfaces(), &sky, sun, &camera, &p).unwrap();
    let shaped = |reach_rad: f32| {
        let reach_rad = vec![reach_rad; seen.scene.triangles.len()];
        let shape = Shape { surfaces: &seen.surfaces(), reach_rad: &reach_rad };
        render_shape(shape, &original.surfaces(), &sky, sun, &camera, &p).unwrap()
    };
    let off = |frame: &heliodon_light::reference::ReferenceFrame, x: usize, y: usize| {
        (frame.radiance[40 * y + x] - truth.radiance[40 * y + x]).length()
    };
    let near = shaped(0.02);
    near.validate().unwrap();
    // sunlit ground, and ground in the block's shadow, which the low ground has not
    for (x, y) in [(35, 20), (20, 36), (13, 20)] {
        assert!(off(&near, x, y) < 0.02, "{x}, {y}: {} off", off(&near, x, y));
    }
    let (lit, shadow) = (truth.radiance[40 * 20 + 35].x, truth.radiance[40 * 20 + 13].x);
    assert!(shadow < 0.6 * lit, "the block throws no shadow there: {shadow} beside {lit}");
    // the top of the block is seen in the middle; of the shape it is ground that is seen there
    assert!(off(&near, 20, 17) > 0.05, "{} off", off(&near, 20, 17));
    // where neither is met the sky shows, though the shape is there
    let up = Camera::look_at(Vec3::Y, Vec3::Y * 2.0, Vec3::Z, 0.9, 4, 4);
    let lid = Lit::new(ground(40.0, 1).moved(Vec3::Y * 5.0), 0.1);
    let reach_rad = vec![0.02; lid.scene.triangles.len()];
    let shape = Shape { surfaces: &lid.surfaces(), reach_rad: &reach_rad };
    let nothing = render_shape(shape, &original.surfaces(), &sky, sun, &up, &p).unwrap();
    let is_sky = nothing.radiance.iter().all(|r| (*r - Vec3::splat(0.2)).length() < 1e-6);
    assert!(is_sky && nothing.coverage.iter().all(|c| *c == 0.0), "{nothing:?}");
    // what lies beyond its reach shows what is seen straight on
    let straight = shaped(1e-4);
    assert!(straight.radiance == truth.radiance);
    assert!(shaped(0.0).radiance == truth.radiance);
    // one for each triangle, in its range
    let whole = vec![0.1; seen.scene.triangles.len()];
    let with = |reach: f32| [&whole[1..], &[reach]].concat();
    for (reach_rad, is_one) in
        [(whole.clone(), true), (vec![0.1], false), (with(f32::NAN), false), (with(f32::INFINITY), false), (with(-0.1), false)]
    {
        let shape = Shape { surfaces: &seen.surfaces(), reach_rad: &reach_rad };
        assert_eq!(render_shape(shape, &original.surfaces(), &sky, sun, &camera, &p).is_ok(), is_one, "{reach_rad:?}");
    }
    // what rays meet is told in these triangles, or not at all
    let (stands_for, clearance_m) = (vec![0; seen.scene.triangles.len()], vec![0.0; seen.scene.positions.len()]);
    let detail = Some(Detail { stands_for: &stands_for, clearance_m: &clearance_m, shown: &[] });
    let simplified = Surfaces { detail, ..seen.surfaces() };
    simplified.validate().unwrap();
    let shape = Shape { surfaces: &simplified, reach_rad: &whole };
    assert!(render_shape(shape, &original.surfaces(), &sky, sun, &camera, &p).is_err());
    assert!(render(&simplified, &sky, sun, &camera, &p).is_err());
    assert!(reference_light_at_points(&simplified, &sky, sun, &[Vec3::Y], &[Vec3::Y], &p).is_err());
}

/// Two blocks a centimetre apart, whose triangles reach from the lit rim of the joint into its dark; one block is meshed too coarsely
/// to have a vertex within. Were the light of a triangle's corners believed, daylight would reach the joint's depth.
#[test]
fn a_narrow_joint_of_coarse_triangles_stays_dark() {
    for (parts, other, wanted) in [(2, 2, 1), (4, 4, 4), (4, 1, 4)] {
        let left = cuboid(Vec3::new(-0.405, 0.0, -0.2), Vec3::new(-0.005, 0.4, 0.2), parts);
        let right = cuboid(Vec3::new(0.005, 0.0, -0.2), Vec3::new(0.405, 0.4, 0.2), other);
        let lit = Lit::new(ground(3.0, 30).and(left).and(right), 0.7);
        let deep: Vec<usize> = (0..lit.scene.positions.len())
            .filter(|&v| (lit.scene.positions[v].x + 0.005).abs() < 1e-5 && lit.scene.normals[v].x > 0.99)
            .filter(|&v| {
                let place = (lit.scene.positions[v] - Vec3::Y * 0.2).abs();
                // the middle, or halfway to the rim off the diagonals, where the coarse triangles meet
                match parts {
                    2 => place.y < 0.01 && place.z < 0.01,
                    _ => (place.y < 0.01 && (place.z - 0.1).abs() < 0.01) || (place.z < 0.01 && (place.y - 0.1).abs() < 0.01),
                }
            })
            .collect();
        assert_eq!(deep.len(), wanted);
        // one sun shines into the joint, on the face across from the places, the other shines on its rim
        let suns = [Vec3::new(-0.02, 0.599_88, 0.799_84), Vec3::new(0.8, 0.6, 0.0)];
        let params = LightParams { cell_size_m: Some(10.0), ..params(2048, 4) };
        let light = bake(&lit.surfaces(), &suns, true, &params).unwrap().light;
        let count = light.vertex_count();
        let sky = [Vec3::splat(UNIFORM_SKY), Vec3::ZERO, Vec3::ZERO, Vec3::ZERO];
        let mean_sky = (0..count).map(|v| light.sky_light(v, &sky).x).sum::<f32>() / count as f32;
        let reference = ReferenceParams { samples: 16_384, max_bounces: 4, offset_m: 1e-4, ..ReferenceParams::default() };
        let traced = at_vertices(&lit, &deep, &ConstantSky(Vec3::ONE), None, &reference);
        for (&v, traced) in deep.iter().zip(&traced) {
            let (baked, limit) = (light.sky_light(v, &sky).x, 0.15 * traced.x.max(0.05 * mean_sky));
            assert!((baked - traced.x).abs() < limit, "{parts}, {other}: {baked} against {}, {limit} allowed", traced.x);
        }
        for (step, &direction) in suns.iter().enumerate() {
            let sun = DirectSun { direction, irradiance: Vec3::ONE };
            let traced = at_vertices(&lit, &deep, &ConstantSky(Vec3::ZERO), Some(sun), &reference);
            for (&v, traced) in deep.iter().zip(&traced) {
                // neither sun reaches these places itself
                let baked = light.bounced_sun(v, step).x;
                let limit = 0.15 * traced.x.max(0.05 * direction.y * FRAC_1_PI);
                assert!((baked - traced.x).abs() < limit, "sun {step}, {parts}, {other}: {baked} against {}", traced.x);
            }
        }
    }
}
