//! Large pictures averaged down to size, in linear light.

use crate::tonemap::codes;
use bevy::math::UVec2;
use glam::Vec3;
use half::f16;
use heliodon_image::{HdrImage, SrgbImage};
use heliodon_math::color::linear_from_srgb8_table;

/// Calls `put` with each pixel's place and the mean of its samples, row by row; `read` gives the linear light of a sample.
fn average(size: UVec2, samples: u32, read: impl Fn(usize) -> Vec3, mut put: impl FnMut(u32, u32, Vec3)) {
    let (columns, samples) = ((size.x * samples) as usize, samples as usize);
    let share = 1.0 / (samples * samples) as f32;
    for y in 0..size.y as usize {
        for x in 0..size.x as usize {
            let mut sum = Vec3::ZERO;
            for row in 0..samples {
                let start = (y * samples + row) * columns + x * samples;
                for sample in start..start + samples {
                    sum += read(sample);
                }
            }
            put(x as u32, y as u32, sum * share);
        }
    }
}

/// From RGBA with sRGB codes, which the shaders have dithered: their mean is finer than a code, and dithered again.
pub(crate) fn srgb(bytes: &[u8], size: UVec2, samples: u32) -> SrgbImage {
    let texels: &[[u8; 4]] = bytemuck::cast_slice(bytes);
    let mut pixels = Vec::with_capacity((size.x * size.y) as usize);
    if samples == 1 {
        pixels.extend(texels.iter().map(|&[r, g, b, _]| [r, g, b, 255]));
    } else {
        let decode = linear_from_srgb8_table();
        let linear = |sample: usize| {
            let [r, g, b, _] = texels[sample];
            Vec3::new(decode[usize::from(r)], decode[usize::from(g)], decode[usize::from(b)])
        };
        average(size, samples, linear, |x, y, mean| {
            let [r, g, b] = codes::dithered(mean, x, y);
            pixels.push([r, g, b, 255]);
        });
    }
    SrgbImage { width: size.x, height: size.y, pixels }
}

/// From RGBA in half floats, times `scale`.
pub(crate) fn linear(bytes: &[u8], size: UVec2, samples: u32, scale: f32) -> HdrImage {
    let read = |sample: usize| {
        let at = |channel: usize| {
            let at = sample * 8 + channel * 2;
            f16::from_le_bytes([bytes[at], bytes[at + 1]]).to_f32()
        };
        Vec3::new(at(0), at(1), at(2))
    };
    let mut pixels = Vec::with_capacity((size.x * size.y) as usize);
    average(size, samples, read, |_, _, mean| pixels.push(mean * scale));
    HdrImage { width: size.x, height: size.y, pixels }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_code_survives() {
        let codes: Vec<u8> = (0..=255u8).flat_map(|c| [[c, c, c, 255]; 4]).flatten().collect();
        let image = srgb(&codes, UVec2::new(512, 2), 1);
        assert_eq!(image.pixels[510], [127, 127, 127, 255]);
        for code in 0..=255u8 {
            let image = srgb(&[code, code, code, 255].repeat(4), UVec2::new(1, 1), 2);
            assert_eq!(image.pixels[0], [code, code, code, 255]);
        }
    }

    #[test]
    fn black_and_white_make_the_grey_of_half_the_light() {
        let image = srgb(&[[0, 0, 0, 255], [255; 4], [255; 4], [0, 0, 0, 255]].concat(), UVec2::ONE, 2);
        // Half of the light lies between two codes, at 187.5.
        assert!([187, 188].contains(&image.pixels[0][0]));
    }

    #[test]
    fn linear_light_is_averaged_and_scaled() {
        let texel = |v: f32| [v, v * 2.0, 0.0, 1.0].map(|v| f16::from_f32(v).to_le_bytes()).concat();
        let bytes = [texel(1.0), texel(3.0), texel(1.0), texel(3.0)].concat();
        let image = linear(&bytes, UVec2::ONE, 2, 0.5);
        assert_eq!(image.pixels, [Vec3::new(1.0, 2.0, 0.0)]);
    }
}
