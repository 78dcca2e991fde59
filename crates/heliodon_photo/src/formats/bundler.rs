//! Bundler's `.out` (N. Snavely): cameras look along -Z with y up, pictures have their origin in the middle.

use super::text::{fault, read_text};
use super::{FormatError, ImportedCamera, ImportedCameras, ImportedPoint};
use crate::camera::{Camera, Intrinsics, Pose};
use glam::{DMat3, DQuat, DVec2, DVec3};
use std::path::Path;

/// Reads a bundle. Its cameras have no names: they are those of `photos`, in their order, and numbers beyond.
///
/// # Errors
/// Where the file is missing or broken.
pub fn read(path: &Path, photos: &[String]) -> Result<ImportedCameras, FormatError> {
    let text = read_text(path)?;
    let words: Vec<(usize, &str)> = (text.lines().enumerate())
        .filter(|(_, line)| !line.trim_start().starts_with('#'))
        .flat_map(|(i, line)| line.split_whitespace().map(move |word| (i + 1, word)))
        .collect();
    let mut at = 0;
    let mut next = || {
        let Some(&(line, word)) = words.get(at) else { return Err(fault(path, 0, "the file ends too early")) };
        at += 1;
        word.parse::<f64>()
            .ok()
            .filter(|v| v.is_finite())
            .ok_or_else(|| fault(path, line, format!("expected a number, not `{word}`")))
    };
    let cameras = next()? as usize;
    let points = next()? as usize;
    if cameras.saturating_mul(15).saturating_add(points.saturating_mul(7)) > words.len() {
        return Err(fault(path, 1, "the file is shorter than its counts say"));
    }
    let mut all = ImportedCameras::default();
    let mut index_of = vec![None; cameras];
    for index in 0..cameras {
        let [f, k1, k2] = [next()?, next()?, next()?];
        let mut rows = [DVec3::ZERO; 4];
        for row in &mut rows {
            *row = DVec3::new(next()?, next()?, next()?);
        }
        let name = photos.get(index).cloned().unwrap_or_else(|| format!("camera {index}"));
        let matrix = DMat3::from_cols(rows[0], rows[1], rows[2]).transpose();
        // Bundler writes zeros for photographs that it could not place.
        if !(f > 0.0) || !(matrix.determinant() > 0.5) {
            all.notes.push(format!("{name} has no camera in the bundle"));
            continue;
        }
        let flip = DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0));
        index_of[index] = Some(all.cameras.len());
        all.cameras.push(ImportedCamera {
            name,
            lens: index as u64,
            camera: Camera {
                intrinsics: Intrinsics { radial: [k1, k2, 0.0], ..Intrinsics::pinhole(0, 0, f) },
                pose: Pose { rotation: DQuat::from_mat3(&(flip * matrix)).normalize(), translation: flip * rows[3] },
            },
            centred: true,
        });
    }
    for _ in 0..points {
        let position = DVec3::new(next()?, next()?, next()?);
        for _ in 0..3 {
            next()?;
        }
        let count = next()? as usize;
        let mut seen = Vec::new();
        for _ in 0..count.min(words.len()) {
            let (camera, _, x, y) = (next()? as usize, next()?, next()?, next()?);
            if let Some(index) = index_of.get(camera).copied().flatten() {
                // from the middle, with y down as everywhere here
                seen.push((index, DVec2::new(x, -y)));
            }
        }
        all.points.push(ImportedPoint { position, seen });
    }
    Ok(all)
}
