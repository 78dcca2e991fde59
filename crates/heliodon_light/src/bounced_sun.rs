//! What the gather needs to know of the suns whose light bounces.

use crate::gather::{Lattice, gather_unit};
use crate::inside::BACK_LIMIT;
use crate::masks::check_sun_count;
use crate::patches::SunPatches;
use crate::sun_basis::{DayFunctions, day_functions};
use crate::{Layout, LightError, LightParams, Surfaces};
use glam::Vec3;
use heliodon_math::color::luminance;
use rayon::prelude::*;

/// Points whose curves over the day decide the functions of bounced sunlight,
const CURVES: usize = 8192;

/// neighbours in runs of so many, which makes beams of their rays.
const RUN: usize = 8;

/// The suns whose light bounces: where they shine, and the functions of the day that bounced sunlight is told by.
pub struct BouncedSun {
    steps: usize,
    pub(crate) patches: SunPatches,
    pub(crate) day: DayFunctions,
    /// The values of the functions' duals, step by step.
    by_step: Vec<f32>,
}

impl BouncedSun {
    /// Finds out where the suns (unit directions) shine, and from the first bounce at a sample of the points the functions of the day.
    /// `None` where no direction is finite and other than zero.
    ///
    /// # Errors
    /// Invalid parameters or too many suns.
    pub fn new(surfaces: &Surfaces, layout: &Layout, suns: &[Vec3], params: &LightParams) -> Result<Option<Self>, LightError> {
        params.validate()?;
        check_sun_count(suns.len())?;
        if !suns.iter().any(|s| s.is_finite() && *s != Vec3::ZERO) {
            return Ok(None);
        }
        // each step a function of its own, until the curves are known
        let steps = suns.len();
        let every: Vec<Vec<f32>> = (0..steps).map(|t| (0..steps).map(|i| f32::from(u8::from(i == t))).collect()).collect();
        let day = DayFunctions { functions: every.clone(), duals: every, median_error: 0.0, p95_error: 0.0 };
        let patches = SunPatches::new(surfaces, layout, suns, params)?;
        let mut sun = Self { steps, patches, by_step: by_step(&day), day };
        let curves = sun.curves(surfaces, layout, params);
        sun.day = day_functions(&curves, steps, params.sun_functions, params.function_error());
        sun.by_step = by_step(&sun.day);
        Ok(Some(sun))
    }

    /// Functions of the day, R.
    #[must_use]
    pub fn function_count(&self) -> usize {
        self.day.functions.len()
    }

    /// Patches that were asked which suns reach them; each keeps a word, and one more for every 32 suns.
    #[must_use]
    pub fn patch_count(&self) -> usize {
        self.patches.count()
    }

    /// Rays that found out where the suns shine.
    #[must_use]
    pub fn rays(&self) -> u64 {
        self.patches.rays
    }

    /// The first bounce at every step, at some of the points that do not lie inside something.
    fn curves(&self, surfaces: &Surfaces, layout: &Layout, params: &LightParams) -> Vec<f32> {
        let (count, channels, steps) = (layout.front_count(), params.channels.count(), self.steps);
        let lattices = Lattice::all(params);
        let stride = (count / (CURVES / RUN)).max(RUN);
        let runs: Vec<usize> = (0..count).step_by(stride).collect();
        let curves: Vec<Vec<f32>> = runs
            .into_par_iter()
            .map(|first| {
                let range = first..(first + RUN).min(count);
                let unit = gather_unit(surfaces, layout, Some(self), range, params, &lattices);
                let first = unit.first_bounce(params.coefficients * channels, steps * channels);
                let level = |light: &[f32]| luminance(Vec3::from_array(std::array::from_fn(|c| light[c.min(channels - 1)])));
                let mut curves = Vec::new();
                for (i, light) in first.chunks_exact(steps * channels).enumerate() {
                    if unit.scale[i] > 0.0 && unit.back[i] <= BACK_LIMIT {
                        curves.extend(light.chunks_exact(channels).map(|light| level(light) * unit.scale[i]));
                    }
                }
                curves
            })
            .collect();
        curves.concat()
    }

    /// Appends what the curves of all channels are in the functions, function-major, then channel.
    pub(crate) fn project(&self, curves: &[f32], out: &mut Vec<f32>) {
        let channels = self.patches.channels();
        let first = out.len();
        out.resize(first + self.function_count() * channels, 0.0);
        let of_channel = curves.len() / channels;
        let mut sums = vec![0.0; self.function_count()];
        for (channel, curve) in curves.chunks_exact(of_channel).enumerate() {
            self.patches.arch.dispatch(Project { by_step: &self.by_step, curve, sums: &mut sums });
            out[first..].iter_mut().skip(channel).step_by(channels).zip(&sums).for_each(|(out, sum)| *out = *sum);
        }
    }
}

/// Sums over the steps of a curve in all functions at once.
struct Project<'a> {
    by_step: &'a [f32],
    curve: &'a [f32],
    sums: &'a mut [f32],
}

impl pulp::NullaryFnOnce for Project<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        self.sums.fill(0.0);
        for (functions, &light) in self.by_step.chunks_exact(self.sums.len()).zip(self.curve) {
            for (sum, function) in self.sums.iter_mut().zip(functions) {
                *sum += function * light;
            }
        }
    }
}

/// The values of the functions' duals, step by step.
fn by_step(day: &DayFunctions) -> Vec<f32> {
    let steps = day.duals.first().map_or(0, Vec::len);
    (0..steps).flat_map(|t| day.duals.iter().map(move |dual| dual[t])).collect()
}
