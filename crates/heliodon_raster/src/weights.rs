//! What a pixel takes from a triangle's corners.

use crate::corners::{Corner, FRACTION, HALF, cross};
use crate::perspective::Perspective;
use glam::{DMat3, DVec3, Vec3};

/// The weights of a triangle's corners over its pixels, in perspective.
///
/// What a corner gives, times how near the place is, is linear on the picture, and so is how near it is (J. Blinn, "Hyperbolic Interpolation",
/// IEEE Computer Graphics and Applications 12(4), 1992).
#[derive(Clone, Copy, Debug)]
pub struct Weights {
    /// From where pixels are counted.
    from: [f32; 2],
    /// Of the second corner, of the third, and of all: at `from`, for each column and for each row.
    planes: [[f32; 3]; 3],
}

impl Weights {
    /// Of no triangle.
    pub const NONE: Self = Self { from: [0.0; 2], planes: [[0.0; 3], [0.0; 3], [1.0, 0.0, 0.0]] };

    pub(crate) fn new(perspective: &Perspective, size: [usize; 2], points: [Vec3; 3]) -> Self {
        let places = points.map(|point| perspective.place(point));
        let corners = places.map(|place| Corner::new(perspective, size, place));
        let [a, b, c] = corners;
        let doubled = cross(a, b, c.x, c.y);
        if a.beyond | b.beyond | c.beyond == 0 && doubled != 0 {
            // The same corners that are drawn, so that no pixel of the triangle lies outside of it.
            let share = (1 << FRACTION) as f32 / doubled as f32;
            let part = |by: f32, p: Corner, q: Corner| [(p.y - q.y) as f32 * by, (q.x - p.x) as f32 * by];
            let [to_b, to_c] = [part(share, c, a), part(share, a, b)];
            let near = |[x, y]: [f32; 2], nearness: f32| [0.0, x * nearness, y * nearness];
            let whole = [0, 1].map(|k| to_b[k] * (b.nearness - a.nearness) + to_c[k] * (c.nearness - a.nearness));
            let from = [a.x, a.y].map(|at| (at - HALF) as f32 / (1 << FRACTION) as f32);
            let planes = [near(to_b, b.nearness), near(to_c, c.nearness), [a.nearness, whole[0], whole[1]]];
            return Self { from, planes };
        }
        // A triangle that reaches behind the eye: its corners' places are the columns of what takes weights to the picture, in [-1, 1] and 1.
        let [a, b, c] = places.map(|[x, y, w]| DVec3::new(x.into(), y.into(), w.into()));
        let scale = 1.0 / DMat3::from_cols(a, b, c).determinant();
        let scale = if scale.is_finite() { scale } else { 1.0 };
        let plane = |row: DVec3| {
            let [x, y] = [row.x / size[0] as f64, row.y / size[1] as f64];
            [row.z + x + y - row.x - row.y, 2.0 * x, 2.0 * y].map(|v| (v * scale) as f32)
        };
        let [to_a, to_b, to_c] = [b.cross(c), c.cross(a), a.cross(b)];
        Self { from: [0.0; 2], planes: [plane(to_b), plane(to_c), plane(to_a + to_b + to_c)] }
    }

    /// Of the second and the third corner at the middle of a pixel, in columns from the left and rows from the lowest; that of the first is what
    /// is left of 1. Between 0 and 1 where the triangle is drawn, up to rounding.
    #[inline(always)]
    #[must_use]
    pub fn at(&self, column: usize, row: usize) -> [f32; 2] {
        let [x, y] = [column as f32 - self.from[0], row as f32 - self.from[1]];
        let [to_b, to_c, all] = self.planes.map(|[at, right, up]| at + right * x + up * y);
        let whole = 1.0 / all;
        [to_b * whole, to_c * whole]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Group, ItemBuffer, NOTHING};
    use glam::vec3;

    /// How many pixels a triangle has; each must show the place that its weights tell.
    fn checked(triangle: [Vec3; 3]) -> usize {
        let eye = Perspective { eye: vec3(0.3, -0.2, 1.0), axes: [Vec3::X * 1.2, Vec3::Y * 1.8, Vec3::NEG_Z], near_m: 0.1 };
        let [width, height] = [300, 200];
        let mut picture = ItemBuffer::new(width, height);
        let axes: [[f32; 3]; 3] = core::array::from_fn(|axis| triangle.map(|point| point[axis]));
        let group = Group { points: axes.each_ref().map(|axis| &axis[..]), triangles: &[[0, 1, 2]] };
        picture.draw(&eye, group, |_| 3, |_| false);
        let weights = picture.weights(&eye, triangle);
        let mut drawn = 0;
        for (y, row) in picture.rows().enumerate() {
            for (x, _) in row.iter().enumerate().filter(|&(_, &id)| id != NOTHING) {
                let [b, c] = weights.at(x, y);
                let a = 1.0 - b - c;
                assert!([a, b, c].iter().all(|weight| (-1e-3..1.001).contains(weight)), "{a} {b} {c}");
                let [right, up, forward] = eye.place(triangle[0] * a + triangle[1] * b + triangle[2] * c);
                let seen = [right, up].map(|way| (way / forward + 1.0) * 0.5);
                // corners are rounded to 1/256 of a pixel
                assert!((seen[0] * width as f32 - x as f32 - 0.5).abs() < 0.02, "{seen:?} at {x}, {y}");
                assert!((seen[1] * height as f32 - y as f32 - 0.5).abs() < 0.02, "{seen:?} at {x}, {y}");
                drawn += 1;
            }
        }
        drawn
    }

    #[test]
    fn weights_are_those_of_the_place_that_a_pixel_shows() {
        let [a, b, c] = [vec3(-3.0, -1.0, -4.0), vec3(2.0, -1.5, -9.0), vec3(0.5, 2.0, -6.0)];
        for triangle in [[a, b, c], [b, a, c]] {
            assert!(checked(triangle) > 5000);
        }
        let behind = [vec3(-3.0, -1.0, 4.0), vec3(2.0, -1.5, -9.0), vec3(0.5, 2.0, -6.0)];
        assert!(checked(behind) > 5000, "it reaches behind the eye");
        let far = [vec3(-3.0, -1.0, -4.0), vec3(900.0, -1.5, -9.0), vec3(0.5, 2.0, -6.0)];
        assert!(checked(far) > 5000, "it reaches far beyond the picture");
        let small = [vec3(0.3, -0.2, -60.0), vec3(0.6, -0.2, -61.0), vec3(0.3, 0.3, -60.0)];
        assert!((1..12).contains(&checked(small)));
    }

    #[test]
    fn what_has_no_area_has_weights_that_do_not_fail() {
        let eye = Perspective { eye: Vec3::ZERO, axes: [Vec3::X, Vec3::Y, Vec3::NEG_Z], near_m: 0.1 };
        let _ = ItemBuffer::new(32, 32).weights(&eye, [Vec3::NEG_Z; 3]).at(3, 4);
    }
}
