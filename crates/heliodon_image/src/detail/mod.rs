//! Detail textures: fine patterns that are multiplied onto a surface which is seen from near, where its own texture or its vertex
//! colours have nothing more to show.
//!
//! Papaioannou, Gaitatzes, Christopoulos, "Enhancing Virtual Reality Walkthroughs of Archaeological Sites", VAST 2003, section 2.4.
//! "Components from 0 to 127 darken the surface; 128 has no effect; and 129 to 255 brighten it." Hence, exactly:
//!
//! ```text
//! factor(code)  = code / 128                                   in [0, 255/128]
//! albedo_linear = albedo_linear * (1 + weight * (factor - 1))  weight in [0, 1] fades the detail in from near
//! ```
//!
//! A code is a number, not a colour: it is neither encoded nor decoded as sRGB, and it multiplies **linear** albedo. On a GPU it is a texel of
//! an `R8Unorm` texture that repeats, `factor = texel * (255.0 / 128.0)`.
//!
//! The mean of all codes is exactly 128 on every mip level, so that the light which a wall sends out, averaged over a tile, is the same with and
//! without its detail: nothing brightens or darkens where the detail fades in or out, the fault that the paper warns of. It is linear light
//! in which this holds; were codes multiplied onto sRGB values, a wall would brighten by the variance of its detail.
//!
//! What is generated tiles in both directions without a seam, and is the same to the bit on every platform: sums in a fixed
//! order, integers for randomness, and libm.

mod error;
mod field;
mod generate;
mod import;
mod mips;
mod noise;
mod plaster;
mod preview;
mod quantise;
mod seam;
mod stone;
mod wood;

pub use error::DetailError;
pub use generate::{DetailKind, DetailParams};
pub use import::{DetailImport, ImportedDetail};
pub use mips::DetailLevel;
pub use seam::{Seam, SeamVerdict};

use crate::ImageError;
use image::{GrayImage, ImageFormat};
use std::io::Cursor;
use std::path::Path;

/// The code that leaves a surface as it is.
pub const NEUTRAL: u8 = 128;

/// The smallest side, in texels: below it a texture repeats within a hand's width.
pub const MIN_SIDE: u32 = 16;

/// The largest side, in texels: above it, it is no detail any more but a texture.
pub const MAX_SIDE: u32 = 2048;

/// What a code multiplies linear albedo with: in [0, 255/128], exactly 1 for [`NEUTRAL`].
#[must_use]
#[inline]
pub fn factor(code: u8) -> f32 {
    f32::from(code) / f32::from(NEUTRAL)
}

/// A detail texture: 8-bit factors that repeat in both directions, and whose mean is exactly [`NEUTRAL`].
///
/// Both sides are powers of two from [`MIN_SIDE`] to [`MAX_SIDE`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DetailTexture {
    width: u32,
    height: u32,
    codes: Vec<u8>,
}

impl DetailTexture {
    /// Columns.
    #[must_use]
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Rows.
    #[must_use]
    pub fn height(&self) -> u32 {
        self.height
    }

    /// `width * height` codes, row-major from the top left. [`factor`] says what they do.
    #[must_use]
    pub fn codes(&self) -> &[u8] {
        &self.codes
    }

    /// The standard deviation of the codes, in codes: 0 to 128. Divided by 128, that of the factors.
    #[must_use]
    pub fn contrast(&self) -> f32 {
        // integers: the same for any order
        let squares: u64 = self.codes.iter().map(|&code| u64::from(code.abs_diff(NEUTRAL)).pow(2)).sum();
        libm::sqrt(squares as f64 / self.codes.len().max(1) as f64) as f32
    }

    /// The share of codes at the ends of what 8 bits hold, 0 and 255: in [0, 1].
    #[must_use]
    pub fn share_at_limits(&self) -> f32 {
        let at_limits = self.codes.iter().filter(|&&code| code == 0 || code == u8::MAX).count();
        at_limits as f32 / self.codes.len().max(1) as f32
    }

    /// Whether all that is promised here holds: sides, number of codes, exact mean.
    ///
    /// # Errors
    /// What does not hold. Nothing that this module makes gives any.
    pub fn validate(&self) -> Result<(), DetailError> {
        error::check_sides("the detail texture", self.width, self.height)?;
        let sum: u64 = self.codes.iter().map(|&code| u64::from(code)).sum();
        let count = u64::from(self.width) * u64::from(self.height);
        if self.codes.len() as u64 != count {
            return Err(DetailError::Broken { name: "the detail texture".into(), width: self.width, height: self.height });
        }
        if sum != count * u64::from(NEUTRAL) {
            return Err(DetailError::Mean { name: "the detail texture".into(), mean: sum as f64 / count as f64 });
        }
        Ok(())
    }

    /// The bytes of a PNG file: grey, 8 bits, no gamma.
    ///
    /// # Errors
    /// Where the encoder fails.
    pub fn to_png_bytes(&self) -> Result<Vec<u8>, ImageError> {
        let failed = |problem: String| ImageError::Write { name: "PNG".into(), problem };
        let image = GrayImage::from_raw(self.width, self.height, self.codes.clone())
            .ok_or_else(|| failed("size and pixels disagree".into()))?;
        let mut out = Cursor::new(Vec::new());
        image.write_to(&mut out, ImageFormat::Png).map_err(|e| failed(e.to_string()))?;
        Ok(out.into_inner())
    }

    /// Writes a PNG file, which [`DetailTexture::read`] reads as the same codes.
    ///
    /// # Errors
    /// Where the file cannot be written.
    pub fn write_png(&self, path: impl AsRef<Path>) -> Result<(), ImageError> {
        let path = path.as_ref();
        let bytes = self.to_png_bytes().map_err(|e| ImageError::write(path, e))?;
        std::fs::write(path, bytes).map_err(|e| ImageError::write(path, e))
    }
}
