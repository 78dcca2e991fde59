//! One ray, ready for eight boxes or eight triangles at a time.
//!
//! A box is asked where the ray enters and leaves it along each axis, which costs half as much as its shear, but is not the comparison that triangles are asked: so boxes have
//! a margin. With u = 2^-24 and M the greatest coordinate: what [`cross`](crate::triangle::cross) accepts has p and q within the triangle's bounds, which carry 3 u M each, and places across within
//! (32 + 4) u M of theirs in units of the slopes' sum, so that the ray passes within 36 u M of the box (these three are all ways in which a line can miss one). What is rounded here moves a box's sides by at most 9 u M. The margin of
//! 64 u M exceeds both, so no box is passed over of whose triangles one would be met, and answers are those of beams to the bit.

use glam::Vec3;

use crate::layout::{Node, Packet};
use crate::shear::{ACROSS, Shear};
use crate::simd::{Engine, Mask, Vector};

/// In units of [`ACROSS`].
const MARGIN: f32 = 2.0;
/// Depth for each unit of an axis along which a ray hardly moves, at most.
const STEEPEST: f32 = 1.0e30;

/// A ray's line, in depths from its origin.
pub(crate) struct Line<E: Engine> {
    engine: E,
    /// Axes i, j, k, and which bounds (0 minima, 1 maxima) it meets first along each.
    axes: [usize; 3],
    first: [usize; 3],
    /// The origin along axes i and j and as depth, moved so that boxes begin and end later by the margin.
    from: [[E::F8; 2]; 3],
    /// Depth for each unit of axes i and j.
    per: [E::F8; 2],
    slope: [E::F8; 2],
    /// p, q and depth of the origin.
    point: [E::F8; 3],
    sign: E::F8,
}

impl<E: Engine> Line<E> {
    /// `extent` is the greatest coordinate of the scene.
    #[inline(always)]
    pub fn new(engine: E, shear: &Shear, origin: Vec3, extent: f32) -> Self {
        let margin = MARGIN * ACROSS * extent.max(origin.abs().max_element());
        let [i, j] = [0, 1].map(|axis| (origin[shear.axes[axis]], margin * shear.sign[axis]));
        let [pi, pj] = [0, 1].map(|axis| (1.0 / shear.slope[axis].abs()).min(STEEPEST) * shear.sign[axis]);
        let [p, q, depth, ..] = shear.apply(origin);
        let splat = |x: f32| E::F8::splat(engine, x);
        Self {
            engine,
            axes: shear.axes,
            first: [usize::from(shear.sign[0] < 0.0), usize::from(shear.sign[1] < 0.0), usize::from(!shear.forward)],
            from: [
                [splat(i.0 + i.1), splat(i.0 - i.1)],
                [splat(j.0 + j.1), splat(j.0 - j.1)],
                [splat(depth + margin), splat(depth - margin)],
            ],
            per: [splat(pi), splat(pj)],
            slope: [splat(shear.slope[0]), splat(shear.slope[1])],
            point: [splat(p), splat(q), splat(depth)],
            sign: splat(if shear.forward { 1.0 } else { -1.0 }),
        }
    }

    /// Which of a node's children it may meet that begin no deeper than `far`, and the depths at which these begin.
    #[inline(always)]
    pub fn passes(&self, node: &Node, far: f32) -> (u32, [f32; 8]) {
        let [fi, fj, fk] = self.first;
        let near = self.sign * self.bound(node, fk, 2);
        let last = self.sign * self.bound(node, 1 - fk, 2);
        let enters_i = (self.bound(node, fi, 0) - self.from[0][0]) * self.per[0];
        let leaves_i = (self.bound(node, 1 - fi, 0) - self.from[0][1]) * self.per[0];
        let enters_j = (self.bound(node, fj, 1) - self.from[1][0]) * self.per[1];
        let leaves_j = (self.bound(node, 1 - fj, 1) - self.from[1][1]) * self.per[1];
        let zero = E::F8::splat(self.engine, 0.0);
        let enters = enters_i.max(enters_j).max((near - self.from[2][0]).max(zero));
        let leaves = leaves_i.min(leaves_j).min(last - self.from[2][1]);
        let mask = enters.le(leaves) & near.le(E::F8::splat(self.engine, far));
        (mask.bits(), near.store())
    }

    #[inline(always)]
    fn bound(&self, node: &Node, side: usize, axis: usize) -> E::F8 {
        E::F8::load(self.engine, &node.bounds[side][self.axes[axis]])
    }

    /// Which of a packet's triangles it may meet no deeper than `far`: those of which [`cross`](crate::triangle::cross) has only their bounds still to ask.
    #[inline(always)]
    pub fn met(&self, packet: &Packet, far: f32) -> u32 {
        let [sp, sq] = self.slope;
        let [p, q, depth] = self.point;
        let (a, b, c) = (self.corner(packet, 0), self.corner(packet, 1), self.corner(packet, 2));
        let (ap, bp, cp) = (a[0] - sp * a[2] - p, b[0] - sp * b[2] - p, c[0] - sp * c[2] - p);
        let (aq, bq, cq) = (a[1] - sq * a[2] - q, b[1] - sq * b[2] - q, c[1] - sq * c[2] - q);
        let wa = bp * cq - bq * cp;
        let wb = cp * aq - cq * ap;
        let wc = ap * bq - aq * bp;
        let zero = E::F8::splat(self.engine, 0.0);
        let [least, greatest] = E::F8::span(wa, wb, wc);
        let inside = zero.le(least) | greatest.le(zero);
        if inside.bits() == 0 {
            return 0;
        }
        let (ad, bd, cd) = (self.sign * a[2], self.sign * b[2], self.sign * c[2]);
        let det = wa + wb + wc;
        let moment = wa * (ad - depth) + wb * (bd - depth) + wc * (cd - depth);
        let ahead = (zero.lt(det) & zero.lt(moment)) | (det.lt(zero) & moment.lt(zero));
        let [near, last] = E::F8::span(ad, bd, cd);
        let at = (moment / det).max(near - depth).min(last - depth);
        (inside & ahead & depth.lt(last) & at.le(E::F8::splat(self.engine, far) - depth)).bits()
    }

    /// A corner of eight triangles, along axes i, j and k.
    #[inline(always)]
    fn corner(&self, packet: &Packet, vertex: usize) -> [E::F8; 3] {
        let [i, j, k] = self.axes;
        let [ci, cj, ck] = [&packet.vertex[vertex][i], &packet.vertex[vertex][j], &packet.vertex[vertex][k]];
        [E::F8::load(self.engine, ci), E::F8::load(self.engine, cj), E::F8::load(self.engine, ck)]
    }
}
