//! The pinhole camera.

use glam::Vec3;
use heliodon_math::frame::unit_or;
use heliodon_rays::Ray;

/// A pinhole camera without distortion; rows run downwards.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Where it stands.
    pub eye: Vec3,
    /// Unit vector of the view.
    pub forward: Vec3,
    /// Unit vector to the right of the picture.
    pub right: Vec3,
    /// Unit vector to the top of the picture.
    pub up: Vec3,
    /// Tangent of half the vertical opening angle.
    pub tan_half_height: f32,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

impl Camera {
    /// A camera at `eye` that looks at `target`, upright with respect to `up`.
    #[must_use]
    pub fn look_at(eye: Vec3, target: Vec3, up: Vec3, vertical_fov_rad: f32, width: u32, height: u32) -> Self {
        let forward = unit_or(target - eye, Vec3::NEG_Z);
        // looking straight along `up`, north or east is as good as any
        let right = unit_or(forward.cross(up), unit_or(forward.cross(Vec3::NEG_Z), Vec3::X));
        let up = right.cross(forward);
        Self { eye, forward, right, up, tan_half_height: libm::tanf(vertical_fov_rad * 0.5), width, height }
    }

    /// The ray through a place of a pixel, `within` from its top left in [0, 1).
    #[must_use]
    pub fn ray(&self, column: u32, row: u32, within: [f32; 2]) -> Ray {
        let (w, h) = (self.width as f32, self.height as f32);
        let x = (2.0 * (column as f32 + within[0]) - w) / h * self.tan_half_height;
        let y = (1.0 - 2.0 * (row as f32 + within[1]) / h) * self.tan_half_height;
        let direction = unit_or(self.forward + self.right * x + self.up * y, self.forward);
        Ray { origin: self.eye, direction, t_min: 0.0, t_max: f32::INFINITY }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_picture_is_upright_and_spans_its_angle() {
        let camera = Camera::look_at(Vec3::ZERO, Vec3::NEG_Z, Vec3::Y, std::f32::consts::FRAC_PI_2, 200, 100);
        assert!((camera.ray(100, 50, [0.0, 0.0]).direction - Vec3::NEG_Z).length() < 1e-6);
        let top = camera.ray(100, 0, [0.0, 0.0]).direction;
        assert!(top.y > 0.0 && (top.y + top.z).abs() < 1e-6, "45 degrees up: {top}");
        assert!(camera.ray(199, 50, [0.5, 0.5]).direction.x > 0.8);
    }
}
