//! Linear Rec. 709 colour, its luminance, and the sRGB transfer function.

use glam::Vec3;

/// Weights of linear Rec. 709 red, green and blue in luminance (ITU-R BT.709, row Y of its RGB to XYZ matrix).
pub const LUMINANCE_REC709: Vec3 = Vec3::new(0.2126, 0.7152, 0.0722);

/// Luminance of a linear Rec. 709 colour, in the colour's own unit.
#[must_use]
pub fn luminance(linear: Vec3) -> f32 {
    linear.x * LUMINANCE_REC709.x + linear.y * LUMINANCE_REC709.y + linear.z * LUMINANCE_REC709.z
}

/// One sRGB-encoded component in [0, 1] to linear light (IEC 61966-2-1).
#[must_use]
pub fn linear_from_srgb(encoded: f32) -> f32 {
    if encoded <= 0.040_45 { encoded / 12.92 } else { libm::powf((encoded + 0.055) / 1.055, 2.4) }
}

/// One linear component to its sRGB encoding (IEC 61966-2-1); values outside [0, 1] are not clamped.
#[must_use]
pub fn srgb_from_linear(linear: f32) -> f32 {
    if linear <= 0.003_130_8 { linear * 12.92 } else { 1.055 * libm::powf(linear, 1.0 / 2.4) - 0.055 }
}

/// The linear value of each of the 256 codes of an 8-bit sRGB component.
#[must_use]
pub fn linear_from_srgb8_table() -> [f32; 256] {
    std::array::from_fn(|code| linear_from_srgb(code as f32 / 255.0))
}

/// A linear component to the nearest 8-bit sRGB code, clamped to [0, 255].
#[must_use]
pub fn srgb8_from_linear(linear: f32) -> u8 {
    (srgb_from_linear(linear.clamp(0.0, 1.0)) * 255.0 + 0.5) as u8
}

/// Bits of a mantissa, bias and largest exponent of the shared-exponent format.
const RGB9E5_MANTISSA_BITS: i32 = 9;
const RGB9E5_BIAS: i32 = 15;
const RGB9E5_MAX_EXPONENT: i32 = 31;

/// A linear colour in 32 bits: three mantissas of nine bits and a shared exponent (`VK_FORMAT_E5B9G9R9_UFLOAT_PACK32`, Khronos Data
/// Format Specification 1.3, section 11.2). Components are clamped to [0, 65,408]; the error is at most 1/512 of the largest one, or
/// 2^-25.
#[must_use]
pub fn rgb9e5_from_linear(linear: Vec3) -> u32 {
    const LARGEST: f32 = 65_408.0;
    // what is not a number is black
    let clamped = linear.to_array().map(|x| if x > 0.0 { x.min(LARGEST) } else { 0.0 });
    let largest = clamped[0].max(clamped[1]).max(clamped[2]);
    // floor(log2) of a normal number stands in its bits; what is smaller shares the smallest exponent anyway
    let floor_log2 = (largest.to_bits() >> 23) as i32 - 127;
    let mut exponent = floor_log2.max(-RGB9E5_BIAS - 1) + 1 + RGB9E5_BIAS;
    let steps = |exponent: i32, x: f32| (x / power_of_two(exponent - RGB9E5_BIAS - RGB9E5_MANTISSA_BITS) + 0.5) as u32;
    if steps(exponent, largest) == 1 << RGB9E5_MANTISSA_BITS {
        exponent += 1;
    }
    debug_assert!(exponent <= RGB9E5_MAX_EXPONENT);
    let [r, g, b] = clamped.map(|x| steps(exponent, x));
    (exponent as u32) << 27 | b << 18 | g << 9 | r
}

/// The linear colour that [`rgb9e5_from_linear`] packed.
#[must_use]
pub fn linear_from_rgb9e5(packed: u32) -> Vec3 {
    let step = power_of_two((packed >> 27) as i32 - RGB9E5_BIAS - RGB9E5_MANTISSA_BITS);
    let mantissa = |shift: u32| (packed >> shift & 0x1ff) as f32;
    Vec3::new(mantissa(0), mantissa(9), mantissa(18)) * step
}

/// `2^n` for exponents of normal numbers.
fn power_of_two(n: i32) -> f32 {
    f32::from_bits(((n + 127) as u32) << 23)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Pcg32;

    #[test]
    fn packed_colours_err_by_at_most_a_512th_of_the_largest_component() {
        let mut rng = Pcg32::new(9, 5);
        for _ in 0..10_000 {
            let size = libm::powf(2.0, rng.range_f32(-20.0, 15.9));
            let colour = Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32()) * size;
            let error = (linear_from_rgb9e5(rgb9e5_from_linear(colour)) - colour).abs().max_element();
            assert!(error <= (colour.max_element() / 512.0).max(libm::powf(2.0, -25.0)), "{colour}: {error}");
        }
        // the format's own example values and edges
        assert_eq!(rgb9e5_from_linear(Vec3::ZERO), 0);
        assert_eq!(rgb9e5_from_linear(Vec3::ONE), 16 << 27 | 256 << 18 | 256 << 9 | 256);
        assert_eq!(linear_from_rgb9e5(u32::MAX), Vec3::splat(65_408.0));
        assert_eq!(rgb9e5_from_linear(Vec3::splat(f32::INFINITY)), u32::MAX);
        assert_eq!(rgb9e5_from_linear(Vec3::new(f32::NAN, -1.0, 0.0)), 0);
    }

    #[test]
    fn every_srgb_code_survives_the_round_trip() {
        for (code, linear) in linear_from_srgb8_table().into_iter().enumerate() {
            assert_eq!(usize::from(srgb8_from_linear(linear)), code);
        }
    }

    #[test]
    fn white_has_luminance_one() {
        assert!((luminance(Vec3::ONE) - 1.0).abs() < 1e-6);
    }
}
