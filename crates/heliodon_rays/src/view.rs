//! Nodes and packets as seen along one direction, eight at a time.

use crate::layout::{Node, Packet};
use crate::shear::{Shear, Start};
use crate::simd::{Engine, Mask, Vector};

/// A [`Shear`] ready for vectors.
#[derive(Clone, Copy)]
pub(crate) struct View<E: Engine> {
    pub engine: E,
    axes: [usize; 3],
    slope: [E::F8; 2],
    /// Which bounds of axes i and j give the least place across.
    across: [usize; 2],
    /// Which bounds of the largest axis (0 minima, 1 maxima) give the least p, and the least q.
    least: [usize; 2],
    near: usize,
    sign: E::F8,
    /// Which bounds of axes i and j a ray leaves last, and their signs.
    last: [usize; 2],
    signs: [E::F8; 2],
}

/// Eight boxes in (p, q, depth).
#[derive(Clone, Copy)]
pub(crate) struct Boxes<E: Engine> {
    pub p: [E::F8; 2],
    pub q: [E::F8; 2],
    pub depth: [E::F8; 2],
    /// How far they reach along axes i and j in the direction's sense.
    pub reach: [E::F8; 2],
    /// Least and greatest place across.
    pub across: [E::F8; 2],
}

/// Eight boxes: least and greatest p, least and greatest q, greatest depth, reach, least and greatest place across.
pub(crate) type Spans = [[f32; 8]; 9];

/// Bounds of some rays' points in (p, q), and the least of their depths: what they can meet lies there or deeper.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Region {
    pub p: [f32; 2],
    pub q: [f32; 2],
    pub depth: f32,
    pub reach: [f32; 2],
    /// Least and greatest place across that a triangle met there can have.
    pub across: [f32; 2],
}

impl Region {
    /// Meets nothing.
    pub const NOTHING: Self = Self {
        p: [f32::INFINITY, f32::NEG_INFINITY],
        q: [f32::INFINITY, f32::NEG_INFINITY],
        depth: f32::INFINITY,
        reach: [f32::INFINITY; 2],
        across: [f32::INFINITY, f32::NEG_INFINITY],
    };

    /// Around 16 points.
    #[inline(always)]
    pub fn around(points: &[[f32; 16]; 7]) -> Self {
        let [p, q, depth, i, j, low, high] = points;
        Self {
            p: [least(p), greatest(p)],
            q: [least(q), greatest(q)],
            depth: least(depth),
            reach: [least(i), least(j)],
            across: [least(low), greatest(high)],
        }
    }
}

/// The depth that a ray reaches at distance t, moved outwards (`side` 1.0) or inwards (-1.0) by more than all that is rounded
/// on the way: hits' distances are differences of depths times `t_per_depth`, each rounded once.
#[inline(always)]
pub(crate) fn depth_at(start: f32, t: f32, shear: &Shear, side: f32) -> f32 {
    let depth = t / shear.t_per_depth;
    let slack = (start.abs() + 2.0 * depth.abs()) * (4.0 * f32::EPSILON);
    let reached = start + depth;
    // An infinite t reaches everything.
    if depth.is_finite() { reached + side * slack } else { depth }
}

/// The least of 16 numbers, none of them NaN.
#[inline(always)]
pub(crate) fn least(x: &[f32; 16]) -> f32 {
    fold(x, |a, b| if a < b { a } else { b })
}

/// The greatest of 16 numbers, none of them NaN.
#[inline(always)]
pub(crate) fn greatest(x: &[f32; 16]) -> f32 {
    fold(x, |a, b| if a > b { a } else { b })
}

#[inline(always)]
fn fold(x: &[f32; 16], f: impl Fn(f32, f32) -> f32) -> f32 {
    let eight: [f32; 8] = core::array::from_fn(|i| f(x[i], x[i + 8]));
    let four: [f32; 4] = core::array::from_fn(|i| f(eight[i], eight[i + 4]));
    f(f(four[0], four[2]), f(four[1], four[3]))
}

impl<E: Engine> View<E> {
    #[inline(always)]
    pub fn new(engine: E, shear: &Shear) -> Self {
        let [sp, sq] = shear.slope;
        Self {
            engine,
            axes: shear.axes,
            slope: [E::F8::splat(engine, sp), E::F8::splat(engine, sq)],
            least: [usize::from(sp > 0.0), usize::from(sq > 0.0)],
            across: [usize::from(sq < 0.0), usize::from(sp > 0.0)],
            near: usize::from(!shear.forward),
            sign: E::F8::splat(engine, if shear.forward { 1.0 } else { -1.0 }),
            last: shear.sign.map(|s| usize::from(s > 0.0)),
            signs: shear.sign.map(|s| E::F8::splat(engine, s)),
        }
    }

    /// Bounds of a node's children. They hold the sheared corners of all triangles inside to the bit, because a sheared
    /// coordinate is rounded monotonously in each of its two terms.
    #[inline(always)]
    pub fn boxes(&self, node: &Node) -> Boxes<E> {
        let [i, j, k] = self.axes;
        let [least, most] = [&node.bounds[0], &node.bounds[1]];
        let [sp, sq] = self.slope;
        let [lp, lq] = self.least;
        let (below_p, above_p) = (&node.bounds[lp][k], &node.bounds[1 - lp][k]);
        let (below_q, above_q) = (&node.bounds[lq][k], &node.bounds[1 - lq][k]);
        let (near, far) = (&node.bounds[self.near][k], &node.bounds[1 - self.near][k]);
        let [ai, aj] = self.across;
        let (low_i, high_i) = (&node.bounds[ai][i], &node.bounds[1 - ai][i]);
        let (low_j, high_j) = (&node.bounds[aj][j], &node.bounds[1 - aj][j]);
        Boxes {
            p: [self.load(&least[i]) - sp * self.load(below_p), self.load(&most[i]) - sp * self.load(above_p)],
            q: [self.load(&least[j]) - sq * self.load(below_q), self.load(&most[j]) - sq * self.load(above_q)],
            depth: [self.sign * self.load(near), self.sign * self.load(far)],
            reach: [
                self.signs[0] * self.load(&node.bounds[self.last[0]][i]),
                self.signs[1] * self.load(&node.bounds[self.last[1]][j]),
            ],
            across: [sq * self.load(low_i) - sp * self.load(low_j), sq * self.load(high_i) - sp * self.load(high_j)],
        }
    }

    #[inline(always)]
    fn load(&self, from: &[f32; 8]) -> E::F8 {
        E::F8::load(self.engine, from)
    }

    #[inline(always)]
    fn splat(&self, value: f32) -> E::F8 {
        E::F8::splat(self.engine, value)
    }

    /// Eight points, sheared.
    #[inline(always)]
    fn project(&self, points: &[[f32; 8]; 3]) -> [E::F8; 6] {
        let [i, j, k] = self.axes;
        let along = self.load(&points[k]);
        let (pi, pj) = (self.load(&points[i]), self.load(&points[j]));
        let (p, q) = (pi - self.slope[0] * along, pj - self.slope[1] * along);
        let across = self.slope[1] * pi - self.slope[0] * pj;
        [p, q, self.sign * along, self.signs[0] * pi, self.signs[1] * pj, across]
    }

    /// Corners of a packet's triangles, and their boxes.
    #[inline(always)]
    pub fn corners(&self, packet: &Packet) -> ([[E::F8; 6]; 3], Boxes<E>) {
        let [a, b, c] = [self.project(&packet.vertex[0]), self.project(&packet.vertex[1]), self.project(&packet.vertex[2])];
        let boxes = Boxes {
            p: E::F8::span(a[0], b[0], c[0]),
            q: E::F8::span(a[1], b[1], c[1]),
            depth: E::F8::span(a[2], b[2], c[2]),
            reach: [a[3].max(b[3]).max(c[3]), a[4].max(b[4]).max(c[4])],
            across: E::F8::span(a[5], b[5], c[5]),
        };
        ([a, b, c], boxes)
    }

    /// Boxes as numbers.
    #[inline(always)]
    pub fn spans(boxes: &Boxes<E>) -> Spans {
        [
            boxes.p[0].store(),
            boxes.p[1].store(),
            boxes.q[0].store(),
            boxes.q[1].store(),
            boxes.depth[1].store(),
            boxes.reach[0].store(),
            boxes.reach[1].store(),
            boxes.across[0].store(),
            boxes.across[1].store(),
        ]
    }

    /// Which of eight boxes rays of a region can meet.
    #[inline(always)]
    pub fn overlap(&self, boxes: &Boxes<E>, region: &Region) -> u32 {
        let p = E::F8::meets(boxes.p, [self.splat(region.p[0]), self.splat(region.p[1])]);
        let q = E::F8::meets(boxes.q, [self.splat(region.q[0]), self.splat(region.q[1])]);
        let reach = self.splat(region.reach[0]).le(boxes.reach[0]) & self.splat(region.reach[1]).le(boxes.reach[1]);
        let across = E::F8::meets(boxes.across, [self.splat(region.across[0]), self.splat(region.across[1])]);
        (p & q & reach & across & self.splat(region.depth).lt(boxes.depth[1])).bits()
    }

    /// Which of eight boxes a ray passes through.
    #[inline(always)]
    pub fn overlap_start(&self, boxes: &Boxes<E>, [p, q, depth, i, j, low, high]: Start) -> u32 {
        self.overlap(boxes, &Region { p: [p; 2], q: [q; 2], depth, reach: [i, j], across: [low, high] })
    }

    /// Which of eight boxes begin no deeper than this.
    #[inline(always)]
    pub fn nearer(&self, boxes: &Boxes<E>, depth: f32) -> u32 {
        boxes.depth[0].le(E::F8::splat(self.engine, depth)).bits()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::Plain;
    use glam::Vec3;
    use heliodon_math::random::Pcg32;

    /// Boxes as long and thin as columns and as flat as walls, seen along any slope, and rays past their corners.
    #[test]
    fn boxes_are_met_by_the_rays_that_pass_them_and_no_others() {
        const EXTENT: f32 = 20.0;
        let mut rng = Pcg32::new(5, 1);
        let mut point = || Vec3::from_array(core::array::from_fn(|_| rng.range_f32(-1.0, 1.0)));
        let (mut passing, mut cut) = (0, 0);
        for _ in 0..40_000 {
            let (direction, center) = (point(), 5.0 * point());
            let half = point().abs().powf(4.0) * 5.0 + 0.01;
            let origin = center + 1.5 * half.max_element() * point() - 3.0 * direction;
            let Some(shear) = Shear::new(direction) else { continue };
            let mut node = Node::EMPTY;
            node.set(3, [center - half, center + half], 0);
            let view = View::new(Plain, &shear);
            let (boxes, start) = (view.boxes(&node), shear.start(origin, EXTENT));
            let met = view.overlap_start(&boxes, start);
            // by slabs: where the ray enters and leaves
            let ends = |side: f32| (center + side * half * direction.signum() - origin) / direction;
            let (enters, leaves) = (ends(-1.0).max_element(), ends(1.0).min_element());
            if leaves.abs().min((leaves - enters).abs()) < 1e-3 {
                continue;
            }
            let passes = enters < leaves && leaves > 0.0;
            assert_eq!(met, u32::from(passes) << 3, "{origin} {direction} {center} {half}");
            passing += u32::from(passes);
            let [p, q, depth, i, j, ..] = start;
            let without = Region { p: [p; 2], q: [q; 2], depth, reach: [i, j], across: [f32::NEG_INFINITY, f32::INFINITY] };
            cut += u32::from(met == 0 && view.overlap(&boxes, &without) != 0);
        }
        assert!(passing > 1000 && cut > 1000, "{passing} pass, {cut} are cut off by what lies across");
    }
}
