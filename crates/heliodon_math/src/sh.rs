//! Real orthonormal spherical harmonics without the Condon-Shortley phase, index `l*l + l + m`.
//!
//! Axes: the polar axis of the textbooks is our **+Z** component; `y_1 = (y_{1,-1}, y_{1,0}, y_{1,1})` is proportional to
//! `(y, z, x)`, as in Ramamoorthi and Hanrahan, "An Efficient Representation for Irradiance Environment Maps", SIGGRAPH 2001.

use glam::Vec3;

/// The most coefficients that are used: three bands.
pub const MAX_COEFFICIENTS: usize = 9;

/// `integral max(cos, 0) y / pi` per band: what a Lambertian surface keeps of a band, divided by pi (ibid., equation 8).
/// A surface with normal n in the open has `T_i = COSINE_LOBE[l] * y_i(n)`.
pub const COSINE_LOBE_OVER_PI: [f32; 3] = [1.0, 2.0 / 3.0, 0.25];

/// All nine basis functions at the unit direction `d`.
#[must_use]
#[inline]
pub fn basis9(d: Vec3) -> [f32; 9] {
    let (x, y, z) = (d.x, d.y, d.z);
    [
        0.282_094_8,
        0.488_602_5 * y,
        0.488_602_5 * z,
        0.488_602_5 * x,
        1.092_548_4 * (x * y),
        1.092_548_4 * (y * z),
        0.315_391_57 * (3.0 * z * z - 1.0),
        1.092_548_4 * (x * z),
        0.546_274_2 * (x * x - y * y),
    ]
}

/// The band l of coefficient `index`.
#[must_use]
pub fn band(index: usize) -> usize {
    match index {
        0 => 0,
        1..=3 => 1,
        _ => 2,
    }
}

/// Coefficient `T_i` of an unoccluded surface with unit normal `n`: `1/pi integral max(n.w, 0) y_i(w) dw`, exactly.
#[must_use]
pub fn open_transfer9(n: Vec3) -> [f32; 9] {
    let y = basis9(n);
    std::array::from_fn(|i| y[i] * COSINE_LOBE_OVER_PI[band(i)])
}

/// Radiance of the sky that `coefficients` describe (4 or 9 per colour), in direction `d`. May be negative.
#[must_use]
pub fn radiance(coefficients: &[Vec3], d: Vec3) -> Vec3 {
    coefficients.iter().zip(basis9(d)).map(|(&c, y)| c * y).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sphere::fibonacci_sphere;
    use std::f32::consts::PI;

    #[test]
    fn the_basis_is_orthonormal() {
        let directions = fibonacci_sphere(20_000);
        let weight = 4.0 * PI / 20_000.0;
        for i in 0..9 {
            for j in 0..9 {
                let dot: f64 = directions.iter().map(|&d| f64::from(basis9(d)[i] * basis9(d)[j] * weight)).sum();
                let expected = if i == j { 1.0 } else { 0.0 };
                assert!((dot - expected).abs() < 1e-3, "<y{i}, y{j}> = {dot}");
            }
        }
    }

    #[test]
    fn an_open_surface_keeps_the_cosine_lobe() {
        let n = Vec3::new(0.48, 0.6, 0.64);
        let directions = fibonacci_sphere(50_000);
        let weight = 4.0 / 50_000.0; // 4 pi / count, divided by pi
        for (i, exact) in open_transfer9(n).into_iter().enumerate() {
            let sum: f32 = directions.iter().map(|&d| n.dot(d).max(0.0) * basis9(d)[i] * weight).sum();
            assert!((sum - exact).abs() < 2e-3, "T{i}: {sum} against {exact}");
        }
    }

    #[test]
    fn a_uniform_sky_of_one_gives_an_open_vertex_one() {
        let s0 = (4.0 * PI).sqrt(); // integral of y_0 over the sphere
        assert!((open_transfer9(Vec3::Y)[0] * s0 - 1.0).abs() < 1e-6);
    }
}
