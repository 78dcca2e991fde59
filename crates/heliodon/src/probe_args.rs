//! How probes are read, as the command line says it.

use crate::failure::wrong_arguments;
use anyhow::Result;
use clap::ValueEnum;
use heliodon_sky::mapping::Mapping;

/// How probes are read.
#[derive(Clone, Debug, clap::Args)]
pub struct ProbeArgs {
    /// How the probes map directions to pixels
    #[arg(long, value_enum)]
    mapping: Option<MappingName>,
    /// Opening angle of a fisheye, degrees [default: 180]
    #[arg(long, value_name = "DEG", value_parser = |text: &str| crate::values::within(text, 1.0, 360.0))]
    opening: Option<f64>,
    /// The compass bearing, clockwise in degrees, of what the mapping calls north [default: 0]
    #[arg(long, value_name = "DEG", allow_negative_numbers = true, value_parser = |text: &str| crate::values::within(text, -360.0, 360.0))]
    turn: Option<f64>,
}

/// A mapping by the name that `site.toml` gives it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum MappingName {
    /// Latitude and longitude, north in the middle
    LatLong,
    /// Light probe: the whole sphere seen along -Z
    Angular,
    /// Mirror ball seen along -Z
    MirrorBall,
    /// The faces of a cube: a cross, 3 x 4 or 4 x 3, or a strip, 6 x 1 or 1 x 6
    CubeCross,
    /// The upper half seen from below
    Fisheye,
}

impl ProbeArgs {
    /// Whether anything is said.
    pub fn any(&self) -> bool {
        self.mapping.is_some() || self.opening.is_some() || self.turn.is_some()
    }

    /// The mapping, if one is named.
    ///
    /// # Errors
    /// An opening angle of what has none.
    pub fn mapping(&self) -> Result<Option<Mapping>> {
        if self.opening.is_some() && self.mapping != Some(MappingName::Fisheye) {
            wrong_arguments!("--opening is a fisheye's; leave it out, or say --mapping fisheye");
        }
        Ok(self.mapping.map(|mapping| match mapping {
            MappingName::LatLong => Mapping::LatLong,
            MappingName::Angular => Mapping::Angular,
            MappingName::MirrorBall => Mapping::MirrorBall,
            MappingName::CubeCross => Mapping::CubeCross,
            MappingName::Fisheye => Mapping::Fisheye { opening_deg: self.opening.unwrap_or(180.0) },
        }))
    }

    /// The bearing of what the mapping calls north, in degrees.
    pub fn turn_deg(&self) -> f64 {
        self.turn.unwrap_or(0.0)
    }
}
