//! Orthonormal frames and vectors that may be zero.

use glam::Vec3;

/// `v` scaled to length one, or `fallback` where `v` is zero, too small to divide by, or not finite.
///
/// [`Vec3::normalize`] is banned in this workspace because it answers NaN for such vectors.
#[must_use]
pub fn unit_or(v: Vec3, fallback: Vec3) -> Vec3 {
    v.try_normalize().unwrap_or(fallback)
}

/// Two unit vectors that form a right-handed orthonormal frame with the unit vector `n`: `t x b = n`.
///
/// Duff, Burgess, Christensen, Hery, Kensler, Liani, Villemin: "Building an Orthonormal Basis, Revisited", JCGT 6(1), 2017.
#[must_use]
pub fn orthonormal_basis(n: Vec3) -> (Vec3, Vec3) {
    let sign = 1.0_f32.copysign(n.z);
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    (Vec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x), Vec3::new(b, sign + n.y * n.y * a, -n.y))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sphere::fibonacci_sphere;

    #[test]
    fn bases_are_orthonormal_and_right_handed() {
        for n in fibonacci_sphere(1000).into_iter().chain([Vec3::Z, Vec3::NEG_Z]) {
            let (t, b) = orthonormal_basis(n);
            assert!(t.dot(b).abs() < 1e-6 && t.dot(n).abs() < 1e-6 && b.dot(n).abs() < 1e-6);
            assert!((t.cross(b) - n).length() < 1e-5);
        }
    }

    #[test]
    fn a_zero_vector_takes_the_fallback() {
        assert_eq!(unit_or(Vec3::ZERO, Vec3::Y), Vec3::Y);
        assert_eq!(unit_or(Vec3::NAN, Vec3::Y), Vec3::Y);
        assert_eq!(unit_or(Vec3::X * 3.0, Vec3::Y), Vec3::X);
    }
}
