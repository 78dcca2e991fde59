//! What the tests of the solver share.

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
        }
    }

    /// The vertex nearest to a place among those whose normal is `normal`.
    #[allow(dead_code, reason = "each test program uses its part of this module")]
    pub fn vertex(&self, place: Vec3, normal: Vec3) -> usize {
        (0..self.scene.positions.len())
            .filter(|&v| self.scene.normals[v].dot(normal) > 0.99)
            .min_by(|&a, &b| {
                let of = |v: usize| self.scene.positions[v].distance_squared(place);
                of(a).total_cmp(&of(b))
            })
            .unwrap()
    }
}

/// Parameters that suit small scenes of about a metre.
#[allow(dead_code, reason = "each test program uses its part of this module")]
pub fn params(samples: u32, bounces: u32) -> LightParams {
    LightParams { samples, bounces, offset_m: 1e-4, ..LightParams::default() }
}

/// Five times what a lattice of `samples` directions above a point is off by at most in practice for a view cut by a few
/// edges: its discrepancy falls with the power -3/4 (Brauchart, Saff, Sloan, Womersley: "QMC Designs", Math. Comp. 83, 2014).
#[allow(dead_code, reason = "each test program uses its part of this module")]
pub fn lattice_tolerance(samples: u32) -> f32 {
    1.0 / (samples as f32).powf(0.75)
}
