//! What the gather needs to know of the suns whose light bounces.

use crate::gather::{Lattice, gather_unit};
use crate::inside::BACK_LIMIT;
use crate::masks::check_sun_count;
use crate::patches::SunPatches;
use crate::sun_basis::{DayFunctions, day_functions};
use crate::traces::KnownUnit;
use crate::{
    Layout, LightError, LightParams, MaskParams, PatchPlan, SunMasks, SunlitPatches, Surfaces, Traces, bake_sun_masks,
    light_patches,
};
use glam::Vec3;
use heliodon_math::color::luminance;
use rayon::prelude::*;
use std::ops::Range;

/// So many runs of neighbouring points are asked for the curves over the day that decide the functions of bounced sunlight.
const CURVE_RUNS: usize = 1024;

/// The suns whose light bounces: where they shine, and the functions of the day that bounced sunlight is told by.
pub struct BouncedSun {
    steps: usize,
    pub(crate) patches: SunPatches,
    pub(crate) day: DayFunctions,
    /// The values of the functions' duals, step by step.
    by_step: Vec<f32>,
}

/// What the rays of some runs of points met, run by run.
pub type CurveRuns = Vec<Traces>;

/// Where the suns shine, before it is known how the day is best told: a sample of the points' curves over the day decides that.
pub struct SunOnSurfaces(BouncedSun);

impl SunOnSurfaces {
    /// Puts together what patches ([`light_patches`], all of the plan's triangles in order) and the layout's points on fronts
    /// ([`bake_sun_masks`]) know of the suns.
    ///
    /// # Errors
    /// Parts that do not belong together.
    pub fn new(
        surfaces: &Surfaces,
        layout: &Layout,
        plan: PatchPlan,
        suns: &[Vec3],
        lit: Vec<SunlitPatches>,
        fronts: &SunMasks,
        params: &LightParams,
    ) -> Result<Self, LightError> {
        let steps = suns.len();
        // each step a function of its own
        let every: Vec<Vec<f32>> = (0..steps).map(|t| (0..steps).map(|i| f32::from(u8::from(i == t))).collect()).collect();
        let day = DayFunctions { functions: every.clone(), duals: every, median_error: 0.0, p95_error: 0.0 };
        let patches = SunPatches::new(surfaces, layout, plan, suns, lit, fronts, params)?;
        Ok(Self(BouncedSun { steps, patches, by_step: by_step(&day), day }))
    }

    /// Runs of neighbouring points whose curves decide, all of them on what is shown ([`crate::Detail`]) where that has any; ranges of
    /// them may be asked apart.
    #[must_use]
    pub fn curve_runs(layout: &Layout) -> usize {
        layout.spread_runs(CURVE_RUNS).len()
    }

    /// The first bounce at every step, at the points of some runs that do not lie inside something. Curves of consecutive ranges, one after the
    /// other, are those of all runs.
    #[must_use]
    pub fn curves(&self, surfaces: &Surfaces, layout: &Layout, runs: Range<usize>, params: &LightParams) -> Vec<f32> {
        self.curves_knowing(surfaces, layout, runs, params, None).0
    }

    /// As [`SunOnSurfaces::curves`], which traces only rays that are not `known` of the same runs; what all of them met comes back, run by
    /// run.
    #[must_use]
    pub fn curves_knowing(
        &self,
        surfaces: &Surfaces,
        layout: &Layout,
        runs: Range<usize>,
        params: &LightParams,
        known: Option<CurveRuns>,
    ) -> (Vec<f32>, CurveRuns) {
        let (channels, steps) = (params.channels.count(), self.0.steps);
        let lattices = Lattice::all(params);
        let ranges = layout.spread_runs(CURVE_RUNS)[runs].to_vec();
        let fits = |known: &CurveRuns| {
            let same = |(traces, range): (&Traces, &Range<usize>)| traces.validate(range, surfaces, params).is_ok();
            known.len() == ranges.len() && known.iter().zip(&ranges).all(same)
        };
        let known: Vec<Option<Traces>> = match known.filter(fits) {
            Some(known) => known.into_iter().map(Some).collect(),
            None => vec![None; ranges.len()],
        };
        let done: Vec<(Vec<f32>, Traces)> = ranges
            .into_par_iter()
            .zip(known)
            .map(|(range, known)| {
                let known = known.and_then(|mut known| known.units.pop().flatten()).map(KnownUnit::from);
                let (unit, of_unit) =
                    gather_unit(surfaces, layout.own(), Some(&self.0), range.clone(), params, &lattices, known);
                let first = unit.first_bounce(params.coefficients * channels, steps * channels);
                let level = |light: &[f32]| luminance(Vec3::from_array(std::array::from_fn(|c| light[c.min(channels - 1)])));
                let mut curves = Vec::new();
                for (i, light) in first.chunks_exact(steps * channels).enumerate() {
                    if unit.scale[i] > 0.0 && unit.back[i] <= BACK_LIMIT {
                        curves.extend(light.chunks_exact(channels).map(|light| level(light) * unit.scale[i]));
                    }
                }
                (curves, Traces { range, units: vec![Some(of_unit)], traced: unit.rays.traced })
            })
            .collect();
        let (curves, traces): (Vec<_>, Vec<_>) = done.into_iter().unzip();
        (curves.concat(), traces)
    }

    /// Tells the day by the functions that the curves of all runs ask for.
    #[must_use]
    pub fn told_by(self, curves: &[f32], params: &LightParams) -> BouncedSun {
        let mut sun = self.0;
        sun.day = day_functions(curves, sun.steps, params.sun_functions, params.function_error());
        sun.by_step = by_step(&sun.day);
        sun
    }
}

impl BouncedSun {
    /// Finds out where the suns (unit directions) shine, and from the first bounce at a sample of the points the functions of the day: all
    /// that [`SunOnSurfaces`] does in parts. `None` where no sun shines ([`BouncedSun::any`]).
    ///
    /// # Errors
    /// Invalid parameters or too many suns.
    pub fn new(surfaces: &Surfaces, layout: &Layout, suns: &[Vec3], params: &LightParams) -> Result<Option<Self>, LightError> {
        params.validate()?;
        check_sun_count(suns.len())?;
        if !Self::any(suns) {
            return Ok(None);
        }
        let plan = PatchPlan::new(surfaces, layout, params);
        let lit = vec![light_patches(surfaces, &plan, suns, 0..plan.triangle_count(), params)?];
        let fronts = bake_sun_masks(surfaces, layout.points(), suns, 0..layout.front_count(), &MaskParams::default())?;
        let sun = SunOnSurfaces::new(surfaces, layout, plan, suns, lit, &fronts, params)?;
        let curves = sun.curves(surfaces, layout, 0..SunOnSurfaces::curve_runs(layout), params);
        Ok(Some(sun.told_by(&curves, params)))
    }

    /// Whether a direction is finite and other than zero: that of a sun which shines.
    #[must_use]
    pub fn any(suns: &[Vec3]) -> bool {
        suns.iter().any(|s| s.is_finite() && *s != Vec3::ZERO)
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

    /// Rays that the patches were asked with.
    #[must_use]
    pub fn rays(&self) -> u64 {
        self.patches.rays
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
