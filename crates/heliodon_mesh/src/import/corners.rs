//! Vertices that corners of triangles share only where all they say of it is the same.
//!
//! OBJ and MeshLab's PLY give texture coordinates and normals to the corners of faces. Vertex i of the result is position i of
//! the file with what its first corner said; a corner that says otherwise gets a vertex behind the file's own. Per position one
//! chain holds its variants: 12 bytes a vertex, no hashing.

/// A corner that names a vertex behind the file's own, before their number is known.
const EXTRA: u32 = 1 << 31;
const NONE: u32 = u32::MAX;
/// Keys are indices or float bits; as indices both are out of every file's reach, as floats both are NaN.
const UNSAID: [u32; 2] = [NONE - 1; 2];

/// More positions or more splits than this have no index.
pub(crate) const MOST: u32 = EXTRA - 1;

/// A position with more variants (a made-up file) gets double ones instead of a search that grows with the square.
const LONGEST_SEARCH: u32 = 64;

#[derive(Default)]
pub(crate) struct Corners {
    /// What the vertex of each position, then each split one, was said to be.
    own: Vec<Variant>,
    extra: Vec<Variant>,
    base_of_extra: Vec<u32>,
}

#[derive(Clone, Copy)]
struct Variant {
    key: [u32; 2],
    next: u32,
}

impl Corners {
    pub fn is_empty(&self) -> bool {
        self.own.is_empty()
    }

    /// The vertex for a corner at position `base` that says `key`; `None` beyond [`MOST`] splits.
    pub fn vertex(&mut self, base: u32, key: [u32; 2]) -> Option<u32> {
        let at = base as usize;
        if at >= self.own.len() {
            self.own.resize(at + 1, Variant { key: UNSAID, next: NONE });
        }
        let own = &mut self.own[at];
        if own.key == UNSAID {
            own.key = key;
        }
        if own.key == key {
            return Some(base);
        }
        let mut link = own.next;
        let mut searched = 0;
        while link != NONE && searched < LONGEST_SEARCH {
            searched += 1;
            let variant = self.extra[link as usize];
            if variant.key == key {
                return Some(EXTRA | link);
            }
            link = variant.next;
        }
        let new = u32::try_from(self.extra.len()).ok().filter(|&n| n < MOST)?;
        self.extra.push(Variant { key, next: own.next });
        own.next = new;
        self.base_of_extra.push(base);
        Some(EXTRA | new)
    }

    /// Turns what [`Corners::vertex`] answered into indices, now that there are `positions` positions.
    pub fn number(triangles: &mut [[u32; 3]], positions: u32) {
        for vertex in triangles.as_flattened_mut() {
            if *vertex & EXTRA != 0 {
                *vertex = (*vertex & !EXTRA) + positions;
            }
        }
    }

    /// The positions that split vertices repeat, in the order of their indices.
    pub fn extra_bases(&self) -> &[u32] {
        &self.base_of_extra
    }

    /// What was said of each vertex: of `positions` positions, then of the split ones; `None` where nothing was.
    pub fn keys(&self, positions: usize) -> impl Iterator<Item = Option<[u32; 2]>> + '_ {
        let own = (0..positions).map(|i| self.own.get(i).map(|v| v.key).filter(|key| *key != UNSAID));
        own.chain(self.extra.iter().map(|v| Some(v.key)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_that_agree_share_a_vertex_and_others_come_behind() {
        let mut corners = Corners::default();
        let mut triangles = vec![
            [(2, [5, 0]), (0, [1, 0]), (1, [1, 0])].map(|(base, key)| corners.vertex(base, key).unwrap()),
            [(2, [6, 0]), (0, [1, 0]), (2, [7, 0])].map(|(base, key)| corners.vertex(base, key).unwrap()),
            [(2, [7, 0]), (2, [5, 0]), (2, [6, 0])].map(|(base, key)| corners.vertex(base, key).unwrap()),
        ];
        Corners::number(&mut triangles, 4);
        assert_eq!(triangles, [[2, 0, 1], [4, 0, 5], [5, 2, 4]]);
        assert_eq!(corners.extra_bases(), [2, 2]);
        let keys: Vec<_> = corners.keys(4).collect();
        assert_eq!(keys, [Some([1, 0]), Some([1, 0]), Some([5, 0]), None, Some([6, 0]), Some([7, 0])]);
    }

    #[test]
    fn a_hub_of_many_variants_stays_quick() {
        let mut corners = Corners::default();
        let vertices: Vec<u32> = (0..200_000).map(|k| corners.vertex(0, [k, 0]).unwrap()).collect();
        assert_eq!(corners.extra_bases().len(), 199_999);
        assert_eq!(vertices[0], 0);
        assert!(corners.extra_bases().iter().all(|&base| base == 0));
    }
}
