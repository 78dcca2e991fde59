//! `heliodon demo`: a day over the temple, from nothing.

use crate::App;
use crate::failure::wrong_arguments;
use crate::files;
#[cfg(feature = "viewer")]
use crate::output::duration;
use crate::templates::{self, Template, TemplateParams};
use anyhow::{Context, Result, bail, ensure};
use heliodon_bake::TOOL;
use heliodon_bake::bake::{BakeReport, bake};
use heliodon_bake::plan::{BakeOptions, Plan};
use heliodon_bake::report::Reporter;
use heliodon_bundle::StoredFile;
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
    /// Length of the film [default: 12, of the workshop, whose pictures take longer, 4]
    #[arg(long, value_name = "S", value_parser = crate::values::seconds)]
    film_seconds: Option<f64>,
}

/// From what a demo's site was made, kept in it, so that the next run need not make it again.
#[derive(Debug, PartialEq, Eq, Serialize, Deserialize)]
struct MadeFrom {
    tool: String,
    template: String,
    triangles: Option<u64>,
    seed: u64,
}

/// The mark of a demo: only what it lists, as it lists it, may a later run remove.
#[derive(Debug, Serialize, Deserialize)]
struct Mark {
    made_from: MadeFrom,
    files: Vec<StoredFile>,
}

const MARK_FILE: &str = "made-from.json";

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
    let made_from =
        MadeFrom { tool: TOOL.to_owned(), template: format!("{:?}", args.name), triangles: args.triangles, seed: args.seed };
    let mark: Option<Mark> = fs::read(folder.join(MARK_FILE)).ok().and_then(|text| serde_json::from_slice(&text).ok());
    if mark.as_ref().is_some_and(|mark| mark.made_from == made_from) && Site::read(folder).is_ok() {
        return Ok(());
    }
    if let Some(mark) = mark {
        remove_site(folder, &mark)?;
    }
    app.progress.stage("building", 0);
    let params = TemplateParams { template: args.name, triangles: args.triangles, seed: args.seed };
    let made = templates::make(folder, &params, |begun, site| {
        let hashes = site.files.iter().map(|name| StoredFile::hash(&begun.join(name), name));
        let mark = Mark { made_from, files: hashes.collect::<Result<_, _>>().context("the demo's files")? };
        let text = serde_json::to_vec_pretty(&mark).context("the demo's mark")?;
        let path = begun.join(MARK_FILE);
        fs::write(&path, text).with_context(|| format!("cannot write {}", path.display()))
    });
    app.progress.finished();
    made.map(drop)
}

/// Removes the site that another demo has made, if nobody has put anything into it since.
fn remove_site(folder: &Path, mark: &Mark) -> Result<()> {
    let remedy = "move that folder away, or name another --out";
    let ours = |name: &str| name == MARK_FILE || mark.files.iter().any(|file| file.path == name);
    if let Some(name) = files::find_foreign(folder, ours)? {
        bail!(
            "{} in {} was not made by a demo, which would make another site there; {remedy}",
            name.display(),
            folder.display()
        );
    }
    for file in &mark.files {
        let path = folder.join(&file.path);
        if path.exists() {
            let now = StoredFile::hash(&path, &file.path).with_context(|| format!("cannot read {}", path.display()))?;
            ensure!(
                now == *file,
                "{} was changed since a demo made it, and this demo would make another site there; {remedy}",
                path.display()
            );
        }
    }
    fs::remove_dir_all(folder).with_context(|| format!("cannot remove the old site in {}", folder.display()))
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
        studio.pictures(&times, 0.0, |index, picture| {
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
        let seconds = args.film_seconds.unwrap_or(if args.name == Template::Workshop { 4.0 } else { 12.0 });
        let frames = ((FPS * seconds).round() as usize).max(2);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::Output;
    use crate::progress::Progress;

    fn args(out: &Path, triangles: u64) -> Args {
        Args {
            name: Template::Grey,
            out: out.to_owned(),
            headless: true,
            triangles: Some(triangles),
            seed: 0,
            film_seconds: Some(1.0),
        }
    }

    #[test]
    fn a_demo_replaces_what_demos_have_made_and_nothing_else() {
        let home = tempfile::tempdir().unwrap();
        let folder = home.path().join("site");
        let app = App { output: Output { json: false }, progress: Progress::new(true) };
        let make = |triangles| make_site(&app, &args(home.path(), triangles), &folder);
        let plate = || fs::read(folder.join("plate.obj")).unwrap();

        // a killed run leaves no more than this
        fs::create_dir_all(home.path().join(".heliodon-new-site/junk")).unwrap();
        make(1000).unwrap();
        let first = plate();
        make(1000).unwrap();
        assert_eq!(plate(), first);
        make(2000).unwrap();
        let second = plate();
        assert!(second != first && fs::read_dir(home.path()).unwrap().count() == 1);

        fs::write(folder.join("notes.txt"), "mine").unwrap();
        assert!(make(1000).unwrap_err().to_string().contains("notes.txt"));
        assert_eq!((plate(), fs::read(folder.join("notes.txt")).unwrap()), (second.clone(), b"mine".to_vec()));
        fs::remove_file(folder.join("notes.txt")).unwrap();

        let edited = fs::read_to_string(folder.join("site.toml")).unwrap().replace("samples = 256", "samples = 64");
        fs::write(folder.join("site.toml"), &edited).unwrap();
        make(2000).unwrap();
        assert!(make(1000).unwrap_err().to_string().contains("site.toml"));
        assert_eq!(fs::read_to_string(folder.join("site.toml")).unwrap(), edited, "what its user has changed stays");

        fs::remove_file(folder.join(MARK_FILE)).unwrap();
        assert!(make(1000).unwrap_err().to_string().contains("not empty"));
        assert_eq!(plate(), second);
    }
}
