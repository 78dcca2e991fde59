//! What counts as one object where small things are left out.
//!
//! Leaving out a pebble shows the ground behind it, leaving out every block of a wall shows a hole: things that touch others of about their own size are
//! one object with them. So a wall, a roof of tiles and a bed of gravel are as large as they look, and a chisel on a bench or a
//! stone on the ground stands for itself. Whole bodies (what hangs together by its corners) are joined, by their boxes.

use super::OfChunk;
use crate::daylight::chunk::KeptChunk;
use crate::daylight::closed::Bodies;
use glam::Vec3;
use std::collections::HashMap;
use std::sync::Arc;

/// A body joins others that are at most four times as large, two powers of two.
const CLASSES_APART: i32 = 2;

/// Boxes touch that are this near, as a part of the smaller one's size.
const TOUCHES: f32 = 0.05;

/// The objects of a stage, and which of them are in each cluster.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Objects {
    /// Centre and radius of each.
    pub spheres: Vec<(Vec3, f32)>,
    /// Of each the least pixels that its parts ask for, and whether some of it asks for none; empty where nothing does.
    pub(super) least_px: Vec<(f32, bool)>,
    /// Of each chunk, where in `members` those of each cluster begin, and where the last ones end.
    pub(super) begins: Vec<Vec<u32>>,
    pub(super) members: Vec<u32>,
}

impl Objects {
    /// Of all chunks, each with what is said of it.
    #[must_use]
    pub fn new(chunks: &[Arc<KeptChunk>], of_chunks: &[OfChunk], bodies: &Bodies) -> Self {
        let mut boxes = vec![(Vec3::INFINITY, Vec3::NEG_INFINITY); bodies.closed.len()];
        for (chunk, of_vertex) in chunks.iter().zip(&bodies.of_vertex) {
            for (&position, &body) in chunk.positions.iter().zip(of_vertex) {
                let (low, high) = &mut boxes[body as usize];
                (*low, *high) = (low.min(position), high.max(position));
            }
        }
        let object_of_body = join(&boxes);
        let count = object_of_body.iter().max().map_or(0, |&most| most as usize + 1);
        let mut bounds = vec![(Vec3::INFINITY, Vec3::NEG_INFINITY); count];
        for (&(low, high), &object) in boxes.iter().zip(&object_of_body) {
            let bounds = &mut bounds[object as usize];
            *bounds = (bounds.0.min(low), bounds.1.max(high));
        }
        let mut objects = Self {
            spheres: bounds.into_iter().map(|(low, high)| ((low + high) * 0.5, low.distance(high) * 0.5)).collect(),
            ..Self::default()
        };
        for (chunk, of_vertex) in chunks.iter().zip(&bodies.of_vertex) {
            let mut begins = Vec::with_capacity(chunk.clusters.len() + 1);
            for cluster in &chunk.clusters {
                begins.push(objects.members.len() as u32);
                let indices = &chunk.indices[cluster.indices.start as usize..cluster.indices.end as usize];
                let first = objects.members.len();
                for triangle in indices.chunks_exact(3) {
                    let object = object_of_body[of_vertex[usize::from(triangle[0])] as usize];
                    if !objects.members[first..].contains(&object) {
                        objects.members.push(object);
                    }
                }
            }
            begins.push(objects.members.len() as u32);
            objects.begins.push(begins);
        }
        objects.members.shrink_to_fit();
        if of_chunks.iter().any(|of| of.least_px.is_some()) {
            objects.least_px = vec![(f32::INFINITY, false); count];
            for (begins, of) in objects.begins.iter().zip(of_chunks) {
                let (first, end) = (begins.first().copied().unwrap_or(0), begins.last().copied().unwrap_or(0));
                for &object in &objects.members[first as usize..end as usize] {
                    let (least_px, asks_for_none) = &mut objects.least_px[object as usize];
                    *least_px = least_px.min(of.least_px.unwrap_or(f32::INFINITY));
                    *asks_for_none |= of.least_px.is_none();
                }
            }
        }
        objects
    }

    /// Below how many pixels an object is small, where `common` holds for those that do not ask for their own.
    #[must_use]
    pub fn threshold_px(&self, object: usize, common: f32) -> f32 {
        match self.least_px.get(object) {
            None => common,
            Some(&(own, false)) => own,
            Some(&(own, true)) => own.min(common),
        }
    }

    /// The objects that have triangles in a cluster.
    #[must_use]
    pub fn of_cluster(&self, chunk: u32, cluster: u32) -> &[u32] {
        let begins = &self.begins[chunk as usize];
        &self.members[begins[cluster as usize] as usize..begins[cluster as usize + 1] as usize]
    }
}

/// The object of each body.
fn join(boxes: &[(Vec3, Vec3)]) -> Vec<u32> {
    let size = |&(low, high): &(Vec3, Vec3)| (high - low).max_element();
    // Of nothing, and of what has no size, by itself.
    let class = |of: &(Vec3, Vec3)| Some(size(of)).filter(|size| *size > 0.0 && size.is_finite()).map(libm::ilogbf);
    let mut grid: HashMap<(i32, [i32; 3]), Vec<u32>> = HashMap::new();
    for (body, of) in boxes.iter().enumerate() {
        if let Some(class) = class(of) {
            for_cells(class, of, 0.0, |cell| grid.entry((class, cell)).or_default().push(body as u32));
        }
    }
    let mut parents: Vec<u32> = (0..boxes.len() as u32).collect();
    for (body, of) in boxes.iter().enumerate() {
        let Some(own) = class(of) else { continue };
        let reach = size(of) * TOUCHES;
        for larger in own..=own + CLASSES_APART {
            for_cells(larger, of, reach, |cell| {
                for &other in grid.get(&(larger, cell)).into_iter().flatten() {
                    let (low, high) = boxes[other as usize];
                    if (low - reach).cmple(of.1).all() && of.0.cmple(high + reach).all() {
                        let (a, b) = (root(&mut parents, body as u32), root(&mut parents, other));
                        parents[a.max(b) as usize] = a.min(b);
                    }
                }
            });
        }
    }
    // Numbers without gaps, in the order of their first bodies.
    let mut numbers: HashMap<u32, u32> = HashMap::new();
    (0..boxes.len() as u32)
        .map(|body| {
            let (root, next) = (root(&mut parents, body), numbers.len() as u32);
            *numbers.entry(root).or_insert(next)
        })
        .collect()
}

/// The cells, as wide as the largest body of a class, that a box reaches into: at most 27 for one of the class or below.
fn for_cells(class: i32, &(low, high): &(Vec3, Vec3), reach: f32, mut take: impl FnMut([i32; 3])) {
    let width = libm::scalbnf(1.0, class + 1);
    let [from, to] = [low - reach, high + reach].map(|corner| (corner / width).floor().as_ivec3());
    for x in from.x..=to.x {
        for y in from.y..=to.y {
            for z in from.z..=to.z {
                take([x, y, z]);
            }
        }
    }
}

fn root(parents: &mut [u32], mut body: u32) -> u32 {
    while parents[body as usize] != body {
        let above = parents[parents[body as usize] as usize];
        parents[body as usize] = above;
        body = above;
    }
    body
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cube(center: [f32; 3], half: f32) -> (Vec3, Vec3) {
        (Vec3::from(center) - half, Vec3::from(center) + half)
    }

    #[test]
    fn what_touches_its_like_is_one_and_what_lies_on_something_large_is_not() {
        let mut boxes = vec![
            // the ground, a pebble on it and one that touches that, three blocks of a wall, one that lies apart
            (Vec3::new(-50.0, -1.0, -50.0), Vec3::new(50.0, 0.0, 50.0)),
            cube([3.0, 0.05, 3.0], 0.05),
            cube([3.1, 0.05, 3.0], 0.05),
            cube([0.0, 0.5, 0.0], 0.5),
            cube([1.01, 0.5, 0.0], 0.5),
            cube([1.83, 0.3, 0.0], 0.3),
            cube([9.0, 0.5, 0.0], 0.5),
            (Vec3::INFINITY, Vec3::NEG_INFINITY),
            (Vec3::ZERO, Vec3::ZERO),
        ];
        let objects = join(&boxes);
        assert_eq!(objects, [0, 1, 1, 2, 2, 2, 3, 4, 5]);
        // Whatever the order.
        boxes.reverse();
        let turned = join(&boxes);
        for a in 0..boxes.len() {
            for b in 0..boxes.len() {
                let same = objects[boxes.len() - 1 - a] == objects[boxes.len() - 1 - b];
                assert_eq!(turned[a] == turned[b], same);
            }
        }
    }

    #[test]
    fn clusters_know_their_objects() {
        use crate::daylight::closed::ClosedBodies;
        use crate::daylight::cluster::cluster;
        let triangle = |x: f32| [Vec3::new(x, 0.0, 0.0), Vec3::new(x + 1.0, 0.0, 0.0), Vec3::new(x, 1.0, 0.0)];
        let positions: Vec<Vec3> = [0.0, 9.0].into_iter().flat_map(triangle).collect();
        let made = cluster(&positions, &[[0, 1, 2], [3, 4, 5]]);
        let chunk = Arc::new(KeptChunk {
            positions: made.vertices.iter().map(|&vertex| positions[vertex as usize]).collect(),
            indices: made.indices,
            clusters: made.clusters,
            bounds: (Vec3::ZERO, Vec3::new(10.0, 1.0, 0.0)),
            albedo: Vec::new(),
        });
        let mut bodies = ClosedBodies::default();
        bodies.push(&chunk);
        let bodies = bodies.finish();
        let objects = Objects::new(std::slice::from_ref(&chunk), &[OfChunk::default()], &bodies);
        assert_eq!(objects.of_cluster(0, 0), [0, 1]);
        assert_eq!(objects.threshold_px(1, 2.0), 2.0);
        let own = OfChunk { least_px: Some(7.0), ..OfChunk::default() };
        assert_eq!(Objects::new(&[chunk], &[own], &bodies).threshold_px(1, 2.0), 7.0);
        let shared = Objects { least_px: vec![(7.0, true), (0.5, true)], ..objects.clone() };
        assert_eq!([0, 1].map(|object| shared.threshold_px(object, 2.0)), [2.0, 0.5], "as small as its least part may be");
        assert_eq!(objects.spheres.len(), 2);
        assert!((objects.spheres[0].1 - 0.5_f32.sqrt()).abs() < 1e-6);
    }
}
