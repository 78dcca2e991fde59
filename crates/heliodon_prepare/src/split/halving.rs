//! Which edges are halved, and where.

use glam::Vec3;

/// Neither half of an edge may be longer than this part of it, squared. Where f32 is so coarse that its middle is no middle, halving
/// would go on for ever.
const LONGEST_HALF_SQUARED: f64 = 0.5625;

/// The middle of an edge, the same to the bit from either end, and the edge's length squared; none where f32 has no middle to offer,
/// or it is not finite.
#[inline]
fn middle(a: Vec3, b: Vec3) -> Option<(Vec3, f64)> {
    // adding zero turns -0, which equals 0 but has other bits, into 0
    let middle = (a + b) * 0.5 + Vec3::ZERO;
    let squared = |a: Vec3, b: Vec3| a.as_dvec3().distance_squared(b.as_dvec3());
    let whole = squared(a, b);
    // not finite fails the comparison
    let halved = squared(a, middle).max(squared(b, middle)) <= LONGEST_HALF_SQUARED * whole;
    (halved && whole > 0.0 && middle.is_finite()).then_some((middle, whole))
}

/// From one end of an edge to the other, the same to the bit whichever is named first.
#[inline]
fn along(a: Vec3, b: Vec3) -> Vec3 {
    let along = b - a;
    let first = along.to_array().into_iter().find(|&x| x != 0.0).unwrap_or(0.0);
    if first < 0.0 { a - b } else { along }
}

/// The middle of an edge if it is too long: from the positions of its ends only, in whatever order, for sums, products and squared
/// differences are the same to the bit either way.
#[inline]
pub(super) fn too_long(a: Vec3, b: Vec3, longest_m: &impl Fn(Vec3, Vec3) -> f32) -> Option<Vec3> {
    let (middle, squared) = middle(a, b)?;
    let longest = f64::from(longest_m(middle, along(a, b)));
    let longest = if longest < 0.0 { 0.0 } else { longest };
    // NaN fails the comparison
    (squared > longest * longest).then_some(middle)
}
