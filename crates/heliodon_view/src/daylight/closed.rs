//! Which stone is a body rather than a surface: nobody outside of it sees its backs, so they need not be drawn.
//!
//! Triangles that share corners make a component. It is closed where every edge is passed as often one way as the other, and
//! the right side is out where its volume is positive. Edges are not listed but summed: an edge adds a hash of its ends one way
//! and takes it off the other way, so that a sum of zero means a closed component but for one chance in 2^64. Whatever is in
//! doubt (a hole, a crack, a body turned inside out, a hollow inside one) counts as open and is drawn from both sides.

use super::chunk::KeptChunk;
use glam::Vec3;
use std::collections::HashMap;

/// Finds out, while chunks come in, which of them are parts of closed bodies only.
#[derive(Default)]
pub struct ClosedBodies {
    corners: HashMap<[u32; 3], u32>,
    parents: Vec<u32>,
    edge_sums: Vec<u64>,
    volumes: Vec<f64>,
    /// The corners of each chunk's vertices.
    chunks: Vec<Vec<u32>>,
}

/// What hangs together by its corners.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Bodies {
    /// Of each chunk, the body of each vertex.
    pub of_vertex: Vec<Vec<u32>>,
    /// Of each body, whether it is closed and outside out.
    pub closed: Vec<bool>,
}

impl Bodies {
    /// Of each chunk, in their order, whether all of it belongs to closed bodies.
    #[must_use]
    pub fn closed_chunks(&self) -> Vec<bool> {
        let all_closed = |bodies: &Vec<u32>| bodies.iter().all(|&body| self.closed[body as usize]);
        self.of_vertex.iter().map(all_closed).collect()
    }
}

impl ClosedBodies {
    /// Takes the next chunk.
    pub fn push(&mut self, chunk: &KeptChunk) {
        let corners: Vec<u32> = chunk.positions.iter().map(|&position| self.corner(position)).collect();
        for triangle in chunk.indices.chunks_exact(3) {
            let [a, b, c] = [0, 1, 2].map(|k| usize::from(triangle[k]));
            let [p, q, r] = [a, b, c].map(|v| chunk.positions[v].as_dvec3());
            let ids = [a, b, c].map(|v| corners[v]);
            let sum = edge(ids[0], ids[1]).wrapping_add(edge(ids[1], ids[2])).wrapping_add(edge(ids[2], ids[0]));
            let slot = ids[0] as usize;
            self.edge_sums[slot] = self.edge_sums[slot].wrapping_add(sum);
            self.volumes[slot] += p.dot(q.cross(r)) / 6.0;
            self.join(ids[0], ids[1]);
            self.join(ids[0], ids[2]);
        }
        self.chunks.push(corners);
    }

    /// The bodies of all chunks.
    #[must_use]
    pub fn finish(mut self) -> Bodies {
        // Only their places are asked for from here on.
        self.corners = HashMap::new();
        let mut totals = vec![(0u64, 0.0f64); self.parents.len()];
        for corner in 0..self.parents.len() {
            let total = &mut totals[self.root(corner as u32) as usize];
            *total = (total.0.wrapping_add(self.edge_sums[corner]), total.1 + self.volumes[corner]);
        }
        // Numbers without gaps, in the order of their first corners.
        let mut numbers = vec![u32::MAX; self.parents.len()];
        let mut closed = Vec::new();
        for corner in 0..self.parents.len() {
            let root = self.root(corner as u32) as usize;
            if numbers[root] == u32::MAX {
                numbers[root] = closed.len() as u32;
                closed.push(matches!(totals[root], (0, volume) if volume > 0.0));
            }
        }
        let mut of_vertex = std::mem::take(&mut self.chunks);
        of_vertex.iter_mut().flatten().for_each(|corner| *corner = numbers[self.root(*corner) as usize]);
        Bodies { of_vertex, closed }
    }

    fn corner(&mut self, position: Vec3) -> u32 {
        // Adding zero makes one of the two zeros.
        let bits = (position + Vec3::ZERO).to_array().map(f32::to_bits);
        let next = self.parents.len() as u32;
        *self.corners.entry(bits).or_insert_with(|| {
            self.parents.push(next);
            self.edge_sums.push(0);
            self.volumes.push(0.0);
            next
        })
    }

    fn root(&mut self, mut corner: u32) -> u32 {
        while self.parents[corner as usize] != corner {
            let above = self.parents[self.parents[corner as usize] as usize];
            self.parents[corner as usize] = above;
            corner = above;
        }
        corner
    }

    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        let (low, high) = (a.min(b), a.max(b));
        self.parents[high as usize] = low;
    }
}

/// What the directed edge adds; its reverse takes it off.
fn edge(from: u32, to: u32) -> u64 {
    if from == to {
        return 0;
    }
    let (low, high) = (from.min(to), from.max(to));
    // SplitMix64's finalizer (Steele, Lea, Flood: "Fast Splittable Pseudorandom Number Generators", 2014).
    let mut hash = (u64::from(low) << 32 | u64::from(high)).wrapping_add(0x9e37_79b9_7f4a_7c15);
    hash = (hash ^ hash >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    hash = (hash ^ hash >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    hash ^= hash >> 31;
    if from < to { hash } else { hash.wrapping_neg() }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Twelve triangles of a cube around `center`, with corners of their own; outside out.
    fn cube(center: Vec3) -> Vec<[Vec3; 3]> {
        let mut triangles = Vec::new();
        for axis in 0..3 {
            for side in [-1.0, 1.0] {
                let at = |u: f32, v: f32| {
                    let mut p = [0.0; 3];
                    (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) = (side, u * side, v);
                    center + Vec3::from(p)
                };
                let [a, b, c, d] = [at(-1.0, -1.0), at(1.0, -1.0), at(1.0, 1.0), at(-1.0, 1.0)];
                triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
        triangles
    }

    fn closed(chunks: &[Vec<[Vec3; 3]>]) -> Vec<bool> {
        let mut bodies = ClosedBodies::default();
        for triangles in chunks {
            bodies.push(&KeptChunk {
                positions: triangles.iter().flatten().copied().collect(),
                indices: (0..triangles.len() as u16 * 3).collect(),
                clusters: Vec::new(),
                bounds: (Vec3::ZERO, Vec3::ZERO),
                albedo: Vec::new(),
            });
        }
        bodies.finish().closed_chunks()
    }

    #[test]
    fn a_body_is_closed_over_chunks() {
        let whole = cube(Vec3::new(0.5, 7.0, -3.0));
        assert_eq!(closed(std::slice::from_ref(&whole)), [true]);
        assert_eq!(closed(&[whole[..5].to_vec(), whole[5..].to_vec()]), [true, true]);
    }

    #[test]
    fn a_hole_opens_all_chunks_of_its_body_and_no_other() {
        let (holed, whole) = (cube(Vec3::ZERO), cube(Vec3::X * 9.0));
        assert_eq!(closed(&[holed[..5].to_vec(), holed[5..11].to_vec(), whole]), [false, false, true]);
    }

    #[test]
    fn inside_out_is_open() {
        let turned: Vec<[Vec3; 3]> = cube(Vec3::ONE).into_iter().map(|[a, b, c]| [a, c, b]).collect();
        assert_eq!(closed(std::slice::from_ref(&turned)), [false]);
        assert_eq!(closed(&[[cube(Vec3::ONE * 9.0), turned].concat()]), [false]);
        // One triangle turned round.
        let mut one = cube(Vec3::ONE);
        one[3].swap(0, 1);
        assert_eq!(closed(&[one]), [false]);
    }
}
