//! From a tracker's coordinates to the room's.
//!
//! `p_room = translation + rotation * (scale * M p_tracker)`, where M lays the tracker's axes along ours ([`Axes`]).
//! Orientations become `rotation * M R M^-1`.

mod axes;
mod eigen;
mod solve;

pub use axes::Axes;
pub use solve::{SolveError, SolveSettings, Solved, solve};

use crate::pose::Pose;
use crate::settings::{SettingsError, within};
use glam::{Quat, Vec3};
use serde::{Deserialize, Serialize};

/// `room_from_tracker`. As it comes, the tracker's coordinates are the room's.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "Written", into = "Written")]
pub struct Calibration {
    /// Which way the tracker's axes point.
    pub axes: Axes,
    /// Metres in the tracker's unit of length, from 1e-6 to 1e6: 0.01 for centimetres. DTrack's millimetres have become metres
    /// before: there it is 1.
    pub scale: f32,
    /// Turns what the axes are laid along into the room; of length one.
    pub rotation: Quat,
    /// Where the tracker's origin is in the room, metres.
    pub translation: Vec3,
}

impl Default for Calibration {
    fn default() -> Self {
        Self { axes: Axes::SAME, scale: 1.0, rotation: Quat::IDENTITY, translation: Vec3::ZERO }
    }
}

impl Calibration {
    /// A point of the tracker's in the room.
    #[must_use]
    pub fn point(&self, p_tracker: Vec3) -> Vec3 {
        self.translation + self.rotation * (self.axes.point(p_tracker) * self.scale)
    }

    /// An orientation of the tracker's in the room.
    #[must_use]
    pub fn orientation(&self, orientation: Quat) -> Quat {
        self.rotation * self.axes.rotation(orientation)
    }

    /// `room_from_target` of a `tracker_from_target`, unchecked: what is not finite stays so.
    #[must_use]
    pub fn pose(&self, tracker_from_target: &Pose) -> Pose {
        Pose {
            position: self.point(tracker_from_target.position),
            orientation: self.orientation(tracker_from_target.orientation),
        }
    }

    /// Checks the ranges.
    ///
    /// # Errors
    ///
    /// Where the scale is out of its range, or rotation and translation are no pose.
    pub fn validate(&self) -> Result<(), SettingsError> {
        within("scale", self.scale, 1e-6, 1e6)?;
        if Pose::new(self.translation, self.rotation).is_none() {
            let remedy = "give metres up to a kilometre and a quaternion of length 1, or solve it from pairs of points";
            return Err(SettingsError::new("rotation", "rotation and translation are no pose", remedy));
        }
        Ok(())
    }
}

/// A calibration as it stands in files.
#[derive(Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct Written {
    axes: Axes,
    scale: f32,
    /// x, y, z, w.
    rotation: [f32; 4],
    translation: [f32; 3],
}

impl Default for Written {
    fn default() -> Self {
        Calibration::default().into()
    }
}

impl From<Written> for Calibration {
    fn from(written: Written) -> Self {
        let rotation = Quat::from_array(written.rotation);
        Self {
            axes: written.axes,
            scale: written.scale,
            rotation: crate::rotation::unit(rotation).unwrap_or(rotation),
            translation: written.translation.into(),
        }
    }
}

impl From<Calibration> for Written {
    fn from(calibration: Calibration) -> Self {
        let Calibration { axes, scale, rotation, translation } = calibration;
        Self { axes, scale, rotation: rotation.into(), translation: translation.into() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rotation;

    #[test]
    fn points_are_laid_scaled_turned_and_moved_in_this_order() {
        let calibration = Calibration {
            axes: Axes::Z_UP,
            scale: 0.01,
            rotation: rotation::from_vector(Vec3::Y * std::f32::consts::FRAC_PI_2),
            translation: Vec3::new(0.0, 1.0, 0.0),
        };
        // 100 right, 200 forwards, 300 up; a quarter turn to the left takes right to forwards and forwards to left
        let p_room = calibration.point(Vec3::new(100.0, 200.0, 300.0));
        assert!((p_room - Vec3::new(-2.0, 4.0, -1.0)).length() < 1e-5, "{p_room}");
    }

    #[test]
    fn a_body_moves_with_its_tracker_for_all_axes() {
        // the point of a body must come out the same, be it taken to the room by the body's pose or by itself
        let tracker_from_body = Pose { position: Vec3::new(1.0, -2.0, 0.5), orientation: rotation::from_vector(Vec3::ONE) };
        let p_body = Vec3::new(0.1, 0.2, -0.3);
        for axes in Axes::all() {
            let calibration = Calibration { axes, rotation: rotation::from_vector(Vec3::Z), ..Calibration::default() };
            let by_itself = calibration.point(tracker_from_body.point(p_body));
            let by_pose = calibration.pose(&tracker_from_body).point(axes.point(p_body));
            assert!((by_itself - by_pose).length() < 1e-5, "{axes}");
        }
    }

    #[test]
    fn files_hold_plain_numbers() {
        let text = r#"{"axes": "x z -y", "translation": [0, 1.2, 0]}"#;
        let read: Calibration = serde_json::from_str(text).unwrap();
        assert_eq!(read, Calibration { axes: Axes::Z_UP, translation: Vec3::Y * 1.2, ..Calibration::default() });
        assert_eq!(serde_json::from_str::<Calibration>(&serde_json::to_string(&read).unwrap()).unwrap(), read);
        assert!(serde_json::from_str::<Calibration>(r#"{"axes": "x x y"}"#).unwrap_err().to_string().contains("x z -y"));
        let wrong: Calibration = serde_json::from_str(r#"{"rotation": [0, 0, 0, 0]}"#).unwrap();
        assert!(wrong.validate().is_err() && Calibration { scale: 0.0, ..Calibration::default() }.validate().is_err());
    }
}
