//! How fine each piece of stone is cut into triangles: by its size in the picture that a visitor sees.
//!
//! Light is stored per vertex, so a shadow's edge is as sharp as triangles are small **on the screen**. Everything is
//! therefore cut to a length in pixels, seen from the worst place of the visitor's room, foreshortening counted.

use glam::Vec3;
use heliodon_math::frame::unit_or;

/// Rows of the picture that lengths in pixels refer to.
pub const PICTURE_HEIGHT_PX: f32 = 768.0;
/// Columns of that picture.
pub const PICTURE_WIDTH_PX: f32 = 1024.0;
/// Vertical opening of that picture, in degrees.
pub const PICTURE_FOV_DEG: f32 = 50.0;
/// Pixels per unit of tangent: `PICTURE_HEIGHT_PX / 2 / tan(PICTURE_FOV_DEG / 2)`.
pub const FOCAL_PX: f32 = 823.49;

/// No closer than this does a visitor's eye come to stone (metres); bounds the sizes in pixels.
const NEAREST: f32 = 0.6;
/// Cosine of the angle from the middle of the picture to its corners, and a little beyond.
const LEAST_COSINE: f32 = 0.77;
/// Sides turned away from every eye are this much coarser.
pub const COARSER_BACK: f32 = 4.0;

/// Where the visitor's eyes can be, and where they look.
#[derive(Clone, Debug)]
pub struct View {
    eyes: [Vec3; 9],
    centre: Vec3,
    forward: Vec3,
    /// The direction through the middle of the picture.
    axis: Vec3,
}

impl View {
    /// The view from a box of eyes towards a point.
    pub fn new(room: (Vec3, Vec3), look_at: Vec3) -> Self {
        let (low, high) = room;
        let centre = (low + high) * 0.5;
        let mut eyes = [centre; 9];
        for (i, eye) in eyes.iter_mut().take(8).enumerate() {
            let pick = |bit: usize, a: f32, b: f32| if i & bit == 0 { a } else { b };
            *eye = Vec3::new(pick(1, low.x, high.x), pick(2, low.y, high.y), pick(4, low.z, high.z));
        }
        let to = look_at - centre;
        let forward = unit_or(Vec3::new(to.x, 0.0, to.z), Vec3::X);
        Self { eyes, centre, forward, axis: unit_or(to, forward) }
    }

    /// How much longer than in its middle an angle shows towards the picture's edges, on a plane: the root of the ratio of
    /// areas, `1 / cos^3`.
    pub fn stretch(&self, to: Vec3) -> f32 {
        let cosine = (to.dot(self.axis) / to.length().max(1e-6)).max(LEAST_COSINE);
        1.0 / (cosine * cosine.sqrt())
    }

    /// The corners and the middle of the room.
    pub fn eyes(&self) -> &[Vec3; 9] {
        &self.eyes
    }

    /// The middle of the room.
    pub fn centre(&self) -> Vec3 {
        self.centre
    }

    /// The horizontal direction in which visitors look.
    pub fn forward(&self) -> Vec3 {
        self.forward
    }

    /// How far out of the picture a direction points: 1 at its edges, infinite behind.
    pub fn outside(&self, to: Vec3) -> f32 {
        let right = unit_or(self.axis.cross(Vec3::Y), Vec3::X);
        let depth = to.dot(self.axis).max(1e-6) / FOCAL_PX;
        let (x, y) = (to.dot(right).abs() / depth, to.dot(right.cross(self.axis)).abs() / depth);
        (2.0 * x / PICTURE_WIDTH_PX).max(2.0 * y / PICTURE_HEIGHT_PX)
    }

    /// The greatest length in pixels that the vector `edge` at `at` has for any eye.
    pub fn edge_px(&self, at: Vec3, edge: Vec3) -> f32 {
        self.eyes.iter().fold(0.0_f32, |worst, &eye| {
            let to = eye - at;
            let distance = to.length().max(NEAREST);
            // the part of the edge across the line of sight; at grazing sight relief still shows, hence the floor
            let across = edge.cross(to).length() / distance;
            worst.max(across.max(0.12 * edge.length()) * FOCAL_PX / distance * self.stretch(-to))
        })
    }

    /// Length in pixels of something `length` metres long at `at`, seen square on.
    pub fn length_px(&self, at: Vec3, length: f32) -> f32 {
        let shown = |eye: &Vec3| self.stretch(at - *eye) / (*eye - at).length().max(NEAREST);
        length * FOCAL_PX * self.eyes.iter().map(shown).fold(0.0, f32::max)
    }

    /// Whether any eye lies before the surface, or so little behind its plane that relief might show.
    pub fn sees(&self, at: Vec3, normal: Vec3) -> bool {
        self.sees_within(at, normal, 0.06)
    }

    /// [`View::sees`] with the sine of how far behind the plane an eye may be.
    pub fn sees_within(&self, at: Vec3, normal: Vec3, sine: f32) -> bool {
        self.eyes.iter().any(|&eye| {
            let to = eye - at;
            normal.dot(to) > -sine * to.length()
        })
    }

    /// How much coarser things at `at` may be because visitors rarely turn there: 1 before them, 3 behind.
    pub fn aside(&self, at: Vec3) -> f32 {
        let to = at - self.centre;
        let flat = Vec3::new(to.x, 0.0, to.z);
        let cosine = unit_or(flat, self.forward).dot(self.forward);
        // full sharpness to 38 degrees on either side, then wider
        1.0 + 2.0 * super::noise::smoothstep(0.79, 0.2, cosine)
    }
}

/// A view with a length in pixels to cut to.
#[derive(Clone, Copy, Debug)]
pub struct Grain<'a> {
    /// The view.
    pub view: &'a View,
    /// Longest leg of a triangle, in pixels.
    pub px: f32,
    /// Whether ornaments are kept however small they are.
    pub ornaments: bool,
}

impl Grain<'_> {
    /// Steps to cut a seen edge into. `coarser` multiplies the length.
    pub fn seen_steps(&self, at: Vec3, edge: Vec3, coarser: f32) -> u32 {
        self.steps(self.view.edge_px(at, edge), at, coarser)
    }

    /// Steps to cut an edge into that no eye sees.
    pub fn back_steps(&self, at: Vec3, edge: Vec3, coarser: f32) -> u32 {
        self.steps(self.view.length_px(at, edge.length()), at, coarser * COARSER_BACK)
    }

    fn steps(&self, length_px: f32, at: Vec3, coarser: f32) -> u32 {
        ((length_px / (self.px * coarser * self.view.aside(at))).ceil() as u32).clamp(1, 4096)
    }

    /// Whether an ornament of this size is worth its triangles here.
    pub fn shows(&self, at: Vec3, size: f32, coarser: f32) -> bool {
        self.ornaments || self.view.length_px(at, size) > 0.4 * self.px * coarser * self.view.aside(at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn view() -> View {
        View::new((Vec3::new(-1.0, 0.0, -1.0), Vec3::new(1.0, 1.0, 1.0)), Vec3::new(0.0, 0.5, -50.0))
    }

    #[test]
    fn the_focal_length_is_that_of_the_picture() {
        let exact = f64::from(PICTURE_HEIGHT_PX) / 2.0 / (f64::from(PICTURE_FOV_DEG) / 2.0).to_radians().tan();
        assert!((f64::from(FOCAL_PX) - exact).abs() < 0.01, "{exact}");
    }

    #[test]
    fn a_metre_shrinks_with_distance_and_slant() {
        let view = view();
        let near = view.edge_px(Vec3::new(0.0, 0.5, -21.0), Vec3::X);
        let far = view.edge_px(Vec3::new(0.0, 0.5, -41.0), Vec3::X);
        assert!((near - FOCAL_PX / 20.0).abs() < 0.5 && (far - FOCAL_PX / 40.0).abs() < 0.3);
        // on the plane of the picture an angle is longer to the side
        let aside = Vec3::new(-0.5, 0.0, -1.0);
        assert!((view.stretch(aside) - libm::powf(1.25, 0.75)).abs() < 0.01);
        assert!(view.edge_px(Vec3::new(0.0, 0.5, -41.0), Vec3::Z) < 0.2 * far);
    }

    #[test]
    fn what_lies_behind_is_coarser() {
        let view = view();
        assert_eq!(view.aside(Vec3::new(0.0, 0.0, -30.0)), 1.0);
        assert_eq!(view.aside(Vec3::new(0.0, 0.0, 30.0)), 3.0);
        assert!(view.sees(Vec3::new(0.0, 0.0, -30.0), Vec3::Z) && !view.sees(Vec3::new(0.0, 0.0, -30.0), Vec3::NEG_Z));
    }
}
