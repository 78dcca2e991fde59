//! Objects that are too small to matter.
//!
//! Georgios Papaioannou et al., VAST 2003, section 3.2.2, after the DirectModel specification of 1997: objects whose projection stays below a threshold are
//! not drawn. An object that was left out comes back only when it is a quarter larger than the threshold, so that none flickers on its verge.

use super::objects::Objects;
use crate::daylight::view::Eye;
use glam::{Mat4, Vec2};

/// What was left out comes back when it is so many times the threshold.
pub const BACK_AT: f32 = 1.25;

/// How large things are drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    eye: Eye,
    /// Pixels of a radian, where in the picture that is most; of a metre in a parallel view.
    pixels: f32,
}

impl Scale {
    /// Of a view with pictures of `size` pixels.
    #[must_use]
    pub fn new(clip_from_world: &Mat4, size: Vec2, eye: Eye) -> Self {
        let rows = clip_from_world.transpose();
        // How much clip space turns or shifts, for what is before the eye.
        let [across, up] = [rows.x_axis, rows.y_axis].map(|row| row.truncate());
        let forward = rows.w_axis.truncate();
        let pixels = match eye {
            Eye::Along(_) => (across.length() * size.x).max(up.length() * size.y) * 0.5,
            Eye::At(_) => {
                let [x, y] = [across, up].map(|row| (row - forward * row.dot(forward)).length());
                // From the middle to a corner perspective draws things out, by one plus the squared tangent.
                let corner = Vec2::new(1.0 / x, 1.0 / y).length_squared();
                (x * size.x).max(y * size.y) * 0.5 * (1.0 + corner)
            }
        };
        Self { eye, pixels }
    }

    /// The most pixels that a ball may be across.
    #[must_use]
    pub fn pixels(&self, (center, radius): (glam::Vec3, f32)) -> f32 {
        match self.eye {
            Eye::Along(_) => 2.0 * radius * self.pixels,
            Eye::At(eye) => {
                let distance = eye.distance(center);
                if distance <= radius { f32::INFINITY } else { 2.0 * radius / (distance - radius) * self.pixels }
            }
        }
    }
}

/// Which objects a view leaves out, or both views of a pair.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LeftOut {
    /// Of each object the last view that asked for it, and whether that left it out.
    objects: Vec<(u32, bool)>,
    view: u32,
}

impl LeftOut {
    /// Goes on to the next view, or the next two of a pair; if it `remembers` the ones before, what was left out comes back late.
    pub fn next_view<'a>(
        &'a mut self,
        objects: &'a Objects,
        scales: &'a [Scale],
        threshold_px: f32,
        remembers: bool,
    ) -> View<'a> {
        self.view = self.view.wrapping_add(1);
        self.objects.resize(objects.spheres.len(), (self.view.wrapping_sub(1), false));
        View { objects, scales, threshold_px, remembers, left_out: self }
    }

    /// Forgets all views.
    pub fn clear(&mut self) {
        self.objects.clear();
    }
}

/// A view that leaves out what is small. It decides of an object when it is asked for it: a scan may have a million, of which few are met.
pub struct View<'a> {
    objects: &'a Objects,
    scales: &'a [Scale],
    threshold_px: f32,
    remembers: bool,
    left_out: &'a mut LeftOut,
}

impl View<'_> {
    /// Whether all of these are left out.
    pub fn has_all(&mut self, objects: &[u32]) -> bool {
        objects.iter().all(|&object| self.has(object as usize))
    }

    fn has(&mut self, object: usize) -> bool {
        let this = self.left_out.view;
        let Some((view, out)) = self.left_out.objects.get_mut(object) else { return false };
        if *view != this {
            let threshold_px = self.objects.threshold_px(object, self.threshold_px);
            let until = if *out && self.remembers { threshold_px * BACK_AT } else { threshold_px };
            // Where it is larger.
            let pixels = self.scales.iter().map(|scale| scale.pixels(self.objects.spheres[object])).fold(0.0, f32::max);
            (*view, *out) = (this, pixels < until);
        }
        *out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    const SIZE: Vec2 = Vec2::new(1024.0, 768.0);

    fn looking_north() -> Mat4 {
        Mat4::perspective_infinite_reverse_rh(50_f32.to_radians(), SIZE.x / SIZE.y, 0.05)
    }

    #[test]
    fn no_ball_is_drawn_larger_than_it_is_said_to_be() {
        let clip = looking_north();
        let scale = Scale::new(&clip, SIZE, Eye::At(Vec3::ZERO));
        let (distance, radius) = (100.0, 0.1);
        let mut largest = 0.0_f32;
        for (x, y) in [(0.0, 0.0), (0.9, 0.0), (0.0, 0.9), (0.95, 0.95), (-0.95, 0.95)] {
            let forward = clip.inverse().project_point3(Vec3::new(x, y, 0.5));
            let center = heliodon_math::frame::unit_or(forward, Vec3::NEG_Z) * distance;
            let drawn = |point: Vec3| clip.project_point3(point).truncate() * SIZE * 0.5;
            for direction in heliodon_math::sphere::fibonacci_sphere(200) {
                largest = largest.max(2.0 * drawn(center + direction * radius).distance(drawn(center)));
            }
            assert!(largest <= scale.pixels((center, radius)) * 1.001, "{largest} at {x} {y}");
        }
        assert!(largest > 0.9 * scale.pixels((Vec3::Z * distance, radius)), "{largest}: not much less either");
        assert_eq!(scale.pixels((Vec3::ZERO, 1.0)), f32::INFINITY, "the eye is in it");
    }

    #[test]
    fn parallel_views_know_no_distance() {
        let clip = Mat4::orthographic_rh(-20.0, 20.0, -15.0, 15.0, 100.0, 0.0);
        let scale = Scale::new(&clip, SIZE, Eye::Along(Vec3::NEG_Z));
        for z in [0.0, -50.0] {
            assert!((scale.pixels((Vec3::Z * z, 1.0)) - 2.0 * 1024.0 / 40.0).abs() < 1e-3);
        }
    }

    #[test]
    fn what_was_left_out_comes_back_late() {
        let objects = Objects { spheres: vec![(Vec3::ZERO, 0.5)], ..Objects::default() };
        let mut left_out = LeftOut::default();
        let mut at = |pixels: f32, remembers: bool| {
            // From where the ball is so large.
            let unit = Scale::new(&looking_north(), SIZE, Eye::At(Vec3::ZERO)).pixels;
            let eye = Vec3::Z * (unit / pixels + 0.5);
            left_out.next_view(&objects, &[Scale::new(&looking_north(), SIZE, Eye::At(eye))], 2.0, remembers).has_all(&[0])
        };
        assert_eq!(
            [2.1, 1.9, 2.1, 2.4, 2.6, 2.1, 1.9].map(|pixels| at(pixels, true)),
            [false, true, true, true, false, false, true]
        );
        assert!(!at(2.1, false), "a picture for itself remembers nothing");
    }

    #[test]
    fn two_eyes_leave_out_what_is_small_in_both() {
        let objects = Objects { spheres: vec![(Vec3::ZERO, 0.5)], ..Objects::default() };
        let unit = Scale::new(&looking_north(), SIZE, Eye::At(Vec3::ZERO)).pixels;
        let seen = |pixels: f32| Scale::new(&looking_north(), SIZE, Eye::At(Vec3::Z * (unit / pixels + 0.5)));
        let out = |a: f32, b: f32| LeftOut::default().next_view(&objects, &[seen(a), seen(b)], 2.0, true).has_all(&[0]);
        assert_eq!([out(1.9, 2.1), out(2.1, 1.9), out(1.9, 1.8), out(2.1, 2.2)], [false, false, true, false]);
    }
}
