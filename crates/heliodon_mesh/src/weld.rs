//! Vertices that are the same to the bit: finding them.

use glam::Vec3;

/// Finds positions that it has seen before, exactly (0 and -0 are the same). Open addressing over indices: 8 to 16 bytes a vertex.
#[derive(Default)]
pub(crate) struct Welder {
    slots: Vec<u32>,
    mask: usize,
}

const EMPTY: u32 = u32::MAX;

impl Welder {
    /// With room for so many positions at once.
    pub fn with_room_for(positions: usize) -> Self {
        let size = (positions * 2).next_power_of_two().max(64);
        Self { slots: vec![EMPTY; size], mask: size - 1 }
    }

    /// The index of the first equal position in `positions`, or `None` after having noted `p` as the next one,
    /// `positions.len()`, which the caller then appends.
    #[inline]
    pub fn find_or_note(&mut self, positions: &[Vec3], p: Vec3) -> Option<u32> {
        if positions.len() * 2 >= self.slots.len() {
            self.grow(positions);
        }
        let mut slot = hash(p) & self.mask;
        loop {
            match self.slots[slot] {
                EMPTY => break,
                index if positions[index as usize] == p => return Some(index),
                _ => slot = (slot + 1) & self.mask,
            }
        }
        self.slots[slot] = positions.len() as u32;
        None
    }

    #[cold]
    fn grow(&mut self, positions: &[Vec3]) {
        let size = (positions.len() * 4).next_power_of_two().max(64);
        self.slots.clear();
        self.slots.shrink_to_fit();
        self.slots.resize(size, EMPTY);
        self.mask = size - 1;
        for (index, &p) in positions.iter().enumerate() {
            let mut slot = hash(p) & self.mask;
            while self.slots[slot] != EMPTY {
                slot = (slot + 1) & self.mask;
            }
            self.slots[slot] = index as u32;
        }
    }
}

/// Mixes the three words; adding zero turns -0 into 0.
#[inline]
fn hash(p: Vec3) -> usize {
    let [x, y, z] = (p + Vec3::ZERO).to_array().map(|c| u64::from(c.to_bits()));
    let mut h = (x | (y << 32)).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    h = (h ^ (h >> 29) ^ z).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    (h ^ (h >> 32)).wrapping_mul(0x94D0_49BB_1331_11EB) as usize >> 16
}

/// For every position the index of the first one that is the same.
#[must_use]
pub(crate) fn first_of_position(positions: &[Vec3]) -> Vec<u32> {
    let size = (positions.len() * 2).next_power_of_two().max(2);
    let mask = size - 1;
    let mut slots = vec![EMPTY; size];
    let place = |(index, &p): (usize, &Vec3)| {
        let mut slot = hash(p) & mask;
        loop {
            match slots[slot] {
                EMPTY => break,
                first if positions[first as usize] == p => return first,
                _ => slot = (slot + 1) & mask,
            }
        }
        slots[slot] = index as u32;
        index as u32
    };
    positions.iter().enumerate().map(place).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_welder_and_the_table_agree() {
        let positions: Vec<Vec3> =
            (0..5000).map(|i| Vec3::new((i % 70) as f32, (i % 7) as f32 * -0.0, (i % 11) as f32)).collect();
        let (mut unique, mut welder) = (Vec::new(), Welder::default());
        let welded: Vec<Vec3> = positions
            .iter()
            .map(|&p| {
                let index = welder.find_or_note(&unique, p).unwrap_or_else(|| {
                    unique.push(p);
                    unique.len() as u32 - 1
                });
                unique[index as usize]
            })
            .collect();
        let first = first_of_position(&positions);
        assert_eq!(welded, positions);
        assert_eq!(unique.len(), 770);
        assert_eq!(first.iter().enumerate().filter(|(i, f)| *i == **f as usize).count(), 770);
        assert!(first.iter().enumerate().all(|(i, f)| positions[i] == positions[*f as usize]));
    }
}
