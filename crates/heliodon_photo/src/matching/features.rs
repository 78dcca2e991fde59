//! Features of all photographs and their matches, in COLMAP's database.

use super::program::{Argument, Program};
use super::{MatchError, Request};
use crate::camera::Intrinsics;
use crate::formats::colmap_write::LensModel;
use crate::solve::bundle::Free;
use crate::solve::{Focal, LensGroup};
use std::ffi::OsStr;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// COLMAP's step that finds features.
pub(super) const EXTRACTOR: &str = "feature_extractor";

/// COLMAP's step that matches all pairs.
pub(super) const MATCHER: &str = "exhaustive_matcher";

/// Up to so many photographs features are sought once more along the epipolar lines that the first matches give: half as many matches again
/// (castle and temple: 34 % and 96 % more) for twice to three times the time, which with more photographs would be hours.
const MOST_GUIDED: usize = 32;

/// What COLMAP says of one photograph.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Extracted {
    pub(super) file: String,
    /// Its lens's number in the database; `None` where COLMAP does not take the photograph.
    pub(super) camera: Option<u32>,
    pub(super) features: usize,
    /// Why it is not taken.
    pub(super) error: Option<String>,
}

/// What of a lens is solved for where marks come by the thousand: k2 with k1.
pub(super) fn freed(group: &LensGroup) -> Free {
    let radial = if group.free.radial > 0 { group.free.radial.max(2) } else { 0 };
    let held = radial == 0 && matches!(group.focal, Focal::Known(_));
    // A centre that was told is held.
    let Intrinsics { width, height, centre_px, .. } = group.intrinsics;
    let untold = centre_px == Intrinsics::pinhole(width, height, 1.0).centre_px;
    Free { radial, centre: group.free.centre || untold && !held, ..group.free }
}

/// The lens as COLMAP's steps are told it, and what they may move of it. k3 would bring k4 to k6 with it, which ours does not have.
pub(super) fn told(group: &LensGroup, focal_px: Option<f64>) -> (Intrinsics, Free) {
    let focal = focal_px.or(match group.focal {
        Focal::Known(px) | Focal::Guess(px) => Some(px),
        Focal::Free => None,
    });
    let lens = focal.map_or(group.intrinsics, |px| crate::solve::with_focal(&group.intrinsics, px));
    let [k1, k2, _] = lens.radial;
    (Intrinsics { radial: [k1, k2, 0.0], ..lens }, Free { radial: freed(group).radial.min(2), ..Free::default() })
}

/// Finds the features of all photographs, a run for every lens. What an earlier run found of the same photographs with the same lenses is kept.
pub(super) fn extract(program: &mut Program<'_>, request: &Request<'_>, database: &Path) -> Result<Vec<String>, MatchError> {
    let asked = program.work.join("request.txt");
    let words = described(request);
    if database.is_file() && std::fs::read_to_string(&asked).is_ok_and(|before| before == words) {
        return Ok(vec!["features and matches of the last run were kept".to_owned()]);
    }
    let stale = [asked.clone(), database.to_owned(), program.log(EXTRACTOR), program.log(MATCHER)];
    for path in stale.iter().filter(|path| path.exists()) {
        std::fs::remove_file(path).map_err(|e| MatchError::unwritten(path, &e))?;
    }
    let mut notes = Vec::new();
    let mut failure = None;
    let mut done = 0;
    for (lens, group) in request.problem.lenses.iter().enumerate() {
        let photos = || request.problem.photos.iter().zip(request.files).filter(|(photo, _)| photo.lens == lens);
        if photos().count() == 0 {
            continue;
        }
        let list = program.work.join(format!("photos-{}.txt", lens + 1));
        let text: String = photos().map(|(_, file)| format!("{file}\n")).collect();
        std::fs::write(&list, text).map_err(|e| MatchError::unwritten(&list, &e))?;
        let (intrinsics, free) = told(group, None);
        let model = LensModel::of(&intrinsics, free);
        let parameters = model.parameters(&intrinsics).iter().map(f64::to_string).collect::<Vec<_>>().join(",");
        let mut arguments: Vec<Argument<'_>> = vec![
            ("--database_path", database.as_os_str()),
            ("--image_path", request.folder.as_os_str()),
            ("--image_list_path", list.as_os_str()),
            ("--ImageReader.single_camera", OsStr::new("1")),
            ("--ImageReader.camera_model", OsStr::new(model.name_and_number().0)),
        ];
        // Without parameters COLMAP looks for a focal length itself, and does not trust what it guesses.
        if group.focal != Focal::Free {
            arguments.push(("--ImageReader.camera_params", OsStr::new(&parameters)));
        }
        match program.feature_step(EXTRACTOR, &arguments, "Extraction", &[]) {
            Ok(()) => done += 1,
            Err(error @ MatchError::Step { .. }) => {
                notes.push(error.to_string());
                failure = Some(error);
            }
            Err(error) => return Err(error),
        }
    }
    match failure {
        Some(error) if done == 0 => return Err(error),
        Some(_) => {}
        None => std::fs::write(&asked, words).map_err(|e| MatchError::unwritten(&asked, &e))?,
    }
    Ok(notes)
}

/// Matches all pairs. A matcher that fails half way has kept what it had: that is told, and used.
pub(super) fn match_all(program: &mut Program<'_>, request: &Request<'_>, database: &Path) -> Result<(), MatchError> {
    let guided: &[Argument<'_>] =
        if request.files.len() <= MOST_GUIDED { &[("guided_matching", OsStr::new("1"))] } else { &[] };
    program.feature_step(MATCHER, &[("--database_path", database.as_os_str())], "Matching", guided)
}

/// What features depend on: photographs, their sizes and times, and lenses.
fn described(request: &Request<'_>) -> String {
    let mut text = String::new();
    for (photo, file) in request.problem.photos.iter().zip(request.files) {
        let data = std::fs::metadata(request.folder.join(file)).ok();
        let time = data.as_ref().and_then(|d| d.modified().ok()).and_then(|t| t.duration_since(std::time::UNIX_EPOCH).ok());
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{file}: {:?} bytes, {time:?}, lens {}", data.map(|d| d.len()), photo.lens);
    }
    for group in &request.problem.lenses {
        let _ = writeln!(text, "lens: {:?} {:?} {:?}", group.focal, told(group, None), freed(group));
    }
    text
}

/// What the log says of each photograph. COLMAP ends well where it cannot read one.
pub(super) fn extracted(log: &str) -> Vec<Extracted> {
    let mut all: Vec<Extracted> = Vec::new();
    let mut at = None;
    for line in log.lines() {
        // `Name:            north/a b.jpg`; from glog of later versions with a date and `] ` before it
        let line = line.split_once("] ").filter(|(before, _)| !before.contains('[')).map_or(line, |(_, words)| words).trim();
        // A new run begins: what it complains of first is its own.
        if line.starts_with("$ colmap") {
            at = None;
        }
        let Some((key, value)) = line.split_once(':') else { continue };
        let value = value.trim();
        if key == "Name" {
            // Of two attempts the second skips what the first has done.
            at = all.iter().position(|e| e.file == value);
            if at.is_none() {
                at = Some(all.len());
                all.push(Extracted { file: value.to_owned(), ..Extracted::default() });
            }
            continue;
        }
        let Some(now) = at.and_then(|at| all.get_mut(at)) else { continue };
        match key {
            "Camera" => now.camera = value.trim_start_matches('#').split_whitespace().next().and_then(|n| n.parse().ok()),
            "Features" => now.features = value.split_whitespace().next().and_then(|n| n.parse().ok()).unwrap_or(0),
            "ERROR" => now.error = Some(value.to_owned()),
            _ => {}
        }
    }
    all
}

/// Where COLMAP keeps features and matches.
pub(super) fn database(work: &Path) -> PathBuf {
    work.join("database.db")
}
