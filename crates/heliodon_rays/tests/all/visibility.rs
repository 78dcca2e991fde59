//! The visibility matrix: analytic scenes, single rays, hostile meshes.

#![expect(clippy::unwrap_used, reason = "a test may panic")]

use crate::common::{point, sheet};
use glam::{Quat, Vec3};
use heliodon_math::light_sphere::LightSphere;
use heliodon_math::random::Pcg32;
use heliodon_math::visibility::{BLOCK, VisibilityMatrix};
use heliodon_rays::{BuildParams, Ray, TriangleScene};
use heliodon_testkit::scenes::{Scene, ball, cuboid, ground, rectangle};

const OFFSET_M: f32 = 1e-4;

fn matrix(scene: &Scene, sphere: &LightSphere) -> VisibilityMatrix {
    let rays = TriangleScene::build(&scene.positions, &scene.triangles, &BuildParams::default()).unwrap();
    let matrix = rays.visibility(&scene.positions, &scene.normals, sphere.directions(), OFFSET_M);
    assert_eq!(matrix.validate(), Ok(()));
    matrix
}

fn occlusion(scene: &Scene, level: u32) -> Vec<f32> {
    let sphere = LightSphere::new(level);
    matrix(scene, &sphere).ambient_occlusion(sphere.weights())
}

#[test]
fn convex_solids_are_open_exactly() {
    for solid in [ball(1.0, 24), cuboid(Vec3::splat(-1.0), Vec3::new(1.0, 2.0, 3.0), 9), ground(10.0, 3)] {
        for level in 0..=3 {
            assert!(occlusion(&solid, level).iter().all(|&ao| ao == 1.0), "level {level}");
        }
    }
}

#[test]
fn a_closed_room_is_dark() {
    let room = cuboid(Vec3::splat(-1.0), Vec3::splat(1.0), 6).inside_out();
    // Vertices in edges and corners lie in two walls or three; those within a face see nothing but walls.
    let dark = occlusion(&room, 3);
    let within = |p: &Vec3| p.to_array().into_iter().filter(|c| c.abs() > 0.99).count() == 1;
    for (p, ao) in room.positions.iter().zip(dark).filter(|(p, _)| within(p)) {
        assert_eq!(ao, 0.0, "{p}");
    }
}

#[test]
fn a_wall_takes_half_of_the_ground_at_its_foot() {
    let wall = rectangle(Vec3::new(-500.0, 0.0, 0.0), Vec3::X * 1000.0, Vec3::Y * 1000.0, 1);
    let mut scene = ground(2.0, 20).moved(Vec3::Z * 1.001).and(wall);
    // Askew, for the light sphere has directions in the plane of any wall along the axes.
    let turn = Quat::from_rotation_y(0.3);
    scene.positions.iter_mut().chain(&mut scene.normals).for_each(|v| *v = turn * *v);
    let sphere = LightSphere::new(4);
    let matrix = matrix(&scene, &sphere);
    let ao = matrix.ambient_occlusion(sphere.weights());
    let bent = matrix.light(sphere.weights(), sphere.directions()).light;
    for (i, p) in scene.positions.iter().enumerate().take(21 * 21) {
        assert!((ao[i] - 0.5).abs() < 0.01, "{p}: {}", ao[i]);
        // The integral of n.l l / pi over half a hemisphere: 1/3 along the normal, 2 / (3 pi) away from the wall.
        let exact = turn * Vec3::new(0.0, 1.0 / 3.0, 2.0 / 3.0 / std::f32::consts::PI);
        assert!(bent[i].angle_between(exact) < 0.02, "{p}: {}", bent[i]);
    }
}

#[test]
fn inside_a_tube_the_ends_are_seen() {
    // A tube of radius 1 along x, open at both ends. A point of its wall at `a` and `b` from the ends.
    let (columns, rings, half) = (96u32, 40u32, 2.0f32);
    let mut tube = Scene::default();
    for ring in 0..=rings {
        for column in 0..columns {
            let angle = std::f32::consts::TAU * column as f32 / columns as f32;
            let out = Vec3::new(0.0, libm::cosf(angle), libm::sinf(angle));
            tube.positions.push(out + Vec3::X * (half * (2.0 * ring as f32 / rings as f32 - 1.0)));
            tube.normals.push(-out);
        }
    }
    for ring in 0..rings {
        for column in 0..columns {
            let (a, b) = (ring * columns + column, ring * columns + (column + 1) % columns);
            tube.triangles.extend([[a, b, a + columns], [b, b + columns, a + columns]]);
        }
    }
    // From a wall element to the disc that closes the tube at distance h: half of 1 - ... (Howell, B-21 with r = 1):
    // F = (h^2 + 2) / (2 sqrt(h^2 + 4)) - h / 2.
    let end = |h: f32| (h * h + 2.0) / (2.0 * (h * h + 4.0).sqrt()) - h / 2.0;
    let ao = occlusion(&tube, 5);
    for ring in 1..rings {
        let x = half * (2.0 * ring as f32 / rings as f32 - 1.0);
        let exact = end(half - x) + end(half + x);
        let of_ring = &ao[(ring * columns) as usize..][..columns as usize];
        let mean = of_ring.iter().sum::<f32>() / columns as f32;
        assert!((mean - exact).abs() < 0.01, "at {x}: {mean}, not {exact}");
    }
}

#[test]
fn every_entry_is_what_a_single_ray_says() {
    let (positions, triangles) = sheet(30, 7);
    let rays = TriangleScene::build(&positions, &triangles, &BuildParams::default()).unwrap();
    let mut rng = Pcg32::new(5, 5);
    let normals: Vec<Vec3> = positions.iter().map(|_| heliodon_math::frame::unit_or(point(&mut rng), Vec3::Y)).collect();
    let sphere = LightSphere::new(3);
    let matrix = rays.visibility(&positions, &normals, sphere.directions(), OFFSET_M);
    assert_eq!(matrix.validate(), Ok(()));
    assert!(positions.len() > BLOCK, "more than one block");
    let mut visible = 0;
    for (row, &i) in matrix.order().iter().enumerate() {
        let (p, n) = (positions[i as usize], matrix.normals()[row]);
        let asked: Vec<Ray> = sphere
            .directions()
            .iter()
            .map(|&direction| Ray { origin: p + n * OFFSET_M, direction, t_min: 0.0, t_max: f32::INFINITY })
            .collect();
        let mut occluded = vec![0u64; asked.len().div_ceil(64)];
        rays.occluded(&asked, &mut occluded);
        for (j, (&l, entry)) in sphere.directions().iter().zip(matrix.row(row)).enumerate() {
            let seen = n.dot(l) > 0.0 && occluded[j / 64] >> (j % 64) & 1 == 0;
            assert_eq!(matrix.is_visible(row, j), seen, "row {row}, direction {j}");
            assert_eq!(entry, if seen { n.dot(l) } else { 0.0 });
            visible += u64::from(seen);
        }
    }
    assert_eq!(matrix.visible_count(), visible);
}

#[test]
fn finer_spheres_add_columns_and_threads_do_not_matter() {
    let scene = ball(1.0, 20).and(ground(6.0, 12).moved(Vec3::Y * -1.0));
    let rays = TriangleScene::build(&scene.positions, &scene.triangles, &BuildParams::default()).unwrap();
    let (coarse, fine) = (LightSphere::new(2), LightSphere::new(3));
    let ask = |directions: &[Vec3]| rays.visibility(&scene.positions, &scene.normals, directions, OFFSET_M);
    let mut grown = ask(coarse.directions());
    grown.append(&ask(&fine.directions()[fine.added()])).unwrap();
    assert_eq!(grown, ask(fine.directions()));
    let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    assert_eq!(alone.install(|| ask(fine.directions())), grown);
    let mut other = VisibilityMatrix::new(vec![0], &[Vec3::Y], coarse.directions());
    assert!(other.append(&grown).is_err());
}

#[test]
fn hostile_meshes_give_finite_numbers() {
    for hostile in heliodon_testkit::hostile::meshes() {
        let Scene { positions, normals, triangles } = &hostile.scene;
        let rays = TriangleScene::build(positions, triangles, &BuildParams::default()).unwrap();
        let sphere = LightSphere::new(1);
        let matrix = rays.visibility(positions, normals, sphere.directions(), OFFSET_M);
        assert_eq!(matrix.validate(), Ok(()), "{}", hostile.name);
        let ao = matrix.ambient_occlusion(sphere.weights());
        assert!(ao.iter().all(|ao| (0.0..=1.0).contains(ao)), "{}: {ao:?}", hostile.name);
        let bent = matrix.light(sphere.weights(), sphere.directions()).light;
        assert!(bent.iter().all(|n| n.is_finite()), "{}", hostile.name);
    }
}
