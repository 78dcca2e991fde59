//! The light that films are in: the space's own, from the grid that actors stand in, and the lamps', which the grid knows nothing of.

use crate::actors::Actors;
use crate::lamps::Lamp;
use crate::lamps::reaching::{arrives, reaching};
use crate::lamps::uniform::lit;
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
}

/// What reaches a place.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Reached {
    around: AmbientCube,
    /// Unit directions to lamps, and their irradiance / pi at normal incidence.
    lamps: Vec<(Vec3, Vec3)>,
}

/// Which lamps reach a place; rays are cast anew only where lamps, place or stone are others than before.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LampsAt {
    place: Vec3,
    lamps: Vec<Lamp>,
    chunks: usize,
    reaching: Vec<(Vec3, Vec3)>,
}

impl Reached {
    fn by_lamps(&self, normal: Vec3) -> Vec3 {
        self.lamps.iter().map(|(to, irradiance)| *irradiance * normal.dot(*to).max(0.0)).sum()
    }
}

impl LampsAt {
    /// Looks which lamps reach a place.
    pub fn look(&mut self, place: Vec3, lamps: &[Lamp], ground: &Ground) {
        let chunks = ground.chunks().len();
        if self.place == place && self.lamps == lamps && self.chunks == chunks {
            return;
        }
        *self = Self { place, lamps: lamps.to_vec(), chunks, reaching: reaching(place, &lit(lamps), ground).collect() };
    }
}

impl Light<'_> {
    /// What reaches a place, by the lamps that do.
    #[must_use]
    pub fn at(&self, place: Vec3, lamps: &LampsAt) -> Reached {
        Reached { around: self.actors.light_at(self.moment, place), lamps: lamps.reaching.clone() }
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

#[cfg(test)]
mod tests {
    use super::*;

    fn lamp() -> Lamp {
        Lamp { place: Vec3::new(0.0, 2.0, 0.0), intensity: Vec3::splat(8.0), cone: None, reach_m: 100.0, shadows: true }
    }

    #[test]
    fn lamps_are_looked_for_again_where_something_is_another() {
        let (mut at, ground) = (LampsAt::default(), Ground::default());
        at.look(Vec3::ZERO, &[lamp()], &ground);
        assert_eq!(at.reaching.len(), 1);
        at.look(Vec3::ZERO, &[], &ground);
        assert!(at.reaching.is_empty());
        at.look(Vec3::X, &[lamp(), lamp()], &ground);
        assert_eq!(at.reaching.len(), 2);
    }
}
