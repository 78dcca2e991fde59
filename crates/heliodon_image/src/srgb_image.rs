//! The 8-bit image.

use crate::error::{self, COPY_AGAIN, ImageError, check_expansion, check_size};
use crate::{MAX_SRGB_PIXELS, TextureWrap};
use glam::Vec4;
use heliodon_math::color::linear_from_srgb;
use image::{ImageDecoder, ImageFormat, ImageReader, Limits};
use std::io::Cursor;
use std::path::Path;
use std::sync::LazyLock;

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

/// Deflate and JPEG's coding of flat blocks expand at most about a thousandfold.
const MAX_EXPANSION: u64 = 1100;

static LINEAR: LazyLock<[f32; 256]> = LazyLock::new(|| std::array::from_fn(|code| linear_from_srgb(code as f32 / 255.0)));

impl SrgbImage {
    /// An image of one colour.
    #[must_use]
    pub fn filled(width: u32, height: u32, color: [u8; 4]) -> Self {
        Self { width, height, pixels: vec![color; width as usize * height as usize] }
    }

    /// Reads a PNG or JPEG file, told apart by their first bytes. Grey becomes RGB, 16 bits become 8, no alpha becomes 255.
    ///
    /// # Errors
    /// Where the file cannot be read, is no such image, or is broken.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, ImageError> {
        let (bytes, name) = error::read_file(path.as_ref())?;
        Self::from_bytes(&bytes, &name)
    }

    /// Decodes a file's bytes; `name` is for error messages.
    ///
    /// # Errors
    /// As [`SrgbImage::read`].
    pub fn from_bytes(bytes: &[u8], name: &str) -> Result<Self, ImageError> {
        let format = if bytes.starts_with(b"\x89PNG\r\n\x1a\n") {
            ImageFormat::Png
        } else if bytes.starts_with(&[0xff, 0xd8, 0xff]) {
            ImageFormat::Jpeg
        } else {
            return Err(ImageError::UnknownFormat { name: name.into() });
        };
        let broken = |e: image::ImageError| ImageError::malformed(name, "its pixels", e.to_string(), COPY_AGAIN);
        let mut limits = Limits::default();
        // 8 bytes a pixel: the decoder's own 16-bit RGBA
        limits.max_alloc = Some(MAX_SRGB_PIXELS * 8);
        let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
        reader.limits(limits);
        let decoder = reader.into_decoder().map_err(broken)?;
        let (width, height) = decoder.dimensions();
        check_size(name, "the size in its header", u64::from(width), u64::from(height), MAX_SRGB_PIXELS)?;
        check_expansion(name, decoder.total_bytes(), bytes.len(), MAX_EXPANSION)?;
        let decoded = image::DynamicImage::from_decoder(decoder).map_err(broken)?.into_rgba8();
        // in place where the allocation's capacity allows it: an atlas takes up to a gigabyte
        let pixels = bytemuck::allocation::try_cast_vec(decoded.into_raw())
            .unwrap_or_else(|(_, raw)| raw.chunks_exact(4).map(|p| [p[0], p[1], p[2], p[3]]).collect());
        Ok(Self { width, height, pixels })
    }

    /// Writes a PNG file.
    ///
    /// # Errors
    /// Where the file cannot be written.
    pub fn write_png(&self, path: impl AsRef<Path>) -> Result<(), ImageError> {
        let path = path.as_ref();
        let bytes = self.to_png_bytes().map_err(|e| ImageError::write(path, e))?;
        std::fs::write(path, bytes).map_err(|e| ImageError::write(path, e))
    }

    /// The bytes of a PNG file: RGB where every pixel is opaque, else RGBA.
    ///
    /// # Errors
    /// Where the image's size and its number of pixels disagree or are zero.
    pub fn to_png_bytes(&self) -> Result<Vec<u8>, ImageError> {
        let mut out = Cursor::new(Vec::new());
        let opaque = self.pixels.iter().all(|p| p[3] == 255);
        let written = if opaque {
            // a vector that is collected grows by doubling, and holds both its sizes meanwhile
            let mut rgb = Vec::with_capacity(3 * self.pixels.len());
            rgb.extend(self.pixels.iter().flat_map(|p| [p[0], p[1], p[2]]));
            image::RgbImage::from_raw(self.width, self.height, rgb).map(|i| i.write_to(&mut out, ImageFormat::Png))
        } else {
            let rgba = bytemuck::cast_slice(&self.pixels).to_vec();
            image::RgbaImage::from_raw(self.width, self.height, rgba).map(|i| i.write_to(&mut out, ImageFormat::Png))
        };
        match written {
            Some(Ok(())) => Ok(out.into_inner()),
            Some(Err(e)) => Err(ImageError::Write { name: "PNG".into(), problem: e.to_string() }),
            None => Err(ImageError::Write { name: "PNG".into(), problem: "size and pixels disagree".into() }),
        }
    }

    /// The pixel in column `x` of row `y`.
    ///
    /// # Panics
    /// Outside of the image.
    #[must_use]
    #[inline]
    pub fn pixel(&self, x: u32, y: u32) -> [u8; 4] {
        self.pixels[y as usize * self.width as usize + x as usize]
    }

    /// The linear RGB of a pixel, and its alpha in [0, 1].
    #[must_use]
    #[inline]
    pub fn linear(&self, x: u32, y: u32) -> Vec4 {
        let [r, g, b, a] = self.pixel(x, y);
        let table = &*LINEAR;
        Vec4::new(table[usize::from(r)], table[usize::from(g)], table[usize::from(b)], f32::from(a) / 255.0)
    }

    /// Linear RGB and alpha at texture coordinates (u to the right, v down from the top left, as in glTF), going on outside of [0, 1]
    /// along u and v as `wrap` says, interpolated between the four nearest pixels in linear light. Transparent black where the image is
    /// empty or a coordinate is not finite.
    #[must_use]
    pub fn sample_bilinear(&self, u: f32, v: f32, wrap: [TextureWrap; 2]) -> Vec4 {
        if self.pixels.is_empty() || !(u.is_finite() && v.is_finite()) {
            return Vec4::ZERO;
        }
        let (x0, x1, fx) = wrap[0].taps(u, self.width);
        let (y0, y1, fy) = wrap[1].taps(v, self.height);
        let top = self.linear(x0, y0).lerp(self.linear(x1, y0), fx);
        let bottom = self.linear(x0, y1).lerp(self.linear(x1, y1), fx);
        top.lerp(bottom, fy)
    }
}
