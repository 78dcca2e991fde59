//! Flicks of a tracked wand.

use super::{Flick, FlickDetector, FlickSettings, SILENCE_S};
use crate::rotation;
use glam::{Quat, Vec3};
use heliodon_math::frame::unit_or;

/// Finds flicks of a wand in how it turns, however it is rolled in the hand.
#[derive(Clone, Debug)]
pub struct WandFlickDetector {
    detector: FlickDetector,
    last_s: Option<f64>,
}

impl WandFlickDetector {
    /// A detector for which the hand has rested for long; lengths of the settings are radians ([`FlickSettings::wand`]).
    #[must_use]
    pub fn new(settings: FlickSettings) -> Self {
        Self { detector: FlickDetector::new(settings), last_s: None }
    }

    /// Takes the wand's orientation (`room_from_wand`, it points along its -Z) and how it turns, radians a second about an axis
    /// in the room ([`crate::follow::Follower::velocity`]), once a frame. Answers the flick that has just ended: left and right
    /// as seen by who points, up and down in the room. A turn about the wand itself is none.
    pub fn turn(&mut self, orientation: Quat, angular_rad_s: Vec3, seconds: f64) -> Option<Flick> {
        let orientation = rotation::unit(orientation)?;
        let dt_s = self.last_s.replace(seconds).map_or(0.0, |last_s| (seconds - last_s).clamp(0.0, SILENCE_S) as f32);
        let pointing = orientation * Vec3::NEG_Z;
        // a wand that points straight up has its right where its own is
        let right = unit_or(pointing.cross(Vec3::Y), orientation * Vec3::X);
        let up = right.cross(pointing);
        let moved = angular_rad_s.cross(pointing) * dt_s;
        self.detector.motion(moved.dot(right), -moved.dot(up), seconds)
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::reached;
    use super::*;
    use glam::Vec2;

    /// The flicks of a wand that points as `start` turns it and is turned about `axis` by an angle within a fifth of a second.
    fn wand_flicks(start: Quat, axis: Vec3, angle: f32) -> Vec<Flick> {
        let mut detector = WandFlickDetector::new(FlickSettings::wand());
        let turned = |t: f64| reached(Vec2::X * angle, 0.2, t - 0.3).x;
        let step = |i: i32| {
            let (before, t) = (f64::from(i - 1) / 60.0, f64::from(i) / 60.0);
            let rate = (turned(t) - turned(before)) * 60.0;
            detector.turn(rotation::from_vector(axis * turned(t)) * start, axis * rate, t)
        };
        (0..60).filter_map(step).collect()
    }

    #[test]
    fn wands_flick_in_the_room_however_they_are_rolled() {
        for facing in [0.0, 1.0, 2.5, -2.0] {
            for roll in [0.0, 1.2, 3.0] {
                let face = rotation::from_vector(Vec3::Y * facing);
                let start = face * rotation::from_vector(Vec3::Z * roll);
                // counter-clockwise seen from above is to the left
                assert_eq!(wand_flicks(start, Vec3::Y, 0.8), [Flick::Left]);
                assert_eq!(wand_flicks(start, Vec3::Y, -0.8), [Flick::Right]);
                assert_eq!(wand_flicks(start, face * Vec3::X, 0.8), [Flick::Up]);
                assert_eq!(wand_flicks(start, face * Vec3::X, -0.8), [Flick::Down]);
                assert_eq!(wand_flicks(start, face * Vec3::Z, 2.0), [], "a turn about itself");
                assert_eq!(wand_flicks(start, Vec3::Y, 0.2), [], "too little");
            }
        }
        assert!(!wand_flicks(rotation::from_vector(Vec3::X * std::f32::consts::FRAC_PI_2), Vec3::X, -0.8).is_empty());
    }
}
