//! Light from what has no texels: backs, and triangles that others light. Paths go on there until they come to a texel, or to a lamp or the sky.

use super::gather::{Arriving, Gather};
use super::stage::{Met, Onward};
use crate::lights::{balance, pick_light};
use glam::Vec3;
use heliodon_math::random::{hash3_u32, unit_f32};
use heliodon_math::sphere::sample_cosine_hemisphere;
use heliodon_rays::{Hit, Ray};
use std::f32::consts::FRAC_1_PI;

/// A path at a place without texels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Path {
    /// Who asks.
    pub of: u32,
    /// The texel that asks, and a number for each of its paths: what its chances are drawn from.
    pub texel: u32,
    pub key: u32,
    pub origin: Vec3,
    pub normal: Vec3,
    pub throughput: Vec3,
    /// How often the light that is asked for was reflected before it came here.
    pub order: u32,
}

impl Path {
    fn numbers(&self, of: u32) -> [f32; 2] {
        [0, 1].map(|k| unit_f32(hash3_u32(self.texel, self.key, self.order << 8 | of << 1 | k)))
    }
}

/// Adds what paths find to who asks; returns the number of rays.
pub(super) fn follow(gather: &Gather, mut paths: Vec<Path>, mut add: impl FnMut(u32, Vec3)) -> u64 {
    let Arriving::Reflected(lights) = gather.arriving else { return 0 };
    let mut rays_traced = 0;
    while !paths.is_empty() {
        let (at_end, on_the_way): (Vec<Path>, Vec<Path>) = paths.into_iter().partition(|path| path.order == 0);
        rays_traced += direct(gather, &at_end, &mut add);
        let directions: Vec<Vec3> =
            on_the_way.iter().map(|path| sample_cosine_hemisphere(path.normal, path.numbers(0))).collect();
        let ray = |(path, &direction): (&Path, &Vec3)| endless(path.origin, direction);
        let rays: Vec<Ray> = on_the_way.iter().zip(&directions).map(ray).collect();
        let mut hits = vec![Hit::MISS; rays.len()];
        gather.stage.scene.rays.closest(&rays, &mut hits);
        rays_traced += rays.len() as u64;
        paths = Vec::new();
        for ((path, direction), hit) in on_the_way.iter().zip(directions).zip(&hits).filter(|(_, hit)| hit.is_some()) {
            match gather.stage.met(hit) {
                Met::Texel(texel) => {
                    let light = lights[path.order as usize - 1][texel as usize];
                    add(path.of, path.throughput * gather.stage.albedo[texel as usize] * light);
                }
                Met::Other => {
                    let Onward { origin, normal, albedo } = gather.stage.goes_on(hit, direction);
                    let throughput = path.throughput * albedo;
                    if throughput != Vec3::ZERO {
                        paths.push(Path { origin, normal, throughput, order: path.order - 1, ..*path });
                    }
                }
            }
        }
    }
    rays_traced
}

fn endless(origin: Vec3, direction: Vec3) -> Ray {
    Ray { origin, direction, t_min: 0.0, t_max: f32::INFINITY }
}

/// Light of the lamps and of the sky at the ends of paths: one lamp that was picked, one direction to where the sky is bright, one to anywhere.
fn direct(gather: &Gather, paths: &[Path], add: &mut impl FnMut(u32, Vec3)) -> u64 {
    let scene = gather.stage.scene;
    let illumination = gather.models.illumination;
    let mut rays: Vec<Ray> = Vec::new();
    let mut carried: Vec<(u32, Vec3)> = Vec::new();
    for path in paths {
        let mut ask = |ray: Ray, light: Vec3| {
            if light.is_finite() && light != Vec3::ZERO {
                rays.push(ray);
                carried.push((path.of, path.throughput * light));
            }
        };
        if illumination.has_lights() {
            let [which, _] = path.numbers(1);
            let picked = pick_light(scene.lights, path.origin, path.normal, which);
            let sample = |picked: &crate::lights::PickedLight| scene.lights[picked.index].sample(path.origin, path.numbers(2));
            if let Some((picked, sample)) = picked.and_then(|picked| Some((picked, sample(&picked)?))) {
                let cosine = path.normal.dot(sample.direction).max(0.0);
                let ray = Ray {
                    t_max: super::lamps::reach(sample.distance_m, gather.stage.offset_m),
                    ..endless(path.origin, sample.direction)
                };
                ask(ray, sample.light * (cosine / picked.chance));
            }
        }
        let seen = |direction: Vec3| illumination.escaped(scene.sky, direction);
        let density = |direction: Vec3| if illumination.is_sky_seen() { scene.sky.density(direction) } else { 0.0 };
        let bright = illumination.is_sky_seen().then(|| scene.sky.sample(path.numbers(3))).flatten();
        if let Some((direction, density)) = bright {
            let even = path.normal.dot(direction).max(0.0) * FRAC_1_PI;
            ask(endless(path.origin, direction), seen(direction) * (even / density * balance(density, even)));
        }
        let direction = sample_cosine_hemisphere(path.normal, path.numbers(4));
        let even = path.normal.dot(direction).max(0.0) * FRAC_1_PI;
        ask(endless(path.origin, direction), seen(direction) * balance(even, density(direction)));
    }
    let mut occluded = vec![0_u64; rays.len().div_ceil(64)];
    scene.rays.occluded(&rays, &mut occluded);
    for (i, (of, light)) in carried.into_iter().enumerate() {
        if occluded[i / 64] >> (i % 64) & 1 == 0 {
            add(of, light);
        }
    }
    rays.len() as u64
}
