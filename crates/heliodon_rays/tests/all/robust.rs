//! What must hold whatever the input: same bits everywhere, closed surfaces, hostile triangles.

use crate::common;
use crate::common::{build, build_with, check_hit, direction, number, point, sheet, soup};
use glam::Vec3;
use heliodon_math::random::Pcg32;
use heliodon_rays::{
    BuildError, BuildParams, Hit, Instructions, MAX_COORDINATE, Quality, Ray, TriangleScene, beam_order, bench, morton_order,
};
use proptest::prelude::*;

/// Shadows and nearest hits of all origins in one direction, asked in runs of `run`.
fn ask(scene: &TriangleScene, origins: &[Vec3], direction: Vec3, run: usize) -> (Vec<bool>, Vec<Hit>) {
    let (mut shaded, mut all) = (Vec::new(), Vec::new());
    for origins in origins.chunks(run) {
        let active = vec![u64::MAX; origins.len().div_ceil(64)];
        let (mut bits, mut hits) = (active.clone(), vec![Hit::MISS; origins.len()]);
        scene.occluded_parallel(origins, direction, &active, &mut bits);
        scene.closest_parallel(origins, direction, &active, &mut hits);
        shaded.extend((0..origins.len()).map(|i| bits[i / 64] >> (i % 64) & 1 == 1));
        all.extend(hits);
    }
    (shaded, all)
}

fn bits(hit: &Hit) -> [u32; 5] {
    [hit.triangle, hit.t.to_bits(), hit.u.to_bits(), hit.v.to_bits(), u32::from(hit.back)]
}

#[test]
fn every_instruction_set_and_partition_and_tree_gives_the_same_bits() {
    for (seed, soup) in [soup(400, 11), sheet(50, 12)].into_iter().enumerate() {
        let mut rng = Pcg32::new(seed as u64, 5);
        let mut origins: Vec<Vec3> = soup.0.iter().map(|p| *p + point(&mut rng) * 1e-3).collect();
        origins.extend((0..500).map(|_| point(&mut rng) * 2.0));
        let directions: Vec<Vec3> =
            (0..6).map(|_| direction(&mut rng)).chain([Vec3::Y, -Vec3::X, Vec3::new(1.0, 1.0, 0.0)]).collect();
        let scene = build(&soup);
        for &d in &directions {
            let (shaded, hits) = ask(&scene, &origins, d, origins.len());
            for run in [1, 17, 64, 1000] {
                let (s, h) = ask(&scene, &origins, d, run);
                assert_eq!(s, shaded);
                assert!(h.iter().map(bits).eq(hits.iter().map(bits)));
            }
            for quality in [Quality::Fast, Quality::High] {
                let (s, h) = ask(&build_with(&soup, quality), &origins, d, origins.len());
                assert_eq!(s, shaded);
                assert!(h.iter().map(bits).eq(hits.iter().map(bits)));
            }
        }
        let expected: Vec<_> = directions.iter().map(|&d| ask(&scene, &origins, d, 256)).collect();
        let mut scene = scene;
        for instructions in Instructions::available() {
            scene = scene.with_instructions(instructions);
            for (&d, (shaded, hits)) in directions.iter().zip(&expected) {
                let (s, h) = ask(&scene, &origins, d, 256);
                assert_eq!(s, *shaded, "{instructions:?}");
                assert!(h.iter().map(bits).eq(hits.iter().map(bits)), "{instructions:?}");
            }
        }
    }
}

/// Suns of a day and what no day has: equal, turned, lower than the horizon, along the axes, none.
fn fan(rng: &mut Pcg32) -> Vec<Vec3> {
    let mut fan = bench::equinox_suns(40);
    fan.extend([Vec3::Y; 9]);
    fan.extend(bench::equinox_suns(5).into_iter().map(|s| -s));
    fan.extend([Vec3::NAN, Vec3::ZERO, Vec3::X, -Vec3::Z, Vec3::new(1.0, 1.0, 0.0), Vec3::new(1.0, -1.0, 1e-30)]);
    fan.extend((0..30).map(|_| direction(rng)));
    // A grazing arc, steps of a hundredth of a degree, and none at all.
    fan.extend((0..20).map(|i| Vec3::new(1.0, 1e-7 * i as f32, 0.3)));
    fan
}

#[test]
fn a_fan_is_the_same_as_ray_by_ray() {
    for (seed, (soup, away)) in
        [(soup(400, 21), Vec3::ZERO), (sheet(60, 22), Vec3::ZERO), (sheet(40, 23), Vec3::new(700.0, -30.0, 9000.0))]
            .into_iter()
            .enumerate()
    {
        let mut rng = Pcg32::new(seed as u64, 9);
        let soup = (soup.0.iter().map(|p| *p + away).collect::<Vec<_>>(), soup.1);
        let mut scene = build(&soup);
        // Runs of neighbours on the surface; in its very plane; inside; far out; nowhere.
        let mut origins: Vec<Vec3> = soup.0.iter().take(900).map(|p| *p + Vec3::Y * scene.start_offset()).collect();
        origins.extend(soup.0.iter().take(70).copied());
        origins.extend((0..100).map(|_| away + point(&mut rng) * 2.0));
        origins.extend([Vec3::NAN, Vec3::splat(f32::INFINITY), Vec3::splat(1e7), away - Vec3::Y * 1e4]);
        let directions = fan(&mut rng);
        let words = origins.len().div_ceil(64);
        let active: Vec<u64> = (0..words * directions.len())
            .map(|i| match i % 5 {
                0 => u64::MAX,
                1 => 1 << (i % 64),
                2 => 0,
                _ => u64::from(rng.next_u32()) * 0x1_0000_0003,
            })
            .collect();
        let mut expected = vec![0; active.len()];
        for (d, expected) in directions.iter().zip(expected.chunks_mut(words)) {
            let rays: Vec<Ray> =
                origins.iter().map(|&origin| Ray { origin, direction: *d, t_min: 0.0, t_max: f32::INFINITY }).collect();
            scene.occluded(&rays, expected);
        }
        for (expected, active) in expected.iter_mut().zip(&active) {
            *expected &= active;
        }
        assert!(expected.iter().any(|w| *w != 0) && expected.iter().zip(&active).any(|(e, a)| e != a));
        for instructions in Instructions::available() {
            scene = scene.with_instructions(instructions);
            let mut occluded = vec![u64::MAX; active.len()];
            scene.occluded_fan(&origins, &directions, &active, &mut occluded);
            assert!(occluded == expected, "{instructions:?}, scene {seed}");
        }
    }
    build(&(vec![], vec![])).occluded_fan(&[], &[Vec3::Y], &[], &mut []);
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let soup = sheet(60, 13);
    let origins: Vec<Vec3> = soup.0.iter().map(|p| *p + Vec3::Y * 1e-3).collect();
    let with = |threads: usize| {
        rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(|| {
            let order = beam_order(&origins, Some(&origins));
            let (shaded, hits) = ask(&build(&soup), &origins, Vec3::new(0.9, 0.3, 0.2), 512);
            (order, shaded, hits.iter().map(bits).collect::<Vec<_>>())
        })
    };
    assert_eq!(with(1), with(3));
}

/// An icosphere-like ball: a cube's faces, subdivided and pushed out.
fn ball(n: u32) -> common::Soup {
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for face in 0..6 {
        let (axis, side) = (face / 2, if face % 2 == 0 { 1.0 } else { -1.0 });
        let base = positions.len() as u32;
        for i in 0..=n {
            for j in 0..=n {
                let mut p = Vec3::ZERO;
                p[axis] = side;
                p[(axis + 1) % 3] = i as f32 / n as f32 * 2.0 - 1.0;
                p[(axis + 2) % 3] = j as f32 / n as f32 * 2.0 - 1.0;
                positions.push(p / p.length());
            }
        }
        for i in 0..n {
            for j in 0..n {
                let a = base + i * (n + 1) + j;
                triangles.extend([[a, a + n + 1, a + 1], [a + 1, a + n + 1, a + n + 2]]);
            }
        }
    }
    (positions, triangles)
}

#[test]
fn no_ray_leaves_a_closed_surface() {
    // Aimed at vertices and at points of edges, where cracks would be; a kilometre away too.
    for away in [Vec3::ZERO, Vec3::new(1000.0, -300.0, 7000.0)] {
        let mut soup = ball(9);
        for p in &mut soup.0 {
            *p += away;
        }
        let scene = build(&soup);
        let mut rng = Pcg32::new(9, 6);
        for [a, b, _] in &soup.1 {
            let (a, b) = (soup.0[*a as usize], soup.0[*b as usize]);
            for target in [a, b, a.lerp(b, 0.5), a.lerp(b, rng.next_f32())] {
                let origin = away + point(&mut rng) * 0.3;
                let d = target - origin;
                let ray = Ray { origin, direction: d, t_min: 0.0, t_max: f32::INFINITY };
                let mut hits = [Hit::MISS];
                scene.closest(&[ray], &mut hits);
                assert!(hits[0].is_some(), "{ray:?}");
                // Parallel rays from as many origins as make a beam, most of which miss the edge by a hair.
                let origins: Vec<Vec3> = (0..40).map(|i| origin + d * (i as f32 * 0.01)).collect();
                assert!(ask(&scene, &origins, d, 64).0.iter().all(|s| *s));
            }
        }
    }
}

#[test]
fn starts_at_the_safe_offset_do_not_meet_their_own_surface() {
    for away in [Vec3::ZERO, Vec3::new(400.0, 0.0, -900.0)] {
        let n = 40;
        let mut soup = sheet(n, 14);
        for p in &mut soup.0 {
            p.y = 0.37 * p.x - 0.21 * p.z;
            *p = *p * 20.0 + away;
        }
        let scene = build(&soup);
        let normal = Vec3::new(-0.37, 1.0, 0.21) / Vec3::new(-0.37, 1.0, 0.21).length();
        // Vertices were rounded, so the sheet is flat to one unit in the last place only: that is the caller's model.
        let flat = 2.0 * f32::EPSILON * 900.0;
        let origins: Vec<Vec3> = soup.0.iter().map(|p| *p + normal * (scene.start_offset() + flat)).collect();
        let mut rng = Pcg32::new(3, 7);
        for _ in 0..50 {
            let d = direction(&mut rng);
            let d = if d.dot(normal) < 0.0 { -d } else { d };
            if d.dot(normal) > 1e-2 {
                assert!(ask(&scene, &origins, d, 4096).0.iter().all(|s| !s), "{d:?}");
            }
        }
    }
}

#[test]
fn hostile_triangles() {
    let ray = |origin, direction| Ray { origin, direction, t_min: 0.0, t_max: f32::INFINITY };
    let first = |scene: &TriangleScene, r: Ray| {
        let mut hits = [Hit::MISS];
        scene.closest(&[r], &mut hits);
        hits[0]
    };
    let empty = build(&(vec![], vec![]));
    assert_eq!(empty.bounds(), None);
    assert_eq!(first(&empty, ray(Vec3::ZERO, Vec3::Y)), Hit::MISS);
    assert!(!ask(&empty, &[Vec3::ZERO; 70], Vec3::Y, 70).0[0]);

    let outside = TriangleScene::build(&[Vec3::ZERO], &[[0, 0, 1]], &BuildParams::default());
    assert_eq!(outside.err(), Some(BuildError::VertexOutOfRange { triangle: 0, vertex: 1, vertices: 1 }));

    // One good triangle (index 4) among those that are left out; it keeps its index.
    let positions = vec![
        Vec3::new(-1.0, 1.0, -1.0),
        Vec3::new(0.0, 1.0, 2.0),
        Vec3::new(1.0, 1.0, -1.0),
        Vec3::NAN,
        Vec3::splat(f32::INFINITY),
        Vec3::splat(MAX_COORDINATE * 2.0),
    ];
    let scene = build(&(positions, vec![[0, 1, 3], [0, 1, 4], [0, 1, 5], [0, 0, 1], [0, 1, 2]]));
    let hit = first(&scene, ray(Vec3::ZERO, Vec3::Y * 4.0));
    assert_eq!((hit.triangle, hit.t, hit.back), (4, 0.25, true));
    assert!(!first(&scene, ray(Vec3::Y * 3.0, -Vec3::Y)).back);
    for bad in [Vec3::ZERO, Vec3::NAN, Vec3::splat(f32::INFINITY)] {
        assert!(!first(&scene, ray(Vec3::ZERO, bad)).is_some());
        assert!(!ask(&scene, &[Vec3::ZERO; 3], bad, 3).0[0]);
    }
    let odd = [Vec3::NAN, Vec3::ZERO, Vec3::splat(f32::NEG_INFINITY), Vec3::splat(MAX_COORDINATE * 4.0)];
    assert_eq!(ask(&scene, &odd, Vec3::Y, 4).0, [false, true, false, false]);

    // Thousands of copies of one triangle: the lowest index wins.
    let copies = (vec![Vec3::ZERO, Vec3::X, Vec3::Z], vec![[0, 1, 2]; 5000]);
    let hit = first(&build(&copies), ray(Vec3::new(0.2, 1.0, 0.3), -Vec3::Y));
    assert_eq!((hit.triangle, hit.t), (0, 1.0));
    assert!((hit.u - 0.2).abs() < 1e-6 && (hit.v - 0.3).abs() < 1e-6);

    // A huge ground does not hide what is small.
    let wide = 1.0e9;
    let ground = vec![Vec3::new(-wide, 0.0, -wide), Vec3::new(wide, 0.0, -wide), Vec3::new(0.0, 0.0, 2.0 * wide)];
    assert!(first(&build(&(ground, vec![[0, 1, 2]])), ray(Vec3::new(3.0, 2.0, 1.0), -Vec3::Y)).is_some());
}

#[test]
fn all_in_one_plane_seen_edge_on_and_face_on() {
    let mut soup = soup(300, 15);
    for p in &mut soup.0 {
        p.y = 0.5;
    }
    let scene = build(&soup);
    let mut rng = Pcg32::new(1, 8);
    let origins: Vec<Vec3> = (0..300).map(|_| Vec3::new(number(&mut rng), 0.5, number(&mut rng))).collect();
    assert!(ask(&scene, &origins, Vec3::X, 300).0.iter().all(|s| !s), "edge-on triangles do not count");
    for o in &origins {
        let ray = Ray { origin: *o - Vec3::Y, direction: Vec3::new(0.1, 1.0, 0.05), t_min: 0.0, t_max: f32::INFINITY };
        let mut hits = [Hit::MISS];
        scene.closest(&[ray], &mut hits);
        check_hit(&soup, &ray, &hits[0]);
    }
}

#[test]
fn the_ends_of_a_ray_count_as_documented() {
    let scene =
        build(&(vec![Vec3::new(-1.0, 0.0, -1.0), Vec3::new(0.0, 0.0, 2.0), Vec3::new(1.0, 0.0, -1.0)], vec![[0, 1, 2]]));
    let meets = |t_min: f32, t_max: f32| {
        let mut bits = [0];
        scene.occluded(&[Ray { origin: Vec3::Y, direction: -Vec3::Y, t_min, t_max }], &mut bits);
        bits[0] == 1
    };
    assert!(meets(0.0, f32::INFINITY) && meets(0.999, 1.001));
    assert!(!meets(1.0, 2.0) && !meets(0.0, 1.0) && !meets(f32::NAN, 2.0) && !meets(0.0, f32::NAN));
}

#[test]
fn the_benchmark_counts_rays_that_face_the_sun() {
    // A floor of two triangles, under a roof that covers half of it at noon.
    let floor = [Vec3::new(0.0, 0.0, 0.0), Vec3::new(0.0, 0.0, 1.0), Vec3::new(1.0, 0.0, 0.0), Vec3::new(1.0, 0.0, 1.0)];
    let roof = [Vec3::new(-9.0, 1.0, -9.0), Vec3::new(-9.0, 1.0, 9.0), Vec3::new(0.5, 1.0, -9.0), Vec3::new(0.5, 1.0, 9.0)];
    let positions = [floor, roof].concat();
    let scene = build(&(positions, vec![[0, 1, 2], [2, 1, 3], [4, 5, 6], [6, 5, 7]]));
    let measured = bench::sun_rays(&scene, &floor, &[Vec3::Y, Vec3::Y, Vec3::Y, -Vec3::Y], &[Vec3::Y, Vec3::Y], 1e-3);
    assert_eq!((measured.rays, measured.occluded), (6, 4));
    assert!(measured.mrays_per_second() > 0.0);
    assert!(bench::equinox_suns(92).iter().all(|s| (s.length() - 1.0).abs() < 1e-6 && s.y > 0.0));
}

#[test]
fn memory_stays_below_the_budget() {
    let soup = sheet(150, 16);
    let bytes = build(&soup).memory_bytes() as f64 / soup.1.len() as f64;
    assert!(bytes < 80.0, "{bytes} bytes a triangle");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn orders_are_permutations(
        coordinates in prop::collection::vec(prop::num::f32::ANY, 0..600),
        with_normals in any::<bool>(),
    ) {
        let points: Vec<Vec3> = coordinates.chunks_exact(3).map(Vec3::from_slice).collect();
        for mut order in [morton_order(&points), beam_order(&points, with_normals.then_some(&points[..]))] {
            order.sort_unstable();
            prop_assert!(order.iter().copied().eq(0..points.len() as u32));
        }
    }

    #[test]
    fn any_triangles_and_rays(
        numbers in prop::collection::vec(prop_oneof![prop::num::f32::ANY, -2.0f32..2.0, Just(0.0), Just(1.0)], 9..120),
        from in prop::array::uniform3(-2.0f32..2.0),
        to in prop::array::uniform3(prop_oneof![-1.0f32..1.0, Just(0.0)]),
    ) {
        let positions: Vec<Vec3> = numbers.chunks_exact(3).map(Vec3::from_slice).collect();
        let triangles: Vec<[u32; 3]> = (0..positions.len() as u32 / 3).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let scene = build(&(positions.clone(), triangles));
        let (d, mut origins) = (Vec3::from_array(to), positions);
        origins.push(Vec3::from_array(from));
        let (shaded, hits) = ask(&scene, &origins, d, 64);
        for ((origin, shaded), hit) in origins.iter().zip(shaded).zip(hits) {
            let mut single = [Hit::MISS];
            scene.closest(&[Ray { origin: *origin, direction: d, t_min: 0.0, t_max: f32::INFINITY }], &mut single);
            prop_assert_eq!(bits(&single[0]), bits(&hit));
            prop_assert_eq!(shaded, hit.is_some());
        }
    }
}
