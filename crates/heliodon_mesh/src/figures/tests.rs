//! What all figures keep.

use super::shape::is_closed;
use crate::export::scene::{Scene, Track};
use crate::import::{ImportOptions, read};
use crate::motion::pc2::{self, PointCache};
use crate::{Mesh, export, weld};
use glam::Vec3;

pub fn glb_bytes(scene: &Scene) -> Vec<u8> {
    let mut bytes = Vec::new();
    export::glb(&mut bytes, scene).unwrap();
    bytes
}

/// Every edge has a triangle on either side, vertices at one position taken as one.
pub fn assert_closed(name: &str, mesh: &Mesh) {
    let first = weld::first_of_position(&mesh.positions);
    let welded: Vec<[u32; 3]> = mesh.triangles.iter().map(|t| t.map(|i| first[i as usize])).collect();
    assert!(is_closed(&welded), "{name}");
}

/// The last key of every channel is its first.
pub fn assert_loops(scene: &Scene) {
    for clip in &scene.clips {
        let ends: Vec<f32> = clip.channels.iter().filter_map(|c| c.times_s.last().copied()).collect();
        assert!(ends.iter().all(|end| *end == ends[0]), "{}", clip.name);
        for channel in &clip.channels {
            let each = match &channel.track {
                Track::Translation(keys) | Track::Scale(keys) => keys.len() / channel.times_s.len(),
                Track::Rotation(keys) => keys.len() / channel.times_s.len(),
                Track::Weights(_) => 1,
            };
            let same = match &channel.track {
                Track::Translation(keys) | Track::Scale(keys) => keys[..each] == keys[keys.len() - each..],
                Track::Rotation(keys) => keys[..each] == keys[keys.len() - each..],
                Track::Weights(keys) => keys.first() == keys.last(),
            };
            assert!(same, "{}: node {}", clip.name, channel.node);
        }
    }
}

#[test]
fn figures_have_the_same_bits_for_any_number_of_threads() {
    let make = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let cloth = super::cloth();
            let mut bytes = glb_bytes(&super::walker());
            bytes.extend(glb_bytes(&super::stoneyard()));
            export::ply(&mut bytes, &cloth.mesh, None).unwrap();
            pc2::write(&mut bytes, &PointCache::of_frames(&cloth.frames)).unwrap();
            bytes
        })
    };
    let once = make(1);
    assert!(once == make(2) && once == make(1));
}

#[test]
fn files_of_figures_are_read_as_they_stand() {
    let folder = tempfile::tempdir().unwrap();
    for (name, scene, vertices) in
        [("walker.glb", super::walker(), 8325.0_f32), ("stoneyard.glb", super::stoneyard(), 26_000.0)]
    {
        let path = folder.path().join(name);
        export::write_glb(&path, &scene).unwrap();
        let mesh = read(&path, &ImportOptions::default()).unwrap();
        mesh.validate().unwrap();
        let written: usize = scene.meshes.iter().map(|part| part.mesh.positions.len()).sum();
        assert_eq!(mesh.positions.len(), written);
        assert!((written as f32 / vertices - 1.0).abs() < if name == "walker.glb" { 0.02 } else { 0.2 }, "{name}: {written}");
        assert!(mesh.colors_linear.iter().all(|c| c.min_element() > 0.02 && c.max_element() < 0.95), "{name}");
    }
    // a capital stands on its table, and the block hangs where its rope ends
    let mesh = read(&folder.path().join("stoneyard.glb"), &ImportOptions::default()).unwrap();
    let (low, high) = mesh.bounds().unwrap();
    assert!(low.abs_diff_eq(Vec3::new(-2.6, 0.0, -2.15), 1e-3) && high.y < 3.1, "{low} {high}");
}

#[test]
fn a_point_cache_is_as_its_readers_want_it() {
    let frames = vec![vec![Vec3::X, Vec3::Y], vec![Vec3::Z, Vec3::ONE]];
    let mut bytes = Vec::new();
    pc2::write(&mut bytes, &PointCache::of_frames(&frames)).unwrap();
    assert_eq!(&bytes[..12], b"POINTCACHE2\0");
    let word = |i: usize| i32::from_le_bytes(bytes[12 + 4 * i..16 + 4 * i].try_into().unwrap());
    assert_eq!([word(0), word(1), word(2), word(3), word(4)], [1, 2, 0, 1.0_f32.to_bits() as i32, 2]);
    assert_eq!(bytes.len(), 32 + 4 * 12);
    assert_eq!(word(5), 1.0_f32.to_bits() as i32);
    for unlike in [vec![], vec![vec![]], vec![vec![Vec3::X], vec![]]] {
        assert!(pc2::write(&mut Vec::new(), &PointCache::of_frames(&unlike)).is_err());
    }
}
