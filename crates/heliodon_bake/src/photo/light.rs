//! The light that falls on a survey's texels at the hours of its photographs.

use super::HourSky;
use crate::albedo::{SceneAlbedo, solvable};
use glam::Vec3;
use heliodon_light::reference::{ReferenceParams, reference_light_at_points};
use heliodon_light::{LightError, SurfaceAlbedo, Surfaces};
use heliodon_math::frame::{orthonormal_basis, unit_or};
use heliodon_mesh::Mesh;
use heliodon_photo::albedo::Light;
use heliodon_photo::texture::{Sparse, Survey, TexelIndex};
use heliodon_rays::Ray;
use rayon::prelude::*;
use std::f32::consts::{FRAC_1_PI, TAU};

/// How the light of hours is found.
#[derive(Clone, Debug, PartialEq)]
pub struct HourLightParams {
    /// Rays to the sun's disc from each texel; 1 for a sun without extent.
    pub sun_samples: u32,
    /// Light of the sky and bounced light is traced at one of so many by so many texels.
    pub every: u32,
    /// Paths from each of these. Their noise falls with the root.
    pub samples: u32,
    /// Diffuse bounces.
    pub max_bounces: u32,
    /// How far off the surface rays start beside what rounding asks for, metres.
    pub offset_m: f32,
    /// Picks the random numbers.
    pub seed: u32,
}

impl Default for HourLightParams {
    fn default() -> Self {
        Self { sun_samples: 16, every: 6, samples: 256, max_bounces: 4, offset_m: 0.001, seed: 0 }
    }
}

/// The light of the hours of a survey's photographs.
pub struct HourLights<'a> {
    survey: &'a Survey<'a>,
    surroundings: &'a [&'a Mesh],
    hours: &'a [HourSky],
    hour_of: &'a [usize],
    params: HourLightParams,
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    index: TexelIndex<'a>,
    /// Texels that a photograph says something of.
    asked: Vec<bool>,
    nodes: Nodes,
    /// For each hour and texel the cosine to the sun, times the part of the disc that is seen.
    sun: Vec<Vec<f32>>,
}

/// Texels from which paths start.
struct Nodes {
    sparse: Sparse,
    places: Vec<Vec3>,
    normals: Vec<Vec3>,
}

/// Texels whose rays are asked for together.
const BLOCK: usize = 1024;

impl<'a> HourLights<'a> {
    /// Looks for the suns of all hours. `surroundings` are what stands in the survey's way, in its order; `hour_of` has the hour of each of its photographs.
    ///
    /// # Panics
    /// Where a photograph has no hour, or one that there is not.
    #[must_use]
    pub fn new(
        survey: &'a Survey<'a>,
        surroundings: &'a [&'a Mesh],
        hours: &'a [HourSky],
        hour_of: &'a [usize],
        params: HourLightParams,
    ) -> Self {
        assert_eq!(hour_of.len(), survey.names().len(), "an hour for each photograph");
        let all = survey.triangles();
        let positions: Vec<Vec3> = all.iter().flat_map(|(corners, _)| *corners).collect();
        let normals = all.iter().flat_map(|(_, normals)| *normals).collect();
        let triangles = (0..all.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        let places: Vec<(Vec3, Vec3)> = survey.places().collect();
        let light_normals: Vec<Vec3> = survey.light_normals().collect();
        let mut asked = vec![false; places.len()];
        survey.samples().iter().flatten().for_each(|sample| asked[sample.texel as usize] = true);
        let sparse = survey.sparse(params.every, &asked);
        let of_nodes = |of: &dyn Fn(usize) -> Vec3| sparse.nodes.iter().map(|&texel| of(texel as usize)).collect();
        let (node_places, node_normals) = (of_nodes(&|texel| places[texel].0), of_nodes(&|texel| light_normals[texel]));
        let offset_m = params.offset_m + survey.scene().start_offset();
        let of_hour = |hour: &HourSky| {
            let Some(sun) = hour.sun else { return vec![0.0; places.len()] };
            let disc = disc(sun.direction, params.sun_samples);
            let block = |block: usize| {
                let texels = (block * BLOCK..((block + 1) * BLOCK).min(places.len())).filter(|&texel| asked[texel]);
                let texels: Vec<usize> = texels.collect();
                let starts: Vec<(Vec3, Vec3)> =
                    texels.iter().map(|&texel| (places[texel].0 + places[texel].1 * offset_m, light_normals[texel])).collect();
                texels.into_iter().zip(sunlit(survey, &starts, &disc)).collect::<Vec<_>>()
            };
            let lit: Vec<Vec<(usize, f32)>> = (0..places.len().div_ceil(BLOCK)).into_par_iter().map(block).collect();
            let mut of_hour = vec![0.0; places.len()];
            lit.into_iter().flatten().for_each(|(texel, lit)| of_hour[texel] = lit);
            of_hour
        };
        let sun = hours.iter().map(of_hour).collect();
        let nodes = Nodes { places: node_places, normals: node_normals, sparse };
        let index = survey.index();
        Self { survey, surroundings, hours, hour_of, params, positions, normals, triangles, index, asked, nodes, sun }
    }

    /// How many texels paths start from.
    #[must_use]
    pub fn node_count(&self) -> usize {
        self.nodes.places.len()
    }

    /// The light of every sample of the survey (irradiance over pi) at its photograph's hour, while texels have the given albedo.
    ///
    /// # Errors
    /// A model that light cannot be traced through.
    pub fn light(&self, albedo: &[Vec3]) -> Result<Light, LightError> {
        let own = self.triangles.len() - self.surroundings.iter().map(|mesh| mesh.triangles.len()).sum::<usize>();
        let mut first = own;
        let others = self.surroundings.iter().map(|mesh| {
            first += mesh.triangles.len();
            (first, SceneAlbedo::new(mesh, 0.0))
        });
        let filled = self.filled(albedo);
        let found = Found { index: &self.index, texels: &filled, own, others: others.collect() };
        let surfaces = Surfaces {
            rays: self.survey.scene(),
            positions: &self.positions,
            normals: &self.normals,
            triangles: &self.triangles,
            albedo: &found,
            detail: None,
        };
        let of_hours = self.hours.iter().map(|hour| self.slow_light(hour, &surfaces)).collect::<Result<Vec<_>, _>>()?;
        let of_photograph = |(own, &hour): (&Vec<heliodon_photo::texture::Sample>, &usize)| {
            let sun = self.hours[hour].sun.map_or(Vec3::ZERO, |sun| sun.irradiance * FRAC_1_PI);
            let at = |sample: &heliodon_photo::texture::Sample| {
                let texel = sample.texel as usize;
                let slow = self.nodes.sparse.read(texel, &of_hours[hour]).unwrap_or(Vec3::ZERO);
                slow + sun * self.sun[hour][texel]
            };
            own.par_iter().map(at).collect()
        };
        Ok(self.survey.samples().iter().zip(self.hour_of).map(of_photograph).collect())
    }

    /// The albedo, where no photograph says anything that of the same face; of the same part, where none says anything of that.
    fn filled(&self, albedo: &[Vec3]) -> Vec<Vec3> {
        let mean = |sum: (Vec3, f32)| (sum.1 > 0.0).then(|| sum.0 / sum.1);
        let of_face: Vec<(usize, std::ops::Range<usize>, (Vec3, f32))> = (self.survey.faces())
            .map(|(part, texels)| {
                let seen = texels.clone().filter(|texel| self.asked[*texel]);
                (part, texels, seen.fold((Vec3::ZERO, 0.0), |(sum, count), texel| (sum + albedo[texel], count + 1.0)))
            })
            .collect();
        let mut of_part = vec![(Vec3::ZERO, 0.0); of_face.iter().map(|(part, ..)| part + 1).max().unwrap_or(0)];
        for (part, _, (sum, count)) in &of_face {
            of_part[*part].0 += *sum;
            of_part[*part].1 += *count;
        }
        let mut filled = albedo.to_vec();
        for (part, texels, sum) in of_face {
            // what is of a part that nobody sees keeps the mean of all
            if let Some(color) = mean(sum).or_else(|| mean(of_part[part])) {
                texels.filter(|texel| !self.asked[*texel]).for_each(|texel| filled[texel] = color);
            }
        }
        filled
    }

    /// Light of the sky and bounced light at the nodes.
    fn slow_light(&self, hour: &HourSky, surfaces: &Surfaces) -> Result<Vec<Vec3>, LightError> {
        let offset_m = self.params.offset_m + self.survey.scene().start_offset();
        let params = ReferenceParams {
            samples: self.params.samples,
            max_bounces: self.params.max_bounces,
            offset_m,
            seed: self.params.seed,
        };
        let Nodes { places, normals, .. } = &self.nodes;
        let mut light = reference_light_at_points(surfaces, &hour.sky, hour.sun, places, normals, &params)?;
        // the tracer's own sun comes without noise, so that it can be taken out again
        if let Some(sun) = hour.sun {
            light.par_chunks_mut(BLOCK).enumerate().for_each(|(block, light)| {
                let starts: Vec<(Vec3, Vec3)> = (block * BLOCK..block * BLOCK + light.len())
                    .map(|node| (places[node] + normals[node] * offset_m, normals[node]))
                    .collect();
                for (light, lit) in light.iter_mut().zip(sunlit(self.survey, &starts, &[sun.direction])) {
                    *light = (*light - sun.irradiance * (lit * FRAC_1_PI)).max(Vec3::ZERO);
                }
            });
        }
        Ok(light)
    }
}

/// For each start, which has a normal, the mean cosine to the directions that nothing hides.
fn sunlit(survey: &Survey, starts: &[(Vec3, Vec3)], directions: &[Vec3]) -> Vec<f32> {
    let (mut rays, mut terms) = (Vec::new(), Vec::new());
    for (i, (origin, normal)) in starts.iter().enumerate() {
        for &direction in directions {
            let cosine = normal.dot(direction);
            if cosine > 0.0 {
                rays.push(Ray { origin: *origin, direction, t_min: 0.0, t_max: f32::INFINITY });
                terms.push((i, cosine / directions.len() as f32));
            }
        }
    }
    let mut occluded = vec![0; rays.len().div_ceil(64)];
    survey.scene().occluded(&rays, &mut occluded);
    let mut lit = vec![0.0; starts.len()];
    for (ray, (i, term)) in terms.into_iter().enumerate() {
        if occluded[ray / 64] >> (ray % 64) & 1 == 0 {
            lit[i] += term;
        }
    }
    lit
}

/// Directions spread evenly over the sun's disc.
fn disc(middle: Vec3, count: u32) -> Vec<Vec3> {
    if count <= 1 {
        return vec![middle];
    }
    let (right, up) = orthonormal_basis(middle);
    let radius = heliodon_sky::sun::SUN_RADIUS_DEG.to_radians() as f32;
    // the golden angle spreads any number
    let golden = TAU * 0.381_966;
    let direction = |i: u32| {
        let r = radius * ((i as f32 + 0.5) / count as f32).sqrt();
        let (sin, cos) = libm::sincosf(golden * i as f32);
        unit_or(middle + right * (r * cos) + up * (r * sin), middle)
    };
    (0..count).map(direction).collect()
}

/// The model with the albedo that was found so far, and what stands about it.
struct Found<'a> {
    index: &'a TexelIndex<'a>,
    texels: &'a [Vec3],
    /// Triangles of the model.
    own: usize,
    /// Where each of the other meshes' triangles end.
    others: Vec<(usize, SceneAlbedo<'a>)>,
}

impl SurfaceAlbedo for Found<'_> {
    fn albedo(&self, triangle: u32, u: f32, v: f32) -> Vec3 {
        let t = triangle as usize;
        if t < self.own {
            return self.index.texel(triangle, u, v).map_or(Vec3::splat(0.5), |texel| solvable(self.texels[texel]));
        }
        let mut begin = self.own;
        for (end, albedo) in &self.others {
            if t < *end {
                return albedo.albedo((t - begin) as u32, u, v);
            }
            begin = *end;
        }
        Vec3::ZERO
    }

    fn mean(&self, triangle: u32) -> Vec3 {
        self.albedo(triangle, 1.0 / 3.0, 1.0 / 3.0)
    }
}
