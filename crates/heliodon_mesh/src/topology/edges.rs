//! The edges of a mesh, each with the triangles at it.

use super::Buckets;

/// One side of a triangle, as it runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HalfEdge {
    /// Which triangle.
    pub triangle: u32,
    /// It begins at the triangle's corner 0, 1 or 2.
    pub corner: u8,
    /// Whether it runs from the place with the higher number to the lower.
    pub down: bool,
}

/// All edges of triangles by position, 8 bytes for each side of a triangle and 4 for each place.
pub struct Edges(Buckets<u64>);

impl Edges {
    /// The edges of those triangles that `kept` names; their corners must be at three different places.
    ///
    /// # Panics
    /// From 700 million triangles on.
    pub fn new(triangles: &[[u32; 3]], places: &[u32], kept: impl Fn(usize) -> bool) -> Self {
        assert!(triangles.len() < (1 << 31) / 3, "more triangles than half edges can name");
        Self(Buckets::new(places.len(), |give| {
            for (t, triangle) in triangles.iter().enumerate().filter(|(t, _)| kept(*t)) {
                let at = triangle.map(|vertex| places[vertex as usize]);
                for corner in 0..3 {
                    let (from, to) = (at[corner], at[(corner + 1) % 3]);
                    let name = ((t * 3 + corner) as u64) << 1 | u64::from(from > to);
                    give(from.min(to), u64::from(from.max(to)) << 32 | name);
                }
            }
        }))
    }

    /// Every edge: its places, the lower number first, and the half edges there in the order of their triangles.
    pub fn for_each(&self, mut visit: impl FnMut([u32; 2], &mut dyn ExactSizeIterator<Item = HalfEdge>)) {
        for (low, sides) in self.0.iter() {
            for edge in sides.chunk_by(|a, b| a >> 32 == b >> 32) {
                visit([low, (edge[0] >> 32) as u32], &mut edge.iter().map(|&side| half_edge(side)));
            }
        }
    }
}

fn half_edge(side: u64) -> HalfEdge {
    let name = side as u32;
    HalfEdge { triangle: (name >> 1) / 3, corner: ((name >> 1) % 3) as u8, down: name & 1 == 1 }
}
