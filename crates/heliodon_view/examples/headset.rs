//! A visit in a headset, without the command line around it: what OpenXR runtime there is, it shows the bundle in it.
//!
//! `cargo run --example headset [BUNDLE] [--no-window] [--seconds N] [--capture FOLDER] [--floor] [--noon]`; without a bundle, a small court
//! of columns is made; the day is on the wrist, or with `--floor` on the floor. scripts/monado/headset.sh runs it in Monado.

#![expect(clippy::print_stdout, clippy::print_stderr, reason = "an example speaks to people")]

#[path = "common/mod.rs"]
mod common;

use heliodon_bundle::display::{Display, DisplayFile, HeadsetTimeline, Navigation};
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
    let (mut bundle, mut on_floor) = (None, false);
    while let Some(argument) = arguments.next() {
        let mut value = || arguments.next().ok_or_else(|| format!("{argument} needs a value"));
        match argument.as_str() {
            "--no-window" => options.mirror = false,
            "--seconds" => options.trial.seconds = Some(value()?.parse()?),
            "--capture" => options.trial.capture = Some(value()?.into()),
            "--floor" => on_floor = true,
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
    if on_floor {
        let mut display = DisplayFile::default();
        display.display.navigation = Navigation::Walk;
        display.headset.timeline = HeadsetTimeline::Floor;
        options.visit.display = Some(Arc::new(Display::parse(&display.to_toml_string(), "headset")?));
    }
    Ok(run_headset(bundle, &options)?.json())
}
