//! A chunk's triangles as item buffers take them: in parts that share few vertices, whose coordinates lie together.

use super::chunk::KeptChunk;
use glam::Vec3;
use heliodon_raster::Group;

/// The most triangles of a part, a power of two: at most 256 vertices.
pub const PART_TRIANGLES: usize = 64;

/// All parts of a chunk, those of one cluster after those of the one before.
#[derive(Clone, Debug)]
pub struct Parts {
    list: Vec<Part>,
    /// Where the parts of each cluster begin, and where the last ones end.
    of_cluster: Vec<u32>,
    points: [Vec<f32>; 3],
    corners: Vec<[u8; 3]>,
}

/// A part.
#[derive(Clone, Copy, Debug)]
pub struct Part {
    /// Number of its first triangle in the chunk.
    pub first_triangle: u32,
    /// Least and greatest corner.
    pub bounds: (Vec3, Vec3),
    triangles: u32,
    vertices: [u32; 2],
}

impl Parts {
    /// Of a chunk.
    #[must_use]
    pub fn new(chunk: &KeptChunk) -> Self {
        let triangles = chunk.indices.as_chunks::<3>().0;
        let mut all = Self {
            list: Vec::new(),
            of_cluster: Vec::with_capacity(chunk.clusters.len() + 1),
            points: [const { Vec::new() }; 3],
            corners: Vec::with_capacity(triangles.len()),
        };
        // The part that last had each vertex, and its number there.
        let mut noted = vec![(u32::MAX, 0_u8); chunk.positions.len()];
        for cluster in &chunk.clusters {
            all.of_cluster.push(all.list.len() as u32);
            let mut first = cluster.indices.start / 3;
            for part in triangles[first as usize..cluster.indices.end as usize / 3].chunks(PART_TRIANGLES) {
                all.add(first, part, &chunk.positions, &mut noted);
                first += part.len() as u32;
            }
        }
        all.of_cluster.push(all.list.len() as u32);
        all.points.iter_mut().for_each(Vec::shrink_to_fit);
        all
    }

    fn add(&mut self, first_triangle: u32, triangles: &[[u16; 3]], positions: &[Vec3], noted: &mut [(u32, u8)]) {
        let number = self.list.len() as u32;
        let begin = self.points[0].len();
        let mut bounds = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for triangle in triangles {
            self.corners.push(triangle.map(|vertex| {
                let note = &mut noted[usize::from(vertex)];
                if note.0 != number {
                    *note = (number, (self.points[0].len() - begin) as u8);
                    let point = positions[usize::from(vertex)];
                    bounds = (bounds.0.min(point), bounds.1.max(point));
                    self.points.iter_mut().zip(point.to_array()).for_each(|(axis, at)| axis.push(at));
                }
                note.1
            }));
        }
        let vertices = [begin as u32, self.points[0].len() as u32];
        self.list.push(Part { first_triangle, bounds, triangles: triangles.len() as u32, vertices });
    }

    /// Numbers of the parts of a cluster.
    #[must_use]
    pub fn of_cluster(&self, cluster: u32) -> std::ops::Range<u32> {
        self.of_cluster[cluster as usize]..self.of_cluster[cluster as usize + 1]
    }

    /// A part.
    #[must_use]
    pub fn part(&self, number: u32) -> &Part {
        &self.list[number as usize]
    }

    /// A part's triangles.
    #[must_use]
    pub fn group(&self, part: &Part) -> Group<'_> {
        let [first, last] = part.vertices.map(|vertex| vertex as usize);
        let triangles = part.first_triangle as usize..(part.first_triangle + part.triangles) as usize;
        Group { points: self.points.each_ref().map(|axis| &axis[first..last]), triangles: &self.corners[triangles] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::daylight::cluster::cluster;

    #[test]
    fn parts_hold_all_triangles_in_their_order() {
        let side = 30_u16;
        let positions: Vec<Vec3> =
            (0..side * side).map(|i| Vec3::new(f32::from(i % side), f32::from(i / side), (i as f32).sin())).collect();
        let quads = (0..(side - 1) * (side - 1)).map(|i| u32::from(i / (side - 1) * side + i % (side - 1)));
        let triangles: Vec<[u32; 3]> = quads
            .flat_map(|v| [[v, v + 1, v + u32::from(side)], [v + 1, v + 1 + u32::from(side), v + u32::from(side)]])
            .collect();
        let made = cluster(&positions, &triangles);
        let kept = KeptChunk {
            positions: made.vertices.iter().map(|&old| positions[old as usize]).collect(),
            indices: made.indices,
            clusters: made.clusters,
            bounds: (Vec3::ZERO, Vec3::ZERO),
            albedo: Vec::new(),
        };
        let parts = Parts::new(&kept);
        let mut next = 0;
        for number in 0..kept.clusters.len() as u32 {
            assert_eq!(next, kept.clusters[number as usize].indices.start / 3);
            for part in parts.of_cluster(number).map(|number| parts.part(number)) {
                assert_eq!(part.first_triangle, next);
                let group = parts.group(part);
                assert!(group.triangles.len() <= PART_TRIANGLES);
                for corners in group.triangles {
                    let wanted = kept.triangle(next).map(|vertex| kept.positions[usize::from(vertex)]);
                    let point = |vertex: u8| Vec3::from_array(group.points.map(|axis| axis[usize::from(vertex)]));
                    assert_eq!(corners.map(point), wanted);
                    assert!(wanted.iter().all(|p| p.cmpge(part.bounds.0).all() && p.cmple(part.bounds.1).all()));
                    next += 1;
                }
            }
        }
        assert_eq!(next as usize, triangles.len());
    }
}
