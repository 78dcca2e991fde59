//! The points at which light is solved, in an order in which neighbours in space lie together.

use crate::Surfaces;
use glam::Vec3;
use heliodon_rays::beam_order;
use std::ops::Range;

/// Points with normals, already lifted off their surface, sorted so that parallel rays from a run of them form a tight beam.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PointSet {
    /// Where rays start, in metres.
    pub origins: Vec<Vec3>,
    /// Unit normals, or zero where there is none: such a point sends no rays.
    pub normals: Vec<Vec3>,
    /// What each point stands for; see [`crate::Layout`].
    pub sites: Vec<u32>,
    /// Points whose origin was moved along the surface too (see [`inward_shifts`]), ascending, and where they would start
    /// otherwise.
    pub(crate) unmoved: Vec<(u32, Vec3)>,
}

/// Points that are moved along the surface by less than this part of the offset count as unmoved.
const MOVED: f32 = 0.1;

impl PointSet {
    /// The vertices alone, site `i` being vertex `i`: all that sun masks need.
    #[must_use]
    pub fn at_vertices(surfaces: &Surfaces, offset_m: f32) -> Self {
        let inward = inward_shifts(surfaces.positions, surfaces.triangles);
        let place = |v: u32| Place {
            position: surfaces.positions[v as usize],
            normal: surfaces.normals[v as usize],
            inward: inward[v as usize],
            lift_m: offset_m + surfaces.vertex_clearance_m(v as usize),
            site: v,
        };
        Self::new((0..surfaces.positions.len() as u32).map(place))
    }

    /// How many points there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.sites.len()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.sites.is_empty()
    }

    /// Origins and normals of some points.
    pub(crate) fn run(&self, range: Range<usize>) -> (&[Vec3], &[Vec3]) {
        (&self.origins[range.clone()], &self.normals[range])
    }

    /// Points at places, sorted.
    pub(crate) fn new(places: impl Iterator<Item = Place>) -> Self {
        let new: Vec<Place> = places.map(Place::cleaned).collect();
        let mut set = Self::default();
        let (positions, normals): (Vec<Vec3>, Vec<Vec3>) = new.iter().map(|p| (p.position, p.normal)).unzip();
        let order = beam_order(&positions, Some(&normals));
        for &i in &order {
            let Place { position, normal, inward, lift_m, .. } = new[i as usize];
            let along = inward - normal * inward.dot(normal);
            if along.length() > MOVED {
                set.unmoved.push((set.origins.len() as u32, position + normal * lift_m));
            }
            set.origins.push(position + (normal + along) * lift_m);
        }
        set.normals = order.iter().map(|&i| new[i as usize].normal).collect();
        set.sites = order.iter().map(|&i| new[i as usize].site).collect();
        set
    }

    /// Adds points behind the others.
    pub(crate) fn append(&mut self, mut more: Self) {
        let first = self.len() as u32;
        self.unmoved.extend(more.unmoved.into_iter().map(|(point, origin)| (first + point, origin)));
        self.origins.append(&mut more.origins);
        self.normals.append(&mut more.normals);
        self.sites.append(&mut more.sites);
    }
}

/// A point before it is lifted off the surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    pub position: Vec3,
    pub normal: Vec3,
    /// Where the surface lies, seen from the point; see [`inward_shifts`].
    pub inward: Vec3,
    /// How far off the surface rays start, metres.
    pub lift_m: f32,
    pub site: u32,
}

impl Place {
    /// A point that is nowhere sends no rays, and must not spoil the others' order.
    fn cleaned(self) -> Self {
        if !self.position.is_finite() {
            return Self { position: Vec3::ZERO, normal: Vec3::ZERO, inward: Vec3::ZERO, ..self };
        }
        let inward = if self.inward.is_finite() { self.inward } else { Vec3::ZERO };
        Self { normal: normal_or_zero(self.normal), inward, ..self }
    }
}

/// For every vertex the mean vector to its neighbours, over their mean distance: near zero amid a surface, about a half
/// inwards at its rim.
///
/// A wall's lowest vertices lie in the very plane of the floor that they stand on. Lifted along the wall's normal alone they
/// stay in it, and whether their rays into the floor meet it is a matter of rounding: light leaks in along every inner edge. So
/// points are lifted by the offset times the normal and this vector's part along the surface: vertices of a rim move off the
/// planes that meet there, those amid a surface stay where they are.
pub(crate) fn inward_shifts(positions: &[Vec3], triangles: &[[u32; 3]]) -> Vec<Vec3> {
    let mut sums = vec![(Vec3::ZERO, 0.0_f32); positions.len()];
    for t in triangles {
        let corners = t.map(|i| positions[i as usize]);
        for k in 0..3 {
            let (sum, distances) = &mut sums[t[k] as usize];
            for other in [corners[(k + 1) % 3], corners[(k + 2) % 3]] {
                *sum += other - corners[k];
                *distances += other.distance(corners[k]);
            }
        }
    }
    sums.into_iter().map(|(sum, distances)| if distances > 0.0 { sum / distances } else { Vec3::ZERO }).collect()
}

/// A normal that is a unit vector, or zero.
fn normal_or_zero(normal: Vec3) -> Vec3 {
    if normal.is_finite() { normal.try_normalize().unwrap_or(Vec3::ZERO) } else { Vec3::ZERO }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn place(position: Vec3, normal: Vec3, site: u32) -> Place {
        Place { position, normal, inward: Vec3::ZERO, lift_m: 0.5, site }
    }

    #[test]
    fn neighbours_in_the_order_are_neighbours_in_space() {
        let side = 32_u32;
        let points = (0..side * side).map(|i| place(Vec3::new((i % side) as f32, 0.0, (i / side) as f32), Vec3::Y, i));
        let set = PointSet::new(points);
        // 64 consecutive points of a square grid fill a square of 8 x 8
        for run in set.origins.chunks(64) {
            let low = run.iter().copied().reduce(Vec3::min).unwrap();
            let high = run.iter().copied().reduce(Vec3::max).unwrap();
            assert!((high - low).max_element() <= 8.0, "{low} {high}");
        }
        let mut sites = set.sites.clone();
        sites.sort_unstable();
        assert!(sites.iter().enumerate().all(|(i, &s)| i as u32 == s));
    }

    #[test]
    fn points_that_are_nowhere_have_no_normal() {
        let places = [place(Vec3::NAN, Vec3::Y, 0), place(Vec3::ONE, Vec3::NAN, 1), place(Vec3::ONE, Vec3::Y * 2.0, 2)];
        let set = PointSet::new(places.into_iter());
        for (site, normal) in set.sites.iter().zip(&set.normals) {
            assert_eq!(*normal, if *site == 2 { Vec3::Y } else { Vec3::ZERO });
        }
        assert!(set.origins.iter().all(|o| o.is_finite()));
    }
}
