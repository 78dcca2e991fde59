//! Keeping triangles small where nothing but light needs them.
//!
//! Meshoptimizer has no limit to the length of edges, but it can mix into a vertex's quadric, which measures how far the
//! surface moves off the planes of its triangles, a share f of one that measures how far the vertex itself moves. On a plane
//! the error of joining the vertices of a region of root mean square radius r is then r sqrt(f / (1 + f)), so that with the
//! tolerance e no region grows beyond r = e sqrt((1 + f) / f): edges are limited and triangles are even, by the same tolerance
//! that limits the error of a rough surface. It offers f = 1 for single vertices ("priority"), and 0.1 or 0.01 for the others;
//! between these, as many vertices take priority as give the mean that is wanted, and a region of many vertices has that mean.
//!
//! Why not a target number of triangles instead: it is one for the whole tile, which a plain wall beside a relief would pay
//! for.

use super::fineness::Allowed;
use meshopt::SimplifyOptions;

/// The share of the error that is allowed that meshoptimizer is told. It means root mean squares; what is promised are
/// distances, of which 95 of 100 lie below twice their root mean square. A little more than half, so that the default limits
/// give f = 0.1, which needs no priorities and makes the most even triangles.
const MEAN_SHARE: f32 = 0.545;
/// The radius r of regions, in edges as long as is allowed. On a plane of scattered vertices half of the edges come out shorter
/// than 1.5 r, 90 of 100 than 2.1 r, 99 than 2.6 r, all than 3.2 r, whatever the tolerance and f.
const RADIUS_SHARE: f32 = 0.36;
/// The least f, so that edges longer than 28 tolerances are not made: without any, slivers are.
const LEAST: f32 = 0.01;

/// At open borders the share weighs that much less, since the quadrics that hold the border in its line come on top of the
/// others: twice ten times an edge's length beside three triangles' roots of twice their area, which on an even mesh are about
/// as much as the edge.
const BORDER_MORE: f32 = 23.0 / 3.0;
/// The greatest f: what borders can still follow.
const MOST: f32 = 1.0 / BORDER_MORE;

/// What meshoptimizer is told so that it keeps to both limits.
pub(super) struct Evenness {
    pub options: SimplifyOptions,
    /// The tolerance.
    pub error_m: f32,
    /// Of 2^32 vertices, how many take priority.
    weighty: u64,
    /// Of 2^32 vertices at an open border, how many take priority.
    weighty_at_border: u64,
}

impl Evenness {
    pub fn of(allowed: Allowed) -> Self {
        let radius_m = RADIUS_SHARE * allowed.edge_m;
        // With f = MOST regions have at most the radius e sqrt((1 + f) / f): shorter edges need a finer tolerance.
        let error_m = (MEAN_SHARE * allowed.error_m).min(radius_m * (MOST / (1.0 + MOST)).sqrt());
        let ratio = radius_m / error_m;
        let share = (1.0 / (ratio * ratio - 1.0)).clamp(LEAST, MOST);
        let (base, options) = match share {
            0.1.. => (0.1, SimplifyOptions::Regularize),
            _ => (LEAST, SimplifyOptions::RegularizeLight),
        };
        let of_all = |share: f32| (f64::from(((share - base) / (1.0 - base)).clamp(0.0, 1.0)) * 2.0_f64.powi(32)) as u64;
        Self { options, error_m, weighty: of_all(share), weighty_at_border: of_all(BORDER_MORE * share) }
    }

    /// Whether the vertex takes priority: by its index times the golden ratio, so that neighbours in the file take turns
    /// evenly.
    pub fn is_weighty(&self, vertex: u32, at_border: bool) -> bool {
        let weighty = if at_border { self.weighty_at_border } else { self.weighty };
        u64::from(vertex.wrapping_mul(0x9E37_79B9)) < weighty
    }
}
