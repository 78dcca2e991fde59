//! A bake by many machines: shards that each do their blocks, and the merge that makes the bundle of them.
//!
//! A shard is the same plan, of which it computes its own blocks into the cache; the merge is the bake that finds all of them there. So the
//! bundle is the same as one machine's, byte for byte, and whatever is killed, done twice or done elsewhere is no special case.

use crate::bake::{BakeReport, bake_where};
use crate::blocks::Share;
use crate::cache::{Cache, has_block};
use crate::details::Details;
use crate::division::{Division, PlanNote, shards_of};
use crate::earlier::{Earlier, SceneRecord, leave_record};
use crate::error::BakeError;
use crate::kept_rays::kept_rays;
use crate::light::LightInput;
use crate::names::{LightNames, SceneDigests};
use crate::plan::Plan;
use crate::report::Reporter;
use crate::scene::{Original, Traceable};
use crate::shard::Shard;
use crate::sky::{SkyShare, sky_names};
use crate::stages::{LightStages, Work, lay_out};
use crate::texels::Atlas;
use heliodon_bundle::memory::peak_resident_bytes;
use heliodon_bundle::site::{InputKind, SITE_FILE_NAME};
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// What a shard has done.
#[derive(Clone, Debug, Serialize)]
pub struct ShardReport {
    /// Which of how many, `2/7`.
    pub shard: String,
    /// The key of the plan, which its merge must share.
    pub plan: String,
    /// Where its blocks lie.
    pub cache: PathBuf,
    /// Whether the bundle was there already, so that nothing was done.
    pub up_to_date: bool,
    /// Blocks of its own that it has done in this run,
    pub computed: usize,
    /// of so many that are its own.
    pub own: usize,
    /// Blocks of all shards that are not there yet.
    pub missing: usize,
    /// Blocks of all shards.
    pub blocks: usize,
    /// Seconds that it took.
    pub seconds: f64,
    /// The most memory that the process has needed so far, where the system tells.
    pub peak_memory_bytes: Option<u64>,
}

/// Why shards cannot be merged, or a shard not be a part of its plan.
#[derive(Debug, thiserror::Error)]
pub enum MergeError {
    /// No shard has begun.
    #[error("no shard of this bake has run in {root}{others}; run `{command}` for every I from 1 to N, then merge again")]
    NoShards {
        /// The cache.
        root: PathBuf,
        /// What lies there instead, as the end of a sentence.
        others: String,
        /// What to run.
        command: String,
    },
    /// Shards are missing.
    #[error(
        "{missing} of {blocks} blocks are missing in {folder}, those of {shards}{others}; run {commands} (what is done is not done again), then merge again"
    )]
    Missing {
        /// Blocks that are missing,
        missing: usize,
        /// of so many.
        blocks: usize,
        /// Where they should be.
        folder: PathBuf,
        /// The shards, as people write them.
        shards: String,
        /// What else lies there, as the end of a sentence.
        others: String,
        /// What to run.
        commands: String,
    },
    /// The site or the program is not what the plan was made of.
    #[error(
        "{site} is not what the plan {expected} was made of: it differs in {differences}; make both the same, or begin anew with the site as it is"
    )]
    OtherPlan {
        /// The site's file.
        site: PathBuf,
        /// The key that was asked for.
        expected: String,
        /// In what they differ.
        differences: String,
    },
}

/// Does a shard's part of a bake, as far as it is not there yet. `expected` is the key of the plan that it must be a part of, if any.
///
/// # Errors
/// As [`crate::bake::bake`], and [`MergeError::OtherPlan`].
pub fn bake_shard(
    plan: &Plan,
    shard: Shard,
    expected: Option<&str>,
    reporter: &dyn Reporter,
) -> Result<ShardReport, BakeError> {
    let begun = Instant::now();
    let mut report = ShardReport {
        shard: shard.to_string(),
        plan: expected.unwrap_or_default().to_owned(),
        cache: plan.cache_root(),
        up_to_date: true,
        computed: 0,
        own: 0,
        missing: 0,
        blocks: 0,
        seconds: 0.0,
        peak_memory_bytes: None,
    };
    if !plan.options.again && plan.is_up_to_date() {
        reporter.note("the bundle is up to date");
        return Ok(report);
    }
    check_details(plan, reporter)?;
    let mut scene = plan.read_scene(reporter)?;
    let (digests, record) = (SceneDigests::new(&scene), SceneRecord::new(&scene));
    let key = plan.key(&digests);
    let note = PlanNote::new(plan, &key, shard.count());
    if let Some(expected) = expected.filter(|expected| *expected != key) {
        let planned = PlanNote::read(&plan.cache_root().join(expected));
        let differences = planned.map_or_else(|| "what cannot be told".to_owned(), |planned| told(&note.differences(&planned)));
        let (site, expected) = (plan.site.path().to_owned(), expected.to_owned());
        return Err(MergeError::OtherPlan { site, expected, differences }.into());
    }
    let cache = Cache::join(&plan.cache_root(), &key, &plan.owner())?;
    // the merge alone needs it: one that is too small is told before hours are spent, and what fits is kept
    drop(Atlas::new(&plan.site, &scene, Some(&cache))?);
    note.keep(&cache)?;
    cache.adopt(&sky_names(plan)?.all())?;
    reporter.stage("rays", 0);
    let rays = kept_rays(&mut scene, &cache, reporter)?;
    scene.original.iter_mut().for_each(Original::forget_looks);
    let mesh = &scene.mesh;
    let traceable = Traceable::new(&scene, rays);
    let params = plan.light_params(&mesh.positions, &mesh.triangles);
    let grid = plan.grid(Some(&traceable.rays))?;
    let surfaces = traceable.surfaces();
    reporter.finished();
    let sky = SkyShare::new(plan, &cache, reporter, Share { shard, first: 0 })?;
    let suns = sky.suns()?;
    let sun_bounce = plan.site.bake.sun_bounce;
    // texels and the scan itself take their light from all cells: the merge solves them
    let names = &LightNames::new(&digests, &params, (&suns, sun_bounce), &grid, [None; 3]);
    cache.adopt(&names.all())?;
    reporter.stage("points", 0);
    let layout = lay_out(&surfaces, &params, &names.sight, Some(&cache))?;
    reporter.finished();
    let (params, grid, record) = (&params, &grid, &record);
    let (texels, panorama, scan) = (None, None, None);
    let input = LightInput { surfaces, suns: &suns, sun_bounce, params, grid, texels, panorama, scan, names, record };
    let earlier = Earlier::find(&input, &cache);
    leave_record(&input, &cache)?;
    let stages = LightStages::new(&input, layout, earlier.as_ref());
    let mut division = Division::default();
    let (stage, skies) = sky.blocks()?;
    division.add(stage, skies);
    stages.divide(&mut division);
    division.keep(&cache)?;
    report.blocks = division.count();
    report.own = (0..report.blocks).filter(|&block| shard.takes(block)).count();
    report.computed = sky.run_own()?;
    report.computed += stages.run_own(&Work { cache: Some(&cache), reporter, shard: Some((shard, &division)) })?;
    report.missing = division.missing(|stage, block| cache.has(stage, block)).len();
    Ok(ShardReport {
        plan: key,
        cache: cache.folder().to_owned(),
        up_to_date: false,
        seconds: begun.elapsed().as_secs_f64(),
        peak_memory_bytes: peak_resident_bytes(),
        ..report
    })
}

/// Looks whether the bundle can stand where it should, and keeps the plan in the cache for `count` shards that are to come; returns its key.
///
/// # Errors
/// As [`crate::bake::bake`].
pub fn begin_shards(plan: &Plan, count: u32, reporter: &dyn Reporter) -> Result<String, BakeError> {
    plan.check_target()?;
    check_details(plan, reporter)?;
    let scene = plan.read_scene(reporter)?;
    let key = plan.key(&SceneDigests::new(&scene));
    let cache = Cache::join(&plan.cache_root(), &key, &plan.owner())?;
    if plan.options.no_cache {
        cache.forget_finished_for_all()?;
    }
    drop(Atlas::new(&plan.site, &scene, Some(&cache))?);
    PlanNote::new(plan, &key, count).keep(&cache)?;
    Ok(key)
}

/// Looks at the details, which the merge alone needs: what is wrong with them is told before hours are spent.
fn check_details(plan: &Plan, reporter: &dyn Reporter) -> Result<(), BakeError> {
    drop(Details::read(&plan.site, &plan.files, reporter)?);
    plan.check_unchanged(InputKind::is_detail)
}

/// Makes the bundle of what shards have left in the cache.
///
/// # Errors
/// As [`crate::bake::bake`]; [`MergeError`] names what is missing, and what makes it.
pub fn merge(plan: &Plan, reporter: &dyn Reporter) -> Result<BakeReport, BakeError> {
    bake_where(plan, reporter, false, |key| Ok(check_whole(plan, key)?))
}

/// How far all shards of a plan are together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Standing {
    /// Blocks that are done,
    pub done: usize,
    /// of so many; 0 before the first shard has counted them.
    pub blocks: usize,
}

/// How far all shards of the plan `key` are, and which of `count` have blocks left, ascending; all, before the first shard has counted them.
#[must_use]
pub fn standing(plan: &Plan, key: &str, count: u32) -> (Standing, Vec<u32>) {
    let folder = plan.cache_root().join(key);
    let Some(division) = Division::kept(&folder) else { return (Standing::default(), (1..=count).collect()) };
    let missing = division.missing(|stage, block| has_block(&folder, stage, block));
    let blocks = division.count();
    (Standing { done: blocks - missing.len(), blocks }, shards_of(&missing, count))
}

fn check_whole(plan: &Plan, key: &str) -> Result<(), MergeError> {
    let root = plan.cache_root();
    let folder = root.join(key);
    let note = PlanNote::read(&folder);
    let others = others(&note.clone().unwrap_or_else(|| PlanNote::new(plan, key, 1)), &root);
    let (Some(note), Some(division)) = (note, Division::kept(&folder)) else {
        return Err(MergeError::NoShards { root, others, command: command(plan, "I/N") });
    };
    let missing = division.missing(|stage, block| has_block(&folder, stage, block));
    if missing.is_empty() {
        return Ok(());
    }
    let shards = shards_of(&missing, note.shards);
    let names: Vec<String> = shards.iter().map(|index| format!("{index}/{}", note.shards)).collect();
    let (first, rest) = names.split_at(names.len().min(MOST_NAMED));
    let more = if rest.is_empty() { String::new() } else { format!(" and {} more", rest.len()) };
    let commands: Vec<String> = first.iter().map(|name| format!("`{}`", command(plan, name))).collect();
    Err(MergeError::Missing {
        missing: missing.len(),
        blocks: division.count(),
        folder,
        shards: format!("shard{} {}{more}", if names.len() == 1 { "" } else { "s" }, first.join(", ")),
        others,
        commands: commands.join(" and "),
    })
}

/// Shards that a message names one by one.
const MOST_NAMED: usize = 8;

fn command(plan: &Plan, shard: &str) -> String {
    let cache = plan.options.cache.as_ref().map_or_else(String::new, |cache| format!(" --cache {}", cache.display()));
    let (file, bundle) = (plan.site.path(), plan.options.bundle.display());
    let site = if file.ends_with(SITE_FILE_NAME) { plan.site.folder() } else { file }.display();
    format!("heliodon bake {site} -o {bundle}{cache} --shard {shard}")
}

/// What a cache holds of other plans, as the end of a sentence.
fn others(note: &PlanNote, root: &Path) -> String {
    let others: Vec<String> = note.others(root).iter().map(|other| told(&note.differences(other))).collect();
    if others.is_empty() {
        return String::new();
    }
    format!(" (there are shards of another plan, which cannot be taken: it differs in {})", others.join("; another in "))
}

fn told(differences: &[String]) -> String {
    differences.join(", ")
}
