//! T-junctions: vertices on the inside of an edge without a neighbour. The two sides of such an edge agree by rounding at best, and light of one's
//! vertex does not reach the other's triangle.
//!
//! Only open edges and their ends count, which are few of a scan: with both in a grid of cells, each edge asks those that it runs through.

use super::rims::Side;
use super::{CleanReport, Mark};
use crate::topology::Cells;
use glam::{DVec3, Vec3};
use heliodon_mesh::Mesh;
use rayon::prelude::*;

/// A vertex in the middle of an edge is rounded by half of 1.2e-7 of its coordinates, and lies off the edge by up to twice of that: within this part of
/// the largest coordinate it lies on it.
const ROUNDING: f64 = 2.5e-7;
/// Cells are no smaller than this part of an edge in the mean, so that long ones do not run through too many.
const LEAST_CELL: f64 = 1.0 / 256.0;
/// And no smaller than so many times how far a vertex may be off an edge.
const REACHES: f64 = 4.0;

/// Counts and places them, and marks the triangles whose edges they are on. Vertices within `weld_m` of an edge are on it.
pub(super) fn mark(mesh: &Mesh, open: &[Side], weld_m: f32, report: &mut CleanReport) {
    let mut rim: Vec<u32> = open.iter().flat_map(|side| side.ends).collect();
    rim.par_sort_unstable();
    rim.dedup();
    let points: Vec<Vec3> = rim.iter().map(|&place| mesh.positions[place as usize]).collect();
    let line = |side: &Side| Line::new(side.ends.map(|place| mesh.positions[place as usize]), weld_m);
    let Some(cell_m) = cell_m(open.iter().map(line)) else { return };
    let cells = Cells::new(&points, cell_m);
    let on = |side: &Side| {
        let (line, mut found) = (line(side), Vec::new());
        let corners = mesh.triangles[side.triangle as usize].map(|v| mesh.positions[v as usize]);
        line.visit(cell_m, |cell| {
            for (index, p) in cells.near(cell) {
                if !corners.contains(&p) && line.holds(p) {
                    found.push((rim[index as usize], side.triangle));
                }
            }
        });
        found
    };
    let mut found: Vec<(u32, u32)> = open.par_iter().flat_map_iter(on).collect();
    found.par_sort_unstable();
    for &(_, triangle) in &found {
        let mark = &mut report.marks[triangle as usize];
        *mark = Mark::TJunction.min(*mark);
    }
    found.dedup_by_key(|&mut (place, _)| place);
    report.t_junctions.vertices = found.len() as u64;
    report.t_junctions.first = found.first().map(|&(place, _)| mesh.positions[place as usize].to_array());
}

/// The size of cells that suits these edges: between few vertices in each and few cells along each, their mean by powers of two.
fn cell_m(lines: impl Iterator<Item = Line>) -> Option<f64> {
    let (mut count, mut exponents, mut length_m, mut reach_m) = (0_i64, 0, 0.0, 0.0_f64);
    for line in lines {
        let length = line.along.length();
        count += 1;
        exponents += (length.to_bits() >> 52 & 0x7FF) as i64 - 1023;
        length_m += length;
        reach_m = reach_m.max(line.reach_m);
    }
    let mean_exponent = exponents.checked_div(count)?;
    let even = f64::from_bits(((mean_exponent + 1023).clamp(1, 2046) as u64) << 52);
    let cell_m = even.max(LEAST_CELL * length_m / count as f64).max(REACHES * reach_m);
    cell_m.is_finite().then_some(cell_m)
}

/// An edge.
struct Line {
    begin: DVec3,
    along: DVec3,
    /// What is within this of it lies on it.
    reach_m: f64,
}

impl Line {
    fn new(ends: [Vec3; 2], weld_m: f32) -> Self {
        let largest = ends.iter().map(|p| p.abs().max_element()).fold(0.0, f32::max);
        let [begin, end] = ends.map(Vec3::as_dvec3);
        Self { begin, along: end - begin, reach_m: f64::from(weld_m).max(ROUNDING * f64::from(largest)) }
    }

    /// Whether a place lies on it, and at neither of its ends.
    fn holds(&self, p: Vec3) -> bool {
        let off = p.as_dvec3() - self.begin;
        let share = off.dot(self.along) / self.along.length_squared();
        let is_near = |at: DVec3| off.distance_squared(at) <= self.reach_m * self.reach_m;
        // what is not finite fails the comparison
        share > 0.0 && share < 1.0 && is_near(self.along * share) && !is_near(DVec3::ZERO) && !is_near(self.along)
    }

    /// Names all cells of which some place is within reach, slab after slab along the axis that it runs along most.
    fn visit(&self, cell_m: f64, mut visit: impl FnMut([i64; 3])) {
        let Self { begin, along, reach_m } = self;
        let axis = along.abs().max_position();
        let number = |x: f64| (x / cell_m).floor() as i64;
        let reach = |a: f64, b: f64| number(a.min(b) - reach_m)..=number(a.max(b) + reach_m);
        for slab in reach(begin[axis], begin[axis] + along[axis]) {
            let share = |x: f64| ((x - begin[axis]) / along[axis]).clamp(0.0, 1.0);
            let (low, high) = (slab as f64 * cell_m - reach_m, (slab + 1) as f64 * cell_m + reach_m);
            let [p, q] = [low, high].map(|x| *begin + *along * share(x));
            let [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
            for across in reach(p[u], q[u]) {
                for up in reach(p[v], q[v]) {
                    let mut cell = [slab; 3];
                    (cell[u], cell[v]) = (across, up);
                    visit(cell);
                }
            }
        }
    }
}
