//! For each size of rectangles a row below which none of them has room.

/// Sides up to this one are each of their own size ...
const EXACT: u16 = 64;
/// ... and of longer ones those that differ by less than this part of them are of one.
const PART: u16 = 20;

/// A row for each width and height: a rectangle has no room where a smaller one has none, so rows never fall towards longer sides.
#[derive(Clone, Debug)]
pub(super) struct Rooms {
    /// The least side of each size, ascending.
    sides: Vec<u16>,
    rows: Vec<u32>,
}

impl Rooms {
    /// For sides up to the longest.
    pub fn new(longest: u32) -> Self {
        let after = |side: &u16| side.checked_add(if *side < EXACT { 1 } else { side / PART });
        let sides: Vec<u16> = std::iter::successors(Some(1), after).take_while(|side| u32::from(*side) <= longest).collect();
        Self { rows: vec![0; sides.len() * sides.len()], sides }
    }

    /// The number of the largest size that is no larger than a side, and its side.
    fn size(&self, side: u32) -> (usize, u32) {
        let number = self.sides.partition_point(|of_size| u32::from(*of_size) <= side).saturating_sub(1);
        (number, u32::from(self.sides[number]))
    }

    /// The number of the largest rectangle that is no larger, and its sides.
    pub fn of(&self, width: u32, height: u32) -> (usize, [u32; 2]) {
        let ((across, width), (along, height)) = (self.size(width), self.size(height));
        (across * self.sides.len() + along, [width, height])
    }

    /// The row of a rectangle.
    pub fn row(&self, number: usize) -> u32 {
        self.rows[number]
    }

    /// There is no room for a rectangle below a row.
    pub fn raise(&mut self, number: usize, row: u32) {
        let count = self.sides.len();
        for of_width in self.rows.chunks_exact_mut(count).skip(number / count) {
            let higher = &mut of_width[number % count..];
            if higher[0] >= row {
                return;
            }
            higher.iter_mut().take_while(|known| **known < row).for_each(|known| *known = row);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_larger_has_no_room_either() {
        let mut rooms = Rooms::new(2048);
        let at = |rooms: &Rooms, width: u32, height: u32| rooms.row(rooms.of(width, height).0);
        assert_eq!(rooms.of(10, 2000).1[0], 10);
        assert!((1900..=2000).contains(&rooms.of(10, 2000).1[1]));
        rooms.raise(rooms.of(10, 20).0, 100);
        rooms.raise(rooms.of(12, 5).0, 300);
        rooms.raise(rooms.of(11, 20).0, 50);
        for (width, height, row) in
            [(10, 19, 0), (9, 20, 0), (10, 20, 100), (11, 21, 100), (12, 4, 0), (12, 5, 300), (2000, 2000, 300)]
        {
            assert_eq!(at(&rooms, width, height), row, "{width} by {height}");
        }
        assert_eq!(Rooms::new(1).of(1, 1), (0, [1, 1]));
    }
}
