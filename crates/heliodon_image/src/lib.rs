//! HDR and 8-bit images: read, write, resample.
//!
//! Pixels are row-major from the top left. HDR pixels are linear Rec. 709 radiance in any consistent unit.

use glam::Vec3;

/// A linear RGB image of 32-bit floats.
#[derive(Clone, Debug, PartialEq)]
pub struct HdrImage {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// `width * height` pixels, row-major from the top left.
    pub pixels: Vec<Vec3>,
}

/// An 8-bit sRGB image with alpha.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SrgbImage {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// `width * height` pixels, row-major from the top left; alpha is linear.
    pub pixels: Vec<[u8; 4]>,
}
