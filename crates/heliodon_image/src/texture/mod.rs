//! Pictures into textures that load fastest: blocks as devices draw them, with all their smaller versions, and nothing packed.
//!
//! 8-bit pictures become BC7: colours coded as sRGB, numbers and normals linear. Pictures of floats become BC6H. Both take a byte a texel, a quarter or an eighth of
//! what they unpack to otherwise, and a third more for the smaller versions.
//!
//! Smaller versions are means over what a texel covers, of sides that are not even, too. Colours are averaged in linear light and by their alpha, so that nothing that
//! cannot be seen bleeds into an edge; numbers each for itself; normals as directions, made unit again.
//!
//! Why BC7 for normals and not BC5: it keeps all three components, so that shaders that know normal maps as glTF means them read them as they are.

mod mips;

use crate::bc6h::{decode_bc6h, encode_bc6h};
use crate::ktx2::{Ktx2, TexelFormat, halved};
use crate::{Bc7Quality, HdrImage, ImageError, Picture, SrgbImage, decode_bc7, encode_bc7};
use glam::Vec3;
use mips::smaller;
use rayon::prelude::*;

/// What files that are written here say of who wrote them, by the key `KTXwriter`.
pub const WRITER: &str = "Heliodon convert";
/// The largest that a BC6H texel can be.
const BRIGHTEST: f32 = 65_504.0;

/// What a picture's numbers are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TextureUse {
    /// Colours coded as sRGB, and alpha.
    #[default]
    Color,
    /// Numbers as they are: masks, heights, roughness.
    Data,
    /// Directions: red, green and blue from -1 to 1.
    NormalMap,
}

/// How a texture is made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TextureParams {
    /// What the picture's numbers are; floats are linear colours whatever is said here.
    pub usage: TextureUse,
    /// How long is searched for good blocks. [`Bc7Quality::Best`] takes some four times as long as the usual, and is a quarter less off.
    pub quality: Bc7Quality,
    /// Whether there is the picture alone, without smaller versions.
    pub alone: bool,
}

/// How far a texture is from its picture, without smaller versions.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TextureError {
    /// Root of the mean square: of a component's range, for floats of a pixel's brightest component.
    pub rms: f64,
    /// The greatest.
    pub greatest: f64,
}

/// The texture of a picture.
///
/// # Errors
/// Pictures without pixels, or larger than 16,384 along a side; `name` is theirs in the message.
pub fn texture(picture: &Picture, params: &TextureParams, name: &str) -> Result<Ktx2, ImageError> {
    let [width, height] = picture.size();
    let format = match (picture, params.usage) {
        (Picture::Hdr(_), _) => TexelFormat::Bc6h,
        (Picture::Eight(_), TextureUse::Color) => TexelFormat::Bc7Srgb,
        (Picture::Eight(_), _) => TexelFormat::Bc7,
    };
    let mut texture = Ktx2 { format, width, height, layers: 1, levels: Vec::new() };
    texture.check_size(name)?;
    texture.levels = match picture {
        Picture::Hdr(image) => hdr_levels(image, params.alone),
        Picture::Eight(image) => {
            let base = encode_bc7(&image.pixels, width, height, params.quality);
            let encode = |level: SrgbImage| encode_bc7(&level.pixels, level.width, level.height, params.quality);
            let more = if params.alone { Vec::new() } else { smaller(image, params.usage) };
            std::iter::once(base).chain(more.into_iter().map(encode)).collect()
        }
    };
    Ok(texture)
}

fn hdr_levels(image: &HdrImage, alone: bool) -> Vec<Vec<u8>> {
    let mut levels = vec![encode_bc6h(image)];
    let mut last = image.clone();
    while !alone && (last.width > 1 || last.height > 1) {
        last = halved(&last);
        levels.push(encode_bc6h(&last));
    }
    levels
}

/// The bytes of its file.
///
/// # Errors
/// As [`texture`].
pub fn texture_bytes(texture: &Ktx2, name: &str) -> Result<Vec<u8>, ImageError> {
    texture.to_plain_bytes(&[("KTXorientation", "rd"), ("KTXwriter", WRITER)], name)
}

/// How far a texture that was made here is off.
#[must_use]
pub fn texture_error(picture: &Picture, texture: &Ktx2) -> TextureError {
    let Some(base) = texture.levels.first() else { return TextureError::default() };
    let offs: Vec<f64> = match picture {
        Picture::Eight(image) => {
            let back = decode_bc7(base, texture.width, texture.height);
            let off =
                |(a, b): (&[u8; 4], &[u8; 4])| (0..4).map(|k| f64::from(a[k].abs_diff(b[k])) / 255.0).fold((0.0, 0.0_f64), add);
            return summed(image.pixels.par_iter().zip(&back).map(off).collect(), 4.0);
        }
        Picture::Hdr(image) => {
            let back = decode_bc6h(base, texture.width, texture.height);
            image.pixels.par_iter().zip(&back.pixels).map(|(a, b)| relative(*a, *b)).collect()
        }
    };
    summed(offs.into_iter().map(|off| (off * off, off)).collect(), 1.0)
}

fn add((sum, most): (f64, f64), off: f64) -> (f64, f64) {
    (sum + off * off, most.max(off))
}

fn summed(parts: Vec<(f64, f64)>, each: f64) -> TextureError {
    let (sum, greatest) = parts.iter().fold((0.0, 0.0_f64), |(sum, most), (square, off)| (sum + square, most.max(*off)));
    TextureError { rms: (sum / (each * parts.len().max(1) as f64)).sqrt(), greatest }
}

/// Of the brightest component, as far as the format reaches.
fn relative(a: Vec3, b: Vec3) -> f64 {
    let a = a.min(Vec3::splat(BRIGHTEST));
    // what is darker than the halves' smallest normal number has no digits to lose
    f64::from((a - b).abs().max_element() / a.max_element().max(6.2e-5))
}

/// How many pixels are brighter than the format can say.
#[must_use]
pub fn clipped(picture: &Picture) -> u64 {
    match picture {
        Picture::Hdr(image) => image.pixels.iter().filter(|pixel| pixel.max_element() > BRIGHTEST).count() as u64,
        Picture::Eight(_) => 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ramp(width: u32, height: u32) -> SrgbImage {
        let at = |i: u32| [(i % width * 200 / width) as u8, (i / width * 200 / height) as u8, 90, 255];
        SrgbImage { width, height, pixels: (0..width * height).map(at).collect() }
    }

    #[test]
    fn every_kind_comes_back_from_its_file() {
        let hdr = HdrImage::from_fn(37, 20, |x, y| Vec3::new(1.0, 0.8, 0.5) * (0.3 + x as f32 * 0.01 + y as f32 * 0.005));
        for (picture, usage, format, most) in [
            (Picture::Eight(ramp(37, 20)), TextureUse::Color, TexelFormat::Bc7Srgb, 0.02),
            (Picture::Eight(ramp(64, 64)), TextureUse::Data, TexelFormat::Bc7, 0.02),
            (Picture::Eight(ramp(1, 5)), TextureUse::NormalMap, TexelFormat::Bc7, 0.03),
            (Picture::Hdr(hdr), TextureUse::Color, TexelFormat::Bc6h, 0.01),
        ] {
            let params = TextureParams { usage, ..TextureParams::default() };
            let made = texture(&picture, &params, "a").unwrap();
            let bytes = texture_bytes(&made, "a").unwrap();
            let back = Ktx2::from_bytes(&bytes, "a").unwrap();
            assert_eq!(back, made);
            assert_eq!((back.format, [back.width, back.height]), (format, picture.size()));
            let longest = picture.size().into_iter().max().unwrap();
            assert_eq!(back.levels.len() as u32, longest.ilog2() + 1);
            assert_eq!(Ktx2::text_of(&bytes, "KTXwriter"), Some(WRITER));
            let error = texture_error(&picture, &back);
            assert!(error.rms > 0.0 && error.rms < most && error.greatest < 6.0 * most, "{format:?}: {error:?}");
            let alone = texture(&picture, &TextureParams { alone: true, ..params }, "a").unwrap();
            assert_eq!(alone.levels[..], made.levels[..1]);
        }
    }

    #[test]
    fn what_is_no_texture_is_refused() {
        let empty = Picture::Eight(SrgbImage { width: 0, height: 3, pixels: Vec::new() });
        assert!(texture(&empty, &TextureParams::default(), "a").is_err());
        let wide = Picture::Eight(SrgbImage::filled(20_000, 1, [0; 4]));
        assert!(texture(&wide, &TextureParams::default(), "a").unwrap_err().to_string().contains("16,384"));
        let bright = Picture::Hdr(HdrImage::filled(2, 1, Vec3::new(1.0, 1e6, 0.0)));
        assert_eq!(clipped(&bright), 2);
    }
}
