//! A texture that charts are laid onto.

use super::bitmap::{next, set};
use super::mask::Mask;
use super::rooms::Rooms;
use std::collections::HashMap;

/// Words that are looked at together.
pub(super) const LANES: usize = 4;
/// Texels of these.
pub(super) const BLOCK: u32 = 64 * LANES as u32;

/// Which texels are taken, a bit each: all of a large sheet stays near to the processor.
#[derive(Clone, Debug)]
pub(super) struct Sheet {
    pub width: u32,
    pub height: u32,
    /// Words of a row: those of whole blocks, and one behind them.
    words: usize,
    /// Texels behind a row's end are taken too, so that nothing reaches over it.
    taken: Vec<u64>,
    /// For each row its longest free run.
    longest: Vec<u16>,
    /// And for each of its blocks the most texels from one of the block on that are free one after the other.
    longest_from: Vec<u16>,
    blocks: usize,
    /// Where rectangles have no room ...
    pub rooms: Rooms,
    /// ... and masks, by their hash, which is one for few: who begins to look too late finds room later.
    pub rooms_of_masks: HashMap<u64, u32>,
    /// Texels that are not taken.
    free: u64,
    /// What is looked at of rows of long runs, kept so that it need not be made anew.
    pub scratch: Vec<u64>,
}

/// The largest side of a sheet, so that runs fit into 16 bits.
pub(super) const LARGEST: u32 = 16_384;

impl Sheet {
    pub fn new(width: u32, height: u32) -> Self {
        let blocks = width.div_ceil(BLOCK) as usize;
        let words = blocks * LANES + 1;
        let mut row = vec![0; words];
        set(&mut row, width as usize, words * 64);
        let mut sheet = Self {
            width,
            height,
            words,
            taken: row.repeat(height as usize),
            longest: vec![0; height as usize],
            longest_from: vec![0; blocks * height as usize],
            blocks,
            rooms: Rooms::new(width.max(height)),
            rooms_of_masks: HashMap::new(),
            free: u64::from(width) * u64::from(height),
            scratch: Vec::new(),
        };
        (0..height).for_each(|y| sheet.measure(y, 0, width));
        sheet
    }

    /// Texels that are not taken.
    pub fn free(&self) -> u64 {
        self.free
    }

    /// How many blocks a row has.
    pub fn blocks(&self) -> u32 {
        self.blocks as u32
    }

    /// The bits of a row.
    #[inline(always)]
    pub fn row(&self, y: u32) -> &[u64] {
        &self.taken[y as usize * self.words..][..self.words]
    }

    /// A row's longest free run.
    #[inline(always)]
    pub fn longest(&self, y: u32) -> u32 {
        u32::from(self.longest[y as usize])
    }

    /// The most texels from one of a block on that are free one after the other.
    #[inline(always)]
    pub fn longest_from(&self, y: u32, block: u32) -> u32 {
        u32::from(self.longest_from[y as usize * self.blocks + block as usize])
    }

    /// Takes the mask's texels, laid at a place, and those within `margin` of them.
    pub fn put(&mut self, mask: &Mask, [x, y]: [u32; 2], margin: u32) {
        let rows = y.saturating_sub(margin)..(y + mask.height + margin).min(self.height);
        let [begin, end] = [x.saturating_sub(margin), (x + mask.width + margin).min(self.width)];
        for row in rows {
            let near = row.saturating_sub(y + margin)..(row + margin + 1).saturating_sub(y).min(mask.height);
            // the free run that reaches these texels becomes shorter too
            let words = &mut self.taken[row as usize * self.words..][..self.words];
            let from = run_begin(words, begin);
            let count = |words: &[u64]| {
                let touched = &words[(begin / 64) as usize..=(end / 64) as usize];
                touched.iter().map(|word| u64::from(word.count_ones())).sum::<u64>()
            };
            let before = count(words);
            for run in near.flat_map(|of_mask| mask.row(of_mask)) {
                let begin = (x + u32::from(run.begin)).saturating_sub(margin);
                set(words, begin as usize, (x + run.end() + margin).min(self.width) as usize);
            }
            self.free -= count(words) - before;
            self.measure(row, from, end);
        }
    }

    /// How long the free runs of a row's blocks are, from the block of one texel to that of another.
    fn measure(&mut self, y: u32, from: u32, end: u32) {
        let row = &self.taken[y as usize * self.words..][..self.words];
        let longest_from = &mut self.longest_from[y as usize * self.blocks..][..self.blocks];
        let block_of = |x: usize| x / BLOCK as usize;
        let last = block_of(end as usize).min(self.blocks - 1);
        let mut x = block_of(from as usize) * BLOCK as usize;
        longest_from[block_of(x)..=last].fill(0);
        while let Some(begin) = next(row, x, false).filter(|begin| block_of(*begin) <= last) {
            x = next(row, begin, true).unwrap_or(row.len() * 64);
            let first = block_of(begin);
            for (of_run, longest) in longest_from[first..=block_of(x - 1).min(last)].iter_mut().enumerate() {
                *longest = (*longest).max((x - begin.max((first + of_run) * BLOCK as usize)) as u16);
            }
        }
        self.longest[y as usize] = longest_from.iter().copied().max().unwrap_or(0);
    }
}

/// Where the free run begins that ends before a texel; the texel where none does.
fn run_begin(row: &[u64], x: u32) -> u32 {
    let (mut word, bits) = ((x / 64) as usize, x % 64);
    let mut taken = row[word] & !(u64::MAX << bits);
    while taken == 0 {
        if word == 0 {
            return 0;
        }
        word -= 1;
        taken = row[word];
    }
    64 * word as u32 + 64 - taken.leading_zeros()
}

#[cfg(test)]
mod tests {
    use super::super::bitmap::{Bitmap, INSET};
    use super::super::inner::Inner;
    use super::*;
    use glam::Vec2;

    fn made(triangles: &[[Vec2; 3]], most: u32) -> Mask {
        let bitmap = Bitmap::new(triangles, most).unwrap();
        let mask = Mask::new(&bitmap);
        let inner = Inner::of(&bitmap, &mask);
        mask.with_inner(inner)
    }

    fn square(side: f32) -> Mask {
        let at = |x: f32, y: f32| Vec2::splat(INSET) + Vec2::new(x, y) * side;
        made(&[[at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0)], [at(0.0, 0.0), at(1.0, 1.0), at(0.0, 1.0)]], 1000)
    }

    #[test]
    fn squares_fill_a_sheet_row_by_row() {
        let mut sheet = Sheet::new(23, 11);
        let mask = square(4.0);
        let mut places = Vec::new();
        while let Some(place) = sheet.find(&mask, u32::MAX) {
            sheet.put(&mask, place, 1);
            places.push(place);
        }
        assert_eq!(places, [[0, 0], [6, 0], [12, 0], [18, 0], [0, 6], [6, 6], [12, 6], [18, 6]]);
        assert_eq!(sheet.find(&square(0.0), u32::MAX), None, "margins are taken");
    }

    #[test]
    fn a_triangle_makes_room_beside_its_slope() {
        let corner = |p: [f32; 2]| Vec2::splat(INSET) + Vec2::from(p);
        let under = made(&[[corner([0.0, 0.0]), corner([60.0, 0.0]), corner([0.0, 60.0])]], 100);
        let above = made(&[[corner([60.0, 0.0]), corner([60.0, 60.0]), corner([0.0, 60.0])]], 100);
        let mut sheet = Sheet::new(66, 66);
        sheet.put(&under, [0, 0], 0);
        let place = sheet.find(&above, u32::MAX).unwrap();
        assert!(place[0] <= 4 && place[1] <= 4, "{place:?}");
        assert_eq!(Sheet::new(60, 66).find(&above, u32::MAX), None);
    }
}
