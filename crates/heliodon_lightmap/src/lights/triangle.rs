//! Triangles on the sphere around a point: their solid angle, and directions spread evenly over it.

use crate::lights::vector::angle_between;
use glam::DVec3;

/// Solid angle (steradians, 0 to 2 pi) of a triangle around the origin, positive where the origin lies on the side that `normal` points to,
/// negative on the other, 0 in its plane. `normal`, of any length, is the cross product of the edges from corner 0 to 1 and to 2, taken
/// before the triangle was moved, for moving costs digits.
///
/// A. van Oosterom, J. Strackee: "The Solid Angle of a Plane Triangle", IEEE Trans. Biomedical Engineering 30(2), 1983, eq. 8.
pub(super) fn solid_angle(corners: [DVec3; 3], normal: DVec3) -> f64 {
    let [a, b, c] = corners;
    let (la, lb, lc) = (a.length(), b.length(), c.length());
    let volume = -a.dot(normal);
    let base = la * lb * lc + a.dot(b) * lc + a.dot(c) * lb + b.dot(c) * la;
    if volume == 0.0 { 0.0 } else { 2.0 * libm::atan2(volume, base) }
}

/// A unit direction spread evenly over a triangle's solid angle around the origin; neighbouring numbers give neighbouring directions.
/// `None` where rounding leaves no direction.
///
/// J. Arvo: "Stratified Sampling of Spherical Triangles", SIGGRAPH 1995, with the small sides taken from differences of vectors and not
/// from cosines near one. It keeps four digits down to 1e-4 sr.
pub(super) fn sample_direction(corners: [DVec3; 3], solid_angle: f64, numbers: [f64; 2]) -> Option<DVec3> {
    let [a, b, c] = corners.map(|corner| corner.try_normalize());
    let (a, b, c) = (a?, b?, c?);
    let alpha = angle_between(a.cross(b), a.cross(c));
    let (sin_alpha, cos_alpha) = (libm::sin(alpha), libm::cos(alpha));
    let part = numbers[0] * solid_angle;
    // the corner of the sub-triangle of that area, on the arc from A to C
    let (s, t) = (libm::sin(part - alpha), libm::cos(part - alpha));
    let (u, v) = (t - cos_alpha, s + sin_alpha * a.dot(b));
    let q = ((v * t - u * s) * cos_alpha - v) / ((v * s + u * t) * sin_alpha);
    let q = if q.is_nan() { 1.0 } else { q.clamp(-1.0, 1.0) };
    let towards_c = (c - a * c.dot(a)).try_normalize()?;
    let corner = a * q + towards_c * ((1.0 - q) * (1.0 + q)).sqrt();
    // and a point on the arc from B to it, evenly in the cosine; 1 - cos of a small angle as half a squared distance
    let w = numbers[1] * 0.5 * (corner - b).length_squared();
    let across = (corner - b * corner.dot(b)).try_normalize().unwrap_or(DVec3::ZERO);
    (b * (1.0 - w) + across * (w * (2.0 - w)).max(0.0).sqrt()).try_normalize()
}

#[cfg(test)]
mod tests {
    use super::*;
    use heliodon_math::random::Pcg32;
    use std::f64::consts::FRAC_PI_2;

    #[test]
    fn an_octant_is_half_pi_and_has_a_side() {
        let corners = [DVec3::X, DVec3::Y, DVec3::Z];
        let normal = DVec3::ONE;
        // seen from the origin, behind its front
        assert!((solid_angle(corners, normal) + FRAC_PI_2).abs() < 1e-14);
        assert!((solid_angle(corners, -normal) - FRAC_PI_2).abs() < 1e-14);
        assert_eq!(solid_angle([DVec3::X, DVec3::Y, -DVec3::X], DVec3::Z), 0.0);
        // far away: area over distance squared
        let far = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]].map(|[x, z]| DVec3::new(x, 1e5, z));
        assert!((solid_angle(far, DVec3::NEG_Y) / 0.5e-10 - 1.0).abs() < 1e-9);
    }

    #[test]
    fn directions_are_even_within_the_triangle() {
        let mut rng = Pcg32::new(3, 3);
        let mut number = || f64::from(rng.range_f32(-1.0, 1.0));
        for _ in 0..40 {
            let corners = [(); 3].map(|()| DVec3::new(number(), number(), number()));
            let [a, b, c] = corners;
            let normal = (b - a).cross(c - a);
            let omega = solid_angle(corners, normal).abs();
            // cut from corner B to the middle of the side AC: the parts are hit in proportion to their solid angles
            let middle = (a + c) * 0.5;
            let part = solid_angle([a, b, middle], (b - a).cross(middle - a)).abs();
            let cut = b.cross(middle);
            let (mut hits, n) = (0, 64);
            for i in 0..n * n {
                let u = [(f64::from(i % n) + 0.5) / f64::from(n), (f64::from(i / n) + 0.5) / f64::from(n)];
                let d = sample_direction(corners, omega, u).unwrap();
                let sides = [a.cross(b).dot(d), b.cross(c).dot(d), c.cross(a).dot(d)].map(|s| s * a.cross(b).dot(c).signum());
                assert!((d.length() - 1.0).abs() < 1e-12 && sides.iter().all(|s| *s > -1e-9), "{corners:?} {d}: {sides:?}");
                hits += i32::from((cut.dot(d) > 0.0) == (cut.dot(a) > 0.0));
            }
            assert!((f64::from(hits) / f64::from(n * n) - part / omega).abs() < 0.02, "{corners:?}");
        }
    }
}
