//! A vertex with all that it has, and the one between two.

use glam::{Vec2, Vec3};
use heliodon_mesh::Mesh;

/// A vertex with all that it has; zero for what its mesh lacks.
#[derive(Clone, Copy, Default)]
pub(super) struct Vertex {
    pub position: Vec3,
    normal: Vec3,
    uv: Vec2,
    color_linear: Vec3,
}

impl Vertex {
    pub fn of(mesh: &Mesh, vertex: usize) -> Self {
        Self {
            position: mesh.positions[vertex],
            normal: mesh.normals.get(vertex).copied().unwrap_or_default(),
            uv: mesh.uvs.get(vertex).copied().unwrap_or_default(),
            color_linear: mesh.colors_linear.get(vertex).copied().unwrap_or_default(),
        }
    }

    /// The one between; see `too_long` for its position. Of opposite normals the first one's is taken.
    pub fn middle(&self, other: &Self) -> Self {
        Self {
            position: (self.position + other.position) * 0.5 + Vec3::ZERO,
            normal: (self.normal + other.normal).try_normalize().unwrap_or(self.normal),
            uv: (self.uv + other.uv) * 0.5,
            color_linear: (self.color_linear + other.color_linear) * 0.5,
        }
    }

    /// Appends it to a mesh, with what the mesh has; answers its index.
    pub fn push(&self, mesh: &mut Mesh) -> u32 {
        let index = mesh.positions.len();
        mesh.positions.push(self.position);
        if mesh.normals.len() == index {
            mesh.normals.push(self.normal);
        }
        if mesh.uvs.len() == index {
            mesh.uvs.push(self.uv);
        }
        if mesh.colors_linear.len() == index {
            mesh.colors_linear.push(self.color_linear);
        }
        index as u32
    }
}
