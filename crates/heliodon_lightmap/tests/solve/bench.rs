//! A scene on the bench: unwrapped, lit, and asked.

use glam::Vec3;
use heliodon_image::Wrap;
use heliodon_lightmap::charts::ChartParams;
use heliodon_lightmap::lights::{
    Amount, DirectionalSpec, EmissiveTriangles, IesProfile, Light, LightFiles, LightSpec, Photometry,
};
use heliodon_lightmap::packing::PackParams;
use heliodon_lightmap::solve::models::{Lambertian, Realistic};
use heliodon_lightmap::solve::{LightMap, Models, Scene, SolveParams, solve};
use heliodon_lightmap::texels::{Texel, texels};
use heliodon_lightmap::unwrap::{UnwrapParams, Unwrapped, unwrap};
use heliodon_math::dome::{ConstantSky, Environment};
use heliodon_rays::{BuildParams, TriangleScene};
use heliodon_testkit::scenes;
use std::sync::Arc;

pub const REALISTIC: Models = Models { illumination: &Realistic, surface: &Lambertian };
pub const BLACK: ConstantSky = ConstantSky(Vec3::ZERO);
pub const WHITE: ConstantSky = ConstantSky(Vec3::ONE);

pub struct Bench {
    pub scene: scenes::Scene,
    pub unwrapped: Unwrapped,
    pub texels: Vec<Texel>,
    pub rays: TriangleScene,
    pub side: u32,
    pub albedo: f32,
    pub lights: Vec<Light>,
    pub sky: Box<dyn Environment>,
}

impl Bench {
    /// A scene of which all triangles have texels.
    pub fn new(scene: scenes::Scene, side: u32) -> Self {
        let all = scene.triangles.len();
        Self::with_texels_on(scene, side, all)
    }

    /// A scene of which only the first triangles have texels.
    pub fn with_texels_on(scene: scenes::Scene, side: u32, triangles: usize) -> Self {
        Self::cut(scene, side, triangles, ChartParams::default())
    }

    /// The same, cut into charts in some way.
    pub fn cut(scene: scenes::Scene, side: u32, triangles: usize, charts: ChartParams) -> Self {
        let pack = PackParams { width: side, height: side, ..PackParams::default() };
        Self::unwrapped(scene, triangles, UnwrapParams { charts, pack })
    }

    /// The same, unwrapped in some way into squares.
    pub fn unwrapped(scene: scenes::Scene, triangles: usize, params: UnwrapParams) -> Self {
        let side = params.pack.width;
        let unwrapped = unwrap(&scene.positions, &scene.triangles[..triangles], &[], &params).unwrap();
        let texels = texels(&unwrapped, side, side);
        let rays = TriangleScene::build(&scene.positions, &scene.triangles, &BuildParams::default()).unwrap();
        Self { scene, unwrapped, texels, rays, side, albedo: 0.0, lights: Vec::new(), sky: Box::new(BLACK) }
    }

    pub fn lit(mut self, light: Light) -> Self {
        self.lights.push(light);
        self
    }

    pub fn under(self, sky: impl Environment + 'static) -> Self {
        Self { sky: Box::new(sky), ..self }
    }

    pub fn reflecting(self, albedo: f32) -> Self {
        Self { albedo, ..self }
    }

    pub fn solve(&self, params: &SolveParams) -> LightMap {
        self.solve_by(&REALISTIC, params)
    }

    pub fn solve_by(&self, models: &Models, params: &SolveParams) -> LightMap {
        let albedo = |_, _, _| Vec3::splat(self.albedo);
        let scene = Scene {
            rays: &self.rays,
            positions: &self.scene.positions,
            normals: &self.scene.normals,
            triangles: &self.scene.triangles,
            unwrapped: &self.unwrapped,
            texels: &self.texels,
            sides: [self.side; 2],
            albedo: &albedo,
            lights: &self.lights,
            sky: self.sky.as_ref(),
        };
        let map = solve(&scene, models, params).unwrap();
        map.validate().unwrap();
        map
    }

    /// What filtering shows all over the front of each triangle, with the places.
    pub fn filtered(&self, map: &LightMap) -> Vec<(Vec3, Vec3)> {
        let image = map.image(&self.texels, 0, [self.side; 2]);
        let of = |t: usize| {
            let uvs = self.unwrapped.triangles[t].map(|v| self.unwrapped.uvs[v as usize] * self.side as f32);
            let corners = self.scene.triangles[t].map(|v| self.scene.positions[v as usize]);
            let longest = uvs[0].distance(uvs[1]).max(uvs[1].distance(uvs[2])).max(uvs[2].distance(uvs[0]));
            let steps = (4.0 * longest).ceil().max(1.0) as u32;
            let image = &image;
            (0..=steps).flat_map(move |i| {
                (0..=steps - i).map(move |j| {
                    let [u, v] = [i, j].map(|x| x as f32 / steps as f32);
                    let uv = uvs[0] + (uvs[1] - uvs[0]) * u + (uvs[2] - uvs[0]) * v;
                    let place = corners[0] + (corners[1] - corners[0]) * u + (corners[2] - corners[0]) * v;
                    (place, image.sample_bilinear(uv.x, uv.y, Wrap::Clamp))
                })
            })
        };
        (0..self.unwrapped.triangles.len()).flat_map(of).collect()
    }

    pub fn position(&self, texel: &Texel) -> Vec3 {
        texel.mix(self.scene.triangles[texel.triangle as usize].map(|v| self.scene.positions[v as usize]))
    }

    pub fn normal(&self, texel: &Texel) -> Vec3 {
        texel.mix(self.scene.triangles[texel.triangle as usize].map(|v| self.scene.normals[v as usize]))
    }

    /// Each texel's place and light, where `wanted`; asserts that there are some.
    pub fn at<'a>(&'a self, map: &'a LightMap, wanted: impl Fn(Vec3, Vec3) -> bool) -> Vec<(Vec3, Vec3)> {
        let all = self.texels.iter().zip(&map.light).map(|(texel, &light)| (self.position(texel), self.normal(texel), light));
        let wanted: Vec<(Vec3, Vec3)> =
            all.filter(|(place, normal, _)| wanted(*place, *normal)).map(|(place, _, light)| (place, light)).collect();
        assert!(wanted.len() > 50, "{} texels", wanted.len());
        wanted
    }
}

/// The greatest and the root mean square error against a truth, as parts of that.
pub fn errors(found: &[(Vec3, Vec3)], truth: impl Fn(Vec3) -> f32) -> (f32, f32) {
    let off: Vec<f32> = found.iter().map(|(place, light)| (light.x / truth(*place) - 1.0).abs()).collect();
    let most = off.iter().copied().fold(0.0, f32::max);
    (most, (off.iter().map(|x| x * x).sum::<f32>() / off.len() as f32).sqrt())
}

/// A mesh light of these triangles.
struct Triangles(scenes::Scene);

impl LightFiles for Triangles {
    fn ies(&self, file: &str) -> Result<Arc<IesProfile>, String> {
        Err(format!("{file} is not there"))
    }

    fn mesh(&self, _file: &str) -> Result<EmissiveTriangles, String> {
        Ok(EmissiveTriangles { positions: self.0.positions.clone(), triangles: self.0.triangles.clone() })
    }
}

/// In the site's unit, as it is.
pub fn light(spec: &LightSpec) -> Light {
    emissive(spec, scenes::Scene::default())
}

pub fn emissive(spec: &LightSpec, triangles: scenes::Scene) -> Light {
    Light::new(spec, Photometry::HOUSE, &Triangles(triangles)).unwrap()
}

pub fn sun(direction: [f64; 3], angular_radius_deg: f64, irradiance: f64) -> Light {
    let amount = Amount::Irradiance(irradiance);
    light(&LightSpec::Directional(DirectionalSpec { name: None, direction, angular_radius_deg, colour: [1.0; 3], amount }))
}
