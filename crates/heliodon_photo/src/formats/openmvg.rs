//! OpenMVG's `sfm_data.json`, as the cereal library writes it.

use super::text::{fault, read_text};
use super::{FormatError, ImportedCamera, ImportedCameras, ImportedPoint};
use crate::camera::{Camera, Intrinsics, Pose};
use glam::{DMat3, DQuat, DVec2, DVec3};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::Path;

/// Reads a scene.
///
/// # Errors
/// Where the file is missing or broken, or a lens has a model that ours cannot express.
pub fn read(path: &Path) -> Result<ImportedCameras, FormatError> {
    let text = read_text(path)?;
    let root: Value = serde_json::from_str(&text).map_err(|e| fault(path, e.line(), e.to_string()))?;
    let list = |key: &str| root[key].as_array().map_or(&[][..], Vec::as_slice);
    let wrong = |what: String| fault(path, 0, what);
    let mut lenses = BTreeMap::new();
    // A type is named where it first comes up; later its number stands alone, without the topmost bit.
    let mut names: BTreeMap<u64, String> = BTreeMap::new();
    for entry in list("intrinsics") {
        let id = entry["key"].as_u64().ok_or_else(|| wrong("an intrinsic has no key".to_owned()))?;
        let value = &entry["value"];
        let number = value["polymorphic_id"].as_u64().unwrap_or(0) & 0x7fff_ffff;
        if let Some(name) = value["polymorphic_name"].as_str() {
            names.insert(number, name.to_owned());
        }
        let model = names.get(&number).map_or("", String::as_str);
        let lens = lens(model, &value["ptr_wrapper"]["data"]).map_err(|what| wrong(format!("intrinsic {id}: {what}")))?;
        lenses.insert(id, lens);
    }
    let mut poses = BTreeMap::new();
    for entry in list("extrinsics") {
        let rows: Option<Vec<DVec3>> =
            entry["value"]["rotation"].as_array().map(|rows| rows.iter().filter_map(vector).collect());
        let centre = vector(&entry["value"]["center"]);
        let (Some(id), Some([a, b, c]), Some(centre)) = (entry["key"].as_u64(), rows.as_deref(), centre) else {
            return Err(wrong("an extrinsic lacks its key, rotation or center".to_owned()));
        };
        let rotation = DQuat::from_mat3(&DMat3::from_cols(*a, *b, *c).transpose()).normalize();
        if !rotation.is_finite() {
            return Err(wrong(format!("extrinsic {id} is not a rotation")));
        }
        poses.insert(id, Pose::from_centre(rotation, centre));
    }
    let mut all = ImportedCameras::default();
    let mut index_of = BTreeMap::new();
    for entry in list("views") {
        let data = &entry["value"]["ptr_wrapper"]["data"];
        let name = data["filename"].as_str().unwrap_or_default().to_owned();
        let (lens, pose) = (data["id_intrinsic"].as_u64(), data["id_pose"].as_u64());
        let found = (lens.and_then(|l| lenses.get(&l)), pose.and_then(|p| poses.get(&p)));
        let (Some(intrinsics), Some(pose)) = found else {
            all.notes.push(format!("{name} has no camera in the scene"));
            continue;
        };
        if let Some(id) = data["id_view"].as_u64() {
            index_of.insert(id, all.cameras.len());
        }
        let camera = Camera { intrinsics: *intrinsics, pose: *pose };
        all.cameras.push(ImportedCamera { name, lens: lens.unwrap_or(0), camera, centred: false });
    }
    for entry in list("structure") {
        let Some(position) = vector(&entry["value"]["X"]) else { continue };
        let place = |o: &Value| {
            let pixel = o["value"]["x"].as_array()?;
            let index = *index_of.get(&o["key"].as_u64()?)?;
            Some((index, DVec2::new(pixel.first()?.as_f64()?, pixel.get(1)?.as_f64()?)))
        };
        let seen = entry["value"]["observations"].as_array().map_or(&[][..], Vec::as_slice).iter().filter_map(place).collect();
        all.points.push(ImportedPoint { position, seen });
    }
    Ok(all)
}

fn vector(value: &Value) -> Option<DVec3> {
    let list = value.as_array()?;
    Some(DVec3::new(list.first()?.as_f64()?, list.get(1)?.as_f64()?, list.get(2)?.as_f64()?))
}

fn lens(model: &str, data: &Value) -> Result<Intrinsics, String> {
    let size = |key: &str| data[key].as_u64().and_then(|n| u32::try_from(n).ok()).ok_or(format!("{key} is missing"));
    let focal = data["focal_length"].as_f64().filter(|f| *f > 0.0).ok_or("focal_length is missing")?;
    let mut lens = Intrinsics::pinhole(size("width")?, size("height")?, focal);
    let list = |key: &str| -> Vec<f64> {
        data[key].as_array().map(|all| all.iter().filter_map(Value::as_f64).collect()).unwrap_or_default()
    };
    if let [x, y] = list("principal_point")[..] {
        lens.centre_px = [x, y];
    }
    match (model, &list("disto_k1")[..], &list("disto_k3")[..], &list("disto_t2")[..]) {
        ("pinhole", ..) => {}
        ("pinhole_radial_k1", [k], ..) => lens.radial = [*k, 0.0, 0.0],
        ("pinhole_radial_k3", _, [k1, k2, k3], _) => lens.radial = [*k1, *k2, *k3],
        ("pinhole_brown_t2", _, _, [k1, k2, k3, t1, t2]) => {
            lens.radial = [*k1, *k2, *k3];
            lens.tangential = [*t1, *t2];
        }
        ("pinhole_radial_k1" | "pinhole_radial_k3" | "pinhole_brown_t2", ..) => {
            return Err(format!("{model} lacks its distortion"));
        }
        _ => return Err(format!("lens model {model} is not supported: undistort the photographs")),
    }
    Ok(lens)
}
