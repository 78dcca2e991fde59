//! Frames over several backgrounds, to look at.

use anyhow::Result;
use heliodon_capture::key::{Blending, Keyed};
use heliodon_image::detail::{DetailKind, DetailParams, DetailTexture, factor};
use heliodon_image::{SheetLayout, SrgbImage, contact_sheet};
use heliodon_math::color::{linear_from_srgb8_table, srgb8_from_linear};

/// Frames that are drawn.
const FRAMES: u64 = 6;
/// The longest side of a picture on the sheet.
const LONGEST: usize = 640;
/// Backgrounds, sRGB: black, white, a clear sky. Stone is the fourth.
const PLAIN: [[u8; 3]; 3] = [[0; 3], [255; 3], [120, 170, 225]];
/// Pentelic marble in the sun, linear.
const STONE: [f32; 3] = [0.56, 0.49, 0.38];

/// The sheet while frames come.
pub struct Preview {
    /// Which frames are drawn: every so many.
    every: u64,
    blending: Blending,
    pictures: Vec<SrgbImage>,
}

impl Preview {
    /// A sheet of six frames out of `frames`, or of the first ones where nobody knows how many there are.
    pub fn new(frames: Option<u64>, blending: Blending) -> Self {
        Self { every: frames.map_or(30, |frames| frames.div_ceil(FRAMES)).max(1), blending, pictures: Vec::new() }
    }

    /// Draws a frame, if it is one of those.
    pub fn offer(&mut self, number: u64, keyed: &Keyed) {
        let wanted = number % self.every == self.every / 2 || (number == 0 && self.every > 2 * FRAMES && keyed.width < 16);
        if !wanted || self.pictures.len() as u64 >= 4 * FRAMES {
            return;
        }
        let step = keyed.width.max(keyed.height).div_ceil(LONGEST).max(1);
        for background in PLAIN {
            self.pictures.push(scaled(&keyed.over(self.blending, |_, _| background), keyed, step));
        }
        // the pattern is as fine on the sheet as it is alone
        if let Ok(stone) = DetailTexture::generate(&DetailParams::new(DetailKind::Stone)) {
            let side = stone.width() as usize;
            let at = |x: usize, y: usize| {
                let factor = factor(stone.codes()[y / step % side * side + x / step % side]);
                STONE.map(|albedo| srgb8_from_linear(albedo * factor))
            };
            self.pictures.push(scaled(&keyed.over(self.blending, at), keyed, step));
        }
    }

    /// The sheet as PNG.
    pub fn sheet(self) -> Result<Vec<u8>> {
        let sheet = contact_sheet(&self.pictures, &SheetLayout { columns: 4, margin: 4, ..SheetLayout::default() });
        Ok(sheet.to_png_bytes()?)
    }
}

/// Smaller by a whole number, means taken in linear light.
fn scaled(pixels: &[[u8; 4]], keyed: &Keyed, step: usize) -> SrgbImage {
    let (width, height) = (keyed.width.div_ceil(step), keyed.height.div_ceil(step));
    let linear = linear_from_srgb8_table();
    let pixels = (0..width * height)
        .map(|k| {
            let (x, y) = (k % width * step, k / width * step);
            let (mut sum, mut count) = ([0.0; 3], 0.0);
            for y in y..(y + step).min(keyed.height) {
                for pixel in &pixels[y * keyed.width..][x..(x + step).min(keyed.width)] {
                    (0..3).for_each(|c| sum[c] += linear[usize::from(pixel[c])]);
                    count += 1.0;
                }
            }
            let [r, g, b] = sum.map(|x: f32| srgb8_from_linear(x / count));
            [r, g, b, 255]
        })
        .collect();
    SrgbImage { width: width as u32, height: height as u32, pixels }
}
