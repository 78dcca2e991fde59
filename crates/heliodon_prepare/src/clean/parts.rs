//! Pieces of a mesh that hang together, and bits of dust among them.

use super::{CleanReport, Mark};
use glam::Vec3;
use heliodon_mesh::Mesh;
use heliodon_mesh::topology::UnionFind;

/// The extent of a piece.
#[derive(Clone, Copy)]
struct Piece {
    low: Vec3,
    high: Vec3,
    used: bool,
}

impl Piece {
    fn diagonal_squared(&self) -> f64 {
        self.high.as_dvec3().distance_squared(self.low.as_dvec3())
    }
}

/// Marks the triangles of pieces whose bounding boxes have a diagonal below `isolated_m`, all but the largest piece's, and counts the pieces.
pub(super) fn mark_isolated(mesh: &Mesh, places: &[u32], isolated_m: f32, report: &mut CleanReport) {
    let mut sets = UnionFind::new(mesh.positions.len());
    let kept = |marks: &[Mark], t: usize| !marks[t].is_removed();
    for (t, triangle) in mesh.triangles.iter().enumerate().filter(|(t, _)| kept(&report.marks, *t)) {
        let [a, b, c] = triangle.map(|vertex| places[vertex as usize]);
        debug_assert!(a != b && b != c, "triangle {t} has three places");
        sets.unite(a, b, false);
        sets.unite(b, c, false);
    }
    let (numbers, count) = sets.into_numbers();
    let piece_of = |t: usize| numbers[places[mesh.triangles[t][0] as usize] as usize] as usize >> 1;
    let mut pieces = vec![Piece { low: Vec3::INFINITY, high: Vec3::NEG_INFINITY, used: false }; count as usize];
    for t in (0..mesh.triangles.len()).filter(|&t| kept(&report.marks, t)) {
        let piece = &mut pieces[piece_of(t)];
        piece.used = true;
        for p in mesh.corners(t) {
            (piece.low, piece.high) = (piece.low.min(p), piece.high.max(p));
        }
    }
    let used = || pieces.iter().enumerate().filter(|(_, piece)| piece.used);
    let largest = used().fold((0, -1.0), |(best, size), (index, piece)| {
        let diagonal = piece.diagonal_squared();
        if diagonal > size { (index, diagonal) } else { (best, size) }
    });
    let limit = f64::from(isolated_m) * f64::from(isolated_m);
    let goes = |index: usize| index != largest.0 && pieces[index].diagonal_squared() < limit;
    report.isolated_bits = used().filter(|&(index, _)| goes(index)).count() as u64;
    report.pieces = used().count() as u64 - report.isolated_bits;
    if report.isolated_bits > 0 {
        for t in 0..mesh.triangles.len() {
            if kept(&report.marks, t) && goes(piece_of(t)) {
                report.marks[t] = Mark::Isolated;
                report.isolated.add(mesh, t);
            }
        }
    }
}
