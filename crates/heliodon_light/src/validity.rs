//! Vertices that lie inside something, and whose light they show instead.
//!
//! Where a column stands in the ground, triangles reach below it; their lower vertices see nothing but the insides of stones,
//! and would draw a dark rim along the foot. They borrow the light of a valid neighbour.

use glam::Vec3;
use std::collections::HashMap;

/// Which vertices are valid, and where the others' light comes from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Validity {
    /// 1 where a vertex sees the open, 0 where it lies inside something.
    pub valid: Vec<u8>,
    /// The vertex whose light is shown: the vertex itself where it is valid, or where no valid one can be reached. Numbers from N on
    /// are cells of divided triangles, in their order: large faces may have all their corners inside their neighbours.
    pub source: Vec<u32>,
}

/// The cosine between normals below which a neighbour looks another way and is borrowed from only where no other is.
const SAME_WAY: f32 = 0.3;

impl Validity {
    /// Finds for every invalid vertex the valid one to borrow from: one that looks the same way before others, reached over
    /// the fewest edges (vertices at the same place count as one), then the nearest, then the first.
    #[must_use]
    pub fn new(valid: Vec<u8>, positions: &[Vec3], normals: &[Vec3], triangles: &[[u32; 3]]) -> Self {
        let mut source: Vec<u32> = (0..valid.len() as u32).collect();
        let graph = Neighbours::of_invalid(&valid, positions, triangles);
        let mut reached = valid.clone();
        let mut waiting: Vec<u32> = graph.vertices.clone();
        for any_way in [false, true] {
            loop {
                // one ring of edges at a time: all of a ring see only what was reached before it
                let mut ring: Vec<(u32, u32)> = Vec::new();
                waiting.retain(|&v| {
                    let (at, way) = (positions[v as usize], normals[v as usize]);
                    let best = graph
                        .of(v)
                        .filter(|&n| reached[n as usize] != 0)
                        .map(|n| source[n as usize])
                        .filter(|&s| any_way || normals[s as usize].dot(way) > SAME_WAY)
                        .map(|s| (at.distance_squared(positions[s as usize]), s))
                        .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
                    ring.extend(best.map(|(_, from)| (v, from)));
                    best.is_none()
                });
                if ring.is_empty() {
                    break;
                }
                for (v, from) in ring {
                    reached[v as usize] = 1;
                    source[v as usize] = from;
                }
            }
        }
        Self { valid, source }
    }
}

impl Validity {
    /// Whether a vertex neither is valid nor could borrow from anything that is.
    #[must_use]
    pub fn is_lost(&self, vertex: u32) -> bool {
        self.valid.get(self.source[vertex as usize] as usize) == Some(&0)
    }

    /// Lets lost vertices borrow from cells: of the offers (vertex, cell's number as in `source`, squared distance) each takes the
    /// nearest, then the first.
    pub(crate) fn borrow_from_cells(&mut self, offers: impl Iterator<Item = (u32, u32, f32)>) {
        let mut best: HashMap<u32, (f32, u32)> = HashMap::new();
        for (vertex, cell, distance) in offers {
            let kept = best.entry(vertex).or_insert((distance, cell));
            if distance.total_cmp(&kept.0).then(cell.cmp(&kept.1)).is_lt() {
                *kept = (distance, cell);
            }
        }
        for (vertex, (_, cell)) in best {
            self.source[vertex as usize] = cell;
        }
    }
}

/// The neighbours of invalid vertices, over edges and at the same place.
struct Neighbours {
    /// Invalid vertices that some triangle uses, ascending.
    vertices: Vec<u32>,
    /// (invalid vertex's place, neighbour), sorted.
    edges: Vec<(u32, u32)>,
    /// The vertices at each place that holds an invalid one: (place, vertex), sorted.
    twins: Vec<(u32, u32)>,
    place_of: HashMap<u32, u32>,
}

impl Neighbours {
    fn of_invalid(valid: &[u8], positions: &[Vec3], triangles: &[[u32; 3]]) -> Self {
        let key = |v: u32| positions[v as usize].to_array().map(|x| (x + 0.0).to_bits());
        // a place is named by its first invalid vertex; the maps are only looked up, never walked
        let mut places: HashMap<[u32; 3], u32> = HashMap::new();
        let mut place_of: HashMap<u32, u32> = HashMap::new();
        for v in (0..valid.len() as u32).filter(|&v| valid[v as usize] == 0) {
            place_of.insert(v, *places.entry(key(v)).or_insert(v));
        }
        let mut twins = Vec::new();
        if !places.is_empty() {
            twins.extend((0..valid.len() as u32).filter_map(|v| Some((*places.get(&key(v))?, v))));
        }
        let mut edges = Vec::new();
        let mut vertices = Vec::new();
        for t in triangles.iter().filter(|t| t.iter().any(|&v| valid[v as usize] == 0)) {
            for &v in t.iter().filter(|&&v| valid[v as usize] == 0) {
                vertices.push(v);
                edges.extend(t.iter().filter(|&&n| n != v).map(|&n| (place_of[&v], n)));
            }
        }
        for list in [&mut edges, &mut twins] {
            list.sort_unstable();
            list.dedup();
        }
        vertices.sort_unstable();
        vertices.dedup();
        Self { vertices, edges, twins, place_of }
    }

    fn of(&self, vertex: u32) -> impl Iterator<Item = u32> {
        let place = self.place_of[&vertex];
        let run = |list: &'_ [(u32, u32)]| {
            let (from, to) = (list.partition_point(|p| p.0 < place), list.partition_point(|p| p.0 <= place));
            from..to
        };
        let edges = self.edges[run(&self.edges)].iter();
        let twins = self.twins[run(&self.twins)].iter();
        edges.chain(twins).map(|p| p.1).filter(move |&n| n != vertex)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn strip(count: u32) -> (Vec<Vec3>, Vec<[u32; 3]>) {
        let positions = (0..count).map(|i| Vec3::new((i / 2) as f32, (i % 2) as f32, 0.0)).collect();
        (positions, (0..count - 2).map(|i| [i, i + 1, i + 2]).collect())
    }

    #[test]
    fn a_chain_of_invalid_vertices_borrows_from_its_end() {
        let (positions, triangles) = strip(12);
        let normals = vec![Vec3::Z; 12];
        let mut valid = vec![0; 12];
        valid[10] = 1;
        valid[11] = 1;
        let validity = Validity::new(valid, &positions, &normals, &triangles);
        for v in 0..10 {
            assert_eq!(validity.source[v], if v % 2 == 0 { 10 } else { 11 }, "vertex {v}");
        }
    }

    #[test]
    fn vertices_at_one_place_are_neighbours() {
        let (mut positions, mut triangles) = strip(3);
        positions.extend([positions[2], positions[2] + Vec3::X, positions[2] + Vec3::Y]);
        triangles.push([3, 4, 5]);
        let validity = Validity::new(vec![0, 0, 0, 1, 1, 1], &positions, &[Vec3::Z; 6], &triangles);
        assert_eq!(validity.source, [3, 3, 3, 3, 4, 5]);
    }

    #[test]
    fn what_nothing_valid_can_be_reached_from_keeps_its_own() {
        let (positions, triangles) = strip(4);
        let validity = Validity::new(vec![0; 4], &positions, &[Vec3::Z; 4], &triangles);
        assert_eq!(validity.source, [0, 1, 2, 3]);
        assert_eq!(validity.valid, [0; 4]);
    }
}
