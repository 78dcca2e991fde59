//! Sparse models for COLMAP and whatever else reads its files.
//!
//! Binary and not text: COLMAP ends a photograph's name at the first space where it reads text.

use super::{FormatError, ImportedCamera, ImportedCameras};
use crate::camera::Intrinsics;
use crate::solve::bundle::Free;
use glam::DVec2;
use std::path::Path;

/// The lens models of COLMAP that ours can be told in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LensModel {
    /// f, cx, cy.
    SimplePinhole,
    /// fx, fy, cx, cy.
    Pinhole,
    /// f, cx, cy, k1.
    SimpleRadial,
    /// f, cx, cy, k1, k2.
    Radial,
    /// fx, fy, cx, cy, k1, k2, p1, p2.
    OpenCv,
    /// The same with k3, and k4 to k6, which are 0.
    FullOpenCv,
}

impl LensModel {
    /// The smallest model that tells a lens and lets move what is free of its distortion.
    #[must_use]
    pub fn of(lens: &Intrinsics, free: Free) -> Self {
        let told = lens.radial.iter().rposition(|k| *k != 0.0).map_or(0, |last| last + 1);
        let radial = told.max(usize::from(free.radial));
        let tangential = free.tangential || lens.tangential != [0.0; 2];
        let oblong = lens.focal_px[0].to_bits() != lens.focal_px[1].to_bits();
        match radial {
            3.. => Self::FullOpenCv,
            _ if tangential || oblong && radial > 0 => Self::OpenCv,
            2 => Self::Radial,
            1 => Self::SimpleRadial,
            _ if oblong => Self::Pinhole,
            _ => Self::SimplePinhole,
        }
    }

    /// Its name and its number in binary files.
    #[must_use]
    pub fn name_and_number(self) -> (&'static str, u32) {
        match self {
            Self::SimplePinhole => ("SIMPLE_PINHOLE", 0),
            Self::Pinhole => ("PINHOLE", 1),
            Self::SimpleRadial => ("SIMPLE_RADIAL", 2),
            Self::Radial => ("RADIAL", 3),
            Self::OpenCv => ("OPENCV", 4),
            Self::FullOpenCv => ("FULL_OPENCV", 6),
        }
    }

    /// A lens's parameters in the model's order; what the model does not have is left out.
    #[must_use]
    pub fn parameters(self, lens: &Intrinsics) -> Vec<f64> {
        let Intrinsics { focal_px: [fx, fy], centre_px: [cx, cy], radial: [k1, k2, k3], tangential: [p1, p2], .. } = *lens;
        match self {
            Self::SimplePinhole => vec![fx, cx, cy],
            Self::Pinhole => vec![fx, fy, cx, cy],
            Self::SimpleRadial => vec![fx, cx, cy, k1],
            Self::Radial => vec![fx, cx, cy, k1, k2],
            Self::OpenCv => vec![fx, fy, cx, cy, k1, k2, p1, p2],
            Self::FullOpenCv => vec![fx, fy, cx, cy, k1, k2, p1, p2, k3, 0.0, 0.0, 0.0],
        }
    }
}

/// Writes a sparse model into a folder, which is made where it is not there. Lenses, photographs and points are numbered from 1 in their
/// order; `free` is what a program that goes on from there shall be able to move.
///
/// # Errors
/// Where the folder cannot be written to.
pub fn write(folder: &Path, model: &ImportedCameras, free: Free) -> Result<(), FormatError> {
    let mut lenses: Vec<(u64, Intrinsics)> = Vec::new();
    let mut lens_of = Vec::new();
    for ImportedCamera { lens, camera, .. } in &model.cameras {
        lens_of.push(lenses.iter().position(|(l, _)| l == lens).unwrap_or(lenses.len()));
        if lens_of.last() == Some(&lenses.len()) {
            lenses.push((*lens, camera.intrinsics));
        }
    }
    let mut seen: Vec<Vec<(DVec2, u64)>> = vec![Vec::new(); model.cameras.len()];
    let mut points = Bytes::counting(model.points.len());
    for (index, point) in model.points.iter().enumerate() {
        let id = index as u64 + 1;
        points.u64(id);
        points.all(&point.position.to_array());
        // Neither colour nor error is known.
        points.0.extend([128; 3]);
        points.all(&[-1.0]);
        points.u64(point.seen.len() as u64);
        for (camera, pixel) in &point.seen {
            points.u32(*camera as u32 + 1);
            points.u32(seen[*camera].len() as u32);
            seen[*camera].push((*pixel, id));
        }
    }
    let mut images = Bytes::counting(model.cameras.len());
    for (index, (camera, seen)) in model.cameras.iter().zip(&seen).enumerate() {
        let (q, t) = (camera.camera.pose.rotation, camera.camera.pose.translation);
        images.u32(index as u32 + 1);
        images.all(&[q.w, q.x, q.y, q.z, t.x, t.y, t.z]);
        images.u32(lens_of[index] as u32 + 1);
        images.0.extend(camera.name.bytes().chain([0]));
        images.u64(seen.len() as u64);
        for (pixel, point) in seen {
            images.all(&pixel.to_array());
            images.u64(*point);
        }
    }
    let lenses: Vec<(Intrinsics, Free)> = lenses.into_iter().map(|(_, lens)| (lens, free)).collect();
    write_files(folder, &[("cameras.bin", cameras(&lenses)), ("images.bin", images), ("points3D.bin", points)])
}

/// Writes a model that has lenses, numbered from 1, and nothing else: what COLMAP's mapper takes in place of its database's lenses.
///
/// # Errors
/// Where the folder cannot be written to.
pub fn write_lenses(folder: &Path, lenses: &[(Intrinsics, Free)]) -> Result<(), FormatError> {
    let none = || Bytes::counting(0);
    write_files(folder, &[("cameras.bin", cameras(lenses)), ("images.bin", none()), ("points3D.bin", none())])
}

fn cameras(lenses: &[(Intrinsics, Free)]) -> Bytes {
    let mut bytes = Bytes::counting(lenses.len());
    for (index, (lens, free)) in lenses.iter().enumerate() {
        let model = LensModel::of(lens, *free);
        bytes.u32(index as u32 + 1);
        bytes.u32(model.name_and_number().1);
        bytes.u64(u64::from(lens.width));
        bytes.u64(u64::from(lens.height));
        bytes.all(&model.parameters(lens));
    }
    bytes
}

fn write_files(folder: &Path, files: &[(&str, Bytes)]) -> Result<(), FormatError> {
    let fault =
        |path: &Path, error: std::io::Error| FormatError::Write { file: path.display().to_string(), why: error.to_string() };
    std::fs::create_dir_all(folder).map_err(|e| fault(folder, e))?;
    for (name, bytes) in files {
        let path = folder.join(name);
        std::fs::write(&path, &bytes.0).map_err(|e| fault(&path, e))?;
    }
    Ok(())
}

/// Little-endian numbers one after another.
struct Bytes(Vec<u8>);

impl Bytes {
    fn counting(count: usize) -> Self {
        Self((count as u64).to_le_bytes().to_vec())
    }

    fn u32(&mut self, number: u32) {
        self.0.extend(number.to_le_bytes());
    }

    fn u64(&mut self, number: u64) {
        self.0.extend(number.to_le_bytes());
    }

    fn all(&mut self, numbers: &[f64]) {
        self.0.extend(numbers.iter().flat_map(|n| n.to_le_bytes()));
    }
}
