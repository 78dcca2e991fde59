//! The light of all vertices: sun masks, gather, bounces, in blocks that survive a kill.

use crate::blocks::{BlockStage, block_ranges, points_per_block};
use crate::cache::Cache;
use crate::codec::{Decoder, Encoder};
use crate::error::BakeError;
use crate::report::Reporter;
use glam::Vec3;
use heliodon_light::{
    BouncedSun, Channels, GatherBlock, Layout, LightParams, MaskParams, SunBounce, SunMasks, Surfaces, Validity, VertexLight,
    bake_sun_masks, gather, solve, vertex_masks,
};

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
}

/// Solves everything, going on from what `cache` holds of an earlier run.
///
/// # Errors
/// Input that the solver refuses, or a cache that cannot be written.
pub fn bake_light(input: &LightInput, cache: Option<&Cache>, reporter: &dyn Reporter) -> Result<BakedLight, BakeError> {
    let (surfaces, params) = (&input.surfaces, input.params);
    let mut layout = Layout::new(surfaces, params)?;
    if let Some(done) = cache.and_then(|cache| cache.load("light", 0)).and_then(|bytes| decode_light(&bytes, &layout, input)) {
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
    let blocks = gather_all(input, sun.as_ref(), &mut layout, cache, reporter)?;
    let masks = all_masks(input, &layout, cache, reporter)?;
    reporter.stage("bounces", 0);
    let light = solve(surfaces, &layout, &blocks, sun.as_ref(), params)?;
    light.validate()?;
    let of_vertices = vertex_masks(&layout, &masks, &light.validity);
    of_vertices.validate()?;
    let baked = BakedLight {
        light,
        points: layout.points().len() as u64,
        gather_rays: blocks.iter().map(|block| block.rays).sum(),
        mask_rays: masks.rays + sun.map_or(0, |sun| sun.rays()),
        masks: of_vertices,
    };
    if let Some(cache) = cache {
        cache.store("light", 0, &encode_light(&baked))?;
    }
    reporter.finished();
    Ok(baked)
}

fn gather_all(
    input: &LightInput,
    sun: Option<&BouncedSun>,
    layout: &mut Layout,
    cache: Option<&Cache>,
    reporter: &dyn Reporter,
) -> Result<Vec<GatherBlock>, BakeError> {
    let per_block = points_per_block(u64::from(input.params.samples));
    let functions = sun.map_or(0, BouncedSun::function_count);
    let mut blocks: Vec<GatherBlock> = Vec::new();
    let mut points = 0..layout.points().len();
    while !points.is_empty() {
        let name = if blocks.is_empty() { "sky transfer" } else { "back sides" };
        let stage = BlockStage { cache, reporter, file_stage: "gather", name };
        let ranges: Vec<_> = block_ranges(points, per_block).collect();
        blocks.extend(stage.run(
            &ranges,
            blocks.len(),
            |bytes, range| {
                let block = GatherBlock::from_bytes(bytes).ok()?;
                (block.range == *range && block.validate(layout, functions, input.params).is_ok()).then_some(block)
            },
            |range| gather(&input.surfaces, layout, sun, range, input.params).map_err(BakeError::from),
            GatherBlock::to_bytes,
        )?);
        points = layout.add_back_sides(&input.surfaces, &blocks, input.params);
    }
    Ok(blocks)
}

fn all_masks(
    input: &LightInput,
    layout: &Layout,
    cache: Option<&Cache>,
    reporter: &dyn Reporter,
) -> Result<SunMasks, BakeError> {
    let stage = BlockStage { cache, reporter, file_stage: "masks", name: "sun masks" };
    let steps = input.suns.len() as u64;
    // half of the suns stand behind a surface, on average
    let per_block = points_per_block(steps.div_ceil(2));
    let ranges: Vec<_> = block_ranges(0..layout.front_count(), per_block).collect();
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
    })
}

/// The solver's name of the site's `transfer`.
#[must_use]
pub fn channels(transfer: heliodon_bundle::site::Transfer) -> Channels {
    match transfer {
        heliodon_bundle::site::Transfer::Mono => Channels::Mono,
        heliodon_bundle::site::Transfer::Rgb => Channels::Rgb,
    }
}
