//! BC6H: linear colour in a byte a pixel, as graphics processors read it (`VK_FORMAT_BC6H_UFLOAT_BLOCK`).
//!
//! Khronos Data Format Specification 1.3, section 20 (after the BPTC_FLOAT of OpenGL 4.2). Of its fourteen modes blocks are written in one of the four that have one
//! region, with sixteen steps between two endpoints: colours of a block lie on one line, which those of a light map nearly do. They differ in how exact the first
//! endpoint is and how far the other may lie from it; the best one is taken.
//! Why no kept crate: none in Rust encodes it without a foreign library. Endpoints are fitted by the principal axis and then by least squares, in the half floats' own
//! bits, in which an error is one of the value's part.

use crate::HdrImage;
use glam::Vec3;
use half::f16;
use rayon::prelude::*;

/// Largest half float that is finite, as bits.
const LARGEST: f32 = 31_743.0;
/// How far each of the sixteen steps lies from the first endpoint, in sixty-fourths.
const WEIGHTS: [u32; 16] = [0, 4, 9, 13, 17, 21, 26, 30, 34, 38, 43, 47, 51, 55, 60, 64];
/// Rounds of least squares.
const ROUNDS: usize = 3;

/// Sixteen bytes for each four by four pixels, row by row; what is missing at the right and lower rim repeats the last ones. Components below 0 and what is no
/// number become 0, those above 65,504 that.
#[must_use]
pub fn encode_bc6h(image: &HdrImage) -> Vec<u8> {
    let (columns, rows) = (image.width.div_ceil(4), image.height.div_ceil(4));
    let block = |at: u32| {
        let (x, y) = (at % columns * 4, at / columns * 4);
        let pixel = |i: u32| bits(image.pixel((x + i % 4).min(image.width - 1), (y + i / 4).min(image.height - 1)));
        encode_block(&std::array::from_fn(|i| pixel(i as u32))).to_le_bytes()
    };
    (0..columns * rows).into_par_iter().flat_map_iter(block).collect()
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

/// A mode of one region.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Mode {
    /// Its number, five bits.
    code: u32,
    /// Bits of an endpoint's component.
    precision: u32,
    /// Bits of the second endpoint's, as a difference from the first's; as many as `precision`: as it is.
    difference: u32,
}

const MODES: [Mode; 4] = [
    Mode { code: 0b01111, precision: 16, difference: 4 },
    Mode { code: 0b01011, precision: 12, difference: 8 },
    Mode { code: 0b00111, precision: 11, difference: 9 },
    Mode { code: 0b00011, precision: 10, difference: 10 },
];

type Ends = [[u32; 3]; 2];

impl Mode {
    fn largest(self) -> u32 {
        (1 << self.precision) - 1
    }

    /// The bits that come nearest to a half's.
    fn quantized(self, half: Vec3) -> [u32; 3] {
        half.to_array().map(|x| {
            let guess = (x * (64.0 / 31.0) * libm::ldexpf(1.0, self.precision as i32 - 16)).round().max(0.0) as u32;
            let near = guess.saturating_sub(1)..=(guess + 1).min(self.largest());
            let off = |&q: &u32| (f64::from(finished(self.unquantized(q))) - f64::from(x)).abs();
            near.min_by(|a, b| off(a).total_cmp(&off(b))).unwrap_or(self.largest())
        })
    }

    fn unquantized(self, bits: u32) -> u32 {
        match bits {
            0 => 0,
            _ if self.precision >= 15 => bits,
            _ if bits == self.largest() => 0xFFFF,
            _ => ((bits << 16) + 0x8000) >> self.precision,
        }
    }

    /// Whether the second endpoint is near enough to the first.
    fn holds(self, ends: &Ends) -> bool {
        let reach = 1 << (self.difference - 1);
        self.difference == self.precision || (0..3).all(|c| (-reach..reach).contains(&(ends[1][c] as i32 - ends[0][c] as i32)))
    }

    /// The sixteen colours between two endpoints, as halves' bits.
    fn palette(self, ends: &Ends) -> [Vec3; 16] {
        WEIGHTS.map(|weight| {
            let component = |c: usize| {
                let [a, b] = [ends[0][c], ends[1][c]].map(|bits| self.unquantized(bits));
                finished((a * (64 - weight) + b * weight + 32) >> 6) as f32
            };
            Vec3::new(component(0), component(1), component(2))
        })
    }

    /// For each pixel the step that is nearest, and the sum of squares that it is off.
    fn steps(self, pixels: &[Vec3; 16], ends: &Ends) -> ([u8; 16], f32) {
        let palette = self.palette(ends);
        let mut sum = 0.0;
        let steps = pixels.map(|pixel| {
            let (mut best, mut least) = (0, f32::INFINITY);
            for (step, color) in palette.iter().enumerate() {
                let off = color.distance_squared(pixel);
                if off < least {
                    (best, least) = (step as u8, off);
                }
            }
            sum += least;
            best
        });
        (steps, sum)
    }

    /// The best of this mode near two endpoints, and how far off it is; `None` where the mode cannot tell them.
    fn fit(self, pixels: &[Vec3; 16], ends: [Vec3; 2]) -> Option<(Ends, [u8; 16], f32)> {
        let mut ends = ends.map(|end| self.quantized(end));
        let (mut indices, mut off) = self.steps(pixels, &ends);
        for _ in 0..ROUNDS {
            let Some(fitted) = fitted(pixels, &indices) else { break };
            let fitted = fitted.map(|end| self.quantized(end));
            let (next, next_off) = self.steps(pixels, &fitted);
            if next_off >= off || !self.holds(&fitted) {
                break;
            }
            (ends, indices, off) = (fitted, next, next_off);
        }
        // the first pixel's index has one bit less: it is of the lower half
        if indices[0] >= 8 {
            ends.swap(0, 1);
            indices = indices.map(|index| 15 - index);
        }
        self.holds(&ends).then_some((ends, indices, off))
    }

    fn block(self, ends: &Ends, indices: &[u8; 16]) -> u128 {
        let mut bits = Bits { block: 0, at: 0 };
        bits.put(self.code, 5);
        ends[0].iter().for_each(|&first| bits.put(first & 1023, 10));
        for (&first, &second) in ends[0].iter().zip(&ends[1]) {
            let second = if self.difference == self.precision { second } else { second.wrapping_sub(first) };
            bits.put(second & ((1 << self.difference) - 1), self.difference);
            // what ten bits did not hold of the first endpoint follows from its highest bit on
            (10..self.precision).rev().for_each(|bit| bits.put(first >> bit & 1, 1));
        }
        indices.iter().enumerate().for_each(|(i, &index)| bits.put(u32::from(index), if i == 0 { 3 } else { 4 }));
        bits.block
    }

    fn ends(self, bits: &mut Bits) -> Ends {
        let mut first: [u32; 3] = std::array::from_fn(|_| bits.take(10));
        let mut second = [0; 3];
        for (first, second) in first.iter_mut().zip(&mut second) {
            *second = bits.take(self.difference);
            (10..self.precision).rev().for_each(|bit| *first |= bits.take(1) << bit);
            if self.difference < self.precision {
                let signed = (*second << (32 - self.difference)) as i32 >> (32 - self.difference);
                *second = first.wrapping_add_signed(signed) & self.largest();
            }
        }
        [first, second]
    }
}

/// A block, bit by bit.
struct Bits {
    block: u128,
    at: u32,
}

impl Bits {
    fn put(&mut self, value: u32, count: u32) {
        self.block |= u128::from(value) << self.at;
        self.at += count;
    }

    fn take(&mut self, count: u32) -> u32 {
        let value = (self.block >> self.at) as u32 & ((1 << count) - 1);
        self.at += count;
        value
    }
}

fn finished(value: u32) -> u32 {
    (value * 31) >> 6
}

fn encode_block(pixels: &[Vec3; 16]) -> u128 {
    let mean = pixels.iter().sum::<Vec3>() / 16.0;
    let axis = principal_axis(pixels, mean);
    let along = pixels.map(|pixel| (pixel - mean).dot(axis));
    let (low, high) = along.iter().fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), &x| (low.min(x), high.max(x)));
    let ends = [mean + axis * low, mean + axis * high];
    let fits = MODES.iter().filter_map(|mode| Some((mode, mode.fit(pixels, ends)?)));
    let best = fits.min_by(|a, b| a.1.2.total_cmp(&b.1.2));
    best.map_or(0b00011, |(mode, (ends, indices, _))| mode.block(&ends, &indices))
}

/// The direction in which pixels differ most, by powers of their covariance.
fn principal_axis(pixels: &[Vec3; 16], mean: Vec3) -> Vec3 {
    let [mut xx, mut xy, mut xz] = [Vec3::ZERO; 3];
    for pixel in pixels {
        let off = *pixel - mean;
        (xx, xy, xz) = (xx + off * off.x, xy + off * off.y, xz + off * off.z);
    }
    let mut axis = [xx, xy, xz].into_iter().max_by(|a, b| a.length_squared().total_cmp(&b.length_squared())).unwrap_or(xx);
    for _ in 0..8 {
        let Some(unit) = axis.try_normalize() else { return Vec3::ONE.normalize_or_zero() };
        axis = xx * unit.x + xy * unit.y + xz * unit.z;
    }
    axis.normalize_or(Vec3::ONE.normalize_or_zero())
}

/// The endpoints from which pixels at these steps are least off.
fn fitted(pixels: &[Vec3; 16], indices: &[u8; 16]) -> Option<[Vec3; 2]> {
    let (mut aa, mut ab, mut bb) = (0.0, 0.0, 0.0);
    let (mut a, mut b) = (Vec3::ZERO, Vec3::ZERO);
    for (pixel, &index) in pixels.iter().zip(indices) {
        let share = WEIGHTS[usize::from(index)] as f32 / 64.0;
        aa += (1.0 - share) * (1.0 - share);
        ab += (1.0 - share) * share;
        bb += share * share;
        a += *pixel * (1.0 - share);
        b += *pixel * share;
    }
    let determinant = aa * bb - ab * ab;
    let limit = |end: Vec3| end.clamp(Vec3::ZERO, Vec3::splat(LARGEST));
    (determinant > 1e-3).then(|| [limit((a * bb - b * ab) / determinant), limit((b * aa - a * ab) / determinant)])
}

fn decode_block(block: u128) -> [Vec3; 16] {
    let mut bits = Bits { block, at: 0 };
    let code = bits.take(5);
    let Some(mode) = MODES.iter().find(|mode| mode.code == code) else { return [Vec3::ZERO; 16] };
    let palette = mode.palette(&mode.ends(&mut bits));
    std::array::from_fn(|i| {
        let index = bits.take(if i == 0 { 3 } else { 4 });
        let halves = palette[index as usize].to_array().map(|x| f16::from_bits(x as u16).to_f32());
        Vec3::from_array(halves)
    })
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
}
