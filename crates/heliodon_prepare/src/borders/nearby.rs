//! The nearest of many places, and whether there is any at all.

use crate::topology::Cells;
use glam::Vec3;
use heliodon_mesh::Mesh;
use rayon::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering};

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
/// So many cells are marked at most, some of them often. Where triangles cross more, all are.
const MOST_MARKED: u64 = 1 << 29;

/// Where things lie, roughly: most of what is asked for lies nowhere near one, and is told so at once. What is looked for in [`Nearby`] is chosen by it, and what is asked there.
pub(super) struct Around {
    low: Vec3,
    per_m: Vec3,
    cells: Vec<AtomicU64>,
}

impl Around {
    /// Within a reach of any of the places that have it.
    pub fn places(all: &[(f32, &[Vec3])]) -> Self {
        let empty = || (Vec3::INFINITY, Vec3::NEG_INFINITY);
        let join = |(l, h): (Vec3, Vec3), (low, high): (Vec3, Vec3)| (l.min(low), h.max(high));
        let of = |&(reach_m, places): &(f32, &[Vec3])| {
            places.par_iter().map(move |&p| (p - reach_m, p + reach_m)).reduce(empty, join)
        };
        let bounds = all.iter().map(of).fold(empty(), join);
        // no place marks more than eight cells
        let widest = all.iter().fold(f32::MIN_POSITIVE, |widest, &(reach_m, _)| widest.max(2.0 * reach_m));
        let around = Self::nothing(bounds, widest);
        for &(reach_m, places) in all {
            places.par_iter().for_each(|&p| around.mark(around.between(p - reach_m, p + reach_m)));
        }
        around
    }

    /// Within a reach of the box of any triangle, as far as it lies between `low` and `high`.
    pub fn triangles(mesh: &Mesh, (low, high): (Vec3, Vec3), reach_m: f32) -> Self {
        let around = Self::nothing((low, high), f32::MIN_POSITIVE);
        let crossed = |triangle: &[u32; 3]| {
            let [a, b, c] = triangle.map(|vertex| mesh.positions[vertex as usize]);
            let (from, to) = (a.min(b).min(c) - reach_m, a.max(b).max(c) + reach_m);
            (from.cmple(high).all() && to.cmpge(low).all()).then(|| around.between(from, to))
        };
        let count = |[from, to]: [[usize; 3]; 2]| (0..3).map(|axis| (to[axis] - from[axis] + 1) as u64).product::<u64>();
        if mesh.triangles.par_iter().filter_map(crossed).map(count).sum::<u64>() > MOST_MARKED {
            around.cells.par_iter().for_each(|cells| cells.store(u64::MAX, Ordering::Relaxed));
        } else {
            mesh.triangles.par_iter().filter_map(crossed).for_each(|cells| around.mark(cells));
        }
        around
    }

    /// Cells between these bounds, no narrower than `least_m`.
    fn nothing((low, high): (Vec3, Vec3), least_m: f32) -> Self {
        let per_m = (SIDE as f32 / (high - low).max(Vec3::splat(f32::MIN_POSITIVE))).min(Vec3::splat(1.0 / least_m));
        let cells = std::iter::repeat_with(AtomicU64::default).take(SIDE.pow(3) / 64).collect();
        Self { low, per_m, cells }
    }

    /// Whether something may be at a place.
    pub fn may_hold(&self, p: Vec3) -> bool {
        let index = index(self.cell(p));
        self.cells[index / 64].load(Ordering::Relaxed) >> (index % 64) & 1 == 1
    }

    fn mark(&self, [[x, y, z], [to_x, to_y, to_z]]: [[usize; 3]; 2]) {
        for index in (x..=to_x).flat_map(|x| (y..=to_y).flat_map(move |y| (z..=to_z).map(move |z| index([x, y, z])))) {
            let (cells, bit) = (&self.cells[index / 64], 1 << (index % 64));
            // to look is cheaper than to write where others write
            if cells.load(Ordering::Relaxed) & bit == 0 {
                cells.fetch_or(bit, Ordering::Relaxed);
            }
        }
    }

    /// The first and the last cell between two places: rounding keeps an order, so whatever is between them is in one of these.
    fn between(&self, from: Vec3, to: Vec3) -> [[usize; 3]; 2] {
        [self.cell(from), self.cell(to)]
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
            let around = Around::places(&[(reach, &places)]);
            for &p in &places {
                let aside = [Vec3::ZERO, Vec3::X, -Vec3::Z, Vec3::splat(0.577)];
                assert!(aside.into_iter().all(|aside| around.may_hold(p + 0.999 * reach * aside)));
            }
            let held = (0..2000).filter(|_| around.may_hold(point())).count();
            assert!(held < 40, "{held}");
        }
        assert!(!Around::places(&[]).may_hold(Vec3::ONE));
    }

    #[test]
    fn what_triangles_are_near_may_be_held_and_little_else() {
        let mut random = Pcg32::new(12, 5);
        let mut point = |most: f32| Vec3::from_array([0; 3].map(|_| random.range_f32(-most, most)));
        let positions: Vec<Vec3> = (0..60)
            .map(|_| point(40.0))
            .flat_map(|p| [p, p + Vec3::new(2.0, 0.1, 0.0), p + Vec3::new(0.0, 0.3, 1.0)])
            .collect();
        let triangles = (0..60).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        let mesh = Mesh { positions, triangles, ..Mesh::default() };
        let bounds = (Vec3::splat(-50.0), Vec3::splat(30.0));
        let around = Around::triangles(&mesh, bounds, 0.1);
        for corners in mesh.positions.chunks_exact(3) {
            let middle = 0.5 * (corners[1] + corners[2]) + Vec3::Y * 0.09;
            let is_between = middle.cmpge(bounds.0).all() && middle.cmple(bounds.1).all();
            assert!(!is_between || around.may_hold(middle));
        }
        let held = (0..2000).filter(|_| around.may_hold(point(29.0))).count();
        assert!(held < 40, "{held}");
        // triangles as large as all of it, and many
        let positions = vec![bounds.0, bounds.1, Vec3::ZERO];
        let all = Mesh { positions, triangles: vec![[0, 1, 2]; 33], ..Mesh::default() };
        let around = Around::triangles(&all, bounds, 0.0);
        assert!((0..100).all(|_| around.may_hold(point(29.0))));
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
