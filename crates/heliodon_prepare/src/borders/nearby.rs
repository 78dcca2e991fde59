//! The nearest of many places, and whether there is any at all.

use crate::topology::Cells;
use glam::Vec3;

/// Where only the same place counts, cells are this part of the largest coordinate, which is some 16 times what f32 rounds: few places share one.
const EXACT_CELL: f64 = 1.0e-6;
/// Cells are so many times as wide as the reach: two of them lie within reach of a place in the mean, where 27 of its own size would.
const REACHES: f64 = 8.0;

/// Places that are asked for the nearest within a reach.
pub(super) struct Nearby<'p> {
    cells: Cells<'p>,
    reach_m: f64,
}

impl<'p> Nearby<'p> {
    /// With a reach of 0 only the very place is found.
    pub fn new(places: &'p [Vec3], reach_m: f32) -> Self {
        let finite = places.iter().map(|p| p.abs().max_element()).filter(|largest| largest.is_finite());
        let largest = finite.fold(0.0, f32::max);
        let reach_m = f64::from(reach_m.max(0.0));
        let cell_m = (REACHES * reach_m).max(EXACT_CELL * f64::from(largest)).max(f64::from(f32::MIN_POSITIVE));
        Self { cells: Cells::new(places, cell_m), reach_m }
    }

    /// The number of the nearest place, the first of several, and how far it is, squared.
    pub fn nearest(&self, p: Vec3) -> Option<(u32, f64)> {
        let of = |cell: [i64; 3]| {
            let all = self.cells.near(cell).map(|(index, place)| (index, place.as_dvec3().distance_squared(p.as_dvec3())));
            let within = all.filter(|&(_, squared)| squared <= self.reach_m * self.reach_m);
            within.min_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)))
        };
        let at = |sign: f64| self.cells.cell(p.as_dvec3() + sign * self.reach_m);
        let ([x, y, z], [to_x, to_y, to_z]) = (at(-1.0), at(1.0));
        let around = (x..=to_x).flat_map(|x| (y..=to_y).flat_map(move |y| (z..=to_z).map(move |z| [x, y, z])));
        around.filter_map(of).min_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)))
    }
}

/// Cells along a side of [`Around`]: two megabytes.
const SIDE: usize = 256;

/// Where places lie, roughly: most of what is asked for lies nowhere near one, and is told so at once: a third of the time of comparing borders.
pub(super) struct Around {
    low: Vec3,
    per_m: Vec3,
    cells: Vec<u64>,
}

impl Around {
    /// Within a reach of any of these places.
    pub fn new(places: impl Iterator<Item = (Vec3, f32)> + Clone) -> Self {
        let (low, high) = places
            .clone()
            .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(l, h), (p, reach)| (l.min(p - reach), h.max(p + reach)));
        // no place marks more than eight cells
        let widest = places.clone().fold(f32::MIN_POSITIVE, |widest, (_, reach)| widest.max(2.0 * reach));
        let per_m = (SIDE as f32 / (high - low).max(Vec3::splat(f32::MIN_POSITIVE))).min(Vec3::splat(1.0 / widest));
        let mut around = Self { low, per_m, cells: vec![0; SIDE.pow(3) / 64] };
        for (p, reach) in places {
            // rounding keeps an order: whoever is within reach is in one of them
            let ([x, y, z], [to_x, to_y, to_z]) = (around.cell(p - reach), around.cell(p + reach));
            for index in (x..=to_x).flat_map(|x| (y..=to_y).flat_map(move |y| (z..=to_z).map(move |z| index([x, y, z])))) {
                around.cells[index / 64] |= 1 << (index % 64);
            }
        }
        around
    }

    /// Whether a place may be within reach of one.
    pub fn may_hold(&self, p: Vec3) -> bool {
        let index = index(self.cell(p));
        self.cells[index / 64] >> (index % 64) & 1 == 1
    }

    fn cell(&self, p: Vec3) -> [usize; 3] {
        ((p - self.low) * self.per_m).to_array().map(|at| (at as usize).min(SIDE - 1))
    }
}

fn index([x, y, z]: [usize; 3]) -> usize {
    (x * SIDE + y) * SIDE + z
}

#[cfg(test)]
mod tests {
    use super::*;
    use heliodon_math::random::Pcg32;

    #[test]
    fn what_is_within_reach_may_be_held_and_little_else() {
        let mut random = Pcg32::new(11, 5);
        let mut point = || Vec3::from_array([0; 3].map(|_| random.range_f32(-50.0, 50.0)));
        let places: Vec<Vec3> = (0..300).map(|_| point()).collect();
        for reach in [0.0, 1.0e-5, 0.5] {
            let around = Around::new(places.iter().map(|&p| (p, reach)));
            for &p in &places {
                let aside = [Vec3::ZERO, Vec3::X, -Vec3::Z, Vec3::splat(0.577)];
                assert!(aside.into_iter().all(|aside| around.may_hold(p + 0.999 * reach * aside)));
            }
            let held = (0..2000).filter(|_| around.may_hold(point())).count();
            assert!(held < 40, "{held}");
        }
        assert!(!Around::new(std::iter::empty()).may_hold(Vec3::ONE));
    }

    #[test]
    fn the_nearest_is_found_across_cells_and_none_beyond_the_reach() {
        let places = [Vec3::ZERO, Vec3::new(0.9, 0.0, 0.0), Vec3::new(-0.3, 0.0, 0.0), Vec3::new(0.9, 0.0, 0.0)];
        let nearby = Nearby::new(&places, 1.0);
        assert_eq!(nearby.nearest(Vec3::new(-0.2, 0.0, 0.0)).unwrap().0, 2);
        assert_eq!(nearby.nearest(Vec3::new(1.2, 0.1, -0.2)).unwrap().0, 1);
        assert_eq!(nearby.nearest(Vec3::new(2.0, 0.0, 0.0)), None);
        let exact = Nearby::new(&places, 0.0);
        assert_eq!(exact.nearest(Vec3::new(0.9, -0.0, 0.0)), Some((1, 0.0)));
        assert_eq!(exact.nearest(Vec3::new(0.9, 1.0e-7, 0.0)), None);
        assert_eq!(Nearby::new(&[], 0.0).nearest(Vec3::ZERO), None);
    }
}
