//! Where a body is and how it is turned.

use crate::rotation;
use glam::{Quat, Vec3};
use serde::{Deserialize, Serialize};
use std::ops::Mul;

/// The farthest that a coordinate of a tracked body may be from the origin, metres: no room is larger, and what is beyond is a
/// slip of the tracker.
pub const FARTHEST_M: f32 = 1000.0;

/// Position and orientation of a body in a space: `room_from_body` unless a name says otherwise. A body's own axes are +X
/// right, +Y up, +Z backwards: a head looks, and a wand points, along its -Z.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Written", into = "Written")]
pub struct Pose {
    /// The body's origin, metres.
    pub position: Vec3,
    /// Turns directions of the body into those of the space; of length one.
    pub orientation: Quat,
}

impl Default for Pose {
    fn default() -> Self {
        Self::IDENTITY
    }
}

impl Pose {
    /// At the origin, not turned.
    pub const IDENTITY: Self = Self { position: Vec3::ZERO, orientation: Quat::IDENTITY };

    /// A pose with its orientation brought to length one, or nothing where the position is not finite or has a coordinate
    /// beyond [`FARTHEST_M`], or the orientation is no rotation (see [`rotation::unit`]).
    #[must_use]
    pub fn new(position: Vec3, orientation: Quat) -> Option<Self> {
        let near = position.to_array().iter().all(|c| c.abs() <= FARTHEST_M);
        let orientation = rotation::unit(orientation)?;
        near.then_some(Self { position, orientation })
    }

    /// The pose as [`Pose::new`] would make it, or nothing where it cannot be one.
    #[must_use]
    pub fn checked(self) -> Option<Self> {
        Self::new(self.position, self.orientation)
    }

    /// Whether every number is finite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.position.is_finite() && self.orientation.is_finite()
    }

    /// The pose that undoes this one: `body_from_room`.
    #[must_use]
    pub fn inverse(&self) -> Self {
        let orientation = self.orientation.conjugate();
        Self { position: orientation * -self.position, orientation }
    }

    /// The place in the space of a point of the body.
    #[must_use]
    pub fn point(&self, p_body: Vec3) -> Vec3 {
        self.position + self.orientation * p_body
    }

    /// The way to `other`: at 0 (or below, or NaN) this pose, at 1 (or above) the other; straight, and turning evenly the
    /// shorter way.
    #[must_use]
    pub fn interpolate(&self, other: &Self, t: f32) -> Self {
        let t = if t > 0.0 { t.min(1.0) } else { 0.0 };
        Self {
            position: self.position + (other.position - self.position) * t,
            orientation: rotation::slerp(self.orientation, other.orientation, t),
        }
    }
}

/// `a_from_b * b_from_c`.
impl Mul for Pose {
    type Output = Self;

    fn mul(self, b_from_c: Self) -> Self {
        // many products in a row would wear the length down
        let orientation = self.orientation * b_from_c.orientation;
        Self { position: self.point(b_from_c.position), orientation: rotation::unit(orientation).unwrap_or(orientation) }
    }
}

/// How a body moves in the room.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Velocity {
    /// Of its origin, metres a second.
    pub linear_m_s: Vec3,
    /// The axis about which it turns, counter-clockwise seen from the axis' tip, times radians a second.
    pub angular_rad_s: Vec3,
}

/// A pose as it stands in files.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Written {
    /// Metres.
    #[serde(default)]
    position: [f32; 3],
    /// x, y, z, w.
    #[serde(default = "not_turned")]
    orientation: [f32; 4],
}

fn not_turned() -> [f32; 4] {
    Quat::IDENTITY.to_array()
}

impl TryFrom<Written> for Pose {
    type Error = String;

    fn try_from(written: Written) -> Result<Self, String> {
        Self::new(written.position.into(), Quat::from_array(written.orientation)).ok_or_else(|| {
            format!(
                "position {:?} with orientation {:?} is no pose; write metres up to {FARTHEST_M} and a quaternion x, y, z, w of length 1",
                written.position, written.orientation
            )
        })
    }
}

impl From<Pose> for Written {
    fn from(pose: Pose) -> Self {
        Self { position: pose.position.into(), orientation: pose.orientation.into() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_finite_poses_within_a_kilometre_are_poses() {
        assert!(Pose::new(Vec3::splat(FARTHEST_M), Quat::IDENTITY).is_some());
        for wrong in [Vec3::splat(FARTHEST_M * 1.01), Vec3::NAN, Vec3::new(0.0, f32::INFINITY, 0.0)] {
            assert_eq!(Pose::new(wrong, Quat::IDENTITY), None);
        }
        assert_eq!(Pose::new(Vec3::ZERO, Quat::from_xyzw(0.0, 0.0, 0.0, 0.0)), None);
        assert_eq!(Pose::new(Vec3::X, Quat::IDENTITY * 0.9), Some(Pose { position: Vec3::X, ..Pose::IDENTITY }));
    }

    #[test]
    fn a_pose_times_its_inverse_is_nothing() {
        let pose = Pose { position: Vec3::new(1.0, 2.0, 3.0), orientation: rotation::from_vector(Vec3::new(0.3, 2.0, -0.5)) };
        for product in [pose * pose.inverse(), pose.inverse() * pose] {
            assert!(product.position.length() < 1e-5 && rotation::to_vector(product.orientation).length() < 1e-5);
        }
        let p = Vec3::new(-0.4, 0.2, 9.0);
        assert!((pose.inverse().point(pose.point(p)) - p).length() < 1e-5);
    }

    #[test]
    fn halfway_is_in_the_middle_and_turned_by_half() {
        let turned = Pose { position: Vec3::X, orientation: rotation::from_vector(Vec3::Y) };
        let middle = Pose::IDENTITY.interpolate(&turned, 0.5);
        assert!((middle.position - Vec3::X * 0.5).length() < 1e-6);
        assert!((rotation::to_vector(middle.orientation) - Vec3::Y * 0.5).length() < 1e-6);
        assert_eq!(Pose::IDENTITY.interpolate(&turned, f32::NAN), Pose::IDENTITY);
    }

    #[test]
    fn poses_in_files_are_checked() {
        let read = |text: &str| serde_json::from_str::<Pose>(text);
        assert_eq!(read("{}").unwrap(), Pose::IDENTITY);
        let pose = read(r#"{"position": [0, 1.5, 0], "orientation": [0, 1, 0, 0]}"#).unwrap();
        assert_eq!(read(&serde_json::to_string(&pose).unwrap()).unwrap(), pose);
        let error = read(r#"{"orientation": [0, 0, 0, 0]}"#).unwrap_err().to_string();
        assert!(error.contains("quaternion"), "{error}");
    }
}
