//! Weathering: dust that settles where neither rain nor wind takes it away, and corrosion where rain and sky reach.
//!
//! A look, not a forecast: amounts are between 0 and 1, how much a century leaves is for the eye to say ([`Look`]). They follow what the literature holds for the causes:
//!
//! - **Dust** falls from the air, so a face catches it in proportion to its upward component, and holds it up to the angle at which it slides; what a place is exposed to takes it away again
//!   (S.-C. Hsu, T.-T. Wong: "Simulating Dust Accumulation", IEEE Computer Graphics and Applications 15(1), 1995: inclination, and exposure found by visibility; J. Dorsey, H. K. Pedersen,
//!   P. Hanrahan: "Flow and Changes in Appearance", SIGGRAPH 1996: water washes deposits off). With the normal n:
//!   `dust = max(n.y, 0) hold(n.y) (1 - min(rain, 1)) (1 - SWEPT wind)`, `hold` a smooth step from 60 degrees of slope (0) to 30 (1).
//! - **Corrosion**: rain dissolves stone in proportion to what of it a face catches, and what the air brings dry comes from the open
//!   (F. W. Lipfert: "Atmospheric Damage to Calcareous Stones", Atmospheric Environment 23(2), 1989, adds the same two): `corrosion = RAINED min(rain, 1) + (1 - RAINED) sky`.
//!
//! What a place is exposed to are sums over directions w_j of the upper half, V_j being 1 where nothing is in the way:
//!
//! - `sky = sum V_j max(n.w_j, 0) / sum w_j.y`: 1 on an open horizontal place, a half on an open wall.
//! - `rain = sum p_j V_j max(n.w_j, 0) / sum p_j w_j.y`: of the rain that falls on open ground, what a face catches, p being a distribution about the angle at which wind drives it
//!   ([`Climate`]). 1 on an open horizontal place; on a wall that faces the wind 2/9 of its speed in m/s, as ISO 15927-3 has it; it may exceed 1.
//! - `wind = sum q_j V_j max(n.w_j, 0) / sum q_j max(n.w_j, 0)`: the open part of the low horizon that a face looks at, q falling from the horizon to 30 degrees above it.
//!
//! The sky's transfer of the bake does not serve: its first band would tell the sky's part, but it holds what bounced as well, and neither rain nor wind bounces. Rays are asked for afresh, without
//! bounces: parallel and in fans, [`Climate::directions`] a place.
//!
//! Not in it: water that runs down and streaks, moss, black crusts, feet that polish, dust that slides off onto what lies below. The solve of the light knows nothing of all this: it bounces
//! off the surfaces as they are given.

mod climate;
mod layer;

pub use climate::Climate;
pub use layer::{Layer, Look};

use glam::Vec3;
use heliodon_rays::TriangleScene;
use rayon::prelude::*;
use thiserror::Error;

/// The part of the dust that wind takes away where the whole horizon is open: it lifts what is coarse and lets go of what is fine.
const SWEPT: f32 = 0.5;
/// Slopes with a normal less steep than this (60 degrees) hold no dust,
const HOLDS_NONE: f32 = 0.5;
/// and from this on (30 degrees, the angle of repose of dry powders) all that falls.
const HOLDS_ALL: f32 = 0.866_025_4;
/// The rain's part of the corrosion of a place that all of it reaches; the rest is the air's.
const RAINED: f32 = 0.5;

/// Places whose bits of visibility are held at once.
const AT_ONCE: usize = 1 << 16;

/// What is wrong with what is asked.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum WeatherError {
    /// A number of the climate is out of range.
    #[error("the climate's {what} is {value}")]
    Climate {
        /// Which.
        what: &'static str,
        /// Its value.
        value: f64,
    },
    /// There are not as many normals as places.
    #[error("{normals} normals of {places} places")]
    Lengths {
        /// Places.
        places: usize,
        /// Normals.
        normals: usize,
    },
}

/// What a place is exposed to.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Exposure {
    /// Of the sky: 1 on an open horizontal place. 0 to 1 but for the rounding of sums.
    pub sky: f32,
    /// Of the rain that falls on open ground: from 0 up, above 1 on walls in strong wind.
    pub rain: f32,
    /// The open part of the low horizon, 0 to 1.
    pub wind: f32,
}

/// What the weather has left at a place, each 0 to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Amounts {
    /// Dust.
    pub dust: f32,
    /// Corrosion.
    pub corrosion: f32,
}

impl Exposure {
    /// What it leaves on a surface of unit normal `normal`; nothing where there is none.
    #[must_use]
    pub fn amounts(self, normal: Vec3) -> Amounts {
        if normal == Vec3::ZERO {
            return Amounts::default();
        }
        let rain = self.rain.clamp(0.0, 1.0);
        let up = normal.y.clamp(0.0, 1.0);
        let step = ((up - HOLDS_NONE) / (HOLDS_ALL - HOLDS_NONE)).clamp(0.0, 1.0);
        let hold = step * step * (3.0 - 2.0 * step);
        let dust = up * hold * (1.0 - rain) * (1.0 - SWEPT * self.wind.clamp(0.0, 1.0));
        Amounts { dust, corrosion: RAINED * rain + (1.0 - RAINED) * self.sky.clamp(0.0, 1.0) }
    }
}

/// What some places are exposed to. `origins` are where their rays start, metres, off the surface already and best in their [`heliodon_rays::beam_order`]; `normals` are unit, or zero where
/// there is none: such a place is exposed to nothing. Nothing depends on the threads or on what else is asked.
///
/// # Errors
/// A climate out of range, not as many normals as origins.
pub fn exposures(
    scene: &TriangleScene,
    origins: &[Vec3],
    normals: &[Vec3],
    climate: &Climate,
) -> Result<Vec<Exposure>, WeatherError> {
    climate.validate()?;
    if origins.len() != normals.len() {
        return Err(WeatherError::Lengths { places: origins.len(), normals: normals.len() });
    }
    let weights = climate.weights();
    let winds: Vec<[f32; 1]> = weights.brought.iter().map(|&[_, _, wind]| [wind]).collect();
    let mut all = Vec::with_capacity(origins.len());
    for (origins, normals) in origins.chunks(AT_ONCE).zip(normals.chunks(AT_ONCE)) {
        let order = (0..origins.len() as u32).collect();
        let seen = scene.visibility_of(order, origins, normals, &weights.directions, 0.0);
        let (brought, open) = (seen.gather(&weights.brought), seen.gather_open(&winds));
        let exposure = |(&[sky, rain, wind], &[open]): (&[f32; 3], &[f32; 1])| Exposure {
            sky,
            rain,
            wind: if open > 0.0 { wind / open } else { 0.0 },
        };
        all.par_extend(brought.par_iter().zip(&open).map(exposure));
    }
    Ok(all)
}

/// What the weather leaves at some places: [`exposures`] and their [`Exposure::amounts`].
///
/// # Errors
/// As [`exposures`].
pub fn weather(
    scene: &TriangleScene,
    origins: &[Vec3],
    normals: &[Vec3],
    climate: &Climate,
) -> Result<Vec<Amounts>, WeatherError> {
    let exposures = exposures(scene, origins, normals, climate)?;
    Ok(exposures.into_iter().zip(normals).map(|(exposure, &normal)| exposure.amounts(normal)).collect())
}
