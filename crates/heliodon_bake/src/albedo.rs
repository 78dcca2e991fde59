//! The scene's albedo as the solver asks for it.

use glam::Vec3;
use heliodon_light::SurfaceAlbedo;
use heliodon_mesh::Mesh;
use heliodon_mesh::albedo::MeshAlbedo;

/// The albedo of a mesh: its colours, materials and textures.
pub struct SceneAlbedo<'a>(MeshAlbedo<'a>);

impl<'a> SceneAlbedo<'a> {
    /// Of `mesh`; textures are averaged over patches of `footprint_m`, 0 for as sharp as they are.
    #[must_use]
    pub fn new(mesh: &'a Mesh, footprint_m: f32) -> Self {
        Self(MeshAlbedo::new(mesh, Mesh::UNSAID_ALBEDO, footprint_m))
    }

    /// The albedo of each vertex.
    #[must_use]
    pub fn vertices(&self) -> Vec<Vec3> {
        self.0.vertices()
    }
}

impl SurfaceAlbedo for SceneAlbedo<'_> {
    fn albedo(&self, triangle: u32, u: f32, v: f32) -> Vec3 {
        self.0.albedo(triangle, u, v)
    }

    fn mean(&self, triangle: u32) -> Vec3 {
        self.0.mean(triangle)
    }
}
