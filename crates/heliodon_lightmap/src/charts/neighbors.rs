//! Which triangles lie side by side on one surface.

use glam::Vec3;
use heliodon_mesh::topology::{Edges, HalfEdge, NOWHERE, places};

/// No triangle.
pub(super) const NOBODY: u32 = u32::MAX;

/// Tells of the edges at which two triangles meet that are wound alike, what runs along them of both. Left out are edges where more than two meet, and triangles
/// that are not `kept` or whose corners are not three places: one without area lies along an edge of others and would tie its ends to what is far from them.
pub(crate) fn for_each_pair(
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    kept: impl Fn(usize) -> bool,
    mut visit: impl FnMut(HalfEdge, HalfEdge),
) {
    let places = places(positions, 0.0);
    let has_places = |t: usize| {
        let [a, b, c] = triangles[t].map(|v| places[v as usize]);
        a != b && b != c && c != a && a != NOWHERE && b != NOWHERE && c != NOWHERE
    };
    Edges::new(triangles, &places, |t| kept(t) && has_places(t)).for_each(|_, sides| {
        if let (2, Some(a), Some(b)) = (sides.len(), sides.next(), sides.next())
            && a.down != b.down
            && a.triangle != b.triangle
        {
            visit(a, b);
        }
    });
}

/// For each side of each triangle the one beyond it, or [`NOBODY`] where it is open, where more than two meet, and where the one beyond is wound the
/// other way: light changes there anyway.
pub(super) fn neighbors(positions: &[Vec3], triangles: &[[u32; 3]], kept: impl Fn(usize) -> bool) -> Vec<[u32; 3]> {
    let mut found = vec![[NOBODY; 3]; triangles.len()];
    for_each_pair(positions, triangles, kept, |a, b| {
        found[a.triangle as usize][usize::from(a.corner)] = b.triangle;
        found[b.triangle as usize][usize::from(b.corner)] = a.triangle;
    });
    found
}
