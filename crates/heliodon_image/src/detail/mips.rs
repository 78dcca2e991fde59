//! Mip levels whose mean stays at exactly 128.

use super::quantise::round_up;
use super::{DetailTexture, NEUTRAL};

/// One mip level.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DetailLevel {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// `width * height` codes, row-major from the top left; their mean is exactly [`NEUTRAL`].
    pub codes: Vec<u8>,
}

/// Sums of the base level's codes in blocks of `2^shift`: exact for any level.
pub(super) struct BlockSums {
    pub width: u32,
    pub height: u32,
    pub shift: u32,
    pub sums: Vec<u32>,
}

impl BlockSums {
    pub fn of(texture: &DetailTexture) -> Self {
        let sums = texture.codes.iter().map(|&code| u32::from(code)).collect();
        Self { width: texture.width, height: texture.height, shift: 0, sums }
    }

    /// Of blocks twice as large along each side that has more than one block; `None` after the last.
    ///
    /// A sum is at most 255 x 2048 x 2048, below 2^31.
    pub fn halved(&self) -> Option<Self> {
        let (columns, rows) = (self.width.min(2), self.height.min(2));
        if (columns, rows) == (1, 1) {
            return None;
        }
        let (width, height) = (self.width / columns, self.height / rows);
        let at = |x: u32, y: u32| self.sums[y as usize * self.width as usize + x as usize];
        let block = |k: u32| -> u32 {
            let (x, y) = (k % width * columns, k / width * rows);
            (0..rows).flat_map(|j| (0..columns).map(move |i| (i, j))).map(|(i, j)| at(x + i, y + j)).sum()
        };
        let shift = self.shift + columns / 2 + rows / 2;
        Some(Self { width, height, shift, sums: (0..width * height).map(block).collect() })
    }
}

impl DetailTexture {
    /// All mip levels, the texture itself first, each half of the one before along both sides (a side of 1 stays), down to one
    /// texel of 128.
    ///
    /// Each texel is the mean of the base level's texels that it covers (a box filter over codes, which are linear), rounded
    /// such that the level's mean is exactly 128. Every level is made from the base, so that rounding does not add up.
    #[must_use]
    pub fn mip_levels(&self) -> Vec<DetailLevel> {
        let mut levels = vec![DetailLevel { width: self.width, height: self.height, codes: self.codes.clone() }];
        let mut sums = BlockSums::of(self).halved();
        while let Some(blocks) = sums {
            let mut codes: Vec<u8> = blocks.sums.iter().map(|sum| (sum >> blocks.shift) as u8).collect();
            // the remainder in 2^-32; its upper bits are those that the shift takes away
            let remainders: Vec<u32> = blocks.sums.iter().map(|sum| sum << (32 - blocks.shift)).collect();
            let target = codes.len() as u64 * u64::from(NEUTRAL);
            round_up(&mut codes, &remainders, target);
            levels.push(DetailLevel { width: blocks.width, height: blocks.height, codes });
            sums = blocks.halved();
        }
        levels
    }

    /// The codes of all mip levels one after the other, the base first: a texture upload's bytes, with the number of levels.
    #[must_use]
    pub fn mip_bytes(&self) -> (Vec<u8>, u32) {
        let levels = self.mip_levels();
        let count = levels.len() as u32;
        (levels.into_iter().flat_map(|level| level.codes).collect(), count)
    }
}
