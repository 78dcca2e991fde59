//! The sky's coefficients: `S_i = integral L(w) y_i(w) dw`, by sums over pixels weighted with their solid angles.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// The nine basis functions of `heliodon_math::sh::basis9`, in f64.
#[must_use]
pub fn basis9_f64(d: DVec3) -> [f64; 9] {
    // sqrt(1 / 4 pi), sqrt(3 / 4 pi), sqrt(15 / 4 pi), sqrt(5 / 16 pi), sqrt(15 / 16 pi)
    const Y0: f64 = 0.282_094_791_773_878_14;
    const Y1: f64 = 0.488_602_511_902_919_9;
    const Y2: f64 = 1.092_548_430_592_079_2;
    const Y20: f64 = 0.315_391_565_252_520_05;
    const Y22: f64 = 0.546_274_215_296_039_6;
    let (x, y, z) = (d.x, d.y, d.z);
    [Y0, Y1 * y, Y1 * z, Y1 * x, Y2 * x * y, Y2 * y * z, Y20 * (3.0 * z * z - 1.0), Y2 * x * z, Y22 * (x * x - y * y)]
}

/// Sums the rows' contributions in their order, so that the bits do not depend on the number of threads. `row(y, add)` calls `add(direction,
/// radiance times solid angle)`.
pub(crate) fn sum_rows<F>(height: u32, coefficients: usize, row: F) -> Vec<Vec3>
where
    F: Fn(u32, &mut dyn FnMut(DVec3, DVec3)) + Sync,
{
    let rows: Vec<[DVec3; 9]> = (0..height)
        .into_par_iter()
        .map(|y| {
            let mut sums = [DVec3::ZERO; 9];
            row(y, &mut |direction, flux| {
                let basis = basis9_f64(direction);
                for (sum, value) in sums.iter_mut().zip(basis).take(coefficients) {
                    *sum += flux * value;
                }
            });
            sums
        })
        .collect();
    let mut total = [DVec3::ZERO; 9];
    for sums in rows {
        total.iter_mut().zip(sums).for_each(|(t, s)| *t += s);
    }
    total.iter().take(coefficients).map(|t| t.as_vec3()).collect()
}
