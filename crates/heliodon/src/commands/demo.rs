//! `heliodon demo`: a day over the temple, from nothing.

use crate::App;
use crate::failure::wrong_arguments;
#[cfg(feature = "viewer")]
use crate::output::duration;
use crate::templates::{self, Template, TemplateParams};
use anyhow::{Context, Result};
use heliodon_bake::bake::{BakeReport, bake};
use heliodon_bake::plan::{BakeOptions, Plan};
use heliodon_bake::report::Reporter;
use heliodon_bundle::site::Site;
use serde::{Deserialize, Serialize};
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Builds a site, bakes its light and opens the viewer; a second run shows at once what the first has baked.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  heliodon demo\n  heliodon demo temple --out /tmp/temple --headless")]
pub struct Args {
    /// Which site
    #[arg(value_enum, default_value_t = Template::Temple)]
    name: Template,
    /// Where site, bundle and pictures go
    #[arg(long, value_name = "DIR", default_value = "heliodon-demo")]
    out: PathBuf,
    /// Write stills from dawn to dusk, a contact sheet and a film instead of opening a window
    #[arg(long)]
    headless: bool,
    /// About how many triangles [default: as many as its pictures need]
    #[arg(long, value_name = "N")]
    triangles: Option<u64>,
    /// Seed of erosion, stains and rocks
    #[arg(long, value_name = "S", default_value_t = 0)]
    seed: u64,
    /// Length of the film
    #[arg(long, value_name = "S", default_value = "12", value_parser = crate::values::seconds)]
    film_seconds: f64,
}

/// From what a demo's site was made, kept beside it, so that the next run need not make it again.
#[derive(Debug, PartialEq, Eq, Serialize, Deserialize)]
struct MadeFrom {
    tool: String,
    template: String,
    triangles: Option<u64>,
    seed: u64,
}

const MADE_FROM_FILE: &str = "made-from.json";

#[derive(Serialize)]
struct DemoReport {
    site: PathBuf,
    bake: BakeReport,
    /// Stills, contact sheet and film, in order.
    pictures: Vec<PathBuf>,
    seconds: f64,
}

/// Runs it.
pub fn run(app: &App, args: &Args) -> Result<()> {
    let begun = Instant::now();
    if cfg!(not(feature = "viewer")) && args.headless {
        wrong_arguments!("this program was built without the viewer, so it makes no pictures; leave out --headless");
    }
    let folder = args.out.join("site");
    make_site(app, args, &folder)?;
    let site = Site::read(&folder)?;
    let plan = Plan::new(site, BakeOptions::new(args.out.join("bundle")))?;
    let baked = bake(&plan, &app.progress)?;
    let pictures = show(app, args, &baked.bundle)?;
    let report = DemoReport { site: folder, bake: baked, pictures, seconds: begun.elapsed().as_secs_f64() };
    app.output.result(&report, |report| {
        let mut text = super::bake::describe(&report.bake);
        for picture in &report.pictures {
            text += &format!("{}\n", picture.display());
        }
        text
    })
}

/// Makes the site, unless the same one is there.
fn make_site(app: &App, args: &Args, folder: &Path) -> Result<()> {
    let made_from = MadeFrom {
        tool: env!("CARGO_PKG_VERSION").to_owned(),
        template: format!("{:?}", args.name),
        triangles: args.triangles,
        seed: args.seed,
    };
    let mark = args.out.join(MADE_FROM_FILE);
    let same =
        fs::read(&mark).ok().and_then(|text| serde_json::from_slice(&text).ok()).is_some_and(|old: MadeFrom| old == made_from);
    if same && Site::read(folder).is_ok() {
        return Ok(());
    }
    // Only what a demo has made before is made anew; whatever else lies there is refused by the template itself.
    if mark.exists() && folder.exists() {
        fs::remove_dir_all(folder).with_context(|| format!("cannot remove the old site in {}", folder.display()))?;
    }
    app.progress.stage("building", 0);
    fs::create_dir_all(&args.out).with_context(|| format!("cannot make the folder {}", args.out.display()))?;
    let made = templates::make(folder, &TemplateParams { template: args.name, triangles: args.triangles, seed: args.seed });
    app.progress.finished();
    made?;
    let text = serde_json::to_vec_pretty(&made_from).context("the demo's mark")?;
    fs::write(&mark, text).with_context(|| format!("cannot write {}", mark.display()))
}

#[cfg(not(feature = "viewer"))]
fn show(_app: &App, _args: &Args, _bundle: &Path) -> Result<Vec<PathBuf>> {
    Ok(Vec::new())
}

#[cfg(feature = "viewer")]
fn show(app: &App, args: &Args, bundle: &Path) -> Result<Vec<PathBuf>> {
    if args.headless {
        return pictures(app, args, bundle);
    }
    heliodon_view::window::run_window(bundle, &heliodon_view::window::WindowOptions::default())?;
    Ok(Vec::new())
}

#[cfg(feature = "viewer")]
fn pictures(app: &App, args: &Args, bundle: &Path) -> Result<Vec<PathBuf>> {
    use super::render::{write_film, write_png, write_sheet};
    use crate::studio::{Look, Studio, spread};
    use crate::values::Size;
    use heliodon_view::headless::RenderOptions;

    /// Stills from dawn to dusk.
    const STILLS: usize = 7;
    /// Columns and rows of the contact sheet, and the size of its pictures.
    const SHEET: (u32, u32) = (4, 3);
    const SHEET_PICTURE: Size = Size { width: 512, height: 384 };
    const SIZE: Size = Size { width: 1024, height: 768 };
    const FPS: f64 = 24.0;

    let begun = Instant::now();
    let mut files = Vec::new();
    {
        let look = Look { samples: RenderOptions::still().samples, ..Look::new(SIZE.width, SIZE.height) };
        let mut studio = Studio::open(bundle, look, None)?;
        let (first, last) = studio.day();
        let times = spread(first, last, STILLS);
        app.progress.stage("stills", times.len() as u64);
        studio.pictures(&times, |index, picture| {
            let path = args.out.join(format!("still-{}.png", clock_name(times[index])));
            write_png(&path, &picture)?;
            files.push(path);
            app.progress.progress(index as u64 + 1);
            Ok(())
        })?;
        app.progress.finished();
    }
    {
        let look = Look { samples: RenderOptions::still().samples, ..Look::new(SHEET_PICTURE.width, SHEET_PICTURE.height) };
        let mut studio = Studio::open(bundle, look, None)?;
        let (first, last) = studio.day();
        let path = args.out.join("day.png");
        write_sheet(app, &mut studio, &spread(first, last, (SHEET.0 * SHEET.1) as usize), SHEET.0, &path)?;
        files.push(path);
    }
    {
        let mut studio = Studio::open(bundle, Look::new(SIZE.width, SIZE.height), None)?;
        let (first, last) = studio.day();
        let path = args.out.join("day.mp4");
        let frames = ((FPS * args.film_seconds).round() as usize).max(2);
        write_film(app, &mut studio, &spread(first, last, frames), SIZE, FPS, &path)?;
        files.push(path);
    }
    app.progress.note(&format!("pictures: {}", duration(begun.elapsed().as_secs_f64())));
    Ok(files)
}

/// A time of day for file names.
#[cfg(feature = "viewer")]
fn clock_name(seconds: f64) -> String {
    let minutes = (seconds / 60.0).round() as u32;
    format!("{:02}{:02}", minutes / 60, minutes % 60)
}
