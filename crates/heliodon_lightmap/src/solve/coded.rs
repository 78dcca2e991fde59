//! Light maps in files of fewer bits than they were solved in.

use super::LightMap;
use super::matching::{SEAM_CODES, white};
use crate::seams::Seams;
use crate::texels::{Texel, cell};
use glam::Vec3;
use heliodon_image::{Bc6h, SrgbImage, rgbe8, rgbe8_step};
use heliodon_math::color::{linear_from_srgb8_table, srgb8_from_linear};

/// Linear colours of the texels as those nearest to them that a screen of eight bits shows, of which 1 is white: each texel rounded up or down so that both sides of borders show the same as nearly as can be;
/// off by less than a code, not half of one. What is brighter than white is white.
///
/// # Panics
/// When there is not a colour for each texel.
#[must_use]
pub fn shown_srgb8(seams: &Seams, colors: &[Vec3]) -> Vec<Vec3> {
    let linear = linear_from_srgb8_table();
    let shown: Vec<Vec3> = colors.iter().map(|color| color.clamp(Vec3::ZERO, Vec3::ONE)).collect();
    let mut held: Vec<Vec3> =
        shown.iter().map(|x| x.to_array().map(|x| linear[usize::from(srgb8_from_linear(x))]).into()).collect();
    seams.choose(&shown, &mut held, 1.0, SEAM_CODES, |_, found, held| {
        let beside = move |(c, up): (usize, bool)| {
            let code = srgb8_from_linear(held[c]);
            let code = if up { code.checked_add(1)? } else { code.checked_sub(1)? };
            let (before, after) = (held[c], linear[usize::from(code)]);
            // what was found lies between both, or beyond the new one
            let is_near = if up { found[c] > before } else { found[c] < before };
            let mut color = held;
            color[c] = after;
            is_near.then_some(color)
        };
        (0..3).flat_map(|c| [(c, true), (c, false)]).filter_map(beside)
    });
    held
}

impl LightMap {
    /// As [`LightMap::image`], in four bytes with a common exponent ([`rgbe8`]), and each texel rounded up or down so that both sides of borders show the same as nearly as can be: texels are off by less than
    /// a step, not half of one.
    ///
    /// # Panics
    /// As [`LightMap::image`].
    #[must_use]
    pub fn rgbe8(&self, texels: &[Texel], sheet: u16, sides: [u32; 2]) -> SrgbImage {
        let rounded = |light: &Vec3| rgbe8_step(*light).map_or(Vec3::ZERO, |step| (*light / step).round() * step);
        let mut held: Vec<Vec3> = self.light.iter().map(rounded).collect();
        self.seams.choose(&self.light, &mut held, white(&self.light), SEAM_CODES, |_, found, held| {
            let step = rgbe8_step(held).unwrap_or(0.0);
            let beside = move |(c, by): (usize, f32)| {
                let mut color = held;
                color[c] += by * step;
                let is_near = (color[c] - found[c]).abs() < step && found[c] > 0.0 && color[c] >= 0.0;
                (is_near && color.max_element() <= 255.0 * step).then_some(color)
            };
            (0..3).flat_map(|c| [(c, 1.0), (c, -1.0)]).filter_map(beside)
        });
        rgbe8(&super::image(texels, &held, sheet, sides))
    }

    /// As [`LightMap::image`], in blocks of BC6H ([`heliodon_image::encode_bc6h`]): of a block only those texels count that filtering asks for, and those at borders take of its colours those with which both
    /// sides show the same as nearly as can be.
    ///
    /// # Panics
    /// As [`LightMap::image`].
    #[must_use]
    pub fn bc6h(&self, texels: &[Texel], sheet: u16, sides: [u32; 2]) -> Vec<u8> {
        let mut is_asked = vec![false; sides[0] as usize * sides[1] as usize];
        let place = |texel: &Texel| [u32::from(texel.x), u32::from(texel.y)];
        let of_sheet = || texels.iter().enumerate().filter(|(_, texel)| texel.sheet == sheet);
        of_sheet().for_each(|(_, texel)| is_asked[cell(sides, 0, place(texel)[0], place(texel)[1])] = true);
        let mut blocks = Bc6h::new(&self.image(texels, sheet, sides), |x, y| is_asked[cell(sides, 0, x, y)]);
        let mut held = self.light.clone();
        of_sheet().for_each(|(i, texel)| held[i] = blocks.color(place(texel)));
        self.seams.choose(&self.light, &mut held, white(&self.light), SEAM_CODES, |texel, _, _| {
            let is_of_sheet = texels[texel].sheet == sheet;
            is_of_sheet.then(|| blocks.choices(place(&texels[texel]))).into_iter().flatten()
        });
        of_sheet().for_each(|(i, texel)| blocks.choose(place(texel), held[i]));
        blocks.to_bytes()
    }
}
