//! Triangles in groups that are drawn, or found hidden, together.

use crate::purge::Surface;
use glam::Vec3;
use heliodon_raster::Group;
use heliodon_rays::{MAX_COORDINATE, morton_order};

/// Triangles of a group. Fewer are culled more tightly, more share more vertices.
const TRIANGLES: usize = 64;

/// A group: ranges of the arrays of [`Clusters`], and its bounds.
#[derive(Clone, Copy)]
pub(super) struct Cluster {
    pub low: Vec3,
    pub high: Vec3,
    pub vertices: [u32; 2],
    pub triangles: [u32; 2],
}

/// A model in groups of neighbours.
pub(super) struct Clusters {
    pub clusters: Vec<Cluster>,
    /// Coordinates of vertices, one axis after the other, group after group; a vertex that several groups need lies in each.
    points: [Vec<f32>; 3],
    /// Corners of triangles as indices into their group's vertices.
    corners: Vec<[u8; 3]>,
    /// The triangles' own indices, in the order along a space-filling curve.
    pub ids: Vec<u32>,
}

impl Clusters {
    pub fn new(surface: &Surface) -> Self {
        let Surface { positions, triangles, .. } = *surface;
        let at = |t: &[u32; 3]| t.map(|i| positions[i as usize]);
        let middles: Vec<Vec3> = triangles.iter().map(|t| at(t).into_iter().map(|p| p / 3.0).sum()).collect();
        let usable = |t: u32| {
            let [a, b, c] = at(&triangles[t as usize]);
            let near = |p: Vec3| p.abs().cmple(Vec3::splat(MAX_COORDINATE)).all();
            near(a) && near(b) && near(c) && a != b && b != c && c != a
        };
        let ids: Vec<u32> = morton_order(&middles).into_iter().filter(|&t| usable(t)).collect();
        drop(middles);
        let mut all = Self {
            clusters: Vec::new(),
            points: [const { Vec::new() }; 3],
            corners: Vec::with_capacity(ids.len()),
            ids: Vec::new(),
        };
        // Where a vertex lies, if the group that noted it is this one.
        let mut noted = vec![(u32::MAX, 0u8); positions.len()];
        for (group, ids) in ids.chunks(TRIANGLES).enumerate() {
            let first = [all.points[0].len() as u32, all.corners.len() as u32];
            let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
            for &id in ids {
                all.corners.push(triangles[id as usize].map(|i| {
                    let note = &mut noted[i as usize];
                    if note.0 != group as u32 {
                        *note = (group as u32, (all.points[0].len() - first[0] as usize) as u8);
                        let point = positions[i as usize];
                        (low, high) = (low.min(point), high.max(point));
                        all.points.iter_mut().zip(point.to_array()).for_each(|(axis, at)| axis.push(at));
                    }
                    note.1
                }));
            }
            let [vertices, triangles] = [[first[0], all.points[0].len() as u32], [first[1], all.corners.len() as u32]];
            all.clusters.push(Cluster { low, high, vertices, triangles });
        }
        all.ids = ids;
        all
    }

    /// A group's triangles, as they are drawn.
    pub fn group(&self, cluster: &Cluster) -> Group<'_> {
        let [first, last] = cluster.vertices.map(|i| i as usize);
        let [from, to] = cluster.triangles.map(|i| i as usize);
        Group { points: self.points.each_ref().map(|axis| &axis[first..last]), triangles: &self.corners[from..to] }
    }
}
