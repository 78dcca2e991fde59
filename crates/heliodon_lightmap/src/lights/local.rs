//! Lights that are points: to all sides, into a cone, or as a luminaire was measured.

use crate::lights::ies::IesProfile;
use glam::DVec3;
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

/// A point with an intensity for every direction.
#[derive(Clone, Debug)]
pub(super) struct Local {
    pub place: DVec3,
    pub shape: Shape,
}

/// How intensity depends on the direction, from 0 to 1 of the light's own.
#[derive(Clone, Debug)]
pub(super) enum Shape {
    Even,
    Cone(Cone),
    Luminaire(Luminaire),
}

impl Local {
    /// Intensity towards a point and the inverse square of its distance, as a part of the light's own, over pi: irradiance over pi at
    /// normal incidence. With it the unit direction from the point to the light, and the distance. `None` at the light's own place.
    pub fn seen_from(&self, point: DVec3) -> Option<(DVec3, f64, f64)> {
        let to = self.place - point;
        let direction = to.try_normalize()?;
        let part = match &self.shape {
            Shape::Even => 1.0,
            Shape::Cone(cone) => cone.part(-direction),
            Shape::Luminaire(luminaire) => luminaire.intensity(-direction),
        };
        Some((direction, to.length(), part / (PI * to.length_squared())))
    }

    /// The integral over all directions of the intensity's part.
    pub fn solid_angle(&self) -> f64 {
        match &self.shape {
            Shape::Even => 2.0 * TAU,
            Shape::Cone(cone) => cone.solid_angle(),
            Shape::Luminaire(luminaire) => luminaire.profile.flux_lm() * luminaire.factor,
        }
    }
}

/// A spot light's cone: full up to the inner one, and from there a smooth step in the cosine to nothing at the outer. The viewer's lamps fade
/// alike.
#[derive(Clone, Debug)]
pub(super) struct Cone {
    pub axis: DVec3,
    cos_inner: f64,
    cos_outer: f64,
}

impl Cone {
    /// By half angles, radians.
    pub fn new(axis: DVec3, inner_rad: f64, outer_rad: f64) -> Self {
        Self { axis, cos_inner: libm::cos(inner_rad), cos_outer: libm::cos(outer_rad) }
    }

    fn part(&self, direction: DVec3) -> f64 {
        let cos = direction.dot(self.axis);
        if cos >= self.cos_inner {
            1.0
        } else if cos > self.cos_outer {
            let x = ((cos - self.cos_outer) / (self.cos_inner - self.cos_outer)).min(1.0);
            x * x * (3.0 - 2.0 * x)
        } else {
            0.0
        }
    }

    /// The step's mean over the cosines is one half.
    fn solid_angle(&self) -> f64 {
        TAU * (1.0 - 0.5 * (self.cos_inner + self.cos_outer))
    }
}

/// A luminaire's measured distribution, turned in space.
#[derive(Clone, Debug)]
pub(super) struct Luminaire {
    pub profile: Arc<IesProfile>,
    /// Of the file's candelas: the lamp's share when it is tilted.
    pub factor: f64,
    /// The luminaire's axes in the world.
    axes: [DVec3; 3],
}

impl Luminaire {
    /// Turned about its vertical axis (counterclockwise from above, radians), then tilted by the shortest way until its nadir points along the
    /// unit vector `aim`; towards straight up, about the x axis.
    pub fn new(profile: Arc<IesProfile>, aim: DVec3, turn_rad: f64) -> Self {
        let (sin, cos) = (libm::sin(turn_rad), libm::cos(turn_rad));
        let turned = [DVec3::new(cos, 0.0, -sin), DVec3::Y, DVec3::new(sin, 0.0, cos)];
        let down = DVec3::NEG_Y;
        let (axis, cos_tilt) = (down.cross(aim), down.dot(aim));
        // Rodrigues' formula; the divisor vanishes only straight up
        let tilted = |v: DVec3| {
            if 1.0 + cos_tilt > 1e-12 {
                v + axis.cross(v) + axis.cross(axis.cross(v)) / (1.0 + cos_tilt)
            } else {
                DVec3::new(v.x, -v.y, -v.z)
            }
        };
        let tilt_deg = libm::atan2(axis.length(), cos_tilt).to_degrees();
        let factor = profile.tilt_factor(tilt_deg);
        Self { profile, factor, axes: turned.map(tilted) }
    }

    /// Candelas into a unit direction of the world.
    fn intensity(&self, direction: DVec3) -> f64 {
        let [x, y, z] = self.axes;
        let local = DVec3::new(direction.dot(x), direction.dot(y), direction.dot(z));
        self.profile.candela(local) * self.factor
    }
}
