//! Paths, a batch at a time: every step of all of them is one question to the ray engine.

use crate::Channels;
use crate::reference::sampler::PathSampler;
use crate::reference::shape::closest;
use crate::reference::{Stage, finite};
use glam::Vec3;
use heliodon_math::sphere::sample_cosine_hemisphere;
use heliodon_rays::Ray;
use std::f32::consts::FRAC_1_PI;

/// Where a path begins: a place off a surface, the surface's unit normal, the path's numbers.
#[derive(Clone, Debug)]
pub(crate) struct Start {
    pub origin: Vec3,
    pub normal: Vec3,
    pub sampler: PathSampler,
}

struct Path {
    at: Start,
    index: usize,
    throughput: Vec3,
}

/// One estimate of the light (irradiance / pi) at each start.
pub(crate) fn light_at(stage: Stage, starts: Vec<Start>) -> Vec<Vec3> {
    let mut light = vec![Vec3::ZERO; starts.len()];
    let mut paths: Vec<Path> = starts
        .into_iter()
        .enumerate()
        .filter(|(_, at)| at.normal.length_squared() > 0.0 && at.origin.is_finite())
        .map(|(index, at)| Path { at, index, throughput: Vec3::ONE })
        .collect();
    for depth in 0..=stage.params.max_bounces {
        if paths.is_empty() {
            break;
        }
        add_picked_light(stage, depth, &mut paths, &mut light);
        paths = go_on(stage, depth, paths, &mut light);
    }
    light
}

fn endless(origin: Vec3, direction: Vec3) -> Ray {
    Ray { origin, direction, t_min: 0.0, t_max: f32::INFINITY }
}

/// Light from the sun and from the picked direction of the sky, where nothing is in the way.
fn add_picked_light(stage: Stage, depth: u32, paths: &mut [Path], light: &mut [Vec3]) {
    let mut rays = Vec::with_capacity(2 * paths.len());
    let mut carried = Vec::with_capacity(2 * paths.len());
    for path in paths {
        let Start { origin, normal, ref mut sampler } = path.at;
        if let Some(sun) = stage.sun {
            let cos = normal.dot(sun.direction);
            if cos > 0.0 {
                rays.push(endless(origin, sun.direction));
                carried.push((path.index, path.throughput * sun.irradiance * (cos * FRAC_1_PI)));
            }
        }
        let numbers = if depth == 0 { sampler.first_pair(2) } else { sampler.pair() };
        if let Some((direction, density)) = stage.sky.sample(numbers) {
            let cos = normal.dot(direction);
            if cos > 0.0 {
                // the balance heuristic: the sky's light over the sum of both densities
                let weight = cos * FRAC_1_PI / (density + cos * FRAC_1_PI);
                rays.push(endless(origin, direction));
                carried.push((path.index, path.throughput * finite(stage.sky.radiance(direction)) * weight));
            }
        }
    }
    let mut occluded = vec![0_u64; rays.len().div_ceil(64)];
    stage.surfaces.rays.occluded(&rays, &mut occluded);
    for (i, (index, carried)) in carried.into_iter().enumerate() {
        if occluded[i / 64] >> (i % 64) & 1 == 0 {
            light[index] += carried;
        }
    }
}

/// One further direction of every path: sky where it meets nothing, else the next surface.
fn go_on(stage: Stage, depth: u32, paths: Vec<Path>, light: &mut [Vec3]) -> Vec<Path> {
    let mut sampled = Vec::with_capacity(paths.len());
    for mut path in paths {
        let numbers = if depth == 0 { path.at.sampler.first_pair(1) } else { path.at.sampler.pair() };
        let direction = sample_cosine_hemisphere(path.at.normal, numbers);
        sampled.push((path, direction));
    }
    let rays: Vec<Ray> = sampled.iter().map(|(path, direction)| endless(path.at.origin, *direction)).collect();
    let hits = closest(stage.surfaces, &rays);
    let mut next = Vec::new();
    for ((mut path, direction), hit) in sampled.into_iter().zip(&hits) {
        if !hit.is_some() {
            let cosine_density = path.at.normal.dot(direction).max(0.0) * FRAC_1_PI;
            let density = stage.sky.density(direction);
            if cosine_density > 0.0 {
                let weight = cosine_density / (cosine_density + density);
                light[path.index] += path.throughput * finite(stage.sky.radiance(direction)) * weight;
            }
        } else if depth < stage.params.max_bounces {
            path.throughput *= stage.surfaces.reflected_at(hit, Channels::Rgb);
            (path.at.origin, path.at.normal) = stage.surfaces.leave(direction, hit, stage.params.offset_m);
            if path.throughput != Vec3::ZERO {
                next.push(path);
            }
        }
    }
    next
}
