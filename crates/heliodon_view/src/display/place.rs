//! Where the room with the screens stands in the site.

use crate::navigation::Visitor;
use glam::{Quat, Vec3};
use heliodon_bundle::display::DisplayFile;

/// The way from the room to the site: turned about the vertical, scaled, moved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WorldFromRoom {
    /// Where the room's origin is.
    pub origin: Vec3,
    /// How it is turned.
    pub rotation: Quat,
    /// Metres of the site for each of the room.
    pub scale: f32,
}

impl WorldFromRoom {
    /// The room of a display whose resting eye is where the visitor is.
    #[must_use]
    pub fn new(display: &DisplayFile, visitor: &Visitor) -> Self {
        let rotation = Quat::from_rotation_y(-visitor.pose.yaw_rad);
        let scale = display.place.scale as f32;
        Self { origin: visitor.pose.eye - rotation * (rest(display) * scale), rotation, scale }
    }

    /// A point of the room in the site.
    #[must_use]
    pub fn point(&self, in_room: Vec3) -> Vec3 {
        self.origin + self.rotation * (in_room * self.scale)
    }

    /// A point of the site in the room.
    #[must_use]
    pub fn to_room(&self, in_world: Vec3) -> Vec3 {
        self.rotation.inverse() * (in_world - self.origin) / self.scale
    }
}

/// Where the middle between the eyes rests, in the room.
#[must_use]
pub fn rest(display: &DisplayFile) -> Vec3 {
    Vec3::from(display.display.eye.map(|v| v as f32))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::navigation::pose::Pose;
    use heliodon_bundle::display::Preset;

    #[test]
    fn the_resting_eye_is_where_the_visitor_is() {
        let mut display = Preset::Flatworld.file();
        display.place.scale = 2.5;
        display.display.eye = [0.3, 1.6, -0.2];
        let pose = Pose { eye: Vec3::new(10.0, 3.0, -7.0), yaw_rad: 0.7, pitch_rad: 0.0 };
        let room = WorldFromRoom::new(&display, &Visitor { pose, ..Visitor::default() });
        assert!(room.point(rest(&display)).distance(pose.eye) < 1e-5);
        let ahead = room.point(rest(&display) + Vec3::NEG_Z) - pose.eye;
        assert!(ahead.distance(pose.rotation() * Vec3::NEG_Z * 2.5) < 1e-5);
        let point = Vec3::new(1.0, 2.0, 3.0);
        assert!(room.to_room(room.point(point)).distance(point) < 1e-5);
    }
}
