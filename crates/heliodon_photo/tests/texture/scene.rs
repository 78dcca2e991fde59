//! A block and a column on a floor, of procedural colours, photographed by ray casting.

use crate::common::{around, look_at};
use glam::{DMat3, DVec2, DVec3, Vec3};
use heliodon_image::{Picture, SrgbImage, TextureWrap};
use heliodon_math::color::{srgb_from_linear, srgb8_from_linear};
use heliodon_mesh::Mesh;
use heliodon_photo::camera::Camera;
use heliodon_photo::model::table::ShapeRow;
use heliodon_photo::model::{NamedPoint, Part, build};
use heliodon_rays::{BuildParams, Hit, Ray, TriangleScene};
use rayon::prelude::*;

/// The colour of what stands in the way.
pub const MAGENTA: Vec3 = Vec3::new(0.9, 0.02, 0.8);
/// The sky's.
pub const SKY: Vec3 = Vec3::new(0.35, 0.5, 0.8);

#[derive(serde::Deserialize)]
struct Table {
    shape: Vec<ShapeRow>,
}

const SHAPES: &str = r#"
    [[shape]]
    name = "block"
    kind = "box"
    points = ["b0", "b1", "b2", "b3", "b4", "b5", "b6", "b7"]
    [[shape]]
    name = "column"
    kind = "column"
    axis = ["foot", "head"]
    bottom = ["c0", "c1", "c2"]
    top = ["d0", "d1", "d2"]
    sides = 24
    watertight = true
    [[shape]]
    name = "floor"
    kind = "polygon"
    points = ["f0", "f1", "f2", "f3"]
"#;

/// The model, as it comes from exact points.
pub fn model() -> Vec<Part> {
    let mut points: Vec<NamedPoint> = Vec::new();
    let mut add = |name: String, x: f64, y: f64, z: f64| {
        let covariance = DMat3::from_diagonal(DVec3::splat(1e-8));
        points.push(NamedPoint { name, position: DVec3::new(x, y, z), covariance, seen_in: vec![] });
    };
    let corners = [(-1.0, 1.0), (1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)];
    for (i, (x, z)) in corners.into_iter().enumerate() {
        add(format!("b{i}"), x * 1.2 - 1.2, 0.05, z * 0.8 - 0.4);
        add(format!("b{}", i + 4), x * 1.2 - 1.2, 1.55, z * 0.8 - 0.4);
        add(format!("f{i}"), x * 3.5, 0.0, z * 3.5);
    }
    add("foot".into(), 1.3, 0.05, 0.3);
    add("head".into(), 1.3, 2.5, 0.3);
    for i in 0..3 {
        let (cos, sin) = (libm::cos(2.0 * f64::from(i)), libm::sin(2.0 * f64::from(i)));
        add(format!("c{i}"), 1.3 + 0.45 * cos, 0.05, 0.3 + 0.45 * sin);
        add(format!("d{i}"), 1.3 + 0.36 * cos, 2.5, 0.3 + 0.36 * sin);
    }
    let rows = toml::from_str::<Table>(SHAPES).unwrap().shape;
    let model = build(&rows, &points, &[]);
    assert_eq!(model.refused, []);
    model.parts
}

/// A panel that stands in the way of some photographs.
pub fn panel() -> Mesh {
    let corner = |x: f32, y: f32| Vec3::new(x, y, 1.9);
    Mesh {
        positions: vec![corner(-1.5, 0.2), corner(-0.8, 0.2), corner(-0.8, 1.9), corner(-1.5, 1.9)],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    }
}

/// Stone: joints, blotches and a grain, none finer than a few centimetres; different on each side.
pub fn albedo(p: Vec3) -> Vec3 {
    let wave = |x: f32| libm::sinf(x);
    let blotch =
        wave(2.1 * p.x + 1.3 * wave(1.7 * p.y) + 0.4) * wave(2.6 * p.z + 1.1 * wave(2.3 * p.x)) * wave(1.9 * p.y + 0.7);
    let grain = wave(31.0 * p.x + 7.0 * p.y) * wave(29.0 * p.y - 9.0 * p.z) * wave(33.0 * p.z + 5.0 * p.x);
    let joint = |x: f32| (0.5 + 0.5 * wave(x * std::f32::consts::TAU / 0.6)).powi(24);
    let joints = joint(p.x + 0.11).max(joint(p.y + 0.21)).max(joint(p.z + 0.04));
    let warm = Vec3::new(0.62, 0.52, 0.38) + Vec3::new(0.10, 0.06, 0.02) * blotch + Vec3::splat(0.09) * grain;
    warm * (1.0 - 0.55 * joints)
}

/// Everything that a photograph can see.
pub struct World {
    pub scene: TriangleScene,
    model_triangles: u32,
}

impl World {
    pub fn new(parts: &[Part], occluder: Option<&Mesh>) -> Self {
        let (mut positions, mut triangles) = (Vec::new(), Vec::new());
        let mut add = |mesh: &Mesh| {
            let first = positions.len() as u32;
            positions.extend(&mesh.positions);
            triangles.extend(mesh.triangles.iter().map(|t| t.map(|v| v + first)));
            triangles.len() as u32
        };
        let model_triangles = parts.iter().map(|part| add(&part.mesh)).last().unwrap();
        if let Some(mesh) = occluder {
            add(mesh);
        }
        Self { scene: TriangleScene::build(&positions, &triangles, &BuildParams::default()).unwrap(), model_triangles }
    }

    /// The linear colour of each pixel, the mean of `samples` squared rays, and whether all of them met the model.
    pub fn render(&self, camera: &Camera, samples: u32, color: impl Fn(&Hit, Vec3) -> Vec3 + Sync) -> Vec<(Vec3, bool)> {
        let [width, height] = [camera.intrinsics.width, camera.intrinsics.height];
        let row = |y: u32| {
            let ray = |i: u32| {
                let (x, sub) = (i / (samples * samples), i % (samples * samples));
                let inside = DVec2::new(f64::from(sub % samples), f64::from(sub / samples)) + 0.5;
                let pixel = DVec2::new(f64::from(x), f64::from(y)) + inside / f64::from(samples);
                let (origin, direction) = camera.ray(pixel);
                Ray { origin: origin.as_vec3(), direction: direction.as_vec3(), t_min: 0.0, t_max: f32::INFINITY }
            };
            let rays: Vec<Ray> = (0..width * samples * samples).map(ray).collect();
            let mut hits = vec![Hit::MISS; rays.len()];
            self.scene.closest(&rays, &mut hits);
            let seen = |(ray, hit): (&Ray, &Hit)| match hit.triangle {
                _ if !hit.is_some() => (SKY, false),
                t if t >= self.model_triangles => (MAGENTA, false),
                _ => (color(hit, ray.origin + ray.direction * hit.t), true),
            };
            let all: Vec<(Vec3, bool)> = rays.iter().zip(&hits).map(seen).collect();
            let mean =
                |all: &[(Vec3, bool)]| (all.iter().map(|s| s.0).sum::<Vec3>() / all.len() as f32, all.iter().all(|s| s.1));
            all.chunks_exact((samples * samples) as usize).map(mean).collect::<Vec<_>>()
        };
        (0..height).into_par_iter().flat_map_iter(row).collect()
    }

    /// A photograph of true colours at this exposure and white balance.
    pub fn photograph(&self, camera: &Camera, gain: Vec3) -> Picture {
        let pixels = self.render(camera, 3, |_, p| albedo(p)).into_iter().map(|(color, _)| encoded(color * gain)).collect();
        Picture::Eight(SrgbImage { width: camera.intrinsics.width, height: camera.intrinsics.height, pixels })
    }
}

pub fn encoded(color: Vec3) -> [u8; 4] {
    let [r, g, b] = color.to_array().map(srgb8_from_linear);
    [r, g, b, 255]
}

/// What a textured model shows where a ray met it.
pub fn textured_color(meshes: &[Mesh], hit: &Hit) -> Vec3 {
    let mut t = hit.triangle as usize;
    let mesh = meshes
        .iter()
        .find(|mesh| {
            let is_this = t < mesh.triangles.len();
            t -= if is_this { 0 } else { mesh.triangles.len() };
            is_this
        })
        .unwrap();
    let [a, b, c] = mesh.triangles[t].map(|v| mesh.uvs[v as usize]);
    let uv = a + (b - a) * hit.u + (c - a) * hit.v;
    let texture = mesh.materials[0].texture.as_ref().unwrap();
    texture.image.sample_bilinear(uv.x, uv.y, [TextureWrap::Clamp; 2]).truncate()
}

/// Peak signal to noise of sRGB-encoded colours, decibels.
pub fn psnr_db(pairs: impl Iterator<Item = (Vec3, Vec3)>) -> f64 {
    let encode = |color: Vec3| color.clamp(Vec3::ZERO, Vec3::ONE).map(srgb_from_linear);
    let (mut sum, mut count) = (0.0, 0.0);
    for (a, b) in pairs {
        sum += f64::from((encode(a) - encode(b)).length_squared());
        count += 3.0;
    }
    assert!(count > 3000.0, "too few to say");
    -10.0 * libm::log10(sum / count)
}

pub fn cameras() -> Vec<Camera> {
    around(8, 6.0, 1.8, DVec3::new(0.0, 0.9, 0.0), [540, 405], 465.0)
}

/// A camera that took none of the photographs.
pub fn new_view() -> Camera {
    look_at(DVec3::new(3.1, 2.9, 4.4), DVec3::new(0.0, 0.8, 0.0), 540, 405, 480.0)
}

/// Exposure and white balance of each photograph.
pub fn true_gains() -> Vec<Vec3> {
    let gain = |i: usize| {
        let exposure = libm::exp2f([0.0, 0.3, -0.4, 0.2, -0.2, 0.45, -0.1, 0.1][i]);
        let warmth = [0.0, 0.05, -0.04, 0.08, -0.06, 0.0, 0.03, -0.05][i];
        Vec3::new(1.0 + warmth, 1.0, 1.0 - warmth) * exposure
    };
    (0..8).map(gain).collect()
}

/// Writes a picture where the variable HELIODON_LOOK names a folder, for whoever changes this to look at.
pub fn look(name: &str, image: &SrgbImage) {
    if let Ok(folder) = std::env::var("HELIODON_LOOK") {
        image.write_png(std::path::Path::new(&folder).join(name)).unwrap();
    }
}
