//! Light from what has no texels: backs, and triangles that others light. Paths go on there until they come to a texel, or to the sky. They are followed once:
//! each place on the way is kept with the light of lamps and sky that it has and with what its path met, which tells its light after any number of bounces.

use super::gather::Gather;
use super::stage::{Met, Onward};
use crate::lights::{PickedLight, balance, pick_light};
use glam::Vec3;
use heliodon_math::random::{hash3_u32, unit_f32};
use heliodon_math::sphere::sample_cosine_hemisphere;
use heliodon_rays::{Hit, Ray};
use std::f32::consts::FRAC_1_PI;

/// A place on the way.
#[derive(Clone, Copy, Debug)]
pub(super) struct Link {
    /// What it hands on.
    pub albedo: Vec3,
    /// Its light of lamps and sky.
    pub direct: Vec3,
    /// What its path met.
    pub next: Next,
}

/// Where a path goes on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Next {
    /// Nowhere: to the sky, or to what reflects nothing.
    Nothing,
    Texel(u32),
    Link(u32),
}

impl Link {
    /// The same where other links come before all that it knows of.
    pub fn after(self, links: u32) -> Self {
        let next = match self.next {
            Next::Link(next) => Next::Link(links + next),
            next => next,
        };
        Self { next, ..self }
    }
}

/// What a link reflects of light that was itself reflected `order` times before, of which paths that were followed long enough know; `reflected` is what texels reflect of
/// their light, that of lamps and sky first.
pub(super) fn reflected(links: &[Link], link: u32, reflected: &[Vec<Vec3>], order: usize) -> Vec3 {
    let mut link = links[link as usize];
    let mut throughput = link.albedo;
    for of_texels in reflected[..order].iter().rev() {
        match link.next {
            Next::Nothing => return Vec3::ZERO,
            Next::Texel(texel) => return throughput * of_texels[texel as usize],
            Next::Link(next) => link = links[next as usize],
        }
        throughput *= link.albedo;
    }
    throughput * link.direct
}

/// A path at a place without texels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Path {
    /// The texel that asks, and a number for each of its paths: what its chances are drawn from.
    pub texel: u32,
    pub key: u32,
    pub onward: Onward,
    /// How many places are asked for, this one counted, at least one.
    pub places: u32,
}

impl Path {
    fn numbers(&self, step: u32, of: u32) -> [f32; 2] {
        [0, 1].map(|k| unit_f32(hash3_u32(self.texel, self.key, step << 8 | of << 1 | k)))
    }
}

/// Follows paths; adds their links, those of the paths' beginnings first and in their order. Returns the number of rays.
pub(super) fn find(gather: &Gather, mut paths: Vec<Path>, links: &mut Vec<Link>) -> u64 {
    let mut rays_traced = 0;
    for step in 0.. {
        if paths.is_empty() {
            break;
        }
        let first = links.len();
        links.extend(paths.iter().map(|path| Link { albedo: path.onward.albedo, direct: Vec3::ZERO, next: Next::Nothing }));
        let new = &mut links[first..];
        rays_traced += lamps_and_bright_sky(gather, &paths, step, new);
        let directions: Vec<Vec3> =
            paths.iter().map(|path| sample_cosine_hemisphere(path.onward.normal, path.numbers(step, 0))).collect();
        let rays: Vec<Ray> = paths.iter().zip(&directions).map(|(path, &d)| endless(path.onward.origin, d)).collect();
        let mut hits = vec![Hit::MISS; rays.len()];
        gather.stage.scene.rays.closest(&rays, &mut hits);
        rays_traced += rays.len() as u64;
        let mut further = Vec::new();
        for (((path, direction), hit), link) in paths.iter().zip(directions).zip(&hits).zip(new) {
            if !hit.is_some() {
                let even = even_density(path, direction);
                link.direct += found(escaped(gather, direction) * balance(even, sky_density(gather, direction)));
                continue;
            }
            link.next = match gather.stage.met(hit) {
                Met::Texel(texel) => Next::Texel(texel),
                Met::Other if path.places > 1 => {
                    let onward = gather.stage.goes_on(hit, direction);
                    if onward.albedo == Vec3::ZERO {
                        continue;
                    }
                    further.push(Path { onward, places: path.places - 1, ..*path });
                    Next::Link((first + paths.len() + further.len() - 1) as u32)
                }
                Met::Other => Next::Nothing,
            };
        }
        paths = further;
    }
    rays_traced
}

/// Adds light of one lamp that is picked, and of one direction to where the sky is bright.
fn lamps_and_bright_sky(gather: &Gather, paths: &[Path], step: u32, links: &mut [Link]) -> u64 {
    let scene = gather.stage.scene;
    let illumination = gather.models.illumination;
    let mut rays: Vec<Ray> = Vec::new();
    let mut carried: Vec<(usize, Vec3)> = Vec::new();
    for (i, path) in paths.iter().enumerate() {
        let Onward { origin, normal, .. } = path.onward;
        let mut ask = |ray: Ray, light: Vec3| {
            if found(light) != Vec3::ZERO {
                rays.push(ray);
                carried.push((i, light));
            }
        };
        if illumination.has_lights() {
            let [which, _] = path.numbers(step, 1);
            let picked = pick_light(scene.lights, origin, normal, which);
            let sample = |picked: &PickedLight| scene.lights[picked.index].sample(origin, path.numbers(step, 2));
            if let Some((picked, sample)) = picked.and_then(|picked| Some((picked, sample(&picked)?))) {
                let cosine = normal.dot(sample.direction).max(0.0);
                let t_max = super::lamps::reach(sample.distance_m, gather.stage.offset_m);
                ask(Ray { t_max, ..endless(origin, sample.direction) }, sample.light * (cosine / picked.chance));
            }
        }
        let bright = illumination.is_sky_seen().then(|| scene.sky.sample(path.numbers(step, 3))).flatten();
        if let Some((direction, density)) = bright {
            let even = even_density(path, direction);
            ask(endless(origin, direction), escaped(gather, direction) * (even / density * balance(density, even)));
        }
    }
    let mut occluded = vec![0_u64; rays.len().div_ceil(64)];
    scene.rays.occluded(&rays, &mut occluded);
    for (i, (link, light)) in carried.into_iter().enumerate() {
        if occluded[i / 64] >> (i % 64) & 1 == 0 {
            links[link].direct += light;
        }
    }
    rays.len() as u64
}

fn endless(origin: Vec3, direction: Vec3) -> Ray {
    Ray { origin, direction, t_min: 0.0, t_max: f32::INFINITY }
}

fn escaped(gather: &Gather, direction: Vec3) -> Vec3 {
    gather.models.illumination.escaped(gather.stage.scene.sky, direction)
}

/// How densely directions lie about a normal that are the denser the greater their cosine.
fn even_density(path: &Path, direction: Vec3) -> f32 {
    path.onward.normal.dot(direction).max(0.0) * FRAC_1_PI
}

/// And those that go where the sky is bright.
fn sky_density(gather: &Gather, direction: Vec3) -> f32 {
    if gather.models.illumination.is_sky_seen() { gather.stage.scene.sky.density(direction) } else { 0.0 }
}

/// Light, none where it is no number.
fn found(light: Vec3) -> Vec3 {
    if light.is_finite() { light } else { Vec3::ZERO }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn link(albedo: f32, direct: f32, next: Next) -> Link {
        Link { albedo: Vec3::splat(albedo), direct: Vec3::splat(direct), next }
    }

    #[test]
    fn a_chain_tells_its_light_after_any_number_of_bounces() {
        let links = [link(0.5, 8.0, Next::Link(1)), link(0.25, 16.0, Next::Texel(1)), link(0.5, 2.0, Next::Nothing)];
        let texels = [[1.0, 3.0], [5.0, 7.0], [11.0, 13.0]].map(|of| of.map(Vec3::splat).to_vec());
        let of = |link: u32| (0..=3).map(|order| reflected(&links, link, &texels, order).x).collect::<Vec<_>>();
        // its own light, that of the next link, what the texel beyond reflects of its first light, and of its second
        assert_eq!(of(0), [4.0, 0.5 * 0.25 * 16.0, 0.5 * 0.25 * 3.0, 0.5 * 0.25 * 7.0]);
        assert_eq!(of(1), [4.0, 0.25 * 3.0, 0.25 * 7.0, 0.25 * 13.0]);
        assert_eq!(of(2), [1.0, 0.0, 0.0, 0.0]);
    }

    #[test]
    fn links_that_come_after_others_name_those_that_came_with_them() {
        assert_eq!(link(0.5, 1.0, Next::Link(3)).after(10).next, Next::Link(13));
        assert_eq!(link(0.5, 1.0, Next::Texel(3)).after(10).next, Next::Texel(3));
    }
}
