//! A visit in a headset, without the command line around it: what OpenXR runtime there is, it shows the bundle in it.
//!
//! `cargo run --example headset [BUNDLE] [--no-window] [--seconds N] [--capture FOLDER] [--floor] [--noon] [--passes auto|one|two]`; without a bundle, a
//! small court of columns is made; the day is on the wrist, or with `--floor` on the floor. scripts/monado/headset.sh runs it in Monado.

#![expect(clippy::print_stdout, clippy::print_stderr, reason = "an example speaks to people")]

#[path = "common/mod.rs"]
mod common;

use heliodon_bundle::display::{Display, DisplayFile, HeadsetTimeline, Navigation, Passes};
use heliodon_view::xr::{HeadsetOptions, run_headset};
use std::error::Error;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;

fn main() -> ExitCode {
    match visit() {
        Ok(report) => {
            println!("{report}");
            ExitCode::SUCCESS
        }
        Err(why) => {
            eprintln!("headset: {why}");
            ExitCode::FAILURE
        }
    }
}

fn visit() -> Result<String, Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let mut options = HeadsetOptions::default();
    let mut bundle = None;
    let mut display = DisplayFile::default();
    display.display.navigation = Navigation::Walk;
    while let Some(argument) = arguments.next() {
        let mut value = || arguments.next().ok_or_else(|| format!("{argument} needs a value"));
        match argument.as_str() {
            "--no-window" => options.mirror = false,
            "--seconds" => options.trial.seconds = Some(value()?.parse()?),
            "--capture" => options.trial.capture = Some(value()?.into()),
            "--floor" => display.headset.timeline = HeadsetTimeline::Floor,
            "--passes" => {
                display.display.passes = match value()?.as_str() {
                    "auto" => Passes::Auto,
                    "one" => Passes::One,
                    "two" => Passes::Two,
                    other => return Err(format!("--passes {other}: auto, one or two").into()),
                }
            }
            "--noon" => options.visit.clock_s = Some(12.0 * 3600.0),
            _ => bundle = Some(PathBuf::from(argument)),
        }
    }
    let folder = tempfile::tempdir()?;
    let bundle = match bundle {
        Some(path) => path,
        None => {
            let path = folder.path().join("court");
            common::Court::small().write(&path)?;
            path
        }
    };
    options.visit.display = Some(Arc::new(Display::parse(&display.to_toml_string(), "headset")?));
    Ok(run_headset(bundle, &options)?.json())
}
