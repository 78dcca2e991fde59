//! kapture's text files: `sensors/sensors.txt`, `records_camera.txt`, `trajectories.txt`.

use super::colmap;
use super::text::{fault, number, numbers, read_text};
use super::{FormatError, ImportedCamera, ImportedCameras};
use crate::camera::{Camera, Intrinsics, Pose};
use glam::{DQuat, DVec3};
use std::collections::BTreeMap;
use std::path::Path;

/// Reads a data set's folder. Its lens models are COLMAP's. Points are not read: kapture keeps their pixels in files of a type of their own.
///
/// # Errors
/// Where a file is missing or broken, or a lens has a model that ours cannot express.
pub fn read(folder: &Path) -> Result<ImportedCameras, FormatError> {
    let sensors = folder.join("sensors");
    let mut all = ImportedCameras::default();
    if sensors.join("rigs.txt").is_file() {
        all.notes.push("rigs are not read: only cameras with trajectories of their own".to_owned());
    }
    let mut lenses: BTreeMap<String, (u64, Intrinsics)> = BTreeMap::new();
    rows(&sensors.join("sensors.txt"), &mut |path, line, words| {
        if words.get(2) != Some(&"camera") {
            return Ok(());
        }
        let model = words.get(3).ok_or_else(|| fault(path, line, "the camera's model is missing"))?;
        let (width, height) = (number(path, line, words, 4, "width")?, number(path, line, words, 5, "height")?);
        let parameters =
            (6..words.len()).map(|i| number(path, line, words, i, "a parameter")).collect::<Result<Vec<f64>, _>>()?;
        let lens = colmap::lens(model, width, height, &parameters).map_err(|what| fault(path, line, what))?;
        let id = lenses.len() as u64;
        lenses.insert(words[0].to_owned(), (id, lens));
        Ok(())
    })?;
    let mut poses: BTreeMap<(String, String), Pose> = BTreeMap::new();
    rows(&sensors.join("trajectories.txt"), &mut |path, line, words| {
        if words.len() < 9 || words[2..9].iter().any(|w| w.is_empty()) {
            // A pose may lack its turn or its place; such cameras cannot be used.
            return Ok(());
        }
        let [w, x, y, z, tx, ty, tz] = numbers(path, line, words, 2, "the pose")?;
        let rotation = DQuat::from_xyzw(x, y, z, w);
        if !(rotation.length_squared() > 0.25) {
            return Err(fault(path, line, "the rotation is not a quaternion"));
        }
        let pose = Pose { rotation: rotation.normalize(), translation: DVec3::new(tx, ty, tz) };
        poses.insert((words[0].to_owned(), words[1].to_owned()), pose);
        Ok(())
    })?;
    rows(&sensors.join("records_camera.txt"), &mut |path, line, words| {
        let &[time, device, name, ..] = words else {
            return Err(fault(path, line, "expected timestamp, device_id, image_path"));
        };
        let key = (time.to_owned(), device.to_owned());
        match (lenses.get(device), poses.get(&key)) {
            (Some((lens, intrinsics)), Some(pose)) => all.cameras.push(ImportedCamera {
                name: name.to_owned(),
                lens: *lens,
                camera: Camera { intrinsics: *intrinsics, pose: *pose },
                centred: false,
            }),
            _ => all.notes.push(format!("{name} has no camera in the data set")),
        }
        Ok(())
    })?;
    Ok(all)
}

type Row<'r> = &'r mut dyn FnMut(&Path, usize, &[&str]) -> Result<(), FormatError>;

fn rows(path: &Path, each: Row<'_>) -> Result<(), FormatError> {
    let text = read_text(path)?;
    for (index, line) in text.lines().enumerate() {
        if line.trim_start().starts_with('#') || line.trim().is_empty() {
            continue;
        }
        let words: Vec<&str> = line.split(',').map(str::trim).collect();
        each(path, index + 1, &words)?;
    }
    Ok(())
}
