//! `heliodon view`: the viewer's window.

use super::display;
use crate::App;
use crate::acting;
use crate::failure::wrong_arguments;
use crate::swarming::Particles;
use crate::values::{self, Size};
use anyhow::Result;
use heliodon_bake::bake::bake;
use heliodon_bake::plan::{BakeOptions, Plan};
use heliodon_bundle::display::Display;
use heliodon_bundle::manifest::MANIFEST_FILE_NAME;
use heliodon_bundle::site::{Site, TimeOfDay};
use heliodon_view::Blend;
use heliodon_view::actors::ActorsOptions;
use heliodon_view::story::StoryPlaces;
use heliodon_view::visit::VisitOptions;
use heliodon_view::window::{WindowOptions, run_window};
#[cfg(feature = "headset")]
use heliodon_view::xr::{HeadsetOptions, run_headset};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Opens the viewer: walk around the monument while the day passes. H shows the keys.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  heliodon view mysite\n  heliodon view mysite/bundle --time 07:30 --size 1920x1080\n  heliodon view mysite --display flatworld --preview\n  heliodon view mysite --headset"
)]
pub struct Args {
    /// A bundle's folder; or a site, whose bundle is baked first where it is not up to date
    path: PathBuf,
    /// The window's size [default: what the site was prepared for]
    #[arg(long, value_name = "WxH", value_parser = values::size)]
    size: Option<Size>,
    /// Begin at this time, paused
    #[arg(long, value_name = "HH:MM")]
    time: Option<TimeOfDay>,
    /// Seconds in which the whole day passes
    #[arg(long, value_name = "S", default_value = "30", value_parser = values::seconds)]
    day_seconds: f64,
    #[command(flatten)]
    acting: acting::Args,
    /// Let each step hold until the next instead of blending between them
    #[arg(long)]
    hard_steps: bool,
    /// Samples a pixel: 1, 2, 4 or 8; more where a GPU has the time
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = values::samples)]
    samples: u32,
    /// Who simulates sources of very many particles
    #[arg(long, value_enum, value_name = "BY", default_value_t)]
    particles: Particles,
    /// Screens, trackers and keys: display.toml, or desktop, monitor, flatworld, cave, ring [default: display.toml beside the site, or the user's own]
    #[arg(long, value_name = "FILE|PRESET")]
    display: Option<PathBuf>,
    /// The language of the story's texts: en, el, de [default: the story's own]
    #[arg(long, value_name = "LANGUAGE")]
    language: Option<String>,
    /// Begin the story anew, and keep nothing of this visit
    #[arg(long)]
    forget: bool,
    /// A recording of the visitor's head, in place of the display's trackers
    #[arg(long, value_name = "FILE")]
    track: Option<PathBuf>,
    /// Show the room itself, with its screens and the visitor in it
    #[arg(long)]
    preview: bool,
    /// Visit in a headset, by OpenXR; a window shows what its left eye sees
    #[cfg(feature = "headset")]
    #[arg(long, conflicts_with_all = ["preview", "track", "size"])]
    headset: bool,
    /// Without that window, where there is no display
    #[cfg(feature = "headset")]
    #[arg(long, requires = "headset")]
    no_mirror: bool,
}

/// Runs it.
pub fn run(app: &App, args: &Args) -> Result<()> {
    if app.output.json {
        wrong_arguments!("the viewer has no result to print; leave out --json");
    }
    let mut actors = ActorsOptions::default();
    args.acting.apply(&mut actors);
    let visit = VisitOptions {
        day_seconds: args.day_seconds as f32,
        clock_s: args.time.map(|time| f64::from(time.seconds())),
        blend: if args.hard_steps { Blend::Hard } else { Blend::Smooth },
        samples: args.samples,
        actors,
        display: display_of(args)?,
        story: story_places(&args.path, args.language.clone(), !args.forget),
        particles: args.particles.into(),
    };
    let options = WindowOptions { size: args.size.map(|size| (size.width, size.height)), visit, preview: args.preview };
    if args.preview && options.visit.display.as_ref().is_none_or(|display| display.screens.is_empty()) {
        wrong_arguments!(
            "--preview shows a room, and a desktop has none: --display flatworld, or a display.toml with [[screen]]"
        );
    }
    let bundle = bundle_of(app, &args.path)?;
    #[cfg(feature = "headset")]
    if args.headset {
        let options = HeadsetOptions { visit: options.visit, mirror: !args.no_mirror, ..HeadsetOptions::default() };
        run_headset(bundle, &options)?;
        return Ok(());
    }
    Ok(run_window(bundle, &options)?)
}

/// What the viewer shows itself on.
fn display_of(args: &Args) -> Result<Option<Arc<Display>>> {
    let display = display::of_viewer(args.display.as_deref(), &display::folder_of(&args.path))?;
    match (&args.track, display) {
        (None, display) => Ok(display),
        (Some(track), Some(display)) if !display.screens.is_empty() => {
            Ok(Some(Arc::new(Arc::unwrap_or_clone(display).with_recording(track, true))))
        }
        (Some(_), _) => {
            wrong_arguments!("--track moves a head before screens: --display flatworld, or a display.toml with [[screen]]")
        }
    }
}

/// Where scripts are read from and what they remember is kept: in the site's folder, or beside the bundle. Nothing is, unless it `remembers`.
pub fn story_places(path: &Path, language: Option<String>, remembers: bool) -> StoryPlaces {
    let is_bundle = path.join(MANIFEST_FILE_NAME).exists();
    let folder = if path.is_file() { path.parent().unwrap_or(Path::new(".")) } else { path };
    // of `.` and of `site.v2` alike the folder's own whole name counts
    let beside = || {
        let whole = folder.canonicalize().ok()?;
        Some(whole.with_file_name(format!("{}.memory.json", whole.file_name()?.to_string_lossy())))
    };
    let memory = if is_bundle { beside() } else { Some(folder.join("memory.json")) };
    StoryPlaces { site: (!is_bundle).then(|| folder.to_owned()), memory: memory.filter(|_| remembers), language }
}

/// The bundle to show: the one named, or the site's, made up to date.
pub fn bundle_of(app: &App, path: &Path) -> Result<PathBuf> {
    if path.join(MANIFEST_FILE_NAME).exists() {
        return Ok(path.to_owned());
    }
    let site = Site::read(path)?;
    let options = BakeOptions::new(super::bake::default_bundle(&site));
    let plan = Plan::new(site, options)?;
    Ok(bake(&plan, &app.progress)?.bundle)
}
