//! Meshes that move.

use heliodon_mesh::export::glb;
use heliodon_mesh::export::scene::Scene;
use heliodon_mesh::figures;
use heliodon_mesh::import::{Format, ImportOptions, ImportReport};
use heliodon_mesh::motion::{MovingMesh, from_bytes};
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
