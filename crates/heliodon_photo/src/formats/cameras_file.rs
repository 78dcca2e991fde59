//! `cameras.json`: what was solved, for models, textures and other programs.

use crate::camera::{Camera, Intrinsics, Pose};
use crate::solve::{MarkResult, PhotoResult, PointResult, Problem, Solution, worst_sigma};
use glam::{DMat3, DQuat, DVec3};
use serde::{Deserialize, Serialize};

/// The name of the file beside the project.
pub const CAMERAS_FILE_NAME: &str = "cameras.json";

/// What the file calls itself.
const FORMAT: &str = "heliodon-cameras";

/// The version that is written.
const VERSION: u32 = 1;

/// The file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CamerasFile {
    /// `heliodon-cameras`.
    pub format: String,
    /// 1.
    pub version: u32,
    /// Whether lengths are metres; without, they are relative.
    pub metric: bool,
    /// The standard deviation of a mark's coordinate.
    pub sigma_px: f64,
    /// Photographs, in the project's order.
    pub photos: Vec<PhotoRecord>,
    /// Points, in the project's order.
    pub points: Vec<PointRecord>,
    /// Marks that were found wrong, the worst first, in words.
    pub wrong_marks: Vec<String>,
    /// Every mark that was compared.
    pub residuals: Vec<ResidualRecord>,
    /// What the whole rests on and how well that is met.
    pub checks: Vec<CheckRecord>,
    /// What else is to be said.
    pub notes: Vec<String>,
}

/// A photograph.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PhotoRecord {
    /// Its name.
    pub name: String,
    /// Its camera.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera: Option<CameraRecord>,
    /// Why it has none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unsolved: Option<String>,
    /// Marks that were used.
    pub marks: usize,
    /// The root of the mean squared residual.
    pub rms_px: f64,
    /// The standard deviation of its place along the worst direction.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub place_sigma_m: Option<f64>,
    /// The standard deviation of its turn about the worst axis.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub turn_sigma_deg: Option<f64>,
    /// The standard deviation of its focal length, 0 where it was held.
    pub focal_sigma_px: f64,
}

/// A camera: x_c = R x_w + t, +X right, +Y down, +Z ahead; pixel centres at half-integers.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CameraRecord {
    /// Width and height.
    pub size_px: [u32; 2],
    /// Along x and y.
    pub focal_px: [f64; 2],
    /// The principal point.
    pub centre_px: [f64; 2],
    /// k1, k2, k3.
    pub radial: [f64; 3],
    /// p1, p2.
    pub tangential: [f64; 2],
    /// R as a quaternion x, y, z, w.
    pub rotation: [f64; 4],
    /// t.
    pub translation_m: [f64; 3],
}

impl From<&Camera> for CameraRecord {
    fn from(camera: &Camera) -> Self {
        let Intrinsics { width, height, focal_px, centre_px, radial, tangential } = camera.intrinsics;
        let Pose { rotation, translation } = camera.pose;
        Self {
            size_px: [width, height],
            focal_px,
            centre_px,
            radial,
            tangential,
            rotation: rotation.to_array(),
            translation_m: translation.to_array(),
        }
    }
}

impl CameraRecord {
    /// The camera; `None` where its numbers are not those of one.
    #[must_use]
    pub fn camera(&self) -> Option<Camera> {
        let rotation = DQuat::from_array(self.rotation);
        let numbers = [&self.focal_px[..], &self.centre_px, &self.radial, &self.tangential, &self.translation_m].concat();
        let whole = numbers.iter().all(|n| n.is_finite()) && self.focal_px.iter().all(|f| *f > 0.0);
        (whole && rotation.length_squared() > 0.25).then(|| Camera {
            intrinsics: Intrinsics {
                width: self.size_px[0],
                height: self.size_px[1],
                focal_px: self.focal_px,
                centre_px: self.centre_px,
                radial: self.radial,
                tangential: self.tangential,
            },
            pose: Pose { rotation: rotation.normalize(), translation: DVec3::from(self.translation_m) },
        })
    }
}

/// A point.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PointRecord {
    /// Its name.
    pub name: String,
    /// Where it is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub position_m: Option<[f64; 3]>,
    /// Why that is not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unsolved: Option<String>,
    /// xx, xy, xz, yy, yz, zz of its covariance.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub covariance_m2: Option<[f64; 6]>,
    /// Marks that were used.
    pub marks: usize,
    /// The root of the mean squared residual.
    pub rms_px: f64,
}

/// A mark and how far the point's picture lies from it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ResidualRecord {
    /// The point's name.
    pub point: String,
    /// The photograph's name.
    pub photo: String,
    /// From the mark to the picture.
    pub off_px: [f64; 2],
    /// Whether it was found wrong and left out.
    pub wrong: bool,
}

/// How well something known is met.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CheckRecord {
    /// What.
    pub what: String,
    /// By how much it is missed.
    pub off: f64,
    /// In which unit.
    pub unit: String,
}

impl CamerasFile {
    /// The record of a solution.
    #[must_use]
    pub fn new(problem: &Problem, solution: &Solution) -> Self {
        let photos = problem.photos.iter().zip(&solution.photos).map(|(photo, result)| {
            let name = photo.name.clone();
            match result {
                PhotoResult::Solved(s) => PhotoRecord {
                    name,
                    camera: Some(CameraRecord::from(&s.camera)),
                    unsolved: None,
                    marks: s.marks,
                    rms_px: s.rms_px,
                    place_sigma_m: s.centre_covariance_m2.as_ref().map(worst_sigma),
                    turn_sigma_deg: s.rotation_sigma_rad.map(f64::to_degrees),
                    focal_sigma_px: solution.lenses[photo.lens].sigmas[0],
                },
                PhotoResult::Unsolved(why) => PhotoRecord {
                    name,
                    camera: None,
                    unsolved: Some(why.clone()),
                    marks: 0,
                    rms_px: 0.0,
                    place_sigma_m: None,
                    turn_sigma_deg: None,
                    focal_sigma_px: 0.0,
                },
            }
        });
        let points = problem.points.iter().zip(&solution.points).map(|(point, result)| {
            let name = point.name.clone();
            match result {
                PointResult::Solved(s) => PointRecord {
                    name,
                    position_m: Some(s.position_m.to_array()),
                    unsolved: None,
                    covariance_m2: s.covariance_m2.map(|c| upper(&c)),
                    marks: s.marks,
                    rms_px: s.rms_px,
                },
                PointResult::Unsolved(why) => PointRecord {
                    name,
                    position_m: None,
                    unsolved: Some(why.clone()),
                    covariance_m2: None,
                    marks: 0,
                    rms_px: 0.0,
                },
            }
        });
        let residuals = problem.marks.iter().zip(&solution.marks).filter_map(|(mark, result)| {
            let (off, wrong) = match result {
                MarkResult::Used(off) => (off, false),
                MarkResult::Wrong(off) => (off, true),
                MarkResult::Idle => return None,
            };
            Some(ResidualRecord {
                point: problem.points[mark.point].name.clone(),
                photo: problem.photos[mark.photo].name.clone(),
                off_px: off.to_array(),
                wrong,
            })
        });
        let checks = solution.alignment.checks.iter();
        Self {
            format: FORMAT.to_owned(),
            version: VERSION,
            metric: solution.alignment.scale_from.is_some(),
            sigma_px: solution.sigma_px,
            photos: photos.collect(),
            points: points.collect(),
            wrong_marks: solution.wrong_marks(problem),
            residuals: residuals.collect(),
            checks: checks.map(|c| CheckRecord { what: c.what.clone(), off: c.off, unit: c.unit.to_owned() }).collect(),
            notes: solution.notes.clone(),
        }
    }

    /// The file's text, ending in a line's end.
    ///
    /// # Errors
    /// Where a number cannot be written.
    pub fn text(&self) -> Result<String, String> {
        serde_json::to_string_pretty(self).map(|text| text + "\n").map_err(|e| e.to_string())
    }

    /// Reads the file's text.
    ///
    /// # Errors
    /// Where it is another file, or of a later version, or a camera in it is none.
    pub fn parse(text: &str) -> Result<Self, String> {
        let file: Self = serde_json::from_str(text).map_err(|e| format!("this is not a cameras.json: {e}"))?;
        if file.format != FORMAT || file.version != VERSION {
            return Err(format!(
                "this is {} version {}, and {FORMAT} version {VERSION} is read here",
                file.format, file.version
            ));
        }
        for photo in &file.photos {
            if photo.camera.is_some_and(|c| c.camera().is_none()) {
                return Err(format!("the camera of {} has numbers that no camera has", photo.name));
            }
        }
        Ok(file)
    }
}

fn upper(c: &DMat3) -> [f64; 6] {
    [c.x_axis.x, c.y_axis.x, c.z_axis.x, c.y_axis.y, c.z_axis.y, c.z_axis.z]
}
