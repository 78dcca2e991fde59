//! Being guided: from one of the site's rooms to the next, a while in each, and again from the first.

use super::pose::Pose;
use heliodon_bundle::Manifest;

/// Seconds in each room.
const STAY_S: f32 = 12.0;
/// Metres a second between rooms, where that does not take too long.
const PACE_M_S: f32 = 3.0;
/// The shortest and the longest way between rooms, seconds.
const WAY_S: (f32, f32) = (4.0, 20.0);

/// Where a visitor is on the way round.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Tour {
    /// The pose it came from, once it has begun.
    from: Option<Pose>,
    room: usize,
    seconds: f32,
}

/// Slow at both ends.
fn eased(part: f32) -> f32 {
    let t = part.clamp(0.0, 1.0);
    t * t * t * (t * (6.0 * t - 15.0) + 10.0)
}

fn between(from: Pose, to: Pose, part: f32) -> Pose {
    let turn = (to.yaw_rad - from.yaw_rad + std::f32::consts::PI).rem_euclid(std::f32::consts::TAU) - std::f32::consts::PI;
    Pose {
        eye: from.eye.lerp(to.eye, part),
        yaw_rad: from.yaw_rad + turn * part,
        pitch_rad: from.pitch_rad + (to.pitch_rad - from.pitch_rad) * part,
    }
}

impl Tour {
    /// Where the visitor is after `seconds` more, who was at `now`; `None` where the site has no rooms.
    pub(super) fn step(&mut self, manifest: &Manifest, now: Pose, seconds: f32) -> Option<Pose> {
        let rooms = &manifest.rooms;
        let to = Pose::in_room(manifest, rooms.get(self.room % rooms.len().max(1))?);
        let from = *self.from.get_or_insert(now);
        let way_s = (from.eye.distance(to.eye) / PACE_M_S).clamp(WAY_S.0, WAY_S.1);
        self.seconds += seconds;
        if self.seconds >= way_s + STAY_S {
            *self = Self { from: Some(to), room: (self.room + 1) % rooms.len(), seconds: 0.0 };
            return Some(to);
        }
        Some(between(from, to, eased(self.seconds / way_s)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;
    use std::f32::consts::PI;

    #[test]
    fn the_shorter_way_round_is_turned() {
        let pose = |yaw_rad: f32| Pose { eye: Vec3::ZERO, yaw_rad, pitch_rad: 0.0 };
        let half = between(pose(0.9 * PI), pose(-0.9 * PI), 0.5);
        assert!((half.yaw_rad - PI).abs() < 1e-5, "{half:?}");
    }

    #[test]
    fn it_begins_and_ends_slowly() {
        assert_eq!((eased(0.0), eased(1.0), eased(2.0)), (0.0, 1.0, 1.0));
        assert!(eased(0.01) < 1e-4 && (eased(0.5) - 0.5).abs() < 1e-6);
    }
}
