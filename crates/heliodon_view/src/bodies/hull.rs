//! What a thing is made of for bodies: the convex hull of a few hundred of its vertices.
//!
//! A model may have a hundred thousand vertices, and a hull of all of them hundreds of faces that each contact asks. Instead the farthest vertices along
//! evenly spread directions span it: exact for boxes, wedges and prisms, and for round things within 1% of their size, as 258 directions lie 14 degrees apart.

use avian3d::prelude::{Collider, ComputeMassProperties3d, Position, Rotation};
use glam::{Quat, Vec3};
use heliodon_math::light_sphere::LightSphere;

/// Level of the sphere of directions: 258 of them.
const LEVEL: u32 = 3;
/// What is thinner counts as a plate of this thickness, metres: the solver lets bodies sink into one another by half of it.
const THINNEST_M: f32 = 0.01;

/// Less is no volume, cubic metres: a hull around a leaning sheet, which would weigh nothing.
const LEAST_M3: f32 = 1e-7;

/// A thing's shape, in its model's space.
#[derive(Clone, Debug, PartialEq)]
pub struct Hull {
    corners: Vec<Vec3>,
    bounds: (Vec3, Vec3),
}

impl Hull {
    /// Around vertices; none where none of them is finite.
    #[must_use]
    pub fn around(positions: &[Vec3]) -> Option<Self> {
        let finite = || positions.iter().copied().filter(|p| p.is_finite());
        let (low, high) = finite().map(|p| (p, p)).reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))?;
        if (high - low).min_element() < THINNEST_M {
            let (middle, half) = ((low + high) * 0.5, ((high - low) * 0.5).max(Vec3::splat(0.5 * THINNEST_M)));
            return Some(Self::cuboid(middle - half, middle + half));
        }
        let mut corners: Vec<Vec3> = Vec::new();
        for &direction in LightSphere::new(LEVEL).directions() {
            let along = |p: &Vec3| p.dot(direction);
            let farthest = finite().max_by(|a, b| along(a).total_cmp(&along(b)));
            corners.extend(farthest.filter(|p| !corners.contains(p)));
        }
        Some(Self { corners, bounds: (low, high) })
    }

    /// A box.
    #[must_use]
    pub fn cuboid(low: Vec3, high: Vec3) -> Self {
        let corner = |i: usize| Vec3::select(glam::BVec3::new(i & 1 > 0, i & 2 > 0, i & 4 > 0), high, low);
        Self { corners: (0..8).map(corner).collect(), bounds: (low, high) }
    }

    /// The farthest that any of it is from the model's origin, metres, at a scale.
    #[must_use]
    pub fn reach_m(&self, scale: Vec3) -> f32 {
        self.corners.iter().map(|&p| (p * scale).length()).fold(0.0, f32::max)
    }

    /// The collider at a scale: the hull, or the box around what has none.
    #[must_use]
    pub fn collider(&self, scale: Vec3) -> Collider {
        let hull = Collider::convex_hull(self.corners.iter().map(|&p| p * scale).collect());
        hull.filter(|hull| hull.mass(1.0) > LEAST_M3).unwrap_or_else(|| {
            let (low, high) = (self.bounds.0 * scale, self.bounds.1 * scale);
            let size = (high - low).abs().max(Vec3::splat(THINNEST_M));
            let middle = Position((low + high) * 0.5);
            Collider::compound(vec![(middle, Rotation(Quat::IDENTITY), Collider::cuboid(size.x, size.y, size.z))])
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use heliodon_testkit::scenes::ball;

    fn volume(hull: &Hull) -> f32 {
        hull.collider(Vec3::ONE).mass(1.0)
    }

    #[test]
    fn boxes_are_exact_and_balls_nearly() {
        let cuboid = Hull::around(&Hull::cuboid(Vec3::new(-0.1, 0.0, -0.2), Vec3::new(0.1, 0.5, 0.2)).corners).unwrap();
        assert!((volume(&cuboid) - 0.04).abs() < 1e-5, "{}", volume(&cuboid));
        let round = Hull::around(&ball(0.3, 40).positions).unwrap();
        let exact = 4.0 / 3.0 * std::f32::consts::PI * 0.027;
        assert!(round.corners.len() <= 258 && (volume(&round) / exact - 1.0).abs() < 0.06, "{} of {exact}", volume(&round));
        assert!((round.reach_m(Vec3::splat(2.0)) - 0.6).abs() < 1e-3);
    }

    #[test]
    fn what_has_no_hull_is_a_box() {
        assert_eq!(Hull::around(&[]), None);
        assert_eq!(Hull::around(&[Vec3::NAN, Vec3::INFINITY]), None);
        for positions in [
            vec![Vec3::ONE],
            vec![Vec3::ZERO, Vec3::X],
            vec![Vec3::ZERO, Vec3::X, Vec3::Z, Vec3::X + Vec3::Z],
            // a leaning sheet, flat in no axis
            vec![Vec3::ZERO, Vec3::ONE, Vec3::new(1.0, 0.0, 1.0), Vec3::new(0.0, 1.0, 0.0)],
            vec![Vec3::NAN, Vec3::ZERO, Vec3::X, Vec3::Y],
        ] {
            let hull = Hull::around(&positions).unwrap();
            let mass = volume(&hull);
            assert!(mass.is_finite() && mass > 0.0, "{positions:?}: {mass}");
        }
    }
}
