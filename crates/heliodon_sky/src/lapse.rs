//! The day lapse: what light comes from the sky at each step of a day, as `lapse.json` holds it.

use serde::{Deserialize, Serialize};

/// The light of a day, step by step.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Lapse {
    /// The steps in the order of time; `sky_steps` of them.
    pub steps: Vec<LapseStep>,
    /// How a vertex's sun bounce coefficients make its bounced sunlight at each sun step; absent where none was baked.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sun_bounce_basis: Option<SunBounceBasis>,
}

/// One moment of the day.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LapseStep {
    /// Local time, `HH:MM` or `HH:MM:SS`.
    pub time: String,
    /// The sun, where there is one.
    pub sun: Option<Sun>,
    /// Sky radiance in spherical harmonics, 4 or 9 coefficients of linear RGB, without the sun.
    pub sky: Vec<[f32; 3]>,
    /// The sky's light as viewers shade with it, where `sky` alone is a poor account of it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fitted: Option<Fitted>,
    /// The exposure that suits the step, in stops.
    pub exposure_stops: f32,
    /// The step's sky image, relative to the bundle.
    pub sky_map: String,
    /// The sun step whose mask bit holds here.
    pub mask_bit: u32,
    /// Whether the sky image shows the sun itself, as a probe's does; a viewer draws the disc where it does not.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub sun_in_map: bool,
}

/// The sun of a step.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sun {
    /// Unit direction to the sun.
    pub direction: [f32; 3],
    /// Irradiance at normal incidence, linear RGB, in the sky's radiance unit times steradians; not divided by pi.
    pub irradiance: [f32; 3],
    /// Whether the probe's brightest pixels were clipped, so that `irradiance` is a lower bound.
    pub clipped: bool,
}

/// A sky's light fitted to what surfaces receive of it (see [`crate::fit`]), in place of [`LapseStep::sky`]: light at a vertex is
/// `max(0, sum_i T_i sky_i)`, with the sun's irradiance (and its bounced light's) raised by `glow`.
///
/// [`LapseStep::sky`] and [`Sun::irradiance`] hold all light without it, each once, and so do `sky` and `glow` here with the sun.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Fitted {
    /// The part of the sky's light that is shaded as coming from the sun's direction and cut by its mask: irradiance at normal incidence, not
    /// negative; zero where the step has no sun.
    pub glow: [f32; 3],
    /// Coefficients of the rest, as many as the step's.
    pub sky: Vec<[f32; 3]>,
}

/// The functions over the day by which bounced sunlight is stored.
///
/// Bounced sunlight (irradiance / pi, for a sun of unit irradiance at normal incidence) of a vertex at sun step `t` is
/// `max(0, sum_r coefficients[r] * functions[r][t])`, per channel.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SunBounceBasis {
    /// 1 (grey) or 3 (RGB).
    pub channels: u32,
    /// R functions of T values.
    pub functions: Vec<Vec<f32>>,
}
