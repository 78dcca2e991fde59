//! The texels that a chart needs: every one that filtering takes into account anywhere on it.

use super::bitmap::{Bitmap, runs};
use super::inner::Inner;

/// A run of texels in a row.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Run {
    pub begin: u16,
    pub length: u16,
}

impl Run {
    pub fn end(self) -> u32 {
        u32::from(self.begin) + u32::from(self.length)
    }
}

/// The texels of a chart at one scale, row by row.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Mask {
    pub width: u32,
    pub height: u32,
    /// Those of all rows; none where all texels are its.
    runs: Vec<Run>,
    /// Where each row's runs begin, and where the last one's end.
    rows: Vec<u32>,
    /// All of a row.
    whole: Run,
    /// Its largest rectangle, or one nearly as large.
    pub inner: Inner,
    /// Rows that have more than that, so that what does not fit is found out early: the one with the longest run first, then each as far as can be from
    /// those before.
    pub order: Vec<u16>,
    /// What those have in common that are alike, and others hardly ever.
    pub hash: u64,
}

impl Mask {
    pub fn new(bitmap: &Bitmap) -> Self {
        let Bitmap { width, height, .. } = *bitmap;
        if bitmap.count() == u64::from(width) * u64::from(height) {
            return Self::full(width, height);
        }
        let mut mask = Self { width, height, rows: Vec::with_capacity(height as usize + 1), ..Self::default() };
        mask.rows.push(0);
        for row in bitmap.rows() {
            mask.runs.extend(runs(row).map(|(begin, end)| Run { begin: begin as u16, length: (end - begin) as u16 }));
            mask.rows.push(mask.runs.len() as u32);
        }
        mask
    }

    /// A rectangle with all its texels.
    #[inline(always)]
    pub fn full(width: u32, height: u32) -> Self {
        let inner = Inner { width, height, row: 0, column: 0 };
        Self { width, height, whole: Run { begin: 0, length: width as u16 }, inner, ..Self::default() }
    }

    /// The same turned by two quarters, but for what is reckoned of it.
    pub fn upside_down(&self) -> Self {
        if self.is_full() {
            return self.clone();
        }
        let mut turned =
            Self { width: self.width, height: self.height, rows: Vec::with_capacity(self.rows.len()), ..Self::default() };
        let mirrored = |run: &Run| Run { begin: (self.width - run.end()) as u16, length: run.length };
        turned.runs.extend(self.runs.iter().rev().map(mirrored));
        let all = self.runs.len() as u32;
        turned.rows.extend(self.rows.iter().rev().map(|begin| all - begin));
        turned
    }

    /// With what is reckoned of it: `inner` is a rectangle within it.
    pub fn with_inner(mut self, inner: Inner) -> Self {
        if !self.is_full() {
            self.inner = inner;
            self.order = self.rows_apart();
            self.hash = self.hashed();
        }
        self
    }

    /// Whether both have the same texels.
    pub fn is_alike(&self, other: &Self) -> bool {
        (self.hash, self.width, self.height) == (other.hash, other.width, other.height)
            && self.rows == other.rows
            && self.runs == other.runs
    }

    /// Whether it has every texel of its rectangle.
    pub fn is_full(&self) -> bool {
        self.rows.is_empty()
    }

    /// The runs of a row.
    pub fn row(&self, y: u32) -> &[Run] {
        if self.is_full() {
            return std::slice::from_ref(&self.whole);
        }
        &self.runs[self.rows[y as usize] as usize..self.rows[y as usize + 1] as usize]
    }

    fn rows_apart(&self) -> Vec<u16> {
        let Inner { width, height, row, column } = self.inner;
        let is_inner = |y: u32| {
            (row..row + height).contains(&y)
                && matches!(self.row(y), [run] if u32::from(run.begin) == column && u32::from(run.length) == width)
        };
        let longest = |y: &u32| self.row(*y).iter().map(|run| run.length).max();
        let hardest = (0..self.height).rev().filter(|y| !is_inner(*y)).max_by_key(longest);
        let others = Apart::new(self.height).filter(|y| Some(*y) != hardest && !is_inner(*y));
        hardest.into_iter().chain(others).map(|y| y as u16).collect()
    }

    /// Fowler, Noll and Vo's, of the runs.
    fn hashed(&self) -> u64 {
        let add = |hash: u64, value: u64| (hash ^ value).wrapping_mul(0x0100_0000_01B3);
        let rows = self.rows.iter().fold(0xCBF2_9CE4_8422_2325, |hash, begin| add(hash, u64::from(*begin)));
        self.runs.iter().fold(rows, |hash, run| add(hash, u64::from(run.begin) << 16 | u64::from(run.length)))
    }
}

/// All numbers below a count, each far from those before it.
pub(super) struct Apart {
    count: u32,
    bits: u32,
    next: u32,
}

impl Apart {
    #[inline(always)]
    pub fn new(count: u32) -> Self {
        Self { count, bits: count.next_power_of_two().ilog2(), next: 0 }
    }
}

impl Iterator for Apart {
    type Item = u32;

    #[inline(always)]
    fn next(&mut self) -> Option<u32> {
        while self.next < 1 << self.bits {
            // twice, for a shift by 32 is none
            let number = self.next.reverse_bits() >> 1 >> (31 - self.bits);
            self.next += 1;
            if number < self.count {
                return Some(number);
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::super::bitmap::INSET;
    use super::*;
    use glam::Vec2;

    fn made(triangles: &[[Vec2; 3]], most: u32) -> Option<Mask> {
        let bitmap = Bitmap::new(triangles, most)?;
        let mask = Mask::new(&bitmap);
        let inner = Inner::of(&bitmap, &mask);
        Some(mask.with_inner(inner))
    }

    fn texels(mask: &Mask) -> u32 {
        (0..mask.height).flat_map(|y| mask.row(y)).map(|run| u32::from(run.length)).sum()
    }

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
        let mask = made(&rectangle(Vec2::new(7.0, 3.0)), 100).unwrap();
        assert_eq!((mask.width, mask.height, texels(&mask)), (8, 4, 32));
        assert_eq!(mask.inner, Inner { width: 8, height: 4, row: 0, column: 0 });
        let point = made(&[[Vec2::splat(INSET); 3]], 100).unwrap();
        assert_eq!((point.width, point.height, texels(&point)), (1, 1, 1));
        assert!(made(&rectangle(Vec2::new(7.0, 300.0)), 100).is_none());
        let long = made(&rectangle(Vec2::new(300.0, 1.0)), 1000).unwrap();
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
        let mask = made(&shape, 100).unwrap();
        assert_eq!(mask.inner, Inner { width: 5, height: 20, row: 0, column: 7 });
        let upside_down: Vec<_> = shape.iter().map(|t| t.map(|p| Vec2::new(p.x, 20.0 - p.y))).collect();
        assert_eq!(made(&upside_down, 100).unwrap().inner, Inner { width: 5, height: 20, row: 0, column: 7 });
        let wide = [quad(0.0, 0.0, 40.0, 2.0), quad(7.0, 0.0, 4.0, 19.0)].concat();
        assert_eq!(made(&wide, 100).unwrap().inner, Inner { width: 41, height: 3, row: 0, column: 0 });
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
            let mask = made(&[triangle], 100).unwrap();
            let (asked, bits) = (asked(&[triangle], &mask), bits(&mask));
            let mut more = 0;
            for (asked, bits) in asked.iter().flatten().zip(bits.iter().flatten()) {
                assert!(*bits || !*asked);
                more += u32::from(*bits && !*asked);
            }
            assert!(more * 8 <= texels(&mask) + 16, "{more} of {}", texels(&mask));
        }
    }
}
