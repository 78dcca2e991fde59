//! What splitting promises.

use super::edges::edge;
use super::*;
use crate::shapes::{cube, joined, moebius};
use heliodon_mesh::topology::{Edges, places};
use heliodon_testkit::hostile;
use proptest::prelude::*;
use std::collections::BTreeSet;

/// Finer around a place.
fn near_corner(p: Vec3, _along: Vec3) -> f32 {
    0.02 + 0.1 * p.distance(Vec3::new(0.9, 1.1, 0.8))
}

/// By position: edges of one triangle, and of more than two.
fn faults(mesh: &Mesh) -> (usize, usize) {
    let (mut open, mut many) = (0, 0);
    let edges = Edges::new(&mesh.triangles, &places(&mesh.positions, 0.0), |_| true);
    edges.for_each(|_, sides| match sides.len() {
        1 => open += 1,
        2 => {}
        _ => many += 1,
    });
    (open, many)
}

fn longest_excess(mesh: &Mesh, longest_m: impl Fn(Vec3, Vec3) -> f32) -> f32 {
    let excess = |t: usize| {
        let corners = mesh.corners(t);
        (0..3)
            .map(|k| (corners[k], corners[(k + 1) % 3]))
            .map(|(a, b)| a.distance(b) / longest_m((a + b) * 0.5, b - a))
            .fold(0.0, f32::max)
    };
    (0..mesh.triangles.len()).map(excess).fold(0.0, f32::max)
}

#[test]
fn what_is_closed_stays_closed_and_no_edge_is_too_long() {
    // every face with vertices of its own, as texture atlases have
    let shared = cube(Vec3::ZERO, Vec3::ONE);
    let mut mesh = Mesh {
        positions: shared.triangles.as_flattened().iter().map(|&v| shared.positions[v as usize]).collect(),
        triangles: (0..12).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect(),
        triangle_material: (0..12).collect(),
        ..Mesh::default()
    };
    mesh.materials = vec![heliodon_mesh::Material { name: String::new(), base_color_linear: Vec3::ONE, texture: None }; 12];
    heliodon_mesh::normals::split_creases(&mut mesh, 1.0);
    let report = split(&mut mesh, near_corner, 1_000_000).unwrap();
    mesh.validate().unwrap();
    assert_eq!(faults(&mesh), (0, 0));
    assert!(longest_excess(&mesh, near_corner) <= 1.0);
    assert!((mesh.surface_area() - 6.0).abs() < 1e-5);
    assert_eq!((report.split_triangles, report.triangles_after), (12, mesh.triangles.len() as u64));
    assert!(report.triangles_after > 3000);
    // pieces stand where their triangle stood, with its material and normal
    assert!(mesh.triangle_material.is_sorted());
    for t in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.corners(t);
        let n = (b - a).cross(c - a).try_normalize().unwrap();
        assert!(mesh.triangles[t].iter().all(|&v| mesh.normals[v as usize].distance(n) < 1e-4));
    }
}

#[test]
fn shared_vertices_stay_shared() {
    let mut mesh = cube(Vec3::ZERO, Vec3::ONE);
    split(&mut mesh, |_, _| 0.26, 1_000_000).unwrap();
    let edges: BTreeSet<u64> = mesh.triangles.iter().flat_map(|t| (0..3).map(|k| edge(t[k], t[(k + 1) % 3]))).collect();
    // Euler: a closed surface of genus 0 over its indices
    assert_eq!(mesh.positions.len() as i64 - edges.len() as i64 + mesh.triangles.len() as i64, 2);
    assert_eq!(mesh.triangles.len(), 12 * 32, "sides of 1 are halved twice, diagonals of 1.41 three times");
}

#[test]
fn meshes_split_apart_fit_to_the_bit() {
    // two halves of a wall with a crooked seam between them, the other half's triangles run the other way round and elsewhere
    let seam = [Vec3::new(0.13, 0.0, 0.7), Vec3::new(0.21, 1.37, 0.33), Vec3::new(-0.4, 3.1, 0.2)];
    let left = Vec3::new(-2.0, 1.0, 0.1);
    let right = Vec3::new(3.3, 2.0, -0.4);
    let mut a =
        Mesh { positions: vec![seam[0], seam[1], seam[2], left], triangles: vec![[0, 1, 3], [1, 2, 3]], ..Mesh::default() };
    let mut b =
        Mesh { positions: vec![right, seam[2], seam[0], seam[1]], triangles: vec![[0, 3, 2], [1, 3, 0]], ..Mesh::default() };
    for mesh in [&mut a, &mut b] {
        split(mesh, near_corner, 1_000_000).unwrap();
    }
    let both = joined(&[a.clone(), b.clone()]);
    let seams = faults(&a).0 + faults(&b).0 - faults(&both).0;
    assert!(seams > 40 && seams.is_multiple_of(2), "{seams}");
    // along the seam no triangle is left alone: an open edge has both ends on it only if it is one of the two rims'
    let between = |p: Vec3| seam.windows(2).any(|s| (p.distance(s[0]) + p.distance(s[1]) - s[0].distance(s[1])).abs() < 1e-6);
    let mut alone = 0;
    let edges = Edges::new(&both.triangles, &places(&both.positions, 0.0), |_| true);
    edges.for_each(|ends, sides| {
        alone += usize::from(sides.len() == 1 && ends.iter().all(|&v| between(both.positions[v as usize])));
    });
    assert_eq!(alone, 0);
}

#[test]
fn slivers_do_not_multiply() {
    // a blunt triangle, 100 to 1: its pieces are no thinner, and fewer than if each were quartered
    let mut mesh = Mesh {
        positions: vec![Vec3::ZERO, Vec3::new(100.0, 0.0, 0.0), Vec3::new(50.0, 1.0, 0.0)],
        triangles: vec![[0, 1, 2]],
        ..Mesh::default()
    };
    split(&mut mesh, |_, _| 1.5, 1_000_000).unwrap();
    let shape = |t: usize| {
        let [a, b, c] = mesh.corners(t);
        let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
        (b - a).cross(c - a).length() / (longest * longest)
    };
    let good = (0..mesh.triangles.len()).filter(|&t| shape(t) > 0.1).count();
    assert!(good * 2 > mesh.triangles.len(), "{good} of {}", mesh.triangles.len());
    assert!(mesh.triangles.len() < 400, "{}", mesh.triangles.len());
}

#[test]
fn too_many_are_refused_and_the_mesh_stays() {
    let mut mesh = cube(Vec3::ZERO, Vec3::ONE);
    heliodon_mesh::normals::compute(&mut mesh);
    let before = mesh.clone();
    let error = split(&mut mesh, |_, _| 0.001, 10_000).unwrap_err();
    assert!(error.to_string().contains("more than 10000 triangles"), "{error}");
    assert_eq!((mesh.positions, mesh.normals, mesh.triangles), (before.positions, before.normals, before.triangles));
    for target in [0.0, -1.0] {
        assert!(split(&mut cube(Vec3::ZERO, Vec3::ONE), |_, _| target, 10_000).is_err());
    }
    for target in [f32::NAN, f32::INFINITY, 2.0] {
        let report = split(&mut cube(Vec3::ZERO, Vec3::ONE), |_, _| target, 10_000);
        assert_eq!(report.map(|r| (r.split_triangles, r.triangles_after)), Ok((0, 12)));
    }
}

#[test]
fn an_edge_that_f32_cannot_halve_ends_it() {
    let far = Vec3::splat(1.0e8);
    let mut mesh = Mesh {
        positions: vec![far, far + Vec3::X * 64.0, far + Vec3::Y * 64.0],
        triangles: vec![[0, 1, 2]],
        ..Mesh::default()
    };
    split(&mut mesh, |_, _| 0.5, 10_000).unwrap();
    assert!((64..=128).contains(&mesh.triangles.len()), "8 metres apart is as fine as f32 is there");
}

#[test]
fn the_hostile_corpus_is_survived() {
    for hostile::Hostile { name, scene } in hostile::meshes() {
        let mut mesh = Mesh { positions: scene.positions, triangles: scene.triangles, ..Mesh::default() };
        let _ = split(&mut mesh, |_, _| 0.1, 100_000);
        assert!(mesh.triangles.iter().flatten().all(|&v| (v as usize) < mesh.positions.len()), "{name}");
    }
}

#[test]
fn threads_do_not_change_anything() {
    let mesh = joined(&[moebius(10), cube(Vec3::ZERO, Vec3::ONE)]);
    let with = |threads| {
        let (pool, mut mesh) = (rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap(), mesh.clone());
        pool.install(|| split(&mut mesh, near_corner, 1_000_000)).unwrap();
        (mesh.positions, mesh.triangles)
    };
    assert_eq!(with(1), with(3));
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(60) })]

    #[test]
    fn any_surface_stays_whole(
        points in prop::collection::vec(prop::array::uniform3(-3.0_f32..3.0), 8),
        target in 0.2_f32..2.0,
    ) {
        // a cube's connections over any eight points
        let mut mesh = cube(Vec3::ZERO, Vec3::ONE);
        mesh.positions = points.into_iter().map(Vec3::from_array).collect();
        let area = mesh.surface_area();
        let longest = |p: Vec3, _: Vec3| target * (0.3 + 0.2 * p.length());
        split(&mut mesh, longest, 1_000_000).unwrap();
        prop_assert_eq!(faults(&mesh).0, 0);
        prop_assert!(longest_excess(&mesh, longest) <= 1.0 + 1e-6);
        prop_assert!((mesh.surface_area() - area).abs() < 1e-4 * area);
    }
}
