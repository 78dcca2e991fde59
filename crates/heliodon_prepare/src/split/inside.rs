//! One triangle whose edges may have been halved, cut into pieces that have no edge too long.

use super::edges::{Middles, edge};
use super::halving::too_long;
use super::vertex::Vertex;
use glam::Vec3;
use heliodon_mesh::Mesh;
use std::collections::HashMap;
use std::sync::atomic::{AtomicUsize, Ordering};

/// The pieces of a triangle.
pub(super) struct Pieces {
    /// Corners; those from `first_own` on are the triangle's own.
    pub triangles: Vec<[u32; 3]>,
    /// Vertices inside of the triangle, which no other one shares.
    pub own: Vec<Vertex>,
}

/// Cuts triangles.
pub(super) struct Cutter<'a, F> {
    pub mesh: &'a Mesh,
    pub middles: &'a Middles,
    pub longest_m: &'a F,
    /// How many pieces all cutters may make yet. Which of them finds it used up depends on threads; that it is, does not.
    pub left: &'a AtomicUsize,
}

impl<F: Fn(Vec3, Vec3) -> f32> Cutter<'_, F> {
    /// Cuts a triangle; none where too many pieces were made.
    pub fn cut(&self, triangle: u32) -> Option<Pieces> {
        let mut cut = Cut { cutter: self, own: Vec::new(), middles: HashMap::new() };
        let (mut todo, mut done) = (vec![self.mesh.triangles[triangle as usize]], Vec::new());
        while let Some(corners) = todo.pop() {
            // each of those waiting becomes a piece at least
            if todo.len() > self.left.load(Ordering::Relaxed) {
                return None;
            }
            if cut.cut(corners, &mut todo) {
                continue;
            }
            self.left.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |left| left.checked_sub(1)).ok()?;
            done.push(corners);
        }
        Some(Pieces { triangles: done, own: cut.own })
    }
}

/// A triangle being cut.
struct Cut<'a, F> {
    cutter: &'a Cutter<'a, F>,
    own: Vec<Vertex>,
    /// The middles of edges inside the triangle; none for those that are short enough.
    middles: HashMap<u64, Option<u32>>,
}

impl<F: Fn(Vec3, Vec3) -> f32> Cut<'_, F> {
    fn vertex(&self, vertex: u32) -> Vertex {
        let shared = self.cutter.mesh.positions.len();
        if (vertex as usize) < shared {
            Vertex::of(self.cutter.mesh, vertex as usize)
        } else {
            self.own[vertex as usize - shared]
        }
    }

    fn squared(&self, a: u32, b: u32) -> f64 {
        self.vertex(a).position.as_dvec3().distance_squared(self.vertex(b).position.as_dvec3())
    }

    /// The vertex in the middle of an edge that is too long.
    fn middle(&mut self, a: u32, b: u32) -> Option<u32> {
        let name = edge(a, b);
        if let Some(known) = self.cutter.middles.get(name) {
            return Some(known);
        }
        if let Some(&known) = self.middles.get(&name) {
            return known;
        }
        let (p, q) = (self.vertex(a.min(b)), self.vertex(a.max(b)));
        let made = too_long(p.position, q.position, self.cutter.longest_m).map(|_| {
            self.own.push(p.middle(&q));
            (self.cutter.mesh.positions.len() + self.own.len() - 1) as u32
        });
        self.middles.insert(name, made);
        made
    }

    /// An edge with all its middles, from a to b.
    fn line(&mut self, a: u32, b: u32, line: &mut Vec<u32>) {
        match self.middle(a, b) {
            Some(middle) => {
                self.line(a, middle, line);
                self.line(middle, b, line);
            }
            None => line.push(a),
        }
    }

    /// Cuts a triangle once, if an edge is too long.
    fn cut(&mut self, [a, b, c]: [u32; 3], pieces: &mut Vec<[u32; 3]>) -> bool {
        let halves = [self.middle(a, b), self.middle(b, c), self.middle(c, a)];
        match halves {
            [None, None, None] => return false,
            [Some(ab), None, None] => pieces.extend([[a, ab, c], [ab, b, c]]),
            [None, Some(bc), None] => pieces.extend([[b, bc, a], [bc, c, a]]),
            [None, None, Some(ca)] => pieces.extend([[c, ca, b], [ca, a, b]]),
            [Some(_), None, Some(_)] => self.ladder(a, b, c, pieces),
            [Some(_), Some(_), None] => self.ladder(b, c, a, pieces),
            [None, Some(_), Some(_)] => self.ladder(c, a, b, pieces),
            [Some(ab), Some(bc), Some(ca)] => {
                let lengths = [self.squared(a, b), self.squared(b, c), self.squared(c, a)];
                let [a, b, c, ab, bc, ca] = if lengths[0] >= lengths[1] && lengths[0] >= lengths[2] {
                    [a, b, c, ab, bc, ca]
                } else if lengths[1] >= lengths[2] {
                    [b, c, a, bc, ca, ab]
                } else {
                    [c, a, b, ca, ab, bc]
                };
                if self.squared(ab, c) < self.squared(bc, ca) {
                    // blunt at c
                    pieces.extend([[a, ab, c], [ab, b, c]]);
                } else {
                    pieces.extend([[a, ab, ca], [ab, b, bc], [ab, bc, ca], [ca, bc, c]]);
                }
            }
        }
        true
    }

    /// Rungs between the two long edges that meet at `tip`, with all their middles at once. Halving them over and over would make
    /// three thin triangles of each time and again.
    fn ladder(&mut self, tip: u32, b: u32, c: u32, pieces: &mut Vec<[u32; 3]>) {
        let (mut left, mut right) = (Vec::new(), Vec::new());
        self.line(tip, b, &mut left);
        left.push(b);
        self.line(tip, c, &mut right);
        right.push(c);
        pieces.push([tip, left[1], right[1]]);
        let (mut i, mut j) = (1, 1);
        while i + 1 < left.len() || j + 1 < right.len() {
            let up_left = left.get(i + 1).map_or(f64::INFINITY, |&next| self.squared(next, right[j]));
            let up_right = right.get(j + 1).map_or(f64::INFINITY, |&next| self.squared(left[i], next));
            if up_left <= up_right && i + 1 < left.len() {
                pieces.push([left[i], left[i + 1], right[j]]);
                i += 1;
            } else {
                pieces.push([left[i], right[j + 1], right[j]]);
                j += 1;
            }
        }
    }
}
