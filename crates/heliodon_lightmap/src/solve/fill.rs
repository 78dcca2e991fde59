//! Fills what no texel covers: coarser and coarser means are pulled from what is known, and pushed back to where nothing is.
//!
//! S. Gortler, R. Grzeszczuk, R. Szeliski, M. Cohen: "The Lumigraph", SIGGRAPH 1996, section 3.4 (pull-push).

use glam::Vec3;
use heliodon_image::HdrImage;

/// Gives every pixel that is not known a mean of those around.
pub(super) fn fill(image: &mut HdrImage, known: Vec<bool>) {
    let finest =
        Level { width: image.width as usize, height: image.height as usize, pixels: std::mem::take(&mut image.pixels), known };
    let mut levels = vec![finest];
    while let Some(level) = levels.last().filter(|level| level.width > 1 || level.height > 1) {
        levels.push(level.coarser());
    }
    for coarse in (1..levels.len()).rev() {
        let (fine, coarse) = levels.split_at_mut(coarse);
        if let (Some(fine), Some(coarse)) = (fine.last_mut(), coarse.first()) {
            fine.take(coarse);
        }
    }
    image.pixels = levels.swap_remove(0).pixels;
}

struct Level {
    width: usize,
    height: usize,
    pixels: Vec<Vec3>,
    known: Vec<bool>,
}

impl Level {
    fn coarser(&self) -> Self {
        let (width, height) = (self.width.div_ceil(2), self.height.div_ceil(2));
        let mut coarser =
            Self { width, height, pixels: Vec::with_capacity(width * height), known: Vec::with_capacity(width * height) };
        for y in 0..height {
            for x in 0..width {
                let four = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(dx, dy)| (2 * x + dx, 2 * y + dy));
                let inside = four.into_iter().filter(|&(x, y)| x < self.width && y < self.height);
                let (sum, count) = inside
                    .map(|(x, y)| y * self.width + x)
                    .filter(|&at| self.known[at])
                    .fold((Vec3::ZERO, 0.0), |(sum, count), at| (sum + self.pixels[at], count + 1.0));
                coarser.pixels.push(if count > 0.0 { sum / count } else { Vec3::ZERO });
                coarser.known.push(count > 0.0);
            }
        }
        coarser
    }

    fn take(&mut self, coarse: &Self) {
        for y in 0..self.height {
            for x in 0..self.width {
                let at = y * self.width + x;
                if !self.known[at] {
                    self.pixels[at] = coarse.pixels[y / 2 * coarse.width + x / 2];
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_take_what_lies_around_and_the_known_stays() {
        let mut image = HdrImage::from_fn(13, 7, |x, _| if x < 4 { Vec3::ONE } else { Vec3::splat(3.0) });
        let known: Vec<bool> = (0..13 * 7).map(|i| (i % 13 < 3) || (i % 13 > 9)).collect();
        let before = image.clone();
        image.pixels.iter_mut().zip(&known).filter(|(_, known)| !**known).for_each(|(pixel, _)| *pixel = Vec3::splat(-9.0));
        fill(&mut image, known.clone());
        for (i, pixel) in image.pixels.iter().enumerate() {
            assert!(pixel.x >= 1.0 && pixel.x <= 3.0);
            assert!(!known[i] || *pixel == before.pixels[i]);
        }
        assert_eq!(image.pixels[3], Vec3::ONE);
        let mut nothing = HdrImage::filled(5, 5, Vec3::ONE);
        fill(&mut nothing, vec![false; 25]);
        assert_eq!(nothing.pixels, [Vec3::ZERO; 25]);
    }
}
