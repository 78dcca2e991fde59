//! A texture that charts are laid onto, each where there is room first.

use super::mask::{Inner, Mask, apart, next, set};

/// Which texels are taken, a bit each: all of a large sheet stays near to the processor.
#[derive(Clone, Debug)]
pub(super) struct Sheet {
    width: u32,
    height: u32,
    /// Words of a row, one of them behind its end.
    words: usize,
    taken: Vec<u64>,
    /// For each row its longest free run.
    longest: Vec<u16>,
    /// For each size of rectangles, by width and height, a row below which none of them has room: what contains one has none there either.
    rectangle_rows: Vec<u32>,
    /// Texels that are not taken.
    free: u64,
    /// What is in the way of a mask in one row, and what is taken there: kept, so that they need not be made anew.
    blocked: Vec<u64>,
    together: Vec<u64>,
    /// Twice as long as a row, so that what lies behind it is nothing.
    smeared: Vec<u64>,
}

/// How many sizes there are.
fn sizes() -> usize {
    size_of(LARGEST).0 + 1
}

/// In so many rows for its height a mask is tried.
const STEPS: u32 = 32;
/// So many rows are asked for their longest run before any place is.
const ASKED_FIRST: usize = 8;
/// Rectangles whose sides differ by less than this are of one size.
const SIZES: f32 = 1.15;

/// The number of the largest size that is no larger than a side, and its side.
fn size_of(side: u32) -> (usize, u32) {
    let number = (libm::logf(side.max(1) as f32) / libm::logf(SIZES)).floor();
    (number as usize, (libm::powf(SIZES, number).ceil() as u32).min(side.max(1)))
}

/// The largest side of a sheet, so that runs fit into 16 bits.
pub(super) const LARGEST: u32 = 16_384;

impl Sheet {
    pub fn new(width: u32, height: u32) -> Self {
        let words = width as usize / 64 + 1;
        Self {
            width,
            height,
            words,
            taken: vec![0; words * height as usize],
            longest: vec![width as u16; height as usize],
            rectangle_rows: vec![0; sizes() * sizes()],
            free: u64::from(width) * u64::from(height),
            blocked: vec![0; words],
            together: vec![0; words],
            smeared: vec![0; 2 * words + 1],
        }
    }

    /// Texels that are not taken.
    pub fn free(&self) -> u64 {
        self.free
    }

    fn row(&self, y: u32) -> &[u64] {
        &self.taken[y as usize * self.words..][..self.words]
    }

    /// The first place where there is room for all of it, the lowest row first.
    pub fn find(&mut self, mask: &Mask) -> Option<[u32; 2]> {
        pulp::Arch::new().dispatch(Find { sheet: self, mask })
    }

    /// A row below which no rectangle of a size has room; none where it has none at all. Rooms only become fewer, so it is looked for from where it was.
    #[inline(always)]
    fn lowest_rectangle(&mut self, inner: &Inner) -> Option<u32> {
        let ((across, width), (along, height)) = (size_of(inner.width), size_of(inner.height));
        let size = across * sizes() + along;
        let row = self.find_from(&Mask::full(width, height), self.rectangle_rows[size]).map(|[_, y]| y);
        self.rectangle_rows[size] = row.unwrap_or(self.height);
        row
    }

    #[inline(always)]
    fn find_from(&mut self, mask: &Mask, from: u32) -> Option<[u32; 2]> {
        if mask.width > self.width || mask.height > self.height {
            return None;
        }
        // what is large is tried in fewer rows, and then moved back as far as there is room
        let (step, last) = ((mask.height / STEPS).max(1), self.height - mask.height);
        let mut y = from;
        let [mut x, mut y] = loop {
            if y > last {
                return None;
            }
            match self.find_in_row(mask, y) {
                Some(x) => break [x, y],
                None if y < last => y = (y + step).min(last),
                None => return None,
            }
        };
        while let Some(above) = y.checked_sub(1).filter(|above| *above >= from && step > 1)
            && let Some(place) = self.find_in_row(mask, above)
        {
            [x, y] = [place, above];
        }
        Some([x, y])
    }

    #[inline(always)]
    fn find_in_row(&mut self, mask: &Mask, y: u32) -> Option<u32> {
        let longest = |row: &u16| self.longest[(y + u32::from(*row)) as usize];
        let fits = |row: &u16| mask.row(u32::from(*row)).iter().all(|run| i32::from(run.length) <= i32::from(longest(row)));
        if !mask.order.iter().take(ASKED_FIRST).all(fits) {
            return None;
        }
        let mut blocked = std::mem::take(&mut self.blocked);
        blocked.fill(0);
        set(&mut blocked, (self.width - mask.width) as usize + 1, self.words * 64);
        let found = self.is_room(mask, y, &mut blocked).then(|| next(&blocked, 0, false)).flatten();
        self.blocked = blocked;
        found.map(|x| x as u32)
    }

    /// Finds out where something is in the way of the mask in a row: bit x says so for it at x. Whether there is a place where nothing is.
    #[inline(always)]
    fn is_room(&mut self, mask: &Mask, y: u32, blocked: &mut [u64]) -> bool {
        let Self { words, taken, together, smeared, .. } = self;
        let row_of = |y: u32| &taken[y as usize * *words..][..*words];
        // its largest rectangle first: all its rows at once, a few that lie far apart before the others
        let Inner { width, height, row, column } = mask.inner;
        together.fill(0);
        let mut asked = 0;
        for place in apart(height) {
            together.iter_mut().zip(row_of(y + row + place)).for_each(|(together, row)| *together |= row);
            asked += 1;
            if asked == height || asked >= 4 && asked.is_power_of_two() && asked.ilog2().is_multiple_of(2) {
                smeared[..*words].copy_from_slice(together);
                if !block(blocked, smeared, width, column) {
                    return false;
                }
            }
        }
        if mask.is_full() {
            return true;
        }
        for &row in &mask.order {
            for run in mask.row(u32::from(row)) {
                smeared[..*words].copy_from_slice(row_of(y + u32::from(row)));
                if !block(blocked, smeared, u32::from(run.length), u32::from(run.begin)) {
                    return false;
                }
            }
        }
        true
    }

    /// Takes the mask's texels, laid at a place, and those within `margin` of them.
    pub fn put(&mut self, mask: &Mask, [x, y]: [u32; 2], margin: u32) {
        let rows = y.saturating_sub(margin)..(y + mask.height + margin).min(self.height);
        for row in rows {
            let (_, before) = longest_free(self.row(row), self.width);
            let near = row.saturating_sub(y + margin)..(row + margin + 1).saturating_sub(y).min(mask.height);
            for run in near.flat_map(|of_mask| mask.row(of_mask)) {
                let begin = x + u32::from(run.begin);
                let end = (begin + u32::from(run.length) + margin).min(self.width);
                set(
                    &mut self.taken[row as usize * self.words..][..self.words],
                    begin.saturating_sub(margin) as usize,
                    end as usize,
                );
            }
            let (longest, free) = longest_free(self.row(row), self.width);
            self.longest[row as usize] = longest;
            self.free = self.free + free - before;
        }
    }
}

/// A call of [`Sheet::find`].
struct Find<'a> {
    sheet: &'a mut Sheet,
    mask: &'a Mask,
}

impl pulp::NullaryFnOnce for Find<'_> {
    type Output = Option<[u32; 2]>;

    #[inline(always)]
    fn call(self) -> Self::Output {
        let Self { sheet, mask } = self;
        let from = sheet.lowest_rectangle(&mask.inner)?.saturating_sub(mask.inner.row);
        sheet.find_from(mask, from)
    }
}

/// The 64 bits that begin with bit `by` of the first word.
#[inline(always)]
fn funnel(word: u64, next: u64, by: u32) -> u64 {
    // twice, for a shift by 64 is none
    word >> by | next << 1 << (63 - by)
}

/// Adds where a run of `length` texels, which begins `begin` texels behind a place, meets what the first half of `row` has; that half is used up. Whether any place
/// is left.
#[inline(always)]
fn block(blocked: &mut [u64], row: &mut [u64], length: u32, begin: u32) -> bool {
    let count = blocked.len();
    // bit x becomes whether any of the bits from x on was set
    let mut done = 1;
    while done < length {
        let by = done.min(length - done);
        or_shifted(row, count, by);
        done += by;
    }
    let (words, bits) = ((begin / 64) as usize, begin % 64);
    let later = row[words..].iter().zip(&row[words + 1..]);
    let mut all = u64::MAX;
    for (blocked, (word, next)) in blocked.iter_mut().zip(later) {
        *blocked |= funnel(*word, *next, bits);
        all &= *blocked;
    }
    all != u64::MAX
}

/// Adds to each of the first bits the one so many further on.
#[inline(always)]
fn or_shifted(row: &mut [u64], count: usize, by: u32) {
    let (words, bits) = ((by / 64) as usize, by % 64);
    for place in 0..count {
        row[place] |= funnel(row[place + words], row[place + words + 1], bits);
    }
}

/// The longest run of free texels, and how many are free.
fn longest_free(row: &[u64], width: u32) -> (u16, u64) {
    let (mut x, mut longest, mut free) = (0, 0, 0);
    while let Some(begin) = next(row, x, false).filter(|begin| *begin < width as usize) {
        let end = next(row, begin, true).unwrap_or(width as usize).min(width as usize);
        longest = longest.max(end - begin);
        free += end - begin;
        x = end;
    }
    (longest as u16, free as u64)
}

#[cfg(test)]
mod tests {
    use super::super::mask::INSET;
    use super::*;
    use glam::Vec2;

    fn square(side: f32) -> Mask {
        let at = |x: f32, y: f32| Vec2::splat(INSET) + Vec2::new(x, y) * side;
        Mask::new(&[[at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0)], [at(0.0, 0.0), at(1.0, 1.0), at(0.0, 1.0)]], 1000).unwrap()
    }

    #[test]
    fn squares_fill_a_sheet_row_by_row() {
        let mut sheet = Sheet::new(23, 11);
        let mask = square(4.0);
        let mut places = Vec::new();
        while let Some(place) = sheet.find(&mask) {
            sheet.put(&mask, place, 1);
            places.push(place);
        }
        assert_eq!(places, [[0, 0], [6, 0], [12, 0], [18, 0], [0, 6], [6, 6], [12, 6], [18, 6]]);
        assert_eq!(sheet.find(&square(0.0)), None, "margins are taken");
    }

    #[test]
    fn a_triangle_makes_room_beside_its_slope() {
        let corner = |p: [f32; 2]| Vec2::splat(INSET) + Vec2::from(p);
        let under = Mask::new(&[[corner([0.0, 0.0]), corner([60.0, 0.0]), corner([0.0, 60.0])]], 100).unwrap();
        let above = Mask::new(&[[corner([60.0, 0.0]), corner([60.0, 60.0]), corner([0.0, 60.0])]], 100).unwrap();
        let mut sheet = Sheet::new(66, 66);
        sheet.put(&under, [0, 0], 0);
        let place = sheet.find(&above).unwrap();
        assert!(place[0] <= 4 && place[1] <= 4, "{place:?}");
        assert_eq!(Sheet::new(60, 66).find(&above), None);
    }
}
