//! Finer triangles where light is stored at vertices: every edge that is too long is halved, on both of its sides alike.

use crate::Mesh;
use glam::Vec3;
use heliodon_math::frame::unit_or;
use std::collections::HashMap;

/// What an edge is halved at, once for each triangle's own vertices: vertices at creases stay doubled.
struct Halves<'a> {
    mesh: &'a mut Mesh,
    longest_squared: f32,
    middles: HashMap<(u32, u32), u32>,
}

impl Halves<'_> {
    /// The vertex in the middle of an edge that is too long. Whether it is depends on the two places only, so triangles that
    /// meet in an edge agree even where they share no vertices.
    fn middle(&mut self, a: u32, b: u32) -> Option<u32> {
        let [from, to] = [a, b].map(|i| self.mesh.positions[i as usize]);
        if from.distance_squared(to) <= self.longest_squared {
            return None;
        }
        let mesh = &mut *self.mesh;
        Some(*self.middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
            let mean = |values: &[Vec3]| (values[a as usize] + values[b as usize]) * 0.5;
            let (position, normal, color) = (mean(&mesh.positions), mean(&mesh.normals), mean(&mesh.colors_linear));
            let fallback = mesh.normals[a as usize];
            mesh.positions.push(position);
            mesh.normals.push(unit_or(normal, fallback));
            mesh.colors_linear.push(color);
            mesh.positions.len() as u32 - 1
        }))
    }
}

/// Halves edges until none is longer than `longest_m`. A mesh with normals and colours; what is closed stays closed.
pub fn split_edges(mesh: &mut Mesh, longest_m: f32) {
    loop {
        let before = std::mem::take(&mut mesh.triangles);
        let mut after = Vec::with_capacity(before.len());
        let mut halves = Halves { mesh, longest_squared: longest_m * longest_m, middles: HashMap::new() };
        for &[a, b, c] in &before {
            let middles = [halves.middle(a, b), halves.middle(b, c), halves.middle(c, a)];
            // a lone or a pair of halved edges is turned to the front, the rest is one case each
            let (corners, [ab, bc, ca]) = match middles {
                [None, Some(_), None] | [None, Some(_), Some(_)] => ([b, c, a], [middles[1], middles[2], middles[0]]),
                [None, None, Some(_)] | [Some(_), None, Some(_)] => ([c, a, b], [middles[2], middles[0], middles[1]]),
                _ => ([a, b, c], middles),
            };
            let [a, b, c] = corners;
            match (ab, bc, ca) {
                (Some(x), Some(y), Some(z)) => after.extend([[a, x, z], [x, b, y], [z, y, c], [x, y, z]]),
                (Some(x), Some(y), None) => after.extend([[x, b, y], [a, x, y], [a, y, c]]),
                (Some(x), None, _) => after.extend([[a, x, c], [x, b, c]]),
                _ => after.push([a, b, c]),
            }
        }
        let done = after.len() == before.len();
        mesh.triangles = after;
        if done {
            return;
        }
    }
}
