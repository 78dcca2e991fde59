//! From faces of the original's vertices to a mesh of its own.

use super::tile::Face;
use super::{Simplified, SimplifyReport};
use heliodon_mesh::Mesh;

/// Vertices come in the order in which faces use them; unused ones are left behind.
pub(super) fn collect(mesh: &Mesh, faces: &[Face], report: SimplifyReport) -> Simplified {
    const UNUSED: u32 = u32::MAX;
    let mut place = vec![UNUSED; mesh.positions.len()];
    let mut original_vertex = Vec::new();
    let mut triangles = Vec::with_capacity(faces.len());
    for face in faces {
        triangles.push(face.corners.map(|vertex| {
            let place = &mut place[vertex as usize];
            if *place == UNUSED {
                *place = original_vertex.len() as u32;
                original_vertex.push(vertex);
            }
            *place
        }));
    }
    let has_materials = !mesh.triangle_material.is_empty();
    let simplified = Mesh {
        positions: pick(&mesh.positions, &original_vertex),
        normals: pick(&mesh.normals, &original_vertex),
        uvs: pick(&mesh.uvs, &original_vertex),
        colors_linear: pick(&mesh.colors_linear, &original_vertex),
        triangles,
        triangle_material: if has_materials { faces.iter().map(|face| face.material).collect() } else { Vec::new() },
        materials: mesh.materials.clone(),
    };
    let vertices_before = mesh.positions.len();
    let report = SimplifyReport { vertices_before, vertices_after: original_vertex.len(), ..report };
    Simplified { mesh: simplified, original_vertex, report }
}

fn pick<T: Copy>(all: &[T], which: &[u32]) -> Vec<T> {
    if all.is_empty() { Vec::new() } else { which.iter().map(|&vertex| all[vertex as usize]).collect() }
}
