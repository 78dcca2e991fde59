//! Where an eye is, and where it looks.

use bevy::prelude::Transform;
use glam::{DVec3, EulerRot, Quat, Vec3};
use heliodon_bundle::Manifest;
use heliodon_bundle::site::Room;
use heliodon_math::frame::unit_or;

/// The steepest look up or down: a hair short of straight, so that the heading stays defined.
pub(crate) const MAX_PITCH_RAD: f32 = 1.55;

/// An eye without roll.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Position in metres.
    pub eye: Vec3,
    /// Heading, clockwise from above, 0 along -Z.
    pub yaw_rad: f32,
    /// Up is positive.
    pub pitch_rad: f32,
}

impl Pose {
    /// An eye that looks at `target`; along -Z if the two are one.
    #[must_use]
    pub fn looking(eye: Vec3, target: Vec3) -> Self {
        let forward = unit_or(target - eye, Vec3::NEG_Z);
        Self {
            eye,
            yaw_rad: libm::atan2f(forward.x, -forward.z),
            pitch_rad: libm::asinf(forward.y.clamp(-1.0, 1.0)).clamp(-MAX_PITCH_RAD, MAX_PITCH_RAD),
        }
    }

    /// The rotation from view to world.
    #[must_use]
    pub fn rotation(&self) -> Quat {
        Quat::from_euler(EulerRot::YXZ, -self.yaw_rad, self.pitch_rad, 0.0)
    }

    /// The camera's transform.
    #[must_use]
    pub fn transform(&self) -> Transform {
        Transform { translation: self.eye, rotation: self.rotation(), ..Default::default() }
    }

    /// Where a visitor begins: in the middle of the first room, looking at what it looks at; without a room, at the first view that has a name; without
    /// either, outside, at a distance from which everything is in view.
    #[must_use]
    pub fn home(manifest: &Manifest) -> Self {
        let (low, high) = (Vec3::from(manifest.bounds.min), Vec3::from(manifest.bounds.max));
        let middle = (low + high) * 0.5;
        match (manifest.rooms.first(), manifest.living.views.first()) {
            (Some(room), _) => Self::in_room(manifest, room),
            (None, Some(view)) => Self::looking(DVec3::from(view.place).as_vec3(), DVec3::from(view.look_at).as_vec3()),
            (None, None) => {
                let radius = ((high - low).length() * 0.5).max(0.1);
                let half_fov = (fov_deg(manifest) * 0.5).to_radians();
                Self::looking(middle + Vec3::new(0.5, 0.35, 0.79) * (radius / libm::sinf(half_fov)), middle)
            }
        }
    }

    /// In the middle of a room, looking at what it looks at, or at the middle of everything.
    #[must_use]
    pub fn in_room(manifest: &Manifest, room: &Room) -> Self {
        let point = |at: [f64; 3]| Vec3::from(at.map(|v| v as f32));
        let middle = (Vec3::from(manifest.bounds.min) + Vec3::from(manifest.bounds.max)) * 0.5;
        Self::looking((point(room.min) + point(room.max)) * 0.5, room.looks_at.map_or(middle, point))
    }
}

/// The vertical opening angle that the site was prepared for.
#[must_use]
pub fn fov_deg(manifest: &Manifest) -> f32 {
    (manifest.display.fov_deg as f32).clamp(1.0, 170.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn poses_look_where_they_are_told() {
        for target in [Vec3::X, Vec3::NEG_X, Vec3::new(0.3, -0.5, 2.0), Vec3::new(-3.0, 1.0, -2.0)] {
            let pose = Pose::looking(Vec3::new(1.0, 2.0, 3.0), Vec3::new(1.0, 2.0, 3.0) + target);
            let forward = pose.rotation() * Vec3::NEG_Z;
            assert!((forward - unit_or(target, Vec3::X)).length() < 1e-5, "{target} {forward}");
            assert!((pose.rotation() * Vec3::X).y.abs() < 1e-6, "no roll");
        }
    }

    #[test]
    fn east_is_to_the_right_of_north() {
        assert!((Pose::looking(Vec3::ZERO, Vec3::X).yaw_rad - std::f32::consts::FRAC_PI_2).abs() < 1e-6);
    }
}
