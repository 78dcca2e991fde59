//! Photographs of the temple by the path tracer.

use crate::temple;
use glam::{DVec2, Vec3};
use heliodon_bake::albedo::SceneAlbedo;
use heliodon_bake::photo::HourSky;
use heliodon_image::SrgbImage;
use heliodon_light::reference::{ReferenceFrame, ReferenceParams, render_through};
use heliodon_light::{SurfaceAlbedo, Surfaces};
use heliodon_math::color::srgb8_from_linear;
use heliodon_math::frame::unit_or;
use heliodon_mesh::Mesh;
use heliodon_photo::camera::Camera;
use heliodon_photo::model::Part;
use heliodon_rays::{BuildParams, Ray, TriangleScene};
use heliodon_sky::civil::{Date, TimeOfDay};
use heliodon_sky::model::{ModelParams, ModelSky};
use heliodon_sky::solar::Place;
use std::collections::HashMap;

/// Triangles as the path tracer takes them.
pub struct Stage {
    pub positions: Vec<Vec3>,
    pub normals: Vec<Vec3>,
    pub triangles: Vec<[u32; 3]>,
    pub rays: TriangleScene,
}

impl Stage {
    /// Of parts, their round faces smooth.
    pub fn new(parts: &[Part]) -> Self {
        let (mut positions, mut normals) = (Vec::new(), Vec::new());
        for part in parts {
            let normal = |t: usize| {
                let [a, b, c] = part.mesh.corners(t);
                (b - a).cross(c - a)
            };
            let key = |t: usize, p: Vec3| (part.face[t], p.to_array().map(|x| (x * 4096.0).round() as i32));
            let mut sums: HashMap<(u32, [i32; 3]), Vec3> = HashMap::new();
            for t in 0..part.mesh.triangles.len() {
                part.mesh.corners(t).into_iter().for_each(|p| *sums.entry(key(t, p)).or_default() += normal(t));
            }
            for t in 0..part.mesh.triangles.len() {
                for p in part.mesh.corners(t) {
                    let smooth = part.smooth[part.face[t] as usize];
                    positions.push(p);
                    normals.push(unit_or(if smooth { sums[&key(t, p)] } else { normal(t) }, Vec3::Y));
                }
            }
        }
        let triangles: Vec<[u32; 3]> = (0..positions.len() as u32 / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        let rays = TriangleScene::build(&positions, &triangles, &BuildParams::default()).unwrap();
        Self { positions, normals, triangles, rays }
    }

    pub fn surfaces<'a>(&'a self, albedo: &'a dyn SurfaceAlbedo) -> Surfaces<'a> {
        Surfaces {
            rays: &self.rays,
            positions: &self.positions,
            normals: &self.normals,
            triangles: &self.triangles,
            albedo,
            detail: None,
        }
    }

    pub fn place(&self, triangle: u32, u: f32, v: f32) -> Vec3 {
        let [a, b, c] = self.triangles[triangle as usize].map(|i| self.positions[i as usize]);
        a + (b - a) * u + (c - a) * v
    }
}

/// The temple's own albedo on a stage.
pub struct Stones<'a>(pub &'a Stage);

impl SurfaceAlbedo for Stones<'_> {
    fn albedo(&self, triangle: u32, u: f32, v: f32) -> Vec3 {
        temple::albedo(self.0.place(triangle, u, v))
    }

    fn mean(&self, triangle: u32) -> Vec3 {
        self.albedo(triangle, 1.0 / 3.0, 1.0 / 3.0)
    }
}

/// What textured meshes show.
pub struct Painted<'a>(Vec<(usize, SceneAlbedo<'a>)>);

impl<'a> Painted<'a> {
    pub fn new(meshes: &'a [Mesh]) -> Self {
        let mut end = 0;
        let each = meshes.iter().map(|mesh| {
            end += mesh.triangles.len();
            (end, SceneAlbedo::new(mesh, 0.0))
        });
        Self(each.collect())
    }
}

impl SurfaceAlbedo for Painted<'_> {
    fn albedo(&self, triangle: u32, u: f32, v: f32) -> Vec3 {
        let t = triangle as usize;
        let which = self.0.partition_point(|(end, _)| *end <= t);
        let begin = if which == 0 { 0 } else { self.0[which - 1].0 };
        self.0[which].1.albedo((t - begin) as u32, u, v)
    }

    fn mean(&self, triangle: u32) -> Vec3 {
        self.albedo(triangle, 1.0 / 3.0, 1.0 / 3.0)
    }
}

/// A clear day in Athens.
pub const PLACE: Place = Place { latitude_deg: 37.97, longitude_deg: 23.73, utc_offset_hours: 2.0, north_deg: 0.0 };
pub const DATE: Date = Date { year: 2024, month: 4, day: 20 };

/// Its skies at some times.
pub fn hours(times: &[&str]) -> Vec<HourSky> {
    let model = ModelSky::new(&ModelParams { turbidity: 3.0, ..ModelParams::default() }).unwrap();
    times.iter().map(|time| HourSky::of_model(&model, &PLACE, DATE, time.parse::<TimeOfDay>().unwrap()).unwrap()).collect()
}

/// Linear radiance through a lens.
pub fn photographed(surfaces: &Surfaces, hour: &HourSky, camera: &Camera, samples: u32, seed: u32) -> ReferenceFrame {
    let lens = |x: u32, y: u32, within: [f32; 2]| {
        let pixel = DVec2::new(f64::from(x) + f64::from(within[0]), f64::from(y) + f64::from(within[1]));
        let (origin, direction) = camera.ray(pixel);
        Ray { origin: origin.as_vec3(), direction: direction.as_vec3(), t_min: 0.0, t_max: f32::INFINITY }
    };
    let params = ReferenceParams { samples, max_bounces: 3, offset_m: 0.001, seed };
    let size = [camera.intrinsics.width, camera.intrinsics.height];
    render_through(surfaces, &hour.sky, hour.sun, size, &lens, &params).unwrap()
}

/// As a camera of a gain keeps it: eight bits of sRGB.
pub fn developed(frame: &ReferenceFrame, gain: Vec3) -> SrgbImage {
    let pixel = |radiance: &Vec3| {
        let [r, g, b] = (*radiance * gain).to_array().map(srgb8_from_linear);
        [r, g, b, 255]
    };
    SrgbImage { width: frame.width, height: frame.height, pixels: frame.radiance.iter().map(pixel).collect() }
}

/// Pixels without their opacity.
pub fn rgb(image: &SrgbImage) -> Vec<[u8; 3]> {
    image.pixels.iter().map(|p| [p[0], p[1], p[2]]).collect()
}

/// Four times what two pictures differ by, about grey.
pub fn difference(a: &SrgbImage, b: &SrgbImage) -> SrgbImage {
    let channel = |a: u8, b: u8| (128 + 4 * (i32::from(a) - i32::from(b))).clamp(0, 255) as u8;
    let pixels =
        a.pixels.iter().zip(&b.pixels).map(|(a, b)| [0, 1, 2, 3].map(|i| if i < 3 { channel(a[i], b[i]) } else { 255 }));
    SrgbImage { width: a.width, height: a.height, pixels: pixels.collect() }
}

/// Writes a picture where the variable HELIODON_LOOK names a folder, for whoever changes this to look at.
pub fn look(name: &str, image: &SrgbImage) {
    if let Ok(folder) = std::env::var("HELIODON_LOOK") {
        image.write_png(std::path::Path::new(&folder).join(name)).unwrap();
    }
}
