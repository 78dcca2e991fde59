//! An illumination and a surface model that this crate does not know, added from outside: `cargo run -p heliodon_lightmap --example own_model -- [OUT.png]`.
//!
//! The illumination is a candle-lit evening: what a ray escapes to glows warm at the horizon and blue above, and light that is reflected from far away is lost in smoke. The
//! surface is that of velvet, which shines at grazing light. They light a ball on a floor; the light map is written as a picture, and its mean printed.

use glam::Vec3;
use heliodon_image::SrgbImage;
use heliodon_lightmap::packing::PackParams;
use heliodon_lightmap::refine::Place;
use heliodon_lightmap::solve::models::{Illumination, SurfaceModel};
use heliodon_lightmap::solve::{Models, Scene, SolveParams, solve};
use heliodon_lightmap::texels::texels;
use heliodon_lightmap::unwrap::{UnwrapParams, unwrap};
use heliodon_math::color::srgb8_from_linear;
use heliodon_math::dome::{ConstantSky, Environment};
use heliodon_rays::{BuildParams, TriangleScene};
use heliodon_testkit::scenes::{ball, ground};
use std::error::Error;

/// The light of an evening in a smoky hall.
struct Evening {
    /// Metres after which half of what is reflected is lost.
    smoke_m: f32,
}

impl Illumination for Evening {
    fn name(&self) -> &str {
        "evening"
    }

    fn escaped(&self, _sky: &dyn Environment, direction: Vec3) -> Vec3 {
        Vec3::new(1.0, 0.55, 0.25).lerp(Vec3::new(0.1, 0.15, 0.4), direction.y.max(0.0).sqrt())
    }

    fn is_sky_seen(&self) -> bool {
        false
    }

    fn reflected(&self, radiance: Vec3, distance_m: f32) -> Vec3 {
        radiance * (-distance_m / self.smoke_m).exp2()
    }
}

/// Cloth that is bright where light grazes it.
struct Velvet;

impl SurfaceModel for Velvet {
    fn name(&self) -> &str {
        "velvet"
    }

    fn response(&self, cosine: f32) -> f32 {
        (1.0 - cosine * cosine).max(0.0).sqrt() * cosine.sqrt()
    }

    fn is_lambertian(&self) -> bool {
        false
    }

    fn shown(&self, light: Vec3, place: &Place, _bright: f32) -> Vec3 {
        // what faces down is worn
        light * if place.normal.y < -0.5 { 0.5 } else { 1.0 }
    }
}

#[expect(clippy::print_stdout, reason = "a program for people")]
fn main() -> Result<(), Box<dyn Error>> {
    let model = ground(4.0, 8).and(ball(0.6, 32).moved(Vec3::Y * 0.6));
    let pack = PackParams { width: 256, height: 256, ..PackParams::default() };
    let unwrapped = unwrap(&model.positions, &model.triangles, &[], &UnwrapParams { pack, ..UnwrapParams::default() })?;
    let texels = texels(&unwrapped, 256, 256);
    let rays = TriangleScene::build(&model.positions, &model.triangles, &BuildParams::default())?;
    let scene = Scene {
        rays: &rays,
        positions: &model.positions,
        normals: &model.normals,
        triangles: &model.triangles,
        unwrapped: &unwrapped,
        texels: &texels,
        sides: [256; 2],
        albedo: &|_, _, _| Vec3::splat(0.6),
        lights: &[],
        sky: &ConstantSky(Vec3::ZERO),
    };
    let models = Models { illumination: &Evening { smoke_m: 1.0 }, surface: &Velvet };
    let map = solve(&scene, &models, &SolveParams::default())?;
    map.validate()?;
    println!(
        "{} on {}: mean light {:?}, {} of {} texels sampled",
        map.notes.illumination, map.notes.surface, map.notes.mean, map.notes.sampled[0], map.notes.texels
    );
    if let Some(file) = std::env::args().nth(1) {
        let image = map.image(&texels, 0, [256; 2]);
        let encode = |p: &Vec3| [srgb8_from_linear(p.x), srgb8_from_linear(p.y), srgb8_from_linear(p.z), 255];
        SrgbImage { width: 256, height: 256, pixels: image.pixels.iter().map(encode).collect() }.write_png(file)?;
    }
    Ok(())
}
