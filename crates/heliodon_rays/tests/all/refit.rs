//! Scenes that move answer as scenes built anew, and rows and columns that come later are those that come at once.

use crate::common::sheet;
use glam::{Quat, Vec3};
use heliodon_math::light_sphere::LightSphere;
use heliodon_math::visibility::VisibilityBackend;
use heliodon_rays::{BuildParams, TriangleScene, VisibilityCpu};
use heliodon_testkit::scenes::{Scene, ball, ground};

/// A ball that stretches, bends and flies over a ground which stays.
fn pose(rest: &Scene, time: f32) -> Vec<Vec3> {
    let bent = |p: Vec3| {
        let turn = Quat::from_rotation_z(time * p.y) * Quat::from_rotation_y(2.0 * time);
        turn * (p * Vec3::new(1.0, 1.0 + 0.5 * time, 1.0)) + Vec3::new(time, 0.3 * time, 0.0)
    };
    rest.positions.iter().map(|&p| if p.length() < 1.5 { bent(p) } else { p }).collect()
}

fn bits(scene: &TriangleScene, origins: &[Vec3], direction: Vec3) -> Vec<u64> {
    let active = vec![u64::MAX; origins.len().div_ceil(64)];
    let mut occluded = active.clone();
    scene.occluded_parallel(origins, direction, &active, &mut occluded);
    occluded
}

#[test]
fn moved_scenes_answer_as_new_ones() {
    let rest = ball(1.0, 24).and(ground(6.0, 20).moved(Vec3::Y * -1.6));
    let params = BuildParams::default();
    let mut moved = TriangleScene::build(&rest.positions, &rest.triangles, &params).unwrap();
    // far beyond what the hierarchy's shape is good for at the end
    for step in 0..12 {
        let mut positions = pose(&rest, 0.3 * step as f32);
        if step == 5 {
            positions[7] = Vec3::NAN;
        }
        moved.refit(&positions, &rest.triangles, &params).unwrap();
        let built = TriangleScene::build(&positions, &rest.triangles, &params).unwrap();
        assert_eq!(moved.bounds(), built.bounds());
        let origins: Vec<Vec3> = positions.iter().map(|&p| p * 1.01 + Vec3::Y * 0.01).collect();
        for &direction in LightSphere::new(1).directions() {
            assert_eq!(
                bits(&moved, &origins, direction),
                bits(&built, &origins, direction),
                "step {step}, towards {direction}"
            );
        }
    }
}

#[test]
fn triangles_that_gain_extent_are_met() {
    let flat = [Vec3::ZERO, Vec3::ZERO, Vec3::Z, Vec3::new(5.0, 0.0, 0.0), Vec3::new(6.0, 0.0, 0.0), Vec3::new(5.0, 0.0, 1.0)];
    let triangles = [[0, 1, 2], [3, 4, 5]];
    let params = BuildParams::default();
    let mut scene = TriangleScene::build(&flat, &triangles, &params).unwrap();
    let below = [Vec3::new(0.25, -1.0, 0.25), Vec3::new(5.25, -1.0, 0.25)];
    assert_eq!(bits(&scene, &below, Vec3::Y), [0b10]);
    let mut open = flat;
    open[1] = Vec3::X;
    scene.refit(&open, &triangles, &params).unwrap();
    assert_eq!(bits(&scene, &below, Vec3::Y), [0b11]);
    scene.refit(&flat, &triangles, &params).unwrap();
    assert_eq!(bits(&scene, &below, Vec3::Y), [0b10]);
    // all gone, and back
    scene.refit(&[Vec3::ZERO; 6], &triangles, &params).unwrap();
    assert_eq!(bits(&scene, &below, Vec3::Y), [0]);
    scene.refit(&open, &triangles, &params).unwrap();
    assert_eq!(bits(&scene, &below, Vec3::Y), [0b11]);
    assert!(scene.refit(&open[..5], &triangles, &params).is_err(), "a vertex that is not there");
}

#[test]
fn rows_and_columns_that_come_later_are_those_that_come_at_once() {
    let (positions, triangles) = sheet(30, 7);
    let normals: Vec<Vec3> = positions.iter().map(|p| Vec3::new(0.3 * p.x, 1.0, 0.3 * p.z)).collect();
    let (coarse, fine) = (LightSphere::new(2), LightSphere::new(3));
    let mut backend = VisibilityCpu::default();
    backend.set_mesh(&positions, &normals, &triangles).unwrap();
    backend.compute(fine.directions()).unwrap();
    let weights = fine.weights();
    let dark = vec![Vec3::ONE; weights.len()];
    let (all, whole) = (backend.light(weights, &dark).unwrap(), backend.matrix().unwrap());

    backend.move_vertices(&positions, &normals).unwrap();
    assert!(backend.matrix().is_err(), "what moves loses its matrix");
    // a third, another, all of them; then finer
    let third = |k: usize| -> Vec<bool> { (0..positions.len()).map(|i| i / 37 % 3 == k).collect() };
    for (wanted, rows) in [(third(1), 0..0), (third(2), 0..0), (vec![true; positions.len()], 0..positions.len())] {
        backend.compute_for(&wanted, coarse.directions()).unwrap();
        let matrix = backend.matrix().unwrap();
        assert_eq!(matrix.validate(), Ok(()));
        assert!(rows.is_empty() || matrix.order().len() == rows.len());
        let light = backend.light(coarse.weights(), &vec![Vec3::ONE; coarse.weights().len()]).unwrap();
        assert!(wanted.iter().zip(&light.open).all(|(&wanted, &open)| !wanted || open > 0.0));
    }
    backend.compute_for(&vec![false; positions.len()], fine.directions()).unwrap();
    assert_eq!(backend.matrix().unwrap().visible_count(), whole.visible_count());
    assert_eq!(backend.light(weights, &dark).unwrap(), all);
    // points without a row are dark
    backend.move_vertices(&positions, &normals).unwrap();
    backend.compute_for(&third(0), fine.directions()).unwrap();
    let some = backend.light(weights, &dark).unwrap();
    for (i, wanted) in third(0).into_iter().enumerate() {
        let expected = if wanted { (all.light[i], all.ambient_occlusion[i]) } else { (Vec3::ZERO, 0.0) };
        assert_eq!((some.light[i], some.ambient_occlusion[i]), expected);
    }
    assert!(backend.compute_for(&[true], fine.directions()).is_err());
}
