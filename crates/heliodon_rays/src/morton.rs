//! Spatial order.

use glam::Vec3;
use rayon::prelude::*;

/// Spreads the low 21 bits to every third.
fn spread(x: u64) -> u64 {
    let x = x & 0x1f_ffff;
    let x = (x | x << 32) & 0x001f_0000_0000_ffff;
    let x = (x | x << 16) & 0x001f_0000_ff00_00ff;
    let x = (x | x << 8) & 0x100f_00f0_0f00_f00f;
    let x = (x | x << 4) & 0x10c3_0c30_c30c_30c3;
    (x | x << 2) & 0x1249_2492_4924_9249
}

/// The order of points along a Morton curve over the cube around them: `order[i]` is the index of the i-th point.
/// Points that are not finite come last; equal ones keep their order.
pub fn morton_order(points: &[Vec3]) -> Vec<u32> {
    let finite = || points.iter().copied().filter(|p| p.is_finite());
    let low = finite().fold(Vec3::INFINITY, Vec3::min);
    let high = finite().fold(Vec3::NEG_INFINITY, Vec3::max);
    // A cube, so that cells are as wide as they are high; the extent is halved against overflow.
    let half = (0.5 * high - 0.5 * low).max_element();
    let scale = if half > 0.0 { ((1 << 20) as f32 - 0.5) / half } else { 0.0 };
    let code = |p: Vec3| {
        if !p.is_finite() {
            return u64::MAX;
        }
        let [x, y, z] = ((0.5 * p - 0.5 * low) * (2.0 * scale)).to_array().map(|c| spread(c as u64));
        x | y << 1 | z << 2
    };
    let mut keyed: Vec<(u64, u32)> = points.par_iter().enumerate().map(|(i, &p)| (code(p), i as u32)).collect();
    keyed.par_sort_unstable();
    keyed.into_iter().map(|(_, i)| i).collect()
}
