//! What the tests of the solver share.

#![expect(clippy::unwrap_used, reason = "helpers of tests")]

use glam::Vec3;
use heliodon_light::{ConstantAlbedo, LightParams, Surfaces};
use heliodon_rays::{BuildParams, TriangleScene};
use heliodon_testkit::scenes::Scene;

/// `S` of a uniform sky of radiance 1: its constant coefficient.
pub const UNIFORM_SKY: f32 = 3.544_907_7;

/// A scene with the structure that answers rays in it.
pub struct Lit {
    pub scene: Scene,
    pub rays: TriangleScene,
    pub albedo: ConstantAlbedo,
}

impl Lit {
    pub fn new(scene: Scene, albedo: f32) -> Self {
        let rays = TriangleScene::build(&scene.positions, &scene.triangles, &BuildParams::default()).unwrap();
        Self { scene, rays, albedo: ConstantAlbedo(Vec3::splat(albedo)) }
    }

    pub fn surfaces(&self) -> Surfaces<'_> {
        Surfaces {
            rays: &self.rays,
            positions: &self.scene.positions,
            normals: &self.scene.normals,
            triangles: &self.scene.triangles,
            albedo: &self.albedo,
            detail: None,
        }
    }
}

/// Parameters that suit small scenes of about a metre.
pub fn params(samples: u32, bounces: u32) -> LightParams {
    LightParams { samples, bounces, offset_m: 1e-4, ..LightParams::default() }
}
