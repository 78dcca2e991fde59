//! The light of all vertices, and of the light grid: sun masks, gather, bounces, in blocks that survive a kill.

use crate::blocks::{BlockStage, block_ranges, points_per_block};
use crate::cache::Cache;
use crate::codec::{Decoder, Encoder};
use crate::error::BakeError;
use crate::grid::GridPlan;
use crate::report::Reporter;
use glam::Vec3;
use heliodon_light::{
    BouncedSun, Channels, GatherBlock, LatticeLight, Layout, LightParams, MaskParams, SunBounce, SunMasks, Surfaces, Validity,
    VertexLight, bake_sun_masks, gather, solve_all, vertex_masks,
};
use std::ops::Range;

/// What is solved.
pub struct LightInput<'a> {
    /// The geometry.
    pub surfaces: Surfaces<'a>,
    /// Unit directions to the sun, one for each sun step; zero where the step has no sun.
    pub suns: &'a [Vec3],
    /// Whether the sun's bounced light is solved.
    pub sun_bounce: bool,
    /// How finely.
    pub params: &'a LightParams,
    /// Points in space that are lit, too.
    pub grid: &'a GridPlan,
}

/// What came of it.
#[derive(Debug)]
pub struct BakedLight {
    /// Transfer, bounced sunlight, validity.
    pub light: VertexLight,
    /// Sun masks of the vertices.
    pub masks: SunMasks,
    /// Points that were solved: vertices, sub-cells, back sides.
    pub points: u64,
    /// Rays of the gather.
    pub gather_rays: u64,
    /// Rays to the suns: from the vertices, and from the patches of the surfaces that they bounce off.
    pub mask_rays: u64,
    /// The light grid, where there is one.
    pub grid: Option<BakedGrid>,
}

/// The light of the points in space.
#[derive(Clone, Debug, PartialEq)]
pub struct BakedGrid {
    /// It.
    pub light: LatticeLight,
    /// Rays of their gather.
    pub gather_rays: u64,
    /// Rays from them to the suns.
    pub mask_rays: u64,
}

/// Solves everything, going on from what `cache` holds of an earlier run.
///
/// # Errors
/// Input that the solver refuses, or a cache that cannot be written.
pub fn bake_light(input: &LightInput, cache: Option<&Cache>, reporter: &dyn Reporter) -> Result<BakedLight, BakeError> {
    let (surfaces, params) = (&input.surfaces, input.params);
    let mut layout = Layout::new(surfaces, params)?;
    let grid_stage = GridStage::new(input.grid);
    let done = cache.and_then(|cache| cache.load("light", 0)).and_then(|bytes| decode_light(&bytes, &layout, input));
    let grid_done = cache.and_then(|cache| cache.load(&grid_stage.result, 0)).and_then(|bytes| decode_grid(&bytes, input));
    let done = match (done, grid_done) {
        (Some(done), None) if input.grid.is_empty() => Some(done),
        (Some(done), Some(grid)) => Some(BakedLight { grid: Some(grid), ..done }),
        _ => None,
    };
    if let Some(done) = done {
        reporter.note("going on: the light is solved, the bundle remains to be written");
        return Ok(done);
    }
    let sun = if input.sun_bounce {
        reporter.stage("sun on surfaces", 0);
        let sun = BouncedSun::new(surfaces, &layout, input.suns, params)?;
        reporter.finished();
        sun
    } else {
        None
    };
    let mut blocks = gather_all(input, sun.as_ref(), &mut layout, cache, reporter)?;
    let points = layout.points().len() as u64;
    let gather_rays = blocks.iter().map(|block| block.rays).sum();
    let masks = all_masks(input, &layout, 0..layout.front_count(), ("masks", "sun masks"), cache, reporter)?;
    let grid = gather_grid(input, sun.as_ref(), &mut layout, &grid_stage, cache, reporter)?;
    let grid_rays = grid.blocks.iter().map(|block| block.rays).sum();
    blocks.extend(grid.blocks);
    reporter.stage("bounces", 0);
    let (light, free) = solve_all(surfaces, &layout, &blocks, sun.as_ref(), params)?;
    light.validate()?;
    free.validate(&light)?;
    let of_vertices = vertex_masks(&layout, &masks, &light.validity);
    of_vertices.validate()?;
    let mask_rays = masks.rays + sun.map_or(0, |sun| sun.rays());
    let mut baked = BakedLight { light, points, gather_rays, mask_rays, masks: of_vertices, grid: None };
    if let Some(cache) = cache {
        cache.store("light", 0, &encode_light(&baked))?;
    }
    if let Some(masks) = grid.masks {
        let light = LatticeLight::new(&input.grid.cells, free, &layout.free_masks(&masks))?;
        light.validate()?;
        let grid = baked.grid.insert(BakedGrid { light, gather_rays: grid_rays, mask_rays: masks.rays });
        if let Some(cache) = cache {
            cache.store(&grid_stage.result, 0, &encode_grid(grid))?;
        }
    }
    reporter.finished();
    Ok(baked)
}

/// Names of the grid's files in the cache: other points have other names.
struct GridStage {
    gather: String,
    masks: String,
    result: String,
}

impl GridStage {
    fn new(grid: &GridPlan) -> Self {
        let name = |what: &str| format!("grid-{}-{what}", grid.digits());
        Self { gather: name("gather"), masks: name("masks"), result: name("light") }
    }
}

/// What the grid's points see.
struct GatheredGrid {
    blocks: Vec<GatherBlock>,
    masks: Option<SunMasks>,
}

/// Gathers the points in space, and asks them for the suns.
fn gather_grid(
    input: &LightInput,
    sun: Option<&BouncedSun>,
    layout: &mut Layout,
    stage: &GridStage,
    cache: Option<&Cache>,
    reporter: &dyn Reporter,
) -> Result<GatheredGrid, BakeError> {
    if input.grid.is_empty() {
        return Ok(GatheredGrid { blocks: Vec::new(), masks: None });
    }
    let points = layout.add_free_points(&input.grid.places());
    let name = (stage.gather.as_str(), "light of space");
    let blocks = gather_points(input, sun, layout, points.clone(), name, 0, cache, reporter)?;
    let masks = all_masks(input, layout, points, (stage.masks.as_str(), "sun in space"), cache, reporter)?;
    Ok(GatheredGrid { blocks, masks: Some(masks) })
}

fn gather_all(
    input: &LightInput,
    sun: Option<&BouncedSun>,
    layout: &mut Layout,
    cache: Option<&Cache>,
    reporter: &dyn Reporter,
) -> Result<Vec<GatherBlock>, BakeError> {
    let mut blocks: Vec<GatherBlock> = Vec::new();
    let mut points = 0..layout.points().len();
    while !points.is_empty() {
        let name = if blocks.is_empty() { "sky transfer" } else { "back sides" };
        let more = gather_points(input, sun, layout, points, ("gather", name), blocks.len(), cache, reporter)?;
        blocks.extend(more);
        points = layout.add_back_sides(&input.surfaces, &blocks, input.params);
    }
    Ok(blocks)
}

/// Gathers a range of points in blocks, the first of which has the number `first_block`.
#[expect(clippy::too_many_arguments, reason = "what a stage of blocks is, and what it works on")]
fn gather_points(
    input: &LightInput,
    sun: Option<&BouncedSun>,
    layout: &Layout,
    points: Range<usize>,
    (file_stage, name): (&str, &str),
    first_block: usize,
    cache: Option<&Cache>,
    reporter: &dyn Reporter,
) -> Result<Vec<GatherBlock>, BakeError> {
    let functions = sun.map_or(0, BouncedSun::function_count);
    let stage = BlockStage { cache, reporter, file_stage, name };
    let ranges: Vec<_> = block_ranges(points, points_per_block(u64::from(input.params.samples))).collect();
    stage.run(
        &ranges,
        first_block,
        |bytes, range| {
            let block = GatherBlock::from_bytes(bytes).ok()?;
            (block.range == *range && block.validate(layout, functions, input.params).is_ok()).then_some(block)
        },
        |range| gather(&input.surfaces, layout, sun, range, input.params).map_err(BakeError::from),
        GatherBlock::to_bytes,
    )
}

fn all_masks(
    input: &LightInput,
    layout: &Layout,
    points: Range<usize>,
    (file_stage, name): (&str, &str),
    cache: Option<&Cache>,
    reporter: &dyn Reporter,
) -> Result<SunMasks, BakeError> {
    let stage = BlockStage { cache, reporter, file_stage, name };
    let steps = input.suns.len() as u64;
    // half of the suns stand behind a surface, on average
    let per_block = points_per_block(steps.div_ceil(2));
    let ranges: Vec<_> = block_ranges(points, per_block).collect();
    let parts = stage.run(
        &ranges,
        0,
        |bytes, range| {
            let mut decoder = Decoder::new(bytes);
            let masks = SunMasks { steps: input.suns.len() as u32, rays: decoder.number()?, words: decoder.run()? };
            let fits = masks.words.len() == range.len() * masks.words_per_point() && masks.validate().is_ok();
            (fits && decoder.is_empty()).then_some(masks)
        },
        |range| {
            bake_sun_masks(&input.surfaces, layout.points(), input.suns, range, &MaskParams::default()).map_err(BakeError::from)
        },
        |masks| {
            let mut encoder = Encoder::default();
            encoder.number(masks.rays).run(&masks.words);
            encoder.finish()
        },
    )?;
    let mut all = SunMasks { steps: input.suns.len() as u32, ..SunMasks::default() };
    all.words.reserve_exact(parts.iter().map(|part| part.words.len()).sum());
    for part in &parts {
        all.append(part)?;
    }
    Ok(all)
}

fn encode_light(baked: &BakedLight) -> Vec<u8> {
    let light = &baked.light;
    let mut encoder = Encoder::default();
    encoder.run(&[baked.points, baked.gather_rays, baked.mask_rays]);
    encoder.run(&light.sky_transfer).run(&light.validity.valid).run(&light.validity.source).run(&baked.masks.words);
    let bounces = light.sun_bounce.as_slice();
    encoder.number(bounces.len() as u64);
    for bounce in bounces {
        encoder.run(&[bounce.median_error, bounce.p95_error]).run(&bounce.coefficients);
        encoder.number(bounce.functions.len() as u64).run(&bounce.functions.concat());
    }
    encoder.finish()
}

fn decode_light(bytes: &[u8], layout: &Layout, input: &LightInput) -> Option<BakedLight> {
    let mut decoder = Decoder::new(bytes);
    let [points, gather_rays, mask_rays] = decoder.run::<u64>()?[..] else { return None };
    let (sky_transfer, valid, source, words) = (decoder.run()?, decoder.run()?, decoder.run()?, decoder.run()?);
    let sun_bounce = match decoder.number()? {
        0 => None,
        _ => {
            let [median_error, p95_error] = decoder.run::<f32>()?[..] else { return None };
            let coefficients = decoder.run()?;
            let count = decoder.number()?;
            let numbers: Vec<f32> = decoder.run()?;
            let steps = input.suns.len().max(1);
            if numbers.len() as u64 != count.checked_mul(steps as u64)? {
                return None;
            }
            let functions = numbers.chunks_exact(steps).map(<[f32]>::to_vec).collect();
            Some(SunBounce { functions, coefficients, median_error, p95_error })
        }
    };
    let light = VertexLight {
        coefficients: input.params.coefficients,
        channels: input.params.channels,
        sky_transfer,
        validity: Validity { valid, source },
        sun_bounce,
    };
    let masks = SunMasks { steps: input.suns.len() as u32, words, rays: mask_rays };
    let fits = decoder.is_empty()
        && light.vertex_count() == layout.vertex_count()
        && masks.words.len() == layout.vertex_count() * masks.words_per_point();
    (fits && light.validate().is_ok() && masks.validate().is_ok()).then_some(BakedLight {
        light,
        masks,
        points,
        gather_rays,
        mask_rays,
        grid: None,
    })
}

fn encode_grid(grid: &BakedGrid) -> Vec<u8> {
    let light = &grid.light;
    let mut encoder = Encoder::default();
    encoder.run(&[grid.gather_rays, grid.mask_rays, u64::from(light.masks.steps)]).run(&light.valid).run(&light.source);
    encoder.run(&light.sky_transfer).run(&light.sun_bounce).run(&light.masks.words);
    encoder.finish()
}

fn decode_grid(bytes: &[u8], input: &LightInput) -> Option<BakedGrid> {
    let mut decoder = Decoder::new(bytes);
    let [gather_rays, mask_rays, steps] = decoder.run::<u64>()?[..] else { return None };
    let (valid, source) = (decoder.run()?, decoder.run()?);
    let (sky_transfer, sun_bounce) = (decoder.run()?, decoder.run()?);
    let masks = SunMasks { steps: u32::try_from(steps).ok()?, words: decoder.run()?, rays: mask_rays };
    let light = LatticeLight { valid, source, sky_transfer, sun_bounce, masks };
    let fits = decoder.is_empty()
        && light.point_count() == input.grid.cells.len()
        && light.masks.steps as usize == input.suns.len()
        && light.validate().is_ok();
    fits.then_some(BakedGrid { light, gather_rays, mask_rays })
}

/// The solver's name of the site's `transfer`.
#[must_use]
pub fn channels(transfer: heliodon_bundle::site::Transfer) -> Channels {
    match transfer {
        heliodon_bundle::site::Transfer::Mono => Channels::Mono,
        heliodon_bundle::site::Transfer::Rgb => Channels::Rgb,
    }
}
