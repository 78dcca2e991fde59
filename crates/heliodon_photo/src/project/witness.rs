//! What a solved project hands on to its model: who looks, and what was marked.

use super::Project;
use crate::camera::Camera;
use crate::formats::cameras_file::CamerasFile;
use crate::model::NamedPoint;
use glam::{DMat3, DVec3};

/// Photographs with their cameras, and points where they were found.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Witnesses {
    /// Those that were solved, by the names that marks call them by, in the project's order.
    pub photographs: Vec<(String, Camera)>,
    /// The file of each, from the project's folder.
    pub files: Vec<String>,
    /// Points that were solved.
    pub points: Vec<NamedPoint>,
}

impl Project {
    /// What `cameras` knows of the project's photographs and points.
    #[must_use]
    pub fn witnesses(&self, cameras: &CamerasFile) -> Witnesses {
        let mut found = Witnesses::default();
        for photo in &self.file.photo {
            let solved = cameras.photos.iter().find(|record| record.name == photo.name());
            if let Some(camera) = solved.and_then(|record| record.camera.as_ref()?.camera()) {
                found.photographs.push((photo.name().to_owned(), camera));
                found.files.push(photo.file.clone());
            }
        }
        for record in &cameras.points {
            let Some(position) = record.position_m.map(DVec3::from) else { continue };
            // known exactly where nothing is said
            let [xx, xy, xz, yy, yz, zz] = record.covariance_m2.unwrap_or_default();
            let covariance = DMat3::from_cols_array(&[xx, xy, xz, xy, yy, yz, xz, yz, zz]);
            let marked = self.file.point.iter().find(|point| point.name == record.name);
            let sees = |name: &String| marked.is_some_and(|point| point.marks.contains_key(name));
            let seen_in = found.photographs.iter().enumerate().filter(|(_, (name, _))| sees(name)).map(|(i, _)| i).collect();
            found.points.push(NamedPoint { name: record.name.clone(), position, covariance, seen_in });
        }
        found
    }
}
