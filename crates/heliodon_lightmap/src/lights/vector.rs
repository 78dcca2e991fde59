//! Double precision vectors. A light's own arithmetic is in f64: solid angles of far or grazing emitters are small differences of
//! large angles, and one light ray costs far more than the few extra digits.

use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

/// Two unit vectors that form a right-handed frame with the unit vector `n`: `t x b = n` (Duff and others, JCGT 6(1), 2017).
pub(super) fn basis(n: DVec3) -> (DVec3, DVec3) {
    let sign = 1.0_f64.copysign(n.z);
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    (DVec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x), DVec3::new(b, sign + n.y * n.y * a, -n.y))
}

/// The angle between two vectors of any length, radians: exact for small angles and for angles near pi, which an arc cosine is not.
pub(super) fn angle_between(a: DVec3, b: DVec3) -> f64 {
    libm::atan2(a.cross(b).length(), a.dot(b))
}

/// A point of the unit disc, uniform for uniform numbers in [0, 1); neighbouring numbers give neighbouring points.
///
/// Shirley and Chiu: "A Low Distortion Map Between Disk and Square", Journal of Graphics Tools 2(3), 1997.
pub(super) fn concentric_disc(numbers: [f64; 2]) -> [f64; 2] {
    let [x, y] = numbers.map(|u| 2.0 * u - 1.0);
    if x == 0.0 && y == 0.0 {
        return [0.0, 0.0];
    }
    let (radius, angle) = if x.abs() > y.abs() { (x, FRAC_PI_4 * (y / x)) } else { (y, FRAC_PI_2 - FRAC_PI_4 * (x / y)) };
    [radius * libm::cos(angle), radius * libm::sin(angle)]
}

/// The interval of the rising sums (one more than there are intervals, from 0) in which a number in [0, 1) falls, when it is stretched
/// to their range, and where in it. Intervals of no width are never picked; `None` where all are such.
pub(super) fn pick(sums: &[f64], number: f64) -> Option<(usize, f64)> {
    let number = number * *sums.last()?;
    let index = sums.partition_point(|&s| s <= number).checked_sub(1)?;
    let (low, high) = (*sums.get(index)?, *sums.get(index + 1)?);
    let width = high - low;
    // the largest f64 below one keeps what is told to lie in [0, 1) there
    (width > 0.0).then(|| (index, ((number - low) / width).clamp(0.0, 1.0 - f64::EPSILON)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn discs_are_filled_evenly() {
        let n = 200;
        let mut inside_half = 0;
        for i in 0..n * n {
            let u = [(f64::from(i % n) + 0.5) / f64::from(n), (f64::from(i / n) + 0.5) / f64::from(n)];
            let [x, y] = concentric_disc(u);
            assert!(x * x + y * y <= 1.0 + 1e-12);
            inside_half += i32::from(x * x + y * y < 0.5);
        }
        assert!((f64::from(inside_half) / f64::from(n * n) - 0.5).abs() < 0.01);
        assert_eq!(concentric_disc([0.5, 0.5]), [0.0, 0.0]);
    }

    #[test]
    fn intervals_of_no_width_are_never_picked() {
        let sums = [0.0, 0.0, 2.0, 2.0, 3.0, 3.0];
        assert_eq!(pick(&sums, 0.0), Some((1, 0.0)));
        assert_eq!(pick(&sums, 1.0 / 3.0), Some((1, 0.5)));
        assert_eq!(pick(&sums, 2.0 / 3.0), Some((3, 0.0)));
        assert_eq!(pick(&sums, 1.0 - f64::EPSILON).map(|(i, _)| i), Some(3));
        assert_eq!((pick(&[0.0, 0.0], 0.5), pick(&[0.0], 0.5), pick(&[], 0.5)), (None, None, None));
    }

    #[test]
    fn frames_are_right_handed() {
        for n in [DVec3::X, DVec3::Y, DVec3::Z, DVec3::NEG_Z, DVec3::new(0.6, -0.64, 0.48)] {
            let (t, b) = basis(n);
            assert!((t.cross(b) - n).length() < 1e-14 && t.dot(b).abs() < 1e-15);
        }
        assert!((angle_between(DVec3::X, DVec3::new(-1.0, 1e-9, 0.0)) - (std::f64::consts::PI - 1e-9)).abs() < 1e-15);
    }
}
