//! What a bake will cost, from its geometry and a few measured blocks of its work; where geometry is to be prepared first, from a coarse form of it, and
//! what preparation itself will cost.

use crate::blocks::{GRANULE, points_per_block};
use crate::budget::{Need, shown_counts, viewer_bytes};
use crate::error::BakeError;
use crate::kept_bounces;
use crate::kept_rays::kept_bytes;
use crate::light::channels;
use crate::panorama::side_of;
use crate::plan::Plan;
use crate::prepare::{PrepareEstimate, estimate_with, is_prepared, preparation_need, textures_of};
use crate::report::Reporter;
use crate::scan::{self, is_wanted};
use crate::scene::{Original, Scene, Traceable};
use crate::sky::lapse_params;
use crate::stand_in::StandIn;
use crate::texels::expects_texels;
use glam::Vec3;
use heliodon_bundle::LightLayout;
use heliodon_bundle::grid::point_bytes;
use heliodon_bundle::manifest::Counts;
use heliodon_bundle::panorama::panorama_bytes;
use heliodon_bundle::texels::{BOUNCE_BLOCK, atlas_bytes, sky_level};
use heliodon_light::{
    AXES, BouncedSun, GatherBlock, Layout, LightParams, MAX_FOLLOWED, MaskParams, PatchPlan, SunOnSurfaces, Surfaces,
    bake_sun_masks, gather, light_patches,
};
use heliodon_math::sphere::fibonacci_sphere;
use heliodon_mesh::{Mesh, Texture};
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
    /// Seconds of the sky transfer, its bounces and the sun masks, from timed blocks; without those of preparation.
    pub seconds: f64,
    /// The most memory at once, in preparation too, where `[budget]` does not limit it.
    pub memory_bytes: u64,
    /// Why the bake would be refused, where `[budget]` gives it less than it cannot do without.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub refused: Option<String>,
    /// The finished work that is kept on disk.
    pub cache_bytes: u64,
    /// The bundle's geometry with its light, at vertices and in texels.
    pub bundle_bytes: u64,
    /// What the viewer needs for it beyond what its empty window takes.
    pub viewer_bytes: u64,
    /// What preparation costs before, where the site wants it and it is not done and kept: vertices, triangles and points are then what it is
    /// thought to leave.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub prepare: Option<PrepareEstimate>,
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
/// Functions of bounced sunlight to reckon with before the solver has chosen: its most, which open scenes take.
pub(crate) const USUAL_FUNCTIONS: u32 = 44;
/// Bytes of a triangle's indices and of a vertex's position, normal, albedo and flag in the bundle.
const BUNDLE_TRIANGLE_BYTES: u64 = 6;
const BUNDLE_VERTEX_BYTES: u64 = 36;

/// Bytes that the hierarchy over the original takes for each of its triangles, and what stands beside it for each.
const RAY_TRIANGLE_BYTES: f64 = 51.0 + 4.0;
/// Cells that prepared geometry is divided into beside its vertices, at most.
const CELLS_A_VERTEX: f64 = 0.25;
/// The pyramid of a texture's halved images takes half of what the texture takes: three channels of two bytes, over a third of its pixels.
const PYRAMIDS: u64 = 2;
/// Halves of a texture's bytes that it takes to be written: a copy of three bytes of each four, and the file, which grows by doubling.
const ENCODED_TIMES: u64 = 3;
/// The part of an atlas that has texels, and the part of them whose light of the sky is asked for, as measured on the workshop.
const COVERED: f64 = 0.74;
const SKY_ASKED: f64 = 0.6;
/// The part of a panorama that shows what is drawn.
const SEEN: f64 = 0.6;
/// Bytes of a texel beside its light: itself, its place, and where it lies among others.
const TEXEL_BYTES: u64 = 120;
/// Copies of a texel's light at once: as it is solved, with its seams closed, at its place in the atlas, and as a texture's bytes. With these the
/// workshop's atlas of 2048 x 2048 texels comes to 1.1 GB; its bake took 1.55 GB in all (BENCHMARKS.md, "Daylight in texels").
const TEXEL_COPIES: u64 = 4;
/// Bytes of a vertex of the scan itself beside its light: of the mesh, while it is written.
const SCAN_VERTEX_BYTES: u64 = 64;
/// Vertices that scans have for each of their triangles, about.
const VERTICES_A_TRIANGLE: f64 = 0.5;
/// What an atlas packs to in the bundle, over what a viewer holds of it: the workshop's 169 MB are 67.2 MB.
const ATLAS_PACKS_TO: f64 = 0.4;
/// Copies of a block while it is written: itself, and its bytes.
const BLOCK_COPIES: u64 = 2;

/// Reads the geometry, times a few blocks, and reckons. Geometry that is to be prepared is not: what preparation would cost and leave is reckoned, too.
///
/// # Errors
/// As the bake's own first steps.
pub fn estimate(plan: &Plan, reporter: &dyn Reporter) -> Result<Estimate, BakeError> {
    let (mut scene, prepare) = match &plan.site.prepare {
        Some(settings) if !is_prepared(plan, settings) => {
            let mut stand_in = StandIn::default();
            let nearest_m = settings.nearest_m as f32;
            let prepare = estimate_with(plan, settings, reporter, |_, mesh, views| stand_in.push(mesh, views, nearest_m))?;
            (stand_in.finish(), Some(prepare))
        }
        _ => (plan.read_scene(reporter)?, None),
    };
    reporter.stage("timing", 0);
    let rays = scene.take_rays()?;
    let scan = match &prepare {
        None => scan::of_site(&plan.site, &mut scene, reporter)
            .map_or([0; 2], |Scene { mesh, .. }| [mesh.positions.len(), mesh.triangles.len()].map(|count| count as u64)),
        Some(prepare) => expected_scan(plan, prepare),
    };
    scene.original.iter_mut().for_each(Original::forget_looks);
    let mesh = &scene.mesh;
    let traceable = Traceable::new(&scene, rays);
    let surfaces = traceable.surfaces();
    let params = plan.light_params(&mesh.positions, &mesh.triangles);
    let layout = Layout::new(&surfaces, &params)?;
    let suns = likely_suns(plan)?;
    let timed = Timed::measure(plan, &surfaces, &layout, &suns, &params)?;
    reporter.finished();
    let grid_points = plan.grid(Some(&traceable.rays))?.cells.len() as u64;
    let needs = match &prepare {
        None => vec![("the light", light_need(plan, &scene, &traceable.rays, [grid_points, scan[0]]))],
        Some(prepare) => vec![("preparation", preparation_need(prepare)), ("the light", expected_light_need(plan, prepare))],
    };
    let refused = refusal(plan, needs);
    // the coarse form has no parts that could be asked
    let by_texels = prepare.as_ref().map_or_else(|| expects_texels(&scene), |prepare| prepare.by_texels);
    let atlas = by_texels.then(|| plan.site.bake.effective_texels());
    let size = match &prepare {
        None => Size::of(&scene, &traceable.rays, &layout, &timed),
        Some(prepare) => Size::expected(prepare, &scene, &layout, &timed),
    };
    let light = reckon(plan, &Size { grid_points, atlas, scan, ..size }, suns.len() as u32, &params, &timed);
    let memory_bytes = light.memory_bytes.max(prepare.as_ref().map_or(0, |prepare| prepare.memory_bytes));
    // nearly all that preparation keeps stays while the light is baked, for what comes after
    let cache_bytes = light.cache_bytes + prepare.as_ref().map_or(0, |prepare| prepare.cache_bytes);
    Ok(Estimate { memory_bytes, cache_bytes, prepare, refused, ..light })
}

/// What a bake would say that is refused for its budget.
fn refusal(plan: &Plan, needs: Vec<(&'static str, Need)>) -> Option<String> {
    let (budget, threads) = (plan.site.budget.bake_bytes(), rayon::current_num_threads());
    let refused = |(what, need): (_, Need)| need.within(what, budget, threads).err();
    needs.into_iter().find_map(refused).map(|error| error.to_string())
}

/// How much there is to solve.
#[derive(Clone, Debug)]
struct Size {
    vertices: u64,
    triangles: u64,
    /// Points on surfaces.
    points: u64,
    /// Points of the light grid.
    grid_points: u64,
    /// Texels along a side of the atlas, where there is one.
    atlas: Option<u32>,
    /// Vertices and triangles of the scan itself.
    scan: [u64; 2],
    /// Geometry with its textures and what is made of them, and what rays meet.
    geometry_bytes: u64,
    /// What is kept on disk of what rays meet.
    kept_rays_bytes: u64,
    texture_bytes: u64,
    largest_texture_bytes: u64,
    /// How many times the surfaces of what was timed there are.
    surfaces: f64,
    /// How many times as long a ray takes as one that was timed.
    depth: f64,
}

impl Size {
    /// Of a scene itself.
    fn of(scene: &Scene, rays: &TriangleScene, layout: &Layout, timed: &Timed) -> Self {
        let (mesh, texture_bytes) = (&scene.mesh, scene.mesh.texture_bytes() as u64);
        Self {
            vertices: mesh.positions.len() as u64,
            triangles: mesh.triangles.len() as u64,
            points: layout.points().len() as u64 + timed.back_sides as u64,
            grid_points: 0,
            atlas: None,
            scan: [0; 2],
            geometry_bytes: geometry_bytes(scene) + rays.memory_bytes() as u64,
            kept_rays_bytes: kept_bytes(rays.triangle_count() as u64, rays.memory_bytes() as u64),
            texture_bytes,
            largest_texture_bytes: largest_texture_bytes(mesh),
            surfaces: 1.0,
            depth: 1.0,
        }
    }

    /// Of what preparation will leave, where a coarse form of it was timed.
    fn expected(prepare: &PrepareEstimate, stand_in: &Scene, layout: &Layout, timed: &Timed) -> Self {
        let mesh = &stand_in.mesh;
        let ratio = |many: u64, few: usize| many as f64 / few.max(1) as f64;
        let times = ratio(prepare.vertices, mesh.positions.len());
        let cells = ratio(layout.points().len() as u64, mesh.positions.len()).clamp(1.0, 1.0 + CELLS_A_VERTEX);
        let back_sides = (timed.back_sides * times) as u64;
        let levels = |triangles: f64| triangles.max(2.0).log2();
        let triangles = prepare.triangles_drawn + prepare.triangles_hidden;
        let original = prepare.triangles_original as f64;
        Self {
            vertices: prepare.vertices,
            triangles,
            points: (prepare.vertices as f64 * cells) as u64 + back_sides,
            grid_points: 0,
            atlas: None,
            scan: [0; 2],
            geometry_bytes: expected_geometry_bytes(prepare),
            kept_rays_bytes: kept_bytes(prepare.triangles_original, ray_bytes(prepare)),
            texture_bytes: prepare.texture_bytes,
            largest_texture_bytes: prepare.largest_texture_bytes,
            surfaces: ratio(triangles, mesh.triangles.len()),
            depth: levels(original) / levels(mesh.triangles.len() as f64),
        }
    }
}

/// Bytes of the largest texture of a mesh.
pub(crate) fn largest_texture_bytes(mesh: &Mesh) -> u64 {
    let bytes = |texture: &Texture| size_of_val(texture.image.pixels.as_slice()) as u64;
    textures_of(&mesh.materials).iter().map(|texture| bytes(texture)).max().unwrap_or(0)
}

/// Bytes of a scene whose rays were taken, with what is made of its textures.
fn geometry_bytes(scene: &Scene) -> u64 {
    let detail = scene.original.as_ref().map_or(0, |original| original.memory_bytes());
    (scene.mesh.memory_bytes() + detail) as u64 + scene.mesh.texture_bytes() as u64 / PYRAMIDS
}

/// What the light of a scene whose rays were taken needs: known before any of it is solved.
pub(crate) fn light_need(plan: &Plan, scene: &Scene, rays: &TriangleScene, [grid_points, of_scan]: [u64; 2]) -> Need {
    let (vertices, triangles) = (scene.mesh.positions.len(), scene.mesh.triangles.len());
    // only large triangles are divided, each into a few dozens
    let cells = plan.light_params(&scene.mesh.positions, &scene.mesh.triangles).max_sub_cells.min(64 * triangles);
    let points = (vertices + cells) as u64 + AXES.len() as u64 * grid_points;
    let geometry_bytes = geometry_bytes(scene) + rays.memory_bytes() as u64;
    need(plan, points, [vertices as u64, of_scan], geometry_bytes, expects_texels(scene))
}

/// What the light of what preparation will leave needs; points of the light grid not counted, for nobody knows yet where the ground is.
pub(crate) fn expected_light_need(plan: &Plan, prepare: &PrepareEstimate) -> Need {
    let points = (prepare.vertices as f64 * (1.0 + CELLS_A_VERTEX)) as u64;
    let [of_scan, _] = expected_scan(plan, prepare);
    need(plan, points, [prepare.vertices, of_scan], expected_geometry_bytes(prepare), prepare.by_texels)
}

/// Vertices and triangles of the scan itself, where a site wants it, before anybody knows what of it stands behind what is drawn: all.
fn expected_scan(plan: &Plan, prepare: &PrepareEstimate) -> [u64; 2] {
    let triangles = if is_wanted(&plan.site) { prepare.triangles_original } else { 0 };
    [(VERTICES_A_TRIANGLE * triangles as f64) as u64, triangles]
}

/// `vertices` are those of what is drawn and reflects, and those of the scan itself.
fn need(plan: &Plan, points: u64, vertices: [u64; 2], geometry_bytes: u64, by_texels: bool) -> Need {
    let bake = &plan.site.bake;
    // one probe is one sun, however many steps the site names; what is wrong with the sky is told where it is made
    let sun_steps = lapse_params(&plan.site, &plan.files).map_or(bake.sun_steps, |sky| sky.effective_sun_steps());
    let functions = if bake.sun_bounce { USUAL_FUNCTIONS.min(sun_steps) } else { 0 };
    let light = plan.layout(sun_steps, functions);
    let light_bytes = 4 * (light.mask_words() + light.transfer_floats() + light.bounce_floats()) as u64;
    let hit_bytes = u64::from(bake.samples) * HIT_BYTES as u64;
    let block = points_per_block(points as usize, u64::from(bake.samples)) as u64;
    let atlas = if by_texels { TexelCounts::of(bake.effective_texels(), light) } else { TexelCounts::default() };
    let panorama = side_of(&plan.site).map_or_else(TexelCounts::default, |side| TexelCounts::of_panorama(side, light));
    let keeps_cells = keeps_cells(plan, by_texels);
    let params = LightParams {
        samples: bake.samples,
        bounces: bake.bounces,
        coefficients: light.coefficients as usize,
        channels: channels(bake.transfer),
        ..LightParams::default()
    };
    Need {
        least: geometry_bytes
            + bytes_of_points(points, vertices[0], light_bytes)
            + bytes_of_bounces(points, &params, (functions, keeps_cells), light)
            + atlas.and(panorama).memory_bytes(light)
            + scan_bytes(vertices[1], light),
        thread: block.min(points) * (hit_bytes + light_bytes) * BLOCK_COPIES,
        kept: (points * hit_bytes).min(LightParams::default().hit_budget_bytes),
    }
}

/// Bytes of what preparation leaves, with what is made of its textures, and what rays meet.
fn expected_geometry_bytes(prepare: &PrepareEstimate) -> u64 {
    prepare.mesh_bytes + prepare.texture_bytes / PYRAMIDS + ray_bytes(prepare) + prepare.vertices * size_of::<f32>() as u64
}

/// Bytes of what rays meet once the site is prepared.
fn ray_bytes(prepare: &PrepareEstimate) -> u64 {
    (RAY_TRIANGLE_BYTES * prepare.triangles_original as f64) as u64
}

/// Points, and light: of the points twice, gathered and solved, and of the vertices.
fn bytes_of_points(points: u64, vertices: u64, light_bytes: u64) -> u64 {
    points * (size_of::<[f32; 6]>() as u64 + 8 + 2 * light_bytes) + vertices * light_bytes
}

/// Whether what cells reflect is kept for others that ask for it.
fn keeps_cells(plan: &Plan, by_texels: bool) -> bool {
    by_texels || side_of(&plan.site).is_some() || is_wanted(&plan.site)
}

/// What followed paths bring to points, which holds all lanes, and the sixteen lanes that bounce together: those of points three times, and those of about as many cells, whose bounces
/// before take half as much. All of the cells' are kept where others ask for their light.
fn bytes_of_bounces(points: u64, params: &LightParams, (functions, keeps_cells): (u32, bool), light: LightLayout) -> u64 {
    let bounces = u64::from(params.bounces);
    let Some(before) = bounces.checked_sub(1) else { return 0 };
    let groups = if keeps_cells { params.bounce_passes(functions as usize) / bounces } else { 1 };
    let followed = 4 * (light.transfer_floats() + light.bounce_floats()) as u64;
    points * (followed + 3 * 64 + groups * (64 + 32 * before.min(MAX_FOLLOWED as u64)))
}

/// So many vertices of the scan itself, with their light, whose numbers take 16 bits.
fn scan_bytes(vertices: u64, light: LightLayout) -> u64 {
    vertices * (SCAN_VERTEX_BYTES + (4 * light.mask_words() + 2 * (light.transfer_floats() + light.bounce_floats())) as u64)
}

/// How many texels of an atlas hold light, about: of all, masks; fewer the rest.
#[derive(Clone, Copy, Debug, Default)]
struct TexelCounts {
    masks: u64,
    sky: u64,
    bounce: u64,
}

impl TexelCounts {
    /// Of an atlas of so many texels along a side.
    fn of(side: u32, light: LightLayout) -> Self {
        let masks = (COVERED * f64::from(side).powi(2)) as u64;
        let squares = u64::from(BOUNCE_BLOCK * BOUNCE_BLOCK);
        let bounce = if light.sun_bounce_functions > 0 { masks / squares } else { 0 };
        Self { masks, sky: masks >> (2 * sky_level(light.channels)), bounce }
    }

    /// Bytes of their light: of masks, of the sky, of the bounced sun.
    fn light_bytes(self, light: LightLayout) -> [u64; 3] {
        let Self { masks, sky, bounce } = self;
        let numbers = [light.mask_words(), light.transfer_floats(), light.bounce_floats()].map(|numbers| 4 * numbers as u64);
        [masks * numbers[0], sky * numbers[1], bounce * numbers[2]]
    }

    /// Of a panorama of faces of so many texels along a side: rooms without a roof see the sky through some of them.
    fn of_panorama(side: u32, light: LightLayout) -> Self {
        let across = (SEEN * 6.0).sqrt() * f64::from(side);
        Self::of((across / COVERED.sqrt()) as u32, light)
    }

    /// All of both.
    fn and(self, more: Self) -> Self {
        Self { masks: self.masks + more.masks, sky: self.sky + more.sky, bounce: self.bounce + more.bounce }
    }

    /// The memory that they take at once.
    fn memory_bytes(self, light: LightLayout) -> u64 {
        self.masks * TEXEL_BYTES + TEXEL_COPIES * self.light_bytes(light).iter().sum::<u64>()
    }

    /// What is kept of them on disk: blocks of all that was asked for, and their light when it is done.
    fn kept_bytes(self, light: LightLayout) -> u64 {
        let [masks, sky, bounce] = self.light_bytes(light);
        2 * masks + sky + (SKY_ASKED * sky as f64) as u64 + 2 * bounce
    }
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
        // those that do not fit count, too
        let params = &LightParams { hit_budget_bytes: u64::MAX, ..params.clone() };
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

fn reckon(plan: &Plan, size: &Size, sun_steps: u32, params: &LightParams, timed: &Timed) -> Estimate {
    let &Size { vertices, triangles, grid_points, .. } = size;
    // a point in space is like one on a surface: it sees half of the sphere, and what fills it
    let points = size.points + AXES.len() as u64 * grid_points;
    let all = |per_point: f64| per_point * points as f64;
    let functions = if timed.bounces_sun { USUAL_FUNCTIONS.min(sun_steps) } else { 0 };
    let light: LightLayout = plan.layout(sun_steps, functions);
    let lanes = light.transfer_floats() + light.bounce_floats();
    let passes = params.bounce_passes(functions as usize);
    let seconds_per_ray = timed.gather_seconds / timed.gather_rays.max(1.0);
    let bounce_seconds = timed.hits * passes as f64 * seconds_per_ray / BOUNCED_HITS_PER_RAY;
    let traced_seconds = size.depth * (timed.gather_seconds + timed.mask_seconds);
    let light_bytes = 4 * (light.mask_words() + lanes) as u64;
    let hit_bytes = (all(timed.hits) * HIT_BYTES) as u64;
    let kept = hit_bytes.min(params.hit_budget_bytes);
    // what rays met is kept twice as wide, of all looks
    let looks = (timed.gather_rays / f64::from(params.samples)).max(1.0);
    let traces = (2.0 * kept as f64 * looks) as u64;
    let counts = Counts { vertices, triangles, ..Counts::default() };
    let of_scan = Counts { vertices: size.scan[0], triangles: size.scan[1], ..Counts::default() };
    let patches = (size.surfaces * timed.patches as f64) as u64;
    let keeps_cells = keeps_cells(plan, size.atlas.is_some());
    // geometry, rays, points, hits, and light: of the points twice, gathered and solved, and of the vertices
    let solving = size.geometry_bytes
        + kept
        + patches * 4 * u64::from(1 + sun_steps.div_ceil(32))
        + bytes_of_points(points, vertices, light_bytes)
        + bytes_of_bounces(points, params, (functions, keeps_cells), light);
    // texels ask the suns everywhere, the sky where it changes, the bounced sun in every square
    let of_atlas = size.atlas.map_or_else(TexelCounts::default, |side| TexelCounts::of(side, light));
    let panorama = side_of(&plan.site);
    let seen = panorama.map_or_else(TexelCounts::default, |side| TexelCounts::of_panorama(side, light));
    let atlas = of_atlas.and(seen);
    let texels = atlas.masks as f64;
    // what was scanned changes from texel to texel
    let gathered = SKY_ASKED * of_atlas.sky as f64 + seen.sky as f64 + atlas.bounce as f64;
    let texel_seconds = size.depth * (gathered * timed.gather_seconds + texels * timed.mask_seconds);
    let [scan_vertices, scan_triangles] = size.scan;
    let scanned = scan_vertices as f64;
    let scan_seconds = size.depth * scanned * (timed.gather_seconds + timed.mask_seconds);
    let texel_bytes = atlas.memory_bytes(light) + scan_bytes(scan_vertices, light);
    let shown =
        size.atlas.map_or(0, |side| atlas_bytes(light, [side; 2])) + panorama.map_or(0, |side| panorama_bytes(light, side));
    let packed = (ATLAS_PACKS_TO * shown as f64) as u64;
    let encoding = size.geometry_bytes + vertices * light_bytes + ENCODED_TIMES * size.largest_texture_bytes / 2;
    Estimate {
        vertices,
        triangles,
        points: size.points,
        grid_points,
        gather_rays: (all(timed.gather_rays) + (gathered + scanned) * timed.gather_rays) as u64,
        mask_rays: (all(timed.mask_rays) + (texels + scanned) * timed.mask_rays) as u64
            + (size.surfaces * timed.sun_rays as f64) as u64,
        seconds: all(traced_seconds + bounce_seconds)
            + size.surfaces * size.depth * timed.sun_seconds
            + texel_seconds
            + scan_seconds,
        memory_bytes: (solving + texel_bytes).max(encoding + texel_bytes),
        cache_bytes: size.kept_rays_bytes
            + kept_bounces::kept_bytes(params, passes, points, all(bounce_seconds))
            + hit_bytes
            + traces
            + points * (light_bytes + 16)
            + (vertices + 2 * scan_vertices) * light_bytes
            + scan_vertices * SCAN_VERTEX_BYTES
            + atlas.kept_bytes(light),
        bundle_bytes: (vertices + scan_vertices) * (BUNDLE_VERTEX_BYTES + light_bytes)
            + (triangles + scan_triangles) * BUNDLE_TRIANGLE_BYTES
            + grid_points * point_bytes(light)
            + packed,
        viewer_bytes: viewer_bytes(shown_counts(counts, Some(of_scan)), light, size.texture_bytes, [size.atlas, panorama]),
        prepare: None,
        refused: None,
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

    #[test]
    fn an_atlas_is_reckoned_as_the_workshops_was_measured() {
        let light = LightLayout { sun_steps: 92, coefficients: 4, channels: 3, sun_bounce_functions: 44 };
        let atlas = TexelCounts::of(2048, light);
        // 3,163,272, 902,005 and 257,530 were there: texels at the rims of charts count on each level
        assert!((3_000_000..3_200_000).contains(&atlas.masks), "{atlas:?}");
        assert!((700_000..902_005).contains(&atlas.sky) && (180_000..257_530).contains(&atlas.bounce), "{atlas:?}");
        let memory = atlas.memory_bytes(light);
        assert!((900_000_000..1_550_000_000).contains(&memory), "{memory}");
        let packed = ATLAS_PACKS_TO * atlas_bytes(light, [2048; 2]) as f64;
        assert!((60e6..75e6).contains(&packed), "{packed}");
        let grey = LightLayout { channels: 1, sun_bounce_functions: 0, ..light };
        let atlas = TexelCounts::of(2048, grey);
        assert_eq!((atlas.sky, atlas.bounce), (atlas.masks, 0));
    }
}
