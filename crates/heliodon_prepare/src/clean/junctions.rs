//! T-junctions: vertices on the inside of an edge without a neighbour. The two sides of such an edge agree by rounding at best, light of one's
//! vertex does not reach the other's triangle, and a body that is closed but for them is no solid.
//!
//! Only open edges and their ends count, which are few of a scan: with both in a grid of cells, each edge asks those that it runs through.

use super::faces::is_flat;
use super::rims::{self, Side};
use super::{CleanReport, Mark, VertexFinding, double_area};
use crate::topology::Cells;
use glam::{DVec3, Vec3};
use heliodon_math::frame::unit_or;
use heliodon_mesh::Mesh;
use heliodon_mesh::topology::Edges;
use rayon::prelude::*;
use std::collections::HashSet;

/// A vertex in the middle of an edge is rounded by half of 1.2e-7 of its coordinates, and lies off the edge by up to twice of that: within this part of
/// the largest coordinate it lies on it.
const ROUNDING: f64 = 2.5e-7;
/// Cells are no smaller than this part of an edge in the mean, so that long ones do not run through too many.
const LEAST_CELL: f64 = 1.0 / 256.0;
/// And no smaller than so many times how far a vertex may be off an edge.
const REACHES: f64 = 4.0;

/// Parting triangles can bring vertices to lie on further edges, where what is within the weld's reach is no straight line.
const ROUNDS: usize = 4;
/// As many are mended as there are triangles, and so many more.
const FREE_JUNCTIONS: usize = 1 << 20;
/// What edges can be asked of, with room.
const MOST_TRIANGLES: usize = 600_000_000;

/// A vertex on the inside of an edge: its place, and the triangle that has the edge, from which corner on.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Junction {
    place: u32,
    triangle: u32,
    corner: u8,
}

/// Counts and places them, and marks the triangles whose edges they are on. Vertices within `weld_m` of an edge are on it.
pub(super) fn mark(mesh: &Mesh, open: &[Side], weld_m: f32, report: &mut CleanReport) {
    let mut found = find(mesh, open, weld_m);
    for junction in &found {
        let mark = &mut report.marks[junction.triangle as usize];
        *mark = Mark::TJunction.min(*mark);
    }
    found.dedup_by_key(|junction| junction.place);
    report.t_junctions.vertices = found.len() as u64;
    report.t_junctions.first = found.first().map(|junction| mesh.positions[junction.place as usize].to_array());
}

/// Parts triangles at the vertices on their edges, so that both sides of an edge have the same; whether there were any. Vertices and triangles that this
/// makes come last, each vertex at the place of the one that it meets, with what the edge has there.
pub(super) fn mend(mesh: &mut Mesh, places: &mut Vec<u32>, weld_m: f32, report: &mut CleanReport) -> bool {
    let mut mended = Vec::new();
    // each makes a vertex and a triangle; edges that overlap on one line have as many as their number squared
    let mut left = mesh.triangles.len() + FREE_JUNCTIONS;
    for _ in 0..ROUNDS {
        let kept = |t: usize| !report.marks[t].is_removed();
        let open = rims::open(&Edges::new(&mesh.triangles, places, kept));
        let mut found = find(mesh, &open, weld_m);
        if found.len() > left || mesh.triangles.len() + found.len() > MOST_TRIANGLES {
            break;
        }
        left -= found.len();
        found.sort_unstable_by_key(|&Junction { place, triangle, corner }| (triangle, corner, place));
        let before = mended.len();
        for of_triangle in found.chunk_by(|a, b| a.triangle == b.triangle) {
            let parted = part_somewhere(mesh, places, of_triangle);
            if !parted.is_empty() {
                let mark = &mut report.marks[of_triangle[0].triangle as usize];
                *mark = Mark::TJunction.min(*mark);
                mended.extend(parted);
            }
        }
        report.marks.resize(mesh.triangles.len(), Mark::Kept);
        if mended.len() == before {
            break;
        }
    }
    mended.sort_unstable();
    mended.dedup();
    let first = mended.first().map(|&place| mesh.positions[place as usize].to_array());
    report.t_junctions_mended = VertexFinding { vertices: mended.len() as u64, first };
    !mended.is_empty()
}

/// Parts a triangle at all vertices on its edges or, where that would not do, at those of one edge; answers their places.
fn part_somewhere(mesh: &mut Mesh, places: &mut Vec<u32>, junctions: &[Junction]) -> Vec<u32> {
    // in a sharp corner a vertex may be within reach of both edges: it is taken for the first one's
    let mut met = HashSet::new();
    let once: Vec<Junction> = junctions.iter().filter(|junction| met.insert(junction.place)).copied().collect();
    let edges = once.chunk_by(|a, b| a.corner == b.corner);
    let mut tried = std::iter::once(&once[..]).chain(edges);
    tried.find_map(|junctions| part(mesh, places, junctions)).unwrap_or_default()
}

/// Parts a triangle at vertices on its edges, and answers their places; not at those that are too near a corner or one another for a part that is not flat,
/// nor at all where a part would face the other way.
fn part(mesh: &mut Mesh, places: &mut Vec<u32>, junctions: &[Junction]) -> Option<Vec<u32>> {
    let triangle = junctions[0].triangle as usize;
    let corners = mesh.triangles[triangle];
    let before = mesh.positions.len();
    let mut on_edges: [Vec<u32>; 3] = Default::default();
    for (corner, on_edge) in on_edges.iter_mut().enumerate() {
        let ends = [corner, (corner + 1) % 3].map(|corner| corners[corner] as usize);
        let [begin, end] = ends.map(|vertex| mesh.positions[vertex].as_dvec3());
        let share =
            |place: u32| (mesh.positions[place as usize].as_dvec3() - begin).dot(end - begin) / (end - begin).length_squared();
        let of_edge = junctions.iter().filter(|junction| usize::from(junction.corner) == corner);
        let mut shares: Vec<(f64, u32)> = of_edge.map(|junction| (share(junction.place), junction.place)).collect();
        shares.sort_by(|a, b| a.0.total_cmp(&b.0));
        let position = |vertex: u32| mesh.positions[vertex as usize];
        let [begin, end, opposite] = [0, 1, 2].map(|k| position(corners[(corner + k) % 3]));
        let mut last = begin;
        shares.retain(|&(_, place)| {
            let is_apart = !is_flat([last, position(place), opposite]);
            if is_apart {
                last = position(place);
            }
            is_apart
        });
        while shares.pop_if(|(_, place)| is_flat([position(*place), end, opposite])).is_some() {}
        for (share, place) in shares {
            on_edge.push(mesh.positions.len() as u32);
            push_between(mesh, ends, share as f32, place);
            places.push(place);
        }
    }
    let parted = places[before..].to_vec();
    let parts = parts(corners, on_edges);
    let facing = double_area(mesh, triangle);
    let is_good = |part: &[u32; 3]| {
        let corners = part.map(|vertex| mesh.positions[vertex as usize]);
        let [a, b, c] = corners.map(Vec3::as_dvec3);
        (b - a).cross(c - a).dot(facing) > 0.0 && !is_flat(corners)
    };
    if parted.is_empty() || !parts.iter().all(is_good) {
        mesh.positions.truncate(before);
        mesh.normals.truncate(before);
        mesh.uvs.truncate(before);
        mesh.colors_linear.truncate(before);
        places.truncate(before);
        return None;
    }
    mesh.triangles[triangle] = parts[0];
    mesh.triangles.extend_from_slice(&parts[1..]);
    if let Some(&material) = mesh.triangle_material.get(triangle) {
        mesh.triangle_material.extend(std::iter::repeat_n(material, parts.len() - 1));
    }
    Some(parted)
}

/// Appends a vertex at a place, with what lies between two vertices there.
fn push_between(mesh: &mut Mesh, [a, b]: [usize; 2], share: f32, place: u32) {
    mesh.positions.push(mesh.positions[place as usize]);
    if let Some((from, to)) = mesh.normals.get(a).zip(mesh.normals.get(b)) {
        mesh.normals.push(unit_or(from.lerp(*to, share), *from));
    }
    if let Some((from, to)) = mesh.uvs.get(a).zip(mesh.uvs.get(b)) {
        mesh.uvs.push(from.lerp(*to, share));
    }
    if let Some((from, to)) = mesh.colors_linear.get(a).zip(mesh.colors_linear.get(b)) {
        mesh.colors_linear.push(from.lerp(*to, share));
    }
}

/// The triangles of a triangle with vertices on its edges, from corner to corner in order: each edge is taken in turn, and what lies on it fans out from the
/// corner opposite, so that none has all its corners on one edge.
fn parts(corners: [u32; 3], on_edges: [Vec<u32>; 3]) -> Vec<[u32; 3]> {
    let mut parts = Vec::new();
    let mut left = vec![(corners, on_edges)];
    while let Some(([a, b, c], [ab, bc, ca])) = left.pop() {
        if ab.is_empty() {
            match (bc.is_empty(), ca.is_empty()) {
                (true, true) => parts.push([a, b, c]),
                (false, _) => left.push(([b, c, a], [bc, ca, ab])),
                (true, false) => left.push(([c, a, b], [ca, ab, bc])),
            }
            continue;
        }
        let rim: Vec<u32> = [a].into_iter().chain(ab).chain([b]).collect();
        let last = rim.len() - 2;
        let (mut bc, mut ca) = (Some(bc), Some(ca));
        for (k, ends) in rim.windows(2).enumerate() {
            let along = if k == last { bc.take() } else { None };
            let back = if k == 0 { ca.take() } else { None };
            left.push(([ends[0], ends[1], c], [Vec::new(), along.unwrap_or_default(), back.unwrap_or_default()]));
        }
    }
    parts
}

/// Vertices on the inside of edges without a neighbour, by their places.
fn find(mesh: &Mesh, open: &[Side], weld_m: f32) -> Vec<Junction> {
    let mut rim: Vec<u32> = open.iter().flat_map(|side| side.ends).collect();
    rim.par_sort_unstable();
    rim.dedup();
    let points: Vec<Vec3> = rim.iter().map(|&place| mesh.positions[place as usize]).collect();
    let line = |side: &Side| Line::new(side.ends.map(|place| mesh.positions[place as usize]), weld_m);
    let Some(cell_m) = cell_m(open.iter().map(line)) else { return Vec::new() };
    let cells = Cells::new(&points, cell_m);
    let on = |side: &Side| {
        let (line, mut found) = (line(side), Vec::new());
        let &Side { triangle, corner, .. } = side;
        let corners = mesh.triangles[triangle as usize].map(|v| mesh.positions[v as usize]);
        line.visit(cell_m, |cell| {
            for (index, p) in cells.near(cell) {
                if !corners.contains(&p) && line.holds(p) {
                    found.push(Junction { place: rim[index as usize], triangle, corner });
                }
            }
        });
        found
    };
    let mut found: Vec<Junction> = open.par_iter().flat_map_iter(on).collect();
    found.par_sort_unstable();
    found.dedup();
    found
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
