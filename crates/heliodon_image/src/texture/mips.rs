//! Smaller versions of 8-bit pictures.

use super::TextureUse;
use crate::SrgbImage;
use crate::resample::coverage;
use glam::{Vec3, Vec4};
use heliodon_math::color::{linear_from_srgb8_table, srgb8_from_linear};
use rayon::prelude::*;

/// A pixel as it is summed.
#[derive(Clone, Copy)]
struct Sum {
    /// Colours by their alpha, and alpha; other numbers as they are.
    weighted: Vec4,
    /// The colour without alpha, for where nothing can be seen: blocks hold it all the same, and filters reach it.
    plain: Vec3,
}

struct Level {
    width: u32,
    height: u32,
    pixels: Vec<Sum>,
}

/// All of them, each half as large as the one before, rounded down, to a single pixel. Each is made of the one before as it was before it was rounded to 8 bits.
pub(super) fn smaller(image: &SrgbImage, usage: TextureUse) -> Vec<SrgbImage> {
    let table = linear_from_srgb8_table();
    let sum = |[r, g, b, a]: [u8; 4]| match usage {
        TextureUse::Color => {
            let plain = Vec3::new(table[usize::from(r)], table[usize::from(g)], table[usize::from(b)]);
            let alpha = f32::from(a) / 255.0;
            Sum { weighted: (plain * alpha).extend(alpha), plain }
        }
        TextureUse::Data | TextureUse::NormalMap => {
            let all = Vec4::new(f32::from(r), f32::from(g), f32::from(b), f32::from(a)) / 255.0;
            Sum { weighted: all, plain: Vec3::ZERO }
        }
    };
    let (width, height) = (image.width, image.height);
    let mut out = Vec::new();
    let mut last = None;
    while let Some((width, height)) =
        next_size(last.as_ref().map_or((width, height), |level: &Level| (level.width, level.height)))
    {
        let level = match &last {
            None => reduced([image.width, image.height], [width, height], |i| sum(image.pixels[i])),
            Some(last) => reduced([last.width, last.height], [width, height], |i| last.pixels[i]),
        };
        let pixels = level.pixels.par_iter().map(|sum| rounded(sum, usage)).collect();
        out.push(SrgbImage { width, height, pixels });
        last = Some(level);
    }
    out
}

fn next_size((width, height): (u32, u32)) -> Option<(u32, u32)> {
    (width > 1 || height > 1).then(|| ((width / 2).max(1), (height / 2).max(1)))
}

/// Each pixel the mean of what it covers.
fn reduced(from: [u32; 2], to: [u32; 2], pixel: impl Fn(usize) -> Sum + Sync) -> Level {
    let [columns, rows] = [0, 1].map(|axis| coverage(from[axis], to[axis], |low, high| high - low));
    let row = |weights: &Vec<(usize, f32)>| {
        let mut line = Vec::with_capacity(columns.len());
        for column in &columns {
            let mut sum = Sum { weighted: Vec4::ZERO, plain: Vec3::ZERO };
            for &(y, down) in weights {
                for &(x, across) in column {
                    let Sum { weighted, plain } = pixel(y * from[0] as usize + x);
                    sum.weighted += weighted * (down * across);
                    sum.plain += plain * (down * across);
                }
            }
            line.push(sum);
        }
        line
    };
    Level { width: to[0], height: to[1], pixels: rows.par_iter().flat_map_iter(row).collect() }
}

fn byte(x: f32) -> u8 {
    (x * 255.0).round().clamp(0.0, 255.0) as u8
}

fn rounded(sum: &Sum, usage: TextureUse) -> [u8; 4] {
    let Sum { weighted, plain } = *sum;
    let (number, alpha) = (weighted.truncate(), weighted.w);
    match usage {
        TextureUse::Color => {
            // less than half a step of alpha is none
            let color = if alpha > 0.5 / 255.0 { number / alpha } else { plain };
            let [r, g, b] = color.to_array().map(srgb8_from_linear);
            [r, g, b, byte(alpha)]
        }
        TextureUse::Data => weighted.to_array().map(byte),
        TextureUse::NormalMap => {
            let unit = (number * 2.0 - 1.0).try_normalize().unwrap_or(Vec3::Z);
            let [x, y, z] = ((unit + 1.0) * 0.5).to_array().map(byte);
            [x, y, z, byte(alpha)]
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(width: u32, pixels: &[[u8; 4]]) -> SrgbImage {
        SrgbImage { width, height: pixels.len() as u32 / width, pixels: pixels.to_vec() }
    }

    fn last(image: &SrgbImage, usage: TextureUse) -> [u8; 4] {
        smaller(image, usage).last().unwrap().pixels[0]
    }

    #[test]
    fn light_is_averaged_and_not_its_code() {
        let board = picture(2, &[[0, 0, 0, 255], [255; 4], [255; 4], [0, 0, 0, 255]]);
        // half the light is coded as 188
        assert_eq!(last(&board, TextureUse::Color), [188, 188, 188, 255]);
        assert_eq!(last(&board, TextureUse::Data), [128, 128, 128, 255]);
    }

    #[test]
    fn what_cannot_be_seen_does_not_bleed() {
        let edge = picture(2, &[[200, 100, 50, 255], [0, 0, 0, 0], [200, 100, 50, 255], [0, 255, 0, 0]]);
        assert_eq!(last(&edge, TextureUse::Color), [200, 100, 50, 128]);
        let nothing = picture(2, &[[90, 90, 90, 0]; 4]);
        assert_eq!(last(&nothing, TextureUse::Color), [90, 90, 90, 0]);
    }

    #[test]
    fn normals_stay_unit() {
        let bent = picture(2, &[[255, 128, 128, 255], [128, 128, 255, 255]]);
        let [x, y, z, _] = last(&bent, TextureUse::NormalMap);
        let unit = Vec3::new(x.into(), y.into(), z.into()) / 127.5 - 1.0;
        assert!((unit.length() - 1.0).abs() < 0.01 && (unit.x - unit.z).abs() < 0.01, "{unit}");
        let opposite = picture(2, &[[255, 128, 128, 255], [0, 127, 127, 255]]);
        assert_eq!(last(&opposite, TextureUse::NormalMap)[2], 255);
    }

    #[test]
    fn odd_sides_lose_nothing() {
        let pixels: Vec<[u8; 4]> = (0..35_u8).map(|i| [i * 7, 255 - i * 7, 3, 255]).collect();
        let image = picture(7, &pixels);
        let sizes: Vec<_> = smaller(&image, TextureUse::Data).iter().map(|level| (level.width, level.height)).collect();
        assert_eq!(sizes, [(3, 2), (1, 1)]);
        let mean = pixels.iter().map(|p| f64::from(p[0])).sum::<f64>() / 35.0;
        assert!((f64::from(last(&image, TextureUse::Data)[0]) - mean).abs() < 1.0);
    }
}
