//! Off-axis perspective as Bevy's cameras take it.

use bevy::camera::{CameraProjection, SubCameraView};
use bevy::math::{Mat4, Vec3A};
use heliodon_math::screen::OffAxis;

/// What an eye sees through a screen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScreenProjection {
    /// The perspective.
    pub view: OffAxis,
    /// Nothing nearer is drawn, metres of the site.
    pub near_m: f32,
    /// Nothing farther is drawn.
    pub far_m: Option<f32>,
}

/// As far as Bevy's own cameras see, for what is of Bevy.
const BEVY_FAR_M: f32 = 1000.0;

impl CameraProjection for ScreenProjection {
    fn get_clip_from_view(&self) -> Mat4 {
        self.view.clip_from_view(self.near_m, self.far_m)
    }

    /// A part of the picture as a picture of its own.
    fn get_clip_from_view_for_sub(&self, part: &SubCameraView) -> Mat4 {
        let (full, size) = (part.full_size.as_vec2(), part.size.as_vec2());
        let OffAxis { left, right, bottom, top, .. } = self.view;
        let (width, height) = ((right - left) / full.x, (top - bottom) / full.y);
        let from_left = left + width * part.offset.x;
        let from_top = top - height * part.offset.y;
        let view = OffAxis {
            left: from_left,
            right: from_left + width * size.x,
            bottom: from_top - height * size.y,
            top: from_top,
            ..self.view
        };
        view.clip_from_view(self.near_m, self.far_m)
    }

    /// A screen's shape does not follow its picture's.
    fn update(&mut self, _width: f32, _height: f32) {}

    fn far(&self) -> f32 {
        self.far_m.unwrap_or(BEVY_FAR_M)
    }

    fn get_frustum_corners(&self, z_near: f32, z_far: f32) -> [Vec3A; 8] {
        let OffAxis { left, right, bottom, top, .. } = self.view;
        let at = |z: f32, x: f32, y: f32| Vec3A::new(x * z.abs(), y * z.abs(), z);
        let of = |z: f32| [at(z, right, bottom), at(z, right, top), at(z, left, top), at(z, left, bottom)];
        let ([a, b, c, d], [e, f, g, h]) = (of(z_near), of(z_far));
        [a, b, c, d, e, f, g, h]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bevy::math::{UVec2, Vec2, Vec3};
    use heliodon_math::glam::DVec3;
    use heliodon_math::screen::Screen;

    fn projection() -> ScreenProjection {
        let screen = Screen::from_corners([DVec3::ZERO, DVec3::X * 4.0, DVec3::Y * 3.0]).unwrap();
        ScreenProjection { view: screen.view(DVec3::new(1.0, 1.7, 2.5)), near_m: 0.05, far_m: None }
    }

    #[test]
    fn a_part_shows_what_the_whole_shows_there() {
        let (whole, point) = (projection(), Vec3::new(0.2, -0.1, -4.0));
        let part =
            SubCameraView { full_size: UVec2::new(800, 600), offset: Vec2::new(200.0, 150.0), size: UVec2::new(400, 300) };
        let of_whole = whole.get_clip_from_view().project_point3(point);
        let of_part = whole.get_clip_from_view_for_sub(&part).project_point3(point);
        assert!((of_part.x - of_whole.x * 2.0).abs() < 1e-5 && (of_part.y - of_whole.y * 2.0).abs() < 1e-5);
    }

    #[test]
    fn corners_of_the_frustum_are_those_of_the_picture() {
        let projection = projection();
        let wanted = [[1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0]];
        for (corner, [x, y]) in projection.get_frustum_corners(-0.5, -20.0).into_iter().zip(wanted.into_iter().cycle()) {
            let at = projection.get_clip_from_view().project_point3(corner.into());
            assert!((at.x - x).abs() < 1e-5 && (at.y - y).abs() < 1e-5, "{at}");
        }
    }
}
