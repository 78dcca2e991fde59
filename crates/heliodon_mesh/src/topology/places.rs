//! Vertices at the same place.

use glam::{DVec3, Vec3};
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

/// Cells in which whoever is near is looked for are so many times as wide as the distance: a ball of that touches 3.4 of them in the mean, where 27 of its own size would be asked.
const REACHES: f64 = 4.0;
/// Whether anybody is near at all is asked in wider ones: most have theirs to themselves.
const WIDE_REACHES: f64 = 16.0;
/// Nobody is farther than this part more than the distance when all is rounded.
const ROUNDING: f64 = 1.0e-6;

/// A grid of cells.
#[derive(Clone, Copy)]
struct Grid {
    reach_m: f64,
    cell_m: f64,
}

impl Grid {
    fn new(weld_m: f32, reaches: f64) -> Self {
        Self { reach_m: f64::from(weld_m) * (1.0 + ROUNDING), cell_m: f64::from(weld_m) * reaches }
    }

    fn cell(&self, p: DVec3) -> DVec3 {
        (p / self.cell_m).floor()
    }

    fn home(&self, p: Vec3) -> u64 {
        Self::hash(self.cell(p.as_dvec3()))
    }

    /// All cells that hold somebody within reach, by their hashes.
    fn around(&self, p: Vec3) -> impl Iterator<Item = u64> {
        let low = self.cell(p.as_dvec3() - self.reach_m);
        // cells are wider than twice the reach: two along each axis at most
        let on = self.cell(p.as_dvec3() + self.reach_m).cmpgt(low).bitmask();
        let steps = |k: u32| DVec3::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2));
        (0..8).filter(move |k| k & !on == 0).map(move |k| Self::hash(low + steps(k)))
    }

    /// Adding zero turns -0 into 0, which has other bits.
    fn hash(cell: DVec3) -> u64 {
        mix((cell + 0.0).to_array().map(f64::to_bits))
    }
}

/// How many positions each cell has, up to two: some cells share a number.
struct Counts {
    /// A bit for each that has one, and one for each that has more.
    bits: Vec<[u64; 2]>,
}

impl Counts {
    fn new(entries: usize) -> Self {
        Self { bits: vec![[0; 2]; (entries * 4).next_power_of_two().div_ceil(64)] }
    }

    fn at(&self, hash: u64) -> (usize, u64) {
        ((hash as usize / 64) & (self.bits.len() - 1), 1 << (hash % 64))
    }

    fn add(&mut self, hash: u64) {
        let (word, bit) = self.at(hash);
        let [one, more] = &mut self.bits[word];
        *more |= *one & bit;
        *one |= bit;
    }

    fn has(&self, hash: u64) -> bool {
        let (word, bit) = self.at(hash);
        self.bits[word][0] & bit != 0
    }

    fn has_more(&self, hash: u64) -> bool {
        let (word, bit) = self.at(hash);
        self.bits[word][1] & bit != 0
    }
}

/// Who is near anybody is asked first, by counts alone and on all threads: most are not, and of these nobody's place depends. The others are met one after the other.
fn within(positions: &[Vec3], same: Vec<u32>, weld_m: f32) -> Vec<u32> {
    let wide = Grid::new(weld_m, WIDE_REACHES);
    let is_first = |&(index, &first): &(usize, &u32)| first as usize == index;
    let mut counts = Counts::new(positions.len());
    same.iter().enumerate().filter(is_first).for_each(|(index, _)| counts.add(wide.home(positions[index])));
    let has_near = |&(index, _): &(usize, &u32)| {
        let (p, home) = (positions[index], wide.home(positions[index]));
        counts.has_more(home) || wide.around(p).any(|cell| cell != home && counts.has(cell))
    };
    let firsts = same.par_iter().enumerate().filter(is_first).filter(has_near);
    let candidates: Vec<u32> = firsts.map(|(index, _)| index as u32).collect();
    drop(counts);
    let grid = Grid::new(weld_m, REACHES);
    let mut table = Table::new(candidates.len());
    let mut joined = same;
    for index in candidates {
        let p = positions[index as usize];
        let near = |other: u32| positions[other as usize].as_dvec3().distance(p.as_dvec3()) <= f64::from(weld_m);
        // the earliest of all that are near, whichever cell it is in
        let mut earliest = None;
        for cell in grid.around(p) {
            table.find(cell, |other| {
                if near(other) {
                    earliest = Some(earliest.map_or(other, |e: u32| e.min(other)));
                }
                false
            });
        }
        match earliest {
            Some(other) => joined[index as usize] = other,
            None => table.note(grid.home(p), index),
        }
    }
    // a first one stands before all that are where it is, and knows already
    for index in 0..joined.len() {
        if joined[index] != NOWHERE {
            joined[index] = joined[joined[index] as usize];
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
    use heliodon_math::random::Pcg32;

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
    fn welding_says_what_asking_everybody_says() {
        let mut random = Pcg32::new(5, 3);
        // from all near somebody to nearly none, across cells' borders and zero
        for side in [1.0, 4.0, 30.0, 200.0] {
            let mut point = || Vec3::from_array(core::array::from_fn(|_| random.range_f32(-side, side)));
            let mut positions: Vec<Vec3> = (0..600).map(|_| point()).collect();
            positions.extend([Vec3::NAN, positions[7], Vec3::ZERO, -Vec3::ZERO, Vec3::splat(-4.0), Vec3::splat(-4.0 - 0.57)]);
            let mut expected: Vec<u32> = Vec::new();
            for (index, p) in positions.iter().enumerate() {
                let is_first = |&(other, _): &(usize, &u32)| expected[other] as usize == other;
                let near =
                    expected.iter().enumerate().filter(is_first).find(|&(other, _)| positions[other].distance(*p) <= 1.0);
                let place = near.map_or(index as u32, |(other, _)| other as u32);
                expected.push(if p.is_finite() { place } else { NOWHERE });
            }
            assert_eq!(places(&positions, 1.0), expected, "{side}");
        }
    }

    #[test]
    fn a_heap_at_one_point_takes_no_time() {
        let heap = vec![Vec3::NAN; 200_000];
        assert!(places(&heap, 0.1).iter().all(|&p| p == NOWHERE));
        assert!(places(&vec![Vec3::ONE; 200_000], 0.1).iter().all(|&p| p == 0));
    }
}
