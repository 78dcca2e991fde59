//! Photometric and radiometric amounts, and the house's light.
//!
//! The house stores linear RGB in "any consistent unit"; only ratios between the lights of one site matter. A **radiometric** amount
//! is taken as it stands: colour times value. A **photometric** amount counts lumens, and lumens are the luminance-weighted sum of
//! linear Rec. 709 RGB ([`LUMINANCE_REC709`]) times one constant of the site, [`Photometry::lumens_per_unit`]:
//!
//! ```text
//! lumens = lumens_per_unit * (0.2126 R + 0.7152 G + 0.0722 B)
//! ```
//!
//! so a colour gives a photometric light its tint alone, never its strength. **The constant is 1000 by default**: the house's sky
//! models give radiance in kcd/m2 and irradiance in klx, and a lamp of 800 lm beside such a sky is right without a thought. With it
//! no luminous efficacy (683 lm/W at 555 nm) enters at all: everything is photometric, and the constant of the candela's definition
//! would cancel. Beside HDR photographs in W/(m2 sr) it is [`Photometry::RADIANCE_WHITE`], 179 lm/W.

use glam::DVec3;
use heliodon_math::color::LUMINANCE_REC709;
use serde::{Deserialize, Serialize};

/// How much light a source gives, in one of eight units; in TOML `amount = { flux_lm = 800 }`. 0 or more, finite.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Amount {
    /// Luminous flux in all directions together, lumens.
    FluxLm(f64),
    /// Luminous intensity, candelas: of a point in every direction, of a spot along its axis, of an IES file its highest, of a flat
    /// emitter along its normal.
    IntensityCd(f64),
    /// Illuminance at normal incidence, lux: of directional lights.
    IlluminanceLx(f64),
    /// Luminance, cd/m2: of surfaces, and of directional lights that have an angular radius.
    LuminanceCdM2(f64),
    /// As [`Amount::FluxLm`], in the site's own unit of radiance times m2 sr.
    RadiantFlux(f64),
    /// As [`Amount::IntensityCd`], in the site's own unit of radiance times m2: what `[[light]]` of a site file calls `intensity`.
    RadiantIntensity(f64),
    /// As [`Amount::IlluminanceLx`], in the site's own unit of radiance times sr.
    Irradiance(f64),
    /// As [`Amount::LuminanceCdM2`], in the site's own unit of radiance.
    Radiance(f64),
}

/// What is measured, whichever unit it is measured in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Quantity {
    Flux,
    Intensity,
    Irradiance,
    Radiance,
}

impl Amount {
    /// The name of its unit as in a site file.
    #[must_use]
    pub fn unit(self) -> &'static str {
        match self {
            Self::FluxLm(_) => "flux_lm",
            Self::IntensityCd(_) => "intensity_cd",
            Self::IlluminanceLx(_) => "illuminance_lx",
            Self::LuminanceCdM2(_) => "luminance_cd_m2",
            Self::RadiantFlux(_) => "radiant_flux",
            Self::RadiantIntensity(_) => "radiant_intensity",
            Self::Irradiance(_) => "irradiance",
            Self::Radiance(_) => "radiance",
        }
    }

    /// The number itself.
    #[must_use]
    pub fn value(self) -> f64 {
        match self {
            Self::FluxLm(x)
            | Self::IntensityCd(x)
            | Self::IlluminanceLx(x)
            | Self::LuminanceCdM2(x)
            | Self::RadiantFlux(x)
            | Self::RadiantIntensity(x)
            | Self::Irradiance(x)
            | Self::Radiance(x) => x,
        }
    }

    /// Whether it counts lumens.
    #[must_use]
    pub fn is_photometric(self) -> bool {
        matches!(self, Self::FluxLm(_) | Self::IntensityCd(_) | Self::IlluminanceLx(_) | Self::LuminanceCdM2(_))
    }

    pub(super) fn quantity(self) -> Quantity {
        match self {
            Self::FluxLm(_) | Self::RadiantFlux(_) => Quantity::Flux,
            Self::IntensityCd(_) | Self::RadiantIntensity(_) => Quantity::Intensity,
            Self::IlluminanceLx(_) | Self::Irradiance(_) => Quantity::Irradiance,
            Self::LuminanceCdM2(_) | Self::Radiance(_) => Quantity::Radiance,
        }
    }
}

/// How a site's unit of light and the lumen hang together.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Photometry {
    /// Lumens of one unit of white flux (R = G = B = 1); greater than 0, finite. 1000 by default, so that the unit of radiance is
    /// kcd/m2, as of the house's sky models. More makes lamps of given lumens darker beside the sky.
    pub lumens_per_unit: f64,
}

impl Photometry {
    /// One unit of radiance is 1 kcd/m2, as in the house's sky models.
    pub const HOUSE: Self = Self { lumens_per_unit: 1000.0 };

    /// One unit of radiance is 1 W/(m2 sr) of equal-energy white at 179 lm/W: G. Ward's convention in Radiance ("The RADIANCE Lighting
    /// Simulation and Rendering System", SIGGRAPH 1994), which calibrated HDR photographs follow.
    pub const RADIANCE_WHITE: Self = Self { lumens_per_unit: 179.0 };

    /// The light of a colour (linear Rec. 709, any scale) and an amount, in the site's unit.
    pub(super) fn rgb(self, colour: [f64; 3], amount: Amount) -> DVec3 {
        let colour = DVec3::from_array(colour);
        if amount.is_photometric() {
            // divided first, so that colours of any scale stay in range
            colour / colour.dot(LUMINANCE_REC709.as_dvec3()) * (amount.value() / self.lumens_per_unit)
        } else {
            colour * amount.value()
        }
    }
}

impl Default for Photometry {
    fn default() -> Self {
        Self::HOUSE
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lumens_are_luminance_weighted_whatever_the_colour() {
        for colour in [[1.0, 1.0, 1.0], [0.0, 0.0, 3.0], [200.0, 100.0, 20.0]] {
            let rgb = Photometry::HOUSE.rgb(colour, Amount::FluxLm(800.0));
            assert!((rgb.dot(LUMINANCE_REC709.as_dvec3()) * 1000.0 - 800.0).abs() < 1e-9);
        }
        let given = Photometry::HOUSE.rgb([1.0, 0.5, 0.25], Amount::Radiance(4.0));
        assert_eq!(given, DVec3::new(4.0, 2.0, 1.0));
    }
}
