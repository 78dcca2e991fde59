//! One triangle and the rays of one direction: the predicate that every question comes down to.
//!
//! With the corners a, b, c relative to the ray's point, the edge functions wa = b x c, wb = c x a, wc = a x b (in p and q)
//! are the barycentric weights times the triangle's doubled area. A ray meets the triangle when they do not differ in sign,
//! their sum is not zero, and the point lies in the triangle's box; the depth is interpolated from them and clamped to the
//! triangle's own. Two of these conditions look redundant: the box matters for slivers, whose weights can all round to
//! one sign far outside, and it and the clamp are what lets nodes be culled without margins. Products and sums stand in
//! one fixed order, here for one ray and in [`covers`] for sixteen: both give the same bits.

use crate::simd::{Engine, Mask, Vector};
use crate::view::{Corners, Spans};

/// Where a ray meets a triangle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Crossing {
    /// From the ray's origin, along the largest axis.
    pub depth: f32,
    pub u: f32,
    pub v: f32,
    /// Whether p, q and depth see the corners run counter-clockwise.
    pub positive: bool,
}

/// Corner `index` of lane `lane`.
#[inline(always)]
fn corner(corners: &Corners, index: usize, lane: usize) -> [f32; 3] {
    [corners[index][0][lane], corners[index][1][lane], corners[index][2][lane]]
}

/// The predicate for one ray.
#[inline(always)]
pub(crate) fn cross(corners: &Corners, lane: usize, point: [f32; 3]) -> Option<Crossing> {
    let relative = |[p, q, z]: [f32; 3]| [p - point[0], q - point[1], z - point[2]];
    let [a, b, c] = [0, 1, 2].map(|index| relative(corner(corners, index, lane)));
    let wa = b[0] * c[1] - b[1] * c[0];
    let wb = c[0] * a[1] - c[1] * a[0];
    let wc = a[0] * b[1] - a[1] * b[0];
    let inside = (wa >= 0.0 && wb >= 0.0 && wc >= 0.0) || (wa <= 0.0 && wb <= 0.0 && wc <= 0.0);
    let det = wa + wb + wc;
    let span = |x: usize| [a[x].min(b[x]).min(c[x]), a[x].max(b[x]).max(c[x])];
    let holds_zero = |[low, high]: [f32; 2]| low <= 0.0 && 0.0 <= high;
    if !(inside && det != 0.0 && holds_zero(span(0)) && holds_zero(span(1))) {
        return None;
    }
    let depth = (wa * a[2] + wb * b[2] + wc * c[2]) / det;
    let [near, far] = span(2);
    Some(Crossing { depth: depth.max(near).min(far), u: wb / det, v: wc / det, positive: det > 0.0 })
}

/// Which of sixteen rays pass through a triangle's box, and not wholly behind it.
#[inline(always)]
pub(crate) fn boxed<E: Engine>(engine: E, spans: &Spans, lane: usize, points: &[[f32; 16]; 3]) -> u16 {
    let [p, q] = [E::F16::load(engine, &points[0]), E::F16::load(engine, &points[1])];
    let depth = E::F16::load(engine, &points[2]);
    let [p0, p1] = [E::F16::splat(engine, spans[0][lane]), E::F16::splat(engine, spans[1][lane])];
    let [q0, q1] = [E::F16::splat(engine, spans[2][lane]), E::F16::splat(engine, spans[3][lane])];
    let far = E::F16::splat(engine, spans[4][lane]);
    ((p0.le(p) & p.le(p1)) & (q0.le(q) & q.le(q1)) & depth.lt(far)).bits() as u16
}

/// Which of sixteen rays that are [`boxed`] pass through the triangle; with `BEYOND` only those that do so beyond their
/// origins.
#[inline(always)]
pub(crate) fn covers<E: Engine, const BEYOND: bool>(
    engine: E,
    corners: &Corners,
    lane: usize,
    points: &[[f32; 16]; 3],
    boxed: u16,
) -> u16 {
    let zero = E::F16::splat(engine, 0.0);
    let [p, q] = [E::F16::load(engine, &points[0]), E::F16::load(engine, &points[1])];
    let [[ap, aq, az], [bp, bq, bz], [cp, cq, cz]] =
        [corner(corners, 0, lane), corner(corners, 1, lane), corner(corners, 2, lane)];
    let [ap, bp, cp] = [E::F16::splat(engine, ap) - p, E::F16::splat(engine, bp) - p, E::F16::splat(engine, cp) - p];
    let [aq, bq, cq] = [E::F16::splat(engine, aq) - q, E::F16::splat(engine, bq) - q, E::F16::splat(engine, cq) - q];
    let wa = bp * cq - bq * cp;
    let wb = cp * aq - cq * ap;
    let wc = ap * bq - aq * bp;
    let [least, greatest] = E::F16::span(wa, wb, wc);
    let inside = zero.le(least) | greatest.le(zero);
    let det = wa + wb + wc;
    let met = if BEYOND {
        let depth = E::F16::load(engine, &points[2]);
        let moment = wa * (E::F16::splat(engine, az) - depth)
            + wb * (E::F16::splat(engine, bz) - depth)
            + wc * (E::F16::splat(engine, cz) - depth);
        inside & ((zero.lt(det) & zero.lt(moment)) | (det.lt(zero) & moment.lt(zero)))
    } else {
        inside & (zero.lt(det) | det.lt(zero))
    };
    met.bits() as u16 & boxed
}
