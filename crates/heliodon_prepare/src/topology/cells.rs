//! Points by the cells of a grid, so that those near to a place are found.

use glam::{DVec3, Vec3};
use heliodon_mesh::topology::Buckets;

/// Bits for each bucket of cells that have points: of those without, seven in eight are known by a bit, which the processor's cache has at hand.
const BITS: usize = 8;

/// Points sorted by the cells that they lie in: 4 bytes a point and up to 10 for the buckets, however far apart they are.
pub(crate) struct Cells<'p> {
    points: &'p [Vec3],
    buckets: Buckets<u32>,
    /// One bit for each of so many hashes that some point's cell has.
    taken: Vec<u64>,
    cell_m: f64,
}

impl<'p> Cells<'p> {
    /// Cells of this size, in metres, which is above 0.
    pub fn new(points: &'p [Vec3], cell_m: f64) -> Self {
        let count = points.len().next_power_of_two();
        let hash = |p: &Vec3| hash(cell(p.as_dvec3(), cell_m));
        let buckets = Buckets::new(count, |give| {
            points.iter().enumerate().for_each(|(index, p)| give(bucket(hash(p), count) as u32, index as u32));
        });
        let mut taken = vec![0; (BITS * count).div_ceil(64)];
        for p in points {
            let bit = bit(hash(p), count);
            taken[bit / 64] |= 1 << (bit % 64);
        }
        Self { points, buckets, taken, cell_m }
    }

    /// The cell that a place lies in.
    pub fn cell(&self, place: DVec3) -> [i64; 3] {
        cell(place, self.cell_m)
    }

    /// The points in a cell by their numbers, in order, and some of other cells: whoever asks measures how far they are.
    pub fn near(&self, of: [i64; 3]) -> impl Iterator<Item = (u32, Vec3)> {
        let (hash, count) = (hash(of), self.points.len().next_power_of_two());
        let bit = bit(hash, count);
        let is_taken = self.taken[bit / 64] >> (bit % 64) & 1 == 1;
        let all = if is_taken { self.buckets.bucket(bucket(hash, count)) } else { &[] };
        all.iter().map(|&index| (index, self.points[index as usize]))
    }
}

fn cell(place: DVec3, cell_m: f64) -> [i64; 3] {
    (place / cell_m).to_array().map(|x| x.floor() as i64)
}

fn hash(cell: [i64; 3]) -> u64 {
    mix(cell.map(|x| x as u64))
}

fn bucket(hash: u64, count: usize) -> usize {
    hash as usize & (count - 1)
}

/// By other digits of the hash than its bucket.
fn bit(hash: u64, count: usize) -> usize {
    hash.rotate_left(32) as usize & (BITS * count - 1)
}

/// Mixes three words well enough for their low bits to be an address.
#[inline]
pub(crate) fn mix([x, y, z]: [u64; 3]) -> u64 {
    let mut h = x.wrapping_mul(0x9E37_79B9_7F4A_7C15).rotate_left(29) ^ y;
    h = h.wrapping_mul(0xBF58_476D_1CE4_E5B9).rotate_left(31) ^ z;
    h = (h ^ (h >> 32)).wrapping_mul(0x94D0_49BB_1331_11EB);
    h ^ (h >> 29)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_point_is_in_its_cell() {
        let points: Vec<Vec3> = (0..500).map(|i| Vec3::new(i as f32 * 0.37 - 90.0, (i % 7) as f32, -3.0e6)).collect();
        let cells = Cells::new(&points, 0.5);
        for (index, p) in points.iter().enumerate() {
            let near: Vec<u32> = cells.near(cells.cell(p.as_dvec3())).map(|(index, _)| index).collect();
            assert!(near.contains(&(index as u32)) && near.is_sorted());
        }
        assert_eq!(Cells::new(&[], 1.0).near([0; 3]).count(), 0);
    }
}
