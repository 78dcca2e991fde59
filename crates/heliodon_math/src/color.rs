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

#[cfg(test)]
mod tests {
    use super::*;

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
