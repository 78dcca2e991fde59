//! A photograph at all resolutions, in linear light.

use glam::{DVec2, Vec3};
use heliodon_image::Picture;

struct Level {
    width: usize,
    height: usize,
    pixels: Vec<Vec3>,
}

/// The photograph's own pixels are read where they are; coarser levels, each of half the size, are kept in floats.
pub(super) struct Pyramid<'a> {
    picture: &'a Picture,
    levels: Vec<Level>,
}

/// Codes of 8 bits beyond which a sensor tells no more.
const DARKEST: u8 = 1;
const BRIGHTEST: u8 = 253;
/// From so far below its end on, in linear light, a sensor's word counts less: others take over without a border.
const HEADROOM: f32 = 0.25;
/// Seen over so many pixels, for grain not to decide who counts.
const OVER_PX: f32 = 6.0;

impl<'a> Pyramid<'a> {
    pub fn new(picture: &'a Picture) -> Self {
        let mut pyramid = Self { picture, levels: Vec::new() };
        let [width, height] = picture.size().map(|side| side as usize);
        let (mut width, mut height) = (width, height);
        while width > 1 || height > 1 {
            let level = pyramid.levels.len();
            let (above_x, above_y) = (width - 1, height - 1);
            (width, height) = (width.div_ceil(2), height.div_ceil(2));
            let mut pixels = Vec::with_capacity(width * height);
            for y in 0..height {
                for x in 0..width {
                    let at = |dx: usize, dy: usize| pyramid.pixel(level, (2 * x + dx).min(above_x), (2 * y + dy).min(above_y));
                    pixels.push((at(0, 0) + at(1, 0) + at(0, 1) + at(1, 1)) * 0.25);
                }
            }
            pyramid.levels.push(Level { width, height, pixels });
        }
        pyramid
    }

    fn size(&self, level: usize) -> [usize; 2] {
        match level.checked_sub(1) {
            None => self.picture.size().map(|side| side as usize),
            Some(coarser) => [self.levels[coarser].width, self.levels[coarser].height],
        }
    }

    fn pixel(&self, level: usize, x: usize, y: usize) -> Vec3 {
        match (level.checked_sub(1), self.picture) {
            (Some(coarser), _) => self.levels[coarser].pixels[y * self.levels[coarser].width + x],
            (None, Picture::Eight(image)) => image.linear(x as u32, y as u32).truncate(),
            (None, Picture::Hdr(image)) => image.pixels[y * image.width as usize + x],
        }
    }

    fn bilinear(&self, level: usize, pixel: DVec2) -> Vec3 {
        let [width, height] = self.size(level);
        let at = pixel / f64::from(1_u32 << level.min(31)) - 0.5;
        let clamp = |x: f64, count: usize| {
            let x = x.clamp(0.0, (count - 1) as f64);
            let first = (x as usize).min(count.saturating_sub(2));
            (first, (first + 1).min(count - 1), (x - first as f64) as f32)
        };
        let (x0, x1, fx) = clamp(at.x, width);
        let (y0, y1, fy) = clamp(at.y, height);
        let top = self.pixel(level, x0, y0).lerp(self.pixel(level, x1, y0), fx);
        let bottom = self.pixel(level, x0, y1).lerp(self.pixel(level, x1, y1), fx);
        top.lerp(bottom, fy)
    }

    /// The mean about a pixel over so many pixels' width: between the two levels next to that.
    pub fn sample(&self, pixel: DVec2, width_px: f32) -> Vec3 {
        let level = libm::log2f(width_px.max(1.0)).min(self.levels.len() as f32);
        let (fine, part) = (level as usize, level.fract());
        let color = self.bilinear(fine, pixel);
        if part > 0.0 { color.lerp(self.bilinear((fine + 1).min(self.levels.len()), pixel), part) } else { color }
    }

    /// How far a pixel's surroundings are from the sensor's end, 0 at it and 1 from [`HEADROOM`] on. HDR pictures have none.
    pub fn headroom(&self, pixel: DVec2) -> f32 {
        let Picture::Eight(_) = self.picture else { return 1.0 };
        ((1.0 - self.sample(pixel, OVER_PX).max_element()) / HEADROOM).clamp(0.0, 1.0)
    }

    /// Whether the sensor could tell what it saw there: not too dark, not too bright. Of HDR pictures every pixel tells.
    pub fn tells(&self, pixel: DVec2) -> bool {
        let Picture::Eight(image) = self.picture else { return true };
        let cell = |x: f64, count: u32| (x.max(0.0) as u32).min(count - 1);
        let [r, g, b, _] = image.pixel(cell(pixel.x, image.width), cell(pixel.y, image.height));
        [r, g, b].iter().all(|code| (DARKEST..=BRIGHTEST).contains(code))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use heliodon_image::HdrImage;

    #[test]
    fn every_level_reads_a_slope_at_the_same_place() {
        let image = HdrImage::from_fn(64, 32, |x, y| Vec3::new(x as f32 + 0.5, y as f32 + 0.5, 1.0));
        let picture = Picture::Hdr(image);
        let pyramid = Pyramid::new(&picture);
        for width_px in [0.5, 1.0, 1.7, 4.0, 5.5] {
            let at = DVec2::new(30.3, 14.9);
            let color = pyramid.sample(at, width_px);
            assert!((color - Vec3::new(30.3, 14.9, 1.0)).length() < 1e-4, "{width_px}: {color}");
        }
        assert_eq!(pyramid.sample(DVec2::new(9.0, 9.0), 1.0e6), Vec3::new(32.0, 16.0, 1.0));
    }
}
