//! The stages of a scene's light that are divided into blocks: what a bake does all of, and a shard its part.
//!
//! Where the sun bounces, the gather asks every patch of the surfaces for the suns: sun masks, patches and the curves that decide how the day
//! is told are needed by all blocks of it. A shard does its own of these first, then what others have not done meanwhile.

use crate::blocks::{BlockStage, Share, block_ranges, points_per_block};
use crate::cache::Cache;
use crate::codec::{Decoder, Encoder};
use crate::division::Division;
use crate::error::BakeError;
use crate::grid::GridPlan;
use crate::light::LightInput;
use crate::report::Reporter;
use crate::shard::Shard;
use heliodon_light::{
    AXES, BouncedSun, GatherBlock, Layout, LightParams, MaskParams, PatchPlan, SunMasks, SunOnSurfaces, SunlitPatches,
    Surfaces, bake_sun_masks, gather, light_patches,
};
use std::ops::Range;

const SIGHT: &str = "sight";
const MASKS: &str = "masks";
const PATCHES: &str = "patches";
const CURVES: &str = "curves";
const GATHER: &str = "gather";

/// Runs of points whose curves are one block: all of them are about a twelfth of a small gather, and cost less where that is larger.
const RUNS_PER_BLOCK: usize = 32;

/// Where blocks are kept, who hears of them, and whose they are.
#[derive(Clone, Copy)]
pub struct Work<'a> {
    /// Where finished blocks are kept; `None` keeps none.
    pub cache: Option<&'a Cache>,
    /// Told of progress.
    pub reporter: &'a dyn Reporter,
    /// The shard that works, and the division of which it is a part.
    pub shard: Option<(Shard, &'a Division)>,
}

impl<'a> Work<'a> {
    fn stage(&self, file_stage: &'a str, name: &'a str) -> BlockStage<'a> {
        let share = self.shard.map(|(shard, division)| Share { shard, first: division.first_of(file_stage) });
        BlockStage { cache: self.cache, reporter: self.reporter, file_stage, name, share }
    }
}

/// Names of the grid's files in the cache: other points have other names.
pub struct GridNames {
    /// What the points see.
    pub gather: String,
    /// Their sun masks.
    pub masks: String,
    /// Their light.
    pub result: String,
}

impl GridNames {
    /// Those of a grid.
    #[must_use]
    pub fn new(grid: &GridPlan) -> Self {
        let name = |what: &str| format!("grid-{}-{what}", grid.digits());
        Self { gather: name("gather"), masks: name("masks"), result: name("light") }
    }
}

/// Lays out the points of some surfaces; what was found out for it is kept, for shards and their merge all begin with it.
///
/// # Errors
/// Surfaces that the solver refuses, or a cache that cannot be written.
pub fn lay_out(surfaces: &Surfaces, params: &LightParams, cache: Option<&Cache>) -> Result<Layout, BakeError> {
    let kept = cache.and_then(|cache| cache.load(SIGHT, 0)).and_then(|bytes| Decoder::new(&bytes).run::<u32>());
    let is_kept = kept.is_some();
    let layout = Layout::with_sight(surfaces, params, kept)?;
    if let Some(cache) = cache.filter(|_| !is_kept && !layout.sight().is_empty()) {
        let mut encoder = Encoder::default();
        encoder.run(layout.sight());
        cache.store(SIGHT, 0, &encoder.finish())?;
    }
    Ok(layout)
}

/// The stages of some input.
pub struct LightStages<'a> {
    input: &'a LightInput<'a>,
    layout: Layout,
    /// Where the sun bounces.
    patches: Option<PatchPlan>,
    names: GridNames,
}

impl<'a> LightStages<'a> {
    /// The stages that some input needs; `layout` has the points on its fronts.
    #[must_use]
    pub fn new(input: &'a LightInput<'a>, layout: Layout) -> Self {
        let bounces = input.sun_bounce && BouncedSun::any(input.suns);
        let patches = bounces.then(|| PatchPlan::new(&input.surfaces, &layout, input.params));
        Self { input, layout, patches, names: GridNames::new(input.grid) }
    }

    /// The layout, without points in space, once all stages are done.
    #[must_use]
    pub fn into_layout(self) -> Layout {
        self.layout
    }

    /// The points in space, behind those on fronts: what they see does not depend on the back sides that come between later.
    fn space_range(&self) -> Range<usize> {
        let first = self.layout.front_count();
        first..first + AXES.len() * self.input.grid.cells.len()
    }

    /// The points on fronts, and those in space.
    fn space_layout(&self) -> Layout {
        let mut layout = self.layout.clone();
        layout.add_free_points(&self.input.grid.places());
        layout
    }

    /// Adds the stages to a bake's division.
    pub fn divide(&self, division: &mut Division) {
        let fronts = 0..self.layout.front_count();
        division.add(MASKS, self.mask_ranges(fronts.clone()).len());
        if let Some(plan) = &self.patches {
            division.add(PATCHES, self.patch_ranges(plan).len());
            division.add(CURVES, self.curve_ranges().len());
        }
        division.add(GATHER, self.gather_ranges(fronts).len());
        let space = self.space_range();
        if !space.is_empty() {
            division.add(&self.names.gather, self.gather_ranges(space.clone()).len());
            division.add(&self.names.masks, self.mask_ranges(space).len());
        }
    }

    /// Does a shard's own blocks; returns how many of them it has done now.
    ///
    /// # Errors
    /// Input that the solver refuses, or a cache that cannot be written.
    pub fn run_own(mut self, work: &Work) -> Result<usize, BakeError> {
        let fronts = 0..self.layout.front_count();
        let mut done = 0;
        let sun = if self.patches.is_some() {
            let masks = self.masks(work)?;
            self.sun(work, &masks)?
        } else {
            let ranges = self.mask_ranges(fronts.clone());
            let compute = |range| self.masks_of(&self.layout, range);
            done += work.stage(MASKS, "sun masks").run_own(&ranges, compute, encode_masks)?;
            None
        };
        let (input, sun) = (self.input, sun.as_ref());
        let seen = |layout: &Layout, range| gather(&input.surfaces, layout, sun, range, input.params).map_err(BakeError::from);
        let ranges = self.gather_ranges(fronts);
        let stage = work.stage(GATHER, "sky transfer");
        done += stage.run_own(&ranges, |range| seen(&self.layout, range), GatherBlock::to_bytes)?;
        let space = self.space_range();
        if !space.is_empty() {
            let layout = self.space_layout();
            let ranges = self.gather_ranges(space.clone());
            let stage = work.stage(&self.names.gather, "light of space");
            done += stage.run_own(&ranges, |range| seen(&layout, range), GatherBlock::to_bytes)?;
            let ranges = self.mask_ranges(space);
            let stage = work.stage(&self.names.masks, "sun in space");
            done += stage.run_own(&ranges, |range| self.masks_of(&layout, range), encode_masks)?;
        }
        Ok(done)
    }

    /// Sun masks of the points on fronts.
    ///
    /// # Errors
    /// As [`LightStages::run_own`].
    pub fn masks(&self, work: &Work) -> Result<SunMasks, BakeError> {
        self.all_masks(&self.layout, 0..self.layout.front_count(), &work.stage(MASKS, "sun masks"))
    }

    /// Where the suns shine, if their light bounces; to be asked once.
    ///
    /// # Errors
    /// As [`LightStages::run_own`].
    pub fn sun(&mut self, work: &Work, masks: &SunMasks) -> Result<Option<BouncedSun>, BakeError> {
        let Some(plan) = self.patches.take() else { return Ok(None) };
        let (input, suns) = (self.input, self.input.suns);
        let lit = work.stage(PATCHES, "sun on surfaces").run(
            &self.patch_ranges(&plan),
            0,
            |bytes, range| {
                let mut decoder = Decoder::new(bytes);
                let lit = SunlitPatches { range: range.clone(), rays: decoder.number()?, words: decoder.run()? };
                (decoder.is_empty() && lit.validate(&plan, suns.len()).is_ok()).then_some(lit)
            },
            |range| light_patches(&input.surfaces, &plan, suns, range, input.params).map_err(BakeError::from),
            |lit| {
                let mut encoder = Encoder::default();
                encoder.number(lit.rays).run(&lit.words);
                encoder.finish()
            },
        )?;
        let sun = SunOnSurfaces::new(&self.layout, plan, suns, lit, masks, input.params)?;
        let curves: Vec<Vec<f32>> = work.stage(CURVES, "the day's curves").run(
            &self.curve_ranges(),
            0,
            |bytes, _| {
                let mut decoder = Decoder::new(bytes);
                let curves: Vec<f32> = decoder.run()?;
                let fits = curves.len().is_multiple_of(suns.len()) && curves.iter().all(|x| x.is_finite());
                (fits && decoder.is_empty()).then_some(curves)
            },
            |runs| Ok::<_, BakeError>(sun.curves(&input.surfaces, &self.layout, runs, input.params)),
            |curves| {
                let mut encoder = Encoder::default();
                encoder.run(curves);
                encoder.finish()
            },
        )?;
        Ok(Some(sun.told_by(&curves.concat(), input.params)))
    }

    /// Gathers the points in space, to be moved behind the back sides, and asks them for the suns.
    ///
    /// # Errors
    /// As [`LightStages::run_own`].
    pub fn space(&self, work: &Work, sun: Option<&BouncedSun>) -> Result<Option<(Vec<GatherBlock>, SunMasks)>, BakeError> {
        let points = self.space_range();
        if points.is_empty() {
            return Ok(None);
        }
        let layout = self.space_layout();
        let stage = work.stage(&self.names.gather, "light of space");
        let blocks = self.gather(&layout, points.clone(), &stage, 0, sun)?;
        let masks = self.all_masks(&layout, points, &work.stage(&self.names.masks, "sun in space"))?;
        Ok(Some((blocks, masks)))
    }

    /// Gathers the points on fronts.
    ///
    /// # Errors
    /// As [`LightStages::run_own`].
    pub fn fronts(&self, work: &Work, sun: Option<&BouncedSun>) -> Result<Vec<GatherBlock>, BakeError> {
        self.gather(&self.layout, 0..self.layout.front_count(), &work.stage(GATHER, "sky transfer"), 0, sun)
    }

    /// Gives the back sides that rays have met points of their own, and gathers those, as often as it takes.
    ///
    /// # Errors
    /// As [`LightStages::run_own`].
    pub fn back_sides(
        &mut self,
        work: &Work,
        sun: Option<&BouncedSun>,
        blocks: &mut Vec<GatherBlock>,
    ) -> Result<(), BakeError> {
        loop {
            let points = self.layout.add_back_sides(&self.input.surfaces, blocks, self.input.params);
            if points.is_empty() {
                return Ok(());
            }
            let stage = work.stage(GATHER, "back sides");
            blocks.extend(self.gather(&self.layout, points, &stage, blocks.len(), sun)?);
        }
    }

    fn gather_ranges(&self, points: Range<usize>) -> Vec<Range<usize>> {
        let per_block = points_per_block(points.len(), u64::from(self.input.params.samples));
        block_ranges(points, per_block).collect()
    }

    fn mask_ranges(&self, points: Range<usize>) -> Vec<Range<usize>> {
        // half of the suns stand behind a surface, on average
        let per_block = points_per_block(points.len(), (self.input.suns.len() as u64).div_ceil(2));
        block_ranges(points, per_block).collect()
    }

    fn patch_ranges(&self, plan: &PatchPlan) -> Vec<Range<usize>> {
        let patches = plan.patch_count(0..plan.triangle_count());
        plan.ranges(points_per_block(patches, (self.input.suns.len() as u64).div_ceil(2)))
    }

    fn curve_ranges(&self) -> Vec<Range<usize>> {
        block_ranges(0..SunOnSurfaces::curve_runs(&self.layout), RUNS_PER_BLOCK).collect()
    }

    /// Gathers a range of points in blocks, the first of which has the number `first_block`.
    fn gather(
        &self,
        layout: &Layout,
        points: Range<usize>,
        stage: &BlockStage,
        first_block: usize,
        sun: Option<&BouncedSun>,
    ) -> Result<Vec<GatherBlock>, BakeError> {
        let (surfaces, params) = (&self.input.surfaces, self.input.params);
        let functions = sun.map_or(0, BouncedSun::function_count);
        stage.run(
            &self.gather_ranges(points),
            first_block,
            |bytes, range| {
                let block = GatherBlock::from_bytes(bytes).ok()?;
                (block.range == *range && block.validate(layout, functions, params).is_ok()).then_some(block)
            },
            |range| gather(surfaces, layout, sun, range, params).map_err(BakeError::from),
            GatherBlock::to_bytes,
        )
    }

    fn masks_of(&self, layout: &Layout, range: Range<usize>) -> Result<SunMasks, BakeError> {
        let (input, params) = (self.input, MaskParams::default());
        bake_sun_masks(&input.surfaces, layout.points(), input.suns, range, &params).map_err(BakeError::from)
    }

    fn all_masks(&self, layout: &Layout, points: Range<usize>, stage: &BlockStage) -> Result<SunMasks, BakeError> {
        let steps = self.input.suns.len() as u32;
        let parts = stage.run(
            &self.mask_ranges(points),
            0,
            |bytes, range| {
                let mut decoder = Decoder::new(bytes);
                let masks = SunMasks { steps, rays: decoder.number()?, words: decoder.run()? };
                let fits = masks.words.len() == range.len() * masks.words_per_point() && masks.validate().is_ok();
                (fits && decoder.is_empty()).then_some(masks)
            },
            |range| self.masks_of(layout, range),
            encode_masks,
        )?;
        let mut all = SunMasks { steps, ..SunMasks::default() };
        all.words.reserve_exact(parts.iter().map(|part| part.words.len()).sum());
        for part in &parts {
            all.append(part)?;
        }
        Ok(all)
    }
}

fn encode_masks(masks: &SunMasks) -> Vec<u8> {
    let mut encoder = Encoder::default();
    encoder.number(masks.rays).run(&masks.words);
    encoder.finish()
}
