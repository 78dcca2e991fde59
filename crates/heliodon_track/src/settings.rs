//! What is followed, and by which name the tracker knows it.

use crate::calibration::Calibration;
use crate::filter::FilterSettings;
use crate::pose::Pose;
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Bodies that one follower may have: the cost of a packet grows with them.
pub const MAX_BODIES: usize = 64;

/// Everything that a [`crate::follow::Follower`] wants to know.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    /// Whom to follow; reports and questions name them by their index. From none to [`MAX_BODIES`]; what is not listed is
    /// ignored.
    pub bodies: Vec<Body>,
    /// From the tracker's coordinates to the room's.
    pub calibration: Calibration,
    /// Smoothing, prediction, loss and jumps, for all bodies that have no settings of their own.
    pub filter: FilterSettings,
}

/// One body: a head, a hand, a wand.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Body {
    /// What people call it, for messages: "head".
    pub name: String,
    /// The OSC address of its messages, such as "/heliodon/head" or VMC's "/VMC/Ext/Tra/Pos"; none: OSC says nothing of it.
    pub address: Option<String>,
    /// The text that its OSC messages carry before their numbers, where several bodies share an address, as VMC's trackers do.
    /// None: every message at the address is its.
    pub serial: Option<String>,
    /// Its number in DTrack; none: DTrack says nothing of it.
    pub dtrack: Option<DtrackTarget>,
    /// From the body's own axes to those of the target that the tracker sees, after the calibration: for a head, where the
    /// middle between the eyes is as seen from the markers, in metres, and how the markers' frame is turned on the head.
    pub target_from_body: Pose,
    /// Smoothing and the rest for this body alone.
    pub filter: Option<FilterSettings>,
}

/// How DTrack numbers what it tracks, from 0 as in its datagrams (its own window counts from 1).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DtrackTarget {
    /// A standard body: lines `6d` and `6di`.
    Body(u32),
    /// A flystick with buttons and joystick: lines `6df2` and `6df`.
    Flystick(u32),
}

/// What is wrong with settings.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{key}: {message}; {remedy}")]
pub struct SettingsError {
    /// Which setting, such as `bodies[1].address`.
    pub key: String,
    /// What is wrong.
    pub message: String,
    /// What to do about it.
    pub remedy: String,
}

impl SettingsError {
    pub(crate) fn new(key: impl Into<String>, message: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self { key: key.into(), message: message.into(), remedy: remedy.into() }
    }

    /// The same for a setting inside another.
    pub(crate) fn inside(mut self, outer: &str) -> Self {
        self.key = format!("{outer}.{}", self.key);
        self
    }
}

/// A number has its range.
pub(crate) fn within(key: &str, value: f32, least: f32, most: f32) -> Result<(), SettingsError> {
    if (least..=most).contains(&value) {
        return Ok(());
    }
    Err(SettingsError::new(key, format!("it is {value}"), format!("give a number from {least} to {most}")))
}

impl Settings {
    /// Checks every number and that no two bodies are the same to the tracker.
    ///
    /// # Errors
    ///
    /// The first setting that is out of its range, with its key and a remedy.
    pub fn validate(&self) -> Result<(), SettingsError> {
        if self.bodies.len() > MAX_BODIES {
            let message = format!("there are {} bodies", self.bodies.len());
            return Err(SettingsError::new("bodies", message, format!("list at most {MAX_BODIES}")));
        }
        self.calibration.validate().map_err(|error| error.inside("calibration"))?;
        self.filter.validate().map_err(|error| error.inside("filter"))?;
        for (i, body) in self.bodies.iter().enumerate() {
            let key = format!("bodies[{i}]");
            body.validate().map_err(|error| error.inside(&key))?;
            for (k, earlier) in self.bodies[..i].iter().enumerate() {
                body.differs_from(earlier, k).map_err(|error| error.inside(&key))?;
            }
        }
        Ok(())
    }
}

impl Body {
    /// A body that OSC reports at an address.
    #[must_use]
    pub fn osc(name: impl Into<String>, address: impl Into<String>) -> Self {
        Self { name: name.into(), address: Some(address.into()), ..Self::default() }
    }

    /// A body that DTrack reports.
    #[must_use]
    pub fn dtrack(name: impl Into<String>, target: DtrackTarget) -> Self {
        Self { name: name.into(), dtrack: Some(target), ..Self::default() }
    }

    fn validate(&self) -> Result<(), SettingsError> {
        if let Some(address) = &self.address {
            let plain = address.bytes().all(|c| c.is_ascii_graphic() && !b"#*,?[]{}".contains(&c));
            if !plain || !address.starts_with('/') || address.len() < 2 || address.ends_with('/') {
                let remedy = "write one that begins with / and has no blanks, wildcards or / at its end: \"/heliodon/head\"";
                return Err(SettingsError::new("address", format!("`{address}` is no OSC address"), remedy));
            }
        } else if self.serial.is_some() {
            let remedy = "add the address, or take serial out";
            return Err(SettingsError::new("serial", "a serial belongs to an OSC address, and there is none", remedy));
        }
        if self.target_from_body.checked().is_none() {
            let remedy = "give finite metres and a quaternion of length 1";
            return Err(SettingsError::new("target_from_body", "it is no pose", remedy));
        }
        self.filter.as_ref().map_or(Ok(()), |filter| filter.validate().map_err(|error| error.inside("filter")))
    }

    /// Whether no message can be meant for both.
    fn differs_from(&self, other: &Self, number: usize) -> Result<(), SettingsError> {
        let remedy = "give each body its own";
        // one without a serial takes every message at the address
        let serials = self.serial.is_none() || other.serial.is_none() || self.serial == other.serial;
        if self.address.is_some() && self.address == other.address && serials {
            let message = format!("bodies[{number}] has the same address, and no other serial");
            return Err(SettingsError::new("address", message, remedy));
        }
        if self.dtrack.is_some() && self.dtrack == other.dtrack {
            return Err(SettingsError::new("dtrack", format!("bodies[{number}] has the same"), remedy));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wrong(bodies: Vec<Body>) -> String {
        Settings { bodies, ..Settings::default() }.validate().unwrap_err().to_string()
    }

    #[test]
    fn the_defaults_are_sound() {
        Settings::default().validate().unwrap();
        let bodies = vec![Body::osc("head", "/heliodon/head"), Body::dtrack("wand", DtrackTarget::Flystick(0))];
        Settings { bodies, ..Settings::default() }.validate().unwrap();
    }

    #[test]
    fn what_is_wrong_is_told_with_its_key_and_a_remedy() {
        for address in ["heliodon", "/", "/head/", "/he ad", "/head*", "/tête", ""] {
            let error = wrong(vec![Body::osc("head", address)]);
            assert!(error.starts_with("bodies[0].address: ") && error.contains("/heliodon/head"), "{error}");
        }
        let twice = wrong(vec![Body::osc("a", "/a"), Body::osc("b", "/a")]);
        assert!(twice.starts_with("bodies[1].address: bodies[0]"), "{twice}");
        let numbers = wrong(vec![Body::dtrack("a", DtrackTarget::Body(1)), Body::dtrack("b", DtrackTarget::Body(1))]);
        assert!(numbers.starts_with("bodies[1].dtrack"), "{numbers}");
        assert!(wrong(vec![Body { serial: Some("x".into()), ..Body::default() }]).contains("serial"));
        assert!(wrong(vec![Body::default(); MAX_BODIES + 1]).contains("65 bodies"));
        let filter = FilterSettings { prediction_s: f32::NAN, ..FilterSettings::default() };
        let error = wrong(vec![Body { filter: Some(filter), ..Body::default() }]);
        assert!(error.starts_with("bodies[0].filter.prediction_s: it is NaN"), "{error}");
    }

    #[test]
    fn trackers_with_serials_share_an_address() {
        let vmc = |serial: &str| Body { serial: Some(serial.into()), ..Body::osc(serial, "/VMC/Ext/Tra/Pos") };
        Settings { bodies: vec![vmc("left"), vmc("right")], ..Settings::default() }.validate().unwrap();
        assert!(wrong(vec![vmc("left"), Body::osc("any", "/VMC/Ext/Tra/Pos")]).contains("same address"));
    }

    #[test]
    fn settings_are_read_with_what_is_not_said_as_it_comes() {
        let text = r#"{"bodies": [{"name": "wand", "dtrack": {"flystick": 0}}], "filter": {"prediction_s": 0.03}}"#;
        let settings: Settings = serde_json::from_str(text).unwrap();
        assert_eq!(settings.bodies[0], Body::dtrack("wand", DtrackTarget::Flystick(0)));
        assert_eq!(settings.filter, FilterSettings { prediction_s: 0.03, ..FilterSettings::default() });
        assert!(serde_json::from_str::<Settings>(r#"{"prediction": 1}"#).is_err());
    }
}
