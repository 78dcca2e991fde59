//! Where points are seen from an eye.

use glam::Vec3;

/// An eye's view through a rectangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Perspective {
    /// The eye.
    pub eye: Vec3,
    /// What a way from the eye is multiplied by: to the right, up, and how far along forward, metres. What is seen lies no farther to a side
    /// than along forward: the first two are unit vectors where the view is 90 degrees wide and high, else the first two rows of its
    /// projection. Right x up points at the eye.
    pub axes: [Vec3; 3],
    /// What is nearer, along forward, is not drawn, metres; above 0.
    pub near_m: f32,
}

/// A point before an eye: right, up, and how far along forward; seen where the first two are not greater than the third.
pub type Place = [f32; 3];

/// How far beyond its borders points of a view are still placed on its picture, in multiples of its half width. Triangles that reach
/// farther are cut, those that do not need not be.
pub(crate) const GUARD: f32 = 4.0;

impl Perspective {
    /// A point as it is seen.
    #[inline(always)]
    #[must_use]
    pub fn place(&self, point: Vec3) -> Place {
        let way = point - self.eye;
        self.axes.map(|axis| axis.dot(way))
    }

    /// Which of the near plane and the four planes at `reach` half widths a point is beyond, in bits 0 to 4.
    #[inline(always)]
    #[must_use]
    pub fn beyond(&self, [x, y, w]: Place, reach: f32) -> u32 {
        let limit = reach * w;
        // Asked for what is within, so that what is not a number is beyond all.
        let within = [w >= self.near_m, x <= limit, -x <= limit, y <= limit, -y <= limit];
        within.into_iter().enumerate().fold(0, |beyond, (plane, within)| beyond | u32::from(!within) << plane)
    }

    /// What is left of a polygon before the near plane and within `reach` half widths. A new corner is computed from the end of the edge
    /// that stays, so that triangles which share an edge are cut at the same point of it.
    pub(crate) fn cut(&self, polygon: &mut Vec<Place>, spare: &mut Vec<Place>, reach: f32) {
        let inside = |plane: usize, [x, y, w]: Place| match plane {
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
    fn what_is_cut_lies_before_the_eye_and_within() {
        let face = Perspective { eye: Vec3::ZERO, axes: [Vec3::X, Vec3::Y, Vec3::NEG_Z], near_m: 0.1 };
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
