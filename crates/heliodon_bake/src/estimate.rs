//! What a bake will cost, from its geometry and a few measured blocks of its work.

use crate::blocks::GRANULE;
use crate::error::BakeError;
use crate::plan::Plan;
use crate::report::Reporter;
use crate::scene::{Scene, Traceable};
use crate::sky::lapse_params;
use glam::Vec3;
use heliodon_bundle::LightLayout;
use heliodon_bundle::grid::point_bytes;
use heliodon_light::{
    AXES, BouncedSun, GatherBlock, Layout, LightParams, MaskParams, PatchPlan, SunOnSurfaces, Surfaces, bake_sun_masks, gather,
    light_patches,
};
use heliodon_math::sphere::fibonacci_sphere;
use heliodon_rays::TriangleScene;
use heliodon_sky::day::{self, LapseParams};
use serde::Serialize;
use std::ops::Range;
use std::time::Instant;

/// What a bake will cost on this machine.
#[derive(Clone, Debug, Serialize)]
pub struct Estimate {
    /// Vertices over all parts.
    pub vertices: u64,
    /// Triangles over all parts.
    pub triangles: u64,
    /// Points that are solved: vertices, cells of large triangles, and back sides of open surfaces, as far as the timed runs
    /// meet them.
    pub points: u64,
    /// Points of the light grid, six of the solver each, that come to these.
    pub grid_points: u64,
    /// Rays of the sky transfer.
    pub gather_rays: u64,
    /// Rays to the suns.
    pub mask_rays: u64,
    /// Seconds of the sky transfer, its bounces and the sun masks, from timed blocks.
    pub seconds: f64,
    /// The most memory at once.
    pub memory_bytes: u64,
    /// The finished work that is kept on disk.
    pub cache_bytes: u64,
    /// The bundle's geometry with its light.
    pub bundle_bytes: u64,
}

/// Timed runs of points, spread over the scene.
const TIMED_RUNS: usize = 8;

/// Every how-maniest sun is timed where all surfaces are asked.
const TIMED_SUNS: usize = 8;
/// Width of a sky map that is made for its sun only, pixels.
const THROWN_AWAY_MAP_WIDTH: u32 = 32;
/// Bytes of a kept hit.
const HIT_BYTES: f64 = 4.0;
/// Hits that one bounce handles a second in sixteen lanes, over what the gather traces rays a second. Measured from the stages
/// that `heliodon bake` prints, on two busy cores: 9.5 on a garden of 72,000 triangles with trees at 64 rays a point, 18 at 256,
/// 22 on two temples of 11,000 triangles (and 2 on a scene so small that its fixed costs showed). The choice of the day's functions is
/// part of it. A figure near the lower end keeps estimates safe.
const BOUNCED_HITS_PER_RAY: f64 = 12.0;
/// Lanes that bounce together.
const LANES: usize = 16;
/// Functions of bounced sunlight to reckon with before the solver has chosen: its most, which open scenes take.
const USUAL_FUNCTIONS: u32 = 44;
/// Bytes of a triangle's indices and of a vertex's position, normal, albedo and flag in the bundle.
const BUNDLE_TRIANGLE_BYTES: u64 = 6;
const BUNDLE_VERTEX_BYTES: u64 = 36;

/// Reads the geometry, times a few blocks, and reckons.
///
/// # Errors
/// As the bake's own first steps.
pub fn estimate(plan: &Plan, reporter: &dyn Reporter) -> Result<Estimate, BakeError> {
    let mut scene = plan.read_scene(reporter)?;
    reporter.stage("timing", 0);
    let rays = scene.take_rays()?;
    let mesh = &scene.mesh;
    let traceable = Traceable::new(&scene, rays);
    let surfaces = traceable.surfaces();
    let params = plan.light_params(&mesh.positions, &mesh.triangles);
    let layout = Layout::new(&surfaces, &params)?;
    let suns = likely_suns(plan)?;
    let timed = Timed::measure(plan, &surfaces, &layout, &suns, &params)?;
    reporter.finished();
    let grid_points = plan.grid(Some(&traceable.rays))?.cells.len() as u64;
    Ok(reckon(plan, &scene, &traceable.rays, (&layout, grid_points), suns.len() as u32, &params, &timed))
}

/// The suns to reckon with: that of a single probe, if it has one; else as many as the site has steps, somewhere in the upper half, where
/// exactly matters little to the time.
fn likely_suns(plan: &Plan) -> Result<Vec<Vec3>, BakeError> {
    let sky = LapseParams { map_width: THROWN_AWAY_MAP_WIDTH, ..lapse_params(&plan.site, &plan.files)? };
    let steps = sky.effective_sun_steps();
    if steps < sky.sun_steps {
        let found = day::build(&sky, &mut |_| Ok(()))?.suns;
        return Ok(found.into_iter().map(|sun| sun.unwrap_or(Vec3::ZERO)).collect());
    }
    Ok(fibonacci_sphere(2 * steps).into_iter().filter(|sun| sun.y > 0.0).collect())
}

/// What the timed runs of points have shown, per point.
struct Timed {
    gather_rays: f64,
    gather_seconds: f64,
    hits: f64,
    mask_rays: f64,
    mask_seconds: f64,
    /// Of all surfaces that the sun bounces off.
    sun_rays: u64,
    sun_seconds: f64,
    /// Pieces of the surfaces that were asked.
    patches: u64,
    /// Whether there is a sun whose light bounces.
    bounces_sun: bool,
    /// Points on back sides, over all.
    back_sides: f64,
}

impl Timed {
    fn measure(
        plan: &Plan,
        surfaces: &Surfaces,
        layout: &Layout,
        suns: &[Vec3],
        params: &LightParams,
    ) -> Result<Self, BakeError> {
        let runs = spread_runs(layout.points().len());
        let points = runs.iter().map(Range::len).sum::<usize>().max(1) as f64;
        let (sun, sun_seconds, sun_rays) = timed_suns(plan, surfaces, layout, suns, params)?;
        let begun = Instant::now();
        let blocks: Vec<GatherBlock> =
            runs.iter().map(|run| gather(surfaces, layout, sun.as_ref(), run.clone(), params)).collect::<Result<_, _>>()?;
        let gather_seconds = begun.elapsed().as_secs_f64() / points;
        // a run that is a part of the points meets each back side as often as it is a part
        let share = points / layout.points().len().max(1) as f64;
        let sparse = LightParams { samples: ((f64::from(params.samples) * share) as u32).max(1), ..params.clone() };
        let back_sides = layout.clone().add_back_sides(surfaces, &blocks, &sparse).len() as f64 / share;
        let begun = Instant::now();
        let mut mask_rays = 0;
        for run in &runs {
            mask_rays += bake_sun_masks(surfaces, layout.points(), suns, run.clone(), &MaskParams::default())?.rays;
        }
        Ok(Self {
            gather_rays: blocks.iter().map(|block| block.rays).sum::<u64>() as f64 / points,
            gather_seconds,
            hits: blocks.iter().map(|block| block.hit_bytes() as f64 / HIT_BYTES).sum::<f64>() / points,
            mask_rays: mask_rays as f64 / points,
            mask_seconds: begun.elapsed().as_secs_f64() / points,
            patches: sun.as_ref().map_or(0, BouncedSun::patch_count) as u64,
            bounces_sun: sun.is_some(),
            sun_rays,
            sun_seconds,
            back_sides: back_sides.min(layout.points().len() as f64),
        })
    }
}

/// The suns on surfaces, for some of the suns: with the seconds and the rays that all would take. Much of it (where points look, the albedo of
/// each piece) does not depend on how many suns there are, so it is done for one sun, too.
fn timed_suns(
    plan: &Plan,
    surfaces: &Surfaces,
    layout: &Layout,
    suns: &[Vec3],
    params: &LightParams,
) -> Result<(Option<BouncedSun>, f64, u64), BakeError> {
    if !plan.site.bake.sun_bounce {
        return Ok((None, 0.0, 0));
    }
    let time = |suns: &[Vec3]| -> Result<(Option<BouncedSun>, f64, u64), BakeError> {
        if !BouncedSun::any(suns) {
            return Ok((None, 0.0, 0));
        }
        // the masks of the points are counted with those of all
        let fronts = bake_sun_masks(surfaces, layout.points(), suns, 0..layout.front_count(), &MaskParams::default())?;
        let begun = Instant::now();
        let patches = PatchPlan::new(surfaces, layout, params);
        let lit = vec![light_patches(surfaces, &patches, suns, 0..patches.triangle_count(), params)?];
        let sun = SunOnSurfaces::new(surfaces, layout, patches, suns, lit, &fronts, params)?;
        let curves = sun.curves(surfaces, layout, 0..SunOnSurfaces::curve_runs(layout), params);
        let sun = sun.told_by(&curves, params);
        let (seconds, rays) = (begun.elapsed().as_secs_f64(), sun.rays());
        Ok((Some(sun), seconds, rays))
    };
    let few: Vec<Vec3> = suns.iter().copied().step_by(TIMED_SUNS.min(suns.len().div_ceil(2)).max(1)).collect();
    let (sun, few_seconds, few_rays) = time(&few)?;
    if few.len() == suns.len() {
        return Ok((sun, few_seconds, few_rays));
    }
    let (_, one_seconds, one_rays) = time(&few[..1])?;
    // by how much each further sun adds
    let further = (suns.len() - few.len()) as f64 / (few.len() - 1).max(1) as f64;
    let seconds = few_seconds + (few_seconds - one_seconds).max(0.0) * further;
    let rays = few_rays + (few_rays.saturating_sub(one_rays) as f64 * further) as u64;
    Ok((sun, seconds, rays))
}

/// Whole granules, evenly spread.
fn spread_runs(points: usize) -> Vec<Range<usize>> {
    let granules = points.div_ceil(GRANULE);
    let count = granules.min(TIMED_RUNS);
    (0..count)
        .map(|run| {
            let first = run * granules / count * GRANULE;
            first..(first + GRANULE).min(points)
        })
        .collect()
}

fn reckon(
    plan: &Plan,
    scene: &Scene,
    rays: &TriangleScene,
    (layout, grid_points): (&Layout, u64),
    sun_steps: u32,
    params: &LightParams,
    timed: &Timed,
) -> Estimate {
    let (vertices, triangles) = (scene.mesh.positions.len() as u64, scene.mesh.triangles.len() as u64);
    let of_surfaces = layout.points().len() as u64 + timed.back_sides as u64;
    // a point in space is like one on a surface: it sees half of the sphere, and what fills it
    let points = of_surfaces + AXES.len() as u64 * grid_points;
    let all = |per_point: f64| per_point * points as f64;
    let functions = if timed.bounces_sun { USUAL_FUNCTIONS.min(sun_steps) } else { 0 };
    let light: LightLayout = plan.layout(sun_steps, functions);
    let lanes = light.transfer_floats() + light.bounce_floats();
    let going_on = light.transfer_floats() + params.functions_going_on(functions as usize) * params.channels.count();
    let passes = f64::from(params.bounces) * going_on.div_ceil(LANES) as f64;
    let seconds_per_ray = timed.gather_seconds / timed.gather_rays.max(1.0);
    let bounce_seconds = timed.hits * passes * seconds_per_ray / BOUNCED_HITS_PER_RAY;
    let light_bytes = 4 * (light.mask_words() + lanes) as u64;
    let hit_bytes = (all(timed.hits) * HIT_BYTES) as u64;
    let kept = hit_bytes.min(params.hit_budget_bytes);
    // what rays met is kept twice as wide, of all looks
    let looks = (timed.gather_rays / f64::from(params.samples)).max(1.0);
    let traces = (2.0 * kept as f64 * looks) as u64;
    Estimate {
        vertices,
        triangles,
        points: of_surfaces,
        grid_points,
        gather_rays: all(timed.gather_rays) as u64,
        mask_rays: all(timed.mask_rays) as u64 + timed.sun_rays,
        seconds: all(timed.gather_seconds + timed.mask_seconds + bounce_seconds) + timed.sun_seconds,
        // geometry, rays, points, hits, and light: of the points twice, gathered and solved, and of the vertices
        memory_bytes: (scene.mesh.memory_bytes() + rays.memory_bytes()) as u64
            + kept
            + timed.patches * 4 * u64::from(1 + sun_steps.div_ceil(32))
            + points * (size_of::<[f32; 6]>() as u64 + 8 + 2 * light_bytes)
            + vertices * light_bytes,
        cache_bytes: kept + traces + points * (light_bytes + 16) + vertices * light_bytes,
        bundle_bytes: vertices * (BUNDLE_VERTEX_BYTES + light_bytes)
            + triangles * BUNDLE_TRIANGLE_BYTES
            + grid_points * point_bytes(light),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn timed_runs_are_whole_granules_within_the_points() {
        for points in [0, 1, 1023, 1024, 5000, 1_000_000] {
            let runs = spread_runs(points);
            assert!(runs.iter().all(|run| run.start.is_multiple_of(GRANULE) && run.end <= points && !run.is_empty()));
            assert!(runs.windows(2).all(|pair| pair[0].end <= pair[1].start));
            assert_eq!(runs.is_empty(), points == 0);
        }
    }
}
