//! What an eye sees through a screen that stands anywhere in a room: off-axis projections.
//!
//! Robert Kooima: "Generalized Perspective Projection", Louisiana State University, 2009. A screen is given by three of its
//! corners; the screen's plane is the plane of projection, so that what is drawn looks right from the eye's place, wherever it is,
//! and goes on without a break over the edge to the next screen.

use glam::{DVec3, Mat3, Mat4, Quat, Vec3, Vec4};
use std::fmt;

/// The nearest that an eye comes to a screen's plane, metres: from nearer, or from behind, it sees as from there.
pub const LEAST_EYE_DISTANCE_M: f32 = 0.02;

/// The shortest side of a screen, metres.
const LEAST_SIDE_M: f64 = 0.01;

/// How far from a right angle a corner may be: builders measure corners by hand.
const MOST_SKEW_DEG: f64 = 2.0;

/// A flat rectangle in a room that shows what lies behind it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Screen {
    lower_left: DVec3,
    right: DVec3,
    up: DVec3,
    width: f64,
    height: f64,
}

/// Why three points are no corners of a screen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ScreenFault {
    /// A coordinate is not finite.
    NotFinite,
    /// A side is as short, metres.
    Short(f64),
    /// The three lie on one line.
    Collinear,
    /// The angle at the lower left corner, degrees.
    Skew(f64),
}

impl fmt::Display for ScreenFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotFinite => write!(f, "a coordinate is not a finite number"),
            Self::Short(side) => write!(f, "a side is {side} m long"),
            Self::Collinear => write!(f, "the three corners lie on one line"),
            Self::Skew(angle) => write!(f, "the angle at the lower left corner is {angle:.1} degrees, not 90"),
        }
    }
}

impl std::error::Error for ScreenFault {}

impl Screen {
    /// The screen with these corners: lower left, lower right, upper left, seen from the front. What is not quite a right angle is
    /// made one: the lower edge stays.
    ///
    /// # Errors
    /// If they are not the corners of a rectangle of at least a centimetre.
    pub fn from_corners([lower_left, lower_right, upper_left]: [DVec3; 3]) -> Result<Self, ScreenFault> {
        if ![lower_left, lower_right, upper_left].iter().all(|corner| corner.is_finite()) {
            return Err(ScreenFault::NotFinite);
        }
        let (along, rising) = (lower_right - lower_left, upper_left - lower_left);
        for side in [along, rising] {
            if side.length() < LEAST_SIDE_M {
                return Err(ScreenFault::Short(side.length()));
            }
        }
        let right = along / along.length();
        let across = rising - right * right.dot(rising);
        let skew_deg = libm::acos((right.dot(rising) / rising.length()).clamp(-1.0, 1.0)).to_degrees();
        if across.length() < 1e-3 * rising.length() {
            return Err(ScreenFault::Collinear);
        }
        if (skew_deg - 90.0).abs() > MOST_SKEW_DEG {
            return Err(ScreenFault::Skew(skew_deg));
        }
        let up = across / across.length();
        Ok(Self { lower_left, right, up, width: along.length(), height: across.length() })
    }

    /// Width and height, metres.
    #[must_use]
    pub fn size(&self) -> [f64; 2] {
        [self.width, self.height]
    }

    /// The unit normal of the front.
    #[must_use]
    pub fn normal(&self) -> DVec3 {
        self.right.cross(self.up)
    }

    /// How far a point is in front of the plane, metres; negative behind it.
    #[must_use]
    pub fn distance(&self, point: DVec3) -> f64 {
        self.normal().dot(point - self.lower_left)
    }

    /// The point at `u` of the width from the left and `v` of the height from below.
    #[must_use]
    pub fn point(&self, u: f64, v: f64) -> DVec3 {
        self.lower_left + self.right * (self.width * u) + self.up * (self.height * v)
    }

    /// The four corners: lower left, lower right, upper right, upper left.
    #[must_use]
    pub fn corners(&self) -> [DVec3; 4] {
        [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|[u, v]| self.point(u, v))
    }

    /// Where on the screen, as [`Self::point`] counts, an eye sees `point`; `None` if the line from the eye to it does not meet
    /// the plane before the eye.
    #[must_use]
    pub fn seen_at(&self, eye: DVec3, point: DVec3) -> Option<[f64; 2]> {
        let (from, towards) = (self.distance(eye), self.normal().dot(eye - point));
        let share = from / towards;
        (share.is_finite() && share > 0.0).then(|| {
            let offset = eye + (point - eye) * share - self.lower_left;
            [self.right.dot(offset) / self.width, self.up.dot(offset) / self.height]
        })
    }

    /// What `eye` sees through the screen.
    #[must_use]
    pub fn view(&self, eye: DVec3) -> OffAxis {
        let least = f64::from(LEAST_EYE_DISTANCE_M);
        let behind = least - self.distance(eye);
        let eye = if behind > 0.0 { eye + self.normal() * behind } else { eye };
        // The edges are those of the eye that is drawn from, which is rounded.
        let eye = eye.as_vec3().as_dvec3();
        let distance = self.distance(eye).max(least);
        let to_corner = self.lower_left - eye;
        let (left, bottom) = (self.right.dot(to_corner), self.up.dot(to_corner));
        let tangent = |side: f64| (side / distance) as f32;
        let axes = [self.right, self.up, self.normal()].map(|axis| axis.as_vec3());
        OffAxis {
            eye: eye.as_vec3(),
            room_from_view: Quat::from_mat3(&Mat3::from_cols(axes[0], axes[1], axes[2])),
            left: tangent(left),
            right: tangent(left + self.width),
            bottom: tangent(bottom),
            top: tangent(bottom + self.height),
        }
    }
}

/// A perspective whose axis need not meet the middle of its picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OffAxis {
    /// The eye, in the room.
    pub eye: Vec3,
    /// From view space, which looks along -Z with +Y up, to the room.
    pub room_from_view: Quat,
    /// Tangent of the angle to the left edge; negative to the left of the axis.
    pub left: f32,
    /// Tangent of the angle to the right edge.
    pub right: f32,
    /// Tangent of the angle to the lower edge; negative below the axis.
    pub bottom: f32,
    /// Tangent of the angle to the upper edge.
    pub top: f32,
}

impl OffAxis {
    /// View to clip space with reversed depth: 1 at `near_m` and 0 at `far_m`, or at infinity.
    #[must_use]
    pub fn clip_from_view(&self, near_m: f32, far_m: Option<f32>) -> Mat4 {
        let Self { left, right, bottom, top, .. } = *self;
        let (width, height) = (right - left, top - bottom);
        let (depth, shift) = match far_m {
            None => (0.0, near_m),
            Some(far) => (near_m / (far - near_m), near_m * far / (far - near_m)),
        };
        Mat4::from_cols(
            Vec4::new(2.0 / width, 0.0, 0.0, 0.0),
            Vec4::new(0.0, 2.0 / height, 0.0, 0.0),
            Vec4::new((right + left) / width, (top + bottom) / height, depth, -1.0),
            Vec4::new(0.0, 0.0, shift, 0.0),
        )
    }

    /// The room to view space.
    #[must_use]
    pub fn view_from_room(&self) -> Mat4 {
        Mat4::from_rotation_translation(self.room_from_view, self.eye).inverse()
    }
}

/// The two eyes of a head: left, then right, `separation_m` apart along its own x axis.
#[must_use]
pub fn eyes(head: Vec3, room_from_head: Quat, separation_m: f32) -> [Vec3; 2] {
    let aside = room_from_head * Vec3::X * (0.5 * separation_m);
    [head - aside, head + aside]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Pcg32;

    fn some_room(random: &mut Pcg32) -> (Screen, DVec3) {
        let mut unit = || f64::from(random.next_f32()) * 2.0 - 1.0;
        let turn = glam::DQuat::from_euler(glam::EulerRot::YXZ, unit() * 3.0, unit() * 1.2, unit() * 0.5);
        let (width, height) = (0.3 + 2.0 * (1.0 + unit()), 0.3 + 1.5 * (1.0 + unit()));
        let at = DVec3::new(unit(), unit(), unit()) * 5.0;
        let (right, up) = (turn * DVec3::X, turn * DVec3::Y);
        let screen = Screen::from_corners([at, at + right * width, at + up * height]).unwrap();
        let eye = at + right * width * (0.5 + unit()) + up * height * (0.5 + unit()) + turn * DVec3::Z * (2.0 + 1.5 * unit());
        (screen, eye)
    }

    fn projected(view: &OffAxis, point: DVec3) -> Vec3 {
        view.clip_from_view(0.05, None).project_point3(view.view_from_room().transform_point3(point.as_vec3()))
    }

    #[test]
    fn corners_land_on_the_corners_of_the_picture() {
        let mut random = Pcg32::new(7, 0);
        for _ in 0..10_000 {
            let (screen, eye) = some_room(&mut random);
            let view = screen.view(eye);
            for (corner, wanted) in screen.corners().into_iter().zip([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]) {
                // The picture is 2 wide here, and the limit is 1e-5 of it.
                let at = projected(&view, corner);
                assert!((at.x - wanted[0]).abs() < 2e-5 && (at.y - wanted[1]).abs() < 2e-5, "{at} {wanted:?} {screen:?} {eye}");
            }
        }
    }

    #[test]
    fn what_is_seen_through_a_screen_lies_behind_that_point_of_it() {
        let mut random = Pcg32::new(8, 0);
        for _ in 0..10_000 {
            let (screen, eye) = some_room(&mut random);
            let (u, v) = (f64::from(random.next_f32()), f64::from(random.next_f32()));
            let on_screen = screen.point(u, v);
            let beyond = eye + (on_screen - eye) * (1.0 + 20.0 * f64::from(random.next_f32()));
            let [su, sv] = screen.seen_at(eye, beyond).unwrap();
            assert!((su - u).abs() < 1e-9 && (sv - v).abs() < 1e-9);
            let at = projected(&screen.view(eye), beyond);
            assert!((f64::from(at.x) - (2.0 * u - 1.0)).abs() < 1e-4 && (f64::from(at.y) - (2.0 * v - 1.0)).abs() < 1e-4);
        }
    }

    #[test]
    fn eyes_differ_by_the_parallax_that_geometry_predicts() {
        let screen =
            Screen::from_corners([DVec3::new(-1.0, 0.0, -2.0), DVec3::new(1.0, 0.0, -2.0), DVec3::new(-1.0, 1.5, -2.0)]);
        let screen = screen.unwrap();
        let (head, separation) = (Vec3::new(0.2, 1.6, 0.1), 0.065_f32);
        let [left, right] = eyes(head, Quat::IDENTITY, separation);
        let from_eye = 2.1;
        for distance in [2.1, 3.0, 10.0, 1000.0] {
            let point = DVec3::new(0.3, 1.0, 0.1 - distance);
            let [l, r] = [left, right].map(|eye| f64::from(projected(&screen.view(eye.as_dvec3()), point).x));
            // On the screen's plane they agree; behind it the right eye sees it further to the right, at most by their distance.
            let metres = f64::from(separation) * (distance - from_eye) / distance;
            assert!(((r - l) - metres).abs() < 2e-5, "{distance} m: {} for {metres}", r - l);
        }
    }

    #[test]
    fn depth_is_one_near_and_nothing_far() {
        let (screen, eye) = some_room(&mut Pcg32::new(3, 0));
        let view = screen.view(eye);
        for (far, depth) in [(None, 0.5), (Some(0.2), 0.05 / 0.15)] {
            let clip = view.clip_from_view(0.05, far);
            assert!((clip.project_point3(Vec3::new(0.0, 0.0, -0.05)).z - 1.0).abs() < 1e-6);
            assert!((clip.project_point3(Vec3::new(0.0, 0.0, -0.1)).z - depth).abs() < 1e-6);
        }
        assert!(view.clip_from_view(0.05, Some(0.2)).project_point3(Vec3::new(0.0, 0.0, -0.2)).z.abs() < 1e-6);
    }

    #[test]
    fn an_eye_in_or_behind_the_screen_sees_as_from_close_before_it() {
        let screen = Screen::from_corners([DVec3::ZERO, DVec3::X, DVec3::Y]).unwrap();
        for z in [0.0, -1e-9, -3.0, 0.019] {
            let view = screen.view(DVec3::new(0.5, 0.5, z));
            assert!((view.eye.z - LEAST_EYE_DISTANCE_M).abs() < 1e-6 && view.clip_from_view(0.05, None).is_finite());
        }
    }

    #[test]
    fn what_is_no_rectangle_is_refused() {
        let of = |a: [f64; 3], b: [f64; 3], c: [f64; 3]| Screen::from_corners([a, b, c].map(DVec3::from));
        assert_eq!(of([0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]), Err(ScreenFault::Collinear));
        assert_eq!(of([0.0; 3], [1.0, f64::NAN, 0.0], [0.0, 1.0, 0.0]), Err(ScreenFault::NotFinite));
        assert_eq!(of([0.0; 3], [0.0; 3], [0.0, 1.0, 0.0]), Err(ScreenFault::Short(0.0)));
        assert!(matches!(of([0.0; 3], [1.0, 0.0, 0.0], [0.3, 1.0, 0.0]), Err(ScreenFault::Skew(angle)) if angle < 80.0));
        let nearly = of([0.0; 3], [1.0, 0.0, 0.0], [0.01, 1.0, 0.0]).unwrap();
        assert!(nearly.corners()[3].x.abs() < 1e-12, "made a right angle");
    }
}
