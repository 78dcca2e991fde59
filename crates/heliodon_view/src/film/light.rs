//! The light that films are in: the space's own, from the grid that actors stand in, and the lamps', which the grid knows nothing of.

use crate::actors::Actors;
use crate::lamps::Lamp;
use crate::lamps::reaching::{Reach, arrives};
use crate::stage::ground::Ground;
use bevy::math::Vec3;
use heliodon_bundle::grid::AmbientCube;
use heliodon_bundle::moment::Moment;
use std::f32::consts::{FRAC_1_PI, FRAC_PI_6};

/// The light of a frame.
#[derive(Clone, Copy)]
pub struct Light<'a> {
    /// The space's.
    pub actors: &'a Actors,
    /// Of this moment.
    pub moment: &'a Moment,
    /// The factor of the exposure.
    pub exposure: f32,
    /// Whether there is a sun.
    pub has_sun: bool,
    /// Where shadows come from: the sun's direction, or from above.
    pub shadow: Vec3,
    /// Those that are lit.
    pub lamps: &'a [Lamp],
    /// What hides them.
    pub ground: &'a Ground,
}

/// What reaches a place.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Reached {
    around: AmbientCube,
    /// Unit directions to lamps, and their irradiance / pi at normal incidence.
    lamps: Vec<(Vec3, Vec3)>,
}

impl Reached {
    fn by_lamps(&self, normal: Vec3) -> Vec3 {
        self.lamps.iter().map(|(to, irradiance)| *irradiance * normal.dot(*to).max(0.0)).sum()
    }
}

impl Light<'_> {
    /// What reaches a place.
    #[must_use]
    pub fn at(&self, place: Vec3, reach: &mut Reach) -> Reached {
        Reached { around: self.actors.light_at(self.moment, place), lamps: reach.of(place, self.lamps, self.ground).collect() }
    }

    /// The exposed light (irradiance / pi) on an upright half cylinder that faces somewhere: the mean over what is seen of it.
    #[must_use]
    pub fn on_half_cylinder(&self, reached: &Reached, facing: Vec3) -> Vec3 {
        let side = Vec3::new(facing.z, 0.0, -facing.x);
        let (mut sum, mut whole) = (Vec3::ZERO, 0.0);
        for step in -2..=2 {
            let (sin, cos) = (FRAC_PI_6 * step as f32).sin_cos();
            let normal = facing * cos + side * sin;
            sum += self.on(reached, normal) * cos;
            whole += cos;
        }
        sum * (self.exposure / whole)
    }

    /// The exposed light that the ground there gets from the sky, with the lamps', and what of the sun's (irradiance / pi, at normal incidence) reaches it.
    #[must_use]
    pub fn on_ground(&self, reached: &Reached) -> [Vec3; 2] {
        let sky = reached.around.ambient(Vec3::Y) + reached.by_lamps(Vec3::Y);
        // a sun too low to cast shadows takes no part in them
        let casts = self.has_sun && self.shadow == self.moment.sun_direction;
        let reaches = if casts { reached.around.sun_visible * FRAC_1_PI } else { 0.0 };
        let sun = self.moment.shading.sun_irradiance * reaches;
        [sky * self.exposure, sun * self.exposure]
    }

    fn on(&self, reached: &Reached, normal: Vec3) -> Vec3 {
        let mut light = reached.around.ambient(normal);
        if self.has_sun {
            let facing = reached.around.sun_visible * normal.dot(self.moment.sun_direction).max(0.0);
            light += self.moment.shading.sun_irradiance * (facing * FRAC_1_PI);
        }
        light + reached.by_lamps(normal)
    }
}

/// The light of lamps (irradiance / pi) on a surface, with nothing in its way.
#[must_use]
pub fn unhindered(lamps: &[Lamp], place: Vec3, normal: Vec3) -> Vec3 {
    let lamps = lamps.iter().filter_map(|lamp| arrives(lamp, place));
    lamps.map(|(to, irradiance)| irradiance * normal.dot(to).max(0.0)).sum()
}
