//! One direction's view of the world: the coordinates in which rays of that direction are points.
//!
//! After S. Woop, C. Benthin, I. Wald, "Watertight Ray/Triangle Intersection", JCGT 2(1), 2013, with one change that makes
//! it serve many parallel rays at once: vertices are sheared as they are, not after subtracting the ray's origin. With k the
//! direction's largest axis and i, j the two after it in cyclic order,
//!
//! ```text
//! p = x_i - (d_i / d_k) x_k      q = x_j - (d_j / d_k) x_k      depth = sign(d_k) x_k
//! ```
//!
//! so p and q are constant along a ray, depth grows along it, and a vertex costs four operations (three more for where it lies across). What that buys:
//!
//! - **Watertight.** A vertex has one (p, q) for one direction, whichever triangle it is seen through, and the edge function
//!   of an edge changes its sign exactly when its ends are swapped. A ray through a closed surface's inner edge or vertex
//!   therefore meets at least one of the triangles there. (Woop et al. need the same property; they get it per ray.)
//! - **Exact culling.** Rounding is monotone, so the sheared corners of a box bound the sheared vertices inside
//!   it bit for bit, and the depth of a hit is clamped to its triangle's. A ray's answer is therefore a function of the ray
//!   and the triangles alone: not of the tree, of the neighbours it was traced with or of the vectors' width.
//! - **All three axes.** A ray does not turn back on axes i and j either. So a box or triangle whose reach along one of them, in
//!   the direction's sense, falls short of the origin's is passed over, and as coordinates are compared as they are, this too
//!   holds for a box if it holds for all triangles inside.
//! - **Across.** A box that is seen obliquely covers a hexagon, of which the bounds of p and q hold a rectangle: along a column, or a wall,
//!   several times as large. The bounds of a third combination, `(d_j / d_k) x_i - (d_i / d_k) x_j`, cut its corners off. As it is
//!   rounded apart from p and q, rays have a margin of [`ACROSS`] there, wider than all that is rounded, so that no edge opens;
//!   and it is asked of triangles as of boxes, so that this culls as exactly as the rest.
//! - What it costs: p and q carry the rounding of the coordinates, about 1.5 units in the last place of the scene's
//!   half extent (6e-6 m in a scene of 100 m), which positions stored as `f32` carry anyway. Coordinates are relative to
//!   the scene's centre, so a survey a kilometre from its origin loses nothing more.

use glam::Vec3;

/// What places across are compared with, in greatest coordinates and the slopes' sum S: see [`Shear::across_margin`]. With u = 2^-24 and M the greatest coordinate, p and q
/// carry at most 3 u M each, which is 3 u M S across, and a place across of its own 2 u M S. What lies between the sheared corners of a triangle lies between their places
/// across but for 2 (3 + 3 + 2) u M S and what weights are rounded by, 8 u M S at most; the margin of 32 u M S exceeds that and its own rounding.
pub(crate) const ACROSS: f32 = 16.0 * f32::EPSILON;

/// Slopes with next to no digits left give places across that are off by parts of this.
pub(crate) const LEAST_ACROSS: f32 = f32::MIN_POSITIVE;

/// The sheared coordinates of one direction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shear {
    /// Axes i, j, k.
    pub axes: [usize; 3],
    /// d_i / d_k and d_j / d_k; between -1 and 1.
    pub slope: [f32; 2],
    /// Whether d_k is positive.
    pub forward: bool,
    /// 1 / |d_k|: ray parameter for each unit of depth.
    pub t_per_depth: f32,
    /// Signs of d_i and d_j, 1 or -1.
    pub sign: [f32; 2],
}

/// p, q, depth, how far a point lies along axes i and j in the direction's sense, and where it lies across: see [`Shear::apply`].
pub(crate) type Point = [f32; 6];

/// A ray's origin: a [`Point`] whose place across is the least and the greatest that a triangle met there can have.
pub(crate) type Start = [f32; 7];

impl Shear {
    /// `None` for directions that are zero or not finite.
    #[inline(always)]
    pub fn new(direction: Vec3) -> Option<Self> {
        let d = direction.to_array();
        let m = direction.abs();
        let k = if m.x >= m.y && m.x >= m.z {
            0
        } else if m.y >= m.z {
            1
        } else {
            2
        };
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        let t_per_depth = 1.0 / d[k].abs();
        (direction.is_finite() && t_per_depth.is_finite()).then_some(Self {
            axes: [i, j, k],
            slope: [d[i] / d[k], d[j] / d[k]],
            forward: d[k] > 0.0,
            t_per_depth,
            sign: [d[i], d[j]].map(|d| if d < 0.0 { -1.0 } else { 1.0 }),
        })
    }

    /// (p, q, depth) of a point, sign(d_i) x_i and sign(d_j) x_j, which do not fall along a ray, and its place across,
    /// (d_j / d_k) x_i - (d_i / d_k) x_j, which is constant along a ray as p and q are.
    #[inline(always)]
    pub fn apply(&self, x: Vec3) -> Point {
        let x = x.to_array();
        let along = x[self.axes[2]];
        let p = x[self.axes[0]] - self.slope[0] * along;
        let q = x[self.axes[1]] - self.slope[1] * along;
        let [i, j] = [self.sign[0] * x[self.axes[0]], self.sign[1] * x[self.axes[1]]];
        let across = self.slope[1] * x[self.axes[0]] - self.slope[0] * x[self.axes[1]];
        [p, q, if self.forward { along } else { -along }, i, j, across]
    }

    /// The margin across, in greatest coordinates; one of [`LEAST_ACROSS`] comes on top.
    #[inline(always)]
    pub fn across_margin(&self) -> f32 {
        ACROSS * (self.slope[0].abs() + self.slope[1].abs())
    }

    /// Where a ray starts, in a scene whose coordinates do not exceed `extent`.
    #[inline(always)]
    pub fn start(&self, origin: Vec3, extent: f32) -> Start {
        let [p, q, depth, i, j, across] = self.apply(origin);
        let margin = self.across_margin() * extent.max(origin.abs().max_element()) + LEAST_ACROSS;
        [p, q, depth, i, j, across - margin, across + margin]
    }
}
