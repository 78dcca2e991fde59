//! Automatic matches by the real COLMAP, against cameras that are known. Without the program or the photographs the tests say so and are skipped.

#![cfg(test)]

#[path = "common/accuracy.rs"]
mod accuracy;

use accuracy::compare;
use heliodon_photo::camera::{Camera, Intrinsics};
use heliodon_photo::formats::{ImportedCameras, openmvg, projection};
use heliodon_photo::matching::{Matched, Request, run};
use heliodon_photo::project::{DistortionEntry, FocalEntry, LensEntry, PhotoEntry, Project};
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

const CASTLE: &str = "kapture_maupertuis";
const TEMPLE: &str = "middlebury_templeSparseRing";

/// A shared set of photographs, where it is there and COLMAP is.
fn photoset(name: &str) -> Option<PathBuf> {
    let folder = Path::new("../../../shared/data/photosets").join(name);
    if !folder.is_dir() {
        eprintln!("skipped: there is no {}", folder.display());
        return None;
    }
    if std::process::Command::new("colmap").arg("-h").env("QT_QPA_PLATFORM", "offscreen").output().is_err() {
        eprintln!("skipped: there is no program colmap");
        return None;
    }
    Some(folder)
}

/// A project of photographs in a folder of its own.
fn project(folder: &Path, files: &[PathBuf], lens: Option<LensEntry>) -> Project {
    let mut project = Project::parse("", folder.join("photos.toml")).unwrap();
    for file in files {
        let name = file.file_name().unwrap().to_string_lossy().into_owned();
        let to = folder.join(&name);
        if !to.exists() {
            std::fs::copy(file, to).unwrap();
        }
        project.file.photo.push(PhotoEntry { file: name, lens: lens.as_ref().map(|l| l.name.clone()), ..PhotoEntry::default() });
    }
    project.file.lens.extend(lens);
    project
}

fn photographs(folder: &Path, ending: &str) -> Vec<PathBuf> {
    let mut all: Vec<PathBuf> = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    all.retain(|path| path.extension().is_some_and(|e| e == ending));
    all.sort();
    all
}

fn matched(project: &Project) -> Matched {
    let loaded = project.load_for_matching().unwrap();
    let files: Vec<String> = project.file.photo.iter().map(|p| p.file.clone()).collect();
    let request = Request { program: OsStr::new("colmap"), folder: project.folder(), files: &files, problem: &loaded.problem };
    let start = std::time::Instant::now();
    let matched = run(&request, &mut |stage| eprintln!("  {stage}")).unwrap();
    let lens = matched.solution.lenses[0];
    println!(
        "{} of {} photographs, {} points, {:.2} px, {:.0} s; focal length {:.1} +- {:.1} px, centre {:.1} {:.1} +- {:.1} px",
        matched.cameras.cameras.len(),
        files.len(),
        matched.cameras.points.len(),
        matched.solution.sigma_px,
        start.elapsed().as_secs_f64(),
        lens.intrinsics.focal_px[0],
        lens.sigmas[0],
        lens.intrinsics.centre_px[0],
        lens.intrinsics.centre_px[1],
        lens.sigmas[1]
    );
    for left in &matched.left_out {
        println!("  {}: {}", left.photo, left.why);
    }
    for note in &matched.notes {
        println!("  note: {note}");
    }
    matched
}

/// Turn in degrees and place in parts of the baseline, the worst of all photographs.
fn off(matched: &Matched, known: &ImportedCameras) -> (f64, f64) {
    let (mut found, mut truth): (Vec<Camera>, Vec<Camera>) = (Vec::new(), Vec::new());
    for camera in &matched.cameras.cameras {
        let same = known.cameras.iter().find(|k| k.name == camera.name).unwrap();
        found.push(camera.camera);
        truth.push(same.camera);
    }
    let accuracy = compare(&found, &truth);
    println!(
        "  turn {:.4} deg at worst, {:.4} rms; place {:.3} % of the baseline at worst, {:.3} rms",
        accuracy.turn_deg,
        accuracy.turn_rms_deg,
        100.0 * accuracy.place,
        100.0 * accuracy.place_rms
    );
    (accuracy.turn_deg, accuracy.place)
}
