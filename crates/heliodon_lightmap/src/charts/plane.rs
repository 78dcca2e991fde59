//! A chart's plane: triangles are laid onto it straight along their common normal, and turned so that they take the least rectangle.

use glam::{Vec2, Vec3};
use heliodon_math::frame::{orthonormal_basis, unit_or};

/// The plane of a chart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Unit directions in space in which the chart's own coordinates grow.
    pub axes: [Vec3; 2],
    /// A place on it, metres, so that coordinates stay small far from the origin.
    pub origin: Vec3,
}

impl Plane {
    /// Through a place, square to a normal; zero stands for any.
    pub fn new(normal: Vec3, origin: Vec3) -> Self {
        let (u, v) = orthonormal_basis(unit_or(normal, Vec3::Z));
        Self { axes: [u, v], origin }
    }

    /// The coordinates of a place, metres.
    #[must_use]
    pub fn project(&self, place: Vec3) -> Vec2 {
        let from = place - self.origin;
        Vec2::new(from.dot(self.axes[0]), from.dot(self.axes[1]))
    }

    /// Turned in itself so that these coordinates take the least rectangle, its longer side along the first axis.
    pub fn turned_tightly(self, coordinates: &[Vec2]) -> Self {
        let hull = hull(coordinates.to_vec());
        let sides = hull.iter().zip(hull.iter().cycle().skip(1)).filter_map(|(a, b)| (b - a).try_normalize());
        let rectangle = |along: Vec2| {
            let extent = |axis: Vec2| {
                let (low, high) = hull
                    .iter()
                    .map(|p| p.dot(axis))
                    .fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
                high - low
            };
            Vec2::new(extent(along), extent(along.perp()))
        };
        let tightest = sides.map(|along| (rectangle(along), along)).min_by(|a, b| (a.0.x * a.0.y).total_cmp(&(b.0.x * b.0.y)));
        let Some((size, along)) = tightest else { return self };
        let along = if size.y > size.x { along.perp() } else { along };
        let [u, v] = self.axes;
        let turned = u * along.x + v * along.y;
        let across = u * -along.y + v * along.x;
        Self { axes: [turned, across], ..self }
    }
}

/// The convex hull, anticlockwise (A. M. Andrew: "Another efficient algorithm for convex hulls in two dimensions", 1979).
fn hull(mut points: Vec<Vec2>) -> Vec<Vec2> {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    points.dedup();
    if points.len() < 3 {
        return points;
    }
    let half = |points: &mut dyn Iterator<Item = Vec2>| {
        let mut chain: Vec<Vec2> = Vec::new();
        for p in points {
            while let [.., a, b] = chain[..] {
                if (b - a).perp_dot(p - b) > 0.0 {
                    break;
                }
                chain.pop();
            }
            chain.push(p);
        }
        chain.pop();
        chain
    };
    let mut lower = half(&mut points.iter().copied());
    lower.append(&mut half(&mut points.iter().rev().copied()));
    lower
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tilted_plank_is_laid_straight() {
        let plane = Plane::new(Vec3::new(1.0, 2.0, 3.0), Vec3::splat(7.0));
        let [u, v] = plane.axes;
        let (sin, cos) = (libm::sinf(0.7), libm::cosf(0.7));
        let at = |x: f32, y: f32| plane.origin + u * (x * cos - y * sin) + v * (x * sin + y * cos);
        let corners = [at(0.0, 0.0), at(1.0, 0.0), at(1.0, 5.0), at(0.0, 5.0), at(0.5, 2.0)];
        let turned = plane.turned_tightly(&corners.map(|p| plane.project(p)));
        let laid = corners.map(|p| turned.project(p));
        let (low, high) = laid.iter().fold((laid[0], laid[0]), |(low, high), p| (low.min(*p), high.max(*p)));
        assert!((high - low - Vec2::new(5.0, 1.0)).length() < 1e-5, "{low} {high}");
        assert!((turned.axes[0].cross(turned.axes[1]) - u.cross(v)).length() < 1e-6, "not mirrored");
    }

    #[test]
    fn a_line_and_a_point_have_planes_too() {
        let plane = Plane::new(Vec3::ZERO, Vec3::ZERO);
        assert_eq!(plane.turned_tightly(&[Vec2::ONE; 3]), plane);
        let line = plane.turned_tightly(&[Vec2::ZERO, Vec2::ONE, Vec2::splat(2.0)]);
        assert!(line.axes.iter().all(|axis| (axis.length() - 1.0).abs() < 1e-6));
    }
}
