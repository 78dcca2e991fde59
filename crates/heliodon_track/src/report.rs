//! What a tracker reports of a body, whatever language it speaks.

use crate::pose::Pose;
use glam::{Quat, Vec3};
use thiserror::Error;

/// Axes of a joystick or trigger that a body can have.
pub const AXES: usize = 8;

/// What is heard of one body at one moment. What is not said of it stays as it was.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Report {
    /// The body: an index into those of the settings.
    pub body: usize,
    /// When it arrived, seconds of the caller's clock, which never goes back.
    pub arrival_s: f64,
    /// Whether and where the tracker sees it.
    pub sight: Sight,
    /// Buttons.
    pub buttons: Option<Buttons>,
    /// Axes, each where it is told; usually from -1 to 1.
    pub axes: [Option<f32>; AXES],
}

/// Whether and where a tracker sees a body, in the tracker's own coordinates and units of length.
///
/// Nothing is checked yet: numbers may be NaN or beyond all bounds, and a matrix that is no rotation comes as a quaternion of
/// zeros. [`crate::follow::Follower`] refuses and counts those.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Sight {
    /// Nothing is told: the report is of buttons or axes.
    #[default]
    Untold,
    /// The tracker says that it does not see it.
    Lost,
    /// Its position alone: it keeps the orientation that it has.
    Position(Vec3),
    /// Position and orientation, `tracker_from_body`.
    Pose(Pose),
}

/// Buttons, numbered by the bits from 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Buttons {
    /// Bit n: button n is held down.
    pub pressed: u32,
    /// Bit n: the report says something of button n. The others stay as they were.
    pub told: u32,
}

impl Buttons {
    /// All 32 at once.
    #[must_use]
    pub fn all(pressed: u32) -> Self {
        Self { pressed, told: u32::MAX }
    }

    /// One of them; nothing for a number above 31.
    #[must_use]
    pub fn one(number: u32, held: bool) -> Option<Self> {
        let told = 1_u32.checked_shl(number)?;
        Some(Self { pressed: if held { told } else { 0 }, told })
    }

    /// What is held down after the report, where `before` was.
    #[must_use]
    pub fn after(self, before: u32) -> u32 {
        (before & !self.told) | (self.pressed & self.told)
    }
}

impl Report {
    /// A report that says nothing yet.
    #[must_use]
    pub fn of(body: usize, arrival_s: f64) -> Self {
        Self { body, arrival_s, sight: Sight::Untold, buttons: None, axes: [None; AXES] }
    }

    /// The same with what is seen.
    #[must_use]
    pub fn with_sight(self, sight: Sight) -> Self {
        Self { sight, ..self }
    }

    /// The same with buttons.
    #[must_use]
    pub fn with_buttons(self, buttons: Buttons) -> Self {
        Self { buttons: Some(buttons), ..self }
    }

    /// The pose, where the report has a whole one.
    #[must_use]
    pub fn pose(&self) -> Option<Pose> {
        match self.sight {
            Sight::Pose(pose) => Some(pose),
            Sight::Untold | Sight::Lost | Sight::Position(_) => None,
        }
    }
}

/// What a matrix that is no rotation is reported as.
pub(crate) const NO_ROTATION: Quat = Quat::from_xyzw(0.0, 0.0, 0.0, 0.0);

/// What a packet held besides its reports.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Heard {
    /// Messages and targets that belong to no body of the settings.
    pub ignored: u64,
    /// The tracker's own counter of frames, where it has one.
    pub frame: Option<u32>,
}

/// Why a packet was dropped, nothing of it used.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error("byte {offset} of the packet: {reason}")]
pub struct Malformed {
    /// Where in the packet, bytes from 0.
    pub offset: usize,
    /// What is wrong there.
    pub reason: &'static str,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_button_leaves_the_others() {
        let held = Buttons::one(3, true).unwrap().after(0b0001);
        assert_eq!(held, 0b1001);
        assert_eq!(Buttons::one(0, false).unwrap().after(held), 0b1000);
        assert_eq!(Buttons::all(0b10).after(held), 0b10);
        assert_eq!(Buttons::one(32, true), None);
    }

    #[test]
    fn a_malformed_packet_says_where() {
        let error = Malformed { offset: 12, reason: "a number is missing" };
        assert_eq!(error.to_string(), "byte 12 of the packet: a number is missing");
    }
}
