//! What the view-cell purge costs and what is left: `cargo run -p heliodon_prepare --example purge_cost -- X0 Y0 Z0 X1 Y1 Z1 FILE...`
//!
//! The files' triangles are one model, seen from the box between the two corners on a display of 1024 x 768 pixels that is 60 degrees
//! high. Prints the report, seconds, memory, and a check of 4,000 frames with a seed of its own. `THREADS` in the environment sets the
//! number of threads, `FRESH`, `RESOLUTION`, `FACE_RAYS` and `BORDER_RAYS` the parameters of these names.

use glam::Vec3;
use heliodon_mesh::import::{ImportOptions, ImportReport, read_reporting};
use heliodon_prepare::purge::{CheckParams, PurgeParams, Surface, purge, verify};
use heliodon_prepare::{Screen, ViewCell, Views};
use heliodon_rays::{BuildParams, TriangleScene};
use heliodon_testkit::process::peak_bytes;
use std::error::Error;
use std::path::Path;
use std::time::Instant;

#[expect(clippy::print_stdout, reason = "a program for people")]
fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (corners, files) = arguments.split_at_checked(6).ok_or("six numbers and files, please")?;
    let corners = corners.iter().map(|x| x.parse::<f32>()).collect::<Result<Vec<f32>, _>>()?;
    let (low, high) = (Vec3::from_slice(&corners[..3]), Vec3::from_slice(&corners[3..]));
    let screen = Screen { width_px: 1024, height_px: 768, fov_rad: 60_f32.to_radians() };
    let views = Views { cells: vec![ViewCell { low, high, windows: Vec::new() }], screen };
    let number = |name: &str| std::env::var(name).ok().and_then(|value| value.parse::<f64>().ok());
    let standard = PurgeParams::default();
    let params = PurgeParams {
        fresh_share: number("FRESH").unwrap_or(standard.fresh_share),
        resolution: number("RESOLUTION").map_or(standard.resolution, |x| x as f32),
        face_rays: number("FACE_RAYS").map_or(standard.face_rays, |x| x as u8),
        border_rays: number("BORDER_RAYS").map_or(standard.border_rays, |x| x as u8),
        ..standard
    };

    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for file in files {
        let mesh = read_reporting(Path::new(file), &ImportOptions::default(), &mut ImportReport::default())?;
        let first = positions.len() as u32;
        positions.extend(mesh.positions);
        triangles.extend(mesh.triangles.into_iter().map(|t| t.map(|i| i + first)));
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(number("THREADS").map_or(0, |x| x as usize)).build()?;
    let start = Instant::now();
    let scene = pool.install(|| TriangleScene::build(&positions, &triangles, &BuildParams::default()))?;
    pool.install(|| {
        println!("hierarchy: {:.1} s, {} MB at the peak so far", start.elapsed().as_secs_f64(), peak_megabytes());
        let surface = Surface { positions: &positions, triangles: &triangles, single_sided: &[] };
        let start = Instant::now();
        let purged = purge(&scene, &surface, &views, &params);
        println!("purge: {:.1} s, {} MB at the peak", start.elapsed().as_secs_f64(), peak_megabytes());
        println!("{:#?}", purged.report);
        let start = Instant::now();
        let check = CheckParams { frames: 4000, pixels: 8192, near_m: params.near_m, seed: 0x00dd_5eed };
        for room in verify(&scene, &[], &purged.keep, &views, &check) {
            let seconds = start.elapsed().as_secs_f64();
            let share = 1e5 * room.wrong_share();
            println!(
                "{} frames: {} of {} pixels wrong, {share:.3} in 100,000; {seconds:.1} s",
                room.frames, room.wrong, room.met
            );
        }
    });
    Ok(())
}

/// The most memory that the process ever had; 0 where the system does not say.
fn peak_megabytes() -> u64 {
    peak_bytes().unwrap_or(0) / 1_000_000
}
