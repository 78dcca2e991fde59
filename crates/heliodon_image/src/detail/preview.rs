//! What a detail texture does to a wall, as a picture.

use super::{DetailTexture, factor};
use crate::{SheetLayout, SrgbImage, contact_sheet};
use glam::Vec3;
use heliodon_math::color::srgb8_from_linear;

/// Linear albedo of a beige plastered wall and of grey stone.
const BEIGE: Vec3 = Vec3::new(0.61, 0.50, 0.35);
const GREY: Vec3 = Vec3::new(0.30, 0.30, 0.29);

impl DetailTexture {
    /// A wall of one colour, so many tiles wide and high (1 to 8), on which the texture is multiplied at full weight; a texel is a
    /// pixel. Where a factor makes a colour brighter than 1, it is clamped.
    #[must_use]
    pub fn wall(&self, albedo_linear: Vec3, tiles: u32) -> SrgbImage {
        let tiles = tiles.clamp(1, 8);
        let (width, height) = (self.width * tiles, self.height * tiles);
        let tones: [[u8; 4]; 256] = std::array::from_fn(|code| {
            let lit = albedo_linear * factor(code as u8);
            [srgb8_from_linear(lit.x), srgb8_from_linear(lit.y), srgb8_from_linear(lit.z), u8::MAX]
        });
        self.tiled(width, height, |code| tones[usize::from(code)])
    }

    /// A sheet to judge it by: its codes, and a beige and a grey wall of 3 x 3 tiles, of textures above 512 texels of 2 x 2.
    #[must_use]
    pub fn preview(&self) -> SrgbImage {
        let tiles = if self.width.max(self.height) > 512 { 2 } else { 3 };
        let codes = self.tiled(self.width * tiles, self.height * tiles, |code| [code, code, code, u8::MAX]);
        let walls = [codes, self.wall(BEIGE, tiles), self.wall(GREY, tiles)];
        contact_sheet(&walls, &SheetLayout { columns: 3, ..SheetLayout::default() })
    }

    fn tiled(&self, width: u32, height: u32, pixel: impl Fn(u8) -> [u8; 4]) -> SrgbImage {
        // both sides are powers of two
        let at = |k: u32| (k / width % self.height * self.width + k % width % self.width) as usize;
        SrgbImage { width, height, pixels: (0..width * height).map(|k| pixel(self.codes[at(k)])).collect() }
    }
}
