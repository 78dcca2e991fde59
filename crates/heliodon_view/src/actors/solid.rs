//! What of an actor can be touched: its triangles as they are posed, asked in the mesh's own space.

use crate::stage::ground::{meets_box, meets_triangle, nearest_of_triangle};
use glam::{Affine3A, Vec3};
use heliodon_math::frame::unit_or;

/// Of a mesh with more triangles only the box is asked, turned as the mesh is: a frame's few questions may cost microseconds, and whoever has so many is
/// looked at rather than held.
const MOST_TRIANGLES: usize = 20_000;

/// An actor's triangles.
#[derive(Clone, Copy, Debug)]
pub struct Solid<'a> {
    /// From the space of the positions to the world.
    pub world_from_mesh: Affine3A,
    /// As they are posed; both sides of what is open, the backs behind the fronts.
    pub positions: &'a [Vec3],
    /// Those that occlude: one side of each.
    pub triangles: &'a [[u32; 3]],
}

impl Solid<'_> {
    /// The box around it in the space of its positions; none without any.
    #[must_use]
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        self.positions.iter().fold(None, |bounds, &p| {
            let (low, high) = bounds.unwrap_or((p, p));
            Some((low.min(p), high.max(p)))
        })
    }

    /// How far away a ray of the world with a unit direction meets it within `reach`, and the unit normal there on the ray's side.
    #[must_use]
    pub fn cast(&self, origin: Vec3, direction: Vec3, reach: f32) -> Option<(f32, Vec3)> {
        let mesh_from_world = self.invertible()?.inverse();
        let from = mesh_from_world.transform_point3(origin);
        let along = mesh_from_world.transform_vector3(direction);
        let stretch = along.length();
        let along = unit_or(along, Vec3::ZERO);
        let mut reach = reach * stretch;
        let (low, high) = self.bounds()?;
        if stretch == 0.0 || !meets_box(from, along, reach, (low, high)) {
            return None;
        }
        let mut met = None;
        if self.triangles.len() > MOST_TRIANGLES {
            met = enters(from, along, (low, high)).filter(|(far, _)| *far < reach);
        } else {
            for triangle in self.triangles {
                let corners = triangle.map(|i| self.positions[i as usize]);
                if let Some((far, normal)) = meets_triangle(from, along, reach, corners) {
                    reach = far;
                    met = Some((far, normal));
                }
            }
        }
        met.map(|(far, normal)| (far / stretch, unit_or(mesh_from_world.matrix3.transpose() * normal, -direction)))
    }

    /// How far its nearest place is from one of the world, within `reach`, and that place.
    #[must_use]
    pub fn nearest(&self, place: Vec3, reach: f32) -> Option<(f32, Vec3)> {
        let world_from_mesh = self.invertible()?;
        let within = world_from_mesh.inverse().transform_point3(place);
        let (low, high) = self.bounds()?;
        let in_world = |point: Vec3| {
            let point = world_from_mesh.transform_point3(point);
            (point.distance(place), point)
        };
        let by_box = in_world(within.clamp(low, high));
        if by_box.0 >= reach || self.triangles.len() > MOST_TRIANGLES {
            return Some(by_box).filter(|(far, _)| *far < reach);
        }
        let corners = self.triangles.iter().map(|triangle| triangle.map(|i| self.positions[i as usize]));
        let places = corners.map(|corners| in_world(nearest_of_triangle(within, corners)));
        places.min_by(|a, b| a.0.total_cmp(&b.0)).filter(|(far, _)| *far < reach)
    }

    /// Its place, where that can be undone.
    fn invertible(&self) -> Option<Affine3A> {
        let determinant = self.world_from_mesh.matrix3.determinant();
        (determinant != 0.0 && determinant.is_finite()).then_some(self.world_from_mesh)
    }
}

/// How far along a unit direction a ray enters a box, and the unit normal of the side; at once where it begins inside.
#[must_use]
pub fn enters(origin: Vec3, direction: Vec3, (low, high): (Vec3, Vec3)) -> Option<(f32, Vec3)> {
    let inverse = direction.recip();
    let (a, b) = ((low - origin) * inverse, (high - origin) * inverse);
    let (near, far) = (a.min(b), a.max(b).min_element());
    let begins = near.max_element();
    if begins > far || far < 0.0 {
        return None;
    }
    let side = [Vec3::X, Vec3::Y, Vec3::Z][near.max_position()];
    Some((begins.max(0.0), if begins < 0.0 { -direction } else { -side * side.dot(direction).signum() }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Quat;

    const CORNERS: [Vec3; 3] = [Vec3::new(-1.0, -1.0, 0.0), Vec3::new(1.0, -1.0, 0.0), Vec3::new(0.0, 1.0, 0.5)];

    fn solid(world_from_mesh: Affine3A) -> Solid<'static> {
        Solid { world_from_mesh, positions: &CORNERS, triangles: &[[0, 1, 2]] }
    }

    #[test]
    fn triangles_are_met_where_they_are_and_not_where_their_box_is() {
        let turn = Quat::from_rotation_y(0.7) * Quat::from_rotation_x(0.4);
        let place = Affine3A::from_scale_rotation_translation(Vec3::splat(2.0), turn, Vec3::new(5.0, 1.0, -3.0));
        let at = |p: Vec3| place.transform_point3(p);
        let middle = at((CORNERS[0] + CORNERS[1] + CORNERS[2]) / 3.0);
        let along = turn * Vec3::NEG_Z;
        let (far, normal) = solid(place).cast(middle - along * 3.0, along, 10.0).unwrap();
        assert!((far - 3.0).abs() < 1e-4, "{far}");
        let wanted = (turn * (CORNERS[1] - CORNERS[0]).cross(CORNERS[2] - CORNERS[0])).normalize_or_zero();
        assert!(normal.dot(wanted).abs() > 0.9999 && normal.dot(along) < 0.0);
        assert!(solid(place).cast(middle - along * 3.0, along, 2.9).is_none(), "out of reach");
        // beside the triangle, within its box
        let beside = at(Vec3::new(-0.9, 0.9, 0.25));
        assert!(solid(place).cast(beside - along * 3.0, along, 10.0).is_none());
        let (far, nearest) = solid(place).nearest(middle + normal * 0.3, 0.5).unwrap();
        assert!((far - 0.3).abs() < 1e-4 && nearest.abs_diff_eq(middle, 1e-4));
        assert!(solid(place).nearest(middle + normal * 0.3, 0.2).is_none());
    }

    #[test]
    fn what_is_flat_or_empty_is_not_met() {
        let flat = Affine3A::from_scale(Vec3::new(1.0, 1.0, 0.0));
        assert!(solid(flat).cast(Vec3::Z, Vec3::NEG_Z, 10.0).is_none() && solid(flat).nearest(Vec3::ZERO, 1.0).is_none());
        let nothing = Solid { world_from_mesh: Affine3A::IDENTITY, positions: &[], triangles: &[] };
        assert!(nothing.cast(Vec3::Z, Vec3::NEG_Z, 10.0).is_none() && nothing.bounds().is_none());
    }

    #[test]
    fn a_box_is_entered_where_it_begins() {
        let unit = (Vec3::ZERO, Vec3::ONE);
        assert_eq!(enters(Vec3::new(0.5, 0.5, 3.0), Vec3::NEG_Z, unit), Some((2.0, Vec3::Z)));
        assert_eq!(enters(Vec3::splat(0.5), Vec3::NEG_Z, unit), Some((0.0, Vec3::Z)));
        assert_eq!(enters(Vec3::new(0.5, 0.5, 3.0), Vec3::Z, unit), None);
        assert_eq!(enters(Vec3::new(1.5, 0.5, 3.0), Vec3::NEG_Z, unit), None);
    }
}
