//! Rotations between floating-point pitfalls: quaternions that may be anything, their logarithm and exponential, and turning
//! from one to another at an even pace.
//!
//! `glam`'s own `slerp` and `from_axis_angle` call the platform's trigonometry, whose last bits differ from one platform to the
//! next; here it is [`libm`]'s, so that a recording played twice shows the same pictures everywhere.

use glam::{Mat3, Quat, Vec3};
use std::ops::RangeInclusive;

/// What is taken for the square of a rotation's length: rounding to few digits explains a half or a double, nothing more does.
const LENGTH_SQUARED: RangeInclusive<f32> = 0.25..=4.0;

/// By how much the squared length of a rotation of length one can be off for rounding alone: four products, three sums and the
/// root before, half a unit each. Such a rotation stays as it is, so that what is written and read again is the same.
const UNIT_ROUNDING: f32 = 4.0 * f32::EPSILON;

/// How far from 1 the squared lengths of a rotation matrix's columns may be, and from 0 the products of two: three digits
/// behind the point, as the thriftiest senders write, are within it thirty times over.
const MATRIX_TOLERANCE: f32 = 0.05;

/// Below this angle, in radians, a sine is its angle to the last bit of an `f32`.
const SMALL_ANGLE_RAD: f32 = 1e-4;

/// `q` at length one, or nothing where it is no rotation: not finite, or of a length below a half or above two.
#[must_use]
pub fn unit(q: Quat) -> Option<Quat> {
    let squared = q.length_squared();
    if (squared - 1.0).abs() <= UNIT_ROUNDING {
        return Some(q);
    }
    LENGTH_SQUARED.contains(&squared).then(|| q * (1.0 / squared.sqrt()))
}

/// The rotation of a matrix with these columns, or nothing where it is none: sheared, scaled, mirrored or not finite.
#[must_use]
pub fn from_columns(x: Vec3, y: Vec3, z: Vec3) -> Option<Quat> {
    let about = |value: f32, wanted: f32| (value - wanted).abs() <= MATRIX_TOLERANCE;
    let lengths = [x, y, z].iter().all(|axis| about(axis.length_squared(), 1.0));
    let square = [x.dot(y), y.dot(z), z.dot(x)].iter().all(|product| about(*product, 0.0));
    let turned = x.cross(y).dot(z) > 0.0;
    if lengths && square && turned { unit(Quat::from_mat3(&Mat3::from_cols(x, y, z))) } else { None }
}

/// The rotation as its axis times its angle in radians, at most pi: the way that [`from_vector`] goes in one step.
#[must_use]
pub fn to_vector(q: Quat) -> Vec3 {
    // q and -q are the same rotation: the one with positive w turns the shorter way
    let q = if q.w < 0.0 { -q } else { q };
    let axis = Vec3::new(q.x, q.y, q.z);
    let sine = axis.length();
    if sine < SMALL_ANGLE_RAD {
        return axis * 2.0;
    }
    axis * (2.0 * libm::atan2f(sine, q.w) / sine)
}

/// The rotation about `v` by its length in radians.
#[must_use]
pub fn from_vector(v: Vec3) -> Quat {
    let angle = v.length();
    if angle < SMALL_ANGLE_RAD {
        return unit(Quat::from_xyzw(v.x * 0.5, v.y * 0.5, v.z * 0.5, 1.0)).unwrap_or(Quat::IDENTITY);
    }
    let axis = v * (libm::sinf(angle * 0.5) / angle);
    unit(Quat::from_xyzw(axis.x, axis.y, axis.z, libm::cosf(angle * 0.5))).unwrap_or(Quat::IDENTITY)
}

/// From `a` (at 0) to `b` (at 1) at an even pace and the shorter way round.
#[must_use]
pub fn slerp(a: Quat, b: Quat, t: f32) -> Quat {
    let step = from_vector(to_vector(b * a.conjugate()) * t);
    unit(step * a).unwrap_or(a)
}

#[cfg(test)]
mod tests {
    use super::*;
    use heliodon_math::random::Pcg32;
    use proptest::prelude::*;

    /// A rotation that may be any.
    pub(crate) fn any_rotation(rng: &mut Pcg32) -> Quat {
        loop {
            let [x, y, z, w] = std::array::from_fn(|_| rng.range_f32(-1.0, 1.0));
            if let Some(q) = unit(Quat::from_xyzw(x, y, z, w)) {
                return q;
            }
        }
    }

    fn angle_between(a: Quat, b: Quat) -> f32 {
        to_vector(b * a.conjugate()).length()
    }

    #[test]
    fn what_is_no_rotation_is_told() {
        let no = [Quat::from_xyzw(0.0, 0.0, 0.0, 0.0), Quat::from_xyzw(f32::NAN, 0.0, 0.0, 1.0), Quat::IDENTITY * 1e20];
        assert!(no.into_iter().all(|q| unit(q).is_none()));
        assert_eq!(unit(Quat::IDENTITY * 1.5), Some(Quat::IDENTITY));
        assert_eq!(from_columns(Vec3::ZERO, Vec3::ZERO, Vec3::ZERO), None, "what DTrack writes where it sees nothing");
        assert_eq!(from_columns(Vec3::X, Vec3::Y, Vec3::NEG_Z), None, "a mirror");
        assert_eq!(from_columns(Vec3::X, Vec3::Y, Vec3::NAN), None);
        assert_eq!(from_columns(Vec3::Y, Vec3::NEG_X, Vec3::Z).map(|q| (q * Vec3::X - Vec3::Y).length() < 1e-6), Some(true));
    }

    #[test]
    fn halfway_is_as_far_from_both_ends() {
        let mut rng = Pcg32::new(1, 0);
        for _ in 0..1000 {
            let (a, b) = (any_rotation(&mut rng), any_rotation(&mut rng));
            let middle = slerp(a, b, 0.5);
            assert!((angle_between(a, middle) - angle_between(middle, b)).abs() < 1e-5);
            assert!(angle_between(a, slerp(a, b, 0.0)) < 1e-5 && angle_between(b, slerp(a, b, 1.0)) < 1e-5);
        }
    }

    proptest! {
        #[test]
        fn a_vector_comes_back_from_its_rotation(x in -1.8_f32..1.8, y in -1.8_f32..1.8, z in -1.8_f32..1.8) {
            let v = Vec3::new(x, y, z);
            prop_assume!(v.length() < 3.1);
            prop_assert!((to_vector(from_vector(v)) - v).length() < 1e-5);
        }
    }
}
