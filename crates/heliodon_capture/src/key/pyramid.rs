//! What is known in places, spread smoothly over the rest: push-pull (Gortler et al., "The Lumigraph", SIGGRAPH 1996, section 3.4).

use super::space::{Rgb, lerp};
use rayon::prelude::*;

/// A grid of colours.
#[derive(Clone, Debug, Default)]
pub(super) struct Grid {
    pub columns: usize,
    pub rows: usize,
    pub colors: Vec<Rgb>,
}

impl Grid {
    /// The colour at a place in cells, cell centres at `k + 0.5`, between the four nearest.
    #[inline]
    pub fn at(&self, x: f32, y: f32) -> Rgb {
        let (x, y) = (x - 0.5, y - 0.5);
        let tap = |v: f32, count: usize| {
            let low = v.floor();
            let first = (low.max(0.0) as usize).min(count - 1);
            let second = ((low + 1.0).max(0.0) as usize).min(count - 1);
            (first, second, v - low)
        };
        let ((x0, x1, fx), (y0, y1, fy)) = (tap(x, self.columns), tap(y, self.rows));
        let (top, bottom) = (&self.colors[y0 * self.columns..], &self.colors[y1 * self.columns..]);
        lerp(lerp(top[x0], top[x1], fx), lerp(bottom[x0], bottom[x1], fx), fy)
    }
}

/// A level: colours and how sure each is, in [0, 1].
struct Level {
    columns: usize,
    rows: usize,
    cells: Vec<(Rgb, f32)>,
}

impl Level {
    fn coarser(&self) -> Self {
        let (columns, rows) = (self.columns.div_ceil(2), self.rows.div_ceil(2));
        let mut cells = vec![([0.0; 3], 0.0); columns * rows];
        cells.par_chunks_mut(columns).enumerate().for_each(|(y, row)| {
            for (x, cell) in row.iter_mut().enumerate() {
                let (mut sum, mut weight) = ([0.0; 3], 0.0);
                for fine_y in 2 * y..(2 * y + 2).min(self.rows) {
                    for fine_x in 2 * x..(2 * x + 2).min(self.columns) {
                        let (color, sure) = self.cells[fine_y * self.columns + fine_x];
                        (0..3).for_each(|c| sum[c] += color[c] * sure);
                        weight += sure;
                    }
                }
                if weight > 0.0 {
                    // one sure cell of four makes its place sure: what is near goes before what is far
                    *cell = (sum.map(|x| x / weight), weight.min(1.0));
                }
            }
        });
        Self { columns, rows, cells }
    }
}

/// Fills what is not sure from what is near; `None` where nothing is sure at all.
pub(super) fn fill(columns: usize, rows: usize, cells: Vec<(Rgb, f32)>) -> Option<Grid> {
    if !cells.iter().any(|cell| cell.1 > 0.0) {
        return None;
    }
    let mut levels = vec![Level { columns, rows, cells }];
    while let Some(last) = levels.last().filter(|level| level.cells.len() > 1) {
        let coarser = last.coarser();
        levels.push(coarser);
    }
    let coarsest = levels.pop()?;
    let mut filled = Grid {
        columns: coarsest.columns,
        rows: coarsest.rows,
        colors: coarsest.cells.into_iter().map(|cell| cell.0).collect(),
    };
    while let Some(level) = levels.pop() {
        let mut colors = vec![[0.0; 3]; level.cells.len()];
        colors.par_chunks_mut(level.columns).zip(level.cells.par_chunks(level.columns)).enumerate().for_each(
            |(y, (out, cells))| {
                for (x, (out, &(color, sure))) in out.iter_mut().zip(cells).enumerate() {
                    *out = if sure >= 1.0 {
                        color
                    } else {
                        lerp(filled.at((x as f32 + 0.5) * 0.5, (y as f32 + 0.5) * 0.5), color, sure)
                    };
                }
            },
        );
        filled = Grid { columns: level.columns, rows: level.rows, colors };
    }
    Some(filled)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_sure_stays_and_holes_take_what_is_around() {
        let (columns, rows) = (37, 21);
        let cells = (0..columns * rows)
            .map(|k| {
                let (x, y) = (k % columns, k / columns);
                let hole = (10..20).contains(&x) && (5..15).contains(&y);
                if hole { ([9.0; 3], 0.0) } else { ([x as f32, 1.0, y as f32], 1.0) }
            })
            .collect();
        let grid = fill(columns, rows, cells).unwrap();
        assert_eq!(grid.colors[3], [3.0, 1.0, 0.0]);
        for y in 5..15 {
            for x in 10..20 {
                let [a, b, c] = grid.colors[y * columns + x];
                assert!((5.0..25.0).contains(&a) && (b - 1.0).abs() < 1e-5 && (1.0..19.0).contains(&c), "{a} {b} {c}");
            }
        }
        assert!(fill(4, 4, vec![([1.0; 3], 0.0); 16]).is_none());
        assert_eq!(fill(1, 1, vec![([1.0; 3], 0.5)]).unwrap().colors, [[1.0; 3]]);
    }
}
