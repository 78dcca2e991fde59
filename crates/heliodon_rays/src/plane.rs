//! What lies behind the surface that rays start from.
//!
//! Rays leave a surface, so the triangles around their origins are in their way in (p, q) but below them in depth, and a
//! region's least depth cannot tell on a slanted surface. A plane fitted to a group's origins can: with
//! w(p, q, depth) = depth - a p - b q, a triangle whose corners all have a smaller w than all origins is met by none of
//! the rays, whatever a and b are. This spares most tests that a walk would do near its start.
//!
//! It must never throw out what [`crate::triangle`]'s rounded predicate would accept. Let u = 2^-24, S the wider side of a
//! triangle's box, D its doubled area in (p, q) and Z the greatest distance in depth between an origin and a corner. A ray
//! that the predicate accepts lies in the box, so each edge function has an error of at most 8 u S^2, the interpolated
//! w is at most max w + 16 u S^2 / D * (max w - min w), and an origin can pass as up to 32 u S^2 / D * Z below the
//! plane although it is above. Twice that, and the rounding of the w themselves, is the margin here; slivers, whose S^2 / D is
//! large, are therefore kept.

use crate::simd::{Engine, Mask, Vector};
use crate::view::{Boxes, View, greatest, least};

/// A plane under a group's origins.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Plane {
    slope: [f32; 2],
    /// The least w of the origins, less what is rounded.
    floor: f32,
    /// Least and greatest depth of the origins.
    depth: [f32; 2],
}

impl Plane {
    /// Behind it lies nothing.
    pub const NOWHERE: Self = Self { slope: [0.0; 2], floor: f32::NEG_INFINITY, depth: [0.0; 2] };

    /// Fitted by least squares; `extent` is the greatest coordinate of any triangle.
    #[inline(always)]
    pub fn under<E: Engine>(engine: E, points: &[[f32; 16]; 3], extent: f32) -> Self {
        let centered = |x: &[f32; 16]| {
            let mean = sum(x) * (1.0 / 16.0);
            core::array::from_fn::<f32, 16, _>(|i| x[i] - mean)
        };
        let (p, q, z) = (centered(&points[0]), centered(&points[1]), centered(&points[2]));
        let dot = |a: &[f32; 16], b: &[f32; 16]| sum(&core::array::from_fn(|i| a[i] * b[i]));
        let (pp, pq, qq) = (dot(&p, &p), dot(&p, &q), dot(&q, &q));
        let (pz, qz) = (dot(&p, &z), dot(&q, &z));
        let scale = 1.0 / (pp * qq - pq * pq);
        let slope = [(pz * qq - qz * pq) * scale, (qz * pp - pz * pq) * scale];
        if !(slope[0].is_finite() && slope[1].is_finite()) {
            return Self::NOWHERE;
        }
        let [p, q, z] = points;
        let (a, b) = (E::F16::splat(engine, slope[0]), E::F16::splat(engine, slope[1]));
        let w = (E::F16::load(engine, z) - a * E::F16::load(engine, p)) - b * E::F16::load(engine, q);
        let depth = [least(z), greatest(z)];
        let reach = |x: &[f32; 16]| greatest(x).max(-least(x)).max(2.0 * extent);
        let magnitude = reach(z) + slope[0].abs() * reach(p) + slope[1].abs() * reach(q);
        Self { slope, floor: least(&w.store()) - 8.0 * f32::EPSILON * magnitude, depth }
    }

    /// Which of eight triangles are behind it.
    #[inline(always)]
    pub fn hides<E: Engine>(&self, view: &View<E>, corners: &[[E::F8; 3]; 3], boxes: &Boxes<E>, shapes: &Shapes<E>) -> u32 {
        let engine = view.engine;
        let (a, b) = (E::F8::splat(engine, self.slope[0]), E::F8::splat(engine, self.slope[1]));
        let [w0, w1, w2] = [
            (corners[0][2] - a * corners[0][0]) - b * corners[0][1],
            (corners[1][2] - a * corners[1][0]) - b * corners[1][1],
            (corners[2][2] - a * corners[2][0]) - b * corners[2][1],
        ];
        let [low, high] = E::F8::span(w0, w1, w2);
        let gap = E::F8::splat(engine, self.floor) - high;
        let up = boxes.depth[1] - E::F8::splat(engine, self.depth[0]);
        let down = E::F8::splat(engine, self.depth[1]) - boxes.depth[0];
        let error = shapes.error * ((high - low) + up.max(down));
        (E::F8::splat(engine, 0.0).lt(gap) & error.lt(shapes.area * gap)).bits()
    }
}

#[inline(always)]
fn sum(x: &[f32; 16]) -> f32 {
    let eight: [f32; 8] = core::array::from_fn(|i| x[i] + x[i + 8]);
    let four: [f32; 4] = core::array::from_fn(|i| eight[i] + eight[i + 4]);
    (four[0] + four[2]) + (four[1] + four[3])
}

/// How far eight triangles can be trusted.
#[derive(Clone, Copy)]
pub(crate) struct Shapes<E: Engine> {
    /// Doubled areas, less their error.
    area: E::F8,
    /// 64 u S^2.
    error: E::F8,
}

impl<E: Engine> Shapes<E> {
    #[inline(always)]
    pub fn new(view: &View<E>, corners: &[[E::F8; 3]; 3], boxes: &Boxes<E>) -> Self {
        let [a, b, c] = corners;
        let (bp, bq, cp, cq) = (b[0] - a[0], b[1] - a[1], c[0] - a[0], c[1] - a[1]);
        let area = bp * cq - bq * cp;
        let area = area.max(E::F8::splat(view.engine, 0.0) - area);
        let size = (boxes.p[1] - boxes.p[0]).max(boxes.q[1] - boxes.q[0]);
        let error = size * size * E::F8::splat(view.engine, 32.0 * f32::EPSILON);
        Self { area: area - error, error }
    }
}
