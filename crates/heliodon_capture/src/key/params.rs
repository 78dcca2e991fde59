//! How a film is keyed.

use super::KeyError;

/// Which colour is keyed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ScreenChoice {
    /// The strongest green or blue of the pictures.
    Find,
    /// The strongest green, from yellowish to bluish.
    Green,
    /// The strongest blue.
    Blue,
    /// What is like this sRGB colour; its shade is found in the pictures.
    Color([u8; 3]),
}

/// How foreground and screen were mixed where both share a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mixing {
    /// Whichever explains the film's edges better; linear where neither does.
    Find,
    /// Light added up: lenses, motion.
    Linear,
    /// Codes added up: composed, scaled or sharpened by programs.
    Encoded,
}

/// How the image and its mask are going to be composited.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Blending {
    /// In linear light, as Heliodon's viewer does.
    Linear,
    /// In encoded values, as fixed-function passes over an 8-bit frame buffer do.
    Encoded,
}

/// A polygon of what is kept; what lies outside of all of them is made transparent.
#[derive(Clone, Debug, PartialEq)]
pub struct Region {
    /// Corners in pixels from the top left, at least 3; even-odd where it crosses itself.
    pub points: Vec<[f32; 2]>,
}

impl Region {
    /// A rectangle from its upper left corner.
    #[must_use]
    pub fn rectangle(left: f32, top: f32, width: f32, height: f32) -> Self {
        let (right, bottom) = (left + width, top + height);
        Self { points: vec![[left, top], [right, top], [right, bottom], [left, bottom]] }
    }
}

/// Parameters of a [`Keyer`](super::Keyer).
#[derive(Clone, Debug, PartialEq)]
pub struct KeyParams {
    /// Which colour is keyed.
    pub screen: ScreenChoice,
    /// How edges were mixed.
    pub mixing: Mixing,
    /// How the result is composited.
    pub blending: Blending,
    /// Half of the wedge of hues that counts as screen, 15 to 75 degrees; `None`: Vlahos's 60 before pure green or blue, down to 40 before other
    /// hues. Wider takes more off edges and keeps less of hues near the screen's.
    pub acceptance_deg: Option<f32>,
    /// Alpha below which a pixel is screen, in standard deviations of the screen's noise, 0 to 20. More cleans the screen and eats wisps of hair.
    pub black_sigmas: f32,
    /// How far below 1 alpha becomes 1, 0 to 0.5. More closes what shines through, and hardens the inner edge.
    pub white_margin: f32,
    /// How much of the screen's colour is taken off what remains, 0 to 1.
    pub spill: f32,
    /// How much grey of the same brightness replaces it, 0 (darker) to 1.
    pub spill_grey: f32,
    /// Whether the film has fewer samples of colour than of brightness: edges then follow brightness more.
    pub subsampled: bool,
    /// How much alpha holds still where a pixel does, 0 to 0.95. More is calmer, and trails behind slow changes.
    pub steadiness: f32,
    /// Pixels that the matte is drawn in by, 0 to 50. More hides edges that are not clean.
    pub shrink_px: f32,
    /// Pixels that its edges are blurred over, 0 to 50.
    pub soften_px: f32,
    /// The garbage matte: only what lies in one of these is kept; all where there is none.
    pub keep: Vec<Region>,
    /// Whether small holes that show no screen are closed: highlights, glasses. Off for veils and smoke.
    pub close_holes: bool,
    /// Only what hangs together with the largest figure is kept.
    pub largest_only: bool,
}

impl KeyParams {
    /// A studio: a painted or woven screen, an actor.
    #[must_use]
    pub fn studio() -> Self {
        Self {
            screen: ScreenChoice::Find,
            mixing: Mixing::Find,
            blending: Blending::Linear,
            acceptance_deg: None,
            black_sigmas: 4.0,
            white_margin: 0.08,
            spill: 1.0,
            spill_grey: 0.5,
            subsampled: true,
            steadiness: 0.4,
            shrink_px: 0.0,
            soften_px: 0.0,
            keep: Vec::new(),
            close_holes: true,
            largest_only: false,
        }
    }

    /// A wall of some colour, a sheet, uneven light, a small or noisy film: harder on what is nearly screen and nearly foreground, and only the largest figure.
    #[must_use]
    pub fn rough() -> Self {
        Self { black_sigmas: 6.0, white_margin: 0.2, steadiness: 0.6, shrink_px: 0.5, largest_only: true, ..Self::studio() }
    }

    /// Nothing but the matte: for pictures without noise and codec.
    #[must_use]
    pub fn clean() -> Self {
        Self { black_sigmas: 3.0, white_margin: 0.02, subsampled: false, steadiness: 0.0, close_holes: false, ..Self::studio() }
    }

    /// Whether every parameter lies in its range.
    ///
    /// # Errors
    /// The first that does not.
    pub fn validate(&self) -> Result<(), KeyError> {
        let ranges = [
            ("the acceptance angle", self.acceptance_deg.unwrap_or(60.0), 15.0, 75.0, "an angle from 15 to 75 degrees"),
            ("the black point", self.black_sigmas, 0.0, 20.0, "a number of standard deviations from 0 to 20"),
            ("the white margin", self.white_margin, 0.0, 0.5, "a number from 0 to 0.5"),
            ("the spill removed", self.spill, 0.0, 1.0, "a number from 0 to 1"),
            ("the grey for spill", self.spill_grey, 0.0, 1.0, "a number from 0 to 1"),
            ("the steadiness", self.steadiness, 0.0, 0.95, "a number from 0 to 0.95"),
            ("the shrinking", self.shrink_px, 0.0, 50.0, "pixels from 0 to 50"),
            ("the softening", self.soften_px, 0.0, 50.0, "pixels from 0 to 50"),
        ];
        for (parameter, value, low, high, allowed) in ranges {
            // what is no number is in no range
            if !(low..=high).contains(&value) {
                return Err(KeyError::Parameter { parameter, value: value.to_string(), allowed });
            }
        }
        for region in &self.keep {
            if region.points.len() < 3 || region.points.iter().flatten().any(|x| !x.is_finite()) {
                let value = format!("one of {} corners", region.points.len());
                return Err(KeyError::Parameter {
                    parameter: "a region",
                    value,
                    allowed: "at least three corners, finite numbers of pixels",
                });
            }
        }
        Ok(())
    }
}
