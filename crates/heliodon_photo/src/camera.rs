//! The camera that took a photograph: a pinhole with the lens's distortion, and where it stood.

use glam::{DQuat, DVec2, DVec3};

/// Pinhole with Brown-Conrady distortion. Pixel centres lie at half-integers (0.5, 0.5 is the middle of the first pixel), x right, y down.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Intrinsics {
    /// Columns of the photograph.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Focal length along x and y, pixels.
    pub focal_px: [f64; 2],
    /// Principal point, pixels.
    pub centre_px: [f64; 2],
    /// Radial distortion: factors of the radius's second, fourth and sixth power.
    pub radial: [f64; 3],
    /// Tangential distortion.
    pub tangential: [f64; 2],
}

/// Where a camera stood. `camera_from_world`: x_c = R x_w + t; the camera looks along +Z, +X right, +Y down (as COLMAP and OpenCV).
/// World: Heliodon's (metres, +Y up, -Z north).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// R, of length one.
    pub rotation: DQuat,
    /// t, metres.
    pub translation: DVec3,
}

/// A camera that took one photograph.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// The lens.
    pub intrinsics: Intrinsics,
    /// Its place.
    pub pose: Pose,
}

/// Newton steps when distortion is inverted; each about doubles the digits, and lenses start with one or two.
const NEWTON_STEPS: usize = 12;

impl Intrinsics {
    /// Distorted normalised coordinates of ideal ones.
    fn distorted(&self, p: DVec2) -> DVec2 {
        let [k1, k2, k3] = self.radial;
        let [p1, p2] = self.tangential;
        let r2 = p.length_squared();
        let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        let xy = p.x * p.y;
        p * radial + DVec2::new(2.0 * p1 * xy + p2 * (r2 + 2.0 * p.x * p.x), p1 * (r2 + 2.0 * p.y * p.y) + 2.0 * p2 * xy)
    }

    /// How fast the distorted radius grows with the ideal one: not above 0 where the model folds back.
    fn growth(&self, p: DVec2) -> f64 {
        let [k1, k2, k3] = self.radial;
        let r2 = p.length_squared();
        1.0 + r2 * (3.0 * k1 + r2 * (5.0 * k2 + r2 * 7.0 * k3))
    }

    fn ideal(&self, distorted: DVec2) -> DVec2 {
        let mut p = distorted;
        for _ in 0..NEWTON_STEPS {
            const STEP: f64 = 1e-6;
            let at = self.distorted(p);
            let dx = (self.distorted(p + DVec2::new(STEP, 0.0)) - at) / STEP;
            let dy = (self.distorted(p + DVec2::new(0.0, STEP)) - at) / STEP;
            let determinant = dx.perp_dot(dy);
            if determinant.abs() < STEP {
                break;
            }
            let error = distorted - at;
            p += DVec2::new(error.perp_dot(dy), dx.perp_dot(error)) / determinant;
        }
        p
    }
}

impl Camera {
    /// The pixel where a place appears; none behind the camera or where the lens's distortion is no longer one to one.
    #[must_use]
    pub fn project(&self, world: DVec3) -> Option<DVec2> {
        let at = self.pose.rotation * world + self.pose.translation;
        if at.z <= 0.0 || at.z.is_nan() {
            return None;
        }
        let p = at.truncate() / at.z;
        let lens = &self.intrinsics;
        let one_to_one = (1..=8).all(|step| lens.growth(p * (f64::from(step) / 8.0)) > 0.0);
        one_to_one.then(|| lens.distorted(p) * DVec2::from(lens.focal_px) + DVec2::from(lens.centre_px))
    }

    /// The ray that a pixel saw: origin and unit direction.
    #[must_use]
    pub fn ray(&self, pixel: DVec2) -> (DVec3, DVec3) {
        let lens = &self.intrinsics;
        let p = lens.ideal((pixel - DVec2::from(lens.centre_px)) / DVec2::from(lens.focal_px));
        let along = p.extend(1.0);
        (self.centre(), self.pose.rotation.inverse() * (along / along.length()))
    }

    /// Where it stood.
    #[must_use]
    pub fn centre(&self) -> DVec3 {
        self.pose.rotation.inverse() * -self.pose.translation
    }
}
