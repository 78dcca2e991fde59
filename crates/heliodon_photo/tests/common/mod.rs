//! Cameras that tests look through.

use glam::{DMat3, DQuat, DVec3};
use heliodon_photo::camera::{Camera, Intrinsics, Pose};

/// A camera at `eye` that looks at `target`, upright.
pub fn look_at(eye: DVec3, target: DVec3, width: u32, height: u32, focal_px: f64) -> Camera {
    let ahead = (target - eye).try_normalize().unwrap();
    let right = ahead.cross(DVec3::Y).try_normalize().unwrap();
    let down = ahead.cross(right);
    let world_from_camera = DMat3::from_cols(right, down, ahead);
    let rotation = DQuat::from_mat3(&world_from_camera).inverse();
    let intrinsics = Intrinsics {
        width,
        height,
        focal_px: [focal_px; 2],
        centre_px: [0.5 * f64::from(width), 0.5 * f64::from(height)],
        radial: [-0.08, 0.01, 0.0],
        tangential: [0.0004, -0.0003],
    };
    Camera { intrinsics, pose: Pose { rotation, translation: -(rotation * eye) } }
}

/// Cameras on a circle about the origin.
pub fn around(count: u32, radius_m: f64, height_m: f64, target: DVec3, size: [u32; 2], focal_px: f64) -> Vec<Camera> {
    let eye = |i: u32| {
        let angle = std::f64::consts::TAU * (f64::from(i) + 0.3) / f64::from(count);
        DVec3::new(radius_m * libm::cos(angle), height_m + 0.4 * f64::from(i % 3), radius_m * libm::sin(angle))
    };
    (0..count).map(|i| look_at(eye(i), target, size[0], size[1], focal_px)).collect()
}
