//! Pictures as BC6H with smaller versions: what engines load straight into a graphics processor's memory.

use super::{Head, TexelFormat, block_descriptor, key_value};
use crate::HdrImage;
use crate::bc6h::encode_bc6h;
use glam::Vec3;

/// `KHR_DF_MODEL_BC6H`, primaries of Rec. 709, linear, alpha straight.
pub(super) const MODEL: u32 = 133 | 1 << 8 | 1 << 16;
/// Levels begin at multiples of a block's bytes.
const ALIGNMENT: usize = 16;

/// The bytes of a KTX 2.0 file: the image as BC6H, then half as large each, `levels` in all: at least 1, and at most down to one pixel. The first row is that of v = 0.
#[must_use]
pub fn ktx2_bc6h(image: &HdrImage, levels: u32) -> Vec<u8> {
    ktx2_of_bc6h(image, encode_bc6h(image), levels)
}

/// As [`ktx2_bc6h`], where the first level's blocks are given.
#[must_use]
pub fn ktx2_of_bc6h(image: &HdrImage, blocks: Vec<u8>, levels: u32) -> Vec<u8> {
    let mut images = vec![blocks];
    let mut last = image.clone();
    while images.len() < levels as usize && (last.width > 1 || last.height > 1) {
        last = halved(&last);
        images.push(encode_bc6h(&last));
    }
    let descriptor = block_descriptor(MODEL, [0, 1.0_f32.to_bits()]);
    let values = [key_value("KTXorientation", "rd"), key_value("KTXwriter", "Heliodon")].concat();
    let levels: Vec<(&[u8], u64)> = images.iter().map(|level| (level.as_slice(), level.len() as u64)).collect();
    let head = Head { vk: TexelFormat::Bc6h.vk(), type_bytes: 1, size: [image.width, image.height], packing: 0 };
    head.file(0, &levels, &descriptor, &values, ALIGNMENT)
}

/// Half as large, each pixel the mean of those it stands for.
pub(crate) fn halved(image: &HdrImage) -> HdrImage {
    let (width, height) = ((image.width / 2).max(1), (image.height / 2).max(1));
    HdrImage::from_fn(width, height, |x, y| {
        let ends = |at: u32, fine: u32, coarse: u32| at * fine / coarse..((at + 1) * fine).div_ceil(coarse).min(fine);
        let (columns, rows) = (ends(x, image.width, width), ends(y, image.height, height));
        let count = (columns.len() * rows.len()) as f32;
        rows.flat_map(|y| columns.clone().map(move |x| image.pixel(x, y))).sum::<Vec3>() / count
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bc6h::decode_bc6h;

    #[test]
    fn every_level_lies_where_the_index_says() {
        let image = HdrImage::from_fn(37, 20, |x, y| Vec3::new(1.0, 0.8, 0.5) * (0.3 + x as f32 * 0.01 + y as f32 * 0.005));
        let file = ktx2_bc6h(&image, u32::MAX);
        assert_eq!(&file[..12], &super::super::MAGIC);
        let word = |at: usize| u32::from_le_bytes(file[at..at + 4].try_into().unwrap());
        let long = |at: usize| u64::from_le_bytes(file[at..at + 8].try_into().unwrap()) as usize;
        assert_eq!([word(12), word(20), word(24), word(36), word(40)], [143, 37, 20, 1, 6]);
        // the descriptor says how long it is
        assert_eq!(word(word(48) as usize), word(52));
        let mean = |image: &HdrImage| image.pixels.iter().sum::<Vec3>() / image.pixels.len() as f32;
        let mut smallest = usize::MAX;
        for level in 0..6 {
            let (at, length) = (long(80 + 24 * level), long(88 + 24 * level));
            assert!(at % 16 == 0 && at < smallest && at + length <= file.len());
            smallest = at;
            let (width, height) = ((37 >> level).max(1), (20 >> level).max(1));
            let back = decode_bc6h(&file[at..at + length], width, height);
            assert!((mean(&back) - mean(&image)).abs().max_element() < 0.02, "level {level}: {}", mean(&back));
        }
        for (asked, levels) in [(0, 1), (1, 1), (3, 3), (6, 6), (7, 6)] {
            let file = ktx2_bc6h(&image, asked);
            assert_eq!(u32::from_le_bytes(file[40..44].try_into().unwrap()), levels);
        }
    }
}
