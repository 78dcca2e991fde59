//! Rows of bits, a texel each.

use super::cover;
use glam::Vec2;

/// A picture of bits.
#[derive(Clone, Debug)]
pub(super) struct Bitmap {
    pub width: u32,
    pub height: u32,
    /// Words of a row.
    words: usize,
    bits: Vec<u64>,
}

/// Where a chart's least coordinates come to lie: a texel's middle, so that nothing before it is asked for.
pub(super) const INSET: f32 = 0.5;

impl Bitmap {
    fn empty(width: u32, height: u32) -> Self {
        let words = width.div_ceil(64) as usize;
        Self { width, height, words, bits: vec![0; words * height as usize] }
    }

    /// Of triangles whose coordinates are in texels and least ones [`INSET`]: every texel that filtering takes into account anywhere on them. None where it
    /// is larger than `most` a side.
    pub fn new(triangles: &[[Vec2; 3]], most: u32) -> Option<Self> {
        let high = triangles.iter().flatten().fold(Vec2::splat(INSET), |high, p| high.max(*p));
        // filtering at p takes the texels whose middles are nearer than one texel
        let size = (high + 0.5).ceil().max(Vec2::ONE);
        if !(size.x <= most as f32 && size.y <= most as f32) {
            return None;
        }
        let mut bitmap = Self::empty(size.x as u32, size.y as u32);
        let (width, words) = (bitmap.width as usize, bitmap.words);
        for triangle in triangles {
            cover(triangle, 1.0, bitmap.height as usize, |y, begin, end| {
                set(&mut bitmap.bits[y * words..][..words], begin, end.min(width))
            });
        }
        Some(bitmap)
    }

    /// The same turned by a quarter, anticlockwise: x becomes the height less y, y becomes x.
    pub fn turned(&self) -> Self {
        let mut turned = Self::empty(self.height, self.width);
        let words = turned.words;
        // a run is one bit in each of its rows: where it begins and ends the bit changes
        for (y, row) in self.rows().enumerate() {
            let x = self.height as usize - 1 - y;
            for (begin, end) in runs(row) {
                for place in [begin, end].iter().filter(|place| **place < self.width as usize) {
                    turned.bits[place * words + x / 64] ^= 1 << (x % 64);
                }
            }
        }
        for place in words..turned.bits.len() {
            turned.bits[place] ^= turned.bits[place - words];
        }
        turned
    }

    pub fn rows(&self) -> impl Iterator<Item = &[u64]> {
        self.bits.chunks_exact(self.words)
    }

    /// About how many texels lie beside it: two at each run, and above and below it two for each of its own that the next row does not have.
    pub fn rim(&self) -> u64 {
        let begins = |row: &[u64]| {
            let before = std::iter::once(0).chain(row.iter().copied());
            row.iter()
                .zip(before)
                .map(|(word, before)| u64::from((word & !(word << 1 | before >> 63)).count_ones()))
                .sum::<u64>()
        };
        2 * self.rows().map(begins).sum::<u64>() + 2 * u64::from(self.width)
    }

    /// How many are set.
    pub fn count(&self) -> u64 {
        self.bits.iter().map(|word| u64::from(word.count_ones())).sum()
    }
}

/// Where runs of set bits begin and end.
pub(super) fn runs(row: &[u64]) -> impl Iterator<Item = (usize, usize)> {
    let mut x = 0;
    std::iter::from_fn(move || {
        let begin = next(row, x, true)?;
        x = next(row, begin, false).unwrap_or(row.len() * 64);
        Some((begin, x))
    })
}

/// The first bit from `x` on that is set, or not.
#[inline]
pub(super) fn next(row: &[u64], x: usize, is_set: bool) -> Option<usize> {
    let flip = if is_set { 0 } else { u64::MAX };
    let mut word = x / 64;
    let mut bits = (row.get(word)? ^ flip) & (u64::MAX << (x % 64));
    while bits == 0 {
        word += 1;
        bits = row.get(word)? ^ flip;
    }
    Some(word * 64 + bits.trailing_zeros() as usize)
}

/// Sets the bits from `begin` on and before `end`.
#[inline]
pub(super) fn set(row: &mut [u64], begin: usize, end: usize) {
    if begin >= end {
        return;
    }
    let (first, last) = (begin / 64, (end - 1) / 64);
    let (head, tail) = (u64::MAX << (begin % 64), u64::MAX >> (63 - (end - 1) % 64));
    if first == last {
        row[first] |= head & tail;
    } else {
        row[first] |= head;
        row[first + 1..last].fill(u64::MAX);
        row[last] |= tail;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_are_set_and_found() {
        let mut row = [0; 3];
        set(&mut row, 3, 3);
        assert_eq!(runs(&row).count(), 0);
        for (begin, end) in [(0, 1), (5, 64), (66, 68), (70, 192)] {
            set(&mut row, begin, end);
        }
        assert_eq!(runs(&row).collect::<Vec<_>>(), [(0, 1), (5, 64), (66, 68), (70, 192)]);
        assert_eq!(next(&row, 68, false), Some(68));
        assert_eq!(next(&row, 70, false), None);
    }

    #[test]
    fn four_quarters_are_a_whole_turn() {
        let at = |x: f32, y: f32| Vec2::splat(INSET) + Vec2::new(x, y);
        let bitmap = Bitmap::new(&[[at(0.0, 0.0), at(130.2, 3.0), at(40.0, 77.0)]], 200).unwrap();
        let turned = bitmap.turned();
        assert_eq!((turned.width, turned.height), (bitmap.height, bitmap.width));
        let is_set = |bitmap: &Bitmap, x: usize, y: usize| bitmap.bits[y * bitmap.words + x / 64] >> (x % 64) & 1;
        for y in 0..bitmap.height as usize {
            for x in 0..bitmap.width as usize {
                assert_eq!(is_set(&bitmap, x, y), is_set(&turned, bitmap.height as usize - 1 - y, x));
            }
        }
        assert_eq!(turned.turned().turned().turned().bits, bitmap.bits);
        assert_eq!(turned.count(), bitmap.count());
    }
}
