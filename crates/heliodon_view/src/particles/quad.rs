//! What is drawn of whatever is in the air: a quad that faces the eye, as air.wgsl reads it.

use bevy::math::{Vec3, Vec4};
use bytemuck::{Pod, Zeroable};

/// Spots are drawn at least so wide to each side, pixels, and as much fainter.
pub const LEAST_PX: f32 = 0.75;
/// How much air and dust scatter forward: `g` of Henyey and Greenstein.
pub const FORWARD: f32 = 0.55;

/// What a quad shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// A round spot that shines or reflects; where it is smaller than a pixel, as bright as it would be there.
    Mote,
    /// A tongue of fire.
    Flame,
    /// A puff that takes light away and gives back what falls on it.
    Smoke,
    /// Air that the sun is seen in, where its map says that it shines.
    Haze,
    /// A disc upon the ground, whatever its shape.
    Mark,
}

/// `Quad` of air.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Quad {
    /// Its middle in the world, and half its width, metres.
    place: Vec4,
    /// Unit direction along which it is longer, and how many times; zero where it is round.
    along: Vec4,
    /// Exposed radiance that it gives off, and the share of what is behind that it takes away in its middle.
    glow: Vec4,
    /// Exposed radiance that the sun adds, and over how many metres it goes into what is behind it.
    sun: Vec4,
    /// Its shape, a random number in [0, 1), its age from 0 to 1, and its map of the sun or -1.
    what: Vec4,
    /// How much it sends on of what lamps send to it: radiance of irradiance / pi at normal incidence.
    given: Vec4,
}

/// Size of `Quad` in air.wgsl, which a test compares with what the shader's compiler says.
pub const QUAD_BYTES: usize = size_of::<Quad>();

impl Quad {
    /// A quad that neither shines nor hides anything yet.
    #[must_use]
    pub fn new(shape: Shape, place: Vec3, radius_m: f32, random: f32) -> Self {
        Self {
            place: place.extend(radius_m),
            along: Vec4::ZERO,
            glow: Vec4::ZERO,
            sun: Vec3::ZERO.extend(radius_m.max(0.01)),
            what: Vec4::new(f32::from(shape as u8), random, 0.0, -1.0),
            given: Vec4::ZERO,
        }
    }

    /// Whether it is of the air that the sun is seen in: nothing but light, and nowhere sharp.
    #[must_use]
    pub fn is_haze(&self) -> bool {
        self.what.x == f32::from(Shape::Haze as u8)
    }

    /// It gives off this exposed radiance, and takes away this share of what is behind it.
    #[must_use]
    pub fn glowing(self, radiance: Vec3, opacity: f32) -> Self {
        Self { glow: radiance.extend(opacity), ..self }
    }

    /// The sun adds this exposed radiance.
    #[must_use]
    pub fn in_sun(self, radiance: Vec3) -> Self {
        Self { sun: radiance.extend(self.sun.w), ..self }
    }

    /// It sends on so much of what lamps send to it; how much that is is known where it is drawn.
    #[must_use]
    pub fn under_lamps(self, given: Vec3) -> Self {
        Self { given: given.extend(0.0), ..self }
    }

    /// It is so many times as long in a unit direction as it is wide.
    #[must_use]
    pub fn stretched(self, along: Vec3, times: f32) -> Self {
        Self { along: along.extend(times.max(1.0)), ..self }
    }

    /// It has lived this part of its life.
    #[must_use]
    pub fn aged(self, age: f32) -> Self {
        Self { what: self.what.with_z(age), ..self }
    }

    /// Its map of the sun.
    #[must_use]
    pub fn with_map(self, map: Option<u32>) -> Self {
        Self { what: self.what.with_w(map.map_or(-1.0, |map| map as f32)), ..self }
    }

    /// Whether it sends on any of the lamps' light.
    #[must_use]
    pub fn is_under_lamps(&self) -> bool {
        self.given != Vec4::ZERO
    }

    /// Its middle.
    #[must_use]
    pub fn middle(&self) -> Vec3 {
        self.place.truncate()
    }

    /// No part of it is farther from its middle, metres.
    #[must_use]
    pub fn reach_m(&self) -> f32 {
        self.place.w * self.along.w.max(1.0) * std::f32::consts::SQRT_2
    }

    /// What it gives off.
    #[cfg(test)]
    pub(crate) fn radiance(&self) -> Vec3 {
        self.glow.truncate()
    }

    /// How much it sends on of lamps' light.
    #[cfg(test)]
    pub(crate) fn of_lamps(&self) -> Vec3 {
        self.given.truncate()
    }

    /// What the sun adds.
    #[cfg(test)]
    pub(crate) fn of_sun(&self) -> Vec3 {
        self.sun.truncate()
    }
}

/// The box around quads, its least and greatest corner.
#[must_use]
pub fn bounds(quads: &[Quad]) -> Option<(Vec3, Vec3)> {
    let boxes = quads.iter().map(|quad| (quad.middle() - quad.reach_m(), quad.middle() + quad.reach_m()));
    boxes.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
}
