//! Where a photograph's pixels look.
//!
//! Brown-Conrady distortion as OpenCV and COLMAP write it (D. C. Brown: Close-range camera calibration, Photogrammetric Engineering 37, 1971),
//! so that parameters from those programs need no conversion.

use glam::{DMat2, DMat3, DQuat, DVec2, DVec3};

/// Newton steps that undistort a pixel; from the distorted point as a start, lenses of real cameras need three to five.
const MAX_NEWTON_STEPS: usize = 40;

/// Halvings that bring any pixel into the range of a lens whose parameters are finite.
const MAX_HALVINGS: usize = 600;

/// How far undistorted coordinates may still move, in units of the focal length, when Newton's method counts as settled: a millionth of a
/// pixel at a focal length of 10,000 pixels.
const SETTLED: f64 = 1e-10;

/// Pinhole with Brown-Conrady distortion. Pixel centres lie at half-integers (0.5, 0.5 is the middle of the first pixel), x right, y down.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Intrinsics {
    /// Columns of the photograph.
    pub width: u32,
    /// Rows of the photograph.
    pub height: u32,
    /// Focal length in pixels, along x and y: positive.
    pub focal_px: [f64; 2],
    /// Where the optical axis meets the photograph.
    pub centre_px: [f64; 2],
    /// k1, k2, k3 of the radial polynomial 1 + k1 r^2 + k2 r^4 + k3 r^6.
    pub radial: [f64; 3],
    /// p1, p2 of the tangential part, in OpenCV's order.
    pub tangential: [f64; 2],
}

/// camera_from_world: x_c = R x_w + t; the camera looks along +Z, +X right, +Y down (as COLMAP and OpenCV). World: Heliodon's (metres, +Y up,
/// -Z north).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// R, a unit quaternion.
    pub rotation: DQuat,
    /// t, in the world's unit.
    pub translation: DVec3,
}

/// A photograph's lens and place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// The lens.
    pub intrinsics: Intrinsics,
    /// The place.
    pub pose: Pose,
}

impl Intrinsics {
    /// A pinhole without distortion whose axis meets the middle of the photograph.
    #[must_use]
    pub fn pinhole(width: u32, height: u32, focal_px: f64) -> Self {
        let centre_px = [f64::from(width) / 2.0, f64::from(height) / 2.0];
        Self { width, height, focal_px: [focal_px; 2], centre_px, radial: [0.0; 3], tangential: [0.0; 2] }
    }

    /// True where all of the distortion's parameters are zero.
    #[must_use]
    pub fn is_undistorted(&self) -> bool {
        self.radial == [0.0; 3] && self.tangential == [0.0; 2]
    }

    /// Distorts coordinates on the plane at distance 1.
    #[must_use]
    pub fn distort(&self, plane: DVec2) -> DVec2 {
        let [k1, k2, k3] = self.radial;
        let [p1, p2] = self.tangential;
        let (x, y) = (plane.x, plane.y);
        let r2 = x * x + y * y;
        let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        DVec2::new(
            x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
            y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
        )
    }

    /// The derivative of [`distort`](Self::distort); columns are the derivatives along x and y.
    #[must_use]
    pub fn distort_jacobian(&self, plane: DVec2) -> DMat2 {
        let [k1, k2, k3] = self.radial;
        let [p1, p2] = self.tangential;
        let (x, y) = (plane.x, plane.y);
        let r2 = x * x + y * y;
        let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        let slope = 2.0 * (k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3));
        let mixed = x * y * slope + 2.0 * p1 * x + 2.0 * p2 * y;
        DMat2::from_cols(
            DVec2::new(radial + x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x, mixed),
            DVec2::new(mixed, radial + y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x),
        )
    }

    /// True where the radial polynomial rises from the axis to this squared radius, so that no two points are drawn in one place.
    #[must_use]
    pub fn is_one_to_one(&self, radius_squared: f64) -> bool {
        let [k1, k2, k3] = self.radial;
        // d/dr of r (1 + k1 s + k2 s^2 + k3 s^3) at s = r^2 must stay positive: at the end, and at its own extrema before it.
        let (a, b, c) = (3.0 * k1, 5.0 * k2, 7.0 * k3);
        let slope = |s: f64| 1.0 + s * (a + s * (b + s * c));
        let inside = |s: f64| s.is_finite() && s > 0.0 && s < radius_squared;
        if !(slope(radius_squared) > 0.0) {
            return false;
        }
        let (qa, qb, qc) = (3.0 * c, 2.0 * b, a);
        let discriminant = qb * qb - 4.0 * qa * qc;
        if discriminant < 0.0 {
            return true;
        }
        let q = -0.5 * (qb + discriminant.sqrt().copysign(qb));
        [q / qa, qc / q].into_iter().all(|s| !inside(s) || slope(s) > 0.0)
    }

    /// The pixel of a point before the camera, in the camera's own space; `None` behind it or outside the distortion's one-to-one range.
    #[must_use]
    pub fn project(&self, in_camera: DVec3) -> Option<DVec2> {
        // Also refuses what is not a number.
        if !(in_camera.z > 0.0) {
            return None;
        }
        let plane = in_camera.truncate() / in_camera.z;
        if !plane.is_finite() {
            return None;
        }
        if self.is_undistorted() {
            return Some(self.pixel_from_plane(plane));
        }
        self.is_one_to_one(plane.length_squared()).then(|| self.pixel_from_plane(self.distort(plane)))
    }

    /// Where a pixel's ray meets the plane at distance 1 before the camera, distortion inverted by Newton's method. `None` for a pixel that no
    /// point in the distortion's one-to-one range is drawn on.
    #[must_use]
    pub fn unproject(&self, pixel: DVec2) -> Option<DVec2> {
        let (plane, settled) = self.nearest_plane(pixel);
        settled.then_some(plane)
    }

    fn pixel_from_plane(&self, distorted: DVec2) -> DVec2 {
        DVec2::new(self.focal_px[0] * distorted.x + self.centre_px[0], self.focal_px[1] * distorted.y + self.centre_px[1])
    }

    /// The undistorted point whose picture comes nearest to `pixel` on Newton's way, and whether it gets there.
    fn nearest_plane(&self, pixel: DVec2) -> (DVec2, bool) {
        let target =
            DVec2::new((pixel.x - self.centre_px[0]) / self.focal_px[0], (pixel.y - self.centre_px[1]) / self.focal_px[1]);
        if !target.is_finite() {
            return (DVec2::ZERO, false);
        }
        if self.is_undistorted() {
            return (target, true);
        }
        let mut point = target;
        // A start outside the range could settle on the polynomial's other branch.
        for _ in 0..MAX_HALVINGS {
            if self.is_one_to_one(point.length_squared()) {
                break;
            }
            point *= 0.5;
        }
        let mut error = self.distort(point) - target;
        for _ in 0..MAX_NEWTON_STEPS {
            let jacobian = self.distort_jacobian(point);
            if jacobian.determinant().abs() < f64::MIN_POSITIVE {
                break;
            }
            let full = jacobian.inverse() * error;
            let mut step = full;
            let (next, next_error) = loop {
                let next = point - step;
                let next_error = self.distort(next) - target;
                if self.is_one_to_one(next.length_squared()) && next_error.length_squared() < error.length_squared() {
                    break (next, next_error);
                }
                step *= 0.5;
                // Also ends what is not a number.
                if !(step.length_squared() >= SETTLED * SETTLED) {
                    break (point, error);
                }
            };
            let moved = next - point;
            (point, error) = (next, next_error);
            if moved.length_squared() < SETTLED * SETTLED {
                break;
            }
        }
        (point, error.length() < 10.0 * SETTLED)
    }
}

impl Pose {
    /// The pose of a camera that stands at `centre` and turns by `rotation` (camera from world).
    #[must_use]
    pub fn from_centre(rotation: DQuat, centre: DVec3) -> Self {
        Self { rotation, translation: -(rotation * centre) }
    }

    /// The pose of a camera at `eye` that looks at `target`, upright in a world whose up is +Y. `None` where the two coincide or the view is
    /// straight up or down, where upright means nothing.
    #[must_use]
    pub fn look_at(eye: DVec3, target: DVec3) -> Option<Self> {
        let forward = (target - eye).try_normalize()?;
        let right = forward.cross(DVec3::Y).try_normalize()?;
        let down = forward.cross(right);
        let camera_from_world = DMat3::from_cols(right, down, forward).transpose();
        Some(Self::from_centre(DQuat::from_mat3(&camera_from_world), eye))
    }

    /// A point of the world in the camera's space.
    #[must_use]
    pub fn to_camera(&self, world: DVec3) -> DVec3 {
        self.rotation * world + self.translation
    }

    /// Where the camera stands in the world.
    #[must_use]
    pub fn centre(&self) -> DVec3 {
        -(self.rotation.conjugate() * self.translation)
    }
}

impl Camera {
    /// The pixel of a point of the world; `None` behind the camera or outside the distortion's one-to-one range. The pixel may lie outside the
    /// photograph.
    #[must_use]
    pub fn project(&self, world: DVec3) -> Option<DVec2> {
        self.intrinsics.project(self.pose.to_camera(world))
    }

    /// The ray that a pixel saw: origin and unit direction in the world. A pixel outside the distortion's range gets the ray that comes
    /// nearest to it.
    #[must_use]
    pub fn ray(&self, pixel: DVec2) -> (DVec3, DVec3) {
        let (plane, _) = self.intrinsics.nearest_plane(pixel);
        let in_camera = plane.extend(1.0);
        (self.centre(), self.pose.rotation.conjugate() * (in_camera / in_camera.length()))
    }

    /// Where the camera stands in the world.
    #[must_use]
    pub fn centre(&self) -> DVec3 {
        self.pose.centre()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wide() -> Intrinsics {
        Intrinsics {
            radial: [-0.28, 0.09, -0.012],
            tangential: [0.0011, -0.0007],
            focal_px: [900.0, 905.0],
            ..Intrinsics::pinhole(1600, 1200, 900.0)
        }
    }

    #[test]
    fn what_is_projected_comes_back_along_its_ray() {
        let pose = Pose::look_at(DVec3::new(4.0, 2.0, 9.0), DVec3::new(0.3, 1.0, 0.0)).unwrap();
        let camera = Camera { intrinsics: wide(), pose };
        for step in 0..60 {
            let t = f64::from(step);
            let world = DVec3::new((t * 0.37).sin() * 3.0, (t * 0.73).cos() * 2.0, (t * 0.19).sin() * 2.0);
            let pixel = camera.project(world).unwrap();
            let (origin, direction) = camera.ray(pixel);
            let along = (world - origin).dot(direction);
            assert!(along > 0.0);
            assert!((origin + direction * along - world).length() < 1e-8, "{world}");
            assert!((direction.length() - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn the_middle_of_the_picture_looks_ahead_and_up_is_up() {
        let camera = Camera {
            intrinsics: Intrinsics::pinhole(640, 480, 500.0),
            pose: Pose::look_at(DVec3::new(0.0, 0.0, 5.0), DVec3::ZERO).unwrap(),
        };
        assert!((camera.project(DVec3::ZERO).unwrap() - DVec2::new(320.0, 240.0)).length() < 1e-9);
        // North is -Z, so +X (east) lies to the right, and what is higher has the smaller row.
        assert!(camera.project(DVec3::X).unwrap().x > 320.0);
        assert!(camera.project(DVec3::Y).unwrap().y < 240.0);
        assert!((camera.centre() - DVec3::new(0.0, 0.0, 5.0)).length() < 1e-12);
        assert_eq!(camera.project(DVec3::new(0.0, 0.0, 6.0)), None);
    }

    #[test]
    fn the_distortions_derivative_agrees_with_differences() {
        let lens = wide();
        let point = DVec2::new(0.31, -0.22);
        let jacobian = lens.distort_jacobian(point);
        let h = 1e-6;
        for (column, step) in [(jacobian.x_axis, DVec2::new(h, 0.0)), (jacobian.y_axis, DVec2::new(0.0, h))] {
            let difference = (lens.distort(point + step) - lens.distort(point - step)) / (2.0 * h);
            assert!((difference - column).length() < 1e-8);
        }
    }

    #[test]
    fn beyond_the_fold_of_a_polynomial_nothing_is_drawn() {
        // r - 0.3 r^3 turns back at r = 1.054.
        let lens = Intrinsics { radial: [-0.3, 0.0, 0.0], ..Intrinsics::pinhole(1000, 1000, 500.0) };
        assert!(lens.project(DVec3::new(1.0, 0.0, 1.0)).is_some());
        assert!(lens.project(DVec3::new(1.1, 0.0, 1.0)).is_none());
        // The widest picture is 0.7027 focal lengths from the centre.
        assert!(lens.unproject(DVec2::new(500.0 + 0.70 * 500.0, 500.0)).is_some());
        assert!(lens.unproject(DVec2::new(500.0 + 0.71 * 500.0, 500.0)).is_none());
        // A polynomial that dips and rises again counts only as far as the dip.
        let dips = Intrinsics { radial: [-1.0, 0.4, 0.0], ..lens };
        assert!(dips.is_one_to_one(0.3));
        assert!(!dips.is_one_to_one(4.0));
    }

    #[test]
    fn what_is_not_a_number_is_nowhere() {
        for bad in [f64::NAN, f64::INFINITY, 1e300] {
            let lens = Intrinsics { radial: [bad, -bad, bad], ..wide() };
            assert_eq!(lens.unproject(DVec2::new(100.0, 200.0)).filter(|p| !p.is_finite()), None);
        }
        let lens = wide();
        assert_eq!(lens.project(DVec3::new(f64::NAN, 0.0, 1.0)), None);
        assert_eq!(lens.project(DVec3::new(0.0, 0.0, f64::NAN)), None);
        assert_eq!(lens.unproject(DVec2::new(f64::INFINITY, 0.0)), None);
    }
}
