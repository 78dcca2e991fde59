//! The texels that filtering takes into account somewhere on a triangle.

use glam::Vec2;

/// Tells of each row the texels whose middles are nearer than `reach`, along both axes, to the triangle; filtering takes those into account that are nearer than one texel.
pub fn cover(triangle: &[Vec2; 3], reach: f32, height: usize, mut span: impl FnMut(usize, usize, usize)) {
    let (low, high) = triangle.iter().fold((triangle[0].y, triangle[0].y), |(low, high), p| (low.min(p.y), high.max(p.y)));
    // middles y + 1/2 above low - reach and below high + reach
    let begin = (low - reach - 0.5).floor() + 1.0;
    let end = (high + reach - 0.5).ceil();
    for y in begin.max(0.0) as usize..(end.max(0.0) as usize).min(height) {
        let middle = y as f32 + 0.5;
        let (mut left, mut right) = (f32::INFINITY, f32::NEG_INFINITY);
        for i in 0..3 {
            let (a, b) = (triangle[i], triangle[(i + 1) % 3]);
            if let Some([one, other]) = clipped(a, b, middle - reach, middle + reach) {
                (left, right) = (left.min(one).min(other), right.max(one).max(other));
            }
        }
        if left <= right {
            let begin = ((left - reach - 0.5).floor() + 1.0).max(0.0) as usize;
            let end = (right + reach - 0.5).ceil().max(0.0) as usize;
            span(y, begin, end.max(begin));
        }
    }
}

/// Where a side's part between two heights begins and ends along x.
fn clipped(a: Vec2, b: Vec2, low: f32, high: f32) -> Option<[f32; 2]> {
    if a.y.max(b.y) < low || a.y.min(b.y) > high {
        return None;
    }
    let at = |y: f32| {
        let y = y.clamp(low, high);
        if a.y == b.y { None } else { Some(a.x + (b.x - a.x) * ((y - a.y) / (b.y - a.y)).clamp(0.0, 1.0)) }
    };
    Some([at(a.y).unwrap_or(a.x), at(b.y).unwrap_or(b.x)])
}
