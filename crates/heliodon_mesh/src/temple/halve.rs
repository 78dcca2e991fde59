//! Halves edges of triangles for both of their sides, so that no crack opens (Rivara, "Algorithms for refining triangular
//! grids suitable for adaptive and multigrid techniques", 1984).

use glam::Vec3;
use std::collections::HashMap;

/// An edge by its ends, the same from both sides.
pub fn edge(a: u32, b: u32) -> (u32, u32) {
    (a.min(b), a.max(b))
}

/// Edges to halve, each with the vertex in its middle.
#[derive(Debug)]
pub struct Halving {
    middles: HashMap<(u32, u32), u32>,
    /// In the order of their middles.
    edges: Vec<(u32, u32)>,
    /// The first middle's index.
    first: u32,
}

impl Halving {
    /// Of a mesh of `vertices`; middles are numbered from there on.
    pub fn new(vertices: usize) -> Self {
        Self { middles: HashMap::new(), edges: Vec::new(), first: vertices as u32 }
    }

    /// Asks for an edge to be halved.
    pub fn mark(&mut self, edge: (u32, u32)) {
        self.middles.entry(edge).or_insert_with(|| {
            self.edges.push(edge);
            self.first + self.edges.len() as u32 - 1
        });
    }

    /// The edges, each once, in the order of their middles.
    pub fn edges(&self) -> &[(u32, u32)] {
        &self.edges
    }

    /// Cuts the triangles; `positions` end with the middles. Answers which triangles are new.
    pub fn cut(&self, positions: &[Vec3], triangles: &mut Vec<[u32; 3]>) -> Vec<u32> {
        let mut touched = vec![false; self.first as usize];
        for &(a, b) in &self.edges {
            (touched[a as usize], touched[b as usize]) = (true, true);
        }
        let mut fresh = Vec::new();
        let mut all = Vec::with_capacity(triangles.len() + 2 * self.edges.len());
        for t in std::mem::take(triangles) {
            let middle: [Option<u32>; 3] = std::array::from_fn(|k| {
                let (a, b) = edge(t[k], t[(k + 1) % 3]);
                (touched[a as usize] && touched[b as usize]).then(|| self.middles.get(&(a, b)).copied()).flatten()
            });
            let before = all.len();
            split(t, middle, positions, &mut all);
            if all.len() > before + 1 {
                fresh.extend(before as u32..all.len() as u32);
            }
        }
        *triangles = all;
        fresh
    }
}

/// The one to four triangles of a triangle some of whose edges have a middle vertex; edge k runs from corner k to the next.
fn split(t: [u32; 3], middle: [Option<u32>; 3], positions: &[Vec3], triangles: &mut Vec<[u32; 3]>) {
    let marked = middle.iter().flatten().count();
    // turned so that the odd edge, marked or not, is the first
    let first = match marked {
        1 => middle.iter().position(Option::is_some),
        2 => middle.iter().position(Option::is_none),
        _ => Some(0),
    }
    .unwrap_or(0);
    let [a, b, c] = [0, 1, 2].map(|k| t[(first + k) % 3]);
    let [m, n, o] = [0, 1, 2].map(|k| middle[(first + k) % 3]);
    match (m, n, o) {
        (Some(m), None, None) => triangles.extend([[a, m, c], [m, b, c]]),
        (None, Some(n), Some(o)) => {
            triangles.push([n, c, o]);
            // the shorter diagonal of the rest
            let length = |i: u32, j: u32| (positions[i as usize] - positions[j as usize]).length_squared();
            if length(a, n) <= length(b, o) {
                triangles.extend([[a, b, n], [a, n, o]]);
            } else {
                triangles.extend([[a, b, o], [b, n, o]]);
            }
        }
        (Some(m), Some(n), Some(o)) => triangles.extend([[a, m, o], [m, b, n], [o, n, c], [m, n, o]]),
        _ => triangles.push(t),
    }
}
