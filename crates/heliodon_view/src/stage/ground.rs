//! Rays against the stage's triangles, a few a frame: for feet and shoulders.
//!
//! The clusters that culling keeps anyway are the hierarchy: a ray tests every chunk's box, then the clusters' spheres of those
//! that it meets, then some hundred triangles. That needs no memory beyond the clusters, where a ray hierarchy over 700,000
//! triangles would take some 40 MB, and microseconds are all that a few rays a frame may cost.

use crate::daylight::chunk::KeptChunk;
use glam::Vec3;
use heliodon_math::frame::unit_or;
use std::sync::Arc;

/// Where a ray meets the ground or a wall.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Touch {
    /// Distance along the unit direction.
    pub distance: f32,
    /// Unit normal of the triangle, on the ray's side.
    pub normal: Vec3,
}

/// The geometry of a stage.
#[derive(Clone, Debug, Default)]
pub struct Ground {
    chunks: Vec<Arc<KeptChunk>>,
}

impl Ground {
    /// Adds a chunk.
    pub fn push(&mut self, chunk: Arc<KeptChunk>) {
        self.chunks.push(chunk);
    }

    /// The chunks.
    #[must_use]
    pub fn chunks(&self) -> &[Arc<KeptChunk>] {
        &self.chunks
    }

    /// The box around everything, when there is anything.
    #[must_use]
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        self.chunks.iter().map(|chunk| chunk.bounds).reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
    }

    /// The nearest triangle within `reach` from `origin` in the unit direction `direction`, from either side.
    #[must_use]
    pub fn cast(&self, origin: Vec3, direction: Vec3, reach: f32) -> Option<Touch> {
        let mut nearest: Option<Touch> = None;
        let mut reach = reach;
        for chunk in &self.chunks {
            if !meets_box(origin, direction, reach, chunk.bounds) {
                continue;
            }
            for cluster in &chunk.clusters {
                let to_center = cluster.center - origin;
                let along = to_center.dot(direction);
                let off = to_center.length_squared() - along * along;
                if off > cluster.radius * cluster.radius || along < -cluster.radius || along > reach + cluster.radius {
                    continue;
                }
                let range = cluster.indices.start as usize..cluster.indices.end as usize;
                for triangle in chunk.indices[range].chunks_exact(3) {
                    let corners = [0, 1, 2].map(|k| chunk.positions[usize::from(triangle[k])]);
                    if let Some(touch) = meets_triangle(origin, direction, reach, corners) {
                        reach = touch.distance;
                        nearest = Some(touch);
                    }
                }
            }
        }
        nearest
    }
}

fn meets_box(origin: Vec3, direction: Vec3, reach: f32, (low, high): (Vec3, Vec3)) -> bool {
    let inverse = direction.recip();
    let (a, b) = ((low - origin) * inverse, (high - origin) * inverse);
    // A ray in a face of the box gives NaN, which min and max pass over.
    let near = a.min(b).max_element().max(0.0);
    let far = a.max(b).min_element().min(reach);
    near <= far || [near, far].iter().any(|t| t.is_nan())
}

/// Moeller and Trumbore: "Fast, Minimum Storage Ray/Triangle Intersection", 1997.
fn meets_triangle(origin: Vec3, direction: Vec3, reach: f32, [a, b, c]: [Vec3; 3]) -> Option<Touch> {
    let (ab, ac) = (b - a, c - a);
    let p = direction.cross(ac);
    let determinant = ab.dot(p);
    if determinant == 0.0 {
        return None;
    }
    let s = origin - a;
    let u = s.dot(p) / determinant;
    let q = s.cross(ab);
    let v = direction.dot(q) / determinant;
    let distance = ac.dot(q) / determinant;
    let inside = u >= 0.0 && v >= 0.0 && u + v <= 1.0 && distance >= 0.0 && distance < reach;
    inside.then(|| {
        let normal = unit_or(ab.cross(ac), Vec3::Y);
        Touch { distance, normal: if normal.dot(direction) > 0.0 { -normal } else { normal } }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::daylight::cluster::cluster;

    fn floor(height: f32) -> Arc<KeptChunk> {
        let n = 40;
        let at = |i: i32, j: i32| Vec3::new(i as f32 - 20.0, height, j as f32 - 20.0);
        let positions: Vec<Vec3> = (0..=n).flat_map(|j| (0..=n).map(move |i| at(i, j))).collect();
        let mut triangles = Vec::new();
        for j in 0..n as u32 {
            for i in 0..n as u32 {
                let a = j * (n as u32 + 1) + i;
                triangles.push([a, a + n as u32 + 1, a + 1]);
                triangles.push([a + 1, a + n as u32 + 1, a + n as u32 + 2]);
            }
        }
        let made = cluster(&positions, &triangles);
        let positions: Vec<Vec3> = made.vertices.iter().map(|&v| positions[v as usize]).collect();
        let bounds = (Vec3::new(-20.0, height, -20.0), Vec3::new(20.0, height, 20.0));
        Arc::new(KeptChunk { positions, indices: made.indices, clusters: made.clusters, bounds, albedo: Vec::new() })
    }

    #[test]
    fn feet_find_the_upper_of_two_floors() {
        let mut ground = Ground::default();
        ground.push(floor(0.0));
        ground.push(floor(1.0));
        let touch = ground.cast(Vec3::new(3.3, 2.5, -7.7), Vec3::NEG_Y, 10.0);
        let touch = touch.expect("a floor is below");
        assert!((touch.distance - 1.5).abs() < 1e-5 && touch.normal.dot(Vec3::Y) > 0.999);
        assert_eq!(ground.cast(Vec3::new(3.3, 2.5, -7.7), Vec3::NEG_Y, 1.0), None);
        assert_eq!(ground.cast(Vec3::new(30.0, 2.5, 0.0), Vec3::NEG_Y, 10.0), None);
        assert_eq!(ground.cast(Vec3::new(3.3, 0.5, -7.7), Vec3::Y, 10.0).map(|t| t.normal.y < -0.9), Some(true));
    }

    #[test]
    fn nothing_is_met_in_an_empty_stage() {
        assert_eq!(Ground::default().cast(Vec3::ZERO, Vec3::NEG_Y, 1e9), None);
        assert_eq!(Ground::default().bounds(), None);
    }
}
