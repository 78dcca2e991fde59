//! Coarser levels of an atlas: each texel from those of its own chart alone.

use heliodon_lightmap::texels::Texel;
use std::cmp::Ordering;

/// Nobody's texel.
const NOBODY: u32 = u32::MAX;

/// The texels of a level of an atlas: which chart each belongs to.
pub struct Owners {
    size: [usize; 2],
    chart: Vec<u32>,
}

impl Owners {
    /// Of a level of this side, whose texels filtering may ask for.
    #[must_use]
    pub fn new(side: u32, texels: &[Texel], chart_of_triangle: &[u32]) -> Self {
        let cell = |texel: &Texel| usize::from(texel.y) * side as usize + usize::from(texel.x);
        let charts = texels.iter().map(|texel| (cell(texel), chart_of_triangle[texel.triangle as usize]));
        Self::of([side; 2], charts)
    }

    /// Of a level of so many texels along both sides: cells, counted row by row, each with its chart.
    #[must_use]
    pub fn of(size: [u32; 2], charts: impl Iterator<Item = (usize, u32)>) -> Self {
        let size = size.map(|side| side as usize);
        let mut chart = vec![NOBODY; size[0] * size[1]];
        charts.for_each(|(cell, of)| chart[cell] = of);
        Self { size, chart }
    }

    /// Texels beside a chart that a filter of nine asks for too, each with one of the chart's beside it: in the chart's own squares, as `coarsest` has them, which is
    /// so many levels above.
    #[must_use]
    pub fn rim(&self, coarsest: &Self, levels: u32) -> Vec<(usize, usize)> {
        let [width, _] = self.size;
        let square = |texel: usize| ((texel / width) >> levels) * coarsest.size[0] + ((texel % width) >> levels);
        let beside = |texel: usize| {
            let chart = coarsest.chart[square(texel)];
            (chart != NOBODY).then_some(())?;
            self.near(texel).find(|&other| self.chart[other] == chart)
        };
        let nobodys = (0..self.chart.len()).filter(|&texel| self.chart[texel] == NOBODY);
        nobodys.filter_map(|texel| Some((texel, beside(texel)?))).collect()
    }

    /// The texels of the level below that are those of a texel of this one, and of its chart.
    fn within<'a>(&'a self, finer: &'a Self, texel: usize) -> impl Iterator<Item = usize> + 'a {
        let [width, _] = self.size;
        let (x, y) = (2 * (texel % width), 2 * (texel / width));
        let four = [[0, 0], [1, 0], [0, 1], [1, 1]].map(|[dx, dy]| (y + dy) * finer.size[0] + x + dx);
        four.into_iter().filter(move |&child| finer.chart[child] == self.chart[texel])
    }

    /// The texels around one that are of its chart.
    fn around(&self, texel: usize) -> impl Iterator<Item = usize> + '_ {
        self.near(texel).filter(move |&other| self.chart[other] == self.chart[texel])
    }

    /// The up to eight texels around one.
    fn near(&self, texel: usize) -> impl Iterator<Item = usize> + '_ {
        let [width, height] = self.size;
        let (x, y) = (texel % width, texel / width);
        let rows = y.saturating_sub(1)..(y + 2).min(height);
        let columns = x.saturating_sub(1)..(x + 2).min(width);
        let all = rows.flat_map(move |y| columns.clone().map(move |x| y * width + x));
        all.filter(move |&other| other != texel)
    }
}

/// How far a chart is followed beyond the texels that finer levels have of it: filtering asks for one and a half of the coarsest.
const ROUNDS: usize = 3;

/// The level above `finer`, `width` values a texel: `mix` makes one texel's values of some others'.
#[must_use]
pub fn coarser<T: Copy + Default>(
    own: &Owners,
    (below, finer): (&Owners, &[T]),
    width: usize,
    mix: impl Fn(&[&[T]]) -> Vec<T>,
) -> Vec<T> {
    let mut values = vec![T::default(); own.chart.len() * width];
    let mut is_known = vec![false; own.chart.len()];
    let mine = || (0..own.chart.len()).filter(|&texel| own.chart[texel] != NOBODY);
    for texel in mine() {
        let children: Vec<&[T]> = own.within(below, texel).map(|child| &finer[child * width..(child + 1) * width]).collect();
        if !children.is_empty() {
            values[texel * width..(texel + 1) * width].copy_from_slice(&mix(&children));
            is_known[texel] = true;
        }
    }
    for _ in 0..ROUNDS {
        let unknown: Vec<usize> = mine().filter(|&texel| !is_known[texel]).collect();
        let of = |&texel: &usize| {
            let beside = own.around(texel).filter(|&other| is_known[other]);
            let beside: Vec<&[T]> = beside.map(|other| &values[other * width..(other + 1) * width]).collect();
            (!beside.is_empty()).then(|| (texel, mix(&beside)))
        };
        let found: Vec<(usize, Vec<T>)> = unknown.iter().filter_map(of).collect();
        for (texel, mixed) in found {
            values[texel * width..(texel + 1) * width].copy_from_slice(&mixed);
            is_known[texel] = true;
        }
    }
    values
}

/// The mean of some texels' numbers.
#[must_use]
pub fn mean(texels: &[&[f32]]) -> Vec<f32> {
    let of = |i: usize| texels.iter().map(|texel| texel[i]).sum::<f32>() / texels.len() as f32;
    (0..texels.first().map_or(0, |texel| texel.len())).map(of).collect()
}

/// The bits that most of some texels' masks have; where as many have one as have it not, the first tells: a level has as much sun as the one below in the
/// mean. If half were enough, what is seen from far would be brighter.
#[must_use]
pub fn most(texels: &[&[u32]]) -> Vec<u32> {
    let word = |i: usize| {
        (0..32).fold(0, |word, bit| {
            let set = texels.iter().filter(|texel| texel[i] >> bit & 1 == 1).count();
            let has = match (2 * set).cmp(&texels.len()) {
                Ordering::Less => 0,
                Ordering::Equal => texels[0][i] >> bit & 1,
                Ordering::Greater => 1,
            };
            word | has << bit
        })
    };
    (0..texels.first().map_or(0, |texel| texel.len())).map(word).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    fn texel(x: u16, y: u16, triangle: u32) -> Texel {
        Texel { x, y, sheet: 0, is_covered: true, triangle, weights: Vec3::X }
    }

    #[test]
    fn halves_are_neither_all_lit_nor_all_dark() {
        let of = |bits: &[u32]| most(&bits.iter().map(std::slice::from_ref).collect::<Vec<_>>());
        assert_eq!([of(&[1, 0, 0, 0]), of(&[0, 1, 1, 1]), of(&[0]), of(&[1])], [[0], [1], [0], [1]]);
        // of all masks of four texels as many are lit above as below
        let lit = (0..16_u32).map(|mask| of(&[mask & 1, mask >> 1 & 1, mask >> 2 & 1, mask >> 3])[0]).sum::<u32>();
        assert_eq!(lit, 8);
        assert_eq!(of(&[]), [0_u32; 0]);
    }

    #[test]
    fn no_chart_takes_from_another() {
        // two charts, side by side, the second with a column of texels only
        let fine: Vec<Texel> = (0..8_u16).flat_map(|y| (0..4).map(move |x| texel(x, y, 0)).chain([texel(4, y, 1)])).collect();
        let coarse: Vec<Texel> =
            (0..4_u16).flat_map(|y| [texel(0, y, 0), texel(1, y, 0), texel(2, y, 1), texel(3, y, 1)]).collect();
        let (fine, coarse) = (Owners::new(8, &fine, &[5, 9]), Owners::new(4, &coarse, &[5, 9]));
        let values: Vec<f32> = (0..64)
            .map(|i| {
                if i % 8 < 4 {
                    1.0
                } else if i % 8 == 4 {
                    7.0
                } else {
                    1e9
                }
            })
            .collect();
        let above = coarser(&coarse, (&fine, &values), 1, mean);
        for y in 0..4 {
            assert_eq!(above[4 * y..4 * y + 4], [1.0, 1.0, 7.0, 7.0]);
        }
        // beside the first chart lies the second, beside that one free texel of its own square
        let rim = fine.rim(&coarse, 1);
        assert!(rim.len() == 8 && rim.iter().all(|&(texel, of)| texel % 8 == 5 && of % 8 == 4), "{rim:?}");
        let bits: Vec<u32> = (0..64).map(|i| [0b111, 0b011, 0b001, 0b000, 0b10, 0, 0, 0][i % 8]).collect();
        let above = coarser(&coarse, (&fine, &bits), 1, most);
        assert_eq!(above[..4], [0b111, 0b001, 0b10, 0b10]);
    }
}
