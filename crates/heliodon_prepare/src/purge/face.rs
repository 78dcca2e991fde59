//! The cube of pictures around an eye.

use glam::{Mat3, Quat, Vec3};
use heliodon_math::random::{hash2_u32, unit_f32};
use heliodon_raster::Perspective;

/// The six faces of a cube turned at random, so that no two eyes cut the world along the same lines.
pub(super) fn cube(eye: Vec3, near_m: f32, seed: u32) -> [Perspective; 6] {
    // K. Shoemake, "Uniform Random Rotations", Graphics Gems III, 1992.
    let [a, b, c] = core::array::from_fn(|i| unit_f32(hash2_u32(seed, i as u32)));
    let (s1, c1) = libm::sincosf(std::f32::consts::TAU * b);
    let (s2, c2) = libm::sincosf(std::f32::consts::TAU * c);
    let (flat, steep) = ((1.0 - a).sqrt(), a.sqrt());
    let turn = Mat3::from_quat(Quat::from_xyzw(flat * s1, flat * c1, steep * s2, steep * c2));
    let [x, y, z] = [turn.x_axis, turn.y_axis, turn.z_axis];
    [[x, y, -z], [-x, y, z], [z, y, x], [-z, y, -x], [x, -z, -y], [x, z, y]].map(|axes| Perspective { eye, axes, near_m })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn six_faces_see_every_direction_once() {
        let faces = cube(Vec3::new(1.0, 2.0, 3.0), 0.01, 17);
        for face in faces {
            let [right, up, forward] = face.axes;
            assert!((right.cross(up) + forward).length() < 1e-5);
        }
        for d in heliodon_math::sphere::fibonacci_sphere(5000) {
            let seen = faces.iter().filter(|f| f.beyond(f.place(f.eye + d), 1.0) == 0).count();
            // rounding may give one at an edge to both faces or to none
            assert!(seen == 1 || faces.iter().filter(|f| f.beyond(f.place(f.eye + d), 1.0001) == 0).count() > 1, "{d}");
        }
    }
}
