//! A large rectangle within a mask: whether it has room is asked first, for that is asked quickest.

use super::bitmap::{Bitmap, runs};
use super::mask::Mask;

/// A rectangle within a mask.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Inner {
    pub width: u32,
    pub height: u32,
    /// Its first row and column.
    pub row: u32,
    pub column: u32,
}

/// A mask is looked at in no more cells than this a side: those of large ones have several texels.
const CELLS: u32 = 48;

impl Inner {
    /// The largest of whole cells, and grown then: of masks no larger than so many cells the largest that there is.
    pub fn of(bitmap: &Bitmap, mask: &Mask) -> Self {
        if mask.is_full() {
            return mask.inner;
        }
        let mut cell = [mask.width, mask.height].map(|side| side.div_ceil(CELLS));
        loop {
            let largest = largest_of_cells(bitmap, cell);
            // what is thinner than two cells may have none
            if largest.width > 0 || cell == [1, 1] {
                return largest.grown(mask);
            }
            cell = cell.map(|side| side.div_ceil(2));
        }
    }

    /// Turned by a quarter together with its mask of that height.
    pub fn turned(self, height: u32) -> Self {
        Self { width: self.height, height: self.width, row: self.column, column: height - self.row - self.height }
    }

    /// As wide as its rows allow, then as high.
    fn grown(self, mask: &Mask) -> Self {
        let holds =
            |y: u32, begin: u32, end: u32| mask.row(y).iter().find(|run| u32::from(run.begin) <= begin && end <= run.end());
        let Self { width, height, row, column } = self;
        let runs = (row..row + height).filter_map(|y| holds(y, column, column + width));
        let (begin, end) =
            runs.fold((0, mask.width), |(begin, end), run| (begin.max(u32::from(run.begin)), end.min(run.end())));
        let free = |y: &u32| holds(*y, begin, end).is_some();
        let above = (0..row).rev().take_while(free).count() as u32;
        let below = (row + height..mask.height).take_while(free).count() as u32;
        Self { width: end - begin, height: above + height + below, row: row - above, column: begin }
    }
}

/// The rectangle with the most cells of so many texels, the mask's all: below each row's cells stand columns of those above, and the largest rectangle that
/// ends in the row ends at a column that is lower than its neighbours.
fn largest_of_cells(bitmap: &Bitmap, [across, along]: [u32; 2]) -> Inner {
    let mut columns = vec![0_u32; (bitmap.width / across) as usize + 1];
    let mut largest = Inner::default();
    let mut open: Vec<(usize, u32)> = Vec::with_capacity(columns.len());
    let mut together: Vec<u64> = Vec::new();
    for (y, row) in bitmap.rows().enumerate() {
        let y = y as u32;
        if y.is_multiple_of(along) {
            together.clear();
            together.extend_from_slice(row);
        } else {
            together.iter_mut().zip(row).for_each(|(together, row)| *together &= row);
        }
        if !(y + 1).is_multiple_of(along) {
            continue;
        }
        let mut x = 0;
        for (begin, end) in runs(&together) {
            let (begin, end) = (begin.div_ceil(across as usize), end / across as usize);
            if begin < end {
                columns[x..begin].fill(0);
                columns[begin..end].iter_mut().for_each(|column| *column += 1);
                x = end;
            }
        }
        columns[x..].fill(0);
        for (x, &height) in columns.iter().enumerate() {
            let mut begin = x;
            while let Some((from, above)) = open.pop_if(|(_, above)| *above >= height) {
                begin = from;
                let width = (x - from) as u32;
                if above * width > largest.width * largest.height {
                    largest = Inner { width, height: above, row: y / along + 1 - above, column: from as u32 };
                }
            }
            if height > 0 {
                open.push((begin, height));
            }
        }
    }
    let Inner { width, height, row, column } = largest;
    Inner { width: width * across, height: height * along, row: row * along, column: column * across }
}
