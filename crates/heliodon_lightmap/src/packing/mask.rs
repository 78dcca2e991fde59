//! The texels that a chart needs: every one that filtering takes into account anywhere on it.

use crate::cover::cover;
use glam::Vec2;

/// A run of texels in a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Run {
    pub begin: u16,
    pub length: u16,
}

/// A rectangle within a mask.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Inner {
    pub width: u32,
    pub height: u32,
    /// Its first row and column.
    pub row: u32,
    pub column: u32,
}

/// The texels of a chart at one scale, row by row.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Mask {
    pub width: u32,
    pub height: u32,
    runs: Vec<Run>,
    /// Where each row's runs begin, and where the last one's end.
    rows: Vec<u32>,
    /// All rows, so that what does not fit is found out early: the one with the longest run first, then each as far as can be from those before.
    pub order: Vec<u16>,
    pub texels: u64,
    /// Its largest rectangle.
    pub inner: Inner,
}

/// Where a chart's least coordinates come to lie in its mask: a texel's middle, so that nothing before it is asked for.
pub(super) const INSET: f32 = 0.5;

impl Mask {
    /// Of triangles whose coordinates are in texels and least ones [`INSET`]. None where it is larger than `most` a side.
    pub fn new(triangles: &[[Vec2; 3]], most: u32) -> Option<Self> {
        let high = triangles.iter().flatten().fold(Vec2::splat(INSET), |high, p| high.max(*p));
        // filtering at p takes the texels whose middles are nearer than one texel
        let size = (high + 0.5).ceil().max(Vec2::ONE);
        if !(size.x <= most as f32 && size.y <= most as f32) {
            return None;
        }
        let (width, height) = (size.x as usize, size.y as usize);
        let words = width.div_ceil(64);
        let mut bits = vec![0_u64; words * height];
        for triangle in triangles {
            cover(triangle, height, |y, begin, end| set(&mut bits[y * words..][..words], begin, end.min(width)));
        }
        let mut mask = Self { width: width as u32, height: height as u32, rows: vec![0], ..Self::default() };
        for row in bits.chunks_exact(words) {
            mask.push_row(row);
        }
        mask.inner = mask.largest_rectangle();
        mask.order = mask.rows_apart();
        mask.texels = mask.runs.iter().map(|run| u64::from(run.length)).sum();
        Some(mask)
    }

    /// A rectangle with all its texels.
    pub fn full(width: u32, height: u32) -> Self {
        let run = Run { begin: 0, length: width as u16 };
        Self {
            width,
            height,
            runs: vec![run; height as usize],
            rows: (0..=height).collect(),
            order: (0..height as u16).collect(),
            texels: u64::from(width) * u64::from(height),
            inner: Inner { width, height, row: 0, column: 0 },
        }
    }

    /// About how many texels lie beside it: two at each run, and above and below it two for each of its own that the next row does not have.
    pub fn rim(&self) -> u64 {
        2 * self.runs.len() as u64 + 2 * u64::from(self.width)
    }

    /// Whether it has every texel of its rectangle.
    pub fn is_full(&self) -> bool {
        self.texels == u64::from(self.width) * u64::from(self.height)
    }

    /// The runs of a row.
    pub fn row(&self, y: u32) -> &[Run] {
        &self.runs[self.rows[y as usize] as usize..self.rows[y as usize + 1] as usize]
    }

    fn rows_apart(&self) -> Vec<u16> {
        let longest = |y: &u32| self.row(*y).iter().map(|run| run.length).max();
        let hardest = (0..self.height).rev().max_by_key(longest).unwrap_or(0);
        let others = apart(self.height).filter(|y| *y != hardest);
        std::iter::once(hardest).chain(others).map(|y| y as u16).collect()
    }

    /// The rectangle with the most texels: below each row's texels stand columns of those above, and the largest rectangle that ends in the row ends at a
    /// column that is lower than its neighbours.
    fn largest_rectangle(&self) -> Inner {
        let width = self.width as usize;
        let mut columns = vec![0_u32; width + 1];
        let mut largest = Inner::default();
        let mut open: Vec<(usize, u32)> = Vec::new();
        for y in 0..self.height {
            let mut x = 0;
            for run in self.row(y) {
                let begin = usize::from(run.begin);
                columns[x..begin].fill(0);
                x = begin + usize::from(run.length);
                columns[begin..x].iter_mut().for_each(|column| *column += 1);
            }
            columns[x..].fill(0);
            for (x, &height) in columns.iter().enumerate() {
                let mut begin = x;
                while let Some((from, above)) = open.pop_if(|(_, above)| *above >= height) {
                    begin = from;
                    let of = (x - from) as u32;
                    if above * of > largest.width * largest.height {
                        largest = Inner { width: of, height: above, row: y + 1 - above, column: from as u32 };
                    }
                }
                if height > 0 {
                    open.push((begin, height));
                }
            }
        }
        largest
    }

    fn push_row(&mut self, row: &[u64]) {
        let mut x = 0;
        while let Some(begin) = next(row, x, true) {
            let end = next(row, begin, false).unwrap_or(row.len() * 64);
            self.runs.push(Run { begin: begin as u16, length: (end - begin) as u16 });
            x = end;
        }
        self.rows.push(self.runs.len() as u32);
    }
}

/// All numbers below `count`, each far from those before it.
#[inline(always)]
pub(super) fn apart(count: u32) -> impl Iterator<Item = u32> {
    let bits = count.next_power_of_two().ilog2();
    (0..1_u32 << bits).map(move |i| if bits == 0 { 0 } else { i.reverse_bits() >> (32 - bits) }).filter(move |i| *i < count)
}

/// The first bit from `x` on that is set, or not.
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
pub(super) fn set(row: &mut [u64], begin: usize, end: usize) {
    let below = |bit: usize| if bit == 64 { u64::MAX } else { (1 << bit) - 1 };
    let words = begin / 64..end.div_ceil(64);
    for (bits, first) in row[words.clone()].iter_mut().zip(words.map(|word| word * 64)) {
        *bits |= below((end - first).min(64)) & !below(begin.saturating_sub(first).min(64));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rectangle(size: Vec2) -> [[Vec2; 3]; 2] {
        let at = |x: f32, y: f32| Vec2::splat(INSET) + Vec2::new(x * size.x, y * size.y);
        [[at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0)], [at(0.0, 0.0), at(1.0, 1.0), at(0.0, 1.0)]]
    }

    /// Every texel that filtering asks for anywhere in the triangle, by trying many places.
    fn asked(triangles: &[[Vec2; 3]], mask: &Mask) -> Vec<Vec<bool>> {
        let mut asked = vec![vec![false; mask.width as usize]; mask.height as usize];
        for [a, b, c] in triangles {
            for i in 0..=200 {
                for j in 0..=200 - i {
                    let p = *a + (b - a) * (i as f32 / 200.0) + (c - a) * (j as f32 / 200.0);
                    let from = (p - 0.5).floor();
                    let share = p - 0.5 - from;
                    for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                        let weight =
                            (if dx == 1 { share.x } else { 1.0 - share.x }) * (if dy == 1 { share.y } else { 1.0 - share.y });
                        if weight > 1e-4 {
                            asked[from.y as usize + dy][from.x as usize + dx] = true;
                        }
                    }
                }
            }
        }
        asked
    }

    fn bits(mask: &Mask) -> Vec<Vec<bool>> {
        let mut rows = vec![vec![false; mask.width as usize]; mask.height as usize];
        for y in 0..mask.height {
            for run in mask.row(y) {
                rows[y as usize][usize::from(run.begin)..][..usize::from(run.length)].fill(true);
            }
        }
        rows
    }

    #[test]
    fn a_rectangle_takes_one_texel_more_a_side() {
        let mask = Mask::new(&rectangle(Vec2::new(7.0, 3.0)), 100).unwrap();
        assert_eq!((mask.width, mask.height, mask.texels), (8, 4, 32));
        assert_eq!(mask.inner, Inner { width: 8, height: 4, row: 0, column: 0 });
        let point = Mask::new(&[[Vec2::splat(INSET); 3]], 100).unwrap();
        assert_eq!((point.width, point.height, point.texels), (1, 1, 1));
        assert!(Mask::new(&rectangle(Vec2::new(7.0, 300.0)), 100).is_none());
        let long = Mask::new(&rectangle(Vec2::new(300.0, 1.0)), 1000).unwrap();
        assert_eq!(long.row(1), [Run { begin: 0, length: 301 }]);
    }

    #[test]
    fn the_largest_rectangle_is_found() {
        let at = |x: f32, y: f32| Vec2::splat(INSET) + Vec2::new(x, y);
        let quad = |x: f32, y: f32, w: f32, h: f32| {
            [[at(x, y), at(x + w, y), at(x + w, y + h)], [at(x, y), at(x + w, y + h), at(x, y + h)]]
        };
        // a T: its bar has 21 by 3 texels, its foot 5 by 20
        let shape = [quad(0.0, 0.0, 20.0, 2.0), quad(7.0, 0.0, 4.0, 19.0)].concat();
        let mask = Mask::new(&shape, 100).unwrap();
        assert_eq!(mask.inner, Inner { width: 5, height: 20, row: 0, column: 7 });
        let upside_down: Vec<_> = shape.iter().map(|t| t.map(|p| Vec2::new(p.x, 20.0 - p.y))).collect();
        assert_eq!(Mask::new(&upside_down, 100).unwrap().inner, Inner { width: 5, height: 20, row: 0, column: 7 });
        let wide = [quad(0.0, 0.0, 40.0, 2.0), quad(7.0, 0.0, 4.0, 19.0)].concat();
        assert_eq!(Mask::new(&wide, 100).unwrap().inner, Inner { width: 41, height: 3, row: 0, column: 0 });
    }

    #[test]
    fn all_that_filtering_asks_for_is_there_and_little_more() {
        let mut random = 12345_u32;
        let mut next = || {
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (random >> 8) as f32 / (1 << 24) as f32
        };
        for _ in 0..30 {
            let mut triangle = [(); 3].map(|()| Vec2::new(next(), next()) * 20.0);
            let low = triangle[0].min(triangle[1]).min(triangle[2]);
            triangle.iter_mut().for_each(|p| *p += INSET - low);
            let mask = Mask::new(&[triangle], 100).unwrap();
            let (asked, bits) = (asked(&[triangle], &mask), bits(&mask));
            let mut more = 0;
            for (asked, bits) in asked.iter().flatten().zip(bits.iter().flatten()) {
                assert!(*bits || !*asked);
                more += u32::from(*bits && !*asked);
            }
            assert!(more * 8 <= mask.texels as u32 + 16, "{more} of {}", mask.texels);
        }
    }
}
