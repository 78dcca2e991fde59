//! Where a sheet has room for a mask: at all places of a row at once, a bit each.

use super::inner::Inner;
use super::mask::{Apart, Mask};
use super::sheet::{BLOCK, LANES, Sheet};

/// In so many rows for its height a mask is tried.
const STEPS: u32 = 32;
/// So many rows are asked for their longest run before any place is.
const ASKED_FIRST: usize = 8;

/// Bits of places one after the other.
type Block = [u64; LANES];
const ALL: Block = [u64::MAX; LANES];

impl Sheet {
    /// The first place where there is room for all of it, the lowest row first, in rows up to `last`.
    pub fn find(&mut self, mask: &Mask, last: u32) -> Option<[u32; 2]> {
        pulp::Arch::new().dispatch(Find { sheet: self, mask, last })
    }
}

/// A call of [`Sheet::find`]. pulp compiles it for what the processor has, and what is to be part of it must be inlined.
struct Find<'a> {
    sheet: &'a mut Sheet,
    mask: &'a Mask,
    last: u32,
}

impl pulp::NullaryFnOnce for Find<'_> {
    type Output = Option<[u32; 2]>;

    #[inline(always)]
    fn call(self) -> Self::Output {
        let Self { sheet, mask, last } = self;
        if mask.width > sheet.width || mask.height > sheet.height {
            return None;
        }
        let last = last.min(sheet.height - mask.height);
        let mut scratch = std::mem::take(&mut sheet.scratch);
        let found = find(sheet, mask, last, &mut scratch);
        sheet.scratch = scratch;
        found
    }
}

/// Rooms only become fewer, so a rectangle of a size is looked for from where the last one was, and what contains one from where it has room.
#[inline(always)]
fn find(sheet: &mut Sheet, mask: &Mask, last: u32, scratch: &mut Vec<u64>) -> Option<[u32; 2]> {
    let (number, [width, height]) = sheet.rooms.of(mask.inner.width, mask.inner.height);
    let from = sheet.rooms.row(number);
    if from > last + mask.inner.row {
        return None;
    }
    // as far as any mask may go: what is found holds for all of the size
    let place = search(sheet, &Mask::full(width, height), from, sheet.height - height, scratch);
    let row = place.map_or(sheet.height, |[_, y]| y);
    sheet.rooms.raise(number, row);
    if mask.is_full() && (mask.width, mask.height) == (width, height) {
        return place.filter(|[_, y]| *y <= last);
    }
    let mut from = place?[1].saturating_sub(mask.inner.row);
    if mask.is_full() {
        return search(sheet, mask, from, last, scratch);
    }
    from = from.max(sheet.rooms_of_masks.get(&mask.hash).copied().unwrap_or(0));
    let place = search(sheet, mask, from, last, scratch);
    sheet.rooms_of_masks.insert(mask.hash, place.map_or(last + 1, |[_, y]| y).max(from));
    place
}

#[inline(always)]
fn search(sheet: &Sheet, mask: &Mask, from: u32, last: u32, scratch: &mut Vec<u64>) -> Option<[u32; 2]> {
    let Inner { width, height, row, .. } = mask.inner;
    // what is large is tried in fewer rows, and then moved back as far as there is room
    let step = (mask.height / STEPS).max(1);
    let (mut y, mut asked) = (from, 0);
    let [mut x, mut y] = loop {
        if y > last {
            return None;
        }
        // a row without a run as long leaves no room in any row from which it is reached
        let rows = y + row..y + row + height;
        let (begin, mut end) = (rows.start.max(asked), rows.end);
        while end > begin && sheet.longest(end - 1) >= width {
            end -= 1;
        }
        asked = rows.end;
        if end > begin {
            y = end - row;
            continue;
        }
        match find_in_row(sheet, mask, y, scratch) {
            Some(x) => break [x, y],
            None if y < last => y = (y + step).min(last),
            None => return None,
        }
    };
    while step > 1
        && let Some(above) = y.checked_sub(1).filter(|above| *above >= from)
        && let Some(place) = find_in_row(sheet, mask, above, scratch)
    {
        [x, y] = [place, above];
    }
    Some([x, y])
}

#[inline(always)]
fn find_in_row(sheet: &Sheet, mask: &Mask, y: u32, scratch: &mut Vec<u64>) -> Option<u32> {
    for &of_mask in &mask.order[..mask.order.len().min(ASKED_FIRST)] {
        let longest = sheet.longest(y + u32::from(of_mask));
        for run in mask.row(u32::from(of_mask)) {
            if u32::from(run.length) > longest {
                return None;
            }
        }
    }
    let Inner { width, height, row, column } = mask.inner;
    let top = y + row;
    // places are those of its largest rectangle
    for block in column / BLOCK..sheet.blocks() {
        let is_long = |row: u32| sheet.longest_from(row, block) >= width;
        if !(is_long(top) && is_long(top + height - 1) && is_long(top + height / 2)) {
            continue;
        }
        let mut blocked = below(column.saturating_sub(block * BLOCK));
        if is_room(sheet, mask, y, block, &mut blocked, scratch) {
            let mut free = 0;
            while blocked[free] == u64::MAX {
                free += 1;
            }
            return Some(block * BLOCK + 64 * free as u32 + blocked[free].trailing_ones() - column);
        }
    }
    None
}

/// The first bits of a block.
#[inline(always)]
fn below(count: u32) -> Block {
    each(|word| match count.saturating_sub(64 * word as u32) {
        0 => 0,
        count => u64::MAX >> 64_u32.saturating_sub(count),
    })
}

/// Finds out where something is in the way of the mask in a row: a bit says so for its largest rectangle's place in the block. Whether there is a place where
/// nothing is.
#[inline(always)]
fn is_room(sheet: &Sheet, mask: &Mask, y: u32, block: u32, blocked: &mut Block, scratch: &mut Vec<u64>) -> bool {
    // its largest rectangle first: all its rows at once, a few that lie far apart before the others
    let Inner { width, height, row, column } = mask.inner;
    let top = y + row;
    let mut rows = Apart::new(height);
    let (mut left, mut now) = (height, 4);
    while left > 0 {
        let few = Few { sheet, top, apart: &mut rows, left: now };
        let met = if width <= 64 { met(few, block, width) } else { met_far(few, block, width, scratch) };
        *blocked = or(*blocked, met);
        if *blocked == ALL {
            return false;
        }
        (left, now) = (left.saturating_sub(now), now * 4);
    }
    for &of_mask in &mask.order {
        for run in mask.row(u32::from(of_mask)) {
            let (words, length) = (sheet.row(y + u32::from(of_mask)), u32::from(run.length));
            let from = (block * BLOCK + u32::from(run.begin)) as isize - column as isize;
            let met =
                if length <= 64 { smeared(aligned(words, from), length) } else { run_met_far(words, from, length, scratch) };
            *blocked = or(*blocked, met);
            if *blocked == ALL {
                return false;
            }
        }
    }
    true
}

/// A block, word by word.
#[inline(always)]
fn each(word: impl Fn(usize) -> u64) -> Block {
    [word(0), word(1), word(2), word(3)]
}

#[inline(always)]
fn or(a: Block, b: Block) -> Block {
    each(|i| a[i] | b[i])
}

/// The words from a place on; beyond the row's ends all is taken.
#[inline(always)]
fn load(row: &[u64], at: isize) -> Block {
    // before the begin it is a large number
    match row.get(at as usize..).and_then(|from| from.first_chunk::<LANES>()) {
        Some(words) => *words,
        None => load_at_end(row, at),
    }
}

#[cold]
#[inline(never)]
fn load_at_end(row: &[u64], at: isize) -> Block {
    let word = |i: isize| usize::try_from(at + i).ok().and_then(|at| row.get(at)).copied().unwrap_or(u64::MAX);
    [word(0), word(1), word(2), word(3)]
}

/// The bits from a place on, and those from a word further on.
#[inline(always)]
fn aligned(row: &[u64], from: isize) -> [Block; 2] {
    let (word, bits) = (from.div_euclid(64), from.rem_euclid(64) as u32);
    let [a, b, c] = [load(row, word), load(row, word + 1), load(row, word + 2)];
    [each(|i| funnel(a[i], b[i], bits)), each(|i| funnel(b[i], c[i], bits))]
}

/// The 64 bits that begin with bit `by` of the first word.
#[inline(always)]
fn funnel(word: u64, next: u64, by: u32) -> u64 {
    // twice, for a shift by 64 is none
    word >> by | next << 1 << (63 - by)
}

/// Whether any of so many bits, 64 at most, from each place on is set; given are the bits and those a word further on.
#[inline(always)]
fn smeared([mut bits, mut further]: [Block; 2], length: u32) -> Block {
    let mut done = 1;
    while done < length {
        let by = done.min(length - done);
        bits = each(|i| bits[i] | bits[i] >> by | further[i] << (64 - by));
        further = each(|i| further[i] | further[i] >> by);
        done += by;
    }
    bits
}

/// A few of the rows of a rectangle that begins in row `top`, those that come next.
struct Few<'a, 'b> {
    sheet: &'a Sheet,
    top: u32,
    apart: &'b mut Apart,
    left: u32,
}

impl<'a> Iterator for Few<'a, '_> {
    type Item = &'a [u64];

    #[inline(always)]
    fn next(&mut self) -> Option<Self::Item> {
        self.left = self.left.checked_sub(1)?;
        Some(self.sheet.row(self.top + self.apart.next()?))
    }
}

/// Whether rows have something within so many texels, 64 at most, from each place of a block on.
#[inline(always)]
fn met(rows: Few, block: u32, length: u32) -> Block {
    let at = block as isize * LANES as isize;
    let mut together = [[0; LANES]; 2];
    for row in rows {
        together = [or(together[0], load(row, at)), or(together[1], load(row, at + 1))];
    }
    smeared(together, length)
}

/// The same for any length.
#[inline(always)]
fn met_far(rows: Few, block: u32, length: u32, scratch: &mut Vec<u64>) -> Block {
    let first = block as usize * LANES;
    let count = cleared(scratch, length);
    for row in rows {
        for place in (0..count).step_by(LANES) {
            let words = or(load(scratch, place as isize), load(row, (first + place) as isize));
            scratch[place..place + LANES].copy_from_slice(&words);
        }
    }
    smear_far(scratch, count, length)
}

/// Makes room for a block and so many texels behind it. How many words these are.
#[inline(always)]
fn cleared(scratch: &mut Vec<u64>, length: u32) -> usize {
    let count = LANES + length as usize / 64 + 2;
    scratch.clear();
    scratch.resize(count.next_multiple_of(LANES) + LANES + 1, 0);
    count
}

/// The same of one row and a place that may be before its begin.
#[inline(always)]
fn run_met_far(row: &[u64], from: isize, length: u32, scratch: &mut Vec<u64>) -> Block {
    let (word, bits) = (from.div_euclid(64), from.rem_euclid(64) as u32);
    let count = cleared(scratch, length);
    for place in (0..count).step_by(LANES) {
        let at = word + place as isize;
        let [a, b] = [load(row, at), load(row, at + 1)];
        let aligned: Block = each(|i| funnel(a[i], b[i], bits));
        scratch[place..place + LANES].copy_from_slice(&aligned);
    }
    smear_far(scratch, count, length)
}

/// Whether any of so many bits from each place of the first block on is set: fewer words need be right with every step.
#[inline(always)]
fn smear_far(row: &mut [u64], count: usize, length: u32) -> Block {
    let (mut done, mut count) = (1, count);
    while done < length {
        let by = done.min(length - done);
        let (words, bits) = ((by / 64) as usize, by % 64);
        // the last word that is asked for in steps to come
        count = count.min(LANES + ((length - done - by) / 64) as usize + 2);
        for place in (0..count).step_by(LANES) {
            let [a, b, c] =
                [load(row, place as isize), load(row, (place + words) as isize), load(row, (place + words + 1) as isize)];
            let smeared: Block = each(|i| a[i] | funnel(b[i], c[i], bits));
            row[place..place + LANES].copy_from_slice(&smeared);
        }
        done += by;
    }
    load(row, 0)
}

#[cfg(test)]
mod tests {
    use super::super::bitmap::{Bitmap, INSET};
    use super::*;
    use glam::Vec2;
    use proptest::prelude::*;

    fn triangle(corners: [(u32, u32); 3]) -> Mask {
        let low = corners.iter().fold([u32::MAX; 2], |low, p| [low[0].min(p.0), low[1].min(p.1)]);
        let at = |(x, y): (u32, u32)| Vec2::splat(INSET) + Vec2::new((x - low[0]) as f32, (y - low[1]) as f32);
        let bitmap = Bitmap::new(&[corners.map(at)], 1000).unwrap();
        let mask = Mask::new(&bitmap);
        let inner = Inner::of(&bitmap, &mask);
        mask.with_inner(inner)
    }

    /// The same found texel by texel.
    fn tried(taken: &[Vec<bool>], mask: &Mask, last: u32) -> Option<[u32; 2]> {
        let (width, height) = (taken[0].len() as u32, taken.len() as u32);
        let texels = |x: u32, y: u32| {
            (0..mask.height).flat_map(move |row| {
                mask.row(row)
                    .iter()
                    .flat_map(move |run| (u32::from(run.begin)..run.end()).map(move |column| [x + column, y + row]))
            })
        };
        let places = (0..=height.checked_sub(mask.height)?.min(last))
            .flat_map(|y| (0..width.saturating_sub(mask.width - 1)).map(move |x| [x, y]));
        places.into_iter().find(|&[x, y]| texels(x, y).all(|[x, y]| !taken[y as usize][x as usize]))
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 100, ..ProptestConfig::default() })]

        /// Masks of less than 64 rows, which are tried in each.
        #[test]
        fn the_first_room_is_found(
            corners in proptest::collection::vec([(0_u32..40, 0_u32..30), (0_u32..40, 0_u32..30), (0_u32..200, 0_u32..50)], 1..40),
            width in 30_u32..600,
            height in 20_u32..150,
            margin in 0_u32..3,
            last in 50_u32..150,
        ) {
            let mut sheet = Sheet::new(width, height);
            let mut taken = vec![vec![false; width as usize]; height as usize];
            for mask in corners.into_iter().map(triangle) {
                let found = sheet.find(&mask, last);
                prop_assert_eq!(found, tried(&taken, &mask, last));
                let Some([x, y]) = found else { continue };
                sheet.put(&mask, [x, y], margin);
                for (row, run) in (0..mask.height).flat_map(|row| mask.row(row).iter().map(move |run| (row, run))) {
                    for taken in &mut taken[(y + row).saturating_sub(margin) as usize..(y + row + margin + 1).min(height) as usize] {
                        taken[(x + u32::from(run.begin)).saturating_sub(margin) as usize..(x + run.end() + margin).min(width) as usize].fill(true);
                    }
                }
                let free = taken.iter().flatten().filter(|taken| !**taken).count() as u64;
                prop_assert_eq!(sheet.free(), free);
            }
        }
    }
}
