//! The bake: from a plan to a bundle, step by step, each of which survives a kill.

use crate::actors::actor_metas;
use crate::budget::{Means, shown_counts, viewer_bytes, viewer_doubt};
use crate::cache::{Cache, Taken};
use crate::chunks::{ChunkMaker, VertexValues};
use crate::darkness::tell_of_darkness;
use crate::details::Details;
use crate::earlier::SceneRecord;
use crate::error::BakeError;
use crate::estimate::light_need;
use crate::evidence::seen_share;
use crate::grid::GridPlan;
use crate::ground;
use crate::kept_rays::kept_rays;
use crate::key::told_name;
use crate::lamps;
use crate::light::{BakedGrid, BakedLight, LightInput, bake_light};
use crate::names::{LightNames, SceneDigests};
use crate::panorama::Panorama;
use crate::plan::Plan;
use crate::report::{Reporter, WarningsKept};
use crate::rooms;
use crate::scan::{self, Scan};
use crate::scene::{Original, Scene, Traceable};
use crate::sky::{BakedSky, bake_sky, sky_names};
use crate::stages::Work;
use crate::texels::{Atlas, weathering_layer};
use crate::weathering::{BakedWeathering, WeatherPlan, WeatheredAlbedo, bake_weathering};
use glam::Vec3;
use heliodon_bundle::grid::AXES;
use heliodon_bundle::manifest::Counts;
use heliodon_bundle::memory::{give_back_freed_memory, peak_resident_bytes};
use heliodon_bundle::site::{Actor, InputKind};
use heliodon_bundle::{
    BundleMeta, BundleReader, BundleWriter, EvidenceInfo, GridPoints, LightLayout, Manifest, VertexLight, WriteError,
};
use heliodon_light::LightParams;
use heliodon_mesh::Texture;
use heliodon_rays::TriangleScene;
use heliodon_sky::lapse::SunBounceBasis;
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// What a bake has done.
#[derive(Clone, Debug, Serialize)]
pub struct BakeReport {
    /// The bundle.
    pub bundle: PathBuf,
    /// Whether it was there already, so that nothing was done.
    pub up_to_date: bool,
    /// Chunks, vertices and triangles in it.
    pub counts: Counts,
    /// Sun steps.
    pub sun_steps: u32,
    /// Entries of the sky.
    pub sky_steps: usize,
    /// How far off the surface rays started.
    pub offset_m: f64,
    /// Figures of the solver: rays, points, errors of the compression over the day.
    pub measures: BTreeMap<String, f64>,
    /// What is odd but did not stop the bake; none where nothing was done.
    pub warnings: Vec<String>,
    /// Seconds that each step took in this run.
    pub seconds: Vec<(String, f64)>,
    /// What was taken from the cache, stage by stage.
    pub taken: Vec<Taken>,
    /// What the cache keeps for bakes to come, bytes on the disk.
    pub kept_bytes: u64,
    /// The most memory that the process has needed so far, where the system tells.
    pub peak_memory_bytes: Option<u64>,
}

/// Bakes, or goes on with what an earlier run of the same bake has left.
///
/// # Errors
/// Whatever [`BakeError`] names; a bundle that was there stays as it was.
pub fn bake(plan: &Plan, reporter: &dyn Reporter) -> Result<BakeReport, BakeError> {
    bake_where(plan, reporter, plan.options.no_cache, |_| Ok(()))
}

/// As [`bake`], where `may_go_on` agrees with what there is of the key's work; `anew` takes nothing of finished bakes.
pub(crate) fn bake_where(
    plan: &Plan,
    reporter: &dyn Reporter,
    anew: bool,
    may_go_on: impl FnOnce(&str) -> Result<(), BakeError>,
) -> Result<BakeReport, BakeError> {
    if !plan.options.again && plan.is_up_to_date() {
        reporter.note("the bundle is up to date");
        return up_to_date_report(plan);
    }
    plan.check_target()?;
    let reporter = &WarningsKept::new(reporter);
    let mut clock = Clock::default();
    let details = Details::read(&plan.site, &plan.files, reporter)?;
    plan.check_unchanged(InputKind::is_detail)?;
    let mut scene = plan.read_scene(reporter)?;
    details.doubts(&plan.site, &scene).iter().for_each(|doubt| reporter.warning(doubt));
    let (digests, record) = (SceneDigests::new(&scene), SceneRecord::new(&scene));
    let key = plan.key(&digests);
    may_go_on(&key)?;
    let cache = Cache::open(&plan.cache_root(), &key, &plan.owner())?;
    if anew {
        cache.forget_finished();
    }
    cache.adopt(&sky_names(plan)?.all())?;
    clock.lap("reading");
    reporter.stage("rays", 0);
    let rays = kept_rays(&mut scene, &cache, reporter)?;
    reporter.finished();
    clock.lap("rays");
    let atlas = Atlas::new(&plan.site, &scene, Some(&cache))?;
    clock.lap("charts");
    let panorama = Panorama::new(&plan.site, &scene, &rays, reporter)?;
    clock.lap("panorama");
    let of_scan = scan::of_site(&plan.site, &mut scene, reporter);
    scene.original.iter_mut().for_each(Original::forget_looks);
    let scan_vertices = of_scan.as_ref().map_or(0, |scan| scan.mesh.positions.len() as u64);
    let means = within_budget(plan, &scene, (&rays, scan_vertices), reporter)?;
    let scan = of_scan.map(|scan| Scan::new(scan, &cache)).transpose()?;
    // what preparation and the hierarchy of rays needed for a moment
    give_back_freed_memory();
    let sky = bake_sky(plan, &cache, reporter)?;
    clock.lap("sky");
    let sky_steps = sky.lapse.steps.len();
    let suns = sky.suns();
    let of = SceneParts {
        scene: &scene,
        digests: &digests,
        record: &record,
        atlas: atlas.as_ref(),
        panorama: panorama.as_ref(),
        scan: scan.as_ref(),
    };
    let solved = means.run(|| scene_light(plan, &of, rays, (&suns, means), &cache, reporter))?;
    clock.lap("light");
    let names = solved.names.clone();
    let manifest = write_bundle(plan, (&of, &details), sky, solved, &cache, reporter)?;
    clock.lap("writing");
    let sides = [atlas.as_ref().map(Atlas::side), panorama.as_ref().map(Panorama::side)];
    let shown = shown_counts(manifest.counts, manifest.scan);
    let needs = viewer_bytes(shown, manifest.light, scene.mesh.texture_bytes() as u64, sides);
    viewer_doubt(plan.site.budget.viewer_bytes(), needs).iter().for_each(|doubt| reporter.warning(doubt));
    let taken = cache.all_taken();
    let kept_bytes = if plan.options.no_cache {
        cache.remove(&plan.owner());
        0
    } else {
        let charts = atlas.iter().map(|atlas| atlas.name().to_owned()).collect();
        cache.finish(&[sky_names(plan)?.all(), names, charts].concat(), &plan.owner())?
    };
    let report = report_of(plan, &manifest, false);
    Ok(BakeReport { seconds: clock.laps, sky_steps, warnings: reporter.warnings(), taken, kept_bytes, ..report })
}

#[derive(Debug)]
struct Clock {
    last: Instant,
    laps: Vec<(String, f64)>,
}

impl Default for Clock {
    fn default() -> Self {
        Self { last: Instant::now(), laps: Vec::new() }
    }
}

impl Clock {
    fn lap(&mut self, name: &str) {
        let now = Instant::now();
        self.laps.push((name.to_owned(), (now - self.last).as_secs_f64()));
        self.last = now;
    }
}

/// What is solved of a scene.
struct Solved {
    light: BakedLight,
    grid: GridPlan,
    actors: Vec<Actor>,
    /// Where the site wants it.
    weather: Option<(WeatherPlan, BakedWeathering)>,
    /// Of all blocks that it was made of.
    names: Vec<String>,
}

/// A scene, and what is known of it before its light.
struct SceneParts<'a> {
    scene: &'a Scene,
    digests: &'a SceneDigests,
    record: &'a SceneRecord,
    atlas: Option<&'a Atlas>,
    panorama: Option<&'a Panorama>,
    scan: Option<&'a Scan<'a>>,
}

fn scene_light(
    plan: &Plan,
    &SceneParts { scene, digests, record, atlas, panorama, scan }: &SceneParts,
    rays: TriangleScene,
    (suns, means): (&[Vec3], Means),
    cache: &Cache,
    reporter: &dyn Reporter,
) -> Result<Solved, BakeError> {
    let mesh = &scene.mesh;
    let traceable = Traceable::new(scene, rays);
    let params = plan.light_params(&mesh.positions, &mesh.triangles);
    // the same bits whatever is in memory
    let params = LightParams { hit_budget_bytes: means.kept, ..params };
    let actors = plan.actors(Some(&traceable.rays));
    let of_files = plan.figures.iter().flat_map(|figure| figure.warnings.iter().cloned());
    let doubts = ground::doubts(&plan.site, &actors, &plan.figures, &traceable.rays);
    let of_lamps = lamps::doubts(&plan.site, &traceable.rays);
    let of_rooms = rooms::doubt(&plan.site, scene);
    let is_purged = plan.site.prepare.as_ref().is_some_and(|settings| settings.purge);
    let in_stone = if is_purged { Vec::new() } else { rooms::stone_doubts(&plan.site, &traceable.rays) };
    of_files.chain(doubts).chain(of_lamps).chain(of_rooms).chain(in_stone).for_each(|warning| reporter.warning(&warning));
    let grid = plan.grid(Some(&traceable.rays))?;
    let sun_bounce = plan.site.bake.sun_bounce;
    let names = LightNames::new(
        digests,
        &params,
        (suns, sun_bounce),
        &grid,
        [atlas.map(Atlas::digest), panorama.map(Panorama::digest), scan.map(Scan::digest)],
    );
    let weather = WeatherPlan::new(&plan.site);
    let weather = weather.map(|plan| (plan.names(digests, params.offset_m, atlas), plan));
    let of_weather = weather.iter().flat_map(|(names, _)| names.all());
    let all_names: Vec<String> = names.all().into_iter().chain(of_weather).collect();
    cache.adopt(&all_names)?;
    let (surfaces, params, of_grid) = (traceable.surfaces(), &params, &grid);
    let texels = atlas.map(|atlas| (scene, atlas));
    let input = LightInput { surfaces, suns, sun_bounce, params, grid: of_grid, texels, panorama, scan, names: &names, record };
    let light = bake_light(&input, Some(cache), reporter)?;
    tell_of_darkness(&plan.site.parts, scene, &traceable.rays, &light.light.validity, params.offset_m, reporter);
    let weather = match weather {
        None => None,
        Some((names, plan)) => {
            let work = Work { cache: Some(cache), reporter, shard: None };
            let baked = bake_weathering((&plan, &names), &input, &light.light.validity, &work)?;
            Some((plan, baked))
        }
    };
    Ok(Solved { light, grid, actors, weather, names: all_names })
}

/// With what the light may be solved within the site's budget: threads, and hits that are kept.
fn within_budget(
    plan: &Plan,
    scene: &Scene,
    (rays, scan_vertices): (&TriangleScene, u64),
    reporter: &dyn Reporter,
) -> Result<Means, BakeError> {
    let (budget, threads) = (plan.site.budget.bake_bytes(), rayon::current_num_threads());
    if budget.is_none() {
        return Ok(Means { threads, kept: LightParams::default().hit_budget_bytes });
    }
    let need = light_need(plan, scene, rays, [plan.grid(Some(rays))?.cells.len() as u64, scan_vertices]);
    let means = need.within("the light", budget, threads)?;
    if means.threads < threads || means.kept < need.kept {
        let (kept, all) = (means.kept >> 20, need.kept >> 20);
        reporter.note(&format!(
            "the light stays within [budget] with {} of {threads} threads and {kept} of {all} MiB for what rays have met; the rest is read from the cache for each bounce",
            means.threads
        ));
    }
    Ok(means)
}

/// Writes everything into the bundle, which appears whole or not at all.
fn write_bundle(
    plan: &Plan,
    (&SceneParts { scene, atlas, panorama, scan, .. }, details): (&SceneParts, &Details),
    sky: BakedSky,
    Solved { mut light, grid, actors, weather, names: _ }: Solved,
    cache: &Cache,
    reporter: &dyn Reporter,
) -> Result<Manifest, BakeError> {
    let (mesh, of_scan, light) = (&scene.mesh, light.scan.take(), &light);
    let bounce = light.light.sun_bounce.as_ref();
    let layout = plan.layout(sky.sun_steps, bounce.map_or(0, |bounce| bounce.functions.len() as u32));
    let params = plan.light_params(&mesh.positions, &mesh.triangles);
    let mut meta = plan.meta(layout, params.offset_m);
    meta.measures = measures(light, scene);
    let scan = scan.zip(of_scan.as_ref());
    let of_scan = scan.iter().flat_map(|(_, light)| light.measures());
    meta.measures.extend(of_scan.map(|(name, value)| (format!("scan_{name}"), value)));
    meta.prepared = scene.prepared.clone();
    let mut writer = create_writer(&plan.options.bundle, &meta)?;

    if let (Some(atlas), Some(texels)) = (atlas, &light.texels) {
        let (textures, count) = texels.textures(scene, atlas, layout);
        writer.add_texels(&textures, atlas.info(count))?;
    }
    if let (Some(panorama), Some(texels)) = (panorama, &light.panorama) {
        writer.add_panorama(&panorama.textures(texels, layout), panorama.info())?;
    }
    plan.check_unchanged(InputKind::is_detail)?;
    details.write(&plan.site, &mut writer)?;
    if let (Some(atlas), Some((weather, baked))) = (atlas, weather.as_ref().filter(|(_, baked)| !baked.texels.is_empty())) {
        writer.add_texel_weathering(&weathering_layer(scene, atlas, &baked.texels, &weather.looks))?;
    }
    let weathered = weather.as_ref().map(|(weather, baked)| WeatheredAlbedo::new(weather, baked, mesh));
    let maker = ChunkMaker::new(scene, atlas, VertexValues::of(light), layout).weathered(weathered).detailed(&plan.site);
    let mut textures = Textures::default();
    reporter.stage("writing", mesh.triangles.len() as u64);
    reporter.progress(0);
    let mut done = 0;
    for part in 0..scene.parts.len() {
        let mut shown = BTreeSet::new();
        for piece in maker.pieces(part) {
            let material = piece.textured_material.and_then(|material| mesh.materials.get(usize::from(material)));
            let texture = match material.and_then(|material| material.texture.as_ref()) {
                Some(texture) => Some(textures.number(texture, plan.site.folder(), &mut writer)?),
                None => None,
            };
            writer.push_chunk(&maker.make(part, &piece, texture))?;
            shown.extend(texture);
            done += piece.triangles.len() as u64;
            reporter.progress(done);
        }
        if plan.site.parts[part].evidence.is_some() {
            writer.add_evidence(part, shown, EvidenceInfo { seen: seen_share(scene, part) })?;
        }
    }
    for (index, path) in sky.map_paths.iter().enumerate() {
        writer.add_sky_map(path, &sky.map_bytes(cache, index)?)?;
    }
    if let Some(baked) = &light.grid {
        writer.add_grid(&grid_points(&grid, baked, layout))?;
    }
    for actor in actor_metas(&plan.files, actors) {
        writer.add_actor(&actor)?;
    }
    writer.add_living(plan.site.folder())?;
    let copied =
        |kind| matches!(kind, InputKind::Actor(_) | InputKind::ActorCache(_) | InputKind::ActorAlbedo(_) | InputKind::Living);
    plan.check_unchanged(copied)?;
    let mut lapse = sky.lapse;
    lapse.sun_bounce_basis =
        bounce.map(|bounce| SunBounceBasis { channels: layout.channels, functions: bounce.functions.clone() });
    if let Some((scan, light)) = scan {
        scan.write(light, (&mut writer, &meta, &lapse), reporter)?;
    }
    let manifest = writer.finish(&lapse)?;
    reporter.finished();
    Ok(manifest)
}

/// The light grid as the bundle has it: the mask of a point is that of all six of its vertices.
fn grid_points(grid: &GridPlan, baked: &BakedGrid, layout: LightLayout) -> GridPoints {
    let (light, words) = (&baked.light, layout.mask_words());
    let six = |own: &[u32]| own.repeat(AXES.len());
    GridPoints {
        origin: grid.origin,
        spacing_m: grid.spacing_m,
        cells: grid.cells.clone(),
        valid: light.valid.clone(),
        light: VertexLight {
            sun_mask: light.masks.words.chunks_exact(words).flat_map(six).collect(),
            sky_transfer: light.sky_transfer.clone(),
            sun_bounce: light.sun_bounce.clone(),
            ..VertexLight::zeros(layout, 0)
        },
    }
}

/// How often, and how far apart, a place that another process holds is tried again.
const TRIES: u32 = 20;
const BETWEEN_TRIES: Duration = Duration::from_millis(100);

/// Begins the bundle. A second bake that only looks whether it could write there ([`Plan::check_target`]) holds the place for a moment, which must
/// not cost the first one its work.
fn create_writer(bundle: &Path, meta: &BundleMeta) -> Result<BundleWriter, BakeError> {
    for _ in 1..TRIES {
        match BundleWriter::create(bundle, meta.clone()) {
            Err(WriteError::Busy { .. }) => std::thread::sleep(BETWEEN_TRIES),
            other => return Ok(other?),
        }
    }
    Ok(BundleWriter::create(bundle, meta.clone())?)
}

/// The bundle's numbers of textures; materials that share an image share its number.
#[derive(Default)]
struct Textures {
    numbers: Vec<(*const Texture, u32)>,
}

impl Textures {
    fn number(&mut self, texture: &Arc<Texture>, site: &Path, writer: &mut BundleWriter) -> Result<u32, BakeError> {
        let key = Arc::as_ptr(texture);
        if let Some(&(_, number)) = self.numbers.iter().find(|(known, _)| *known == key) {
            return Ok(number);
        }
        let name = told_name(site, Path::new(&texture.source));
        let number = writer.add_texture_wrapped(&name, &texture.image.to_png_bytes()?, texture.wrap)?;
        self.numbers.push((key, number));
        Ok(number)
    }
}

/// Figures that depend on nothing but the input.
fn measures(light: &BakedLight, scene: &Scene) -> BTreeMap<String, f64> {
    let mut measures = BTreeMap::from([
        ("gather_rays".to_owned(), light.gather_rays as f64),
        ("mask_rays".to_owned(), light.mask_rays as f64),
        ("solved_points".to_owned(), light.points as f64),
        ("source_vertices".to_owned(), scene.mesh.positions.len() as f64),
    ]);
    if let Some(bounce) = &light.light.sun_bounce {
        measures.insert("sun_bounce_median_error".to_owned(), f64::from(bounce.median_error));
        measures.insert("sun_bounce_p95_error".to_owned(), f64::from(bounce.p95_error));
    }
    for (begin, texels) in [("texel", &light.texels), ("panorama", &light.panorama)] {
        if let Some(texels) = texels {
            let [sky, bounce] = texels.samples;
            let named = [
                ("sky_samples", sky),
                ("bounce_samples", bounce),
                ("gather_rays", texels.gather_rays),
                ("mask_rays", texels.mask_rays),
            ];
            measures.extend(named.map(|(name, value)| (format!("{begin}_{name}"), value as f64)));
        }
    }
    if let Some(grid) = &light.grid {
        measures.insert("grid_points".to_owned(), grid.light.point_count() as f64);
        measures.insert("grid_gather_rays".to_owned(), grid.gather_rays as f64);
        measures.insert("grid_mask_rays".to_owned(), grid.mask_rays as f64);
    }
    measures
}

fn report_of(plan: &Plan, manifest: &Manifest, up_to_date: bool) -> BakeReport {
    BakeReport {
        bundle: plan.options.bundle.clone(),
        up_to_date,
        counts: manifest.counts,
        sun_steps: manifest.light.sun_steps,
        sky_steps: 0,
        offset_m: manifest.offset_m,
        measures: manifest.measures.clone(),
        warnings: Vec::new(),
        seconds: Vec::new(),
        taken: Vec::new(),
        kept_bytes: 0,
        peak_memory_bytes: peak_resident_bytes(),
    }
}

fn up_to_date_report(plan: &Plan) -> Result<BakeReport, BakeError> {
    let bundle = BundleReader::open(&plan.options.bundle)?;
    let mut report = report_of(plan, bundle.manifest(), true);
    report.sky_steps = bundle.lapse().steps.len();
    Ok(report)
}

#[cfg(test)]
mod tests {
    use super::*;
    use heliodon_bundle::site::Site;

    #[test]
    fn a_place_that_is_held_for_a_moment_is_tried_again() {
        let folder = tempfile::tempdir().unwrap();
        let text = "[site]\nname = \"a\"\n[[part]]\nfile = \"a.ply\"\n[sky]\nprobes = \"a.hdr\"\nmapping = \"lat-long\"\n";
        let site = Site::parse(text, folder.path().join("site.toml")).unwrap();
        let layout = LightLayout { sun_steps: 1, coefficients: 4, channels: 1, sun_bounce_functions: 0 };
        let meta = BundleMeta::from_site(&site, layout, 0.0);
        let bundle = folder.path().join("bundle");
        let other = BundleWriter::create(&bundle, meta.clone()).unwrap();
        assert!(BundleWriter::create(&bundle, meta.clone()).is_err());
        std::thread::scope(|scope| {
            let waiting = scope.spawn(|| create_writer(&bundle, &meta).is_ok());
            std::thread::sleep(2 * BETWEEN_TRIES);
            drop(other);
            assert!(waiting.join().unwrap());
        });
    }
}
