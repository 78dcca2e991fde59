//! Plain projection matrices: a line a photograph, its name before the twelve numbers of P row by row, or before the 21 of K, R and t (as in
//! Middlebury's `_par.txt`).

use super::text::{fault, numbers, read_text};
use super::{FormatError, ImportedCamera, ImportedCameras};
use crate::camera::{Camera, Intrinsics, Pose};
use glam::{DMat3, DQuat, DVec3};
use std::path::Path;

/// How far rows of pixels may lean: above a thousandth of the focal length no real sensor does, and something else is wrong.
const MAX_SKEW: f64 = 1e-3;

/// Reads a file of matrices; sizes of photographs are not in it.
///
/// # Errors
/// Where the file is missing or broken, or a matrix is not that of a camera with upright pixels.
pub fn read(path: &Path) -> Result<ImportedCameras, FormatError> {
    let text = read_text(path)?;
    let mut all = ImportedCameras::default();
    for (index, content) in text.lines().enumerate() {
        let line = index + 1;
        let words: Vec<&str> = content.split_whitespace().collect();
        // A first line may count the others.
        if words.len() < 2 || words[0].starts_with('#') {
            continue;
        }
        let camera = match words.len() {
            13 => {
                let p: [f64; 12] = numbers(path, line, &words, 1, "the matrix")?;
                from_matrix(&p)
            }
            22 => {
                let k: [f64; 9] = numbers(path, line, &words, 1, "K")?;
                let r: [f64; 9] = numbers(path, line, &words, 10, "R")?;
                let t: [f64; 3] = numbers(path, line, &words, 19, "t")?;
                let row = |m: &[f64; 9], i: usize| DVec3::new(m[3 * i], m[3 * i + 1], m[3 * i + 2]);
                let [a, b] = [&k, &r].map(|m| DMat3::from_cols(row(m, 0), row(m, 1), row(m, 2)).transpose());
                let (m, t) = (a * b, a * DVec3::from(t));
                let row = |i: usize| [m.row(i).x, m.row(i).y, m.row(i).z, t[i]];
                let [x, y, z] = [row(0), row(1), row(2)];
                from_matrix(&std::array::from_fn(|i| [x, y, z][i / 4][i % 4]))
            }
            n => return Err(fault(path, line, format!("a name and 12 or 21 numbers are expected, not {} numbers", n - 1))),
        };
        let camera = camera.map_err(|what| fault(path, line, what))?;
        all.cameras.push(ImportedCamera {
            name: words[0].to_owned(),
            lens: lens_number(&all, &camera),
            camera,
            centred: false,
        });
    }
    Ok(all)
}

/// Photographs whose lens values agree to a thousandth of a pixel share it.
fn lens_number(all: &ImportedCameras, camera: &Camera) -> u64 {
    let values = |c: &Camera| [c.intrinsics.focal_px, c.intrinsics.centre_px].concat();
    let close = |c: &&ImportedCamera| values(&c.camera).iter().zip(values(camera)).all(|(a, b)| (a - b).abs() < 1e-3);
    all.cameras.iter().find(close).map_or(all.cameras.len() as u64, |c| c.lens)
}

/// The camera of a projection matrix, its rows one after another: P = K [R t] up to a factor (RQ decomposition).
///
/// # Errors
/// Where it is not the matrix of a camera before which things lie, or its pixels lean.
pub fn from_matrix(p: &[f64; 12]) -> Result<Camera, String> {
    let row = |i: usize| DVec3::new(p[4 * i], p[4 * i + 1], p[4 * i + 2]);
    let rows = [row(0), row(1), row(2)];
    let determinant = rows[0].dot(rows[1].cross(rows[2]));
    if !(determinant.abs() > 0.0) || !determinant.is_finite() {
        return Err("the matrix is singular: no camera has it".to_owned());
    }
    // A matrix counts up to its factor; the sign is such that the rotation is one.
    let sign = determinant.signum();
    let [m1, m2, m3] = rows.map(|r| r * sign);
    let last = DVec3::new(p[3], p[7], p[11]) * sign;
    let k33 = m3.length();
    let r3 = m3 / k33;
    let k23 = m2.dot(r3);
    let rest = m2 - k23 * r3;
    let k22 = rest.length();
    let r2 = rest / k22;
    let (k13, k12) = (m1.dot(r3), m1.dot(r2));
    let rest = m1 - k13 * r3 - k12 * r2;
    let k11 = rest.length();
    let r1 = rest / k11;
    let focal_px = [k11 / k33, k22 / k33];
    if !focal_px.iter().all(|f| *f > 0.0 && f.is_finite()) {
        return Err("the matrix has no focal length".to_owned());
    }
    if (k12 / k33).abs() > MAX_SKEW * focal_px[0] {
        return Err(format!("the matrix has a skew of {:.2} px, which no lens here has", k12 / k33));
    }
    let t3 = last.z / k33;
    let t2 = (last.y - k23 * t3) / k22;
    let t1 = (last.x - k12 * t2 - k13 * t3) / k11;
    let rotation = DQuat::from_mat3(&DMat3::from_cols(r1, r2, r3).transpose()).normalize();
    let intrinsics = Intrinsics { focal_px, centre_px: [k13 / k33, k23 / k33], ..Intrinsics::pinhole(0, 0, focal_px[0]) };
    Ok(Camera { intrinsics, pose: Pose { rotation, translation: DVec3::new(t1, t2, t3) } })
}
