//! `heliodon sound`: sounds that are made, and what is in a sound file.

use crate::App;
use crate::failure::{WrongArguments, wrong_arguments};
use crate::files;
use anyhow::{Result, bail};
use heliodon_bake::report::Reporter;
use heliodon_sound::RATE_HZ;
use heliodon_sound::clip::Clip;
use heliodon_sound::file::{read_clip, wav_bytes};
use heliodon_sound::generate::{GenerateParams, SoundKind, generate};
use serde::Serialize;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Makes a sound for a site, or tells what is in a sound file.
///
/// KIND is fire, chisel, wood, pour, gold, wind, cicadas, crickets, birds, steps-stone, steps-earth, water, crowd, chime, cloth or dust; another
/// seed is another of its kind. Loops (fire, wind, cicadas, crickets, birds, water, crowd) have no seam. With `inspect` a FILE (WAV, Ogg Vorbis, FLAC,
/// MP3) is read as the viewer reads it, and its length, rate, level and what is damaged in it are told.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  heliodon sound chisel --seed 3 -o chisel-3.wav\n  heliodon sound wind --seconds 60 -o wind.wav\n  heliodon sound inspect hammer.ogg --json"
)]
pub struct Args {
    /// What to make, or `inspect`
    #[arg(value_name = "KIND|inspect")]
    what: String,
    /// The file to inspect
    #[arg(value_name = "FILE")]
    file: Option<PathBuf>,
    /// Its length, 0.1 to 300 seconds; of a loop from 2 on [default: the kind's own]
    #[arg(long, value_name = "S")]
    seconds: Option<f64>,
    /// Which of all sounds of its kind [default: 0]
    #[arg(long, value_name = "S")]
    seed: Option<u64>,
    /// 1 for a sound that has a place, 2 for ambience [default: the kind's own]
    #[arg(long, value_name = "N")]
    channels: Option<usize>,
    /// Write it: WAV, 16 bits, 48 kHz; replaces nothing but a WAV that it made
    #[arg(short, long, value_name = "WAV")]
    output: Option<PathBuf>,
}

enum Plan<'a> {
    Generate(GenerateParams, &'a Path),
    Inspect(&'a Path),
}

#[derive(Serialize)]
struct SoundReport {
    /// The kind, or the file.
    source: String,
    /// What that is.
    what: Option<&'static str>,
    /// Where it was written.
    file: Option<PathBuf>,
    seed: Option<u64>,
    /// Whether it was made to be repeated.
    repeats: Option<bool>,
    seconds: f64,
    /// Of what was written, or of the file itself.
    rate_hz: u32,
    channels: usize,
    /// Against full scale, decibels; none of silence.
    peak_db: Option<f32>,
    rms_db: Option<f32>,
    /// Parts of a file that could not be decoded.
    damaged: u32,
}

fn db(level: f32) -> Option<f32> {
    (level > 0.0).then(|| 20.0 * libm::log10f(level))
}

/// Runs it.
pub fn run(app: &App, args: &Args) -> Result<()> {
    let report = match plan(args)? {
        Plan::Generate(params, path) => {
            files::check_place(path)?;
            refuse_foreign(path)?;
            let clip = generate(&params)?;
            let bytes = wav_bytes(clip.samples(), clip.channels());
            files::write_whole(path, |file| file.write_all(&bytes))?;
            let facts = (params.kind.name().to_owned(), RATE_HZ, clip.channels(), clip.seconds(), 0);
            SoundReport {
                what: Some(params.kind.what()),
                file: Some(path.to_owned()),
                seed: Some(params.seed),
                repeats: Some(params.kind.is_loop()),
                ..told(&clip, facts)
            }
        }
        Plan::Inspect(path) => {
            let (clip, facts) = read_clip(path)?;
            if facts.damaged > 0 {
                let text = format!(
                    "{}: {} parts could not be decoded and are left out; save it again from its original",
                    path.display(),
                    facts.damaged
                );
                app.progress.warning(&text);
            }
            told(&clip, (path.display().to_string(), facts.rate_hz, facts.channels, facts.seconds, facts.damaged))
        }
    };
    app.output.result(&report, describe)
}

fn told(clip: &Clip, (source, rate_hz, channels, seconds, damaged): (String, u32, usize, f64, u32)) -> SoundReport {
    let (peak_db, rms_db) = (db(clip.peak()), db(clip.rms()));
    SoundReport {
        source,
        what: None,
        file: None,
        seed: None,
        repeats: None,
        seconds,
        rate_hz,
        channels,
        peak_db,
        rms_db,
        damaged,
    }
}

/// What the arguments mean together.
fn plan(args: &Args) -> Result<Plan<'_>> {
    if args.what == "inspect" {
        if args.output.is_some() || args.seconds.is_some() || args.seed.is_some() || args.channels.is_some() {
            wrong_arguments!("inspect makes nothing; leave out -o, --seconds, --seed and --channels");
        }
        let Some(file) = &args.file else { wrong_arguments!("name the sound file to inspect") };
        return Ok(Plan::Inspect(file));
    }
    let Some(kind) = SoundKind::named(&args.what) else {
        let known: Vec<&str> = SoundKind::ALL.iter().map(|kind| kind.name()).collect();
        wrong_arguments!("{} is no kind of sound; kinds are {}", args.what, known.join(", "));
    };
    if let Some(file) = &args.file {
        wrong_arguments!("{} is made from its kind alone; leave out {}, or say inspect", kind.name(), file.display());
    }
    let Some(output) = &args.output else { wrong_arguments!("say where to write it: -o {}.wav", kind.name()) };
    if !output.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("wav")) {
        wrong_arguments!("{}: sounds are written as WAV; give a name that ends in .wav", output.display());
    }
    let natural = GenerateParams::new(kind);
    let params = GenerateParams {
        kind,
        seed: args.seed.unwrap_or(natural.seed),
        seconds: args.seconds.unwrap_or(natural.seconds),
        channels: args.channels.unwrap_or(natural.channels),
    };
    params.validate().map_err(|error| WrongArguments(error.to_string()))?;
    Ok(Plan::Generate(params, output))
}

/// A recording is somebody's: only a WAV as this writes them, of 16 bits at 48 kHz, is replaced.
fn refuse_foreign(path: &Path) -> Result<()> {
    let mut head = [0; 44];
    let read = std::fs::File::open(path).and_then(|mut file| std::io::Read::read_exact(&mut file, &mut head));
    let ours = || {
        let channels = usize::from(head[22]);
        (1..=2).contains(&channels)
            && head[..4] == *b"RIFF"
            && head[8..] == wav_bytes(&[], channels)[8..40][..].iter().chain(&head[40..]).copied().collect::<Vec<_>>()[..]
    };
    if path.exists() && (read.is_err() || !ours()) {
        bail!("{} exists, and was not made here; move it away, or name another place", path.display());
    }
    Ok(())
}

fn describe(report: &SoundReport) -> String {
    let SoundReport { source, seconds, rate_hz, channels, .. } = report;
    let seed = report.seed.map_or_else(String::new, |seed| format!(", seed {seed}"));
    let channels = match channels {
        1 => "mono".to_owned(),
        2 => "stereo".to_owned(),
        more => format!("{more} channels"),
    };
    let mut text = format!("{source}: {seconds:.2} s, {rate_hz} Hz, {channels}{seed}\n");
    if let Some(what) = report.what {
        let repeats = if report.repeats == Some(true) { " It repeats without a seam." } else { "" };
        text += &format!("{what}{repeats}\n");
    }
    let level = |db: Option<f32>| db.map_or_else(|| "silence".to_owned(), |db| format!("{db:.1} dB"));
    text += &format!("peak {}, mean {}\n", level(report.peak_db), level(report.rms_db));
    if report.damaged > 0 {
        text += &format!("{} parts of it could not be decoded\n", report.damaged);
    }
    match &report.file {
        Some(file) => format!("{text}Written to {}.\n", file.display()),
        None => text,
    }
}
