//! Values for texels that lie inside of something, from those of their chart beside them.

use super::grid::{ChartGrid, Grid, NOBODY};
use rayon::prelude::*;

/// Gives texels that are not valid the values of the nearest valid ones of their chart, so many rings far; what its rectangle has no texels for is crossed as if
/// it had. A chart without any valid texel keeps what it has.
pub(super) fn borrow(grid: &Grid, values: &mut [f32], count: usize, valid: &[bool], rings: u32) {
    let lent: Vec<(u32, Vec<f32>)> =
        grid.charts.par_iter().flat_map_iter(|chart| of_chart(grid, chart, values, count, valid, rings)).collect();
    for (texel, lent) in lent {
        values[texel as usize * count..][..count].copy_from_slice(&lent);
    }
}

fn of_chart(grid: &Grid, chart: &ChartGrid, values: &[f32], count: usize, valid: &[bool], rings: u32) -> Vec<(u32, Vec<f32>)> {
    let (width, height) = (chart.width as usize, chart.height as usize);
    let cells = &grid.cells[chart.cells..][..width * height];
    let mut wanting = cells.iter().filter(|&&texel| texel != NOBODY && !valid[texel as usize]).count();
    let mut known: Vec<Option<Vec<f32>>> = Vec::new();
    if wanting > 0 {
        let value = |&texel: &u32| {
            (texel != NOBODY && valid[texel as usize]).then(|| values[texel as usize * count..][..count].to_vec())
        };
        known = cells.iter().map(value).collect();
    }
    let mut rim: Vec<usize> = (0..known.len()).filter(|&cell| known[cell].is_some()).collect();
    let mut lent = Vec::new();
    for _ in 0..rings {
        if wanting == 0 || rim.is_empty() {
            break;
        }
        let mut next: Vec<usize> =
            rim.iter().flat_map(|&cell| around(cell, width, height)).filter(|&c| known[c].is_none()).collect();
        next.sort_unstable();
        next.dedup();
        // all of a ring from the ring before it
        let mean = |&cell: &usize| {
            let mut sum = vec![0.0; count];
            let of = around(cell, width, height).filter_map(|beside| known[beside].as_ref());
            let many = of.map(|values| sum.iter_mut().zip(values).for_each(|(sum, value)| *sum += value)).count();
            sum.iter_mut().for_each(|sum| *sum /= many as f32);
            sum
        };
        let means: Vec<Vec<f32>> = next.iter().map(mean).collect();
        for (&cell, mean) in next.iter().zip(means) {
            if cells[cell] != NOBODY {
                wanting -= 1;
                lent.push((cells[cell], mean.clone()));
            }
            known[cell] = Some(mean);
        }
        rim = next;
    }
    lent
}

impl Grid {
    /// Which texels take what others have where those that are not `valid` borrow from so many rings.
    pub(crate) fn borrowers(&self, valid: &[bool], rings: u32) -> Vec<bool> {
        let mut marks: Vec<f32> = valid.iter().map(|valid| f32::from(u8::from(*valid))).collect();
        borrow(self, &mut marks, 1, valid, rings);
        marks.iter().zip(valid).map(|(mark, valid)| !valid && *mark > 0.0).collect()
    }

    /// For each texel the nearest one of its chart that is valid, over the fewest steps of its grid; itself where it is, or where no texel of its chart is.
    ///
    /// # Panics
    /// When there are not as many flags as texels.
    #[must_use]
    pub fn nearest_valid(&self, valid: &[bool]) -> Vec<u32> {
        assert_eq!(valid.len(), self.len(), "a flag for each texel");
        let mut nearest: Vec<u32> = (0..self.len() as u32).collect();
        let found = self.charts.par_iter().flat_map_iter(|chart| nearest_of_chart(self, chart, valid));
        for (texel, source) in found.collect::<Vec<_>>() {
            nearest[texel as usize] = source;
        }
        nearest
    }
}

/// The texels of a chart that are not valid, each with the nearest that is.
fn nearest_of_chart(grid: &Grid, chart: &ChartGrid, valid: &[bool]) -> Vec<(u32, u32)> {
    let (width, height) = (chart.width as usize, chart.height as usize);
    let cells = &grid.cells[chart.cells..][..width * height];
    let is_valid = |&texel: &u32| texel != NOBODY && valid[texel as usize];
    let mut source: Vec<u32> = cells.iter().map(|texel| if is_valid(texel) { *texel } else { NOBODY }).collect();
    if cells.iter().all(|texel| *texel == NOBODY || is_valid(texel)) {
        return Vec::new();
    }
    let mut rim: Vec<usize> = (0..cells.len()).filter(|&cell| source[cell] != NOBODY).collect();
    let mut lent = Vec::new();
    while !rim.is_empty() {
        let mut next = Vec::new();
        for &cell in &rim {
            for beside in around(cell, width, height) {
                if source[beside] == NOBODY {
                    source[beside] = source[cell];
                    next.push(beside);
                    if cells[beside] != NOBODY {
                        lent.push((cells[beside], source[cell]));
                    }
                }
            }
        }
        rim = next;
    }
    lent
}

/// The up to eight cells around one.
fn around(cell: usize, width: usize, height: usize) -> impl Iterator<Item = usize> {
    let (x, y) = (cell % width, cell / width);
    let rows = y.saturating_sub(1)..(y + 2).min(height);
    let columns = x.saturating_sub(1)..(x + 2).min(width);
    rows.flat_map(move |y| columns.clone().map(move |x| y * width + x)).filter(move |&other| other != cell)
}
