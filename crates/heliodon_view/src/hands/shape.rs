//! The shape of a thing as a hand sees it: how large it is, where it is gripped, which of its points strike first.

use super::reach::Scene;
use bevy::prelude::*;
use glam::{Affine3A, Mat3};
use heliodon_math::frame::unit_or;

/// What is so many times as long as it is wide is held by its end, as tools are.
const LONG: f32 = 1.6;
/// Where along a long thing it is gripped, from its lighter end.
const GRIPPED_AT: f32 = 0.2;
/// Points that strike are at least so far from the grip, as a part of the farthest.
const STRIKES_FROM: f32 = 0.5;

/// A thing in the space of its model, whose origin is where it stands.
#[derive(Clone, Debug, PartialEq)]
pub struct Shape {
    /// The box around it.
    pub bounds: (Vec3, Vec3),
    /// Where a hand holds it.
    pub grip: Vec3,
    /// Of a long thing the unit direction from the grip to its head, and the one in which the head strikes, at right angles.
    pub long: Option<(Vec3, Vec3)>,
    /// The points that meet first what it is swung into.
    pub edges: Vec<Vec3>,
}

impl Shape {
    /// Of a thing that is there; of an impostor its box.
    #[must_use]
    pub fn of(scene: Scene<'_>, name: &str) -> Option<Self> {
        let (stands, (low, high)) =
            scene.actors.whereabouts(name).or_else(|| scene.impostors.whereabouts(name, scene.actors))?;
        let points: Vec<Vec3> = match scene.actors.solid(name) {
            Some(solid) => {
                let model_from_mesh = stands.inverse() * solid.world_from_mesh;
                solid.positions.iter().map(|&p| model_from_mesh.transform_point3(p)).collect()
            }
            None => corners((low, high)).into_iter().map(|p| p - Vec3::from(stands.translation)).collect(),
        };
        Some(Self::around(&points))
    }

    /// Around points.
    fn around(points: &[Vec3]) -> Self {
        let low = points.iter().copied().reduce(Vec3::min).unwrap_or_default();
        let high = points.iter().copied().reduce(Vec3::max).unwrap_or_default();
        let (middle, size) = ((low + high) * 0.5, high - low);
        let mut axes = [0, 1, 2];
        axes.sort_by(|&a, &b| size[b].total_cmp(&size[a]));
        let is_long = size[axes[0]] > LONG * size[axes[1]];
        let heavy = points.iter().copied().sum::<Vec3>() / points.len().max(1) as f32;
        let unit = |axis: usize| [Vec3::X, Vec3::Y, Vec3::Z][axis];
        // the head is where more of it is
        let side = if heavy[axes[0]] < middle[axes[0]] { -1.0 } else { 1.0 };
        let long = is_long.then(|| (unit(axes[0]) * side, unit(axes[1])));
        let grip = long.map_or(middle, |(head, _)| middle - head * (size[axes[0]] * (0.5 - GRIPPED_AT)));
        let far = points.iter().map(|p| p.distance(grip)).fold(0.0, f32::max);
        let strikes: Vec<Vec3> = points.iter().copied().filter(|p| p.distance(grip) >= STRIKES_FROM * far).collect();
        let mut edges: Vec<Vec3> = Vec::new();
        for direction in directions() {
            let outermost = strikes.iter().copied().max_by(|a, b| a.dot(direction).total_cmp(&b.dot(direction)));
            edges.extend(outermost.filter(|point| !edges.contains(point)));
        }
        Self { bounds: (low, high), grip, long, edges }
    }

    /// Half of its diagonal, metres.
    #[must_use]
    pub fn radius(&self) -> f32 {
        0.5 * self.bounds.0.distance(self.bounds.1)
    }

    /// How it lies in a tracked hand that was given it: a long thing along the hand's -Z, its head ahead; anything else upright.
    #[must_use]
    pub fn in_hand(&self) -> Affine3A {
        let turn = self.long.map_or(Quat::IDENTITY, |(head, face)| turned((head, face), (Vec3::NEG_Z, Vec3::NEG_Y)));
        Affine3A::from_quat(turn) * Affine3A::from_translation(-self.grip)
    }

    /// Where it is before a view (the eye, and how it looks), on the right (1) or on the left (-1): a long thing with its head up, others as they stand, from the side on which they
    /// are looked at. It is so far away that it takes less than a third of a usual view's height.
    #[must_use]
    pub fn before(&self, (eye, look): (Vec3, Quat), side: f32) -> Affine3A {
        let far = (if self.long.is_some() { 3.0 } else { 3.6 } * self.radius()).max(NEAREST_M);
        let (at, turn) = match self.long {
            Some(long) => {
                let up = unit_or(Vec3::new(-0.15 * side, 0.75, -0.6), Vec3::Y);
                (Vec3::new(0.42 * side, -0.5, -0.95), look * turned(long, (up, Vec3::new(-0.25 * side, 0.0, -1.0))))
            }
            None => {
                let ahead = look * Vec3::NEG_Z;
                let heading = libm::atan2f(-ahead.x, -ahead.z);
                (Vec3::new(0.38 * side, -0.32, -1.0), Quat::from_rotation_y(heading))
            }
        };
        let place = eye + look * (at * far);
        Affine3A::from_translation(place) * Affine3A::from_quat(turn) * Affine3A::from_translation(-self.grip)
    }

    /// Where it stands upright on a place, turned about the vertical as it is now.
    #[must_use]
    pub fn upright_on(&self, place: Vec3, now: Affine3A) -> Affine3A {
        let ahead = now.transform_vector3(Vec3::Z);
        let turn = Quat::from_rotation_y(libm::atan2f(ahead.x, ahead.z));
        let (low, high) = self.bounds;
        let foot = Vec3::new(0.5 * (low.x + high.x), low.y, 0.5 * (low.z + high.z));
        Affine3A::from_translation(place + Vec3::Y * ABOVE_M) * Affine3A::from_quat(turn) * Affine3A::from_translation(-foot)
    }
}

/// Nothing is held nearer to the eyes, metres.
const NEAREST_M: f32 = 0.42;
/// What is put down is let go so far above what it is put on, metres: bodies must not begin in one another.
const ABOVE_M: f32 = 0.005;

/// The rotation that brings one direction to another, and a second, at right angles to it, as near to its other as can be.
fn turned((along, across): (Vec3, Vec3), (to_along, to_across): (Vec3, Vec3)) -> Quat {
    let frame = |along: Vec3, across: Vec3| {
        let side = unit_or(along.cross(across), along.any_orthonormal_vector());
        Mat3::from_cols(along, side.cross(along), side)
    };
    Quat::from_mat3(&(frame(to_along, to_across) * frame(along, across).transpose()))
}

fn corners((low, high): (Vec3, Vec3)) -> [Vec3; 8] {
    std::array::from_fn(|i| {
        let pick = |bit: usize, axis: usize| if i >> bit & 1 == 0 { low[axis] } else { high[axis] };
        Vec3::new(pick(0, 0), pick(1, 1), pick(2, 2))
    })
}

/// Along the axes and between them.
fn directions() -> impl Iterator<Item = Vec3> {
    [Vec3::X, Vec3::Y, Vec3::Z].into_iter().flat_map(|axis| [axis, -axis]).chain(corners((Vec3::NEG_ONE, Vec3::ONE)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A mallet that lies along x, its head, across z, at the far end.
    fn mallet() -> Shape {
        let handle = corners((Vec3::new(0.0, 0.0, -0.01), Vec3::new(0.25, 0.02, 0.01)));
        let head = corners((Vec3::new(0.25, -0.03, -0.08), Vec3::new(0.32, 0.05, 0.08)));
        let middle = corners((Vec3::new(0.27, -0.03, -0.08), Vec3::new(0.3, 0.05, 0.08)));
        Shape::around(&[handle, head, middle].concat())
    }

    #[test]
    fn a_mallet_is_gripped_by_its_handle_and_strikes_with_its_head() {
        let mallet = mallet();
        assert_eq!(mallet.long, Some((Vec3::X, Vec3::Z)));
        assert!(mallet.grip.abs_diff_eq(Vec3::new(0.064, 0.01, 0.0), 1e-5), "{}", mallet.grip);
        assert!(mallet.edges.len() >= 8 && mallet.edges.iter().all(|edge| edge.x >= 0.25), "{:?}", mallet.edges);
        let in_hand = mallet.in_hand();
        assert!(in_hand.transform_vector3(Vec3::X).abs_diff_eq(Vec3::NEG_Z, 1e-5));
        assert!(in_hand.transform_vector3(Vec3::Z).abs_diff_eq(Vec3::NEG_Y, 1e-5));
        assert!(in_hand.transform_point3(mallet.grip).length() < 1e-6);
    }

    #[test]
    fn what_is_held_before_a_view_is_in_it() {
        let jug = Shape::around(&corners((Vec3::new(-0.1, 0.0, -0.1), Vec3::new(0.1, 0.3, 0.1))));
        assert_eq!(jug.long, None, "1.5 times as high as wide");
        let look = Quat::from_rotation_y(0.8) * Quat::from_rotation_x(-0.4);
        let eye = Vec3::new(3.0, 1.7, -2.0);
        for shape in [mallet(), jug] {
            for side in [1.0, -1.0] {
                let before = shape.before((eye, look), side);
                for corner in corners(shape.bounds) {
                    let seen = look.inverse() * (before.transform_point3(corner) - eye);
                    assert!(seen.z < -0.1 && seen.x * side > -0.2 * -seen.z, "{seen}");
                    // within a view of 60 degrees, 4 to 3
                    assert!(seen.y.abs() < -seen.z * 0.9 && seen.x.abs() < -seen.z * 0.9, "{seen}");
                }
                let up = before.transform_vector3(shape.long.map_or(Vec3::Y, |(head, _)| head));
                assert!(up.y > 0.5, "{up}");
            }
        }
    }

    #[test]
    fn what_is_put_down_stands_on_its_foot() {
        let now = Affine3A::from_rotation_y(0.7) * Affine3A::from_rotation_x(0.5);
        let stands = mallet().upright_on(Vec3::new(1.0, 2.0, 3.0), now);
        let places = corners(mallet().bounds).map(|corner| stands.transform_point3(corner));
        let low = places.iter().map(|p| p.y).fold(f32::INFINITY, f32::min);
        assert!((low - 2.0 - ABOVE_M).abs() < 1e-5);
        let middle = places.iter().sum::<Vec3>() / 8.0;
        assert!((middle - Vec3::new(1.0, middle.y, 3.0)).length() < 1e-5);
        assert!(stands.transform_vector3(Vec3::Y).abs_diff_eq(Vec3::Y, 1e-6));
    }

    #[test]
    fn nothing_has_a_shape_too() {
        let nothing = Shape::around(&[]);
        assert!(nothing.radius() == 0.0 && nothing.long.is_none() && nothing.in_hand().is_finite());
    }
}
