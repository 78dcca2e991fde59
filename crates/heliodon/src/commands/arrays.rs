//! `heliodon arrays`: what was baked, for NumPy.

use crate::App;
use crate::output::count;
use anyhow::Result;
use heliodon_bundle::BundleReader;
use heliodon_bundle::arrays::{ArraysReport, write_arrays};
use std::path::PathBuf;

/// Writes what was baked as NumPy arrays, vertices over all parts in the bundle's order.
///
/// positions, normals, albedo (N,3) f32; triangles (M,3) u32; part (N) u16; valid (N) u8; sun_mask (N,W) u32;
/// sky_transfer (N,C) or (N,C,3) f32; and lapse.json.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  heliodon arrays mysite/bundle numbers --sun-bounce\n  python3 -c \"import numpy; print(numpy.load('numbers/sky_transfer.npy').shape)\""
)]
pub struct Args {
    /// The bundle's folder
    bundle: PathBuf,
    /// The folder to write into; made if need be
    dir: PathBuf,
    /// Also write sun_bounce (T,N,3): the sun's bounced light at every sun step
    #[arg(long)]
    sun_bounce: bool,
}

/// Runs it.
pub fn run(app: &App, args: &Args) -> Result<()> {
    let report = write_arrays(&BundleReader::open(&args.bundle)?, &args.dir, args.sun_bounce)?;
    app.output.result(&report, |report: &ArraysReport| {
        format!(
            "{} vertices, {} triangles: {} files in {}",
            count(report.vertices),
            count(report.triangles),
            report.files.len(),
            args.dir.display()
        )
    })
}
