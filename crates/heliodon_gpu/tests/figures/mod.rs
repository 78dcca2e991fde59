//! Meshes that move.

use heliodon_mesh::export::scene::Scene;
use heliodon_mesh::export::{glb, write_pc2, write_ply};
use heliodon_mesh::figures;
use heliodon_mesh::import::{Format, ImportOptions, ImportReport};
use heliodon_mesh::motion::pc2::PointCache;
use heliodon_mesh::motion::{MovingMesh, from_bytes, read_cached};
use std::path::Path;

/// A binary glTF file.
pub fn read(bytes: &[u8]) -> MovingMesh {
    let (options, mut report) = (ImportOptions::default(), ImportReport::default());
    from_bytes(bytes, Format::Gltf, Path::new("figure.glb"), &options, &mut report).unwrap()
}

pub fn of(scene: &Scene) -> MovingMesh {
    let mut bytes = Vec::new();
    glb(&mut bytes, scene).unwrap();
    read(&bytes)
}

/// A skeleton that walks.
pub fn walker() -> MovingMesh {
    of(&figures::walker())
}

/// A curtain with a cache.
#[allow(dead_code, reason = "not every test needs it")]
pub fn cloth() -> MovingMesh {
    let made = figures::cloth();
    let folder = tempfile::tempdir().unwrap();
    let (mesh, cache) = (folder.path().join("cloth.ply"), folder.path().join("cloth.pc2"));
    write_ply(&mesh, &made.mesh, None).unwrap();
    write_pc2(&cache, &PointCache::of_frames(&made.frames)).unwrap();
    read_cached(&mesh, &cache, &ImportOptions::default(), &mut ImportReport::default()).unwrap()
}
