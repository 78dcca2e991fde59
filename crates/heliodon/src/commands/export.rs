//! `heliodon export`: the monument lit as at one hour, for programs that know nothing of Heliodon.

use crate::App;
use crate::failure::wrong_arguments;
use crate::output::{bytes, count};
use crate::values::{self, Exposure};
use anyhow::Result;
use heliodon_bake::report::Reporter;
use heliodon_bundle::BundleReader;
use heliodon_bundle::export::{ExportOptions, ExportReport, export_lit};
use heliodon_bundle::moment::Blend;
use heliodon_bundle::site::TimeOfDay;
use std::path::PathBuf;

/// Writes the monument lit as at one hour to a GLB file that any viewer shows as it is.
///
/// Light goes into the colours of vertices. Parts that are lit by texels have few of these: they are shown in their light, without what lies between, and
/// without weathering. Details are left out.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  heliodon export mysite/bundle --time 10:00 lit.glb")]
pub struct Args {
    /// The bundle's folder
    bundle: PathBuf,
    /// The time of day, `HH:MM[:SS]`, in the site's own offset from UTC
    #[arg(long, value_name = "HH:MM")]
    time: TimeOfDay,
    /// Exposure: auto, or stops
    #[arg(long, value_name = "auto|STOPS", default_value = "auto", value_parser = values::exposure, allow_negative_numbers = true)]
    exposure: Exposure,
    /// The file to write
    out: PathBuf,
}

/// Runs it.
pub fn run(app: &App, args: &Args) -> Result<()> {
    if args.out.extension().is_none_or(|ending| !ending.eq_ignore_ascii_case("glb")) {
        wrong_arguments!("{} must end in .glb", args.out.display());
    }
    let exposure_stops = match args.exposure {
        Exposure::Auto => None,
        Exposure::Stops(stops) => Some(stops),
    };
    let options = ExportOptions { exposure_stops, blend: Blend::Smooth };
    let bundle = BundleReader::open(&args.bundle)?;
    if bundle.manifest().texels.is_some() {
        app.progress.warning(
            "parts that are lit by texels are written in the light of their few vertices, unweathered: shadows between these are lost; \
             bake with light = \"vertex\" and [prepare] for an export that has them",
        );
    }
    let report = export_lit(&bundle, args.time, &options, &args.out)?;
    app.output.result(&report, |report: &ExportReport| {
        format!(
            "{} at {}, exposure {:+.2} stops: {} triangles, {}",
            args.out.display(),
            report.time,
            report.exposure_stops,
            count(report.triangles),
            bytes(report.bytes)
        )
    })
}
