//! Where an actor is: at its place, or somewhere on its path.

use glam::{Affine3A, Quat, Vec3};
use heliodon_bundle::site::Walk;
use heliodon_math::frame::unit_or;
use std::f32::consts::PI;

/// Metres before and behind a bend from which the way through it is turned.
const BEND_M: f32 = 0.35;
/// Seconds in which somebody turns round on the spot.
const TURN_S: f32 = 1.2;

/// The places of an actor over time.
#[derive(Clone, Debug, PartialEq)]
pub struct Course {
    points: Vec<Vec3>,
    /// Metres from the first point to each.
    metres: Vec<f32>,
    speed_m_s: f32,
    end: Walk,
    /// Turns the model about +Y, after it faces where it goes.
    turn_rad: f32,
}

impl Course {
    /// Stands at a place.
    #[must_use]
    pub fn stands(at: Vec3, turn_rad: f32) -> Self {
        Self { points: vec![at], metres: vec![0.0], speed_m_s: 0.0, end: Walk::Once, turn_rad }
    }

    /// Walks along points (not none) at so many metres a second.
    #[must_use]
    pub fn walks(mut points: Vec<Vec3>, speed_m_s: f32, end: Walk, turn_rad: f32) -> Self {
        points.dedup();
        if end == Walk::Circle && points.len() > 1 && points.first() != points.last() {
            points.push(points[0]);
        }
        let mut sum = 0.0;
        let step = |i: usize| if i == 0 { 0.0 } else { points[i].distance(points[i - 1]) };
        let metres = (0..points.len())
            .map(|i| {
                sum += step(i);
                sum
            })
            .collect();
        Self { points, metres, speed_m_s: speed_m_s.max(0.0), end, turn_rad }
    }

    /// From the model's space, in which +Z is forward, to the world, so many seconds after the beginning.
    #[must_use]
    pub fn at(&self, seconds: f32) -> Affine3A {
        let length = self.metres.last().copied().unwrap_or(0.0);
        if length <= 0.0 || self.speed_m_s <= 0.0 {
            let at = self.points.first().copied().unwrap_or_default();
            return Affine3A::from_rotation_translation(Quat::from_rotation_y(self.turn_rad), at);
        }
        let walk_s = length / self.speed_m_s;
        // how far along, whether on the way back, and how far turned round at the end
        let (metres, back, turned) = match self.end {
            Walk::Circle => ((seconds / walk_s).rem_euclid(1.0) * length, false, 0.0),
            Walk::Once => ((seconds.max(0.0) * self.speed_m_s).min(length), false, 0.0),
            Walk::BackAndForth => {
                let leg_s = walk_s + TURN_S;
                let within = seconds.rem_euclid(2.0 * leg_s);
                let (back, within) = (within >= leg_s, within % leg_s);
                let along = (within * self.speed_m_s).min(length);
                let turned = ((within - walk_s) / TURN_S).clamp(0.0, 1.0);
                (if back { length - along } else { along }, back, turned * turned * (3.0 - 2.0 * turned))
            }
        };
        let ahead = if self.end == Walk::Circle {
            let around = |m: f32| self.point(m.rem_euclid(length));
            around(metres + BEND_M) - around(metres - BEND_M)
        } else {
            self.point(metres + BEND_M) - self.point(metres - BEND_M)
        };
        let ahead = unit_or(Vec3::new(ahead.x, 0.0, ahead.z), Vec3::Z) * if back { -1.0 } else { 1.0 };
        let heading = libm::atan2f(ahead.x, ahead.z) + turned * PI + self.turn_rad;
        Affine3A::from_rotation_translation(Quat::from_rotation_y(heading), self.point(metres))
    }

    /// The point so many metres along, the nearest end for one beyond.
    fn point(&self, metres: f32) -> Vec3 {
        let i = self.metres.partition_point(|&m| m <= metres).clamp(1, self.points.len() - 1);
        let (from, to) = (self.metres[i - 1], self.metres[i]);
        self.points[i - 1].lerp(self.points[i], ((metres - from) / (to - from)).clamp(0.0, 1.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn facing(place: Affine3A) -> Vec3 {
        place.transform_vector3(Vec3::Z)
    }

    #[test]
    fn a_square_is_walked_round_and_round() {
        let corners = [(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0)].map(|(x, z)| Vec3::new(x, 0.0, z)).to_vec();
        let course = Course::walks(corners, 2.0, Walk::Circle, 0.0);
        for (seconds, at, ahead) in
            [(1.0, (2.0, 0.0), Vec3::X), (3.0, (4.0, 2.0), Vec3::Z), (7.0, (0.0, 2.0), Vec3::NEG_Z), (9.0, (2.0, 0.0), Vec3::X)]
        {
            let place = course.at(seconds);
            assert!(Vec3::from(place.translation).distance(Vec3::new(at.0, 0.0, at.1)) < 1e-4, "{seconds}");
            assert!(facing(place).distance(ahead) < 1e-4, "{seconds}");
        }
        // in a corner half of the turn is made
        assert!(facing(course.at(2.0)).distance(Vec3::new(0.5f32.sqrt(), 0.0, 0.5f32.sqrt())) < 1e-3);
        // nobody jumps or spins, at the seam neither
        for i in 0..800 {
            let (a, b) = (course.at(i as f32 * 0.01), course.at(i as f32 * 0.01 + 0.01));
            assert!(a.translation.distance(b.translation) < 0.021 && facing(a).angle_between(facing(b)) < 0.1, "{i}");
        }
    }

    #[test]
    fn there_and_back_turns_on_the_spot() {
        let course = Course::walks(vec![Vec3::ZERO, Vec3::X * 3.0], 1.0, Walk::BackAndForth, 0.0);
        assert!(facing(course.at(1.0)).distance(Vec3::X) < 1e-4);
        assert!(facing(course.at(3.0 + TURN_S + 1.0)).distance(Vec3::NEG_X) < 1e-4);
        let turning = course.at(3.0 + 0.5 * TURN_S);
        assert!(Vec3::from(turning.translation).distance(Vec3::X * 3.0) < 1e-5 && facing(turning).x.abs() < 1e-3);
        for i in 0..1000 {
            let (a, b) = (course.at(i as f32 * 0.01), course.at(i as f32 * 0.01 + 0.01));
            assert!(a.translation.distance(b.translation) < 0.011 && facing(a).angle_between(facing(b)) < 0.06, "{i}");
        }
    }

    #[test]
    fn who_stands_stands_and_who_arrives_stays() {
        let place = Course::stands(Vec3::new(1.0, 2.0, 3.0), 0.5 * PI).at(77.0);
        assert_eq!(Vec3::from(place.translation), Vec3::new(1.0, 2.0, 3.0));
        assert!(facing(place).distance(Vec3::X) < 1e-6);
        let once = Course::walks(vec![Vec3::ZERO, Vec3::Z * 2.0], 1.0, Walk::Once, 0.0);
        assert_eq!(once.at(50.0).translation, once.at(2.0).translation);
        assert!(facing(once.at(50.0)).distance(Vec3::Z) < 1e-6);
        let nowhere = Course::walks(vec![Vec3::Y; 3], 1.0, Walk::Circle, 0.0);
        assert_eq!(Vec3::from(nowhere.at(3.0).translation), Vec3::Y);
    }
}
