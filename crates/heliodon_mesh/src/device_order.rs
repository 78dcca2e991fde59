//! Triangles and vertices in the order in which a device takes them best, by meshoptimizer.
//!
//! First for the cache of vertices; then, run by run of triangles, what faces away from the middle before the rest, so that less is drawn that something else covers afterwards;
//! vertices as they are used first. The same triangles at the same places give the same order.

use meshopt::VertexDataAdapter;

/// How much worse for the vertex cache an order against overdraw may be.
const OVERDRAW_THRESHOLD: f32 = 1.05;
const NOWHERE: u32 = u32::MAX;

/// Triangles in a device's order.
pub(crate) struct Ordered {
    /// Three corners each, as indices into `vertices`.
    pub corners: Vec<u32>,
    /// Which vertices they were before; those that no triangle uses are left out.
    pub vertices: Vec<u32>,
}

/// Orders triangles of three `corners` each, whose vertices are at `places`.
///
/// # Panics
/// When a corner names a vertex that does not exist.
pub(crate) fn ordered(corners: &[u32], places: &[[f32; 3]]) -> Ordered {
    let mut corners = meshopt::optimize_vertex_cache(corners, places.len());
    // it refuses other strides only
    if let Ok(adapter) = VertexDataAdapter::new(meshopt::typed_to_bytes(places), size_of::<[f32; 3]>(), 0) {
        meshopt::optimize_overdraw_in_place(&mut corners, &adapter, OVERDRAW_THRESHOLD);
    }
    let mut place = vec![NOWHERE; places.len()];
    let mut vertices = Vec::new();
    for corner in &mut corners {
        let place = &mut place[*corner as usize];
        if *place == NOWHERE {
            *place = vertices.len() as u32;
            vertices.push(*corner);
        }
        *corner = *place;
    }
    Ordered { corners, vertices }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIDE: u32 = 24;

    /// A sheet at a height, looking up, whose corners begin at `first`.
    fn sheet(height: f32, first: u32) -> (Vec<[f32; 3]>, Vec<u32>) {
        let places = (0..=SIDE).flat_map(|z| (0..=SIDE).map(move |x| [x as f32, height, z as f32])).collect();
        let row = SIDE + 1;
        let square = |a: u32| [a, a + row, a + 1, a + 1, a + row, a + row + 1];
        let corners = (0..SIDE).flat_map(|z| (0..SIDE).flat_map(move |x| square(first + z * row + x)));
        (places, corners.collect())
    }

    /// Two sheets that look up, the lower one first.
    fn two_sheets() -> (Vec<[f32; 3]>, Vec<u32>) {
        let (mut places, mut corners) = sheet(0.0, 0);
        let (above, of_above) = sheet(5.0, places.len() as u32);
        places.extend(above);
        corners.extend(of_above);
        (places, corners)
    }

    #[test]
    fn what_covers_the_rest_comes_first_and_the_cache_hardly_suffers() {
        let (places, corners) = two_sheets();
        let of_cache = meshopt::optimize_vertex_cache(&corners, places.len());
        let Ordered { corners: ordered, vertices } = ordered(&corners, &places);
        let heights = |corners: &[u32], of: &dyn Fn(u32) -> usize| -> f32 {
            corners[..corners.len() / 4].iter().map(|&corner| places[of(corner)][1]).sum()
        };
        let first = heights(&ordered, &|corner| vertices[corner as usize] as usize);
        assert!(first > heights(&of_cache, &|corner| corner as usize), "the upper sheet covers the lower one");
        assert_eq!(first, 5.0 * (ordered.len() / 4) as f32);
        let misses =
            |corners: &[u32]| meshopt::analyze_vertex_cache(corners, places.len(), 16, 0, 0).vertices_transformed as f32;
        assert!(misses(&ordered) <= 1.06 * misses(&of_cache), "{} {}", misses(&ordered), misses(&of_cache));
    }

    #[test]
    fn triangles_stay_what_they_are_and_vertices_come_as_they_are_used() {
        let (mut places, mut corners) = two_sheets();
        places.push([7.0; 3]);
        let ordered = ordered(&corners, &places);
        assert_eq!(ordered.vertices.len() + 1, places.len(), "one is used by no triangle");
        let mut next = 0;
        for &corner in &ordered.corners {
            assert!(corner <= next);
            next = next.max(corner + 1);
        }
        let canonical = |corners: &mut [u32]| {
            let mut triangles: Vec<[u32; 3]> = corners.as_chunks::<3>().0.to_vec();
            triangles.iter_mut().for_each(|t| {
                let least = (0..3).min_by_key(|&i| t[i]).unwrap();
                t.rotate_left(least);
            });
            triangles.sort_unstable();
            triangles
        };
        let mut back: Vec<u32> = ordered.corners.iter().map(|&corner| ordered.vertices[corner as usize]).collect();
        assert_eq!(canonical(&mut back), canonical(&mut corners));
    }
}
