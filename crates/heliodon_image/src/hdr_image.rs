//! The linear floating-point image.

use crate::error::{self, ImageError};
use crate::{openexr, radiance};
use glam::Vec3;
use std::path::Path;

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

/// How many colour components of an image were no radiance, and were replaced on reading.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PixelRepairs {
    /// NaN: became 0.
    pub nan: u64,
    /// Infinite: became the largest finite component of the image, at least 65,504 (the largest half float: where
    /// an OpenEXR file of halves was clipped).
    pub infinite: u64,
    /// Below zero: became 0.
    pub negative: u64,
}

impl PixelRepairs {
    /// Whether nothing needed repair.
    #[must_use]
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }
}

impl HdrImage {
    /// An image of one colour.
    #[must_use]
    pub fn filled(width: u32, height: u32, color: Vec3) -> Self {
        Self { width, height, pixels: vec![color; width as usize * height as usize] }
    }

    /// An image of `color(x, y)`.
    #[must_use]
    pub fn from_fn(width: u32, height: u32, mut color: impl FnMut(u32, u32) -> Vec3) -> Self {
        let mut pixels = Vec::with_capacity(width as usize * height as usize);
        for y in 0..height {
            for x in 0..width {
                pixels.push(color(x, y));
            }
        }
        Self { width, height, pixels }
    }

    /// Reads a Radiance (.hdr, .pic) or OpenEXR file, told apart by their first bytes. Components that are no radiance are
    /// replaced as [`PixelRepairs`] says.
    ///
    /// # Errors
    /// Where the file cannot be read, is no such image, or is broken.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, ImageError> {
        Self::read_counted(path).map(|(image, _)| image)
    }

    /// As [`HdrImage::read`], and tells what was replaced.
    ///
    /// # Errors
    /// As [`HdrImage::read`].
    pub fn read_counted(path: impl AsRef<Path>) -> Result<(Self, PixelRepairs), ImageError> {
        let (bytes, name) = error::read_file(path.as_ref())?;
        Self::from_bytes_counted(&bytes, &name)
    }

    /// Decodes a file's bytes; `name` is for error messages.
    ///
    /// # Errors
    /// As [`HdrImage::read`].
    pub fn from_bytes(bytes: &[u8], name: &str) -> Result<Self, ImageError> {
        Self::from_bytes_counted(bytes, name).map(|(image, _)| image)
    }

    /// As [`HdrImage::from_bytes`], and tells what was replaced.
    ///
    /// # Errors
    /// As [`HdrImage::read`].
    pub fn from_bytes_counted(bytes: &[u8], name: &str) -> Result<(Self, PixelRepairs), ImageError> {
        let mut image = if bytes.starts_with(b"#?") {
            radiance::decode(bytes, name)?
        } else if bytes.starts_with(&openexr::MAGIC) {
            openexr::decode(bytes, name)?
        } else {
            return Err(ImageError::UnknownFormat { name: name.into() });
        };
        let repairs = repair(&mut image.pixels);
        Ok((image, repairs))
    }

    /// Writes a Radiance file with run lengths (8 bits a component and a shared exponent: about 1 % of the largest component).
    /// Negative and NaN components become 0.
    ///
    /// # Errors
    /// Where the file cannot be written.
    pub fn write_hdr(&self, path: impl AsRef<Path>) -> Result<(), ImageError> {
        let path = path.as_ref();
        std::fs::write(path, self.to_hdr_bytes()).map_err(|e| ImageError::write(path, e))
    }

    /// The bytes that [`HdrImage::write_hdr`] writes.
    #[must_use]
    pub fn to_hdr_bytes(&self) -> Vec<u8> {
        radiance::encode(self)
    }

    /// Writes an OpenEXR file of 32-bit floats, losslessly.
    ///
    /// # Errors
    /// Where the file cannot be written.
    pub fn write_exr(&self, path: impl AsRef<Path>) -> Result<(), ImageError> {
        self.write_exr_as(path, crate::ExrSamples::Float)
    }

    /// Writes an OpenEXR file, ZIP compressed, of half or full floats.
    ///
    /// # Errors
    /// Where the file cannot be written.
    pub fn write_exr_as(&self, path: impl AsRef<Path>, samples: crate::ExrSamples) -> Result<(), ImageError> {
        let path = path.as_ref();
        let bytes = openexr::encode(self, samples).map_err(|e| ImageError::write(path, e))?;
        std::fs::write(path, bytes).map_err(|e| ImageError::write(path, e))
    }

    /// The pixel in column `x` of row `y`.
    ///
    /// # Panics
    /// Outside of the image.
    #[must_use]
    #[inline]
    pub fn pixel(&self, x: u32, y: u32) -> Vec3 {
        self.pixels[y as usize * self.width as usize + x as usize]
    }
}

/// Replaces what is no radiance.
pub(crate) fn repair(pixels: &mut [Vec3]) -> PixelRepairs {
    let mut repairs = PixelRepairs::default();
    let mut largest = 65_504.0_f32;
    for component in pixels.iter().flat_map(|p| p.to_array()) {
        if component.is_nan() {
            repairs.nan += 1;
        } else if component == f32::INFINITY {
            repairs.infinite += 1;
        } else if component < 0.0 {
            repairs.negative += 1;
        } else {
            largest = largest.max(component);
        }
    }
    if !repairs.is_none() {
        for pixel in pixels {
            // max() takes the other operand where one is NaN, so NaN and what is below zero both become 0
            *pixel = Vec3::from_array(pixel.to_array().map(|c| c.max(0.0).min(largest)));
        }
    }
    repairs
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_radiance_is_counted_and_replaced() {
        let mut pixels =
            vec![Vec3::new(f32::NAN, 1.0, -2.0), Vec3::new(f32::INFINITY, f32::NEG_INFINITY, 3.0), Vec3::new(1e6, -0.0, 0.0)];
        let repairs = repair(&mut pixels);
        assert_eq!(repairs, PixelRepairs { nan: 1, infinite: 1, negative: 2 });
        assert_eq!(pixels[0], Vec3::new(0.0, 1.0, 0.0));
        assert_eq!(pixels[1], Vec3::new(1e6, 0.0, 3.0));
        assert_eq!(pixels[2], Vec3::new(1e6, 0.0, 0.0));
    }

    #[test]
    fn bytes_of_nothing_known_are_refused() {
        for bytes in [&b""[..], b"#", b"\x89PNG\r\n", b"hello"] {
            assert!(matches!(HdrImage::from_bytes(bytes, "x.hdr"), Err(ImageError::UnknownFormat { .. })));
        }
    }
}
