//! Truevision TGA (Truevision, "TGA File Format Specification", version 2.0): plain, grey and mapped pictures, with run lengths or without.
//!
//! Why not the `image` crate's: its feature `tga` is one that Bevy's build would get as well, and be compiled again for.

use crate::error::{COPY_AGAIN, ImageError, check_expansion, check_size};
use crate::{MAX_SRGB_PIXELS, SrgbImage};

const HEADER_BYTES: usize = 18;
/// A packet of one pixel stands for 128.
const MAX_EXPANSION: u64 = 4 * 128;
/// Rows from the top, columns from the right.
const FROM_TOP: u8 = 0x20;
const FROM_RIGHT: u8 = 0x10;

#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Mapped,
    Color,
    Grey,
}

/// The picture; without alpha it is opaque.
pub(crate) fn decode(bytes: &[u8], name: &str) -> Result<SrgbImage, ImageError> {
    let bad = |place: &str, problem: String| ImageError::malformed(name, place, problem, COPY_AGAIN);
    let Some(header) = bytes.first_chunk::<HEADER_BYTES>() else {
        return Err(bad("its header", "it ends within it".to_owned()));
    };
    let word = |at: usize| u16::from_le_bytes([header[at], header[at + 1]]);
    let (kind, packed) = match header[2] {
        1 => (Kind::Mapped, false),
        2 => (Kind::Color, false),
        3 => (Kind::Grey, false),
        9 => (Kind::Mapped, true),
        10 => (Kind::Color, true),
        11 => (Kind::Grey, true),
        other => return Err(bad("its header", format!("its kind {other} is none that is read here"))),
    };
    let (width, height, bits, flags) = (word(12), word(14), header[16], header[17]);
    check_size(name, "the size in its header", width.into(), height.into(), MAX_SRGB_PIXELS)?;
    let pixels = usize::from(width) * usize::from(height);
    check_expansion(name, pixels as u64 * 4, bytes.len(), MAX_EXPANSION)?;
    let known = match kind {
        Kind::Mapped => bits == 8 && header[1] == 1,
        Kind::Grey => bits == 8,
        Kind::Color => matches!(bits, 15 | 16 | 24 | 32),
    };
    if !known {
        return Err(bad("its header", format!("its {bits} bits a pixel are none that are read here")));
    }
    let map_bits = if header[1] == 1 { header[7] } else { 8 };
    let map_bytes = if header[1] == 1 { usize::from(word(5)) * bytes_of(map_bits) } else { 0 };
    let map_at = HEADER_BYTES + usize::from(header[0]);
    let map =
        bytes.get(map_at..map_at + map_bytes).ok_or_else(|| bad("its colour map", "the file ends within it".to_owned()))?;
    let has_alpha = flags & 0x0f != 0;
    let texel = |raw: &[u8]| match kind {
        Kind::Grey => Some([raw[0], raw[0], raw[0], 255]),
        Kind::Color => Some(color(raw, has_alpha)),
        Kind::Mapped => {
            let entry = usize::from(raw[0]).checked_sub(usize::from(word(3)))?;
            let size = bytes_of(map_bits);
            map.get(entry * size..(entry + 1) * size).map(|raw| color(raw, has_alpha))
        }
    };
    let data = &bytes[map_at + map_bytes..];
    let unpacked = unpack(data, bytes_of(bits), pixels, packed)
        .ok_or_else(|| bad("its pixels", "the file ends within them".to_owned()))?;
    let mut image = SrgbImage::filled(width.into(), height.into(), [0; 4]);
    for (i, raw) in unpacked.chunks_exact(bytes_of(bits)).enumerate() {
        let (x, y) = (i % usize::from(width), i / usize::from(width));
        let x = if flags & FROM_RIGHT == 0 { x } else { usize::from(width) - 1 - x };
        let y = if flags & FROM_TOP == 0 { usize::from(height) - 1 - y } else { y };
        let texel = texel(raw).ok_or_else(|| bad("its pixels", format!("pixel {i} names no colour of the map")))?;
        image.pixels[y * usize::from(width) + x] = texel;
    }
    Ok(image)
}

fn bytes_of(bits: u8) -> usize {
    usize::from(bits).div_ceil(8)
}

/// Blue, green, red and alpha; of two bytes five bits each.
fn color(raw: &[u8], has_alpha: bool) -> [u8; 4] {
    let five = |x: u16| ((x & 31) * 255 / 31) as u8;
    match *raw {
        [b, g, r, a] => [r, g, b, if has_alpha { a } else { 255 }],
        [b, g, r] => [r, g, b, 255],
        [low, high] => {
            let word = u16::from_le_bytes([low, high]);
            [five(word >> 10), five(word >> 5), five(word), 255]
        }
        _ => [raw.first().copied().unwrap_or(0); 4],
    }
}

/// So many pixels' bytes; none where there are less.
fn unpack(data: &[u8], size: usize, pixels: usize, packed: bool) -> Option<Vec<u8>> {
    let wanted = pixels * size;
    if !packed {
        return data.get(..wanted).map(<[u8]>::to_vec);
    }
    let mut out = Vec::with_capacity(wanted);
    let mut data = data;
    while out.len() < wanted {
        let (&packet, rest) = data.split_first()?;
        let count = usize::from(packet & 0x7f) + 1;
        if packet & 0x80 != 0 {
            let (pixel, rest) = rest.split_at_checked(size)?;
            (0..count).for_each(|_| out.extend_from_slice(pixel));
            data = rest;
        } else {
            let (run, rest) = rest.split_at_checked(count * size)?;
            out.extend_from_slice(run);
            data = rest;
        }
    }
    out.truncate(wanted);
    Some(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(kind: u8, size: [u8; 2], bits: u8, flags: u8, rest: &[u8]) -> Vec<u8> {
        let mapped = u8::from(kind == 1 || kind == 9);
        let mut bytes =
            vec![0, mapped, kind, 0, 0, 2 * mapped, 0, 24 * mapped, 0, 0, 0, 0, size[0], 0, size[1], 0, bits, flags];
        bytes.extend(rest);
        bytes
    }

    #[test]
    fn every_kind_is_read() {
        let [red, green] = [[255, 0, 0, 255], [0, 255, 0, 255]];
        let of = |bytes: &[u8]| decode(bytes, "a.tga").unwrap().pixels;
        assert_eq!(of(&file(2, [2, 1], 24, 0x20, &[0, 0, 255, 0, 255, 0])), [red, green]);
        // the lowest row first
        assert_eq!(of(&file(2, [1, 2], 24, 0, &[0, 0, 255, 0, 255, 0])), [green, red]);
        assert_eq!(of(&file(2, [2, 1], 24, 0x30, &[0, 0, 255, 0, 255, 0])), [green, red]);
        assert_eq!(of(&file(2, [1, 1], 32, 8, &[1, 2, 3, 4])), [[3, 2, 1, 4]]);
        assert_eq!(of(&file(2, [1, 1], 16, 0, &[0, 0x7c])), [red]);
        assert_eq!(of(&file(10, [3, 1], 24, 0x20, &[0x81, 0, 0, 255, 0, 0, 255, 0])), [red, red, green]);
        assert_eq!(of(&file(3, [2, 1], 8, 0x20, &[7, 9])), [[7, 7, 7, 255], [9, 9, 9, 255]]);
        assert_eq!(of(&file(1, [2, 1], 8, 0x20, &[0, 0, 255, 0, 255, 0, 1, 0])), [green, red]);
    }

    #[test]
    fn broken_ones_are_refused() {
        let good = file(10, [3, 1], 24, 0x20, &[0x81, 0, 0, 255, 0, 0, 255, 0]);
        for length in 0..good.len() {
            assert!(decode(&good[..length], "a").is_err(), "{length}");
        }
        let mut large = good.clone();
        large[12..16].fill(255);
        assert!(decode(&large, "a").unwrap_err().to_string().contains("more"));
        assert!(
            decode(&file(1, [1, 1], 8, 0, &[0, 0, 255, 0, 255, 0, 9]), "a")
                .unwrap_err()
                .to_string()
                .contains("names no colour")
        );
        for at in 0..good.len() {
            for value in [0, 1, 127, 255] {
                let mut other = good.clone();
                other[at] = value;
                drop(decode(&other, "a"));
            }
        }
    }
}
