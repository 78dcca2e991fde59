//! BC6H: linear colour in a byte a pixel, as graphics processors read it (`VK_FORMAT_BC6H_UFLOAT_BLOCK`).
//!
//! Khronos Data Format Specification 1.3, section 20 (after the BPTC_FLOAT of OpenGL 4.2). Of its fourteen modes blocks are written in nine: four of one region, with
//! sixteen steps between two endpoints (colours of a block lie on one line, which those of a light map nearly do), and five of two regions, with eight steps in each. They
//! differ in how exact the first endpoint is and how far the others may lie from it; the best one is taken.
//!
//! Black stays black: what is 0 comes back as 0, whatever is beside it. The price is paid there: endpoints as far apart as 0 and 1 have ten bits in one region and six in two, so light in a block
//! with black is off by a few parts of a hundred. Where colours of a block do not lie on a line or two, as at a shadow's edge, nothing holds them within a code of eight bits: texels of
//! four light maps are off by 0.06 to 0.25 codes in the root of the mean square, single ones by 1 to 18.
//!
//! Why no kept crate: none in Rust encodes it without a foreign library. Why two regions, though they take two to three times as long: root mean squares there are 4 to 23 % less, and 18
//! codes at most in place of 31.

mod fit;
mod modes;

use crate::HdrImage;
use fit::{LARGEST, Pixels};
use glam::Vec3;
use half::f16;
use modes::Block;
use rayon::prelude::*;

/// Sixteen bytes for each four by four pixels, row by row; what is missing at the right and lower rim repeats the last ones. Components below 0 and what is no
/// number become 0, those above 65,504 that. What is 0 comes back as 0.
#[must_use]
pub fn encode_bc6h(image: &HdrImage) -> Vec<u8> {
    Bc6h::new(image, |_, _| true).to_bytes()
}

/// An image in blocks, of which pixels may take other colours that their blocks have.
#[derive(Clone, Debug)]
pub struct Bc6h {
    width: u32,
    blocks: Vec<Block>,
}

impl Bc6h {
    /// As [`encode_bc6h`], where only those pixels count of which somebody is to see something: the others of a block take what comes of it.
    #[must_use]
    pub fn new(image: &HdrImage, counts: impl Fn(u32, u32) -> bool + Sync) -> Self {
        let HdrImage { width, height, .. } = *image;
        let (columns, rows) = (width.div_ceil(4), height.div_ceil(4));
        let block = |at: u32| {
            let places = std::array::from_fn(|i| [at % columns * 4 + i as u32 % 4, at / columns * 4 + i as u32 / 4]);
            let color = |[x, y]: [u32; 2]| bits(image.pixel(x.min(width - 1), y.min(height - 1)));
            Pixels::new(places.map(color), places.map(|[x, y]| x < width && y < height && counts(x, y))).block()
        };
        Self { width, blocks: (0..columns * rows).into_par_iter().map(block).collect() }
    }

    /// A pixel's colour.
    ///
    /// # Panics
    /// Beyond the image.
    #[must_use]
    pub fn color(&self, at: [u32; 2]) -> Vec3 {
        let (block, pixel) = self.place(at);
        color(self.blocks[block].pixels()[pixel])
    }

    /// The colours that a pixel may have.
    ///
    /// # Panics
    /// Beyond the image.
    pub fn choices(&self, at: [u32; 2]) -> impl Iterator<Item = Vec3> + use<> {
        let (block, pixel) = self.place(at);
        self.blocks[block].choices(pixel).map(color)
    }

    /// Gives a pixel the one of its choices that is nearest.
    ///
    /// # Panics
    /// Beyond the image.
    pub fn choose(&mut self, at: [u32; 2], wanted: Vec3) {
        let (block, pixel) = self.place(at);
        let off = self.choices(at).map(|choice| choice.distance_squared(wanted)).zip(0..);
        if let Some((_, step)) = off.min_by(|a, b| a.0.total_cmp(&b.0)) {
            self.blocks[block].steps[pixel] = step;
        }
    }

    /// The blocks, row by row.
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        self.blocks.iter().flat_map(|block| block.written().to_le_bytes()).collect()
    }

    fn place(&self, [x, y]: [u32; 2]) -> (usize, usize) {
        ((y / 4 * self.width.div_ceil(4) + x / 4) as usize, (y % 4 * 4 + x % 4) as usize)
    }
}

/// The pixels of such blocks; only of the modes that are written here, others are black.
#[must_use]
pub fn decode_bc6h(bytes: &[u8], width: u32, height: u32) -> HdrImage {
    let columns = width.div_ceil(4);
    let blocks: Vec<[Vec3; 16]> =
        bytes.as_chunks::<16>().0.iter().map(|block| decode_block(u128::from_le_bytes(*block))).collect();
    HdrImage::from_fn(width, height, |x, y| {
        let block = blocks.get((y / 4 * columns + x / 4) as usize);
        block.map_or(Vec3::ZERO, |block| block[(y % 4 * 4 + x % 4) as usize])
    })
}

/// A colour as the bits of half floats, which grow with it.
fn bits(color: Vec3) -> Vec3 {
    let component = |x: f32| if x > 0.0 { f32::from(f16::from_f32(x.min(65_504.0)).to_bits()).min(LARGEST) } else { 0.0 };
    Vec3::from_array(color.to_array().map(component))
}

fn color(bits: Vec3) -> Vec3 {
    Vec3::from_array(bits.to_array().map(|bits| f16::from_bits(bits as u16).to_f32()))
}

fn decode_block(block: u128) -> [Vec3; 16] {
    Block::read(block).map_or([Vec3::ZERO; 16], |block| block.pixels().map(color))
}

#[cfg(test)]
mod tests {
    use super::*;
    use heliodon_math::random::Pcg32;

    #[test]
    fn even_blocks_are_exact_and_smooth_ones_nearly() {
        let mut rng = Pcg32::new(3, 3);
        for _ in 0..200 {
            let color = Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32()) * libm::exp2f(rng.range_f32(-8.0, 8.0));
            let even = HdrImage::filled(4, 4, color);
            let back = decode_bc6h(&encode_bc6h(&even), 4, 4);
            let off = (back.pixels[5] - color).abs() / color;
            // a half's steps, of which there are 1,024 between powers of two
            assert!(off.max_element() < 0.0011, "{color} became {}", back.pixels[5]);
        }
        let smooth = HdrImage::from_fn(63, 30, |x, y| {
            let light = 0.5 + 0.5 * (x as f32 / 63.0) + 0.2 * libm::sinf(y as f32 * 0.2);
            Vec3::new(light, 0.9 * light + 0.05, 0.7 * light)
        });
        let bytes = encode_bc6h(&smooth);
        assert_eq!(bytes.len(), 16 * 16 * 8);
        let back = decode_bc6h(&bytes, 63, 30);
        let off: Vec<f32> = smooth.pixels.iter().zip(&back.pixels).map(|(a, b)| ((*a - *b) / *a).abs().max_element()).collect();
        let rms = (off.iter().map(|x| x * x).sum::<f32>() / off.len() as f32).sqrt();
        assert!(rms < 0.006 && off.iter().all(|x| *x < 0.02), "{rms}");
    }

    #[test]
    fn what_is_no_light_becomes_black_and_what_is_too_bright_the_brightest() {
        let odd = HdrImage { width: 2, height: 1, pixels: vec![Vec3::new(f32::NAN, -1.0, 0.0), Vec3::splat(1e9)] };
        let back = decode_bc6h(&encode_bc6h(&odd), 2, 1);
        assert_eq!(back.pixels[0], Vec3::ZERO);
        assert!(back.pixels[1].x > 60_000.0 && back.pixels[1].is_finite(), "{}", back.pixels[1]);
        assert_eq!(decode_block(0b00010), [Vec3::ZERO; 16]);
    }

    #[test]
    fn what_is_black_stays_black_whatever_is_beside_it() {
        let mut rng = Pcg32::new(5, 5);
        for share in [0.1, 0.5, 0.9] {
            let image = HdrImage::from_fn(64, 64, |_, _| {
                let light = Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32()) * libm::exp2f(rng.range_f32(-6.0, 10.0));
                if rng.next_f32() < share { Vec3::ZERO } else { light }
            });
            let back = decode_bc6h(&encode_bc6h(&image), 64, 64);
            let is_kept = |(a, b): (&Vec3, &Vec3)| *a != Vec3::ZERO || *b == Vec3::ZERO;
            assert!(image.pixels.iter().zip(&back.pixels).all(is_kept), "{share}");
        }
    }

    #[test]
    fn two_sides_of_a_block_are_told_apart() {
        // a step from black, and from a tenth, each side nearly even
        for dark in [0.0, 0.1] {
            for slope in [[1, 0], [0, 1], [1, 1]] {
                let image = HdrImage::from_fn(4, 4, |x, y| {
                    let is_lit = slope[0] * x + slope[1] * y > slope[0] + slope[1];
                    if is_lit { Vec3::new(0.8, 0.7, 0.6) * (1.0 + 0.01 * x as f32) } else { Vec3::splat(dark) }
                });
                let back = decode_bc6h(&encode_bc6h(&image), 4, 4);
                let off = image.pixels.iter().zip(&back.pixels).map(|(a, b)| (*a - *b).abs().max_element());
                let worst = off.fold(0.0, f32::max);
                assert!(worst < 0.03, "{dark} {slope:?}: {worst}");
            }
        }
    }

    #[test]
    fn pixels_that_nobody_sees_take_what_comes() {
        let image = HdrImage::from_fn(4, 4, |x, y| match x {
            0 | 1 => Vec3::new(0.5, 0.4, 0.3) * (1.0 + 0.1 * y as f32),
            _ => Vec3::splat((100 * x + y) as f32),
        });
        let blocks = Bc6h::new(&image, |x, _| x < 2);
        let back = decode_bc6h(&blocks.to_bytes(), 4, 4);
        for (x, y) in (0..4).flat_map(|y| [(0, y), (1, y)]) {
            let off = ((back.pixel(x, y) - image.pixel(x, y)) / image.pixel(x, y)).abs().max_element();
            assert!(off < 0.01, "{off}");
            assert_eq!(blocks.color([x, y]), back.pixel(x, y));
        }
        // where none counts all do
        assert_eq!(Bc6h::new(&image, |_, _| false).to_bytes(), encode_bc6h(&image));
    }

    #[test]
    fn pixels_take_other_colours_of_their_blocks() {
        let image = HdrImage::from_fn(8, 4, |x, y| Vec3::new(0.5, 0.4, 0.3) * (1.0 + 0.1 * (x + 2 * y) as f32));
        let mut blocks = Bc6h::new(&image, |_, _| true);
        for at in (0..4).flat_map(|y| (0..8).map(move |x| [x, y])) {
            let choices: Vec<Vec3> = blocks.choices(at).collect();
            assert!(choices.len() >= 4 && choices.contains(&blocks.color(at)), "{at:?}");
            blocks.choose(at, choices[1]);
            assert_eq!(blocks.color(at), choices[1]);
        }
        let back = decode_bc6h(&blocks.to_bytes(), 8, 4);
        assert!((0..4).flat_map(|y| (0..8).map(move |x| [x, y])).all(|at| back.pixel(at[0], at[1]) == blocks.color(at)));
    }
}
