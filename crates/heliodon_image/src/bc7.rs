//! BC7: four numbers from 0 to 1 a texel, 4 x 4 texels in 16 bytes (Khronos, "Data Format Specification" 1.3, section 20), by the crate `block_compression`.

use block_compression::decode::decompress_blocks_as_rgba8;
use block_compression::encode::compress_rgba8;
use block_compression::{BC7Settings, CompressionVariant};
use rayon::prelude::*;
use std::sync::LazyLock;

/// How long is searched for a block's best form.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Bc7Quality {
    /// For trying things out.
    Draft,
    /// Nearly the best, in a part of its time.
    #[default]
    Usual,
    /// For what is made once and kept.
    Best,
}

impl Bc7Quality {
    fn variant(self) -> CompressionVariant {
        CompressionVariant::BC7(match self {
            Self::Draft => BC7Settings::alpha_ultrafast(),
            Self::Usual => BC7Settings::alpha_very_fast(),
            Self::Best => BC7Settings::alpha_basic(),
        })
    }
}

const SIDE: u32 = 4;
const BLOCK_BYTES: usize = 16;

/// The blocks of a picture, row after row from its first; at edges that are no multiples of 4 texels the last ones go on. The same bytes for any number of threads.
///
/// # Panics
/// With another number of pixels than `width * height`, or with none.
#[must_use]
pub fn encode_bc7(pixels: &[[u8; 4]], width: u32, height: u32, quality: Bc7Quality) -> Vec<u8> {
    assert!(!pixels.is_empty() && pixels.len() == width as usize * height as usize, "{} pixels", pixels.len());
    let columns = width.next_multiple_of(SIDE);
    let row_bytes = (columns / SIDE) as usize * BLOCK_BYTES;
    let mut blocks = vec![0; row_bytes * height.div_ceil(SIDE) as usize];
    blocks.par_chunks_exact_mut(row_bytes).enumerate().for_each(|(row, blocks)| {
        let mut strip = Vec::with_capacity((columns * SIDE) as usize * 4);
        for y in 0..SIDE {
            let y = (row as u32 * SIDE + y).min(height - 1) as usize;
            let line = &pixels[y * width as usize..][..width as usize];
            strip.extend((0..columns).flat_map(|x| line[x.min(width - 1) as usize]));
        }
        // Blocks of one colour are most of many pictures, and have no better form.
        let texel = |x: u32, y: u32| &strip[((y * columns + x) * 4) as usize..][..4];
        let is_even = |left: u32| (0..SIDE * SIDE).all(|i| texel(left + i % SIDE, i / SIDE) == texel(left, 0));
        let mut first = 0;
        while first < columns {
            let even = is_even(first);
            let mut end = first + SIDE;
            while end < columns && is_even(end) == even {
                end += SIDE;
            }
            let run = &mut blocks[(first / SIDE) as usize * BLOCK_BYTES..(end / SIDE) as usize * BLOCK_BYTES];
            if even {
                for (left, block) in (first..end).step_by(SIDE as usize).zip(run.chunks_exact_mut(BLOCK_BYTES)) {
                    let pixel = texel(left, 0);
                    block.copy_from_slice(&even_block([pixel[0], pixel[1], pixel[2], pixel[3]]));
                }
            } else {
                compress_rgba8(quality.variant(), &strip[first as usize * 4..], run, end - first, SIDE, columns * 4);
            }
            first = end;
        }
    });
    blocks
}

/// Ends of seven bits between which, a third of the way, each number of eight bits lies exactly.
static THIRDS: LazyLock<[[u8; 2]; 256]> = LazyLock::new(|| {
    let expanded = |end: u32| end << 1 | end >> 6;
    let mut ends = [[0; 2]; 256];
    for (low, high) in (0..128).flat_map(|low| (low..128).map(move |high| (low, high))) {
        let third = (43 * expanded(low) + 21 * expanded(high) + 32) >> 6;
        ends[third as usize] = [low as u8, high as u8];
    }
    ends
});

/// The block of one colour, to the bit: mode 5, whose alpha has eight bits, all texels a third of the way between the ends.
fn even_block(pixel: [u8; 4]) -> [u8; BLOCK_BYTES] {
    const MODE_5: u128 = 1 << 5;
    /// Two bits a texel of which each says 1, but one bit of the first.
    const THIRD_EVERYWHERE: u128 = 0x2AAA_AAAB;
    let mut bits = MODE_5;
    let mut at = 8;
    let mut put = |number: u128, count: u32| {
        bits |= number << at;
        at += count;
    };
    for channel in &pixel[..3] {
        THIRDS[*channel as usize].iter().for_each(|end| put(u128::from(*end), 7));
    }
    (0..2).for_each(|_| put(u128::from(pixel[3]), 8));
    put(THIRD_EVERYWHERE, 31);
    bits.to_le_bytes()
}

/// The pixels of a picture of blocks.
///
/// # Panics
/// With another number of bytes than [`encode_bc7`] makes for this size.
#[must_use]
pub fn decode_bc7(blocks: &[u8], width: u32, height: u32) -> Vec<[u8; 4]> {
    let columns = width.next_multiple_of(SIDE);
    let row_bytes = (columns / SIDE) as usize * BLOCK_BYTES;
    assert_eq!(blocks.len(), row_bytes * height.div_ceil(SIDE) as usize, "blocks of {width} x {height} texels");
    let mut pixels = vec![[0; 4]; width as usize * height as usize];
    pixels.par_chunks_mut((width * SIDE) as usize).zip(blocks.par_chunks_exact(row_bytes)).for_each(|(lines, blocks)| {
        let mut strip = vec![0; (columns * SIDE) as usize * 4];
        decompress_blocks_as_rgba8(Bc7Quality::Usual.variant(), columns, SIDE, blocks, &mut strip);
        for (line, texels) in lines.chunks_exact_mut(width as usize).zip(strip.chunks_exact(columns as usize * 4)) {
            line.iter_mut().zip(texels.chunks_exact(4)).for_each(|(pixel, texel)| pixel.copy_from_slice(texel));
        }
    });
    pixels
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(width: u32, height: u32) -> Vec<[u8; 4]> {
        let ramp = |at: u32, by: u32| (at * by % 256) as u8;
        (0..height)
            .flat_map(|y| (0..width).map(move |x| [ramp(x, 5), ramp(y, 3), ramp(x + y, 2), if x > y { 255 } else { 0 }]))
            .collect()
    }

    #[test]
    fn pictures_come_back_nearly_as_they_were() {
        for (width, height) in [(64, 48), (37, 21), (1, 1), (4, 3)] {
            let pixels = picture(width, height);
            for quality in [Bc7Quality::Draft, Bc7Quality::Usual, Bc7Quality::Best] {
                let blocks = encode_bc7(&pixels, width, height, quality);
                let back = decode_bc7(&blocks, width, height);
                let error: u64 =
                    pixels.iter().flatten().zip(back.iter().flatten()).map(|(&a, &b)| u64::from(a.abs_diff(b)).pow(2)).sum();
                let root_mean_square = (error as f64 / (4 * pixels.len()) as f64).sqrt();
                assert!(root_mean_square < 4.0, "{width} x {height}, {quality:?}: {root_mean_square}");
            }
        }
    }

    #[test]
    fn one_colour_is_kept_to_the_bit() {
        for code in 0..=255u8 {
            let pixel = [code, 255 - code, code.wrapping_mul(7), code.wrapping_mul(13)];
            let back = decode_bc7(&encode_bc7(&[pixel; 64], 8, 8, Bc7Quality::Usual), 8, 8);
            assert!(back.iter().all(|p| *p == pixel), "{pixel:?}: {:?}", back[0]);
        }
    }

    #[test]
    #[ignore = "prints how long each quality takes, and how far it is off"]
    fn speed() {
        let (width, height) = (512, 512);
        let mut random = 1u32;
        let mut noise = || {
            random = random.wrapping_mul(1664525).wrapping_add(1013904223);
            (random >> 27) as u8
        };
        let pixels: Vec<[u8; 4]> = picture(width, height).into_iter().map(|p| p.map(|v| v.saturating_add(noise()))).collect();
        for quality in [Bc7Quality::Draft, Bc7Quality::Usual, Bc7Quality::Best] {
            let start = std::time::Instant::now();
            let blocks = encode_bc7(&pixels, width, height, quality);
            let took = start.elapsed().as_secs_f64();
            let back = decode_bc7(&blocks, width, height);
            let error: u64 =
                pixels.iter().flatten().zip(back.iter().flatten()).map(|(&a, &b)| u64::from(a.abs_diff(b)).pow(2)).sum();
            println!(
                "{quality:?}: {:.2} Mtexels/s, RMS {:.2}",
                pixels.len() as f64 / took / 1e6,
                (error as f64 / (4 * pixels.len()) as f64).sqrt()
            );
        }
    }
}
