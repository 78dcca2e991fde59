//! Meshes with a vertex cache.

use crate::near;
use glam::Vec3;
use heliodon_mesh::import::{ImportError, ImportOptions, ImportReport};
use heliodon_mesh::motion::pc2::{self, PointCache};
use heliodon_mesh::motion::{MovingMesh, Pose, read_cached};
use heliodon_mesh::place::{Placement, Unit, Up};
use std::path::Path;

/// A square of two triangles with a seam along the diagonal.
const SQUARE: &str =
    "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvt .5 .5\nf 1/1 2/2 3/3\nf 1/5 3/5 4/4\n";

/// It, shifted along +Z by 4, and folded about the diagonal.
fn samples() -> Vec<Vec3> {
    let square = [Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y];
    let shifted = square.map(|p| p + Vec3::Z * 4.0);
    let mut folded = shifted;
    folded[1].z += 1.0;
    folded[3].z += 1.0;
    [square, shifted, folded].concat()
}

fn cache() -> PointCache {
    PointCache { points: 4, start_frame: 10.0, frames_per_sample: 5.0, positions: samples() }
}

fn bytes(cache: &PointCache) -> Vec<u8> {
    let mut bytes = Vec::new();
    pc2::write(&mut bytes, cache).unwrap();
    bytes
}

fn read_with(mesh: &str, cache: &[u8], options: &ImportOptions) -> Result<(MovingMesh, ImportReport), ImportError> {
    let folder = tempfile::tempdir().unwrap();
    let (mesh_path, cache_path) = (folder.path().join("a.obj"), folder.path().join("a.pc2"));
    std::fs::write(&mesh_path, mesh).unwrap();
    std::fs::write(&cache_path, cache).unwrap();
    let mut report = ImportReport::default();
    let moving = read_cached(&mesh_path, &cache_path, options, &mut report)?;
    moving.validate().unwrap();
    Ok((moving, report))
}

#[test]
fn a_cache_comes_back_as_it_was_written() {
    let bytes = bytes(&cache());
    assert_eq!(bytes.len(), 32 + 12 * 12);
    assert_eq!(&bytes[..16], b"POINTCACHE2\0\x01\0\0\0");
    assert_eq!(pc2::from_bytes(&bytes, Path::new("a.pc2")).unwrap(), cache());
    let empty = PointCache { positions: Vec::new(), ..cache() };
    assert!(pc2::write(&mut Vec::new(), &empty).is_err());
}

#[test]
fn vertices_go_straight_from_sample_to_sample() {
    let (mut moving, report) = read_with(SQUARE, &bytes(&cache()), &ImportOptions::default()).unwrap();
    assert!(report.warnings.is_empty());
    assert_eq!((moving.clips()[0].name.as_str(), moving.clips()[0].duration_s), ("cache", 0.4));
    assert_eq!(moving.rest().positions.len(), 6);
    assert!(!moving.rigid(0));
    let mut pose = Pose::default();
    moving.pose(0, 0.05, &mut pose);
    near(&pose.positions[..2], &[Vec3::Z, Vec3::new(1.0, 0.0, 1.0)]);
    near(&pose.normals, &[Vec3::Z; 6]);
    // appended vertices move with theirs, and the seam stays smooth though the square folds
    moving.pose(0, 9.0, &mut pose);
    for (own, appended) in [(0, 4), (2, 5)] {
        assert_eq!(pose.positions[own], pose.positions[appended]);
        assert_eq!(pose.normals[own], pose.normals[appended]);
    }
    near(&pose.normals[..1], &[Vec3::Z]);
    near(&pose.normals[1..2], &[Vec3::new(-1.0, 1.0, 1.0) / 3_f32.sqrt()]);
    let before = pose.positions.as_ptr();
    moving.pose(0, 0.0, &mut pose);
    assert_eq!(before, pose.positions.as_ptr(), "nothing is allocated again");
    near(&pose.positions, &moving.rest().positions);
    moving.set_cache_frames_per_s(50.0);
    assert_eq!(moving.clips()[0].duration_s, 0.2);
    moving.set_cache_frames_per_s(f32::NAN);
    assert_eq!(moving.clips()[0].duration_s, 0.2);
}

#[test]
fn caches_are_placed_as_their_mesh_is() {
    let placement = Placement {
        unit: Unit::Centimetre,
        up: Up::Z,
        scale: [-1.0, 1.0, 1.0],
        translate: [1.0, 0.0, 0.0],
        ..Placement::default()
    };
    let (moving, _) = read_with(SQUARE, &bytes(&cache()), &ImportOptions { placement, ..ImportOptions::default() }).unwrap();
    let mut pose = Pose::default();
    moving.pose(0, 0.0, &mut pose);
    near(&pose.positions, &moving.rest().positions);
    near(&pose.normals, &moving.rest().normals);
    moving.pose(0, 0.2, &mut pose);
    let affine = placement.affine().unwrap();
    near(&pose.positions[1..2], &[affine.position(glam::DVec3::new(1.0, 0.0, 4.0)).as_vec3()]);
}

#[test]
fn what_is_not_finite_stays_at_rest() {
    let mut cache = cache();
    cache.positions[5] = Vec3::NAN;
    let (moving, report) = read_with(SQUARE, &bytes(&cache), &ImportOptions::default()).unwrap();
    assert!(report.warnings[0].contains("1 positions are NaN"), "{report:?}");
    let mut pose = Pose::default();
    moving.pose(0, 0.2, &mut pose);
    near(&pose.positions[..2], &[Vec3::Z * 4.0, Vec3::X]);
}

#[test]
fn broken_caches_are_refused() {
    let good = bytes(&cache());
    let changed = |at: usize, value: [u8; 4]| {
        let mut bytes = good.clone();
        bytes[at..at + 4].copy_from_slice(&value);
        bytes
    };
    for (bytes, told) in [
        (good[..20].to_vec(), "the file ends after 20 bytes"),
        (b"POINTCACHE3\0".to_vec(), "is no PointCache2 file"),
        (changed(12, 2_i32.to_le_bytes()), "is of version 2"),
        (changed(16, 5_i32.to_le_bytes()), "promises 3 samples of 5 points, but its 176 bytes hold 2 whole samples"),
        (changed(16, 3_i32.to_le_bytes()), "has 3 points, but the mesh has 4 vertices"),
        (changed(16, (-1_i32).to_le_bytes()), "promises 3 samples of -1 points"),
        (changed(16, i32::MAX.to_le_bytes()), "promises 3 samples of 2147483647 points"),
        (changed(28, i32::MAX.to_le_bytes()), "promises 2147483647 samples of 4 points"),
        (changed(28, 0_i32.to_le_bytes()), "has 0 samples of 4 points"),
        (changed(24, 0_f32.to_le_bytes()), "has a sample rate of 0 frames"),
        (changed(24, f32::NAN.to_le_bytes()), "has a sample rate of NaN frames"),
        (good[..good.len() - 1].to_vec(), "hold 2 whole samples"),
    ] {
        let error = read_with(SQUARE, &bytes, &ImportOptions::default()).unwrap_err().to_string();
        assert!(error.contains(told), "{told}: {error}");
    }
    let stl = Path::new("nowhere.stl");
    assert!(read_cached(stl, stl, &ImportOptions::default(), &mut ImportReport::default()).is_err());
}
