//! The reference: a path tracer over the same surfaces, sky and sun, to which baked light must come close.
//!
//! Unbiased: next-event estimation to the sharp sun, importance sampling of the sky's image combined with cosine sampling by
//! the balance heuristic (E. Veach, L. Guibas: "Optimally Combining Sampling Techniques for Monte Carlo Rendering", SIGGRAPH
//! 1995), Lambertian surfaces with interpolated shading normals, both sides alike. Paths have no Russian roulette: they end after
//! `max_bounces`, as the bake's do. The first six numbers of each path (pixel, first direction, sky sample) come from a rank-one
//! sequence that is shifted for each pixel, the rest from a generator of its own per path, so that pictures are the same for any
//! number of threads.

mod camera;
mod path;
mod sampler;
mod shape;

pub use camera::Camera;
pub use heliodon_math::dome::{ConstantSky, Environment, HarmonicSky, LatLongSky};
pub use shape::Shape;

use crate::{Channels, LightError, Surfaces};
use glam::Vec3;
use path::{Start, light_at};
use rayon::prelude::*;
use sampler::PathSampler;
use shape::closest;

use heliodon_rays::Ray;

/// A sun without extent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DirectSun {
    /// Unit direction to the sun.
    pub direction: Vec3,
    /// Irradiance at normal incidence, linear RGB.
    pub irradiance: Vec3,
}

/// How long the reference is traced.
#[derive(Clone, Debug, PartialEq)]
pub struct ReferenceParams {
    /// Paths for each pixel or point; the noise falls with their square root, the time grows with them.
    pub samples: u32,
    /// Further diffuse bounces after the light's first arrival, as in [`crate::LightParams::bounces`].
    pub max_bounces: u32,
    /// How far paths start off the surfaces, in metres; see [`crate::default_offset_m`].
    pub offset_m: f32,
    /// Picks the random numbers.
    pub seed: u32,
}

impl Default for ReferenceParams {
    fn default() -> Self {
        Self { samples: 256, max_bounces: 4, offset_m: 1e-4, seed: 0 }
    }
}

impl ReferenceParams {
    /// A grainy first look.
    #[must_use]
    pub fn preview() -> Self {
        Self { samples: 16, ..Self::default() }
    }

    /// A picture without visible noise.
    #[must_use]
    pub fn archival() -> Self {
        Self { samples: 4096, max_bounces: 8, ..Self::default() }
    }

    /// Whether every field lies in its range.
    ///
    /// # Errors
    /// [`LightError::Parameter`] names the first that does not.
    pub fn validate(&self) -> Result<(), LightError> {
        let bad = |name, value: String, allowed| Err(LightError::Parameter { name, value, allowed });
        if self.samples == 0 {
            return bad("samples", self.samples.to_string(), "at least 1");
        }
        if self.max_bounces > 1000 {
            return bad("max_bounces", self.max_bounces.to_string(), "at most 1000");
        }
        if !(self.offset_m.is_finite() && self.offset_m >= 0.0) {
            return bad("offset_m", self.offset_m.to_string(), "a finite number of metres, not negative");
        }
        Ok(())
    }
}

/// A rendered picture.
#[derive(Clone, Debug, PartialEq)]
pub struct ReferenceFrame {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Linear radiance, row-major from the top left; where nothing is met, the sky's.
    pub radiance: Vec<Vec3>,
    /// The part of each pixel that shows geometry, 0 to 1.
    pub coverage: Vec<f32>,
}

impl ReferenceFrame {
    /// Whether shapes agree and all numbers are finite.
    ///
    /// # Errors
    /// What is wrong.
    pub fn validate(&self) -> Result<(), LightError> {
        let pixels = self.width as usize * self.height as usize;
        if self.radiance.len() != pixels || self.coverage.len() != pixels {
            return Err(LightError::Mismatch("pixels and size of a picture do not agree".into()));
        }
        if !self.radiance.iter().all(|r| r.is_finite()) || !self.coverage.iter().all(|c| (0.0..=1.0).contains(c)) {
            return Err(LightError::Mismatch("a picture with numbers that are not finite".into()));
        }
        Ok(())
    }
}

/// What paths travel through.
#[derive(Clone, Copy)]
pub(crate) struct Stage<'a> {
    pub surfaces: &'a Surfaces<'a>,
    /// What is seen, where it is not the surfaces.
    pub shape: Option<Shape<'a>>,
    pub sky: &'a dyn Environment,
    pub sun: Option<DirectSun>,
    pub params: &'a ReferenceParams,
}

/// Pixels of a run that one task renders.
const TILE: usize = 256;
/// Paths that are asked for together.
const BATCH: usize = 4096;

/// Renders a picture.
///
/// # Errors
/// Invalid surfaces or parameters; surfaces with [`Detail`](crate::Detail).
pub fn render(
    surfaces: &Surfaces,
    sky: &dyn Environment,
    sun: Option<DirectSun>,
    camera: &Camera,
    params: &ReferenceParams,
) -> Result<ReferenceFrame, LightError> {
    render_through(surfaces, sky, sun, [camera.width, camera.height], &|x, y, within| camera.ray(x, y, within), params)
}

/// The ray through a place of a pixel: its column, its row, and where in it from its top left, in [0, 1).
pub type PixelRay<'a> = &'a (dyn Fn(u32, u32, [f32; 2]) -> Ray + Sync);

/// Renders a picture of `size` columns and rows through any lens.
///
/// # Errors
/// Invalid surfaces or parameters; surfaces with [`Detail`](crate::Detail).
pub fn render_through(
    surfaces: &Surfaces,
    sky: &dyn Environment,
    sun: Option<DirectSun>,
    size: [u32; 2],
    lens: PixelRay,
    params: &ReferenceParams,
) -> Result<ReferenceFrame, LightError> {
    traced(Stage { surfaces, shape: None, sky, sun, params }, size, lens)
}

/// Renders a picture of `shape` that shows the light, the normals and the albedo of `surfaces`, which paths travel through.
///
/// Each place of the shape shows what of the surfaces lies before or behind it along its normal, as far as [`Shape::reach_rad`] allows; where
/// nothing does, what is seen of them straight on. Where that is nothing either, the sky shows, and coverage does not count it.
///
/// # Errors
/// Invalid surfaces, shape or parameters; surfaces with [`Detail`](crate::Detail).
pub fn render_shape(
    shape: Shape,
    surfaces: &Surfaces,
    sky: &dyn Environment,
    sun: Option<DirectSun>,
    camera: &Camera,
    params: &ReferenceParams,
) -> Result<ReferenceFrame, LightError> {
    shape.validate()?;
    let lens: PixelRay = &|x, y, within| camera.ray(x, y, within);
    traced(Stage { surfaces, shape: Some(shape), sky, sun, params }, [camera.width, camera.height], lens)
}

/// Whether surfaces are valid, and rays meet these very triangles: of what they meet the reference asks normals and albedo.
fn only_what_is_met(surfaces: &Surfaces) -> Result<(), LightError> {
    if surfaces.detail.is_some() {
        return Err(LightError::Mismatch("the reference traces the triangles that rays meet, none that stand for them".into()));
    }
    surfaces.validate()
}

fn traced(stage: Stage, size: [u32; 2], lens: PixelRay) -> Result<ReferenceFrame, LightError> {
    only_what_is_met(stage.surfaces)?;
    stage.params.validate()?;
    let [width, height] = size;
    let mut radiance = vec![Vec3::ZERO; width as usize * height as usize];
    let mut coverage = vec![0.0; radiance.len()];
    radiance
        .par_chunks_mut(TILE)
        .zip(coverage.par_chunks_mut(TILE))
        .enumerate()
        .for_each(|(tile, (radiance, coverage))| render_pixels(stage, (width, lens), tile * TILE, radiance, coverage));
    Ok(ReferenceFrame { width, height, radiance, coverage })
}

fn render_pixels(stage: Stage, seen: (u32, PixelRay), first: usize, radiance: &mut [Vec3], coverage: &mut [f32]) {
    let (width, lens) = seen;
    let pixels = radiance.len();
    let at_once = (BATCH / pixels).max(1) as u32;
    let mut met = vec![0_u32; pixels];
    for begin in (0..stage.params.samples).step_by(at_once as usize) {
        let samples = begin..(begin + at_once).min(stage.params.samples);
        let mut samplers: Vec<PathSampler> = samples
            .flat_map(|s| (0..pixels).map(move |p| (p, s)))
            .map(|(p, s)| PathSampler::new(stage.params.seed, (first + p) as u32, s))
            .collect();
        let rays: Vec<Ray> = samplers
            .iter_mut()
            .enumerate()
            .map(|(i, sampler)| {
                let pixel = first + i % pixels;
                let (x, y) = (pixel % width as usize, pixel / width as usize);
                lens(x as u32, y as u32, sampler.first_pair(0))
            })
            .collect();
        let (rays, hits) = match stage.shape {
            Some(shape) => {
                let met = closest(shape.surfaces, &rays);
                shape.shown(stage.surfaces, rays, &met)
            }
            None => {
                let hits = closest(stage.surfaces, &rays);
                (rays, hits)
            }
        };
        let mut starts = Vec::new();
        for (i, (ray, hit)) in rays.iter().zip(&hits).enumerate() {
            if !hit.is_some() {
                radiance[i % pixels] += finite(stage.sky.radiance(ray.direction));
            } else {
                met[i % pixels] += 1;
                let (origin, normal) = stage.surfaces.leave(ray.direction, hit, stage.params.offset_m);
                let albedo = stage.surfaces.reflected_at(hit, Channels::Rgb);
                starts.push((Start { origin, normal, sampler: samplers[i].clone() }, albedo, i % pixels));
            }
        }
        let light = light_at(stage, starts.iter().map(|s| s.0.clone()).collect());
        for ((_, albedo, pixel), light) in starts.into_iter().zip(light) {
            radiance[pixel] += albedo * light;
        }
    }
    let scale = 1.0 / stage.params.samples as f32;
    for ((radiance, coverage), met) in radiance.iter_mut().zip(coverage).zip(met) {
        *radiance *= scale;
        *coverage = met as f32 * scale;
    }
}

/// Light (irradiance / pi) at points with unit normals, sun and sky with all bounces: what a bake stores, traced.
///
/// Rays start `params.offset_m` off each point along its normal.
///
/// # Errors
/// Invalid surfaces or parameters, surfaces with [`Detail`](crate::Detail), or not one normal for each point.
pub fn reference_light_at_points(
    surfaces: &Surfaces,
    sky: &dyn Environment,
    sun: Option<DirectSun>,
    positions: &[Vec3],
    normals: &[Vec3],
    params: &ReferenceParams,
) -> Result<Vec<Vec3>, LightError> {
    only_what_is_met(surfaces)?;
    params.validate()?;
    if positions.len() != normals.len() {
        return Err(LightError::Normals { positions: positions.len(), normals: normals.len() });
    }
    let stage = Stage { surfaces, shape: None, sky, sun, params };
    let at = |point: usize| {
        let mut sum = [0.0_f64; 3];
        for begin in (0..params.samples).step_by(BATCH) {
            let starts = (begin..begin.saturating_add(BATCH as u32).min(params.samples))
                .map(|s| Start {
                    origin: positions[point] + normals[point] * params.offset_m,
                    normal: normals[point],
                    sampler: PathSampler::new(params.seed, point as u32, s),
                })
                .collect();
            for light in light_at(stage, starts) {
                for (sum, x) in sum.iter_mut().zip(light.to_array()) {
                    *sum += f64::from(x);
                }
            }
        }
        Vec3::from_array(sum.map(|x| (x / f64::from(params.samples)) as f32))
    };
    Ok((0..positions.len()).into_par_iter().map(at).collect())
}

/// A radiance, or black where it is not a number: a broken pixel of a probe must not blacken the picture.
pub(crate) fn finite(radiance: Vec3) -> Vec3 {
    if radiance.is_finite() { radiance } else { Vec3::ZERO }
}
