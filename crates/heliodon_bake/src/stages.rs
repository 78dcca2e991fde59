//! The stages of a scene's light that are divided into blocks: what a bake does all of, and a shard its part.
//!
//! Where the sun bounces, the gather asks every patch of the surfaces for the suns: sun masks, patches and the curves that decide how the day
//! is told are needed by all blocks of it. A shard does its own of these first, then what others have not done meanwhile.

use crate::blocks::{BlockStage, Share, block_ranges, points_per_block};
use crate::cache::Cache;
use crate::codec::{Decoder, Encoder};
use crate::division::Division;
use crate::earlier::{Earlier, EarlierPoints, leave_places};
use crate::error::BakeError;
use crate::light::LightInput;
use crate::names::PointNames;
use crate::report::Reporter;
use crate::shard::Shard;
use heliodon_light::{
    AXES, BouncedSun, GatherBlock, KnownTraces, Layout, LightParams, MaskParams, PatchPlan, SunMasks, SunOnSurfaces,
    SunlitPatches, Surfaces, Traces, bake_sun_masks_knowing, gather_knowing, light_patches_knowing,
};
use std::ops::Range;

/// What a stage is called for people.
const ON_SURFACES: &str = "sun on surfaces";

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
    /// A stage of it.
    #[must_use]
    pub fn stage(&self, file_stage: &'a str, name: &'a str) -> BlockStage<'a> {
        let share = self.shard.map(|(shard, division)| Share { shard, first: division.first_of(file_stage) });
        BlockStage { cache: self.cache, reporter: self.reporter, file_stage, name, share, told: false }
    }
}

/// Lays out the points of some surfaces; what was found out for it is kept by its name, for shards and their merge all begin with it.
///
/// # Errors
/// Surfaces that the solver refuses, or a cache that cannot be written.
pub fn lay_out(surfaces: &Surfaces, params: &LightParams, name: &str, cache: Option<&Cache>) -> Result<Layout, BakeError> {
    let kept = cache.and_then(|cache| cache.load(name, 0)).and_then(|bytes| Decoder::new(&bytes).run::<u32>());
    let is_kept = kept.is_some();
    let layout = Layout::with_sight(surfaces, params, kept)?;
    if let Some(cache) = cache.filter(|_| !is_kept && !layout.sight().is_empty()) {
        let mut encoder = Encoder::default();
        encoder.run(layout.sight());
        cache.store(name, 0, &encoder.finish())?;
    }
    Ok(layout)
}

/// The stages of some input.
pub struct LightStages<'a> {
    input: &'a LightInput<'a>,
    layout: Layout,
    /// Where the sun bounces.
    patches: Option<PatchPlan>,
    /// What a bake among other geometry has left, and of the points on fronts and in space.
    earlier: Option<&'a Earlier<'a>>,
    earlier_fronts: Option<EarlierPoints<'a>>,
    earlier_space: Option<EarlierPoints<'a>>,
}

/// Points that are asked: what their blocks are called, and what an earlier bake knows of them.
#[derive(Clone, Copy)]
struct Asked<'a> {
    names: &'a PointNames,
    earlier: Option<&'a EarlierPoints<'a>>,
}

impl<'a> LightStages<'a> {
    /// The stages that some input needs; `layout` has the points on its fronts, `earlier` is a bake among other geometry.
    #[must_use]
    pub fn new(input: &'a LightInput<'a>, layout: Layout, earlier: Option<&'a Earlier<'a>>) -> Self {
        let bounces = input.sun_bounce && BouncedSun::any(input.suns);
        let patches = bounces.then(|| PatchPlan::new(&input.surfaces, &layout, input.params));
        let points = |in_space: bool| earlier.and_then(|earlier| earlier.points(in_space, input.suns.len()));
        let (earlier_fronts, earlier_space) = (points(false), points(true));
        Self { input, layout, patches, earlier, earlier_fronts, earlier_space }
    }

    fn fronts_asked(&self) -> Asked<'_> {
        Asked { names: &self.input.names.fronts, earlier: self.earlier_fronts.as_ref() }
    }

    fn space_asked(&self) -> Asked<'_> {
        Asked { names: &self.input.names.space, earlier: self.earlier_space.as_ref() }
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
        let (fronts, names) = (0..self.layout.front_count(), self.input.names);
        division.add(&names.fronts.masks, self.mask_ranges(fronts.clone()).len());
        if let Some(plan) = &self.patches {
            division.add(&names.patches, self.patch_ranges(plan).len());
            division.add(&names.curves, self.curve_ranges().len());
        }
        division.add(&names.fronts.gather, self.gather_ranges(fronts).len());
        let space = self.space_range();
        if !space.is_empty() {
            division.add(&names.space.gather, self.gather_ranges(space.clone()).len());
            division.add(&names.space.masks, self.mask_ranges(space).len());
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
            let stage = work.stage(&self.input.names.fronts.masks, "sun masks");
            let compute = |range| self.masks_of(&self.layout, range, self.fronts_asked(), &stage);
            done += stage.run_own(&ranges, compute, |masks| encode_masks(masks))?;
            None
        };
        let sun = sun.as_ref();
        let ranges = self.gather_ranges(fronts);
        let stage = work.stage(&self.input.names.fronts.gather, "sky transfer");
        let seen = |range| self.seen(&self.layout, range, sun, (self.fronts_asked(), &stage));
        done += stage.run_own(&ranges, seen, |block| stored(block, &self.layout, self.input.params))?;
        let space = self.space_range();
        if !space.is_empty() {
            let layout = self.space_layout();
            let ranges = self.gather_ranges(space.clone());
            let stage = work.stage(&self.input.names.space.gather, "light of space");
            let seen = |range| self.seen(&layout, range, sun, (self.space_asked(), &stage));
            done += stage.run_own(&ranges, seen, |block| stored(block, &layout, self.input.params))?;
            let ranges = self.mask_ranges(space);
            let stage = work.stage(&self.input.names.space.masks, "sun in space");
            let compute = |range| self.masks_of(&layout, range, self.space_asked(), &stage);
            done += stage.run_own(&ranges, compute, |masks| encode_masks(masks))?;
        }
        Ok(done)
    }

    /// Sun masks of the points on fronts.
    ///
    /// # Errors
    /// As [`LightStages::run_own`].
    pub fn masks(&self, work: &Work) -> Result<SunMasks, BakeError> {
        let (asked, fronts) = (self.fronts_asked(), 0..self.layout.front_count());
        if let Some(cache) = work.cache {
            leave_places(self.layout.points(), fronts.clone(), &asked.names.places, cache)?;
        }
        self.all_masks(&self.layout, fronts, asked, &work.stage(&asked.names.masks, "sun masks"))
    }

    /// Where the suns shine, if their light bounces; to be asked once.
    ///
    /// # Errors
    /// As [`LightStages::run_own`].
    pub fn sun(&mut self, work: &Work, masks: &SunMasks) -> Result<Option<BouncedSun>, BakeError> {
        let Some(plan) = self.patches.take() else { return Ok(None) };
        let (input, suns) = (self.input, self.input.suns);
        let before = self.earlier.and_then(|earlier| earlier.patches(input));
        if let Some(cache) = work.cache.filter(|cache| !cache.has(&input.names.plan, 0)) {
            let mut encoder = Encoder::default();
            encoder.number(u64::from(input.params.offset_m.to_bits())).run(&plan.parts());
            cache.store(&input.names.plan, 0, &encoder.finish())?;
        }
        let lit = work.stage(&input.names.patches, ON_SURFACES).run(
            &self.patch_ranges(&plan),
            0,
            |bytes, range| {
                let (rays, words) = decode_masks(bytes)?;
                let lit = SunlitPatches { range: range.clone(), rays, words };
                lit.validate(&plan, suns.len()).is_ok().then_some(lit)
            },
            |range| {
                let before = before.as_ref();
                let (lit, traced) = light_patches_knowing(&input.surfaces, &plan, suns, range, input.params, before)?;
                if let Some(cache) = work.cache {
                    cache.tell_rays(ON_SURFACES, lit.rays - traced, lit.rays);
                }
                Ok::<_, BakeError>(lit)
            },
            |lit| encode_words(lit.rays, &lit.words),
        )?;
        let sun = SunOnSurfaces::new(&input.surfaces, &self.layout, plan, suns, lit, masks, input.params)?;
        let curves: Vec<Vec<f32>> = work.stage(&input.names.curves, "the day's curves").run(
            &self.curve_ranges(),
            0,
            |bytes, _| {
                let mut decoder = Decoder::new(bytes);
                let curves: Vec<f32> = decoder.run()?;
                let fits = curves.len().is_multiple_of(suns.len()) && curves.iter().all(|x| x.is_finite());
                (fits && decoder.is_empty()).then_some(curves)
            },
            |runs| self.curves(&sun, runs, work.cache),
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
        let stage = work.stage(&self.input.names.space.gather, "light of space");
        let asked = self.space_asked();
        if let Some(cache) = work.cache {
            leave_places(layout.points(), points.clone(), &asked.names.places, cache)?;
        }
        let blocks = self.gather(&layout, points.clone(), (asked, &stage), 0, sun)?;
        let masks = self.all_masks(&layout, points, asked, &work.stage(&asked.names.masks, "sun in space"))?;
        Ok(Some((blocks, masks)))
    }

    /// Gathers the points on fronts.
    ///
    /// # Errors
    /// As [`LightStages::run_own`].
    pub fn fronts(&self, work: &Work, sun: Option<&BouncedSun>) -> Result<Vec<GatherBlock>, BakeError> {
        let asked = self.fronts_asked();
        let stage = work.stage(&asked.names.gather, "sky transfer");
        self.gather(&self.layout, 0..self.layout.front_count(), (asked, &stage), 0, sun)
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
            let stage = work.stage(&self.input.names.fronts.gather, "back sides");
            blocks.extend(self.gather(&self.layout, points, (self.fronts_asked(), &stage), blocks.len(), sun)?);
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
        (asked, stage): (Asked, &BlockStage),
        first_block: usize,
        sun: Option<&BouncedSun>,
    ) -> Result<Vec<GatherBlock>, BakeError> {
        let params = self.input.params;
        let functions = sun.map_or(0, BouncedSun::function_count);
        stage.run(
            &self.gather_ranges(points),
            first_block,
            |bytes, range| {
                let mut block = GatherBlock::from_bytes(bytes).ok()?;
                let fits = block.range == *range && block.validate(layout, functions, params).is_ok();
                block.stay_within_budget(layout, params);
                fits.then_some(block)
            },
            |range| self.seen(layout, range, sun, (asked, stage)),
            |block| stored(block, layout, params),
        )
    }

    /// Gathers a block. Rays of which an earlier gather of the same points tells are not traced; what all of them met is kept for the next.
    fn seen(
        &self,
        layout: &Layout,
        range: Range<usize>,
        sun: Option<&BouncedSun>,
        (Asked { names, earlier }, stage): (Asked, &BlockStage),
    ) -> Result<GatherBlock, BakeError> {
        let (surfaces, params, paths) = (&self.input.surfaces, self.input.params, self.input.names.paths);
        let kept = stage.cache.and_then(|cache| cache.load(&names.traces, range.start));
        let known = kept.and_then(|bytes| decode_traces(&bytes, paths)?.pop());
        let known = known.filter(|known| known.validate(&range, surfaces, params).is_ok()).map(KnownTraces::from);
        let known = known.or_else(|| earlier?.traces(layout.points(), &range, params));
        let first = range.start;
        let (mut block, traces) = gather_knowing(surfaces, layout, sun, range, params, known)?;
        if stage.cache.is_none() {
            block.stay_within_budget(layout, params);
        }
        if let Some(cache) = stage.cache {
            cache.tell_rays(stage.name, block.rays - traces.traced, block.rays);
            if traces.traced > 0 {
                cache.store(&names.traces, first, &encode_traces(&[traces], paths))?;
            }
        }
        Ok(block)
    }

    /// The curves of some runs of points, as [`LightStages::seen`] with regard to what is known.
    fn curves(&self, sun: &SunOnSurfaces, runs: Range<usize>, cache: Option<&Cache>) -> Result<Vec<f32>, BakeError> {
        let (input, first) = (self.input, runs.start);
        let (name, paths) = (&input.names.curve_traces, input.names.paths);
        let known = cache.and_then(|cache| cache.load(name, first)).and_then(|bytes| decode_traces(&bytes, paths));
        let (curves, traces) = sun.curves_knowing(&input.surfaces, &self.layout, runs, input.params, known);
        if let Some(cache) = cache.filter(|_| traces.iter().any(|traces| traces.traced > 0)) {
            cache.store(name, first, &encode_traces(&traces, paths))?;
        }
        Ok(curves)
    }

    fn masks_of(&self, layout: &Layout, range: Range<usize>, asked: Asked, stage: &BlockStage) -> Result<SunMasks, BakeError> {
        let (input, params) = (self.input, MaskParams::default());
        let before = asked.earlier.and_then(|earlier| earlier.masks(layout.points(), &range));
        let points = layout.points();
        let (masks, traced) = bake_sun_masks_knowing(&input.surfaces, points, input.suns, range, &params, before.as_ref())?;
        if let Some(cache) = stage.cache {
            cache.tell_rays(stage.name, masks.rays - traced, masks.rays);
        }
        Ok(masks)
    }

    fn all_masks(
        &self,
        layout: &Layout,
        points: Range<usize>,
        asked: Asked,
        stage: &BlockStage,
    ) -> Result<SunMasks, BakeError> {
        let steps = self.input.suns.len() as u32;
        let parts = stage.run(
            &self.mask_ranges(points),
            0,
            |bytes, range| {
                let (rays, words) = decode_masks(bytes)?;
                let masks = SunMasks { steps, rays, words };
                let fits = masks.words.len() == range.len() * masks.words_per_point() && masks.validate().is_ok();
                fits.then_some(masks)
            },
            |range| self.masks_of(layout, range, asked, stage),
            |masks| encode_masks(masks),
        )?;
        let mut all = SunMasks { steps, ..SunMasks::default() };
        all.words.reserve_exact(parts.iter().map(|part| part.words.len()).sum());
        for part in &parts {
            all.append(part)?;
        }
        Ok(all)
    }
}

/// A block's bytes with all its hits, where bounces find those that there is no room for.
fn stored(block: &mut GatherBlock, layout: &Layout, params: &LightParams) -> Vec<u8> {
    let bytes = block.to_bytes();
    block.stay_within_budget(layout, params);
    bytes
}

/// Traces as bytes, with what their paths depend on.
fn encode_traces(traces: &[Traces], paths: u64) -> Vec<u8> {
    let mut encoder = Encoder::default();
    encoder.run(&[paths, traces.len() as u64]);
    for traces in traces {
        encoder.run(&traces.to_bytes());
    }
    encoder.finish()
}

/// Traces from their bytes; followed paths only where they are those of `paths`.
pub(crate) fn decode_traces(bytes: &[u8], paths: u64) -> Option<Vec<Traces>> {
    let mut decoder = Decoder::new(bytes);
    let [of_paths, count] = decoder.run::<u64>()?[..] else { return None };
    let traces = (0..count).map(|_| Traces::from_bytes(&decoder.run::<u8>()?).ok());
    let traces: Vec<Traces> = traces.collect::<Option<_>>()?;
    Some(if of_paths == paths { traces } else { traces.into_iter().map(Traces::without_paths).collect() })
}

pub(crate) fn encode_masks(masks: &SunMasks) -> Vec<u8> {
    encode_words(masks.rays, &masks.words)
}

fn encode_words(rays: u64, words: &[u32]) -> Vec<u8> {
    let mut encoder = Encoder::default();
    encoder.number(rays).run(words);
    encoder.finish()
}

/// The number of rays and the words of masks.
pub(crate) fn decode_masks(bytes: &[u8]) -> Option<(u64, Vec<u32>)> {
    let mut decoder = Decoder::new(bytes);
    let (rays, words) = (decoder.number()?, decoder.run()?);
    decoder.is_empty().then_some((rays, words))
}
