//! The closest point on a surface.
//!
//! Eight boxes a node, nodes in rows of eight, along the Morton curve of the triangles' middles: 32 bytes a triangle.
//! `heliodon_rays` answers what a ray meets, which is another question.

use glam::Vec3;
use heliodon_mesh::Mesh;
use heliodon_rays::morton_order;
use rayon::prelude::*;

const WIDTH: usize = 8;

/// Boxes of eight children, or of eight triangles.
#[derive(Clone, Copy)]
struct Node {
    low: [[f32; WIDTH]; 3],
    high: [[f32; WIDTH]; 3],
}

impl Node {
    const EMPTY: Self = Self { low: [[f32::INFINITY; WIDTH]; 3], high: [[f32::NEG_INFINITY; WIDTH]; 3] };

    fn of(boxes: impl Iterator<Item = (Vec3, Vec3)>) -> Self {
        let mut node = Self::EMPTY;
        for (child, (low, high)) in boxes.enumerate() {
            for axis in 0..3 {
                node.low[axis][child] = low[axis];
                node.high[axis][child] = high[axis];
            }
        }
        node
    }

    fn bounds(&self) -> (Vec3, Vec3) {
        let least = |row: &[f32; WIDTH]| row.iter().copied().fold(f32::INFINITY, f32::min);
        let greatest = |row: &[f32; WIDTH]| row.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        (Vec3::from(self.low.each_ref().map(least)), Vec3::from(self.high.each_ref().map(greatest)))
    }

    /// Squares of the distances from a point to the boxes; infinite for those that are none.
    #[inline]
    fn distances(&self, p: Vec3) -> [f32; WIDTH] {
        let mut sum = [0.0; WIDTH];
        for axis in 0..3 {
            for ((sum, low), high) in sum.iter_mut().zip(self.low[axis]).zip(self.high[axis]) {
                let outside = (low - p[axis]).max(p[axis] - high).max(0.0);
                *sum += outside * outside;
            }
        }
        sum
    }
}

/// A point of the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Closest {
    pub triangle: u32,
    pub distance_squared: f32,
}

/// What is looked for: the point of the surface closest to `point`, among triangles whose normal is within an angle of
/// `normal`.
#[derive(Clone, Copy)]
pub(super) struct Query {
    pub point: Vec3,
    /// Of length 1.
    pub normal: Vec3,
    /// Cosine of the angle; -1 takes all triangles, those without area too.
    pub least_cosine: f32,
}

/// Triangles, ready to be asked.
pub(super) struct Surface<'m> {
    mesh: &'m Mesh,
    order: Vec<u32>,
    /// From the triangles up; the last has one node.
    levels: Vec<Vec<Node>>,
}

impl<'m> Surface<'m> {
    pub fn new(mesh: &'m Mesh) -> Self {
        let centers: Vec<Vec3> = (0..mesh.triangles.len()).into_par_iter().map(|t| center(mesh, t)).collect();
        let order = morton_order(&centers);
        drop(centers);
        let of_triangles = |some: &[u32]| {
            Node::of(some.iter().map(|&t| {
                let [a, b, c] = mesh.corners(t as usize);
                (a.min(b).min(c), a.max(b).max(c))
            }))
        };
        let mut levels: Vec<Vec<Node>> = vec![order.par_chunks(WIDTH).map(of_triangles).collect()];
        while let Some(below) = levels.last().filter(|below| below.len() > 1) {
            let above = below.par_chunks(WIDTH).map(|some| Node::of(some.iter().map(Node::bounds))).collect();
            levels.push(above);
        }
        Self { mesh, order, levels }
    }

    /// The closest triangle no farther than `within_m`, the first of those that are equally close. `near` may name any
    /// triangle: the closer it is, the faster the answer.
    pub fn closest(&self, query: &Query, within_m: f32, near: Option<u32>) -> Option<Closest> {
        self.search(query, within_m, near, f32::NEG_INFINITY)
    }

    /// Any triangle that is no farther from a point than `within_m`, the one `near` names before others.
    pub fn any_within(&self, point: Vec3, within_m: f32, near: Option<u32>) -> Option<u32> {
        let query = Query { point, normal: Vec3::ZERO, least_cosine: -1.0 };
        let found = self.search(&query, within_m, near, within_m * within_m)?;
        Some(found.triangle)
    }

    /// The closest triangle, or one no farther than is `enough`.
    fn search(&self, query: &Query, within_m: f32, near: Option<u32>, enough_squared: f32) -> Option<Closest> {
        let far = Closest { triangle: u32::MAX, distance_squared: (within_m * within_m).min(f32::MAX) };
        let mut search = Search { surface: self, query, best: far, enough_squared };
        if !query.point.is_finite() {
            return None;
        }
        if let Some(triangle) = near {
            search.try_triangle(triangle);
        }
        let root = self.levels.len().checked_sub(1).filter(|&root| !self.levels[root].is_empty());
        if let Some(root) = root.filter(|_| !search.has_enough()) {
            search.visit(root, 0);
        }
        Some(search.best).filter(|best| best.triangle != u32::MAX)
    }
}

struct Search<'a> {
    surface: &'a Surface<'a>,
    query: &'a Query,
    best: Closest,
    enough_squared: f32,
}

impl Search<'_> {
    fn has_enough(&self) -> bool {
        self.best.triangle != u32::MAX && self.best.distance_squared <= self.enough_squared
    }

    fn visit(&mut self, level: usize, node: usize) {
        let mut distances = self.surface.levels[level][node].distances(self.query.point);
        loop {
            let (mut child, mut least) = (0, f32::INFINITY);
            for (index, &distance) in distances.iter().enumerate() {
                if distance < least {
                    (child, least) = (index, distance);
                }
            }
            // as close as the best must be looked at: of equally close triangles the first is wanted
            if least > self.best.distance_squared || least == f32::INFINITY {
                return;
            }
            distances[child] = f32::INFINITY;
            let below = node * WIDTH + child;
            match level {
                0 => self.try_triangle(self.surface.order[below]),
                _ => self.visit(level - 1, below),
            }
            if self.has_enough() {
                return;
            }
        }
    }

    fn try_triangle(&mut self, triangle: u32) {
        let corners = self.surface.mesh.corners(triangle as usize);
        // seen from the point, so that a mesh far from the origin loses no digits
        let distance_squared = closest_to_origin(corners.map(|corner| corner - self.query.point)).length_squared();
        let closer = distance_squared < self.best.distance_squared
            || distance_squared == self.best.distance_squared && triangle < self.best.triangle;
        if closer && self.faces(corners) {
            self.best = Closest { triangle, distance_squared };
        }
    }

    fn faces(&self, [a, b, c]: [Vec3; 3]) -> bool {
        if self.query.least_cosine <= -1.0 {
            return true;
        }
        let normal = (b - a).cross(c - a);
        normal.dot(self.query.normal) > self.query.least_cosine * normal.length()
    }
}

/// The middle of a triangle.
pub(super) fn center(mesh: &Mesh, triangle: usize) -> Vec3 {
    let [a, b, c] = mesh.corners(triangle);
    (a + b + c) * (1.0 / 3.0)
}

/// The weights of the corners at the point of a triangle that is closest to another point; a third each where it has no area.
pub(super) fn weights_of_closest(corners: [Vec3; 3], point: Vec3) -> Vec3 {
    let [a, b, c] = corners.map(|corner| corner - point);
    let closest = closest_to_origin([a, b, c]);
    let (ab, ac) = (b - a, c - a);
    let across = ab.cross(ac);
    let square = across.length_squared();
    if !(square > 0.0 && square.is_finite()) {
        return Vec3::splat(1.0 / 3.0);
    }
    let to = closest - a;
    let [to_b, to_c] = [to.cross(ac).dot(across) / square, ab.cross(to).dot(across) / square];
    let weights = Vec3::new(1.0 - to_b - to_c, to_b, to_c).clamp(Vec3::ZERO, Vec3::ONE);
    weights / weights.element_sum()
}

/// The point of a triangle that is closest to the origin. Ericson: "Real-Time Collision Detection", 2005, 5.1.5. For triangles
/// without area it is one of their points, not always the closest.
fn closest_to_origin([a, b, c]: [Vec3; 3]) -> Vec3 {
    let ratio = |part: f32, whole: f32| if whole > 0.0 { part / whole } else { 0.0 };
    let (ab, ac) = (b - a, c - a);
    let (d1, d2) = (-ab.dot(a), -ac.dot(a));
    if d1 <= 0.0 && d2 <= 0.0 {
        return a;
    }
    let (d3, d4) = (-ab.dot(b), -ac.dot(b));
    if d3 >= 0.0 && d4 <= d3 {
        return b;
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return a + ab * ratio(d1, d1 - d3);
    }
    let (d5, d6) = (-ab.dot(c), -ac.dot(c));
    if d6 >= 0.0 && d5 <= d6 {
        return c;
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return a + ac * ratio(d2, d2 - d6);
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        return b + (c - b) * ratio(d4 - d3, (d4 - d3) + (d5 - d6));
    }
    let scale = ratio(1.0, va + vb + vc);
    a + ab * (vb * scale) + ac * (vc * scale)
}

#[cfg(test)]
mod tests {
    use super::*;
    use heliodon_math::frame::unit_or;
    use proptest::prelude::*;

    fn vector() -> impl Strategy<Value = Vec3> {
        (-1.0..1.0_f32, -1.0..1.0_f32, -1.0..1.0_f32).prop_map(|(x, y, z)| Vec3::new(x, y, z))
    }

    proptest! {
        #[test]
        fn the_closest_of_all_is_found(
            positions in prop::collection::vec(vector(), 300),
            points in prop::collection::vec(vector(), 20),
            normal in vector(),
            within_m in 0.01..0.5_f32,
        ) {
            let triangles: Vec<[u32; 3]> = (0..298).map(|i| [i, i + 1, i + 2]).collect();
            let mesh = Mesh { positions, triangles, ..Mesh::default() };
            let surface = Surface::new(&mesh);
            for (index, &point) in points.iter().enumerate() {
                for least_cosine in [-1.0, 0.5] {
                    let query = Query { point, normal: unit_or(normal, Vec3::Y), least_cosine };
                    let facing = |t: &usize| {
                        let [a, b, c] = mesh.corners(*t);
                        unit_or((b - a).cross(c - a), Vec3::ZERO).dot(query.normal) > least_cosine
                    };
                    let distance = |t| closest_to_origin(mesh.corners(t).map(|corner| corner - point)).length();
                    let least = (0..298).filter(facing).map(distance).fold(within_m, f32::min);
                    let found = surface.closest(&query, within_m, Some(index as u32));
                    match found {
                        Some(found) => {
                            prop_assert!((found.distance_squared.sqrt() - least).abs() < 1e-6);
                            prop_assert_eq!(found, surface.closest(&query, within_m, None).unwrap());
                        }
                        None => prop_assert!(least >= within_m),
                    }
                }
            }
        }

        #[test]
        fn no_point_of_the_triangle_is_closer(a in vector(), b in vector(), c in vector(), u in 0.0..1.0_f32, v in 0.0..1.0_f32) {
            let closest = closest_to_origin([a, b, c]);
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            prop_assert!(closest.length() <= (a + (b - a) * u + (c - a) * v).length() + 1e-5);
        }
    }
}
