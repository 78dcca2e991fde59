//! Edges without a neighbour, edges with too many, and the rims that open edges make.

use super::{CleanReport, Mark};
use heliodon_mesh::Mesh;
use heliodon_mesh::topology::{Edges, HalfEdge, UnionFind};

/// An edge without a neighbour: its places, and the triangle that has it, from which corner on as long as the triangle is not turned.
pub(super) struct Side {
    pub ends: [u32; 2],
    pub triangle: u32,
    pub corner: u8,
}

/// Edges without a neighbour.
pub(super) fn open(edges: &Edges) -> Vec<Side> {
    let mut open = Vec::new();
    edges.for_each(|ends, sides| {
        if sides.len() == 1 {
            open.extend(sides.map(|HalfEdge { triangle, corner, .. }| Side { ends, triangle, corner }));
        }
    });
    open
}

/// Marks the triangles at such edges, and measures the rims. Answers with the edges without a neighbour.
pub(super) fn mark(mesh: &Mesh, places: &[u32], edges: &Edges, report: &mut CleanReport) -> Vec<Side> {
    let mut open: Vec<Side> = Vec::new();
    edges.for_each(|[a, b], sides| {
        let count = sides.len();
        if count == 2 {
            return;
        }
        let ends = [a, b].map(|place| mesh.positions[place as usize]);
        let (found, says) =
            if count == 1 { (&mut report.open, Mark::Open) } else { (&mut report.non_manifold, Mark::NonManifold) };
        found.add(ends[0], ends[1]);
        for side in sides {
            if count == 1 {
                open.push(Side { ends: [a, b], triangle: side.triangle, corner: side.corner });
            }
            let mark = &mut report.marks[side.triangle as usize];
            *mark = says.min(*mark);
        }
    });
    let mut sets = UnionFind::new(places.len());
    for &Side { ends: [a, b], .. } in &open {
        sets.unite(a, b, false);
    }
    let mut lengths: Vec<(u32, f64)> = open
        .iter()
        .map(|&Side { ends: [a, b], .. }| {
            let ends = [a, b].map(|place| mesh.positions[place as usize].as_dvec3());
            (sets.find(a).0, ends[0].distance(ends[1]))
        })
        .collect();
    // stable, so that lengths are added in one order
    lengths.sort_by_key(|&(rim, _)| rim);
    let rims = lengths.chunk_by(|a, b| a.0 == b.0).map(|rim| rim.iter().map(|(_, length)| length).sum::<f64>());
    (report.rims, report.longest_rim_m) = rims.fold((0, 0.0), |(count, longest), rim| (count + 1, rim.max(longest)));
    open
}
