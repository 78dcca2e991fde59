//! Cameras and points by COLMAP's mapper.

use super::features::{Extracted, told};
use super::program::{Argument, Program};
use super::{MatchError, Request, refined};
use crate::camera::Intrinsics;
use crate::formats::colmap_write::write_lenses;
use crate::formats::{ImportedCameras, colmap};
use crate::solve::bundle::Free;
use crate::solve::{Focal, with_focal};
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

/// COLMAP's step that maps.
pub(super) const MAPPER: &str = "mapper";

/// Focal lengths to hold, in widths of the photograph (the longer side's): a lens that is off by a third still brings all photographs together, and
/// the one that fits best is where the adjustment starts from.
const HELD: [f64; 4] = [0.7, 1.2, 2.0, 3.2];

/// What the mapper made.
#[derive(Debug, Default)]
pub(super) struct Maps {
    /// Models, the one with most photographs first.
    pub(super) all: Vec<ImportedCameras>,
    /// How many separate models the first attempt made.
    pub(super) models: usize,
}

impl Maps {
    pub(super) fn best(&self) -> Option<&ImportedCameras> {
        self.all.first().filter(|model| model.cameras.len() >= 2)
    }

    fn registered(&self) -> usize {
        self.best().map_or(0, |model| model.cameras.len())
    }
}

/// Maps what is matched. The mapper moves focal lengths from its first two photographs on, and two tell a focal length badly: where none is
/// known, and few photographs come together, it is held at a few guesses instead, and moved afterwards.
pub(super) fn map(
    program: &mut Program<'_>,
    request: &Request<'_>,
    database: &Path,
    photos: &[Extracted],
    notes: &mut Vec<String>,
) -> Result<Maps, MatchError> {
    let (sparse, snapshots) = (program.work.join("sparse"), program.work.join("snapshots"));
    // A map of another day would be read for this one's.
    let log = program.log(MAPPER);
    if log.exists() {
        std::fs::remove_file(&log).map_err(|e| MatchError::unwritten(&log, &e))?;
    }
    for folder in [&sparse, &snapshots] {
        emptied(folder)?;
    }
    let known = request.problem.lenses.iter().all(|lens| matches!(lens.focal, Focal::Known(_)));
    let straight = request.problem.lenses.iter().all(|lens| lens.free.radial == 0);
    let every = (request.files.len() / 10).max(5).to_string();
    let arguments: Vec<Argument<'_>> = vec![
        ("--database_path", database.as_os_str()),
        ("--image_path", request.folder.as_os_str()),
        ("--output_path", sparse.as_os_str()),
        ("--Mapper.ba_refine_focal_length", OsStr::new(if known { "0" } else { "1" })),
        ("--Mapper.ba_refine_extra_params", OsStr::new(if straight { "0" } else { "1" })),
        // Beside a photograph of another place a model of fewer than ten would be thrown away, and all begun anew with another pair.
        ("--Mapper.min_model_size", OsStr::new("2")),
        // What there is if the mapper does not come to its end.
        ("--Mapper.snapshot_path", snapshots.as_os_str()),
        ("--Mapper.snapshot_images_freq", OsStr::new(&every)),
    ];
    let mut failure = None;
    let mut maps = Maps::default();
    match program.step(MAPPER, &arguments) {
        Ok(()) => maps.all = read_all(&sparse, notes),
        Err(error @ MatchError::Step { .. }) => {
            maps.all = read_all(&sparse, notes);
            if maps.all.is_empty() {
                maps.all = read_all(&snapshots, notes);
                maps.all.truncate(1);
            }
            failure = Some(error).filter(|error| !is_empty_handed(error));
        }
        Err(error) => return Err(error),
    }
    maps.models = maps.all.len();
    if !known && 2 * maps.registered() < request.files.len() {
        let held = hold(program, request, database, photos, notes)?;
        if let Some(held) = held.filter(|held| held.cameras.len() > maps.registered()) {
            notes.push(
                "COLMAP's mapper could not tell the focal length: it was held at guesses, and the best one adjusted; better give it, or \
                 photographs with EXIF"
                    .to_owned(),
            );
            maps = Maps { all: vec![held], models: 1 };
            failure = None;
        }
    }
    match failure {
        Some(error) if maps.best().is_none() => return Err(error),
        Some(error) => notes.push(format!("{error}; what it had mapped by then was taken")),
        None => {}
    }
    std::fs::remove_dir_all(&snapshots).map_err(|e| MatchError::unwritten(&snapshots, &e))?;
    Ok(maps)
}

/// Whether the mapper came to its end and had nothing.
fn is_empty_handed(error: &MatchError) -> bool {
    matches!(error, MatchError::Step { why, .. } if why.contains("failed to create sparse model"))
}

/// Maps with lenses held: at every guess, then once more at what the adjustment makes of the best.
fn hold(
    program: &mut Program<'_>,
    request: &Request<'_>,
    database: &Path,
    photos: &[Extracted],
    notes: &mut Vec<String>,
) -> Result<Option<ImportedCameras>, MatchError> {
    let Some(lenses) = lenses_of_database(request, photos) else { return Ok(None) };
    let guess = |lens: usize, factor: f64| {
        let group = &request.problem.lenses[lens];
        let Intrinsics { width, height, .. } = group.intrinsics;
        let held = matches!(group.focal, Focal::Known(_));
        told(group, (!held).then(|| factor * f64::from(width.max(height)))).0
    };
    let mut best: Option<ImportedCameras> = None;
    let rank = |map: &ImportedCameras| (map.cameras.len(), -map.rms_px().unwrap_or(f64::INFINITY));
    for factor in HELD {
        let held: Vec<Intrinsics> = lenses.iter().map(|lens| guess(*lens, factor)).collect();
        if let Some(map) = map_held(program, request, database, &held, notes)?
            && best.as_ref().is_none_or(|best| rank(&map) > rank(best))
        {
            best = Some(map);
        }
    }
    let Some(best) = best else { return Ok(None) };
    let (_, solution) = refined::refined(request, &best);
    let held: Vec<Intrinsics> = lenses
        .iter()
        .map(|lens| {
            let found = solution.lenses[*lens].intrinsics;
            let [k1, k2, _] = found.radial;
            Intrinsics { radial: [k1, k2, 0.0], ..with_focal(&found, found.focal_px[0]) }
        })
        .collect();
    let again = map_held(program, request, database, &held, notes)?;
    Ok(Some(again.filter(|again| rank(again) >= rank(&best)).unwrap_or(best)))
}

fn map_held(
    program: &mut Program<'_>,
    request: &Request<'_>,
    database: &Path,
    lenses: &[Intrinsics],
    notes: &mut Vec<String>,
) -> Result<Option<ImportedCameras>, MatchError> {
    let (start, sparse) = (program.work.join("held"), program.work.join("sparse-held"));
    emptied(&start)?;
    emptied(&sparse)?;
    let lenses: Vec<(Intrinsics, Free)> = lenses.iter().map(|lens| (*lens, Free { radial: 2, ..Free::default() })).collect();
    write_lenses(&start, &lenses)?;
    let arguments: Vec<Argument<'_>> = vec![
        ("--database_path", database.as_os_str()),
        ("--image_path", request.folder.as_os_str()),
        ("--input_path", start.as_os_str()),
        ("--output_path", sparse.as_os_str()),
        ("--Mapper.min_model_size", OsStr::new("2")),
        ("--Mapper.ba_refine_focal_length", OsStr::new("0")),
        ("--Mapper.ba_refine_extra_params", OsStr::new("0")),
    ];
    match program.step(MAPPER, &arguments) {
        Ok(()) | Err(MatchError::Step { .. }) => Ok(read_all(&sparse, notes).into_iter().next()),
        Err(error) => Err(error),
    }
}

/// Which of the request's lenses each of the database's is, in the order of their numbers; `None` where the log does not tell.
fn lenses_of_database(request: &Request<'_>, photos: &[Extracted]) -> Option<Vec<usize>> {
    let count = photos.iter().filter_map(|p| p.camera).max()?;
    (1..=count)
        .map(|number| {
            let photo = photos.iter().find(|p| p.camera == Some(number))?;
            let index = request.files.iter().position(|file| *file == photo.file)?;
            Some(request.problem.photos[index].lens)
        })
        .collect()
}

/// A folder with nothing in it.
fn emptied(folder: &Path) -> Result<(), MatchError> {
    if folder.is_dir() {
        std::fs::remove_dir_all(folder).map_err(|e| MatchError::unwritten(folder, &e))?;
    }
    std::fs::create_dir_all(folder).map_err(|e| MatchError::unwritten(folder, &e))
}

/// The models in a folder or in the folders within it, the one with most photographs first; of equal ones the one with more points. What
/// cannot be read is noted: a program that was stopped may have left half of one.
fn read_all(folder: &Path, notes: &mut Vec<String>) -> Vec<ImportedCameras> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().filter_map(Result::ok);
    let mut folders: Vec<PathBuf> = entries.map(|entry| entry.path()).filter(|path| path.is_dir()).collect();
    folders.sort();
    folders.insert(0, folder.to_owned());
    let mut all = Vec::new();
    for folder in folders.iter().filter(|f| ["cameras.bin", "cameras.txt"].iter().any(|name| f.join(name).is_file())) {
        match colmap::read(folder) {
            Ok(model) => all.push(model),
            Err(error) => notes.push(format!("a model was left out: {error}")),
        }
    }
    all.sort_by_key(|model| std::cmp::Reverse((model.cameras.len(), model.points.len())));
    all
}
