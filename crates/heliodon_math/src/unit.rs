//! Units of length.

use serde::{Deserialize, Serialize};

/// The unit in which a file's numbers are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Unit {
    /// Kilometres.
    #[serde(rename = "km")]
    Kilometre,
    /// Metres.
    #[default]
    #[serde(rename = "m")]
    Metre,
    /// Decimetres.
    #[serde(rename = "dm")]
    Decimetre,
    /// Centimetres.
    #[serde(rename = "cm")]
    Centimetre,
    /// Millimetres.
    #[serde(rename = "mm")]
    Millimetre,
    /// International feet of 0.3048 m.
    #[serde(rename = "ft")]
    Foot,
    /// United States survey feet of 1200/3937 m.
    #[serde(rename = "us-ft")]
    UsSurveyFoot,
    /// Inches of 0.0254 m.
    #[serde(rename = "in")]
    Inch,
    /// Yards of 0.9144 m.
    #[serde(rename = "yd")]
    Yard,
}

impl Unit {
    /// Every unit, in the order of the documentation.
    pub const ALL: [Self; 9] = [
        Self::Kilometre,
        Self::Metre,
        Self::Decimetre,
        Self::Centimetre,
        Self::Millimetre,
        Self::Foot,
        Self::UsSurveyFoot,
        Self::Inch,
        Self::Yard,
    ];

    /// How it is written in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Kilometre => "km",
            Self::Metre => "m",
            Self::Decimetre => "dm",
            Self::Centimetre => "cm",
            Self::Millimetre => "mm",
            Self::Foot => "ft",
            Self::UsSurveyFoot => "us-ft",
            Self::Inch => "in",
            Self::Yard => "yd",
        }
    }

    /// Its length in metres.
    #[must_use]
    pub fn metres(self) -> f64 {
        match self {
            Self::Kilometre => 1000.0,
            Self::Metre => 1.0,
            Self::Decimetre => 0.1,
            Self::Centimetre => 0.01,
            Self::Millimetre => 0.001,
            Self::Foot => 0.3048,
            Self::UsSurveyFoot => 1200.0 / 3937.0,
            Self::Inch => 0.0254,
            Self::Yard => 0.9144,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_written_by_their_names() {
        for unit in Unit::ALL {
            let json = format!("\"{}\"", unit.name());
            assert_eq!((serde_json::to_string(&unit).unwrap(), serde_json::from_str(&json).ok()), (json, Some(unit)));
        }
        assert!(serde_json::from_str::<Unit>("\"parsec\"").is_err());
    }

    #[test]
    fn feet_differ_by_two_parts_in_a_million() {
        let ratio = Unit::UsSurveyFoot.metres() / Unit::Foot.metres();
        assert!((ratio - 1.000_002).abs() < 1e-9);
        assert!((Unit::Yard.metres() - 3.0 * Unit::Foot.metres()).abs() < 1e-12);
    }
}
