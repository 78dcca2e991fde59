//! The derivatives of a point's picture.

use super::LENS_UNKNOWNS;
use crate::camera::Camera;
use glam::{DMat3, DVec2, DVec3};

/// The picture of a point and its derivatives, in pixels; every array has one row an axis of the picture.
pub(super) struct Projection {
    pub(super) pixel: DVec2,
    /// Along a small rotation of the camera (x_c = exp(w) R x + t) and a small shift of t.
    pub(super) pose: [[f64; 6]; 2],
    /// Along the lens's unknowns, in their order.
    pub(super) lens: [[f64; LENS_UNKNOWNS]; 2],
    /// Along the point's place in the world.
    pub(super) point: [[f64; 3]; 2],
}

pub(super) fn project(camera: &Camera, world: DVec3) -> Option<Projection> {
    let lens = &camera.intrinsics;
    let rotation = DMat3::from_quat(camera.pose.rotation);
    let turned = rotation * world;
    let in_camera = turned + camera.pose.translation;
    let pixel = lens.project(in_camera)?;
    let plane = in_camera.truncate() / in_camera.z;
    let distorted = lens.distort(plane);
    let slope = lens.distort_jacobian(plane);
    let [fx, fy] = lens.focal_px;
    let inverse_z = 1.0 / in_camera.z;
    // rows of d pixel / d in_camera
    let row = |focal: f64, along_x: f64, along_y: f64| {
        let (gx, gy) = (focal * along_x * inverse_z, focal * along_y * inverse_z);
        DVec3::new(gx, gy, -(gx * plane.x + gy * plane.y))
    };
    let rows = [row(fx, slope.x_axis.x, slope.y_axis.x), row(fy, slope.x_axis.y, slope.y_axis.y)];
    let pose = rows.map(|g| {
        // d(w x turned)/dw dotted with g is turned x g
        let w = turned.cross(g);
        [w.x, w.y, w.z, g.x, g.y, g.z]
    });
    let transposed = rotation.transpose();
    let point = rows.map(|g| (transposed * g).to_array());
    let (x, y) = (plane.x, plane.y);
    let r2 = plane.length_squared();
    let (r4, ratio) = (r2 * r2, fy / fx);
    let lens_rows = [
        [distorted.x, 1.0, 0.0, fx * x * r2, fx * x * r4, fx * x * r4 * r2, fx * 2.0 * x * y, fx * (r2 + 2.0 * x * x)],
        [distorted.y * ratio, 0.0, 1.0, fy * y * r2, fy * y * r4, fy * y * r4 * r2, fy * (r2 + 2.0 * y * y), fy * 2.0 * x * y],
    ];
    Some(Projection { pixel, pose, lens: lens_rows, point })
}

#[cfg(test)]
mod tests {
    use super::super::{rotation_from_vector, unknowns, with_unknowns};
    use super::*;
    use crate::camera::{Intrinsics, Pose};

    #[test]
    fn derivatives_agree_with_differences() {
        let intrinsics = Intrinsics {
            focal_px: [800.0, 820.0],
            radial: [-0.2, 0.05, -0.01],
            tangential: [0.001, -0.002],
            ..Intrinsics::pinhole(1200, 900, 800.0)
        };
        let camera = Camera { intrinsics, pose: Pose::look_at(DVec3::new(3.0, 1.0, 6.0), DVec3::ZERO).unwrap() };
        let world = DVec3::new(0.7, -0.4, 0.5);
        let all = project(&camera, world).unwrap();
        let h = 1e-6;
        let check = |analytic: [f64; 2], at: &dyn Fn(f64) -> DVec2, name: &str| {
            let difference = (at(h) - at(-h)) / (2.0 * h);
            let error = (difference - DVec2::from(analytic)).length();
            assert!(error < 1e-5 * (1.0 + difference.length()), "{name}: {difference} against {analytic:?}");
        };
        for axis in 0..3 {
            let unit = DVec3::AXES[axis];
            check(all.point.map(|r| r[axis]), &|s| camera.project(world + unit * s).unwrap(), "point");
            let shifted = |s: f64| {
                let mut moved = camera;
                moved.pose.translation += unit * s;
                moved.project(world).unwrap()
            };
            check(all.pose.map(|r| r[axis + 3]), &shifted, "shift");
            let turned = |s: f64| {
                let mut moved = camera;
                moved.pose.rotation = rotation_from_vector(unit * s) * moved.pose.rotation;
                moved.project(world).unwrap()
            };
            check(all.pose.map(|r| r[axis]), &turned, "turn");
        }
        for i in 0..LENS_UNKNOWNS {
            let changed = |s: f64| {
                let mut values = unknowns(&camera.intrinsics);
                values[i] += s;
                Camera { intrinsics: with_unknowns(&camera.intrinsics, values), ..camera }.project(world).unwrap()
            };
            check(all.lens.map(|r| r[i]), &changed, "lens");
        }
    }
}
