//! The points at which light is solved, in an order in which neighbours in space lie together.

use crate::Surfaces;
use glam::Vec3;
use rayon::prelude::*;

/// Points with normals, already lifted off their surface, sorted so that parallel rays from a run of them form a tight beam.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PointSet {
    /// Where rays start, in metres.
    pub origins: Vec<Vec3>,
    /// Unit normals, or zero where there is none: such a point sends no rays.
    pub normals: Vec<Vec3>,
    /// What each point stands for; see [`crate::Layout`].
    pub sites: Vec<u32>,
}

impl PointSet {
    /// The vertices alone, site `i` being vertex `i`: all that sun masks need.
    #[must_use]
    pub fn at_vertices(surfaces: &Surfaces, offset_m: f32) -> Self {
        let mut points = Self::default();
        points.extend_with(
            (0..surfaces.positions.len() as u32).map(|v| (surfaces.positions[v as usize], surfaces.normals[v as usize], v)),
            offset_m,
        );
        points
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

    /// Appends points (place on the surface, normal, site), sorted among themselves.
    pub(crate) fn extend_with(&mut self, new: impl Iterator<Item = (Vec3, Vec3, u32)>, offset_m: f32) {
        let new: Vec<(Vec3, Vec3, u32)> = new
            .map(|(position, normal, site)| {
                // a point that is nowhere sends no rays, and must not spoil the others' order
                if position.is_finite() { (position, normal_or_zero(normal), site) } else { (Vec3::ZERO, Vec3::ZERO, site) }
            })
            .collect();
        let order = morton_order(&new);
        self.origins.extend(order.iter().map(|&i| new[i as usize].0 + new[i as usize].1 * offset_m));
        self.normals.extend(order.iter().map(|&i| new[i as usize].1));
        self.sites.extend(order.iter().map(|&i| new[i as usize].2));
    }
}

/// A normal that is a unit vector, or zero.
fn normal_or_zero(normal: Vec3) -> Vec3 {
    if normal.is_finite() { normal.try_normalize().unwrap_or(Vec3::ZERO) } else { Vec3::ZERO }
}

/// The order along a Z curve through the points' box, 21 bits an axis; equal codes keep their order.
fn morton_order(points: &[(Vec3, Vec3, u32)]) -> Vec<u32> {
    let (low, high) = points.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), p| (low.min(p.0), high.max(p.0)));
    let extent = (high - low).max_element().max(f32::MIN_POSITIVE);
    let scale = ((1 << 21) - 1) as f32 / extent;
    let mut keys: Vec<(u64, u32)> = points
        .par_iter()
        .enumerate()
        .map(|(i, p)| {
            let q = (p.0 - low) * scale;
            (spread(q.x) | spread(q.y) << 1 | spread(q.z) << 2, i as u32)
        })
        .collect();
    keys.par_sort_unstable();
    keys.into_iter().map(|(_, i)| i).collect()
}

/// The lowest 21 bits of a number, two zeros after each.
fn spread(x: f32) -> u64 {
    let mut x = (x.max(0.0) as u64) & 0x1f_ffff;
    x = (x | x << 32) & 0x001f_0000_0000_ffff;
    x = (x | x << 16) & 0x001f_0000_ff00_00ff;
    x = (x | x << 8) & 0x100f_00f0_0f00_f00f;
    x = (x | x << 4) & 0x10c3_0c30_c30c_30c3;
    (x | x << 2) & 0x1249_2492_4924_9249
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_in_the_order_are_neighbours_in_space() {
        let side = 32;
        let points = (0..side * side).map(|i| (Vec3::new((i % side) as f32, 0.0, (i / side) as f32), Vec3::Y, i as u32));
        let mut set = PointSet::default();
        set.extend_with(points, 0.0);
        // 64 consecutive points of a Z curve over a square grid fill a square of 8 x 8
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
        let mut set = PointSet::default();
        set.extend_with([(Vec3::NAN, Vec3::Y, 0), (Vec3::ONE, Vec3::NAN, 1), (Vec3::ONE, Vec3::Y * 2.0, 2)].into_iter(), 0.5);
        for (site, normal) in set.sites.iter().zip(&set.normals) {
            assert_eq!(*normal, if *site == 2 { Vec3::Y } else { Vec3::ZERO });
        }
        assert!(set.origins.iter().all(|o| o.is_finite()));
    }
}
