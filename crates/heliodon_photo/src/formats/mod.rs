//! Cameras from and for other programs.
//!
//! | module | what it reads |
//! | --- | --- |
//! | [`colmap`] | a sparse model's folder, text or binary |
//! | [`colmap_write`] | the same, written |
//! | [`bundler`] | Bundler's `.out` |
//! | [`openmvg`] | OpenMVG's `sfm_data.json` |
//! | [`kapture`] | kapture's text files |
//! | [`projection`] | plain projection matrices, Middlebury's `_par.txt` |
//! | [`cameras_file`] | Heliodon's own `cameras.json`, written and read |
//!
//! COLMAP's pixel centres lie at half-integers as ours do. The others do not say where theirs lie, and are taken as they are: half a pixel, where
//! it matters, goes into the principal point.

pub mod bundler;
pub mod cameras_file;
pub mod colmap;
mod colmap_binary;
pub mod colmap_write;
pub mod kapture;
pub mod openmvg;
pub mod projection;
mod text;

use crate::camera::{Camera, Intrinsics};
use crate::project::{CameraFormat, CamerasEntry};
use glam::{DVec2, DVec3};
use std::path::Path;

/// A camera that another program solved.
#[derive(Clone, Debug, PartialEq)]
pub struct ImportedCamera {
    /// The photograph's name, as that program has it.
    pub name: String,
    /// Which lens, among those of one import.
    pub lens: u64,
    /// The camera; its width and height are 0 where the file does not tell them.
    pub camera: Camera,
    /// True where the file tells no principal point: it is the photograph's middle.
    pub centred: bool,
}

impl ImportedCamera {
    /// The lens for a photograph of a size.
    #[must_use]
    pub fn intrinsics(&self, size_px: [u32; 2]) -> Intrinsics {
        let [width, height] = size_px;
        let mut lens = Intrinsics { width, height, ..self.camera.intrinsics };
        if self.centred {
            lens.centre_px = [f64::from(width) / 2.0, f64::from(height) / 2.0];
        }
        lens
    }
}

/// A point that another program triangulated.
#[derive(Clone, Debug, PartialEq)]
pub struct ImportedPoint {
    /// Where it is, in that program's space.
    pub position: DVec3,
    /// Where it was seen: which of the cameras, and the pixel.
    pub seen: Vec<(usize, DVec2)>,
}

/// What another program solved.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ImportedCameras {
    /// Its cameras.
    pub cameras: Vec<ImportedCamera>,
    /// Its points.
    pub points: Vec<ImportedPoint>,
    /// What was left out, in words.
    pub notes: Vec<String>,
}

impl ImportedCameras {
    /// The root of the mean squared distance between points' pictures and where they were seen, in pixels; `None` without points.
    #[must_use]
    pub fn rms_px(&self) -> Option<f64> {
        let (mut count, mut sum) = (0usize, 0.0);
        for point in &self.points {
            for (camera, pixel) in &point.seen {
                if let Some(picture) = self.cameras.get(*camera).and_then(|c| c.camera.project(point.position)) {
                    count += 1;
                    sum += (picture - *pixel).length_squared();
                }
            }
        }
        (count > 0).then(|| (sum / count as f64).sqrt())
    }
}

/// What is wrong with a file of another program.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FormatError {
    /// The file cannot be read.
    #[error("{file}: {why}")]
    Read {
        /// Which file.
        file: String,
        /// The system's words.
        why: String,
    },
    /// The file cannot be written.
    #[error("{file}: {why}")]
    Write {
        /// Which file.
        file: String,
        /// The system's words.
        why: String,
    },
    /// Its content is not what it should be.
    #[error("{file}{}: {what}", line.map(|l| format!(":{l}")).unwrap_or_default())]
    Content {
        /// Which file.
        file: String,
        /// The line, counted from 1, of a text file.
        line: Option<usize>,
        /// What is wrong.
        what: String,
    },
}

/// Reads cameras that a project takes over. `photos` are the names of the project's photographs, for formats that have only their order.
///
/// # Errors
/// Where a file is missing or is not what its format says, or a lens has a model that ours cannot express.
pub fn read(folder: &Path, entry: &CamerasEntry, photos: &[String]) -> Result<ImportedCameras, FormatError> {
    let path = folder.join(&entry.file);
    match entry.format {
        CameraFormat::Colmap => colmap::read(&path),
        CameraFormat::Bundler => bundler::read(&path, photos),
        CameraFormat::Openmvg => openmvg::read(&path),
        CameraFormat::Kapture => kapture::read(&path),
        CameraFormat::Projection => projection::read(&path),
    }
}
