//! Light from infinitely far away: a sharp direction, or a disc of uniform radiance such as the sun's.

use crate::lights::disc;
use crate::lights::vector::{basis, concentric_disc};
use glam::DVec3;
use std::f64::consts::{PI, TAU};

/// A disc on the sky.
#[derive(Clone, Debug)]
pub(super) struct Directional {
    /// To its centre, unit.
    pub direction: DVec3,
    x: DVec3,
    y: DVec3,
    sin_radius: f64,
    cos_radius: f64,
    /// 1 - cosine of the radius, without the difference.
    cap: f64,
}

impl Directional {
    /// By its angular radius, radians, below a right angle.
    pub fn new(direction: DVec3, radius_rad: f64) -> Self {
        let (x, y) = basis(direction);
        let half = libm::sin(0.5 * radius_rad);
        let cap = 2.0 * half * half;
        Self { direction, x, y, sin_radius: libm::sin(radius_rad), cos_radius: 1.0 - cap, cap }
    }

    pub fn is_sharp(&self) -> bool {
        self.cap == 0.0
    }

    /// Irradiance at normal incidence from radiance one; 0 where it is sharp.
    pub fn normal_irradiance(&self) -> f64 {
        PI * self.sin_radius * self.sin_radius
    }

    /// A direction spread evenly over the disc, and its density per steradian; none where it is sharp.
    pub fn sample(&self, numbers: [f64; 2]) -> (DVec3, Option<f64>) {
        if self.is_sharp() {
            return (self.direction, None);
        }
        let [a, b] = concentric_disc(numbers);
        // even in 1 - cos, which is the cap's height
        let height = self.cap * (a * a + b * b).min(1.0);
        let across = (self.cap * (2.0 - height)).sqrt();
        let direction = self.direction * (1.0 - height) + (self.x * a + self.y * b) * across;
        (direction, Some(self.density()))
    }

    fn density(&self) -> f64 {
        1.0 / (TAU * self.cap)
    }

    /// The density with which it is sampled in a unit direction; 0 off the disc and where it is sharp.
    pub fn pdf_sr(&self, direction: DVec3) -> f64 {
        if self.holds(direction) { self.density() } else { 0.0 }
    }

    /// Whether a unit direction meets the disc; never where it is sharp.
    pub fn holds(&self, direction: DVec3) -> bool {
        // half the squared chord is 1 - cos, with all its digits
        !self.is_sharp() && 0.5 * (direction - self.direction).length_squared() <= self.cap
    }

    /// Irradiance over pi, relative to the irradiance at normal incidence.
    pub fn part(&self, normal: DVec3) -> f64 {
        if self.is_sharp() {
            return normal.dot(self.direction).max(0.0) / PI;
        }
        // a cap of the sphere looks from its centre as the flat disc that spans it
        let light = disc::irradiance_over_pi(self.direction * self.cos_radius, self.direction, self.sin_radius, normal);
        light / self.normal_irradiance()
    }
}
