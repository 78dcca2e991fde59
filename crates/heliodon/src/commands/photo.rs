//! `heliodon photo`: cameras, models, textures and albedo from photographs.

mod albedo;
mod made;
mod turns;

use crate::App;
use crate::failure::wrong_arguments;
use crate::files::write_whole;
use anyhow::Result;
use heliodon_bake::report::Reporter;
use heliodon_photo::formats::cameras_file::{CAMERAS_FILE_NAME, CamerasFile};
use heliodon_photo::matching::{self, LeftOut, Matched, Request};
use heliodon_photo::project::Project;
use heliodon_photo::report;
use heliodon_photo::solve::{self, PhotoResult};
use serde::Serialize;
use std::ffi::OsString;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Works on a project of photographs: a folder with photos.toml.
#[derive(Debug, clap::Args)]
#[command(
    args_conflicts_with_subcommands = true,
    after_help = "Examples:\n  heliodon photo castle\n  heliodon photo solve castle\n  heliodon photo solve castle/photos.toml --json\n  heliodon photo match castle --colmap /opt/colmap/bin/colmap\n  heliodon photo model castle\n  heliodon photo texture castle -o castle/made --side 8192 --views 4\n  heliodon photo albedo castle"
)]
pub struct Args {
    /// Without a verb, the project to open its window for: see `mark`
    #[arg(value_name = "PROJECT")]
    project: Option<PathBuf>,
    /// What to do
    #[command(subcommand)]
    verb: Option<Verb>,
}

#[derive(Debug, clap::Subcommand)]
enum Verb {
    /// Opens a window to mark points in, the photographs side by side; a folder of photographs without a project becomes one
    Mark(MarkArgs),
    /// Solves for cameras and points from marks, parallel edges and what is known of the place; writes cameras.json beside the project
    Solve(SolveArgs),
    /// Matches photographs by COLMAP, where it is installed, and takes its cameras over into the project
    Match(MatchArgs),
    /// Fits the project's shapes to its points and edges, and writes each part as an OBJ
    Model(made::ModelArgs),
    /// The same, textured from the photographs: OBJs with texture coordinates, atlas.png, evidence.png of what was seen, and views.json where --views asks for it
    Texture(made::TextureArgs),
    /// Solves for the stone's own colour by the light of each photograph's hour: OBJs, albedo.png, and evidence.png of what is known
    Albedo(albedo::AlbedoArgs),
}

#[derive(Debug, clap::Args)]
struct MarkArgs {
    /// The project's folder or its photos.toml
    #[arg(value_name = "PROJECT")]
    project: PathBuf,
}

#[derive(Debug, clap::Args)]
struct SolveArgs {
    /// The project's folder or its photos.toml
    #[arg(value_name = "PROJECT")]
    project: PathBuf,
    /// Where to write the cameras [default: cameras.json beside the project]
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
}

#[derive(Debug, clap::Args)]
struct MatchArgs {
    /// The project's folder or its photos.toml
    #[arg(value_name = "PROJECT")]
    project: PathBuf,
    /// The program
    #[arg(long, value_name = "PROGRAM", default_value = "colmap")]
    colmap: OsString,
}

/// Runs it.
pub fn run(app: &App, args: &Args) -> Result<()> {
    match (&args.verb, &args.project) {
        (None, Some(project)) => mark(project),
        (None, None) => wrong_arguments!("name a project: a folder with photos.toml, or with photographs"),
        (Some(verb), _) => run_verb(app, verb),
    }
}

fn run_verb(app: &App, verb: &Verb) -> Result<()> {
    match verb {
        Verb::Mark(args) => mark(&args.project),
        Verb::Solve(args) => run_solve(app, args),
        Verb::Match(args) => run_match(app, args),
        Verb::Model(args) => made::run_model(app, args),
        Verb::Texture(args) => made::run_texture(app, args),
        Verb::Albedo(args) => albedo::run(app, args),
    }
}

#[cfg(feature = "viewer")]
fn mark(project: &Path) -> Result<()> {
    Ok(heliodon_mark::run(project)?)
}

#[cfg(not(feature = "viewer"))]
fn mark(project: &Path) -> Result<()> {
    wrong_arguments!("{}: this program was built without windows; mark points with one that has them", project.display())
}

fn run_solve(app: &App, args: &SolveArgs) -> Result<()> {
    let project = Project::read(&args.project)?;
    let loaded = project.load()?;
    if loaded.problem.photos.is_empty() {
        wrong_arguments!("{} has no photographs: add [[photo]] with file = \"...\"", args.project.display());
    }
    app.progress.stage("solving for cameras", 0);
    let solution = solve::solve(&loaded.problem, &project.params());
    let mut file = CamerasFile::new(&loaded.problem, &solution);
    file.notes.extend(loaded.notes);
    let path = args.output.clone().unwrap_or_else(|| project.folder().join(CAMERAS_FILE_NAME));
    let text = file.text().map_err(anyhow::Error::msg)?;
    write_whole(&path, |file| file.write_all(text.as_bytes()))?;
    app.output.result(&file, |file| format!("{}written: {}\n", report::describe(file), path.display()))
}

/// What `heliodon photo match` has to say.
#[derive(Serialize)]
struct MatchReport {
    photos: usize,
    matched: usize,
    points: usize,
    rms_px: Option<f64>,
    model: String,
    models: usize,
    /// Focal lengths and their standard deviations, in pixels.
    lenses: Vec<MatchedLens>,
    /// The worst of all photographs.
    turn_sigma_deg: Option<f64>,
    missing: Vec<Missing>,
    notes: Vec<String>,
}

#[derive(Serialize)]
struct MatchedLens {
    name: String,
    focal_px: f64,
    focal_sigma_px: f64,
}

#[derive(Serialize)]
struct Missing {
    photo: String,
    why: String,
}

fn run_match(app: &App, args: &MatchArgs) -> Result<()> {
    let mut project = Project::read(&args.project)?;
    let loaded = project.load_for_matching()?;
    let files: Vec<String> = project.file.photo.iter().map(|photo| photo.file.clone()).collect();
    let request = Request { program: &args.colmap, folder: project.folder(), files: &files, problem: &loaded.problem };
    let Matched { cameras, solution, model, models, left_out, notes } =
        matching::run(&request, &mut |stage| app.progress.stage(stage, 0))?;
    project.take_over_matched(&model);
    project.save()?;
    let lenses = (loaded.problem.lenses.iter().zip(&solution.lenses))
        .filter(|(_, found)| found.solved)
        .map(|(lens, found)| MatchedLens {
            name: lens.name.clone(),
            focal_px: found.intrinsics.focal_px[0],
            focal_sigma_px: found.sigmas[0],
        })
        .collect();
    let turns = solution.photos.iter().filter_map(|photo| match photo {
        PhotoResult::Solved(solved) => solved.rotation_sigma_rad,
        PhotoResult::Unsolved(_) => None,
    });
    let report = MatchReport {
        photos: files.len(),
        matched: cameras.cameras.len(),
        points: cameras.points.len(),
        rms_px: cameras.rms_px(),
        model,
        models,
        lenses,
        turn_sigma_deg: turns.map(f64::to_degrees).reduce(f64::max),
        missing: left_out.into_iter().map(|LeftOut { photo, why }| Missing { photo, why }).collect(),
        notes: loaded.notes.into_iter().chain(notes).collect(),
    };
    app.output.result(&report, describe_match)
}

fn describe_match(report: &MatchReport) -> String {
    let rms = report.rms_px.map(|rms| format!(", {rms:.2} px rms")).unwrap_or_default();
    let turn = report.turn_sigma_deg.map(|sigma| format!(", turns +- {sigma:.3} deg at worst")).unwrap_or_default();
    let mut text = format!(
        "{} of {} photographs matched, {} points{rms}{turn}; taken over from {}\n",
        report.matched, report.photos, report.points, report.model
    );
    for lens in &report.lenses {
        text += &format!("  {}: focal length {:.1} +- {:.1} px\n", lens.name, lens.focal_px, lens.focal_sigma_px);
    }
    if report.models > 1 {
        text += &format!("COLMAP made {} separate models; the one with most photographs was taken\n", report.models);
    }
    for Missing { photo, why } in &report.missing {
        text += &format!("  {photo}: not matched: {why}\n");
    }
    for note in &report.notes {
        text += &format!("note: {note}\n");
    }
    text
}
