//! `heliodon convert`: models and images in the forms that load fastest.

mod model;
mod picture;
mod plan;
mod report;

use crate::App;
use crate::values;
use anyhow::Result;
use clap::ValueEnum;
use heliodon_bake::report::Reporter;
use heliodon_image::Bc7Quality;
use plan::{Kind, Plan};
use report::{FileReport, Report};
use std::path::PathBuf;

/// Brings models and images into the forms that load fastest.
///
/// Models (PLY, OBJ, glTF, STL) become NAME.glb: vertices welded, ordered and stored in whole numbers where an error bound is kept; nodes, names, materials, skins and
/// animations stay. Images become NAME.ktx2 with all their smaller versions: PNG, JPEG, TIFF and TGA as BC7, Radiance and OpenEXR as BC6H. What is written is read back, and it
/// is told how far it is off, how large it is and how long either takes to load.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  heliodon convert statue.ply walker.glb wall.png -o fast\n  heliodon convert statue.ply --meshopt --tolerance 0.1\n  heliodon convert bumps.png --normal-map -o fast\n  heliodon convert sky.exr --dry-run --json"
)]
pub struct Args {
    /// Models and images
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Where to write; made if it is not there [default: beside each file]
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Pack models by EXT_meshopt_compression: smaller files, which take longer to load from a fast disk
    #[arg(long)]
    meshopt: bool,
    /// How far a vertex may move, millimetres where the model's unit is the metre; meshes for which 16 bits are too coarse keep floats
    #[arg(long, value_name = "MM", default_value = "1", value_parser = |text: &str| values::within(text, 0.0, 1e6))]
    tolerance: f64,
    /// Bits of a component of normals, 8 (0.4 degrees) or 16
    #[arg(long, value_name = "BITS", default_value = "8", value_parser = ["8", "16"])]
    normal_bits: String,
    /// Images hold numbers, such as masks or heights, and no colours
    #[arg(long, conflicts_with = "normal_map")]
    linear: bool,
    /// Images hold normals
    #[arg(long)]
    normal_map: bool,
    /// How long is searched for good blocks of images
    #[arg(long, value_enum, default_value = "usual")]
    quality: Quality,
    /// Leave smaller versions of images out
    #[arg(long)]
    no_mips: bool,
    /// How often each file is read to tell how long it takes; less where that takes more than ten seconds
    #[arg(long, value_name = "N", default_value = "5", value_parser = clap::value_parser!(u32).range(1..=1000))]
    reads: u32,
    /// Tell what would come of it, and write nothing
    #[arg(long)]
    dry_run: bool,
}

/// How long is searched for good blocks.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum Quality {
    /// To try things out
    Draft,
    /// Nearly the best
    Usual,
    /// For what is made once and kept
    Best,
}

impl From<Quality> for Bc7Quality {
    fn from(quality: Quality) -> Self {
        match quality {
            Quality::Draft => Self::Draft,
            Quality::Usual => Self::Usual,
            Quality::Best => Self::Best,
        }
    }
}

/// Runs it.
pub fn run(app: &App, args: &Args) -> Result<()> {
    let plans = plan::plans(args)?;
    let mut report = Report { dry_run: args.dry_run, files: Vec::new() };
    let mut failed: Option<anyhow::Error> = None;
    for plan in &plans {
        app.progress.stage(&format!("converting {}", plan.file.display()), 0);
        let converted = convert(args, plan);
        app.progress.finished();
        match converted {
            Ok(file) => {
                file.warnings.iter().for_each(|warning| app.progress.warning(warning));
                report.files.push(file);
            }
            // the others are converted all the same; the last one that failed ends the program
            Err(error) => {
                if let Some(before) = failed.replace(error) {
                    app.progress.note(&format!("error: {before:#}"));
                }
            }
        }
    }
    if !report.files.is_empty() {
        app.output.result(&report, report::describe)?;
    }
    failed.map_or(Ok(()), Err)
}

fn convert(args: &Args, plan: &Plan) -> Result<FileReport> {
    match plan.kind {
        Kind::Model => model::convert(args, plan),
        Kind::Picture => picture::convert(args, plan),
    }
}
