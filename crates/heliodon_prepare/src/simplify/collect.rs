//! From faces of the original's vertices to a mesh of its own.

use super::tile::Face;
use super::{Simplified, SimplifyReport};
use heliodon_mesh::Mesh;

/// Vertices come in the order in which faces use them; unused ones are left behind.
pub(super) fn collect(mesh: &Mesh, faces: &[Face], report: SimplifyReport) -> Simplified {
    let has_materials = !mesh.triangle_material.is_empty();
    let materials = if has_materials { faces.iter().map(|face| face.material).collect() } else { Vec::new() };
    let (simplified, original_vertex) = mesh.with_corners(faces.iter().map(|face| face.corners), materials);
    let vertices_before = mesh.positions.len();
    let report = SimplifyReport { vertices_before, vertices_after: original_vertex.len(), ..report };
    Simplified { mesh: simplified, original_vertex, report }
}
