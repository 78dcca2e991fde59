//! TIFF through the `tiff` crate: grey and RGB, with alpha or without, of 8 or 16 bits or of floats; as it is, or packed by LZW, deflate or run lengths.

use crate::error::{COPY_AGAIN, ImageError, check_expansion, check_size};
use crate::hdr_image::repair;
use crate::picture::told;
use crate::{HdrImage, MAX_PIXELS, MAX_SRGB_PIXELS, Picture, SrgbImage};
use ::tiff::ColorType;
use ::tiff::decoder::{Decoder, DecodingResult, Limits};
use glam::Vec3;
use std::io::Cursor;

/// Deflate's.
const MAX_EXPANSION: u64 = 1100;

pub(crate) fn is_tiff(bytes: &[u8]) -> bool {
    [b"II\x2a\0", b"MM\0\x2a", b"II\x2b\0", b"MM\0\x2b"].iter().any(|magic| bytes.starts_with(*magic))
}

/// The first picture of the file, and what was changed.
pub(crate) fn decode(bytes: &[u8], name: &str) -> Result<(Picture, Option<String>), ImageError> {
    let bad = |place: &str, problem: String| ImageError::malformed(name, place, problem, COPY_AGAIN);
    let broken = |error: ::tiff::TiffError| bad("its pixels", error.to_string());
    let mut limits = Limits::default();
    // four floats a pixel; what a file of this length cannot hold is refused below
    limits.decoding_buffer_size = MAX_SRGB_PIXELS as usize * 16;
    let mut decoder =
        Decoder::new(Cursor::new(bytes)).map_err(|error| bad("its header", error.to_string()))?.with_limits(limits);
    let (width, height) = decoder.dimensions().map_err(broken)?;
    check_size(name, "the size in its header", width.into(), height.into(), MAX_SRGB_PIXELS)?;
    let kind = decoder.colortype().map_err(broken)?;
    let channels = match kind {
        ColorType::Gray(_) => 1,
        ColorType::GrayA(_) => 2,
        ColorType::RGB(_) => 3,
        ColorType::RGBA(_) => 4,
        other => {
            let remedy = "save it as grey or RGB of 8 or 16 bits or of floats, or as PNG";
            return Err(ImageError::malformed(name, "its header", format!("its colours are {other:?}"), remedy));
        }
    };
    let pixels = u64::from(width) * u64::from(height);
    check_expansion(name, pixels * channels as u64 * u64::from(kind.bit_depth()).div_ceil(8), bytes.len(), MAX_EXPANSION)?;
    let decoded = decoder.read_image().map_err(broken)?;
    let numbers = pixels as usize * channels;
    let of_bytes = |values: &[u8]| SrgbImage { width, height, pixels: values.chunks_exact(channels).map(rgba).collect() };
    let of_floats = |values: Vec<f32>| {
        check_size(name, "the size in its header", width.into(), height.into(), MAX_PIXELS)?;
        let mut pixels: Vec<Vec3> = values.chunks_exact(channels).map(rgb).collect();
        let told = told(&repair(&mut pixels)).map(|told| format!("{name}: {told}"));
        Ok((Picture::Hdr(HdrImage { width, height, pixels }), told))
    };
    let (picture, told) = match decoded {
        DecodingResult::U8(values) if values.len() == numbers => (Picture::Eight(of_bytes(&values)), None),
        DecodingResult::U16(values) if values.len() == numbers => {
            let values: Vec<u8> = values.iter().map(|&x| ((u32::from(x) * 255 + 32_767) / 65_535) as u8).collect();
            (Picture::Eight(of_bytes(&values)), Some(format!("{name}: has 16 bits a component, of which 8 are kept")))
        }
        DecodingResult::F32(values) if values.len() == numbers => of_floats(values)?,
        DecodingResult::F16(values) if values.len() == numbers => of_floats(values.iter().map(|x| x.to_f32()).collect())?,
        _ => {
            let remedy = "save it with 8 or 16 bits a component, or with floats";
            return Err(ImageError::malformed(name, "its header", "its numbers are of a kind that is not read here", remedy));
        }
    };
    Ok((picture, told))
}

fn rgba(values: &[u8]) -> [u8; 4] {
    match *values {
        [grey] => [grey, grey, grey, 255],
        [grey, alpha] => [grey, grey, grey, alpha],
        [r, g, b] => [r, g, b, 255],
        [r, g, b, a] => [r, g, b, a],
        _ => [0; 4],
    }
}

fn rgb(values: &[f32]) -> Vec3 {
    match *values {
        [grey] | [grey, _] => Vec3::splat(grey),
        [r, g, b] | [r, g, b, _] => Vec3::new(r, g, b),
        _ => Vec3::ZERO,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ::tiff::encoder::{TiffEncoder, colortype};

    fn file<C: colortype::ColorType>(width: u32, height: u32, values: &[C::Inner]) -> Vec<u8>
    where
        [C::Inner]: ::tiff::encoder::TiffValue,
    {
        let mut out = Cursor::new(Vec::new());
        TiffEncoder::new(&mut out).unwrap().write_image::<C>(width, height, values).unwrap();
        out.into_inner()
    }

    #[test]
    fn bytes_words_and_floats_are_read() {
        let (picture, told) = decode(&file::<colortype::RGB8>(2, 1, &[1, 2, 3, 4, 5, 6]), "a").unwrap();
        let pixels = vec![[1, 2, 3, 255], [4, 5, 6, 255]];
        assert_eq!((picture, told), (Picture::Eight(SrgbImage { width: 2, height: 1, pixels }), None));
        let (picture, told) = decode(&file::<colortype::Gray16>(1, 1, &[65_535]), "a").unwrap();
        assert_eq!(picture, Picture::Eight(SrgbImage::filled(1, 1, [255; 4])));
        assert!(told.unwrap().contains("16 bits"));
        let (picture, _) = decode(&file::<colortype::RGB32Float>(1, 1, &[0.5, 7.0, -1.0]), "a").unwrap();
        assert_eq!(picture, Picture::Hdr(HdrImage::filled(1, 1, Vec3::new(0.5, 7.0, 0.0))));
    }

    #[test]
    fn broken_ones_are_refused() {
        let good = file::<colortype::RGBA8>(3, 2, &[9; 24]);
        assert!(is_tiff(&good));
        for length in 4..good.len() {
            assert!(decode(&good[..length], "a").is_err(), "{length} of {}", good.len());
        }
        for at in 0..good.len() {
            for value in [0, 1, 127, 255] {
                let mut other = good.clone();
                other[at] = value;
                drop(decode(&other, "a"));
            }
        }
    }
}
