//! One triangle and the rays of one direction: the predicate that every question comes down to.
//!
//! With the corners a, b, c relative to the ray's point, the edge functions wa = b x c, wb = c x a, wc = a x b (in p and q)
//! are the barycentric weights times the triangle's doubled area. A ray meets the triangle when they do not differ in sign,
//! their sum is not zero, the point lies in the triangle's box, across as well, and the triangle reaches as far as the origin along axes i and j
//! too; the depth is interpolated from them and clamped to the triangle's own. Four of these conditions look redundant: the box matters for slivers, whose weights can all round to
//! one sign far outside; the reach because of rounding, which it forgives less than the rest (it compares coordinates as
//! they are); all four are what lets nodes be culled by the same comparisons as triangles. Without the reach, rays that leave level ground
//! towards a low sun meet the boxes of all the ground behind their origin, whose shears overlap theirs. Products and sums stand in
//! one fixed order, in [`cross`] for one triangle and in [`met`] for eight: both give the same bits.

use glam::Vec3;

use crate::layout::Packet;
use crate::shear::{Shear, Start};
use crate::simd::{Engine, Mask, Vector};
use crate::types::Ray;
use crate::view::{Boxes, Spans};

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

impl Crossing {
    /// In multiples of the ray's direction.
    #[inline(always)]
    pub fn t(&self, shear: &Shear) -> f32 {
        self.depth * shear.t_per_depth
    }

    #[inline(always)]
    pub fn is_back(&self, shear: &Shear) -> bool {
        self.positive == shear.forward
    }

    /// Whether it lies between a ray's ends.
    #[inline(always)]
    pub fn between(&self, shear: &Shear, ray: &Ray) -> bool {
        let t = self.t(shear);
        t > ray.t_min && t < ray.t_max
    }
}

/// The predicate for one triangle of a packet.
#[inline(always)]
pub(crate) fn cross(shear: &Shear, packet: &Packet, lane: usize, start: Start) -> Option<Crossing> {
    let corner = |[x, y, z]: &[[f32; 8]; 3]| {
        let [p, q, depth, i, j, across] = shear.apply(Vec3::new(x[lane], y[lane], z[lane]));
        [p - start[0], q - start[1], depth - start[2], i - start[3], j - start[4], across]
    };
    let [a, b, c] = &packet.vertex;
    let [a, b, c] = [corner(a), corner(b), corner(c)];
    let wa = b[0] * c[1] - b[1] * c[0];
    let wb = c[0] * a[1] - c[1] * a[0];
    let wc = a[0] * b[1] - a[1] * b[0];
    let inside = (wa >= 0.0 && wb >= 0.0 && wc >= 0.0) || (wa <= 0.0 && wb <= 0.0 && wc <= 0.0);
    let det = wa + wb + wc;
    let span = |x: usize| [a[x].min(b[x]).min(c[x]), a[x].max(b[x]).max(c[x])];
    let holds_zero = |[low, high]: [f32; 2]| low <= 0.0 && 0.0 <= high;
    let reaches = span(3)[1] >= 0.0 && span(4)[1] >= 0.0;
    let [least, greatest] = span(5);
    let across = least <= start[6] && start[5] <= greatest;
    if !(inside && det != 0.0 && holds_zero(span(0)) && holds_zero(span(1)) && reaches && across) {
        return None;
    }
    let depth = (wa * a[2] + wb * b[2] + wc * c[2]) / det;
    let [near, far] = span(2);
    Some(Crossing { depth: depth.max(near).min(far), u: wb / det, v: wc / det, positive: det > 0.0 })
}

/// Which of sixteen rays pass through a triangle's box, and not wholly behind it.
#[inline(always)]
pub(crate) fn boxed<E: Engine>(engine: E, spans: &Spans, lane: usize, points: &[[f32; 16]; 7]) -> u16 {
    let [p, q] = [E::F16::load(engine, &points[0]), E::F16::load(engine, &points[1])];
    let depth = E::F16::load(engine, &points[2]);
    let [p0, p1] = [E::F16::splat(engine, spans[0][lane]), E::F16::splat(engine, spans[1][lane])];
    let [q0, q1] = [E::F16::splat(engine, spans[2][lane]), E::F16::splat(engine, spans[3][lane])];
    let far = E::F16::splat(engine, spans[4][lane]);
    let [i, j] = [E::F16::load(engine, &points[3]), E::F16::load(engine, &points[4])];
    let reach = i.le(E::F16::splat(engine, spans[5][lane])) & j.le(E::F16::splat(engine, spans[6][lane]));
    let [low, high] = [E::F16::load(engine, &points[5]), E::F16::load(engine, &points[6])];
    let across = E::F16::splat(engine, spans[7][lane]).le(high) & low.le(E::F16::splat(engine, spans[8][lane]));
    ((p0.le(p) & p.le(p1)) & (q0.le(q) & q.le(q1)) & depth.lt(far) & reach & across).bits() as u16
}

/// Which of eight triangles a ray meets beyond its origin and no deeper than `limit`: the predicate of [`cross`] and a positive depth.
#[inline(always)]
pub(crate) fn met<E: Engine>(engine: E, corners: &[[E::F8; 6]; 3], boxes: &Boxes<E>, start: Start, limit: f32) -> u32 {
    let zero = E::F8::splat(engine, 0.0);
    let (p, q) = (E::F8::splat(engine, start[0]), E::F8::splat(engine, start[1]));
    let depth = E::F8::splat(engine, start[2]);
    let (i, j) = (E::F8::splat(engine, start[3]), E::F8::splat(engine, start[4]));
    let held = E::F8::meets(boxes.p, [p; 2])
        & E::F8::meets(boxes.q, [q; 2])
        & E::F8::meets(boxes.across, [E::F8::splat(engine, start[5]), E::F8::splat(engine, start[6])])
        & i.le(boxes.reach[0])
        & j.le(boxes.reach[1])
        & depth.lt(boxes.depth[1]);
    if held.bits() == 0 {
        return 0;
    }
    let [a, b, c] = corners;
    let (ap, bp, cp) = (a[0] - p, b[0] - p, c[0] - p);
    let (aq, bq, cq) = (a[1] - q, b[1] - q, c[1] - q);
    let wa = bp * cq - bq * cp;
    let wb = cp * aq - cq * ap;
    let wc = ap * bq - aq * bp;
    let [least, greatest] = E::F8::span(wa, wb, wc);
    let inside = held & (zero.le(least) | greatest.le(zero));
    let det = wa + wb + wc;
    let moment = wa * (a[2] - depth) + wb * (b[2] - depth) + wc * (c[2] - depth);
    let ahead = inside & ((zero.lt(det) & zero.lt(moment)) | (det.lt(zero) & moment.lt(zero)));
    let all = ahead.bits();
    if all == 0 || limit == f32::INFINITY {
        return all;
    }
    let at = (moment / det).max(boxes.depth[0] - depth).min(boxes.depth[1] - depth);
    (ahead & at.le(E::F8::splat(engine, limit - start[2]))).bits()
}
