//! Clusters of a chunk's triangles: what is culled before the GPU sees it.
//!
//! A chunk is split by halves, along the widest axis of position and normal together, into clusters of at most
//! [`CLUSTER_TRIANGLES`] triangles, and its vertices are renumbered in the order of their use. A cluster out of the frustum,
//! or all of whose triangles show their backs, is not drawn; on software Vulkan the front end handles triangles on one thread,
//! so what it never sees is the cheapest frame time there is. The measures are in docs/decisions/008-drawing-stone.md.

use super::layout::GROUP;
use super::view::Eye;
use glam::{Vec3, Vec4};
use heliodon_math::frame::unit_or;
use std::ops::Range;

/// The most triangles of a cluster.
pub const CLUSTER_TRIANGLES: usize = 128;

/// Triangles that are culled together.
#[derive(Clone, Debug, PartialEq)]
pub struct Cluster {
    /// Range of the chunk's index buffer.
    pub indices: Range<u32>,
    /// Groups of [`GROUP`] vertices that hold the cluster's.
    pub groups: Box<[u16]>,
    /// Centre of the bounding box and of the bounding sphere.
    pub center: Vec3,
    /// Half the bounding box.
    pub half: Vec3,
    /// Radius of the bounding sphere.
    pub radius: f32,
    /// Axis of the cone that holds the triangles' normals.
    pub cone_axis: Vec3,
    /// Sine of the cone's half opening; 1 where nothing can be said.
    pub cone_cutoff: f32,
}

impl Cluster {
    /// Whether every triangle shows its back to `eye`.
    ///
    /// With `u` the unit vector from the eye to a point of the cluster, all backs show where the angle between `u` and the axis
    /// is less than 90 degrees minus the cone's; the sphere's radius covers all points (as in meshoptimizer's cluster bounds). A parallel
    /// view has one `u` for all points.
    #[must_use]
    pub fn faces_away(&self, eye: Eye) -> bool {
        let to_center = match eye {
            Eye::At(eye) => self.center - eye,
            Eye::Along(forward) => return forward.dot(self.cone_axis) >= self.cone_cutoff,
        };
        to_center.dot(self.cone_axis) >= self.cone_cutoff * to_center.length() + self.radius
    }

    /// Whether the bounding sphere reaches into all `planes` (inward unit normal, distance).
    #[must_use]
    pub fn meets(&self, planes: &[Vec4]) -> bool {
        planes.iter().all(|plane| plane.truncate().dot(self.center) + plane.w >= -self.radius)
    }
}

/// A chunk's triangles in clusters: `triangles[order[i]]`, vertices renumbered by `vertices`.
#[derive(Clone, Debug)]
pub struct Clustered {
    /// Indices of the renumbered vertices, three a triangle, cluster by cluster.
    pub indices: Vec<u16>,
    /// The old number of each new vertex. Vertices that no triangle uses are left out.
    pub vertices: Vec<u32>,
    /// The clusters in the order of their indices.
    pub clusters: Vec<Cluster>,
}

struct Item {
    triangle: u32,
    key: [f32; 6],
    normal: Vec3,
}

/// Splits a chunk of at most 65,536 vertices into clusters.
#[must_use]
pub fn cluster(positions: &[Vec3], triangles: &[[u32; 3]]) -> Clustered {
    let mut items: Vec<Item> = Vec::with_capacity(triangles.len());
    let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    for (index, triangle) in triangles.iter().enumerate() {
        let [a, b, c] = triangle.map(|v| positions[v as usize]);
        let center = (a + b + c) / 3.0;
        (low, high) = (low.min(center), high.max(center));
        let normal = unit_or((b - a).cross(c - a), Vec3::ZERO);
        items.push(Item { triangle: index as u32, key: [center.x, center.y, center.z, normal.x, normal.y, normal.z], normal });
    }
    // A normal that turns by a radian weighs as much as a third of the chunk's extent: clusters become compact and even-faced.
    let scale = if items.is_empty() { 1.0 } else { (high - low).max_element().max(f32::MIN_POSITIVE) / 3.0 };
    for item in &mut items {
        item.key[3..].iter_mut().for_each(|component| *component *= scale);
    }

    let mut leaves = Vec::new();
    split(&mut items, 0, &mut leaves);

    let mut renumbered = vec![u32::MAX; positions.len()];
    let mut out = Clustered { indices: Vec::with_capacity(triangles.len() * 3), vertices: Vec::new(), clusters: Vec::new() };
    for leaf in leaves {
        let start = out.indices.len() as u32;
        let members = &items[leaf];
        for item in members {
            for vertex in triangles[item.triangle as usize] {
                let number = &mut renumbered[vertex as usize];
                if *number == u32::MAX {
                    *number = out.vertices.len() as u32;
                    out.vertices.push(vertex);
                }
                out.indices.push(*number as u16);
            }
        }
        let points = members.iter().flat_map(|item| triangles[item.triangle as usize]).map(|vertex| positions[vertex as usize]);
        let mut groups: Vec<u16> = out.indices[start as usize..].iter().map(|&index| index / GROUP as u16).collect();
        groups.sort_unstable();
        groups.dedup();
        out.clusters.push(bound(points, members, start..out.indices.len() as u32, groups.into()));
    }
    out
}

/// Halves `items` by the median of their widest axis until each part is small enough.
fn split(items: &mut [Item], start: usize, leaves: &mut Vec<Range<usize>>) {
    if items.is_empty() {
        return;
    }
    if items.len() <= CLUSTER_TRIANGLES {
        leaves.push(start..start + items.len());
        return;
    }
    let mut low = [f32::INFINITY; 6];
    let mut high = [f32::NEG_INFINITY; 6];
    for item in items.iter() {
        for axis in 0..6 {
            low[axis] = low[axis].min(item.key[axis]);
            high[axis] = high[axis].max(item.key[axis]);
        }
    }
    let axis = (0..6).max_by(|&a, &b| (high[a] - low[a]).total_cmp(&(high[b] - low[b]))).unwrap_or(0);
    // Parts of a whole number of clusters, so that the leaves are full.
    let middle = items.len().div_ceil(CLUSTER_TRIANGLES).div_ceil(2) * CLUSTER_TRIANGLES;
    let middle = middle.min(items.len() - 1);
    items.select_nth_unstable_by(middle, |a, b| a.key[axis].total_cmp(&b.key[axis]).then(a.triangle.cmp(&b.triangle)));
    let (left, right) = items.split_at_mut(middle);
    // The order inside a part follows the input's, whose neighbours share vertices.
    if left.len() <= CLUSTER_TRIANGLES {
        left.sort_unstable_by_key(|item| item.triangle);
    }
    if right.len() <= CLUSTER_TRIANGLES {
        right.sort_unstable_by_key(|item| item.triangle);
    }
    split(left, start, leaves);
    split(right, start + middle, leaves);
}

fn bound(points: impl Iterator<Item = Vec3> + Clone, members: &[Item], indices: Range<u32>, groups: Box<[u16]>) -> Cluster {
    let (low, high) =
        points.clone().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), point| (low.min(point), high.max(point)));
    let center = (low + high) * 0.5;
    let radius = points.map(|point| point.distance_squared(center)).fold(0.0, f32::max).sqrt();
    let sum: Vec3 = members.iter().map(|item| item.normal).sum();
    let cone_axis = unit_or(sum, Vec3::Y);
    // A degenerate triangle has no normal and is not drawn: it does not count.
    let least =
        members.iter().filter(|item| item.normal != Vec3::ZERO).map(|item| item.normal.dot(cone_axis)).fold(1.0, f32::min);
    let cone_cutoff = if least <= 0.1 { 1.0 } else { (1.0 - least * least).max(0.0).sqrt() };
    Cluster { indices, groups, center, half: (high - low) * 0.5, radius, cone_axis, cone_cutoff }
}

#[cfg(test)]
mod tests {
    use super::*;
    use heliodon_math::sphere::fibonacci_sphere;

    /// An open cylinder, `n` by `n` quads.
    fn cylinder(n: u32) -> (Vec<Vec3>, Vec<[u32; 3]>) {
        let mut positions = Vec::new();
        let mut triangles = Vec::new();
        for j in 0..=n {
            for i in 0..=n {
                let (s, c) = (i as f32 / n as f32 * std::f32::consts::TAU).sin_cos();
                positions.push(Vec3::new(c, j as f32 / n as f32 * 10.0, s));
            }
        }
        for j in 0..n {
            for i in 0..n {
                let a = j * (n + 1) + i;
                triangles.push([a, a + n + 1, a + 1]);
                triangles.push([a + 1, a + n + 1, a + n + 2]);
            }
        }
        (positions, triangles)
    }

    #[test]
    fn clusters_hold_every_triangle_once() {
        let (positions, triangles) = cylinder(60);
        let made = cluster(&positions, &triangles);
        assert_eq!(made.indices.len(), triangles.len() * 3);
        let mut got: Vec<[u32; 3]> =
            made.indices.chunks_exact(3).map(|t| [0, 1, 2].map(|k| made.vertices[usize::from(t[k])])).collect();
        let mut wanted = triangles.clone();
        got.sort_unstable();
        wanted.sort_unstable();
        assert_eq!(got, wanted);
        assert_eq!(made.clusters.len(), triangles.len().div_ceil(CLUSTER_TRIANGLES));
        assert_eq!(made.clusters.last().map(|c| c.indices.end), Some(made.indices.len() as u32));
    }

    #[test]
    fn only_clusters_that_show_nothing_but_backs_are_culled() {
        let (positions, triangles) = cylinder(60);
        let made = cluster(&positions, &triangles);
        let mut culled = 0;
        for eye in fibonacci_sphere(50).into_iter().map(|d| d * 30.0) {
            for one in made.clusters.iter().filter(|one| one.faces_away(Eye::At(eye))) {
                culled += 1;
                for t in made.indices[one.indices.start as usize..one.indices.end as usize].chunks_exact(3) {
                    let [a, b, c] = [0, 1, 2].map(|k| positions[made.vertices[usize::from(t[k])] as usize]);
                    assert!((b - a).cross(c - a).dot(a - eye) >= -1e-4);
                }
            }
        }
        assert!(culled > 50 * made.clusters.len() / 4, "{culled} of {}", 50 * made.clusters.len());
    }

    #[test]
    fn parallel_views_cull_by_their_direction_alone() {
        let (positions, triangles) = cylinder(60);
        let made = cluster(&positions, &triangles);
        let mut culled = 0;
        for forward in fibonacci_sphere(50) {
            for one in made.clusters.iter().filter(|one| one.faces_away(Eye::Along(forward))) {
                culled += 1;
                for t in made.indices[one.indices.start as usize..one.indices.end as usize].chunks_exact(3) {
                    let [a, b, c] = [0, 1, 2].map(|k| positions[made.vertices[usize::from(t[k])] as usize]);
                    assert!((b - a).cross(c - a).dot(forward) >= -1e-4);
                }
            }
        }
        assert!(culled > 50 * made.clusters.len() / 4, "{culled} of {}", 50 * made.clusters.len());
    }

    #[test]
    fn nothing_and_degenerate_triangles_are_taken() {
        assert!(cluster(&[], &[]).clusters.is_empty());
        let made = cluster(&[Vec3::ZERO; 3], &[[0, 1, 2]]);
        assert_eq!(made.clusters.len(), 1);
        assert!(!made.clusters[0].faces_away(Eye::At(Vec3::Z)) || made.clusters[0].radius == 0.0);
    }
}
