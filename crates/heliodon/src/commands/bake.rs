//! `heliodon bake`: a site's light.

use crate::App;
use crate::output::{bytes, count, counted, duration};
use anyhow::Result;
use heliodon_bake::bake::{BakeReport, bake};
use heliodon_bake::estimate::{Estimate, estimate};
use heliodon_bake::plan::{BakeOptions, Plan};
use heliodon_bundle::site::Site;
use std::path::{Path, PathBuf};

/// Computes a site's light and writes the bundle that viewers read.
///
/// Finished work is kept in .heliodon/cache beside the bundle until the bundle is written: run the same bake again after an
/// interruption of any kind and it goes on where it stopped. The bundle appears whole or not at all; one that was there stays
/// until then.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  heliodon bake mysite\n  heliodon bake mysite --estimate\n  heliodon bake mysite -o /data/bundles/mysite --threads 8"
)]
pub struct Args {
    /// The site's folder, or its site.toml
    site: PathBuf,
    /// Where the bundle stands [default: bundle, in the site's folder]
    #[arg(short, long, value_name = "BUNDLE")]
    output: Option<PathBuf>,
    /// Tell what the bake would cost, from a few timed blocks, and bake nothing
    #[arg(long)]
    estimate: bool,
    /// Bake even where the bundle is up to date
    #[arg(long)]
    again: bool,
    /// Keep finished work in this folder
    #[arg(long, value_name = "DIR")]
    cache: Option<PathBuf>,
    /// Keep the finished work after success, too
    #[arg(long)]
    keep_cache: bool,
}

/// Where a site's bundle stands when nobody says otherwise.
pub fn default_bundle(site: &Site) -> PathBuf {
    site.folder().join("bundle")
}

/// Runs it.
pub fn run(app: &App, args: &Args) -> Result<()> {
    let site = Site::read(&args.site)?;
    let options = BakeOptions {
        bundle: args.output.clone().unwrap_or_else(|| default_bundle(&site)),
        cache: args.cache.clone(),
        keep_cache: args.keep_cache,
        again: args.again,
    };
    let plan = Plan::new(site, options)?;
    if args.estimate {
        return app.output.result(&estimate(&plan, &app.progress)?, describe_estimate);
    }
    app.output.result(&bake(&plan, &app.progress)?, describe)
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
    text + ".\n"
}

fn describe_estimate(estimate: &Estimate) -> String {
    format!(
        "{} triangles, {} vertices, {} points to solve{}\n\
         {} rays to the sky and between surfaces, {} to the suns\n\
         about {} for the light on this machine\n\
         {} of memory, {} of room for finished work, {} for the bundle without sky maps and textures\n",
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
        bytes(estimate.bundle_bytes)
    )
}
