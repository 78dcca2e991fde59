//! Vertices at the same place.

use glam::Vec3;
use rayon::prelude::*;

/// The place of a vertex with a coordinate that is not finite.
pub const NOWHERE: u32 = u32::MAX;

/// For every vertex the first vertex at the same place: at the same position (0 and -0 are the same), or, with `weld_m` above zero,
/// within `weld_m` of a first one. First ones are further apart than `weld_m`. 8 to 16 bytes a vertex while it works.
pub fn places(positions: &[Vec3], weld_m: f32) -> Vec<u32> {
    let same = Table::new(positions.len()).fold(positions, same_place_hash, |first, p| positions[first as usize] == p);
    if weld_m > 0.0 { within(positions, same, weld_m) } else { same }
}

/// Open addressing over indices of positions.
struct Table {
    slots: Vec<u32>,
    mask: usize,
}

impl Table {
    fn new(entries: usize) -> Self {
        let size = (entries * 3 / 2).next_power_of_two().max(2);
        Self { slots: vec![NOWHERE; size], mask: size - 1 }
    }

    /// Every position's first equal, in order.
    fn fold(mut self, positions: &[Vec3], hash: impl Fn(Vec3) -> u64 + Sync, same: impl Fn(u32, Vec3) -> bool) -> Vec<u32> {
        let mut firsts: Vec<u32> = Vec::with_capacity(positions.len());
        for (index, &p) in positions.iter().enumerate() {
            firsts.push(if !p.is_finite() {
                NOWHERE
            } else if let Some(first) = self.find(hash(p), |first| same(first, p)) {
                first
            } else {
                self.note(hash(p), index as u32);
                index as u32
            });
        }
        firsts
    }

    #[inline]
    fn find(&self, hash: u64, mut same: impl FnMut(u32) -> bool) -> Option<u32> {
        let mut slot = hash as usize & self.mask;
        loop {
            match self.slots[slot] {
                NOWHERE => return None,
                first if same(first) => return Some(first),
                _ => slot = (slot + 1) & self.mask,
            }
        }
    }

    fn note(&mut self, hash: u64, index: u32) {
        let mut slot = hash as usize & self.mask;
        while self.slots[slot] != NOWHERE {
            slot = (slot + 1) & self.mask;
        }
        self.slots[slot] = index;
    }
}

/// First positions in a grid of cells as wide as the distance: whoever is within it is in one of 27 cells.
fn within(positions: &[Vec3], same: Vec<u32>, weld_m: f32) -> Vec<u32> {
    let cell = |p: Vec3| (p.as_dvec3() / f64::from(weld_m)).floor();
    let hash = |cell: glam::DVec3| mix(cell.to_array().map(f64::to_bits));
    let mut table = Table::new(positions.len());
    let mut joined = same;
    for index in 0..joined.len() {
        let first = joined[index];
        if first == NOWHERE {
            continue;
        }
        if first as usize != index {
            // the first one stands before it and knows already
            joined[index] = joined[first as usize];
            continue;
        }
        let (p, home) = (positions[index], cell(positions[index]));
        let near = |other: u32| positions[other as usize].as_dvec3().distance(p.as_dvec3()) <= f64::from(weld_m);
        let around = (0..27).map(|i| home + glam::DVec3::new(f64::from(i % 3), f64::from(i / 3 % 3), f64::from(i / 9)) - 1.0);
        // the earliest of all that are near, whichever cell it is in; adding zero turns -0 into 0, which has other bits
        let mut earliest = None;
        for neighbor in around.map(|cell| cell + 0.0) {
            table.find(hash(neighbor), |other| {
                if near(other) {
                    earliest = Some(earliest.map_or(other, |e: u32| e.min(other)));
                }
                false
            });
        }
        match earliest {
            Some(other) => joined[index] = other,
            None => table.note(hash(home + 0.0), index as u32),
        }
    }
    joined
}

fn same_place_hash(p: Vec3) -> u64 {
    mix((p + Vec3::ZERO).to_array().map(|c| u64::from(c.to_bits())))
}

/// Mixes three words well enough for their low bits to be an address.
#[inline]
fn mix([x, y, z]: [u64; 3]) -> u64 {
    let mut h = x.wrapping_mul(0x9E37_79B9_7F4A_7C15).rotate_left(29) ^ y;
    h = h.wrapping_mul(0xBF58_476D_1CE4_E5B9).rotate_left(31) ^ z;
    h = (h ^ (h >> 32)).wrapping_mul(0x94D0_49BB_1331_11EB);
    h ^ (h >> 29)
}

/// Moves every vertex to its place, and -0 to 0, so that those at one place have the same bits.
pub fn settle(positions: &mut [Vec3], places: &[u32]) {
    // a first vertex stays where it is, so it does not matter who moves when
    let moved: Vec<(u32, Vec3)> = places
        .par_iter()
        .enumerate()
        .filter(|&(index, &place)| place != NOWHERE && place as usize != index)
        .map(|(index, &place)| (index as u32, positions[place as usize]))
        .filter(|&(index, p)| positions[index as usize] != p)
        .collect();
    for (index, p) in moved {
        positions[index as usize] = p;
    }
    positions.par_iter_mut().for_each(|p| *p += Vec3::ZERO);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_found_to_the_bit_and_nan_is_nowhere() {
        let positions = [Vec3::ZERO, Vec3::NAN, Vec3::new(-0.0, 0.0, -0.0), Vec3::X, Vec3::X.next_up_x(), Vec3::NAN];
        assert_eq!(places(&positions, 0.0), [0, NOWHERE, 0, 3, 4, NOWHERE]);
    }

    trait NextUp {
        fn next_up_x(self) -> Self;
    }
    impl NextUp for Vec3 {
        fn next_up_x(self) -> Self {
            Self::new(self.x.next_up(), self.y, self.z)
        }
    }

    #[test]
    fn a_chain_of_near_ones_does_not_collapse_into_one() {
        let positions: Vec<Vec3> = (-50..50).map(|i| Vec3::new(i as f32 * 0.4, 0.0, -7.0)).collect();
        let mut settled = positions.clone();
        let found = places(&positions, 1.0);
        settle(&mut settled, &found);
        assert!(positions.iter().zip(&settled).all(|(a, b)| a.distance(*b) <= 1.0));
        let again = places(&settled, 1.0);
        assert!(
            again.iter().enumerate().all(|(i, &place)| settled[place as usize] == settled[i]),
            "welding twice is welding once"
        );
        let distinct = found.iter().enumerate().filter(|&(i, &place)| place as usize == i).count();
        assert!((30..40).contains(&distinct), "{distinct}");
    }

    #[test]
    fn a_heap_at_one_point_takes_no_time() {
        let heap = vec![Vec3::NAN; 200_000];
        assert!(places(&heap, 0.1).iter().all(|&p| p == NOWHERE));
        assert!(places(&vec![Vec3::ONE; 200_000], 0.1).iter().all(|&p| p == 0));
    }
}
