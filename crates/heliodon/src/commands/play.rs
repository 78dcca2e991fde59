//! `heliodon play`: a visit that is played by a script of inputs.

use super::display;
use super::render::write_png;
use super::view::{bundle_of, story_places};
use crate::App;
use crate::film::{self, Film};
use crate::values::{self, Size};
use anyhow::{Context, Result, bail};
use clap::ValueEnum;
use heliodon_bake::report::Reporter;
use heliodon_image::SrgbImage;
use heliodon_view::play::devices::Scheme;
use heliodon_view::play::script::Doing;
use heliodon_view::play::{PlayError, PlayOptions, Played, Player, script};
use serde::Serialize;
use std::num::NonZeroU32;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Plays a visit by a script of inputs, without a display: whether a story can be told to its end, on any kind of device.
///
/// Keys, mouse, sticks and a tracked wand are moved as a visitor moves them; nothing is called that they would not set off. What a line of the script expects and does not find
/// ends the visit with that line and a picture of the moment. Without -o nothing else is drawn, which is many times faster. The visit begins anew and keeps nothing. Keys and buttons
/// are those of the site's display.toml, or the user's own.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  heliodon play mysite --inputs tour.play\n  heliodon play mysite --inputs tour.play --scheme pad -o tour.mp4 --size 640x480\n\nA line of a script: walk PLACE [within M] | look PLACE | strike PLACE | press ACTION [SECONDS] | wait SECONDS | until WHAT [within SECONDS] | expect WHAT | shot NAME.png | say \"TEXT\""
)]
pub struct Args {
    /// A bundle's folder; or a site, whose bundle is baked first where it is not up to date
    path: PathBuf,
    /// The script
    #[arg(long, value_name = "FILE")]
    inputs: PathBuf,
    /// With what it is played
    #[arg(long, value_enum, default_value_t = On::Keyboard)]
    scheme: On,
    /// A film of it (.mp4); pictures that the script asks for go beside it, without a film beside the script
    #[arg(short, long, value_name = "FILM")]
    output: Option<PathBuf>,
    /// The pictures' size
    #[arg(long, value_name = "WxH", default_value = "640x480", value_parser = values::size)]
    size: Size,
    /// Frames a second, of the visit and of its film
    #[arg(long, default_value = "30", value_parser = |text: &str| values::within(text, 10.0, 120.0))]
    fps: f64,
    /// Film every N-th frame only: as quick to watch, quicker to make
    #[arg(long, value_name = "N", default_value = "1", requires = "output")]
    every: NonZeroU32,
    /// The language of the story's texts [default: the story's own]
    #[arg(long, value_name = "LANGUAGE")]
    language: Option<String>,
}

/// With what a visit is played.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum On {
    /// Keys and mouse
    Keyboard,
    /// A game controller
    Pad,
    /// A tracked wand before two walls
    Hand,
}

#[derive(Serialize)]
struct PlayReport {
    bundle: PathBuf,
    scheme: String,
    /// Seconds of the visit, and those that it took.
    visit_s: f64,
    took_s: f64,
    lines: usize,
    /// The tasks that stood, each with the second of the visit in which it was set.
    tasks: Vec<(String, f64)>,
    /// What frames took, milliseconds, and what each feature took of the processor in them.
    frames: Frames,
    features: Vec<Feature>,
    film: Option<PathBuf>,
}

#[derive(Serialize)]
struct Frames {
    count: usize,
    mean_ms: f32,
    p95_ms: f32,
    most_ms: f32,
}

#[derive(Serialize)]
struct Feature {
    name: &'static str,
    mean_ms: f32,
    most_ms: f32,
}

/// Runs it.
pub fn run(app: &App, args: &Args) -> Result<()> {
    let text = std::fs::read_to_string(&args.inputs).with_context(|| format!("cannot read {}", args.inputs.display()))?;
    let lines = script::parse(&text).with_context(|| args.inputs.display().to_string())?;
    if let Some(output) = &args.output {
        crate::files::check_place(output)?;
        film::check_size(args.size.width, args.size.height)?;
    }
    let display = display::of_viewer(None, &display::folder_of(&args.path))?;
    let bundle = bundle_of(app, &args.path)?;
    let options = PlayOptions {
        scheme: match args.scheme {
            On::Keyboard => Scheme::Keyboard,
            On::Pad => Scheme::Pad,
            On::Hand => Scheme::Hand,
        },
        fps: args.fps,
        size: (args.size.width, args.size.height),
        films_every: args.output.as_ref().map(|_| args.every),
        input: display.map(|display| display.input.clone()).unwrap_or_default(),
        story: story_places(&args.path, args.language.clone(), false),
    };
    let begun = Instant::now();
    let mut player = Player::new(&bundle, &options)?;
    // as long as the visit, however few of its frames are in it
    let film_fps = (args.fps / f64::from(args.every.get())).max(1.0);
    let mut film = args.output.as_ref().map(|_| Film::new(args.size.width, args.size.height, film_fps)).transpose()?;
    let whole = args.output.as_ref().unwrap_or(&args.inputs);
    let beside = whole.parent().unwrap_or(Path::new("")).to_owned();
    app.progress.stage("playing", lines.len() as u64);
    let mut take = |shot: Option<&str>, picture: SrgbImage| -> Result<()> {
        match (shot, &mut film) {
            (Some(name), _) => write_png(&beside.join(name), &picture),
            (None, Some(film)) => film.push(&picture),
            (None, None) => Ok(()),
        }
    };
    let mut played = Ok(Played::default());
    for (number, line) in lines.iter().enumerate() {
        if let Doing::Say(text) = &line.doing {
            app.progress.note(text);
        }
        played = player.play(std::slice::from_ref(line), &mut take);
        if played.is_err() {
            break;
        }
        app.progress.progress(number as u64 + 1);
    }
    app.progress.finished();
    player.take_problems().iter().for_each(|problem| app.progress.warning(problem));
    // what went wrong is in the film's last pictures
    if let (Some(film), Some(output)) = (film, &args.output) {
        film.finish(output)?;
    }
    let Played { seconds, tasks, lines } = match played {
        Ok(played) => played,
        Err(error) => match error.downcast::<PlayError>() {
            Ok(fault @ PlayError::Line { .. }) => {
                let picture = whole.with_extension("failed.png");
                if let Some(still) = player.still()? {
                    write_png(&picture, &still)?;
                }
                bail!("{}: {fault}; {} shows it", args.inputs.display(), picture.display())
            }
            Ok(fault) => return Err(fault.into()),
            Err(error) => return Err(error),
        },
    };
    let times = player.frame_times();
    let features =
        player.costs().into_iter().map(|(name, cost)| Feature { name, mean_ms: cost.mean_ms, most_ms: cost.most_ms });
    let report = PlayReport {
        bundle,
        scheme: format!("{:?}", args.scheme).to_lowercase(),
        visit_s: seconds,
        took_s: begun.elapsed().as_secs_f64(),
        lines,
        tasks,
        frames: Frames { count: times.frames, mean_ms: times.mean_ms, p95_ms: times.p95_ms, most_ms: times.most_ms },
        features: features.collect(),
        film: args.output.clone(),
    };
    app.output.result(&report, |report| {
        let mut text = format!(
            "Played to its end: {} lines, {:.0} s of a visit in {:.0} s, by {}.\n",
            report.lines, report.visit_s, report.took_s, report.scheme
        );
        for (task, second) in &report.tasks {
            text += &format!("{second:7.1} s  {task}\n");
        }
        let Frames { count, mean_ms, p95_ms, most_ms } = report.frames;
        text += &format!("{count} frames: {mean_ms:.1} ms, 95 % within {p95_ms:.1} ms, at most {most_ms:.1} ms\n");
        text
    })
}
