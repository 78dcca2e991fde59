//! The edges of the mesh itself, halved until none is too long, before any triangle is looked at: so both sides of each agree.

use super::halving::too_long;
use super::vertex::Vertex;
use glam::Vec3;
use heliodon_mesh::Mesh;
use rayon::prelude::*;

/// An edge's name, whichever way it runs.
pub(super) fn edge(a: u32, b: u32) -> u64 {
    u64::from(a.min(b)) << 32 | u64::from(a.max(b))
}

/// The vertices in the middle of the mesh's edges, of their halves, and so on.
pub(super) struct Middles(Vec<(u64, u32)>);

impl Middles {
    /// Halves the edges of some triangles and appends the middles to the mesh. None where there would be more vertices than `most`.
    pub fn append(
        mesh: &mut Mesh,
        triangles: &[u32],
        longest_m: &(impl Fn(Vec3, Vec3) -> f32 + Sync),
        most: usize,
    ) -> Option<Self> {
        let of_triangle = |&t: &u32| {
            let [a, b, c] = mesh.triangles[t as usize];
            [edge(a, b), edge(b, c), edge(c, a)]
        };
        let mut edges: Vec<u64> = triangles.par_iter().flat_map_iter(of_triangle).collect();
        edges.par_sort_unstable();
        edges.dedup();
        let mut middles = Vec::new();
        while !edges.is_empty() {
            let ends = |edge: u64| [(edge >> 32) as usize, edge as u32 as usize];
            edges = edges
                .into_par_iter()
                .filter(|&edge| {
                    let [p, q] = ends(edge).map(|v| mesh.positions[v]);
                    too_long(p, q, longest_m).is_some()
                })
                .collect();
            if mesh.positions.len() + edges.len() > most {
                return None;
            }
            let mut halves = Vec::with_capacity(edges.len() * 2);
            for &whole in &edges {
                let [a, b] = ends(whole);
                let middle = Vertex::of(mesh, a).middle(&Vertex::of(mesh, b)).push(mesh);
                middles.push((whole, middle));
                halves.extend([edge(a as u32, middle), edge(b as u32, middle)]);
            }
            edges = halves;
        }
        middles.par_sort_unstable();
        Some(Self(middles))
    }

    /// The vertex in the middle of an edge that was halved.
    pub fn get(&self, edge: u64) -> Option<u32> {
        self.0.binary_search_by_key(&edge, |&(edge, _)| edge).ok().map(|at| self.0[at].1)
    }
}
