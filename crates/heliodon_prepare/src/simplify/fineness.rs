//! How large errors and edges may be at a place.

use super::SimplifyParams;
use crate::Views;
use glam::Vec3;

/// What is allowed at one place, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Allowed {
    pub error_m: f32,
    pub edge_m: f32,
}

/// What is allowed anywhere.
pub(super) struct Fineness<'a> {
    views: &'a Views,
    params: &'a SimplifyParams,
}

impl<'a> Fineness<'a> {
    pub fn new(views: &'a Views, params: &'a SimplifyParams) -> Self {
        Self { views, params }
    }

    /// At this distance from the nearest eye, in metres.
    pub fn at_distance(&self, distance_m: f32) -> Allowed {
        if self.views.cells.is_empty() {
            return Allowed { error_m: self.params.error_m.max(0.0), edge_m: self.params.edge_m.max(0.0) };
        }
        let pixel_m = self.views.screen.pixel_m(distance_m.max(self.params.nearest_m));
        Allowed { error_m: (self.params.error_px * pixel_m).max(0.0), edge_m: (self.params.edge_px * pixel_m).max(0.0) }
    }

    /// How far the surface may be from a place of the original, metres.
    pub fn error_m(&self, place: Vec3) -> f32 {
        self.at_distance(self.distance_m(place)).error_m
    }

    /// The distance from a point to the nearest eye, clamped to where it matters; 0 where no eyes are known.
    pub fn distance_m(&self, point: Vec3) -> f32 {
        if self.views.cells.is_empty() { 0.0 } else { self.views.distance_m(point).max(self.params.nearest_m) }
    }

    /// The greatest part of its area that a face at a point can show to an eye.
    pub fn facing(&self, point: Vec3, normal: Vec3) -> f32 {
        self.views.facing(point, normal)
    }

    /// The side of a pixel at a point, metres; infinite where no eyes are known.
    pub fn pixel_m(&self, point: Vec3) -> f32 {
        self.views.pixel_m(point, self.params.nearest_m)
    }

    /// An upper bound of how many times farther than the nearest a point of a box can be from the eyes.
    pub fn spread(&self, low: Vec3, high: Vec3) -> f32 {
        if self.views.cells.is_empty() {
            return 1.0;
        }
        let nearest = self.views.distance_to_box_m(low, high).max(self.params.nearest_m);
        // The distance to a convex box is greatest at a corner.
        let corner = |i: u32| {
            Vec3::new(
                if i & 1 == 0 { low.x } else { high.x },
                if i & 2 == 0 { low.y } else { high.y },
                if i & 4 == 0 { low.z } else { high.z },
            )
        };
        let farthest = (0..8).map(|i| self.distance_m(corner(i))).fold(nearest, f32::max);
        farthest / nearest
    }
}
