//! Films through the real ffmpeg; where it is not installed, every test here says that it is skipped.
#![expect(clippy::unwrap_used, reason = "helpers of tests: a test that cannot go on has failed")]

mod hostile;
mod players;
mod trips;

use heliodon_film::{FilmFormat, FilmWriter, Rate, WriteParams};
use std::path::Path;
use std::process::Command;

/// Whether ffmpeg is there; says so where not.
#[expect(clippy::print_stdout, reason = "a test that is skipped says so")]
fn ffmpeg() -> bool {
    let there = Command::new("ffmpeg").arg("-version").output().is_ok();
    if !there {
        println!("skipped: ffmpeg is not installed");
    }
    there
}

/// Makes something with ffmpeg itself, such as the films that we do not write.
fn made(arguments: &[&str], path: &Path) {
    let output = Command::new("ffmpeg").args(["-v", "error", "-nostdin", "-y"]).args(arguments).arg(path).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// The grey of frame `number`, from which a decoded picture tells its number: 12 codes apart.
fn grey(number: u64) -> u8 {
    (number % 20) as u8 * 12 + 8
}

fn number_of(grey: u8) -> u64 {
    (u64::from(grey) + 6 - 8) / 12
}

/// A film whose frames are greys that tell their numbers, of `count` frames.
fn counting_film(path: &Path, width: u32, height: u32, rate: Rate, count: u64) {
    let params = WriteParams { format: FilmFormat::H264, ..WriteParams::archival(width, height, rate) };
    let mut writer = FilmWriter::grey(path, &params).unwrap();
    for number in 0..count {
        writer.write_grey(&vec![grey(number); (width * height) as usize]).unwrap();
    }
    writer.finish().unwrap();
}
