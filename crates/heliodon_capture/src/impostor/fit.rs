//! Where the model is in all frames, and how it is fitted into them.

use super::FRAME_STEP;
use glam::{Vec2, Vec3};
use heliodon_bundle::impostor::{ImpostorClip, MAX_LAYER_SIDE};
use heliodon_mesh::motion::{MovingMesh, Pose};

/// Texels between what a frame shows and its border: one is left on the coarsest level.
pub const MARGIN_TEXELS: u32 = 4;
/// What is left of it where somebody places the model themselves: less, and the coarsest level would show its neighbour.
pub const LEAST_MARGIN_TEXELS: f32 = 1.0;
/// Models smaller than this have no size.
const LEAST_M: f32 = 1e-4;

/// The model in each frame.
pub struct Poses {
    /// The middle of all of them.
    pub center: Vec3,
    /// How far from there vertices are at most.
    pub radius_m: f32,
    /// How far vertices are from the vertical line through it at most.
    pub around_m: f32,
    /// The lowest and the highest.
    pub heights_m: [f32; 2],
    /// Positions and normals.
    pub frames: Vec<PosedFrame>,
}

/// The model in a frame.
pub struct PosedFrame {
    /// Where its vertices are.
    pub positions: Vec<Vec3>,
    /// Their unit normals.
    pub normals: Vec<Vec3>,
    /// How much of the sky the model leaves to each; empty for all of it.
    pub openness: Vec<f32>,
}

impl Poses {
    /// # Errors
    /// Models of no size, in words.
    pub fn new(model: &MovingMesh, clips: &[(Option<usize>, ImpostorClip)]) -> Result<Self, String> {
        let mut frames = Vec::new();
        let mut pose = Pose::default();
        for (number, clip) in clips {
            for frame in 0..clip.frames {
                let time_s = clip.duration_s * frame as f32 / clip.frames as f32;
                model.pose(number.unwrap_or(usize::MAX), time_s, &mut pose);
                let Pose { positions, normals, .. } = &pose;
                frames.push(PosedFrame { positions: positions.clone(), normals: normals.clone(), openness: Vec::new() });
            }
        }
        // What no triangle names is not seen.
        let seen = |frame: &PosedFrame| -> Vec<Vec3> {
            model.rest().triangles.iter().flatten().map(|&vertex| frame.positions[vertex as usize]).collect()
        };
        let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for frame in &frames {
            seen(frame).iter().for_each(|&p| (low, high) = (low.min(p), high.max(p)));
        }
        let center = (low + high) * 0.5;
        let farthest = frames.iter().flat_map(seen).map(|p| p.distance(center)).fold(0.0, f32::max);
        // a little more, so that rounding keeps depths within
        let radius_m = farthest * 1.001;
        if !(radius_m > LEAST_M && radius_m.is_finite()) {
            return Err(format!("is {radius_m} m large: there is nothing to see"));
        }
        let around =
            frames.iter().flat_map(seen).map(|p| Vec2::new(p.x - center.x, p.z - center.z).length()).fold(0.0, f32::max);
        Ok(Self { center, radius_m, around_m: around.max(LEAST_M) * 1.001, heights_m: [low.y, high.y], frames })
    }

    /// What a view shows of all frames, along its right and up from the middle: the lower left and the upper right corner.
    pub fn extent(&self, [right, up, _]: &[Vec3; 3]) -> [Vec2; 2] {
        let all = self.frames.iter().flat_map(|frame| &frame.positions).map(|&p| p - self.center);
        // vertices that no triangle names lie anywhere: the sphere holds those that count
        let seen = all.filter(|p| p.length() <= self.radius_m).map(|p| Vec2::new(p.dot(*right), p.dot(*up)));
        seen.fold([Vec2::INFINITY, Vec2::NEG_INFINITY], |[low, high], p| [low.min(p), high.max(p)])
    }
}

/// As many texels as pixels at a distance, for the largest of all views.
pub fn frame_px(shown: &[[Vec2; 2]], distance_m: f32, px_per_radian: f32) -> [u32; 2] {
    let largest = shown.iter().map(|[low, high]| *high - *low).fold(Vec2::ZERO, Vec2::max);
    let px = largest * (px_per_radian / distance_m) + (2 * MARGIN_TEXELS) as f32;
    px.to_array().map(|px| (px.ceil().min(1e6) as u32).next_multiple_of(FRAME_STEP))
}

/// What a frame holds so that what it shows has its margin, metres: left, bottom, right, top.
pub fn window([low, high]: &[Vec2; 2], frame_px: [u32; 2]) -> [f32; 4] {
    let middle = (*low + *high) * 0.5;
    let grown = |axis: usize| {
        let frame = frame_px[axis] as f32;
        // half a texel more: filters reach beyond their samples
        let share = frame / (frame - (2 * MARGIN_TEXELS + 1) as f32);
        (0.5 * (high[axis] - low[axis])).max(LEAST_M) * share
    };
    let half = Vec2::new(grown(0), grown(1));
    [middle.x - half.x, middle.y - half.y, middle.x + half.x, middle.y + half.y]
}

/// How the model stands in its frames, beside being fitted into them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Framing {
    /// How much larger it is than fitted: 1 is as large as all frames of a view allow.
    pub zoom: f32,
    /// How far it is moved to the right and up, in parts of a frame.
    pub shift: [f32; 2],
}

impl Default for Framing {
    fn default() -> Self {
        Self { zoom: 1.0, shift: [0.0; 2] }
    }
}

impl Framing {
    /// A fitted window as it is framed.
    pub fn apply(&self, [left, bottom, right, top]: [f32; 4]) -> [f32; 4] {
        if *self == Self::default() {
            return [left, bottom, right, top];
        }
        let half = Vec2::new(right - left, top - bottom) * (0.5 / self.zoom);
        let middle = Vec2::new(right + left, top + bottom) * 0.5 - Vec2::from(self.shift) * half * 2.0;
        [middle.x - half.x, middle.y - half.y, middle.x + half.x, middle.y + half.y]
    }
}

/// Texels between what a window shows and its nearest border; below 0 where the model is cut.
pub fn margin([left, bottom, right, top]: [f32; 4], [low, high]: &[Vec2; 2], frame_px: [u32; 2]) -> f32 {
    let texels = Vec2::new(frame_px[0] as f32 / (right - left), frame_px[1] as f32 / (top - bottom));
    let lower = (*low - Vec2::new(left, bottom)) * texels;
    let upper = (Vec2::new(right, top) - *high) * texels;
    lower.min(upper).min_element()
}

/// Columns and rows of a layer of so many frames, as near to a square as may be; none where it would be too large.
pub fn grid(frames: u32, [width, height]: [u32; 2]) -> Option<[u32; 2]> {
    let most = [MAX_LAYER_SIDE / width, MAX_LAYER_SIDE / height];
    let sides = (1..=most[0].min(frames)).map(|columns| [columns, frames.div_ceil(columns)]);
    sides.filter(|[_, rows]| *rows <= most[1]).min_by_key(|[columns, rows]| {
        let (w, h) = (columns * width, rows * height);
        (columns * rows, w.max(h))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_lie_in_a_grid_without_waste() {
        assert_eq!(grid(24, [64, 128]), Some([6, 4]));
        assert_eq!(grid(1, [64, 128]), Some([1, 1]));
        let [columns, rows] = grid(23, [128, 128]).unwrap();
        assert!(columns * rows >= 23 && columns * rows <= 24);
        assert_eq!(grid(1000, [2048, 2048]), None);
        assert_eq!(grid(4, [2048, 2048]), Some([2, 2]));
    }

    #[test]
    fn a_framed_model_is_larger_and_where_it_was_put() {
        let shown = [Vec2::new(-0.4, -1.0), Vec2::new(0.6, 0.8)];
        let fitted = window(&shown, [64, 128]);
        assert!((margin(fitted, &shown, [64, 128]) - 4.5).abs() < 0.01);
        let framed = Framing { zoom: 0.5, shift: [0.25, -0.1] }.apply(fitted);
        assert!((framed[2] - framed[0] - 2.0 * (fitted[2] - fitted[0])).abs() < 1e-5);
        // the model's middle lies a quarter of a frame to the right, a tenth below
        let at = [(0.1 - framed[0]) / (framed[2] - framed[0]), (-0.1 - framed[1]) / (framed[3] - framed[1])];
        assert!((at[0] - 0.75).abs() < 1e-5 && (at[1] - 0.4).abs() < 1e-5, "{at:?}");
        assert!(margin(Framing { zoom: 1.3, ..Framing::default() }.apply(fitted), &shown, [64, 128]) < 0.0);
    }

    #[test]
    fn a_window_leaves_a_margin_of_texels() {
        let [left, bottom, right, top] = window(&[Vec2::new(-0.4, -1.0), Vec2::new(0.6, 0.8)], [64, 128]);
        let texel = [(right - left) / 64.0, (top - bottom) / 128.0];
        assert!((-0.4 - left) / texel[0] >= 4.0 && (right - 0.6) / texel[0] >= 4.0);
        assert!((-1.0 - bottom) / texel[1] >= 4.0 && (top - 0.8) / texel[1] >= 4.0 && (top - 0.8) / texel[1] < 5.0);
    }
}
