//! `heliodon prepare`: a site's geometry, cleaned and reduced to what can be seen.

use super::bake::default_bundle;
use crate::App;
use crate::files::write_whole;
use crate::output::{bytes, count, duration, table};
use anyhow::{Context, Result};
use heliodon_bake::plan::{BakeOptions, Plan};
use heliodon_bake::prepare::{PrepareEstimate, PrepareReport, estimate, prepare};
use heliodon_bake::report::Reporter;
use heliodon_bundle::site::Site;
use std::fs;
use std::io::Write;
use std::path::PathBuf;
use std::time::Instant;

/// Cleans a site's geometry, splits what is coarse, simplifies it to what the display shows from the rooms and drops what no eye in
/// them can see, and reports what was found and done; bakes nothing.
///
/// The settings are those of [prepare] in site.toml; a site without it is told what the defaults would do.
///
/// Each step's result is kept in .heliodon/cache beside the site's bundle: run the same again after an interruption of any kind and it goes
/// on where it stopped, and a bake finds the geometry prepared. Coloured meshes (-o) show every step, so for these all is done again.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  heliodon prepare mysite\n  heliodon prepare mysite --estimate\n  heliodon prepare mysite -o found --json"
)]
pub struct Args {
    /// The site's folder, or its site.toml
    site: PathBuf,
    /// Write report.txt, report.json and coloured meshes of what was found and what is drawn into this folder
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Tell what every step would cost in time, memory and room on disk, from a look at the parts and a few timed patches, and prepare nothing
    #[arg(long, conflicts_with = "output")]
    estimate: bool,
    /// Keep finished work in this folder; name the same to the bake
    #[arg(long, value_name = "DIR")]
    cache: Option<PathBuf>,
}

/// Runs it.
pub fn run(app: &App, args: &Args) -> Result<()> {
    let site = Site::read(&args.site)?;
    let settings = site.prepare.clone().unwrap_or_else(|| {
        app.progress
            .note("site.toml has no [prepare]: this is what its defaults would do; a bake takes the geometry as it comes");
        heliodon_bundle::site::Prepare::default()
    });
    if let Some(folder) = &args.output {
        fs::create_dir_all(folder).with_context(|| format!("{}: the folder cannot be made", folder.display()))?;
    }
    let begun = Instant::now();
    let options = BakeOptions { cache: args.cache.clone(), ..BakeOptions::new(default_bundle(&site)) };
    let plan = Plan::new(site, options)?;
    if args.estimate {
        return app.output.result(&estimate(&plan, &settings, &app.progress)?, describe_estimate);
    }
    let report = prepare(&plan, &settings, args.output.as_deref(), &app.progress)?.report;
    let text = describe(&report, begun.elapsed().as_secs_f64());
    if let Some(folder) = &args.output {
        let json = serde_json::to_vec_pretty(&report).context("the report cannot be written as JSON")?;
        for (name, content) in [("report.txt", text.as_bytes()), ("report.json", json.as_slice())] {
            write_whole(&folder.join(name), |file| file.write_all(content))?;
        }
    }
    app.output.result(&report, |_| text)
}

fn describe(report: &PrepareReport, seconds: f64) -> String {
    let mut text = format!("{report}in {}", duration(seconds));
    if let Some(peak) = report.peak_memory_bytes {
        text += &format!(", {} of memory at the peak", bytes(peak));
    }
    text + "\n"
}

/// What preparation would cost, for people.
pub fn describe_estimate(estimate: &PrepareEstimate) -> String {
    let rows: Vec<Vec<String>> = estimate
        .steps
        .iter()
        .map(|step| {
            let times = if step.times == 1 { String::new() } else { format!(", {} times", step.times) };
            let name = format!("{}{times}", step.name);
            vec![name, duration(step.seconds), bytes(step.memory_bytes), bytes(step.cache_bytes)]
        })
        .collect();
    let kept = if estimate.kept { "all of this is done already, and kept: it is read in a moment\n" } else { "" };
    format!(
        "{} triangles in the files, about {} that rays of light will meet\n\
         about {} drawn, {} that only reflect light, {} vertices at which it is solved\n\
         {}{kept}about {} for the preparation on this machine, {} of memory, {} of room for finished work\n",
        count(estimate.triangles_read),
        count(estimate.triangles_original),
        count(estimate.triangles_drawn),
        count(estimate.triangles_hidden),
        count(estimate.vertices),
        table(&["step", "time", "memory", "on disk after it"], &rows),
        duration(estimate.seconds),
        bytes(estimate.memory_bytes),
        bytes(estimate.cache_bytes)
    )
}
