//! Directions on the sphere: even point sets, sampling maps, spherical coordinates and solid angles.

use crate::frame::orthonormal_basis;
use glam::Vec3;
use std::f32::consts::{FRAC_PI_2, FRAC_PI_4, PI, TAU};

/// `count` unit directions spread evenly over the sphere, each standing for the same solid angle `4 pi / count`.
///
/// The spherical Fibonacci lattice, with latitudes at the middles of equal-area bands (Keinert, Innmann, Sänger, Stamminger:
/// "Spherical Fibonacci Mapping", ACM TOG 34(6), 2015). Computed in f64 with `libm`, so the bits are the same everywhere.
#[must_use]
pub fn fibonacci_sphere(count: u32) -> Vec<Vec3> {
    // the golden ratio's fraction, 1/phi
    const INV_PHI: f64 = 0.618_033_988_749_894_8;
    (0..count)
        .map(|i| {
            let y = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(count);
            let turn = f64::from(i) * INV_PHI;
            let azimuth = std::f64::consts::TAU * (turn - turn.floor());
            let r = (1.0 - y * y).max(0.0).sqrt();
            Vec3::new((r * libm::cos(azimuth)) as f32, y as f32, (r * libm::sin(azimuth)) as f32)
        })
        .collect()
}

/// A direction with density `cos / pi` about the unit normal `n`, from two numbers in [0, 1).
#[must_use]
pub fn sample_cosine_hemisphere(n: Vec3, u: [f32; 2]) -> Vec3 {
    let r = u[0].max(0.0).sqrt();
    let azimuth = TAU * u[1];
    let (t, b) = orthonormal_basis(n);
    let z = (1.0 - u[0]).max(0.0).sqrt();
    t * (r * libm::cosf(azimuth)) + b * (r * libm::sinf(azimuth)) + n * z
}

/// As [`sample_cosine_hemisphere`], for numbers that are spread evenly over a square: what is near one another there stays near (P. Shirley, K. Chiu: "A Low Distortion Map
/// Between Disk and Square", 1997).
#[must_use]
pub fn concentric_cosine_hemisphere(n: Vec3, u: [f32; 2]) -> Vec3 {
    let [a, b] = u.map(|u| 2.0 * u - 1.0);
    let (r, azimuth) = if a.abs() > b.abs() {
        (a, FRAC_PI_4 * (b / a))
    } else if b != 0.0 {
        (b, FRAC_PI_2 - FRAC_PI_4 * (a / b))
    } else {
        (0.0, 0.0)
    };
    let (t, b) = orthonormal_basis(n);
    t * (r * libm::cosf(azimuth)) + b * (r * libm::sinf(azimuth)) + n * (1.0 - r * r).max(0.0).sqrt()
}

/// The unit direction at a compass azimuth (radians, clockwise from north, -Z; east, +X, at pi/2) and an elevation above
/// the horizon (radians).
#[must_use]
pub fn direction_from_azimuth_elevation(azimuth_rad: f64, elevation_rad: f64) -> Vec3 {
    let horizontal = libm::cos(elevation_rad);
    Vec3::new(
        (horizontal * libm::sin(azimuth_rad)) as f32,
        libm::sin(elevation_rad) as f32,
        (-horizontal * libm::cos(azimuth_rad)) as f32,
    )
}

/// Compass azimuth in [0, 2 pi) and elevation in [-pi/2, pi/2] of a unit direction, both in radians; the inverse of
/// [`direction_from_azimuth_elevation`].
#[must_use]
pub fn azimuth_elevation_from_direction(direction: Vec3) -> (f32, f32) {
    let azimuth = libm::atan2f(direction.x, -direction.z);
    (if azimuth < 0.0 { azimuth + TAU } else { azimuth }, libm::asinf(direction.y.clamp(-1.0, 1.0)))
}

/// Solid angle in steradians of a cone of the given half-angle.
#[must_use]
pub fn cone_solid_angle(half_angle_rad: f32) -> f32 {
    // 2 pi (1 - cos a) written as 4 pi sin^2(a/2), which keeps its digits for the sun's quarter of a degree
    let s = libm::sinf(half_angle_rad * 0.5);
    4.0 * PI * s * s
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_fibonacci_sphere_integrates_low_orders() {
        let directions = fibonacci_sphere(2048);
        let mean: Vec3 = directions.iter().sum::<Vec3>() / 2048.0;
        assert!(mean.length() < 1e-3, "{mean}");
        let mean_x2 = directions.iter().map(|d| d.x * d.x).sum::<f32>() / 2048.0;
        assert!((mean_x2 - 1.0 / 3.0).abs() < 1e-3);
        assert!(directions.iter().all(|d| (d.length() - 1.0).abs() < 1e-6));
    }

    #[test]
    fn north_is_minus_z_and_east_is_plus_x() {
        assert!((direction_from_azimuth_elevation(0.0, 0.0) - Vec3::NEG_Z).length() < 1e-6);
        assert!((direction_from_azimuth_elevation(std::f64::consts::FRAC_PI_2, 0.0) - Vec3::X).length() < 1e-6);
        for d in fibonacci_sphere(500) {
            let (azimuth, elevation) = azimuth_elevation_from_direction(d);
            let back = direction_from_azimuth_elevation(f64::from(azimuth), f64::from(elevation));
            assert!((back - d).length() < 2e-6);
        }
    }

    #[test]
    fn cosine_samples_have_mean_cosine_two_thirds() {
        let n = Vec3::new(0.6, 0.0, 0.8);
        for sample in [sample_cosine_hemisphere, concentric_cosine_hemisphere] {
            let mut rng = crate::random::Pcg32::new(1, 1);
            let mean = (0..20_000).map(|_| sample(n, [rng.next_f32(), rng.next_f32()]).dot(n)).sum::<f32>() / 20_000.0;
            // the cosine's variance under this density is 1/18
            assert!((mean - 2.0 / 3.0).abs() < 5.0 * (1.0_f32 / 18.0 / 20_000.0).sqrt());
        }
    }

    #[test]
    fn what_is_near_in_the_square_stays_near_and_directions_are_unit() {
        let steps = 64;
        let at = |i: usize, j: usize| concentric_cosine_hemisphere(Vec3::Y, [i, j].map(|k| (k as f32 + 0.5) / steps as f32));
        for (i, j) in (1..steps).flat_map(|i| (0..steps).map(move |j| (i, j))) {
            let (here, beside, below) = (at(i, j), at(i - 1, j), at(j, i - 1));
            assert!((here.length() - 1.0).abs() < 1e-6);
            // on the disc by 4 / pi of a step of the square, which is two wide, at most a little more
            let flat = |v: Vec3| glam::Vec2::new(v.x, v.z);
            assert!(flat(here - beside).length() < 1.5 * 2.0 / steps as f32, "{i} {j}");
            assert!(flat(at(j, i) - below).length() < 1.5 * 2.0 / steps as f32, "{i} {j}");
        }
        assert!((concentric_cosine_hemisphere(Vec3::Y, [0.5; 2]) - Vec3::Y).length() < 1e-6);
    }

    #[test]
    fn the_whole_sphere_is_four_pi() {
        assert!((cone_solid_angle(PI) - 4.0 * PI).abs() < 1e-5);
    }
}
