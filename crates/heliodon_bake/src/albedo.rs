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
        Self(MeshAlbedo::new(mesh, footprint_m))
    }
}

/// The most that a surface reflects: what reflects all would keep light for ever, and the solver wants less than 1. White
/// paint and fresh snow, the whitest that sites hold, are just below.
const WHITEST: f32 = 0.99;

/// An albedo as the solver takes it: each component in [0, 1), whatever images and files say.
pub(crate) fn solvable(albedo: Vec3) -> Vec3 {
    albedo.clamp(Vec3::ZERO, Vec3::splat(WHITEST))
}

impl SurfaceAlbedo for SceneAlbedo<'_> {
    fn albedo(&self, triangle: u32, u: f32, v: f32) -> Vec3 {
        solvable(self.0.albedo(triangle, u, v))
    }

    fn mean(&self, triangle: u32) -> Vec3 {
        solvable(self.0.mean(triangle))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn white_reflects_less_than_all() {
        let mesh = Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
            triangles: vec![[0, 1, 2]],
            colors_linear: vec![Vec3::ONE; 3],
            ..Mesh::default()
        };
        let albedo = SceneAlbedo::new(&mesh, 0.0);
        assert_eq!((albedo.albedo(0, 0.2, 0.2), albedo.mean(0)), (Vec3::splat(WHITEST), Vec3::splat(WHITEST)));
        assert_eq!(mesh.corner_albedo(0, 0), Vec3::ONE, "what is drawn stays white");
    }
}
