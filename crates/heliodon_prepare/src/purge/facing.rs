//! Triangles that turn their back on all eyes of a room.
//!
//! The distance of an eye to a triangle's plane is linear in the eye, so it is negative all over a box where it is at the corners. That the
//! back is never seen takes more, because both sides of triangles are drawn: the triangle must be part of a closed body with no eye
//! inside. A way from outside to its back then enters the body first, and ends there.

use crate::ViewCell;
use crate::purge::Surface;
use crate::purge::weld::Weld;
use crate::purge::windows::corners_of;
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// The closed bodies of a model.
pub(super) struct Bodies {
    /// Of each triangle, an index into `bodies`, or [`OPEN`].
    of: Vec<u32>,
    bodies: Vec<Body>,
}

/// What is part of no closed body.
const OPEN: u32 = u32::MAX;

#[derive(Clone, Copy)]
struct Body {
    low: Vec3,
    high: Vec3,
    /// Six times the volume it encloses, cubic metres; positive where fronts face outwards.
    volume: f64,
    /// Some point of it, from which its volume is measured.
    start: DVec3,
}

/// Sets of vertices that triangles connect.
struct Sets(Vec<u32>);

impl Sets {
    fn root(&mut self, mut i: u32) -> u32 {
        while self.0[i as usize] != i {
            self.0[i as usize] = self.0[self.0[i as usize] as usize];
            i = self.0[i as usize];
        }
        i
    }

    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b) as usize] = a.min(b);
    }
}

impl Bodies {
    /// What triangles connect by their vertices' positions is closed if every edge is passed as often one way as the other; only those
    /// that face outwards count.
    pub fn new(surface: &Surface, weld: &Weld) -> Self {
        let Surface { positions, triangles, .. } = *surface;
        let mut sets = Sets((0..positions.len() as u32).collect());
        let mut edges: Vec<u64> = Vec::with_capacity(3 * triangles.len());
        let mut body_of_root = vec![0; positions.len()];
        for &triangle in triangles {
            let [a, b, c] = weld.corners(triangle);
            if a == b || b == c || c == a {
                continue;
            }
            sets.join(a, b);
            sets.join(b, c);
            // Which ends, and the way between them as the lowest bit.
            edges.extend(
                [(a, b), (b, c), (c, a)]
                    .map(|(from, to)| u64::from(from.min(to)) << 32 | u64::from(from.max(to)) << 1 | u64::from(from > to)),
            );
        }
        edges.par_sort_unstable();
        for same in edges.chunk_by(|a, b| a >> 1 == b >> 1) {
            let back = same.iter().filter(|edge| *edge & 1 == 1).count();
            if 2 * back != same.len() {
                body_of_root[sets.root((same[0] >> 32) as u32) as usize] = OPEN;
            }
        }
        drop(edges);
        let mut bodies: Vec<Body> = Vec::new();
        let mut of = vec![OPEN; triangles.len()];
        for (body, &triangle) in of.iter_mut().zip(triangles) {
            let root = sets.root(weld.corners(triangle)[0]) as usize;
            let corners = triangle.map(|i| positions[i as usize]);
            if body_of_root[root] == OPEN || !corners.iter().all(|c| c.is_finite()) {
                continue;
            }
            // 0: none yet; otherwise one more than its index
            if body_of_root[root] == 0 {
                bodies.push(Body { low: corners[0], high: corners[0], volume: 0.0, start: corners[0].as_dvec3() });
                body_of_root[root] = bodies.len() as u32;
            }
            *body = body_of_root[root] - 1;
            bodies[*body as usize].add(corners);
        }
        of.iter_mut().filter(|body| **body != OPEN && bodies[**body as usize].volume <= 0.0).for_each(|body| *body = OPEN);
        Self { of, bodies }
    }

    /// For each triangle whether no eye of the box sees its back, because a body is closed around it and none is inside.
    fn hides_backs(&self, surface: &Surface, cell: &ViewCell, margin_m: f32) -> Vec<bool> {
        let (low, high) = (cell.low - margin_m, cell.high + margin_m);
        let mut outside: Vec<bool> =
            self.bodies.iter().map(|body| body.low.cmpgt(high).any() || body.high.cmplt(low).any()).collect();
        // Of those whose bounds meet the box: whether a triangle does, and how often they surround it.
        let near = outside.clone();
        let mut touched = vec![false; self.bodies.len()];
        let mut winding = vec![0.0; self.bodies.len()];
        let eye = (0.5 * cell.low + 0.5 * cell.high).as_dvec3();
        for (&body, triangle) in self.of.iter().zip(surface.triangles) {
            if body != OPEN && !near[body as usize] {
                let corners = triangle.map(|i| surface.positions[i as usize]);
                touched[body as usize] |= may_meet(corners, low, high);
                winding[body as usize] += solid_angle(corners.map(|c| c.as_dvec3() - eye));
            }
        }
        for ((outside, touched), winding) in outside.iter_mut().zip(touched).zip(winding) {
            *outside |= !touched && (winding / (4.0 * std::f64::consts::PI)).abs() < 0.25;
        }
        self.of.iter().map(|&body| body != OPEN && outside[body as usize]).collect()
    }

    /// For each triangle whether all of the box lies behind its plane and nobody sees backs there.
    pub fn turned_away(&self, surface: &Surface, cell: &ViewCell, margin_m: f32) -> Vec<bool> {
        let corners: [DVec3; 8] = corners_of(cell).map(Vec3::as_dvec3);
        let hidden = self.hides_backs(surface, cell, margin_m);
        let turned = |t: usize| {
            if !(hidden[t] || surface.is_single_sided(t)) {
                return false;
            }
            let [a, b, c] = surface.triangles[t].map(|i| surface.positions[i as usize].as_dvec3());
            let normal = (b - a).cross(c - a);
            let limit = -f64::from(margin_m) * normal.length();
            corners.iter().all(|&eye| normal.dot(eye - a) < limit)
        };
        (0..surface.triangles.len()).into_par_iter().map(turned).collect()
    }
}

impl Body {
    fn add(&mut self, corners: [Vec3; 3]) {
        let [a, b, c] = corners.map(|p| p.as_dvec3() - self.start);
        self.volume += a.dot(b.cross(c));
        self.low = corners.into_iter().fold(self.low, Vec3::min);
        self.high = corners.into_iter().fold(self.high, Vec3::max);
    }
}

/// Whether a triangle may meet a box: neither the box's sides nor the triangle's plane keep them apart.
fn may_meet(corners: [Vec3; 3], low: Vec3, high: Vec3) -> bool {
    let [a, b, c] = corners;
    if a.min(b).min(c).cmpgt(high).any() || a.max(b).max(c).cmplt(low).any() {
        return false;
    }
    let [a, b, c, low, high] = [a, b, c, low, high].map(Vec3::as_dvec3);
    let normal = (b - a).cross(c - a);
    let middle = normal.dot(0.5 * (low + high) - a);
    middle.abs() <= normal.abs().dot(0.5 * (high - low))
}

/// The signed solid angle of a triangle seen from the origin, positive if its back is seen (A. Van Oosterom, J. Strackee, "The Solid Angle of a Plane Triangle", IEEE
/// Transactions on Biomedical Engineering 30(2), 1983).
fn solid_angle([a, b, c]: [DVec3; 3]) -> f64 {
    let (la, lb, lc) = (a.length(), b.length(), c.length());
    2.0 * libm::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb)
}

#[cfg(test)]
mod tests {
    use super::*;
    use heliodon_testkit::scenes::{Scene, ball, cuboid};

    fn turned_away(scene: &Scene, low: Vec3, high: Vec3) -> usize {
        let surface = Surface { positions: &scene.positions, triangles: &scene.triangles, single_sided: &[] };
        let bodies = Bodies::new(&surface, &Weld::new(&scene.positions));
        let cell = ViewCell { low, high, windows: Vec::new() };
        bodies.turned_away(&surface, &cell, 1e-5).into_iter().filter(|&turned| turned).count()
    }

    #[test]
    fn of_a_cube_three_sides_turn_away_from_a_box_at_its_corner() {
        // its sides do not share vertices, only positions
        let cube = cuboid(Vec3::ZERO, Vec3::ONE, 2);
        assert_eq!(turned_away(&cube, Vec3::splat(2.0), Vec3::splat(3.0)), 3 * 8);
        assert_eq!(turned_away(&cube, Vec3::new(0.2, 0.2, 2.0), Vec3::new(0.8, 0.8, 3.0)), 5 * 8);
        // from a box that reaches to both sides of a plane, that side is seen by some
        assert_eq!(turned_away(&cube, Vec3::new(-5.0, 2.0, 2.0), Vec3::new(5.0, 3.0, 3.0)), 2 * 8);
    }

    #[test]
    fn backs_count_as_hidden_only_outside_of_closed_bodies_that_face_outwards() {
        let cube = cuboid(Vec3::ZERO, Vec3::ONE, 2);
        let [low, high] = [2.0, 3.0].map(Vec3::splat);
        assert_eq!(turned_away(&cube.clone().inside_out(), low, high), 0, "it is seen from within its walls");
        let mut open = cube.clone();
        open.triangles.pop();
        assert_eq!(turned_away(&open, low, high), 0, "it has a hole");
        // a box inside, and one that reaches in
        assert_eq!(turned_away(&cube, Vec3::splat(0.4), Vec3::splat(0.6)), 0);
        assert_eq!(turned_away(&cube, Vec3::splat(0.4), Vec3::splat(3.0)), 0);
        // in a bowl: within its bounds, but outside of the body
        let mut bowl = ball(1.0, 24);
        // of the lower pole's vertices each rounds in its own way
        bowl.positions.iter_mut().filter(|p| p.y < -0.9999).for_each(|p| *p = Vec3::NEG_Y);
        bowl.positions.iter_mut().filter(|p| p.y > 0.0).for_each(|p| p.y *= -0.5);
        let [low, high] = [Vec3::new(-0.05, -0.3, -0.05), Vec3::new(0.05, -0.2, 0.05)];
        assert_eq!(turned_away(&bowl, low, high), bowl.triangles.len() / 2, "its outside");
    }
}
