//! The light that what is in the air is under, and that it gives.

use super::sun_map::SunMap;
use crate::lamps::Lamp;
use crate::lamps::reaching::arrives_within;
use glam::Vec3;
use heliodon_bundle::grid::{AXES, Grid};
use heliodon_bundle::moment::Moment;
use heliodon_math::sh;
use heliodon_sky::lapse::Lapse;
use std::f32::consts::FRAC_1_PI;

/// How bright fire is beside a white plane at the day's brightest hour. A wood fire's flames have some 10,000 cd/m2, white paper in the
/// sun has 30,000; a little more than that keeps it fire beside sunlit stone.
const FLAME: f32 = 0.75;
/// The most that fire is exposed to, and its light with it. At night both would be white through and through otherwise, as on overexposed film.
const MOST_EXPOSED: f32 = 2.2;

/// Nearer than this nothing is lit more by a lamp, metres: a flame is no point. `LAMP_FLAME_M2` of lamps.wgsl is its square.
const FLAME_M: f32 = 0.35;
/// Exposed radiance of a white plane in a lamp's light below which that is not seen in the air: four metres of the thickest dust scatter a third of it, less than half a code of eight bits.
const FAINTEST: f32 = 0.004;

/// The light of a frame.
#[derive(Clone, Copy, Debug)]
pub struct AirLight {
    /// What radiance is multiplied by.
    pub exposure: f32,
    /// Exposed radiance of a white plane that the sun shines on at normal incidence; zero without a sun.
    pub sun: Vec3,
    /// Exposed radiance of fire where it is brightest.
    pub flame: f32,
}

impl AirLight {
    /// The light of a moment of a day whose brightest white is `white`.
    #[must_use]
    pub fn new(moment: &Moment, has_sun: bool, exposure_stops: f32, white: f32) -> Self {
        let exposure = exposure_stops.exp2();
        let sun = if has_sun { moment.shading.sun_irradiance * (FRAC_1_PI * exposure) } else { Vec3::ZERO };
        let flame = flame_radiance(white, exposure) * exposure;
        Self { exposure, sun, flame }
    }
}

/// Radiance of fire where it is brightest, in the unit of `white`, the brightest of the day.
#[must_use]
pub fn flame_radiance(white: f32, exposure: f32) -> f32 {
    (FLAME * white).min(MOST_EXPOSED / exposure)
}

/// What a source's particles are under.
#[derive(Clone, Copy, Debug)]
pub struct Reached<'a> {
    /// The light of the frame.
    pub air: AirLight,
    /// Exposed radiance that comes from all around, on the average.
    pub ambient: Vec3,
    /// Exposed radiance of a white plane that faces where most of that comes from.
    pub brightest: Vec3,
    /// Where the sun shines, and the number of that map.
    pub map: Option<(&'a SunMap, u32)>,
    /// The lamps, fires among them.
    pub lamps: &'a [Lamp],
}

impl Reached<'_> {
    /// The part of the sun that reaches a place.
    #[must_use]
    pub fn sun_at(&self, place: Vec3) -> f32 {
        self.map.map_or(1.0, |(map, _)| map.at(place))
    }

    /// Whether any lamp's light may be seen on something within `radius` of a place. What hides it from the lamp is known where it is drawn.
    #[must_use]
    pub fn lamps_reach(&self, place: Vec3, radius: f32) -> bool {
        let seen = |lamp: &Lamp| arrives_within(lamp, place, radius, FLAME_M) * self.air.exposure > FAINTEST;
        self.lamps.iter().any(seen)
    }
}

/// Radiance that comes to a place from all around, on the average, and of a white plane on its brightest side: by the light grid, or else from as much of the sky as is seen there.
#[must_use]
pub fn ambient(moment: &Moment, grid: Option<&Grid>, place: Vec3, openness: f32) -> (Vec3, Vec3) {
    let known = grid.and_then(|grid| grid.light_at(moment, place)).map(|cube| cube.sky_and_bounce);
    let sides = known.unwrap_or_else(|| AXES.map(|axis| openness * open_sky(&moment.sky, axis)));
    let brightest = sides.iter().copied().reduce(|a, b| if a.element_sum() >= b.element_sum() { a } else { b });
    (sides.iter().sum::<Vec3>() / sides.len() as f32, brightest.unwrap_or(Vec3::ZERO))
}

/// Light of an unobstructed sky on a surface that faces `axis`.
fn open_sky(sky: &[Vec3], axis: Vec3) -> Vec3 {
    let all = sky.iter().zip(sh::open_transfer9(axis)).map(|(sky, transfer)| *sky * transfer);
    all.sum::<Vec3>().max(Vec3::ZERO)
}

/// Radiance of a white horizontal plane in the open at the day's brightest hour.
#[must_use]
pub fn brightest_white(lapse: &Lapse) -> f32 {
    let whites = lapse.steps.iter().map(|step| {
        let sky: Vec<Vec3> = step.sky.iter().map(|&sky| Vec3::from(sky)).collect();
        let sun = step.sun.map_or(Vec3::ZERO, |sun| Vec3::from(sun.irradiance) * (sun.direction[1].max(0.0) * FRAC_1_PI));
        (open_sky(&sky, Vec3::Y) + sun).element_sum() / 3.0
    });
    let white = whites.fold(0.0, f32::max);
    if white > 0.0 { white } else { 1.0 }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use heliodon_sky::lapse::{LapseStep, Sun};

    /// A sun of unit radiance on white, from above.
    pub fn noon() -> Reached<'static> {
        let air = AirLight { exposure: 1.0, sun: Vec3::ONE, flame: 1.0 };
        Reached { air, ambient: Vec3::splat(0.1), brightest: Vec3::splat(0.2), map: None, lamps: &[] }
    }

    #[test]
    fn white_is_as_bright_as_the_brightest_hour() {
        let step = |irradiance: f32| LapseStep {
            time: "12:00".to_owned(),
            sun: Some(Sun { direction: [0.0, 1.0, 0.0], irradiance: [irradiance; 3], clipped: false }),
            // a uniform sky of radiance 1
            sky: vec![[2.0 * std::f32::consts::PI.sqrt(); 3], [0.0; 3], [0.0; 3], [0.0; 3]],
            fitted: None,
            exposure_stops: 0.0,
            sky_map: String::new(),
            mask_bit: 0,
            sun_in_map: false,
        };
        let lapse = Lapse { steps: vec![step(0.0), step(std::f32::consts::PI)], sun_bounce_basis: None };
        assert_eq!(flame_radiance(2.0, 1.0), 2.0 * FLAME, "by day");
        assert_eq!(flame_radiance(2.0, 100.0) * 100.0, MOST_EXPOSED, "at night");
        assert!((brightest_white(&lapse) - 2.0).abs() < 1e-4, "{}", brightest_white(&lapse));
        assert_eq!(brightest_white(&Lapse { steps: Vec::new(), sun_bounce_basis: None }), 1.0);
    }
}
