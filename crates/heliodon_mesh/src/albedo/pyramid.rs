//! A texture and its halved images, in linear light.

use crate::Texture;
use glam::{Vec2, Vec3};
use std::sync::Arc;

/// Level 0 is the texture itself; further levels hold 16 bits of linear light a channel, a third of the texture's memory in all.
pub(super) struct Pyramid {
    texture: Arc<Texture>,
    levels: Vec<Level>,
}

struct Level {
    width: u32,
    height: u32,
    texels: Vec<[u16; 3]>,
}

const FULL: f32 = 65535.0;

impl Pyramid {
    pub fn new(texture: Arc<Texture>) -> Self {
        let mut levels: Vec<Level> = Vec::new();
        let image = &texture.image;
        let (mut width, mut height) = (image.width, image.height);
        while width > 1 || height > 1 {
            let next = match levels.last() {
                None => halved(width, height, |x, y| image.linear(x, y).truncate()),
                Some(level) => halved(width, height, |x, y| level.texel(x, y)),
            };
            (width, height) = (next.width, next.height);
            levels.push(next);
        }
        Self { texture, levels }
    }

    /// Texels along u and v.
    pub fn size(&self) -> Vec2 {
        Vec2::new(self.texture.image.width as f32, self.texture.image.height as f32)
    }

    /// The linear colour around `uv`, averaged over about so many texels (an area; up to 1 takes the texture as it is).
    pub fn sample(&self, uv: Vec2, texels: f32) -> Vec3 {
        let level = if texels > 1.0 { 0.5 * texels.log2() } else { 0.0 };
        let level = level.min(self.levels.len() as f32);
        let (low, part) = (level.floor() as usize, level.fract());
        let fine = self.bilinear(uv, low);
        if part > 0.0 { fine.lerp(self.bilinear(uv, low + 1), part) } else { fine }
    }

    fn bilinear(&self, uv: Vec2, level: usize) -> Vec3 {
        let image = &self.texture.image;
        let (width, height) = match level {
            0 => (image.width, image.height),
            n => (self.levels[n - 1].width, self.levels[n - 1].height),
        };
        let texel = |x: u32, y: u32| match level {
            0 => image.linear(x, y).truncate(),
            n => self.levels[n - 1].texel(x, y),
        };
        let (x0, x1, fx) = self.texture.wrap[0].taps(uv.x, width);
        let (y0, y1, fy) = self.texture.wrap[1].taps(uv.y, height);
        let top = texel(x0, y0).lerp(texel(x1, y0), fx);
        let bottom = texel(x0, y1).lerp(texel(x1, y1), fx);
        top.lerp(bottom, fy)
    }
}

impl Level {
    fn texel(&self, x: u32, y: u32) -> Vec3 {
        Vec3::from(self.texels[y as usize * self.width as usize + x as usize].map(f32::from)) / FULL
    }
}

/// The image at half its size, each texel the mean of the area that it covers, also where the size is odd.
fn halved(width: u32, height: u32, texel: impl Fn(u32, u32) -> Vec3) -> Level {
    let (half_width, half_height) = ((width / 2).max(1), (height / 2).max(1));
    let columns = cover(width, half_width);
    let rows = cover(height, half_height);
    let mut texels = Vec::with_capacity(half_width as usize * half_height as usize);
    for row in &rows {
        for column in &columns {
            let mut sum = Vec3::ZERO;
            for &(y, weight_y) in row {
                for &(x, weight_x) in column {
                    sum += texel(x, y) * (weight_x * weight_y);
                }
            }
            texels.push(sum.to_array().map(|c| (c * FULL + 0.5) as u16));
        }
    }
    Level { width: half_width, height: half_height, texels }
}

/// For each of `to` equal parts of `from` texels: which texels it covers, with weights that add up to 1.
fn cover(from: u32, to: u32) -> Vec<Vec<(u32, f32)>> {
    let ratio = f64::from(from) / f64::from(to);
    (0..to)
        .map(|part| {
            let (begin, end) = (f64::from(part) * ratio, f64::from(part + 1) * ratio);
            let last = (end.ceil() as u32).min(from);
            (begin.floor() as u32..last)
                .map(|i| (i, ((f64::from(i + 1).min(end) - f64::from(i).max(begin)) / ratio) as f32))
                .filter(|(_, weight)| *weight > 0.0)
                .collect()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use heliodon_image::{SrgbImage, TextureWrap};

    fn pyramid(width: u32, height: u32, wrap: TextureWrap) -> Pyramid {
        let mut image = SrgbImage::filled(width, height, [0, 0, 0, 255]);
        for (i, pixel) in image.pixels.iter_mut().enumerate() {
            pixel[0] = if (i as u32 % width) * 2 < width { 0 } else { 255 };
        }
        Pyramid::new(Arc::new(Texture { source: String::new(), image, wrap: [wrap; 2] }))
    }

    #[test]
    fn every_level_keeps_the_mean() {
        for (width, height) in [(64, 64), (65, 33), (7, 1), (1, 1), (3, 100)] {
            let pyramid = pyramid(width, height, TextureWrap::Repeat);
            let mean = (0..width).filter(|x| x * 2 >= width).count() as f32 / width as f32;
            for level in &pyramid.levels {
                let sum: f32 = level.texels.iter().map(|t| f32::from(t[0]) / FULL).sum();
                assert!((sum / level.texels.len() as f32 - mean).abs() < 1e-4, "{width} x {height}");
            }
            assert!((pyramid.sample(Vec2::splat(0.3), 1e12).x - mean).abs() < 1e-4);
        }
    }

    #[test]
    fn textures_go_on_as_they_say() {
        let at = |wrap, u: f32| pyramid(8, 8, wrap).sample(Vec2::new(u, 0.5), 1.0).x;
        assert_eq!(
            [
                at(TextureWrap::Repeat, 0.25),
                at(TextureWrap::Repeat, 0.75),
                at(TextureWrap::Repeat, 1.25),
                at(TextureWrap::Repeat, -0.25)
            ],
            [0., 1., 0., 1.]
        );
        assert_eq!(
            [at(TextureWrap::Mirror, 1.25), at(TextureWrap::Mirror, -0.25), at(TextureWrap::Mirror, 1.75)],
            [1., 0., 0.]
        );
        assert_eq!([at(TextureWrap::Clamp, 1.25), at(TextureWrap::Clamp, 0.999), at(TextureWrap::Clamp, -3.0)], [1., 1., 0.]);
        assert_eq!(at(TextureWrap::Repeat, f32::NAN), at(TextureWrap::Repeat, 0.0));
        assert_eq!(at(TextureWrap::Repeat, 0.0), 0.5);
    }
}
