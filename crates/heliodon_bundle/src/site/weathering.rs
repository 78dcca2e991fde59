//! `[weathering]`: what the weather has left on the surfaces, as a layer over their albedo.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::ops::RangeInclusive;

/// Speeds of the wind that are taken for such, m/s: up to a hurricane's.
pub(super) const WIND_M_PER_S: RangeInclusive<f64> = 0.0..=40.0;

/// `[weathering]`: dust that settles on what looks up and is sheltered, and corrosion of what rain and sky reach. Without this table there is none.
///
/// It changes what is shown, not the light: light bounces off the surfaces as they are given.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Weathering {
    /// How far dust covers a surface where it lies thickest, 0 to 1.
    #[schemars(range(min = 0, max = 1))]
    pub dust: f64,
    /// How far the corroded surface takes the place of the sound one where it is exposed most, 0 to 1.
    #[schemars(range(min = 0, max = 1))]
    pub corrosion: f64,
    /// Albedo of the dust, linear [r, g, b] in [0, 1].
    pub dust_color: [f64; 3],
    /// Albedo of a corroded surface.
    pub corrosion_color: [f64; 3],
    /// The compass bearing that wind and driving rain come from, degrees. Default: none prevails.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = -360, max = 360))]
    pub wind_from_deg: Option<f64>,
    /// Mean speed of the wind at the walls while it rains, m/s: more drives rain against walls and under roofs.
    #[schemars(range(min = 0, max = 40))]
    pub wind_m_per_s: f64,
}

impl Default for Weathering {
    fn default() -> Self {
        Self {
            dust: 0.0,
            corrosion: 0.0,
            dust_color: [0.36, 0.29, 0.21],
            corrosion_color: [0.16, 0.15, 0.13],
            wind_from_deg: None,
            wind_m_per_s: 2.0,
        }
    }
}

/// How a part departs from `[weathering]`: `false` for not at all weathered, or a table of what is its own.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "weathering is false, or a table of dust, corrosion, dust_color and corrosion_color")]
pub enum PartWeathering {
    /// `false`: not weathered. `true`: as `[weathering]` says.
    As(bool),
    /// What is its own; the rest is as `[weathering]` says.
    Own(OwnWeathering),
}

/// A part's own weathering.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct OwnWeathering {
    /// As in `[weathering]`.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0, max = 1))]
    pub dust: Option<f64>,
    /// As in `[weathering]`.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0, max = 1))]
    pub corrosion: Option<f64>,
    /// As in `[weathering]`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dust_color: Option<[f64; 3]>,
    /// As in `[weathering]`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub corrosion_color: Option<[f64; 3]>,
}

impl Weathering {
    /// The weathering of a part, its own where it has some; none where nothing of it shows.
    #[must_use]
    pub fn of_part(&self, part: Option<&PartWeathering>) -> Option<Self> {
        let whole = self.clone();
        let of = match part {
            None | Some(PartWeathering::As(true)) => whole,
            Some(PartWeathering::As(false)) => return None,
            Some(PartWeathering::Own(own)) => Self {
                dust: own.dust.unwrap_or(self.dust),
                corrosion: own.corrosion.unwrap_or(self.corrosion),
                dust_color: own.dust_color.unwrap_or(self.dust_color),
                corrosion_color: own.corrosion_color.unwrap_or(self.corrosion_color),
                ..whole
            },
        };
        (of.dust > 0.0 || of.corrosion > 0.0).then_some(of)
    }
}
