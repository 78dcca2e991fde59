//! `heliodon bake`: a site's light.

use super::prepare::describe_estimate as describe_preparation;
use crate::App;
use crate::output::{bytes, count, counted, duration};
use crate::slurm::{self, SlurmReport};
use anyhow::Result;
use heliodon_bake::bake::{BakeReport, bake};
use heliodon_bake::cache::Taken;
use heliodon_bake::estimate::{Estimate, estimate};
use heliodon_bake::merge::{ShardReport, bake_shard};
use heliodon_bake::plan::{BakeOptions, Plan};
use heliodon_bake::shard::{MOST_SHARDS, Shard};
use heliodon_bundle::site::Site;
use std::path::{Path, PathBuf};

/// Computes a site's light and writes the bundle that viewers read.
///
/// Finished work is kept in .heliodon/cache beside the bundle: run the same bake again after an interruption of any kind and it
/// goes on where it stopped; run it after a change and it makes only what the change reaches. The bundle appears whole or not at
/// all; one that was there stays until then. --no-cache keeps nothing after success.
///
/// Many machines share a bake by --shard: each does its part of the work into the same folder, or into one of its own, and
/// `heliodon merge` makes the bundle of it.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  heliodon bake mysite\n  heliodon bake mysite --estimate\n  heliodon bake mysite -o /data/bundles/mysite --threads 8\n  heliodon bake mysite --shard 2/7\n  heliodon bake mysite --on slurm --shards 8 --slurm-option=--partition=long --slurm-option=--mem=8G"
)]
pub struct Args {
    #[command(flatten)]
    target: Target,
    /// Tell what the bake would cost, and the preparation before it, from a few timed blocks and patches, and do neither
    #[arg(long)]
    estimate: bool,
    /// Do only part I of N of the work; `heliodon merge` makes the bundle of all parts
    #[arg(long, value_name = "I/N", conflicts_with_all = ["estimate", "on", "no_cache"], help_heading = "Many machines")]
    shard: Option<Shard>,
    /// Refuse to work where the site or the program is not what this plan was made of (job scripts say so)
    #[arg(long, value_name = "KEY", requires = "shard", help_heading = "Many machines")]
    plan: Option<String>,
    /// Submit the work to a cluster, follow it, and submit again what is lost
    #[arg(long, value_enum, requires = "shards", conflicts_with = "estimate", help_heading = "Many machines")]
    on: Option<Cluster>,
    /// Parts that the cluster is given; more than nodes come out more even
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(MOST_SHARDS)), requires = "on", help_heading = "Many machines")]
    shards: Option<u32>,
    /// Tell sbatch this as well, for every job; may be repeated
    #[arg(long, value_name = "OPTION", allow_hyphen_values = true, requires = "on", help_heading = "Many machines")]
    slurm_option: Vec<String>,
    /// How often a shard is submitted that ends without its work
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=100), requires = "on", help_heading = "Many machines")]
    tries: u32,
}

/// What distributes jobs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Cluster {
    /// Slurm, by sbatch, squeue and scancel
    Slurm,
}

/// Which site becomes which bundle, and where finished work is kept.
#[derive(Debug, clap::Args)]
pub struct Target {
    /// The site's folder, or its site.toml
    site: PathBuf,
    /// Where the bundle stands [default: bundle, in the site's folder]
    #[arg(short, long, value_name = "BUNDLE")]
    output: Option<PathBuf>,
    /// Make the bundle even where it is up to date
    #[arg(long)]
    again: bool,
    /// Keep finished work in this folder [default: .heliodon/cache, beside the bundle]
    #[arg(long, value_name = "DIR")]
    cache: Option<PathBuf>,
    /// Take no light from finished bakes, and keep none for those to come; prepared geometry stays
    #[arg(long)]
    no_cache: bool,
}

impl Target {
    /// Reads the site and plans its bake.
    pub fn plan(&self) -> Result<Plan> {
        let site = Site::read(&self.site)?;
        let options = BakeOptions {
            bundle: self.output.clone().unwrap_or_else(|| default_bundle(&site)),
            cache: self.cache.clone(),
            no_cache: self.no_cache,
            again: self.again,
        };
        Ok(Plan::new(site, options)?)
    }
}

/// Where a site's bundle stands when nobody says otherwise.
pub fn default_bundle(site: &Site) -> PathBuf {
    site.folder().join("bundle")
}

/// Runs it.
pub fn run(app: &App, args: &Args) -> Result<()> {
    let plan = args.target.plan()?;
    if args.estimate {
        return app.output.result(&estimate(&plan, &app.progress)?, describe_estimate);
    }
    if let Some(shard) = args.shard {
        let report = bake_shard(&plan, shard, args.plan.as_deref(), &app.progress)?;
        return app.output.result(&report, describe_shard);
    }
    match (args.on, args.shards) {
        (Some(Cluster::Slurm), Some(shards)) if args.target.again || !plan.is_up_to_date() => {
            let options = slurm::Options { shards, tries: args.tries, sbatch: &args.slurm_option };
            app.output.result(&slurm::bake(app, &plan, &options)?, describe_slurm)
        }
        _ => app.output.result(&bake(&plan, &app.progress)?, describe),
    }
}

fn describe_shard(report: &ShardReport) -> String {
    if report.up_to_date {
        return "the bundle is up to date: no shard is needed (bake it again all the same with --again)\n".to_owned();
    }
    let left = match report.missing {
        0 => "nothing is missing any more: heliodon merge makes the bundle".to_owned(),
        missing => format!("{missing} of all {} are not there yet", counted(report.blocks as u64, "block", "blocks")),
    };
    format!(
        "shard {}: {} of its {} done in {}; {left}.\n",
        report.shard,
        report.computed,
        counted(report.own as u64, "block", "blocks"),
        duration(report.seconds)
    )
}

fn describe_slurm(report: &SlurmReport) -> String {
    let again = match report.again.len() {
        0 => String::new(),
        times => format!(", {} submitted again", counted(times as u64, "shard", "shards")),
    };
    let bundle = report.bake["bundle"].as_str().unwrap_or("the bundle");
    format!(
        "{bundle}: baked by {} on Slurm{again}, in {}.\n",
        counted(u64::from(report.shards), "shard", "shards"),
        duration(report.seconds)
    )
}

/// What a bake has made, for people.
pub fn describe(report: &BakeReport) -> String {
    let name = Path::display(&report.bundle);
    if report.up_to_date {
        return format!("{name} is up to date (bake it again all the same with --again)");
    }
    let counts = &report.counts;
    let seconds: f64 = report.seconds.iter().map(|(_, seconds)| seconds).sum();
    let mut text = format!(
        "{name}: {} triangles, {} vertices ({} inside something), {}, {} in {}",
        count(counts.triangles),
        count(counts.vertices),
        count(counts.invalid_vertices),
        counted(u64::from(report.sun_steps), "sun step", "sun steps"),
        counted(report.sky_steps as u64, "sky", "skies"),
        duration(seconds)
    );
    if let Some(peak) = report.peak_memory_bytes {
        text += &format!(", {} of memory at the peak", bytes(peak));
    }
    text += ".\n";
    let taken: Vec<String> = report.taken.iter().filter_map(told_of).collect();
    if !taken.is_empty() {
        text += &format!("taken from the cache: {}.\n", taken.join(", "));
    }
    if report.kept_bytes > 0 {
        text += &format!("{} of finished work kept for the next bake.\n", bytes(report.kept_bytes));
    }
    text
}

/// How much of a stage was taken from the cache, if anything.
fn told_of(taken: &Taken) -> Option<String> {
    let Taken { stage, blocks, of, rays, of_rays } = taken;
    let percent = (100 * rays).checked_div(*of_rays).unwrap_or(0);
    let rays = || format!("{percent} % of the rays of {stage}");
    match (*blocks, percent) {
        (0, 0) => None,
        (0, _) => Some(rays()),
        (blocks, _) if blocks == *of => Some(format!("all of {stage}")),
        (blocks, 0) => Some(format!("{blocks} of {of} of {stage}")),
        (blocks, _) => Some(format!("{blocks} of {of} of {stage} and {} that is left", rays())),
    }
}

fn describe_estimate(estimate: &Estimate) -> String {
    let prepare = estimate.prepare.as_ref().map_or_else(String::new, |prepare| {
        format!("preparation:\n{}\nthen the light, of what is left:\n", describe_preparation(prepare))
    });
    let refused = estimate.refused.as_ref().map_or_else(String::new, |why| format!("the bake would be refused: {why}\n"));
    format!(
        "{refused}{prepare}{} triangles, {} vertices, {} points to solve{}\n\
         {} rays to the sky and between surfaces, {} to the suns\n\
         about {} for the light on this machine\n\
         {} of memory, {} of room for finished work, {} for the bundle without sky maps and textures\n\
         up to {} in the viewer, beyond what its empty window takes\n",
        count(estimate.triangles),
        count(estimate.vertices),
        count(estimate.points),
        match estimate.grid_points {
            0 => String::new(),
            points => format!(", and {} of the light grid, six each", count(points)),
        },
        count(estimate.gather_rays),
        count(estimate.mask_rays),
        duration(estimate.seconds),
        bytes(estimate.memory_bytes),
        bytes(estimate.cache_bytes),
        bytes(estimate.bundle_bytes),
        bytes(estimate.viewer_bytes)
    )
}
