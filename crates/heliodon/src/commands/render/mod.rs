//! `heliodon render`: stills, contact sheets and films.

mod room;

use crate::App;
use crate::acting;
use crate::failure::wrong_arguments;
use crate::files;
use crate::film::{self, Film};
use crate::output::{count, duration};
use crate::studio::{Look, Studio, spread};
use crate::values::{self, Exposure, Size, TimeSpan};
use anyhow::Result;
use clap::ValueEnum;
use glam::Vec3;
use heliodon_bake::report::Reporter;
use heliodon_image::{SheetLayout, SrgbImage, contact_sheet};
use heliodon_view::headless::RenderOptions;
use heliodon_view::{Blend, ToneCurve};
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Writes stills (PNG, or EXR with linear radiance), contact sheets of the day (PNG), and films (MP4), without a display.
///
/// With --reference the same pictures, but for actors and lamps, are traced by a path tracer over the bundle's geometry, albedo and skies: what the
/// real-time pictures must look like.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  heliodon render mysite/bundle --time 10:00 -o ten.png\n  heliodon render mysite/bundle --sheet 4x3 --size 512x384 -o day.png\n  heliodon render mysite/bundle --time 06:57..17:34 --seconds 30 -o day.mp4\n  heliodon render mysite/bundle --time 10:00 --reference 256 -o truth.png\n  heliodon render mysite/bundle --time 10:00 --reference 64 --shape prepared/bundle -o shape.png\n  heliodon render mysite/bundle --display flatworld --track walk.poses --preview --time 08:00..16:00 --seconds 20 -o room.mp4"
)]
pub struct Args {
    /// The bundle's folder
    bundle: PathBuf,
    /// A time, or a span of the day [default for films and sheets: the whole day]
    #[arg(long, value_name = "HH:MM[..HH:MM]", value_parser = values::time_span)]
    time: Option<TimeSpan>,
    /// Size of each picture
    #[arg(long, value_name = "WxH", default_value = "1024x768", value_parser = values::size)]
    size: Size,
    /// Trace the pictures with SPP paths a pixel
    #[arg(long, value_name = "SPP", value_parser = clap::value_parser!(u32).range(1..=1_048_576))]
    reference: Option<u32>,
    /// Show the geometry of this prepared bundle with the light, normals and colours of BUNDLE: what preparing changes by its shapes alone
    #[arg(long, value_name = "PREPARED", requires = "reference")]
    shape: Option<PathBuf>,
    /// Write as well, in grey, how much of each pixel shows geometry: a PNG, for a traced still
    #[arg(long, value_name = "FILE", requires = "reference")]
    coverage: Option<PathBuf>,
    /// Columns and rows of a contact sheet
    #[arg(long, value_name = "COLSxROWS", value_parser = values::sheet)]
    sheet: Option<(u32, u32)>,
    /// What to write: .png, .exr or .mp4
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Exposure: auto (the hour's), or stops
    #[arg(long, value_name = "auto|STOPS", default_value = "auto", value_parser = values::exposure, allow_negative_numbers = true)]
    exposure: Exposure,
    /// Tone curve
    #[arg(long, value_enum, default_value_t = Tone::Clamp)]
    tone: Tone,
    /// Where the eye is, metres [default: the first room's middle]
    #[arg(long, value_name = "X,Y,Z", value_parser = values::point, allow_hyphen_values = true)]
    eye: Option<Vec3>,
    /// What it looks at [default: what the room looks at]
    #[arg(long, value_name = "X,Y,Z", value_parser = values::point, allow_hyphen_values = true)]
    look: Option<Vec3>,
    /// Vertical opening angle, degrees [default: the site's]
    #[arg(long, value_name = "DEG", value_parser = values::fov_deg)]
    fov: Option<f32>,
    /// Frames a second of a film
    #[arg(long, value_name = "N", default_value = "30", value_parser = values::fps)]
    fps: f64,
    /// Length of a film
    #[arg(long, value_name = "S", default_value = "30", value_parser = values::seconds)]
    seconds: f64,
    /// Samples along each side of a pixel, 1 to 4 [default: 4 for stills, 2 for films]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=4))]
    samples: Option<u32>,
    /// How long actors have acted, seconds; in a film, at its beginning
    #[arg(long, value_name = "S", default_value = "0", value_parser = values::elapsed)]
    actors_time: f64,
    #[command(flatten)]
    acting: acting::Args,
    /// Let each step hold until the next instead of blending between them
    #[arg(long)]
    hard_steps: bool,
    /// Leave out the details of parts, the grain that is seen from near
    #[arg(long)]
    no_details: bool,
    /// Show in blue what no photograph saw, of parts with evidence
    #[arg(long, conflicts_with = "reference")]
    guessed: bool,
    /// Pictures of a room's screens instead: display.toml, or desktop, monitor, flatworld, cave, ring; -o pictures.png writes
    /// pictures-SCREEN.png for each
    #[arg(long, value_name = "FILE|PRESET", conflicts_with_all = ["reference", "sheet", "eye", "look", "fov"])]
    display: Option<PathBuf>,
    /// A recording of the visitor's head, in place of the display's trackers
    #[arg(long, value_name = "FILE", requires = "display")]
    track: Option<PathBuf>,
    /// What each output shows, both eyes packed, blended and corrected, in place of each eye's picture
    #[arg(long, requires = "display")]
    outputs: bool,
    /// The room seen from outside as well, with the visitor in it
    #[arg(long, requires = "display")]
    preview: bool,
}

/// A tone curve by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Tone {
    /// As the paper: what is brighter than white is white
    Clamp,
    /// Hable's filmic curve: shoulders for what is bright
    Filmic,
}

/// What is made.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Work {
    Still { time: TimeSpan },
    Linear { time: TimeSpan },
    Sheet { columns: u32, rows: u32 },
    Film { frames: usize },
}

/// What was made.
#[derive(Serialize)]
struct Rendered {
    file: PathBuf,
    pictures: usize,
    width: u32,
    height: u32,
    seconds: f64,
}

/// Runs it.
pub fn run(app: &App, args: &Args) -> Result<()> {
    let work = plan(args)?;
    if let Some(display) = &args.display {
        return room::run(app, args, work, display);
    }
    if args.coverage.is_some() && !matches!(work, Work::Still { .. }) {
        wrong_arguments!("--coverage goes with a still: -o picture.png, without --sheet");
    }
    let look = Look {
        eye: args.eye,
        target: args.look,
        fov_deg: args.fov,
        exposure: args.exposure,
        curve: if args.tone == Tone::Filmic { ToneCurve::Filmic } else { ToneCurve::Clamp },
        blend: if args.hard_steps { Blend::Hard } else { Blend::Smooth },
        samples: args.samples.unwrap_or_else(|| usual_samples(work)),
        actors_s: args.actors_time,
        acting: args.acting,
        without_details: args.no_details,
        shows_guessed: args.guessed,
        ..Look::new(args.size.width, args.size.height)
    };
    files::check_place(&args.output)?;
    args.coverage.as_deref().map_or(Ok(()), files::check_place)?;
    let begun = Instant::now();
    app.progress.stage("loading", 0);
    let studio = Studio::open(&args.bundle, look, args.reference).and_then(|mut studio| {
        args.shape.as_deref().map_or(Ok(()), |shape| studio.show_shape_of(shape))?;
        Ok(studio)
    });
    app.progress.finished();
    let mut studio = studio?;
    if let Some(left_out) = studio.left_out() {
        app.progress.warning(&left_out);
    }
    let pictures = match work {
        Work::Still { time } => {
            let times = times(&studio, Some(time), 1)?;
            if let Some(coverage_file) = &args.coverage {
                let (picture, coverage) = studio.traced_with_coverage(times[0])?;
                write_png(coverage_file, &coverage)?;
                write_png(&args.output, &picture)?;
            } else {
                studio.pictures(&times, 0.0, |_, picture| write_png(&args.output, &picture))?;
            }
            1
        }
        Work::Linear { time } => {
            let times = times(&studio, Some(time), 1)?;
            let picture = studio.linear(times[0])?;
            files::replace(&args.output, |beside| Ok(picture.write_exr(beside)?))?;
            1
        }
        Work::Sheet { columns, rows } => {
            let times = times(&studio, args.time, (columns * rows) as usize)?;
            write_sheet(app, &mut studio, &times, columns, &args.output)?;
            times.len()
        }
        Work::Film { frames } => {
            let times = times(&studio, args.time, frames)?;
            write_film(app, &mut studio, &times, args.size, args.fps, &args.output)?;
            frames
        }
    };
    studio.take_problems().iter().for_each(|problem| app.progress.warning(problem));
    let rendered = Rendered {
        file: args.output.clone(),
        pictures,
        width: args.size.width,
        height: args.size.height,
        seconds: begun.elapsed().as_secs_f64(),
    };
    app.output.result(&rendered, |rendered| {
        let pictures = if rendered.pictures == 1 {
            "1 picture".to_owned()
        } else {
            format!("{} pictures", count(rendered.pictures as u64))
        };
        format!(
            "{}: {pictures} of {}x{} in {}",
            rendered.file.display(),
            rendered.width,
            rendered.height,
            duration(rendered.seconds)
        )
    })
}

/// What the arguments mean together.
fn plan(args: &Args) -> Result<Work> {
    let ending = args.output.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    let span = args.time.is_some_and(|time| time.last.is_some());
    match (ending.as_str(), args.sheet, args.time) {
        ("mp4", None, _) => {
            if args.time.is_some() && !span {
                wrong_arguments!("a film needs a span of the day: --time 06:57..17:34, or no --time for all of it");
            }
            if let Err(error) = film::check_size(args.size.width, args.size.height) {
                wrong_arguments!("{error}");
            }
            Ok(Work::Film { frames: ((args.fps * args.seconds).round() as usize).max(1) })
        }
        ("mp4" | "exr", Some(_), _) => wrong_arguments!("a contact sheet is a .png"),
        ("png", Some((columns, rows)), _) => Ok(Work::Sheet { columns, rows }),
        ("png" | "exr", None, None) => wrong_arguments!("a still needs a time: --time 10:00"),
        ("png" | "exr", None, Some(_)) if span => {
            wrong_arguments!("a span of the day is a film (-o day.mp4) or a contact sheet (--sheet 4x3)")
        }
        ("png", None, Some(time)) => Ok(Work::Still { time }),
        ("exr", None, Some(time)) => Ok(Work::Linear { time }),
        _ => wrong_arguments!("{} must end in .png, .exr or .mp4", args.output.display()),
    }
}

fn usual_samples(work: Work) -> u32 {
    match work {
        Work::Film { .. } => RenderOptions::film().samples,
        Work::Still { .. } | Work::Linear { .. } | Work::Sheet { .. } => RenderOptions::still().samples,
    }
}

/// The times of `count` pictures, in seconds after midnight.
fn times(studio: &Studio, span: Option<TimeSpan>, count: usize) -> Result<Vec<f64>> {
    let (first, last) = match span {
        None => studio.day(),
        Some(TimeSpan { first, last }) => {
            studio.check_time(first)?;
            last.map_or(Ok(()), |last| studio.check_time(last))?;
            (f64::from(first.seconds()), f64::from(last.unwrap_or(first).seconds()))
        }
    };
    Ok(spread(first, last, count))
}

/// Writes a picture; the file appears whole or not at all.
pub fn write_png(path: &Path, picture: &SrgbImage) -> Result<()> {
    files::replace(path, |beside| Ok(picture.write_png(beside)?))
}

/// Writes a contact sheet.
pub fn write_sheet(app: &App, studio: &mut Studio, times: &[f64], columns: u32, path: &Path) -> Result<()> {
    app.progress.stage("pictures", times.len() as u64);
    let mut pictures = Vec::with_capacity(times.len());
    studio.pictures(times, 0.0, |index, picture| {
        pictures.push(picture);
        app.progress.progress(index as u64 + 1);
        Ok(())
    })?;
    app.progress.finished();
    write_png(path, &contact_sheet(&pictures, &SheetLayout { columns, ..SheetLayout::default() }))
}

/// Writes a film.
pub fn write_film(app: &App, studio: &mut Studio, times: &[f64], size: Size, fps: f64, path: &Path) -> Result<()> {
    app.progress.stage("film", times.len() as u64);
    let mut film = Film::new(size.width, size.height, fps)?;
    studio.pictures(times, 1.0 / fps, |index, picture| {
        film.push(&picture)?;
        app.progress.progress(index as u64 + 1);
        Ok(())
    })?;
    app.progress.finished();
    film.finish(path)
}
