//! How much room an impostor takes: the upright prism that none of its pictures shows anything beyond.

use glam::{Vec2, Vec3};
use heliodon_bundle::impostor::ImpostorInfo;

/// Texels around what a picture shows that its window has for its coarser levels, as they are captured.
const MARGIN_PX: f32 = 4.0;

/// The prism's corners in the model's space: as high as the model in any of its frames, and as wide as each of its views shows it.
#[must_use]
pub fn corners(info: &ImpostorInfo) -> Vec<Vec3> {
    let around = info.around_m;
    let mut outline = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|side| Vec2::from(side) * around).to_vec();
    for ([right, ..], [left_m, _, right_m, _]) in info.view_axes().zip(&info.windows_m) {
        // a view's right is level whatever its elevation
        let right = Vec2::new(right.x, right.z);
        let margin_m = (MARGIN_PX * (right_m - left_m) / info.frame_px[0] as f32).min(0.25 * (right_m - left_m));
        outline = cut(&outline, right, right_m - margin_m);
        outline = cut(&outline, -right, -(left_m + margin_m));
    }
    let [x, _, z] = info.center;
    info.heights_m.iter().flat_map(|&y| outline.iter().map(move |at| Vec3::new(x + at.x, y, z + at.y))).collect()
}

/// What of a convex outline lies no farther than `most` along a direction.
fn cut(outline: &[Vec2], along: Vec2, most: f32) -> Vec<Vec2> {
    let mut left = Vec::with_capacity(outline.len() + 1);
    for (i, &from) in outline.iter().enumerate() {
        let to = outline[(i + 1) % outline.len()];
        let [before, after] = [from, to].map(|at| at.dot(along) - most);
        if before <= 0.0 {
            left.push(from);
        }
        if (before < 0.0 && after > 0.0) || (before > 0.0 && after < 0.0) {
            left.push(from.lerp(to, before / (before - after)));
        }
    }
    left
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use heliodon_bundle::impostor::{ImpostorClip, Ring};

    /// What a box of these sides that stands on the ground is as an impostor, its texels apart.
    pub(crate) fn of_a_box(sides: Vec3) -> ImpostorInfo {
        let half = sides * 0.5;
        let mut info = ImpostorInfo {
            version: 1,
            name: "box".to_owned(),
            center: [0.0, half.y, 0.0],
            radius_m: half.length(),
            around_m: Vec2::new(half.x, half.z).length(),
            heights_m: [0.0, sides.y],
            rings: vec![Ring::around(5.0, 24)],
            windows_m: Vec::new(),
            frame_px: [64, 64],
            grid: [1, 1],
            clips: vec![ImpostorClip { name: "rest".to_owned(), duration_s: 0.0, first: 0, frames: 1 }],
            distance_m: 10.0,
        };
        let with_margin = |half_m: f32| half_m * 64.0 / (64.0 - 2.0 * MARGIN_PX);
        let windows = info.view_axes().map(|[right, up, _]| {
            let [wide, high] = [right, up].map(|axis| with_margin(axis.abs().dot(half)));
            [-wide, -high, wide, high]
        });
        info.windows_m = windows.collect();
        info
    }

    #[test]
    fn a_box_is_a_box_again() {
        let corners = corners(&of_a_box(Vec3::new(0.6, 0.3, 0.2)));
        for along in [Vec3::X, Vec3::NEG_X, Vec3::Z, Vec3::NEG_Z] {
            let far = corners.iter().map(|corner| corner.dot(along)).fold(0.0, f32::max);
            let wanted = along.abs().dot(Vec3::new(0.3, 0.0, 0.1));
            assert!((far - wanted).abs() < 1e-3, "{far} along {along}");
        }
        assert!(corners.iter().all(|corner| corner.y == 0.0 || corner.y == 0.3) && corners.len() < 40, "{corners:?}");
    }
}
