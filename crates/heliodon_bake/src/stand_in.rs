//! A coarse form of a site's geometry that stands for what preparation will make of it, so that light can be timed before anything is prepared.

use crate::error::BakeError;
use crate::scene::Scene;
use glam::{IVec3, Vec3};
use heliodon_mesh::{Mesh, MeshError};
use heliodon_prepare::Views;
use std::collections::{HashMap, HashSet};

/// Parts of no more triangles are taken as they are.
const SMALL: usize = 20_000;
/// Vertices in a box of so many pixels, seen from the nearest room, become one; without rooms, of such a part of the part's own size.
const BOX_PX: f32 = 20.0;
const BOX_PART: f32 = 1.0 / 200.0;

/// Collects parts.
#[derive(Default)]
pub(crate) struct StandIn(Mesh);

impl StandIn {
    /// Adds a part: where eyes are near it stays fine.
    ///
    /// # Errors
    /// More vertices than an index counts.
    pub fn push(&mut self, part: &Mesh, views: &Views, nearest_m: f32) -> Result<(), BakeError> {
        let (low, high) = part.bounds().unwrap_or_default();
        let box_m = |p: Vec3| match views.cells.is_empty() {
            true => BOX_PART * low.distance(high),
            false => BOX_PX * views.pixel_m(p, nearest_m),
        };
        let fine = part.triangles.len() <= SMALL;
        let mut first: HashMap<(i32, IVec3), u32> = HashMap::new();
        let mut vertex = vec![0; part.positions.len()];
        for (v, &p) in part.positions.iter().enumerate() {
            // boxes of like sizes lie on one lattice
            let level = box_m(p).max(f32::MIN_POSITIVE).log2().ceil() as i32;
            let key = (level, (p / (level as f32).exp2()).floor().as_ivec3());
            let next = self.0.positions.len() as u32;
            vertex[v] = if fine { next } else { *first.entry(key).or_insert(next) };
            if vertex[v] == next {
                self.0.positions.push(p);
                self.0.normals.push(part.normals.get(v).copied().unwrap_or(Vec3::Y));
            }
        }
        if u32::try_from(self.0.positions.len()).is_err() {
            return Err(MeshError::TooMany("vertices").into());
        }
        let mut known = HashSet::new();
        for triangle in &part.triangles {
            let [a, b, c] = triangle.map(|v| vertex[v as usize]);
            let mut sorted = [a, b, c];
            sorted.sort_unstable();
            if a != b && b != c && c != a && (fine || known.insert(sorted)) {
                self.0.triangles.push([a, b, c]);
            }
        }
        Ok(())
    }

    /// All that was collected.
    pub fn finish(self) -> Scene {
        Scene { mesh: self.0, parts: Vec::new(), warnings: Vec::new(), original: None, prepared: None }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use heliodon_prepare::{Screen, ViewCell};

    #[test]
    fn what_is_far_is_coarse_and_covers_as_much() {
        let side = 200;
        let at = |i: u32| Vec3::new((i % (side + 1)) as f32 * 0.5, 0.0, (i / (side + 1)) as f32 * 0.5);
        let corner = |i: u32, j: u32| j * (side + 1) + i;
        let quad = |i: u32, j: u32| {
            let [a, b, c, d] = [corner(i, j), corner(i, j + 1), corner(i + 1, j + 1), corner(i + 1, j)];
            [[a, b, c], [a, c, d]]
        };
        let part = Mesh {
            positions: (0..(side + 1) * (side + 1)).map(at).collect(),
            triangles: (0..side).flat_map(|i| (0..side).flat_map(move |j| quad(i, j))).collect(),
            ..Mesh::default()
        };
        let cell = ViewCell { low: Vec3::new(-1.0, 1.0, -1.0), high: Vec3::new(0.0, 2.0, 0.0), windows: Vec::new() };
        let views = Views { cells: vec![cell], screen: Screen { width_px: 400, height_px: 300, fov_rad: 1.0 } };
        let mut stand_in = StandIn::default();
        stand_in.push(&part, &views, 1.0).unwrap();
        let mesh = stand_in.finish().mesh;
        mesh.validate().unwrap();
        assert!(mesh.triangles.len() < part.triangles.len() / 3 && mesh.triangles.len() > 500, "{}", mesh.triangles.len());
        let near = mesh.positions.iter().filter(|p| p.max_element() < 10.0).count();
        let far = mesh.positions.iter().filter(|p| p.x.min(p.z) > 90.0).count();
        assert!(near > 4 * far && far > 0, "{near} {far}");
        let area = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| mesh.positions[v as usize]);
            f64::from((b - a).cross(c - a).length()) * 0.5
        };
        let covered: f64 = mesh.triangles.iter().map(area).sum();
        assert!((8_000.0..11_000.0).contains(&covered), "{covered}");
        let mut small = StandIn::default();
        small.push(&part.with_triangles(&[0, 1]).0, &views, 1.0).unwrap();
        assert_eq!(small.finish().mesh.triangles.len(), 2);
    }
}
