//! Large rectangles of a plane: in a grid of cells, in an outline, in a union of other rectangles.

use std::ops::Range;

/// A rectangle along the axes of a plane, from its lower to its upper corner.
pub type Rectangle = [[f64; 2]; 2];

/// Its area.
#[must_use]
pub fn area([low, high]: &Rectangle) -> f64 {
    (high[0] - low[0]).max(0.0) * (high[1] - low[1]).max(0.0)
}

/// Cells between lines of the plane, row by row, some of them free.
#[derive(Clone, Debug)]
pub struct Cells {
    /// Ascending lines along each axis, at least two.
    pub lines: [Vec<f64>; 2],
    /// Whether each cell may be covered.
    pub free: Vec<bool>,
}

impl Cells {
    /// Rectangles of free cells, the one that covers most of what those before it do not first, until `most` or until what they would add is less
    /// than `least_area`. They may overlap.
    ///
    /// Each row sees the free cells above it as a histogram, whose maximal rectangles a stack finds in one pass (the classic method for the largest
    /// rectangle of a binary image).
    #[must_use]
    pub fn largest(&self, most: usize, least_area: f64) -> Vec<Rectangle> {
        let columns = self.lines[0].len() - 1;
        let mut used = vec![false; self.free.len()];
        let mut found = Vec::new();
        while found.len() < most {
            let unused = self.sums(&used);
            let mut best: Option<(f64, [Range<usize>; 2])> = None;
            self.maximal(|rows, across| {
                let at = |row: usize, column: usize| unused[row * (columns + 1) + column];
                let adds = at(rows.end, across.end) + at(rows.start, across.start)
                    - at(rows.start, across.end)
                    - at(rows.end, across.start);
                if adds >= least_area && best.as_ref().is_none_or(|(most, _)| adds > *most) {
                    best = Some((adds, [across, rows]));
                }
            });
            let Some((_, [across, rows])) = best else { break };
            for row in rows.clone() {
                used[row * columns..][across.clone()].fill(true);
            }
            let [u, v] = &self.lines;
            found.push([[u[across.start], v[rows.start]], [u[across.end], v[rows.end]]]);
        }
        found
    }

    /// Areas of the free cells that are not `used`, summed from the first corner to each.
    fn sums(&self, used: &[bool]) -> Vec<f64> {
        let [u, v] = &self.lines;
        let (columns, rows) = (u.len() - 1, v.len() - 1);
        let mut sums = vec![0.0; (columns + 1) * (rows + 1)];
        for row in 0..rows {
            let mut of_row = 0.0;
            for column in 0..columns {
                let cell = row * columns + column;
                if self.free[cell] && !used[cell] {
                    of_row += (u[column + 1] - u[column]) * (v[row + 1] - v[row]);
                }
                sums[(row + 1) * (columns + 1) + column + 1] = sums[row * (columns + 1) + column + 1] + of_row;
            }
        }
        sums
    }

    /// Tells rows and columns of rectangles of free cells that cannot grow sideways or towards the first row.
    fn maximal(&self, mut tell: impl FnMut(Range<usize>, Range<usize>)) {
        let [columns, rows] = self.lines.each_ref().map(|lines| lines.len() - 1);
        let mut heights = vec![0usize; columns + 1];
        let mut stack: Vec<(usize, usize)> = Vec::new();
        for row in 0..rows {
            for (height, free) in heights.iter_mut().zip(&self.free[row * columns..][..columns]) {
                *height = if *free { *height + 1 } else { 0 };
            }
            // The last height stays 0 and empties the stack.
            for (column, &here) in heights.iter().enumerate() {
                let mut begin = column;
                while let Some(&(first, height)) = stack.last().filter(|(_, height)| *height > here) {
                    stack.pop();
                    tell(row + 1 - height..row + 1, first..column);
                    begin = first;
                }
                if here > 0 && stack.last().is_none_or(|&(_, height)| height < here) {
                    stack.push((begin, here));
                }
            }
        }
    }
}

/// The rectangles in the union of others that cover most, at most `most`, each of which adds at least `least_area`.
#[must_use]
pub fn in_union(parts: &[Rectangle], most: usize, least_area: f64) -> Vec<Rectangle> {
    let lines = [0, 1].map(|axis| {
        let mut lines: Vec<f64> = parts.iter().flat_map(|[low, high]| [low[axis], high[axis]]).collect();
        lines.sort_by(f64::total_cmp);
        lines.dedup();
        lines
    });
    if lines.iter().any(|lines| lines.len() < 2) {
        return Vec::new();
    }
    let [columns, rows] = lines.each_ref().map(|lines| lines.len() - 1);
    // How many parts begin less how many end, summed along both axes, is how many cover a cell.
    let mut counts = vec![0i32; (columns + 1) * (rows + 1)];
    for part in parts {
        let place = |corner: usize, axis: usize| lines[axis].partition_point(|&line| line < part[corner][axis]);
        for (corner_u, corner_v, sign) in [(0, 0, 1), (1, 0, -1), (0, 1, -1), (1, 1, 1)] {
            counts[place(corner_v, 1) * (columns + 1) + place(corner_u, 0)] += sign;
        }
    }
    let mut free = vec![false; columns * rows];
    for row in 0..rows {
        let mut of_row = 0;
        for column in 0..columns {
            let cell = row * (columns + 1) + column;
            of_row += counts[cell];
            counts[cell] = of_row + if row > 0 { counts[cell - columns - 1] } else { 0 };
            free[row * columns + column] = counts[cell] > 0;
        }
    }
    Cells { lines, free }.largest(most, least_area)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cells(picture: &[&str]) -> Cells {
        let free = picture.iter().flat_map(|row| row.bytes().map(|cell| cell == b'#')).collect();
        let lines = [picture[0].len(), picture.len()].map(|count| (0..=count).map(|line| line as f64).collect());
        Cells { lines, free }
    }

    #[test]
    fn the_largest_comes_first_and_the_next_may_lie_across_it() {
        let found = cells(&["..#..", "#####", "#####", "..#..", "..#.."]).largest(9, 1.0);
        assert_eq!(found[0], [[0.0, 1.0], [5.0, 3.0]]);
        assert_eq!(found[1], [[2.0, 0.0], [3.0, 5.0]], "it adds three cells, the two halves fewer");
        assert_eq!(found.len(), 2);
        assert_eq!(cells(&["..", ".."]).largest(9, 0.5), [[[0.0; 2]; 2]; 0]);
        assert_eq!(cells(&["#.", ".#"]).largest(1, 0.5).len(), 1);
    }

    #[test]
    fn unequal_cells_count_by_their_area() {
        let cells = Cells { lines: [vec![0.0, 1.0, 2.0, 12.0], vec![0.0, 1.0]], free: vec![true, false, true] };
        assert_eq!(cells.largest(1, 0.0), [[[2.0, 0.0], [12.0, 1.0]]]);
    }

    #[test]
    fn stones_that_overlap_make_a_wall() {
        // Two courses of blocks that reach into their neighbours, the second shifted and a little short.
        let block = |x: f64, y: f64| [[x, y], [x + 1.01, y + 0.51]];
        let mut parts: Vec<Rectangle> = (0..10).map(|k| block(f64::from(k), 0.0)).collect();
        parts.extend((0..9).map(|k| block(f64::from(k) + 0.5, 0.5)));
        let found = in_union(&parts, 3, 0.1);
        assert_eq!(found[0], [[0.5, 0.0], [9.51, 1.01]]);
        assert!((area(&found[0]) - 9.01 * 1.01).abs() < 1e-12);
        // A gap of a hair divides it.
        let apart = [[[0.0, 0.0], [1.0, 1.0]], [[1.000_001, 0.0], [3.0, 1.0]]];
        assert_eq!(in_union(&apart, 1, 0.1), [apart[1]]);
        assert_eq!(in_union(&[], 1, 0.1), [[[0.0; 2]; 2]; 0]);
    }
}
