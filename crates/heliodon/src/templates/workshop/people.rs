//! The workshop's people, captured when the site is made: nothing of them needs to be kept or fetched.

use anyhow::{Context, Result};
use heliodon_bundle::impostor::{IMPOSTOR_ENDING, Ring};
use heliodon_capture::impostor::{CaptureParams, capture};
use heliodon_image::Bc7Quality;
use heliodon_mesh::export::write_glb;
use heliodon_mesh::figures::{Artisan, artisan};
use heliodon_mesh::import::{ImportOptions, ImportReport};
use heliodon_mesh::motion::read_moving;
use std::path::Path;

/// Views about each: they are met from the height of eyes only, in a hall.
const VIEWS: u32 = 12;
/// From there, degrees over the horizon: eyes are higher than the middle of who stands some metres away.
const FROM_ABOVE_DEG: f32 = 7.0;
/// Frames a second of their movements.
const FRAMES_PER_S: f32 = 12.0;

/// From how far away each is looked at, metres: the master is followed.
fn distance_m(who: Artisan) -> f32 {
    match who {
        Artisan::Master => 7.0,
        Artisan::Carver => 9.0,
        Artisan::Porter => 10.0,
    }
}

/// Captures all of them into the folder; answers the files' names.
pub fn capture_all(folder: &Path) -> Result<Vec<String>> {
    Artisan::ALL.into_iter().map(|who| capture_one(folder, who)).collect()
}

fn capture_one(folder: &Path, who: Artisan) -> Result<String> {
    let model_path = folder.join(who.file_name());
    write_glb(&model_path, &artisan(who))?;
    let model = read_moving(&model_path, &ImportOptions::default(), &mut ImportReport::default())?;
    let params = CaptureParams {
        rings: vec![Ring::around(FROM_ABOVE_DEG, VIEWS)],
        distance_m: distance_m(who),
        frames_per_s: FRAMES_PER_S,
        // who makes the site waits for it
        quality: Bc7Quality::Draft,
        ..CaptureParams::crowd()
    };
    let name = who.file_name().trim_end_matches(".glb");
    let file = format!("{name}{IMPOSTOR_ENDING}");
    let path = folder.join(&file);
    let bytes = capture(&model, name, &params, &|_| {})?.to_bytes(&path.display().to_string())?;
    std::fs::write(&path, bytes).with_context(|| format!("cannot write {}", path.display()))?;
    std::fs::remove_file(&model_path).with_context(|| format!("cannot remove {}", model_path.display()))?;
    Ok(file)
}
