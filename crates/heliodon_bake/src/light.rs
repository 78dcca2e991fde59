//! The light of all vertices, and of the light grid: [`crate::stages`] in blocks that survive a kill, then the bounces, which are kept between one another.

use crate::cache::Cache;
use crate::earlier::{Earlier, SceneRecord, leave_record};
use crate::error::BakeError;
use crate::grid::GridPlan;
use crate::kept_bounces::Bounces;
use crate::kept_light::{decode_grid, decode_light, encode_grid, encode_light};
use crate::names::{LightNames, TexelNames};
use crate::panorama::Panorama;
use crate::report::Reporter;
use crate::scan::{BakedScan, Scan};
use crate::scene::Scene;
use crate::stages::{LightStages, Work, lay_out};
use crate::texels::{Atlas, BakedTexels, SolvedScene, bake_texels};
use glam::Vec3;
use heliodon_bundle::memory::give_back_freed_memory;
use heliodon_light::{
    BouncedSun, CellLight, Channels, LatticeLight, Layout, LightParams, Receiving, SunMasks, Surfaces, VertexLight, solve_all,
    vertex_masks,
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
    /// Points in space that are lit, too.
    pub grid: &'a GridPlan,
    /// The atlas of what is lit by texels, and the scene that it is of.
    pub texels: Option<(&'a Scene, &'a Atlas)>,
    /// What a room's middle sees of the original, where that is wanted.
    pub panorama: Option<&'a Panorama>,
    /// The scan itself, likewise.
    pub scan: Option<&'a Scan<'a>>,
    /// What the blocks are called.
    pub names: &'a LightNames,
    /// What the surfaces are made of, part by part.
    pub record: &'a SceneRecord,
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
    /// Light in texels, where there is any,
    pub texels: Option<BakedTexels>,
    /// that of the panorama,
    pub panorama: Option<BakedTexels>,
    /// and that of the scan itself.
    pub scan: Option<BakedScan>,
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
    reporter.stage("points", 0);
    let layout = lay_out(surfaces, params, &input.names.sight, cache)?;
    reporter.finished();
    let names = input.names;
    if let Some(done) = cache.and_then(|cache| solved(input, cache, &layout)) {
        reporter.note("going on: the light is solved, the bundle remains to be written");
        cache.inspect(|cache| {
            cache.taken("all light", 1, 1);
            cache.remove_blocks(&names.bounces);
        });
        return Ok(done);
    }
    let earlier = cache.and_then(|cache| Earlier::find(input, cache));
    if let Some(cache) = cache {
        leave_record(input, cache)?;
    }
    let mut stages = LightStages::new(input, layout, earlier.as_ref());
    let work = Work { cache, reporter, shard: None };
    let masks = stages.masks(&work)?;
    let sun = stages.sun(&work, &masks)?;
    let sun = sun.as_ref();
    let mut blocks = stages.fronts(&work, sun)?;
    let space = stages.space(&work, sun)?;
    stages.back_sides(&work, sun, &mut blocks)?;
    let mut layout = stages.into_layout();
    let points = layout.points().len() as u64;
    let gather_rays = blocks.iter().map(|block| block.rays).sum();
    let mask_rays = masks.rays + sun.map_or(0, BouncedSun::rays);
    let (mut of_space, fronts) = (None, blocks.len());
    if let Some((of_points, masks)) = space {
        let mut first = layout.add_free_points(&input.grid.places()).start;
        of_space = Some((masks, of_points.iter().map(|block| block.rays).sum::<u64>()));
        for block in of_points {
            let end = first + block.range.len();
            blocks.push(block.moved_to(first));
            first = end;
        }
    }
    reporter.stage("bounces", params.bounce_passes(sun.map_or(0, BouncedSun::function_count)));
    let mut cells =
        [input.texels.is_some(), input.panorama.is_some(), input.scan.is_some()].contains(&true).then(CellLight::default);
    let kept = Bounces::new(cache, names, fronts, reporter);
    let (light, free) = solve_all(surfaces, &layout, &blocks, sun, params, cells.as_mut(), Some(&kept))?;
    drop(blocks);
    // a large part of what all of them took is free in small pieces, which what comes next has no use for
    give_back_freed_memory();
    light.validate()?;
    free.validate(&light)?;
    let of_vertices = vertex_masks(&layout, &masks, &light.validity);
    of_vertices.validate()?;
    let mut baked = BakedLight {
        light,
        points,
        gather_rays,
        mask_rays,
        masks: of_vertices,
        grid: None,
        texels: None,
        panorama: None,
        scan: None,
    };
    if let Some(cache) = cache {
        cache.store(&names.fronts.light, 0, &encode_light(&baked))?;
    }
    if let Some((masks, gather_rays)) = of_space {
        let light = LatticeLight::new(&input.grid.cells, free, &layout.free_masks(&masks))?;
        light.validate()?;
        let grid = baked.grid.insert(BakedGrid { light, gather_rays, mask_rays: masks.rays });
        if let Some(cache) = cache {
            cache.store(&names.space.light, 0, &encode_grid(grid))?;
        }
    }
    reporter.finished();
    if let Some(cells) = &cells {
        let receiving = Receiving::new(surfaces, &layout, params);
        let solved = SolvedScene { input, receiving: &receiving, cells, sun };
        let keep = |names: &TexelNames, texels: &BakedTexels| {
            cache.map_or(Ok(()), |cache| cache.store(&names.light, 0, &texels.to_bytes()))
        };
        if let (Some(of), Some(names)) = (input.texels, &names.texels) {
            keep(names, baked.texels.insert(bake_texels(&solved, of, &work, names)?))?;
        }
        if let (Some(panorama), Some(names)) = (input.panorama, &names.panorama) {
            keep(names, baked.panorama.insert(panorama.light(&solved, &work, names)?))?;
        }
        if let (Some(scan), Some(names)) = (input.scan, &names.scan) {
            let light = baked.scan.insert(scan.light(&solved, &work, names)?);
            cache.map_or(Ok(()), |cache| light.keep(cache, names))?;
        }
    }
    // until here whoever was killed needed them: texels ask the cells
    kept.remove();
    Ok(baked)
}

/// What an earlier run has solved, if it has all of it.
fn solved(input: &LightInput, cache: &Cache, layout: &Layout) -> Option<BakedLight> {
    let mut done = decode_light(&cache.load(&input.names.fronts.light, 0)?, layout, input)?;
    if let (Some(names), Some(_)) = (&input.names.texels, input.texels) {
        done.texels = Some(BakedTexels::from_bytes(&cache.load(&names.light, 0)?)?);
    }
    if let (Some(names), Some(_)) = (&input.names.panorama, input.panorama) {
        done.panorama = Some(BakedTexels::from_bytes(&cache.load(&names.light, 0)?)?);
    }
    if let (Some(names), Some(scan)) = (&input.names.scan, input.scan) {
        let channels = done.light.channels.count();
        let functions = done.light.sun_bounce.as_ref().map_or(0, |bounce| bounce.functions.len());
        let widths = [done.masks.words_per_point(), done.light.coefficients * channels, functions * channels];
        done.scan = Some(BakedScan::kept(cache, names, scan, widths)?);
    }
    if input.grid.is_empty() {
        return Some(done);
    }
    let grid = decode_grid(&cache.load(&input.names.space.light, 0)?, input)?;
    Some(BakedLight { grid: Some(grid), ..done })
}

/// The solver's name of the site's `transfer`.
#[must_use]
pub fn channels(transfer: heliodon_bundle::site::Transfer) -> Channels {
    match transfer {
        heliodon_bundle::site::Transfer::Mono => Channels::Mono,
        heliodon_bundle::site::Transfer::Rgb => Channels::Rgb,
    }
}
