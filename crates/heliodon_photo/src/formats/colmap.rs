//! COLMAP's sparse models: `cameras`, `images`, `points3D`, as `.txt` or `.bin`.

use super::text::{fault, number, numbers, read_text};
use super::{FormatError, ImportedCamera, ImportedCameras, ImportedPoint, colmap_binary};
use crate::camera::{Camera, Intrinsics, Pose};
use glam::{DQuat, DVec2, DVec3};
use std::collections::BTreeMap;
use std::path::Path;

/// An image as COLMAP stores it.
pub(super) struct Image {
    pub(super) id: u32,
    /// w, x, y, z and the translation.
    pub(super) pose: [f64; 7],
    pub(super) camera: u32,
    pub(super) name: String,
    pub(super) pixels: Vec<DVec2>,
}

/// A point as COLMAP stores it.
pub(super) struct Track {
    pub(super) position: DVec3,
    /// Image, and which of its pixels.
    pub(super) seen: Vec<(u32, u32)>,
}

/// Reads a sparse model's folder; binary files come before text ones, as in COLMAP.
///
/// # Errors
/// Where a file is missing or broken, or a lens has a model that ours cannot express.
pub fn read(folder: &Path) -> Result<ImportedCameras, FormatError> {
    let (lenses, images, tracks) = if folder.join("cameras.bin").is_file() {
        (colmap_binary::cameras(folder)?, colmap_binary::images(folder)?, colmap_binary::points(folder)?)
    } else {
        (cameras_text(folder)?, images_text(folder)?, points_text(folder)?)
    };
    let mut all = ImportedCameras::default();
    let mut index_of = BTreeMap::new();
    for image in &images {
        let Some(lens) = lenses.get(&image.camera) else {
            return Err(fault(
                folder,
                0,
                format!("{} has camera {}, which is not among the cameras", image.name, image.camera),
            ));
        };
        let [w, x, y, z, tx, ty, tz] = image.pose;
        let rotation = DQuat::from_xyzw(x, y, z, w);
        if !(rotation.length_squared() > 0.25) {
            return Err(fault(folder, 0, format!("the rotation of {} is not a quaternion", image.name)));
        }
        index_of.insert(image.id, all.cameras.len());
        all.cameras.push(ImportedCamera {
            name: image.name.clone(),
            lens: u64::from(image.camera),
            camera: Camera {
                intrinsics: *lens,
                pose: Pose { rotation: rotation.normalize(), translation: DVec3::new(tx, ty, tz) },
            },
            centred: false,
        });
    }
    for track in tracks {
        let place = |(image, at): &(u32, u32)| {
            let index = *index_of.get(image)?;
            Some((index, *images[index].pixels.get(*at as usize)?))
        };
        all.points.push(ImportedPoint { position: track.position, seen: track.seen.iter().filter_map(place).collect() });
    }
    Ok(all)
}

/// The names of COLMAP's models, by their numbers in binary files, and how many parameters each has.
pub(super) const MODELS: [(&str, usize); 11] = [
    ("SIMPLE_PINHOLE", 3),
    ("PINHOLE", 4),
    ("SIMPLE_RADIAL", 4),
    ("RADIAL", 5),
    ("OPENCV", 8),
    ("OPENCV_FISHEYE", 8),
    ("FULL_OPENCV", 12),
    ("FOV", 5),
    ("SIMPLE_RADIAL_FISHEYE", 4),
    ("RADIAL_FISHEYE", 5),
    ("THIN_PRISM_FISHEYE", 12),
];

/// A lens of one of the models that ours can express, or why not.
pub(super) fn lens(model: &str, width: u32, height: u32, p: &[f64]) -> Result<Intrinsics, String> {
    let wanted = MODELS.iter().find(|(name, _)| *name == model).map(|(_, n)| *n);
    if wanted.is_some_and(|n| n != p.len()) {
        return Err(format!("{model} has {} parameters, not {}", wanted.unwrap_or(0), p.len()));
    }
    let base = |fx: f64, fy: f64, cx: f64, cy: f64| Intrinsics {
        focal_px: [fx, fy],
        centre_px: [cx, cy],
        ..Intrinsics::pinhole(width, height, fx)
    };
    let lens = match (model, p) {
        ("SIMPLE_PINHOLE", &[f, cx, cy]) => base(f, f, cx, cy),
        ("PINHOLE", &[fx, fy, cx, cy]) => base(fx, fy, cx, cy),
        ("SIMPLE_RADIAL", &[f, cx, cy, k]) => Intrinsics { radial: [k, 0.0, 0.0], ..base(f, f, cx, cy) },
        ("RADIAL", &[f, cx, cy, k1, k2]) => Intrinsics { radial: [k1, k2, 0.0], ..base(f, f, cx, cy) },
        ("OPENCV", &[fx, fy, cx, cy, k1, k2, p1, p2]) => {
            Intrinsics { radial: [k1, k2, 0.0], tangential: [p1, p2], ..base(fx, fy, cx, cy) }
        }
        ("FULL_OPENCV", &[fx, fy, cx, cy, k1, k2, p1, p2, k3, k4, k5, k6]) => {
            if [k4, k5, k6] != [0.0; 3] {
                return Err("FULL_OPENCV with k4, k5 or k6 is not supported: undistort the photographs, or solve with OPENCV"
                    .to_owned());
            }
            Intrinsics { radial: [k1, k2, k3], tangential: [p1, p2], ..base(fx, fy, cx, cy) }
        }
        _ => {
            return Err(format!(
                "lens model {model} is not supported: undistort the photographs (colmap image_undistorter), or solve with OPENCV"
            ));
        }
    };
    if lens.focal_px.iter().all(|f| *f > 0.0 && f.is_finite()) { Ok(lens) } else { Err("a focal length is above 0".to_owned()) }
}

fn lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    text.lines().enumerate().map(|(i, line)| (i + 1, line)).filter(|(_, line)| !line.trim_start().starts_with('#'))
}

fn cameras_text(folder: &Path) -> Result<BTreeMap<u32, Intrinsics>, FormatError> {
    let path = folder.join("cameras.txt");
    let text = read_text(&path)?;
    let mut all = BTreeMap::new();
    for (line, content) in lines(&text) {
        let words: Vec<&str> = content.split_whitespace().collect();
        if words.is_empty() {
            continue;
        }
        let id = number(&path, line, &words, 0, "CAMERA_ID")?;
        let (width, height) = (number(&path, line, &words, 2, "WIDTH")?, number(&path, line, &words, 3, "HEIGHT")?);
        let parameters =
            (4..words.len()).map(|i| number(&path, line, &words, i, "a parameter")).collect::<Result<Vec<f64>, _>>()?;
        let lens = lens(words[1], width, height, &parameters).map_err(|what| fault(&path, line, what))?;
        all.insert(id, lens);
    }
    Ok(all)
}

fn images_text(folder: &Path) -> Result<Vec<Image>, FormatError> {
    let path = folder.join("images.txt");
    let text = read_text(&path)?;
    let mut all: Vec<Image> = Vec::new();
    let mut rest = lines(&text);
    while let Some((line, content)) = rest.next() {
        let words: Vec<&str> = content.split_whitespace().collect();
        if words.is_empty() {
            continue;
        }
        let id = number(&path, line, &words, 0, "IMAGE_ID")?;
        let pose = numbers(&path, line, &words, 1, "the pose")?;
        let camera = number(&path, line, &words, 8, "CAMERA_ID")?;
        let name = words.get(9..).filter(|w| !w.is_empty()).ok_or_else(|| fault(&path, line, "NAME is missing"))?.join(" ");
        // The second line of an image is its points; it may be empty.
        let mut pixels = Vec::new();
        if let Some((line, content)) = rest.next() {
            let words: Vec<&str> = content.split_whitespace().collect();
            for at in (0..words.len()).step_by(3) {
                let [x, y] = numbers(&path, line, &words, at, "a point's pixel")?;
                pixels.push(DVec2::new(x, y));
            }
        }
        all.push(Image { id, pose, camera, name, pixels });
    }
    Ok(all)
}

fn points_text(folder: &Path) -> Result<Vec<Track>, FormatError> {
    let path = folder.join("points3D.txt");
    if !path.is_file() {
        return Ok(Vec::new());
    }
    let text = read_text(&path)?;
    let mut all = Vec::new();
    for (line, content) in lines(&text) {
        let words: Vec<&str> = content.split_whitespace().collect();
        if words.is_empty() {
            continue;
        }
        let position = DVec3::from(numbers::<3>(&path, line, &words, 1, "a point's place")?);
        let mut seen = Vec::new();
        for at in (8..words.len()).step_by(2) {
            seen.push((number(&path, line, &words, at, "IMAGE_ID")?, number(&path, line, &words, at + 1, "POINT2D_IDX")?));
        }
        all.push(Track { position, seen });
    }
    Ok(all)
}
