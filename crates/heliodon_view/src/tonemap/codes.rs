//! From linear light to 8-bit sRGB codes on the processor: quickly, and with a dither.
//!
//! Rounded to 256 codes, an evening sky has bands that show. A dither of one code before rounding makes them a grain that does
//! not: Jorge Jimenez's interleaved gradient noise ("Next Generation Post Processing in Call of Duty: Advanced Warfare", 2014),
//! which depends on the pixel alone, so that the same picture is the same bits. The shaders dither likewise (display.wgsl).

use glam::Vec3;
use heliodon_math::color::srgb_from_linear;
use std::sync::OnceLock;

/// Steps of the table from linear light to codes: between two of them, straight lines are off by 1/1000 of a code at most.
const STEPS: usize = 1 << 14;

/// How much of a code the dither takes: a hair less than one, so that light which is a code already keeps it.
const DITHER: f32 = 0.99;

/// Codes, not rounded, of linear light from 0 to 1, and one more for what lies at the end.
fn table() -> &'static [f32] {
    static TABLE: OnceLock<Vec<f32>> = OnceLock::new();
    TABLE.get_or_init(|| (0..=STEPS + 1).map(|i| 255.0 * srgb_from_linear((i as f32 / STEPS as f32).min(1.0))).collect())
}

/// What the code of linear light is before it is rounded.
fn code(linear: f32) -> f32 {
    let table = table();
    let at = linear.clamp(0.0, 1.0) * STEPS as f32;
    let below = at as usize;
    table[below] + (table[below + 1] - table[below]) * (at - below as f32)
}

/// The nearest sRGB codes.
pub(crate) fn nearest(linear: Vec3) -> [u8; 3] {
    linear.to_array().map(|v| (code(v) + 0.5) as u8)
}

/// The sRGB codes of a pixel, dithered by its place in the picture.
#[must_use]
pub fn dithered(linear: Vec3, x: u32, y: u32) -> [u8; 3] {
    let grain = 0.5 + DITHER * noise(x, y);
    linear.to_array().map(|v| (code(v) + grain) as u8)
}

/// In [-1/2, 1/2), even over any few neighbours.
fn noise(x: u32, y: u32) -> f32 {
    (52.982_918 * (0.067_110_56 * x as f32 + 0.005_837_15 * y as f32).fract()).fract() - 0.5
}

#[cfg(test)]
mod tests {
    use super::*;
    use heliodon_math::color::{linear_from_srgb, linear_from_srgb8_table};

    #[test]
    fn every_code_survives() {
        for (code, linear) in linear_from_srgb8_table().into_iter().enumerate() {
            let wanted = [code as u8; 3];
            assert_eq!(nearest(Vec3::splat(linear)), wanted);
            for at in 0..4096 {
                assert_eq!(dithered(Vec3::splat(linear), at % 64, at / 64), wanted, "at {at}");
            }
        }
        assert_eq!(nearest(Vec3::new(-1.0, 2.0, f32::NAN)), [0, 255, 0]);
    }

    #[test]
    fn a_gradient_finer_than_codes_is_kept_in_the_mean() {
        for wanted in (0..100).map(|i| 80.0 + f64::from(i) * 0.03) {
            let linear = Vec3::splat(linear_from_srgb(wanted as f32 / 255.0));
            let sum: f64 = (0..32 * 32).map(|at| f64::from(dithered(linear, 700 + at % 32, 90 + at / 32)[0])).sum();
            let mean = sum / (32.0 * 32.0);
            assert!((mean - wanted).abs() < 0.03, "{mean} for {wanted}");
            assert!((f64::from(nearest(linear)[0]) - wanted).abs() <= 0.501);
        }
    }
}
