//! Prints how long a frame of 720,000 triangles takes at 1024x768: the scene, the eye and the counting of Bevy's peer
//! (36 shafts of 20,000 triangles, off screen, the mean of 100 frames after 60), in a day that passes, sky included.
//!
//! `cargo run -p heliodon_view --example frame_time [BUNDLE] [--paused] [--swaying] [--small] [--empty] [--no-details]`; `--swaying`
//! moves the eye in every frame, `--small` takes a court with a ground instead, `--empty` nothing at all, to compare memory with; `--no-details` switches off the details of
//! a bundle that has some.

#![expect(clippy::print_stdout, reason = "an example speaks to people")]

#[path = "common/mod.rs"]
mod common;

use glam::Vec3;
use heliodon_bundle::memory::resident_bytes;
use heliodon_view::Pose;
use heliodon_view::bench::{FrameBench, frame_times};
use std::path::PathBuf;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let playing = !arguments.iter().any(|a| a == "--paused");
    let empty = arguments.iter().any(|a| a == "--empty");
    let swaying = arguments.iter().any(|a| a == "--swaying");
    let without_details = arguments.iter().any(|a| a == "--no-details");
    let folder = tempfile::tempdir()?;
    let (bundle, pose) = match arguments.iter().find(|a| !a.starts_with("--")) {
        Some(path) => (PathBuf::from(path), None),
        None => {
            let path = folder.path().join("peer");
            let small = arguments.iter().any(|a| a == "--small");
            let court = if small { common::Court::small() } else { common::Court::peer() };
            if !empty {
                court.write(&path)?;
            }
            (path, Some(Pose::looking(Vec3::new(0.0, 4.0, 30.0), Vec3::new(0.0, 4.0, 0.0))))
        }
    };
    let before = resident_bytes();
    let times = frame_times(
        (!empty).then_some(bundle.as_path()),
        FrameBench { playing, swaying, pose, without_details, ..FrameBench::default() },
    )?;
    let mib = |bytes: Option<u64>| bytes.map_or(0, |b| b >> 20);
    println!(
        "{:.1} ms a frame, {:.1} ms of processor time, on {}; {} MiB resident, {} before",
        times.mean_ms,
        times.processor_ms.unwrap_or(f64::NAN),
        times.device,
        mib(times.resident_bytes),
        mib(before)
    );
    Ok(())
}
