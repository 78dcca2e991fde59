//! `heliodon key`: filmed people become an image and an inverted mask.

mod outputs;
mod preview;
mod report;

use crate::App;
use crate::failure::{WrongArguments, wrong_arguments};
use crate::values;
use anyhow::Result;
use heliodon_bake::report::Reporter;
use heliodon_capture::key::{Blending, KeyParams, Keyed, Keyer, Mixing, Picture, Region, ScreenChoice, ScreenKind};
use heliodon_film::{Film, Frame, FrameReader, Rate, ReadParams, Source};
use outputs::Outputs;
use preview::Preview;
use report::KeyReport;
use std::path::PathBuf;
use std::time::Instant;

/// Turns a film before a blue or green screen into an image and an inverted mask, which the viewer overlays.
///
/// The screen's colour is found, its unevenness, its noise and its light on the actor are taken off, soft edges stay. Writes NAME.image.mp4
/// (black where nothing is, with the film's sound) and NAME.mask.mp4 (white where nothing is), H.264 of even width and height: a film of odd size gets a
/// transparent column or row. A film that carries alpha (VP8 or VP9 in WebM, PNG files as in walk/%04d.png) is taken as it is. Films are read and written
/// by ffmpeg.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  heliodon key guide.mp4 -o guide --sheet guide.png\n  heliodon key guide.mp4 --screen blue --keep 80,0,400,1280 --largest\n  heliodon key wall.mp4 --preset rough --screen '#a8b40a' --seconds 5 --sheet look.png\n  heliodon key dancer.webm -o dancer --webm"
)]
pub struct Args {
    /// The film, or numbered pictures as in walk/%04d.png
    #[arg(value_name = "VIDEO")]
    video: PathBuf,
    /// What the films are called, without an ending [default: the film's name, beside it]
    #[arg(short, long, value_name = "NAME")]
    output: Option<PathBuf>,
    /// What is behind the actor: find, green, blue, or a colour as in '#30b048'. Of a film that carries alpha: whose rest is taken off
    #[arg(long, value_name = "COLOUR", default_value = "find", value_parser = screen)]
    screen: ScreenChoice,
    /// Where to begin: studio, rough (a wall, a sheet, a noisy film), or clean (rendered pictures)
    #[arg(long, value_enum, default_value = "studio")]
    preset: Preset,
    /// Keep only what lies in this rectangle of pixels (left,top,width,height) or polygon (x,y,x,y,x,y,...); may be given several times
    #[arg(long, value_name = "REGION", value_parser = region)]
    keep: Vec<Region>,
    /// Keep only what hangs together with the largest figure
    #[arg(long)]
    largest: bool,
    /// Draw the matte in by so many pixels
    #[arg(long, value_name = "PIXELS", value_parser = values::pixels)]
    shrink: Option<f32>,
    /// Blur its edges over so many pixels
    #[arg(long, value_name = "PIXELS", value_parser = values::pixels)]
    soften: Option<f32>,
    /// Where screen ends, in standard deviations of its noise: more is cleaner, and eats hair
    #[arg(long, value_name = "SIGMAS", value_parser = number)]
    black: Option<f32>,
    /// What is at most so far from opaque becomes opaque, 0 to 0.5
    #[arg(long, value_name = "SHARE", value_parser = number)]
    white: Option<f32>,
    /// How much of the screen's colour is taken off what remains, 0 to 1
    #[arg(long, value_name = "SHARE", value_parser = number)]
    spill: Option<f32>,
    /// How much alpha holds still where pixels do, 0 to 0.95
    #[arg(long, value_name = "SHARE", value_parser = number)]
    steady: Option<f32>,
    /// How edges were mixed with the screen: find, light (a camera), or codes (a program)
    #[arg(long, value_enum, default_value = "find")]
    mixed: Mixed,
    /// How the films will be composited: linear (Heliodon's viewer), or encoded (fixed-function passes over display values)
    #[arg(long, value_enum, default_value = "linear")]
    blend: Blend,
    /// Begin at this second of the film
    #[arg(long, value_name = "SECONDS", value_parser = values::elapsed, default_value = "0")]
    from: f64,
    /// Take so many seconds of it [default: all]
    #[arg(long, value_name = "SECONDS", value_parser = values::seconds)]
    seconds: Option<f64>,
    /// Quality of the films, 0 (nearly without loss) to 40 (small)
    #[arg(long, value_name = "Q", default_value = "14", value_parser = clap::value_parser!(u32).range(0..=40))]
    quality: u32,
    /// Also write NAME.webm: VP9 with alpha, as browsers take it
    #[arg(long)]
    webm: bool,
    /// Draw six frames over black, white, sky and stone
    #[arg(long, value_name = "PNG")]
    sheet: Option<PathBuf>,
}

#[derive(Clone, Copy, Debug, clap::ValueEnum)]
enum Preset {
    Studio,
    Rough,
    Clean,
}

#[derive(Clone, Copy, Debug, clap::ValueEnum)]
enum Mixed {
    Find,
    Light,
    Codes,
}

#[derive(Clone, Copy, Debug, clap::ValueEnum)]
enum Blend {
    Linear,
    Encoded,
}

fn screen(text: &str) -> Result<ScreenChoice, String> {
    match text {
        "find" => return Ok(ScreenChoice::Find),
        "green" => return Ok(ScreenChoice::Green),
        "blue" => return Ok(ScreenChoice::Blue),
        _ => {}
    }
    let digits = text.strip_prefix('#').filter(|digits| digits.len() == 6 && digits.is_ascii());
    let code = |at: usize| digits.and_then(|digits| u8::from_str_radix(digits.get(at..at + 2)?, 16).ok());
    match (code(0), code(2), code(4)) {
        (Some(r), Some(g), Some(b)) => Ok(ScreenChoice::Color([r, g, b])),
        _ => Err("write find, green, blue, or a colour of six hexadecimal digits as in '#30b048'".to_owned()),
    }
}

fn region(text: &str) -> Result<Region, String> {
    let form =
        || "write a rectangle as left,top,width,height, or a polygon as x,y,x,y,x,y with at least three corners".to_owned();
    let numbers: Option<Vec<f32>> = text.split(',').map(|n| n.trim().parse().ok().filter(|x: &f32| x.is_finite())).collect();
    match numbers.ok_or_else(form)?.as_slice() {
        &[left, top, width, height] if width > 0.0 && height > 0.0 => Ok(Region::rectangle(left, top, width, height)),
        numbers if numbers.len() >= 6 && numbers.len().is_multiple_of(2) => {
            Ok(Region { points: numbers.chunks_exact(2).map(|corner| [corner[0], corner[1]]).collect() })
        }
        _ => Err(form()),
    }
}

fn number(text: &str) -> Result<f32, String> {
    text.parse().ok().filter(|x: &f32| x.is_finite()).ok_or_else(|| "write a number".to_owned())
}

/// How many frames the screen is found in, and the most bytes that they may take.
const SAMPLES: f64 = 24.0;
const SAMPLE_BYTES: usize = 256 << 20;

/// Runs it.
pub fn run(app: &App, args: &Args) -> Result<()> {
    let params = plan(args)?;
    let film = Film::probe(&args.video)?;
    let part = Part::of(args, &film);
    let outputs = Outputs::plan(args, &film, &part)?;
    let mut work = if film.alpha {
        Work::Split(match args.screen {
            ScreenChoice::Green => Some(ScreenKind::Green),
            ScreenChoice::Blue => Some(ScreenKind::Blue),
            ScreenChoice::Find => None,
            ScreenChoice::Color(_) => {
                wrong_arguments!("{} carries alpha: only --screen green or blue says what is left in it", args.video.display())
            }
        })
    } else {
        app.progress.stage("finding the screen", 0);
        let pictures = sampled(&film, &part)?;
        let views: Vec<Picture<'_>> = pictures.iter().map(picture).collect::<Result<_, _>>()?;
        let keyer = Keyer::prepare(&views, &KeyParams { subsampled: film.subsampled, ..params.clone() });
        app.progress.finished();
        Work::Key(Box::new(keyer.map_err(|error| anyhow::anyhow!("{}: {error}", args.video.display()))?))
    };
    let report = write(app, args, &film, &part, &mut work, outputs, params.blending)?;
    report.warnings.iter().for_each(|warning| app.progress.warning(warning));
    app.output.result(&report, report::describe)
}

/// What the arguments mean together.
fn plan(args: &Args) -> Result<KeyParams> {
    if let Some(sheet) = &args.sheet
        && !sheet.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("png"))
    {
        wrong_arguments!("{}: the sheet is written as PNG; give a name that ends in .png", sheet.display());
    }
    let preset = match args.preset {
        Preset::Studio => KeyParams::studio(),
        Preset::Rough => KeyParams::rough(),
        Preset::Clean => KeyParams::clean(),
    };
    let params = KeyParams {
        screen: args.screen,
        mixing: match args.mixed {
            Mixed::Find => Mixing::Find,
            Mixed::Light => Mixing::Linear,
            Mixed::Codes => Mixing::Encoded,
        },
        blending: match args.blend {
            Blend::Linear => Blending::Linear,
            Blend::Encoded => Blending::Encoded,
        },
        keep: args.keep.clone(),
        largest_only: args.largest || preset.largest_only,
        shrink_px: args.shrink.unwrap_or(preset.shrink_px),
        soften_px: args.soften.unwrap_or(preset.soften_px),
        black_sigmas: args.black.unwrap_or(preset.black_sigmas),
        white_margin: args.white.unwrap_or(preset.white_margin),
        spill: args.spill.unwrap_or(preset.spill),
        steadiness: args.steady.unwrap_or(preset.steadiness),
        ..preset
    };
    params.validate().map_err(|error| WrongArguments(error.to_string()))?;
    Ok(params)
}

/// Which frames of the film are taken.
struct Part {
    rate: Rate,
    first: u64,
    /// How many at most; `None` for all.
    limit: Option<u64>,
    /// How many there should be, where that is known.
    expected: Option<u64>,
}

impl Part {
    fn of(args: &Args, film: &Film) -> Self {
        let first = film.rate.frame_at(args.from);
        let limit = args.seconds.map(|seconds| ((seconds * film.rate.per_second()).round() as u64).max(1));
        let there = film.frames().map(|frames| frames.saturating_sub(first));
        let expected = match (there, limit) {
            (Some(there), Some(limit)) => Some(there.min(limit)),
            (there, limit) => there.or(limit),
        };
        Self { rate: film.rate, first, limit, expected }
    }

    fn start_s(&self) -> f64 {
        self.rate.time_of(self.first)
    }
}

/// What is done with a frame.
enum Work {
    /// Alpha is there; of what screen colour is left.
    Split(Option<ScreenKind>),
    Key(Box<Keyer>),
}

fn picture(frame: &Frame) -> Result<Picture<'_>> {
    Ok(Picture::new(frame.width, frame.height, &frame.pixels)?)
}

/// Frames spread over the part of the film that is keyed.
fn sampled(film: &Film, part: &Part) -> Result<Vec<Frame>> {
    let bytes = film.width as usize * film.height as usize * 4;
    let count = (SAMPLE_BYTES / bytes.max(1)).clamp(2, SAMPLES as usize);
    let params = ReadParams { start: part.first, ..ReadParams::archival() };
    // every so many frames; of a film whose length nobody knows, two a second
    let every = part.expected.map_or(film.rate.per_second() / 2.0, |frames| frames as f64 / count as f64).max(1.0) as u64;
    let mut reader = FrameReader::open(Source::Film(film.clone()), &params)?;
    let (mut frames, mut index, mut last) = (Vec::new(), 0, None);
    let mut pixels = Vec::new();
    while frames.len() < count
        && part.limit.is_none_or(|limit| index < limit)
        && let Some(number) = reader.read_into(&mut pixels)?
    {
        last = Some(number);
        if index % every == every / 2 {
            frames.push(Frame { number, width: film.width, height: film.height, pixels: pixels.clone() });
        }
        index += 1;
    }
    // one that was cut off, or a short one, may have none of those
    if let (Some(number), true) = (last, frames.is_empty()) {
        reader = FrameReader::open(Source::Film(film.clone()), &params)?;
        reader.read_into(&mut pixels)?;
        frames.push(Frame { number, width: film.width, height: film.height, pixels });
    }
    if frames.is_empty() {
        return Err(no_frame(film, part));
    }
    Ok(frames)
}

fn no_frame(film: &Film, part: &Part) -> anyhow::Error {
    anyhow::anyhow!(
        "{}: there is no frame at {:.3} s, where it was to begin; give an earlier second with --from",
        film.path.display(),
        part.start_s()
    )
}

fn write(
    app: &App,
    args: &Args,
    film: &Film,
    part: &Part,
    work: &mut Work,
    mut outputs: Outputs,
    blending: Blending,
) -> Result<KeyReport> {
    let name = if film.alpha { "splitting" } else { "keying" };
    app.progress.stage(name, part.expected.unwrap_or(0));
    let begun = Instant::now();
    let mut solving = std::time::Duration::ZERO;
    let mut preview = args.sheet.as_ref().map(|_| Preview::new(part.expected, blending));
    let mut reader =
        FrameReader::open(Source::Film(film.clone()), &ReadParams { start: part.first, ..ReadParams::archival() })?;
    let mut counts = report::Counts::default();
    let mut pixels = Vec::new();
    while part.limit.is_none_or(|limit| counts.frames < limit) && reader.read_into(&mut pixels)?.is_some() {
        let picture = Picture::new(film.width, film.height, &pixels)?;
        let clock = Instant::now();
        let keyed = match work {
            Work::Split(screen) => Keyed::of_alpha(&picture, *screen, blending),
            Work::Key(keyer) => keyer.key(&picture)?,
        };
        solving += clock.elapsed();
        if let Some(preview) = &mut preview {
            preview.offer(counts.frames, &keyed);
        }
        counts.add(&keyed);
        outputs.write(keyed, blending)?;
        app.progress.progress(counts.frames);
    }
    if counts.frames == 0 {
        return Err(no_frame(film, part));
    }
    let sheet = preview.map(Preview::sheet).transpose()?;
    let files = outputs.finish(sheet)?;
    app.progress.finished();
    let keyer = match work {
        Work::Split(_) => None,
        Work::Key(keyer) => Some(&**keyer),
    };
    let speed = report::Speed {
        frames_per_s: counts.frames as f64 / begun.elapsed().as_secs_f64().max(1e-9),
        solver_frames_per_s: counts.frames as f64 / solving.as_secs_f64().max(1e-9),
    };
    Ok(KeyReport::new(film, part, keyer, &counts, files, reader.complaint(), speed))
}
