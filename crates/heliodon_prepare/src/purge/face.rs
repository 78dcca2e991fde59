//! One side of the cube of pictures around an eye.

use glam::{Mat3, Quat, Vec3};
use heliodon_math::random::{hash2_u32, unit_f32};

/// An eye's view through one square of the cube around it: 90 degrees wide.
#[derive(Clone, Copy)]
pub(super) struct Face {
    pub eye: Vec3,
    /// Its right, up and forward, unit vectors; right x up points at the eye.
    pub axes: [Vec3; 3],
    /// What is nearer, along forward, is not drawn, metres.
    pub near_m: f32,
}

/// The six faces of a cube turned at random, so that no two eyes cut the world along the same lines.
pub(super) fn cube(eye: Vec3, near_m: f32, seed: u32) -> [Face; 6] {
    // K. Shoemake, "Uniform Random Rotations", Graphics Gems III, 1992.
    let [a, b, c] = core::array::from_fn(|i| unit_f32(hash2_u32(seed, i as u32)));
    let (s1, c1) = libm::sincosf(std::f32::consts::TAU * b);
    let (s2, c2) = libm::sincosf(std::f32::consts::TAU * c);
    let (flat, steep) = ((1.0 - a).sqrt(), a.sqrt());
    let turn = Mat3::from_quat(Quat::from_xyzw(flat * s1, flat * c1, steep * s2, steep * c2));
    let [x, y, z] = [turn.x_axis, turn.y_axis, turn.z_axis];
    [[x, y, -z], [-x, y, z], [z, y, x], [-z, y, -x], [x, -z, -y], [x, z, y]].map(|axes| Face { eye, axes, near_m })
}

/// A point before a face: right, up, and how far along forward; seen where the first two are not greater than the third.
pub(super) type Before = [f32; 3];

/// How far beyond its borders points of a face are still placed on its picture, in multiples of its half width. Triangles that reach
/// farther are cut, those that do not need not be.
pub(super) const GUARD: f32 = 4.0;

impl Face {
    #[inline(always)]
    pub fn place(&self, point: Vec3) -> Before {
        let way = point - self.eye;
        self.axes.map(|axis| axis.dot(way))
    }

    /// Which of the near plane and the four planes at `reach` half widths a point is beyond.
    #[inline(always)]
    pub fn beyond(&self, [x, y, w]: Before, reach: f32) -> u32 {
        let limit = reach * w;
        // Asked for what is within, so that what is not a number is beyond all.
        let within = [w >= self.near_m, x <= limit, -x <= limit, y <= limit, -y <= limit];
        within.into_iter().enumerate().fold(0, |beyond, (plane, within)| beyond | u32::from(!within) << plane)
    }

    /// What is left of a polygon before the near plane and within `reach` half widths. A new corner is computed from the end of the edge
    /// that stays, so that triangles which share an edge are cut at the same point of it.
    pub fn cut(&self, polygon: &mut Vec<Before>, spare: &mut Vec<Before>, reach: f32) {
        let inside = |plane: usize, [x, y, w]: Before| match plane {
            0 => w - self.near_m,
            1 => reach * w - x,
            2 => reach * w + x,
            3 => reach * w - y,
            _ => reach * w + y,
        };
        for plane in 0..5 {
            spare.clear();
            for (i, &at) in polygon.iter().enumerate() {
                let before = polygon[(i + polygon.len() - 1) % polygon.len()];
                let (of_before, of_at) = (inside(plane, before), inside(plane, at));
                if (of_before >= 0.0) != (of_at >= 0.0) {
                    let (stays, goes, a, b) =
                        if of_at >= 0.0 { (at, before, of_at, of_before) } else { (before, at, of_before, of_at) };
                    let share = a / (a - b);
                    spare.push(core::array::from_fn(|axis| stays[axis] + share * (goes[axis] - stays[axis])));
                }
                if of_at >= 0.0 {
                    spare.push(at);
                }
            }
            std::mem::swap(polygon, spare);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn six_faces_see_every_direction_once() {
        let faces = cube(Vec3::new(1.0, 2.0, 3.0), 0.01, 17);
        for face in faces {
            let [right, up, forward] = face.axes;
            assert!((right.cross(up) + forward).length() < 1e-5);
        }
        for d in heliodon_math::sphere::fibonacci_sphere(5000) {
            let seen = faces.iter().filter(|f| f.beyond(f.place(f.eye + d), 1.0) == 0).count();
            // rounding may give one at an edge to both faces or to none
            assert!(seen == 1 || faces.iter().filter(|f| f.beyond(f.place(f.eye + d), 1.0001) == 0).count() > 1, "{d}");
        }
    }

    #[test]
    fn what_is_cut_lies_before_the_eye_and_within() {
        let [face, ..] = cube(Vec3::ZERO, 0.1, 3);
        let mut polygon = vec![[-30.0, -1.0, -5.0], [50.0, -1.0, 2.0], [0.0, 3.0, 9.0]];
        face.cut(&mut polygon, &mut Vec::new(), GUARD);
        assert!(polygon.len() >= 3);
        for &[x, y, w] in &polygon {
            assert!(w > 0.0999 && x.abs() < GUARD * w * 1.0001 && y.abs() < GUARD * w * 1.0001, "{x} {y} {w}");
        }
        let mut behind = vec![[0.0, 0.0, -1.0], [1.0, 0.0, -1.0], [0.0, 1.0, 0.0]];
        face.cut(&mut behind, &mut Vec::new(), GUARD);
        assert!(behind.is_empty());
    }
}
