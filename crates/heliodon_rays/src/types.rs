//! Rays and hits.

use glam::Vec3;

use crate::shear::Shear;
use crate::triangle::Crossing;

/// A half line or a stretch of one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Start.
    pub origin: Vec3,
    /// Direction; of any length but zero, distances are in multiples of it.
    pub direction: Vec3,
    /// Hits at this distance or nearer do not count.
    pub t_min: f32,
    /// Nor do hits at or beyond this.
    pub t_max: f32,
}

/// The triangle of a [`Hit`] that met nothing.
pub const NO_HIT: u32 = u32::MAX;

/// Where a ray first meets a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Index of the triangle, or [`NO_HIT`].
    pub triangle: u32,
    /// Distance in multiples of the ray's direction; infinite where nothing was met.
    pub t: f32,
    /// Barycentric weight of the triangle's second vertex.
    pub u: f32,
    /// Barycentric weight of the triangle's third vertex.
    pub v: f32,
    /// Whether the ray met the back (the side from which the vertices run clockwise).
    pub back: bool,
}

impl Hit {
    /// What a ray that meets nothing gets.
    pub const MISS: Self = Self { triangle: NO_HIT, t: f32::INFINITY, u: 0.0, v: 0.0, back: false };

    /// Whether a triangle was met.
    pub fn is_some(&self) -> bool {
        self.triangle != NO_HIT
    }

    /// Becomes the crossing with a triangle if that is beyond `t_min` and before what was found so far (an empty hit's `t`
    /// is the ray's end); whether it did. At one distance the lower index wins.
    #[inline(always)]
    pub(crate) fn take(&mut self, crossing: &Crossing, shear: &Shear, triangle: u32, t_min: f32) -> bool {
        let t = crossing.t(shear);
        let nearer = t < self.t || (t == self.t && self.is_some() && triangle < self.triangle);
        let taken = t > t_min && nearer;
        if taken {
            *self = Self { triangle, t, u: crossing.u, v: crossing.v, back: crossing.is_back(shear) };
        }
        taken
    }
}
