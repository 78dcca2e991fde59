//! COLMAP's cameras, adjusted by ours.

use super::features::freed;
use super::{MatchError, Request};
use crate::camera::Intrinsics;
use crate::formats::{ImportedCamera, ImportedCameras, ImportedPoint, colmap_write};
use crate::solve::bundle::Free;
use crate::solve::{
    Focal, LensGroup, Mark, MarkResult, Params, Photo, Problem, Reference, Solution, Start, refine, with_focal,
};
use std::path::Path;

/// The folder of the adjusted model, in COLMAP's.
pub(super) const FOLDER: &str = "refined";

/// Adjusts a model: its cameras with the points and marks that fit, and the solution for the request's photographs.
pub(super) fn refined(request: &Request<'_>, found: &ImportedCameras) -> (ImportedCameras, Solution) {
    let lenses: Vec<LensGroup> =
        request.problem.lenses.iter().map(|group| LensGroup { free: freed(group), ..group.clone() }).collect();
    let photos = request.problem.photos.iter().map(|photo| Photo { pose: None, ..photo.clone() }).collect();
    let mut start = Start {
        lenses: lenses.iter().map(|group| group.intrinsics).collect(),
        poses: vec![None; request.files.len()],
        points: Vec::with_capacity(found.points.len()),
    };
    let index_of: Vec<Option<usize>> =
        found.cameras.iter().map(|camera| request.files.iter().position(|file| *file == camera.name)).collect();
    for (camera, photo) in found.cameras.iter().zip(&index_of) {
        let Some(photo) = *photo else { continue };
        start.poses[photo] = Some(camera.camera.pose);
        let lens = request.problem.photos[photo].lens;
        start.lenses[lens] = started(&lenses[lens], &camera.camera.intrinsics);
    }
    let mut problem = Problem { lenses, photos, ..Problem::default() };
    for (index, point) in found.points.iter().enumerate() {
        problem.points.push(Reference { name: format!("match {index}"), known_m: None, ground: false });
        start.points.push(Some(point.position));
        let mut seen: Vec<Mark> = (point.seen.iter())
            .filter_map(|(camera, pixel)| Some(Mark { photo: index_of[*camera]?, point: index, pixel: *pixel }))
            .collect();
        // COLMAP may have merged two features of one photograph into a point.
        seen.sort_by_key(|mark| mark.photo);
        seen.dedup_by_key(|mark| mark.photo);
        problem.marks.append(&mut seen);
    }
    let solution = refine(&problem, &start, &Params::default());
    (told(request, &problem, &solution), solution)
}

/// What a lens starts from: COLMAP's, but for what was told.
fn started(group: &LensGroup, found: &Intrinsics) -> Intrinsics {
    let focal = match group.focal {
        Focal::Known(px) => px,
        Focal::Guess(_) | Focal::Free => found.focal_px[0],
    };
    let told = with_focal(&group.intrinsics, focal);
    let radial = if group.free.radial > 0 { found.radial } else { told.radial };
    let tangential = if group.free.tangential { found.tangential } else { told.tangential };
    let centre_px = if group.free.centre { found.centre_px } else { told.centre_px };
    Intrinsics { radial, tangential, centre_px, ..told }
}

/// The solution as a model of COLMAP's, without the marks that do not fit.
fn told(request: &Request<'_>, problem: &Problem, solution: &Solution) -> ImportedCameras {
    let mut model = ImportedCameras::default();
    let mut number = vec![0; request.files.len()];
    for (photo, file) in request.files.iter().enumerate() {
        let Some(camera) = solution.camera(photo) else { continue };
        number[photo] = model.cameras.len();
        let lens = problem.photos[photo].lens as u64 + 1;
        model.cameras.push(ImportedCamera { name: file.clone(), lens, camera, centred: false });
    }
    let mut seen = vec![Vec::new(); problem.points.len()];
    for (mark, result) in problem.marks.iter().zip(&solution.marks) {
        if matches!(result, MarkResult::Used(_)) {
            seen[mark.point].push((number[mark.photo], mark.pixel));
        }
    }
    for (point, seen) in seen.into_iter().enumerate() {
        model.points.extend(solution.position_m(point).map(|position| ImportedPoint { position, seen }));
    }
    model
}

/// Writes the model beside and renames it into place, so that a crash leaves the old one or the new.
pub(super) fn write(folder: &Path, model: &ImportedCameras) -> Result<(), MatchError> {
    let beside = folder.with_extension("new");
    let fault = |e: std::io::Error| MatchError::unwritten(folder, &e);
    colmap_write::write(&beside, model, Free::default())?;
    if folder.is_dir() {
        std::fs::remove_dir_all(folder).map_err(fault)?;
    }
    std::fs::rename(&beside, folder).map_err(fault)
}
