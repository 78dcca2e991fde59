//! Flicks: quick strokes to one side, after which the hand rests.
//!
//! For a free-floating wireless mouse, whose gyroscopes tell how it turns but not where it points, and for tracked wands.
//! Callieri, Debevec, Pair, Scopigno: "A realtime immersive application with realistic lighting: The Parthenon", Computers &
//! Graphics 30(3), 2006, let visitors move the hour and the exposure by gestures of such a mouse.
//!
//! A stroke begins where the speed, smoothed over about a frame, rises above a half of [`FlickSettings::least_speed`], and ends
//! where it falls below a quarter. It is a flick where it was quick, far and short in time, along one axis, and began from
//! rest: the hand's way back, as quick as the flick itself, is none.

mod wand;

pub use wand::WandFlickDetector;

use crate::settings::{SettingsError, within};
use glam::Vec2;
use serde::{Deserialize, Serialize};

/// The time constant in which the speed is smoothed, seconds: two reports of a mouse at 125 Hz, so that one coarse count makes
/// no stroke.
const SMOOTHING_S: f32 = 0.016;

/// After so long a silence a stroke is over, seconds, even where nobody asks in between.
const SILENCE_S: f64 = 0.25;

/// Where a flick went.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Flick {
    /// To the left.
    Left,
    /// To the right.
    Right,
    /// Up, or away over the table.
    Up,
    /// Down, or towards oneself.
    Down,
}

/// What a flick is. Lengths are in counts of a mouse, or in radians of a wand.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FlickSettings {
    /// The speed that a stroke reaches at least, lengths a second, above 0. Less: hasty pointing becomes flicks. More: only
    /// strong hands flick.
    pub least_speed: f32,
    /// How far it goes at least, from 0 up. Less: a knock at the table is a flick. More: needs a wide swing.
    pub least_travel: f32,
    /// How long it lasts at most, seconds, above 0. Less: wide swings are none. More: quick turns of the view are flicks.
    pub max_duration_s: f32,
    /// How many times as far it goes along its axis as across it, from 1 up. Less: slanting strokes count. More: asks for aim.
    pub dominance: f32,
    /// How long the hand rests before the next, seconds, from 0 up. Less: the way back is a flick the other way. More: one has
    /// to wait.
    pub rest_s: f32,
}

impl Default for FlickSettings {
    fn default() -> Self {
        Self::mouse()
    }
}

impl FlickSettings {
    /// For a gyroscopic mouse of some 400 counts an inch, or ten a degree.
    #[must_use]
    pub fn mouse() -> Self {
        Self { least_speed: 1500.0, least_travel: 120.0, max_duration_s: 0.35, dominance: 2.0, rest_s: 0.2 }
    }

    /// For a wand: a turn of 20 degrees or more, at 230 degrees a second or faster.
    #[must_use]
    pub fn wand() -> Self {
        Self { least_speed: 4.0, least_travel: 0.35, max_duration_s: 0.4, dominance: 2.0, rest_s: 0.25 }
    }

    /// Checks the ranges.
    ///
    /// # Errors
    ///
    /// The first field that is out of its range.
    pub fn validate(&self) -> Result<(), SettingsError> {
        within("least_speed", self.least_speed, 1e-3, 1e6)?;
        within("least_travel", self.least_travel, 0.0, 1e6)?;
        within("max_duration_s", self.max_duration_s, 0.01, 10.0)?;
        within("dominance", self.dominance, 1.0, 1e3)?;
        within("rest_s", self.rest_s, 0.0, 10.0)
    }
}

/// Finds flicks in relative motion.
#[derive(Clone, Debug)]
pub struct FlickDetector {
    settings: FlickSettings,
    /// The smoothed speed, to the right and down, lengths a second.
    speed: Vec2,
    last_s: Option<f64>,
    stroke: Option<Stroke>,
    /// When the last quick stroke ended, whether a flick or not.
    ended_s: f64,
}

#[derive(Clone, Copy, Debug)]
struct Stroke {
    since_s: f64,
    travel: Vec2,
    fastest: f32,
    rested: bool,
}

impl FlickDetector {
    /// A detector for which the hand has rested for long.
    #[must_use]
    pub fn new(settings: FlickSettings) -> Self {
        Self { settings, speed: Vec2::ZERO, last_s: None, stroke: None, ended_s: f64::NEG_INFINITY }
    }

    /// Takes how far the mouse has moved since the last time, to the right and **down** as mice tell it, at a time of a clock
    /// that does not go back. Answers the flick that has just ended. Wants to be asked once a frame, with zeros where nothing
    /// moved; else a flick is told with the next motion only. What is not finite is passed over; a clock that goes back begins
    /// anew.
    pub fn motion(&mut self, right: f32, down: f32, seconds: f64) -> Option<Flick> {
        let moved = Vec2::new(right, down);
        if !(moved.is_finite() && seconds.is_finite()) {
            return None;
        }
        let last_s = self.last_s.replace(seconds)?;
        let dt_s = seconds - last_s;
        if dt_s < 0.0 {
            *self = Self { last_s: Some(seconds), ..Self::new(self.settings) };
            return None;
        }
        if dt_s > SILENCE_S {
            // whatever moved in the silence was too slow to be told
            self.speed = Vec2::ZERO;
            return self.end(last_s);
        }
        let dt = dt_s as f32;
        self.speed += (moved - self.speed * dt) / (SMOOTHING_S + dt);
        let speed = self.speed.length();
        // two thresholds, for on a single one noise would make many strokes of one
        let moves = self.settings.least_speed * if self.stroke.is_some() { 0.25 } else { 0.5 };
        if speed < moves {
            return self.end(seconds);
        }
        let rested = last_s - self.ended_s >= f64::from(self.settings.rest_s);
        let begun = Stroke { since_s: last_s, travel: Vec2::ZERO, fastest: 0.0, rested };
        let stroke = self.stroke.get_or_insert(begun);
        stroke.travel += moved;
        stroke.fastest = stroke.fastest.max(speed);
        None
    }

    /// Ends the stroke, if there is one.
    fn end(&mut self, seconds: f64) -> Option<Flick> {
        let stroke = self.stroke.take()?;
        let FlickSettings { least_speed, least_travel, max_duration_s, dominance, .. } = self.settings;
        if stroke.fastest < least_speed {
            return None;
        }
        self.ended_s = seconds;
        let short = seconds - stroke.since_s <= f64::from(max_duration_s);
        let Vec2 { x: right, y: down } = stroke.travel;
        let (along, across) = (right.abs().max(down.abs()), right.abs().min(down.abs()));
        if !stroke.rested || !short || along < least_travel || along < across * dominance {
            return None;
        }
        Some(match (right.abs() >= down.abs(), right > 0.0, down > 0.0) {
            (true, true, _) => Flick::Right,
            (true, false, _) => Flick::Left,
            (false, _, true) => Flick::Down,
            (false, _, false) => Flick::Up,
        })
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use heliodon_math::random::Pcg32;

    /// A hand that moves from rest to rest by `travel` within `duration_s`, as hands do (Flash, Hogan: "The coordination of arm
    /// movements", Journal of Neuroscience 5(7), 1985, equation 9): how far it is at `t`.
    pub(super) fn reached(travel: Vec2, duration_s: f64, t: f64) -> Vec2 {
        let part = (t / duration_s).clamp(0.0, 1.0);
        travel * (part.powi(3) * (10.0 - 15.0 * part + 6.0 * part * part)) as f32
    }

    /// The flicks found in strokes (start, travel, duration), reported at a rate in whole counts with an unsteady hand.
    fn flicks(strokes: &[(f64, Vec2, f64)], rate_hz: f64, noise: f32) -> Vec<Flick> {
        let mut rng = Pcg32::new(21, 3);
        let mut detector = FlickDetector::new(FlickSettings::mouse());
        let end_s = strokes.iter().map(|stroke| stroke.0 + stroke.2).fold(0.0, f64::max) + 0.5;
        let mut told = Vec2::ZERO;
        let step = |i: i32| {
            let t = f64::from(i) / rate_hz;
            let hand: Vec2 = strokes.iter().map(|(start, travel, duration)| reached(*travel, *duration, t - start)).sum();
            let hand = (hand + Vec2::new(rng.range_f32(-noise, noise), rng.range_f32(-noise, noise))).round();
            let moved = hand - told;
            told = hand;
            detector.motion(moved.x, moved.y, t)
        };
        (0..(end_s * rate_hz) as i32).filter_map(step).collect()
    }

    const DIRECTIONS: [(Vec2, Flick); 4] =
        [(Vec2::X, Flick::Right), (Vec2::NEG_X, Flick::Left), (Vec2::Y, Flick::Down), (Vec2::NEG_Y, Flick::Up)];

    #[test]
    fn quick_strokes_are_flicks_at_every_rate() {
        for rate_hz in [30.0, 60.0, 125.0, 1000.0] {
            for (direction, flick) in DIRECTIONS {
                for (travel, duration_s) in [(200.0, 0.15), (300.0, 0.2), (800.0, 0.25)] {
                    let slanting = direction * travel + direction.perp() * travel * 0.3;
                    let found = flicks(&[(0.5, slanting, duration_s)], rate_hz, 1.0);
                    assert_eq!(found, [flick], "{travel} counts in {duration_s} s at {rate_hz} Hz");
                }
            }
        }
    }

    #[test]
    fn slow_motion_is_none_however_far() {
        for rate_hz in [30.0, 60.0, 1000.0] {
            for (travel, duration_s) in [(100.0, 1.0), (600.0, 1.0), (3000.0, 6.0), (300.0, 0.5)] {
                assert!(flicks(&[(0.5, Vec2::X * travel, duration_s)], rate_hz, 1.0).is_empty(), "{travel} in {duration_s} s");
            }
        }
    }

    #[test]
    fn long_slanting_and_tiny_strokes_are_none() {
        assert!(flicks(&[(0.5, Vec2::X * 4000.0, 0.8)], 60.0, 1.0).is_empty(), "a quick turn of the view");
        assert!(flicks(&[(0.5, Vec2::new(300.0, 250.0), 0.2)], 60.0, 1.0).is_empty(), "neither across nor down");
        assert!(flicks(&[(0.5, Vec2::X * 60.0, 0.05)], 60.0, 1.0).is_empty(), "a knock");
        assert!(flicks(&[(100.0, Vec2::ZERO, 1.0)], 125.0, 4.0).is_empty(), "a hand that trembles for two minutes");
    }

    #[test]
    fn the_way_back_is_none_but_the_next_after_a_rest_is() {
        let (there, back) = (Vec2::X * 300.0, Vec2::X * -300.0);
        assert_eq!(flicks(&[(0.5, there, 0.2), (0.7, back, 0.2)], 60.0, 1.0), [Flick::Right]);
        assert_eq!(flicks(&[(0.5, there, 0.2), (0.8, back, 0.2)], 60.0, 1.0), [Flick::Right]);
        assert_eq!(flicks(&[(0.5, there, 0.2), (1.2, back, 0.2)], 60.0, 1.0), [Flick::Right, Flick::Left]);
        // a slow way back is rest enough
        assert_eq!(flicks(&[(0.5, there, 0.2), (0.8, back, 0.9), (1.8, there, 0.2)], 60.0, 1.0), [Flick::Right; 2]);
    }

    #[test]
    fn a_stroke_that_nobody_asked_after_is_told_with_the_next_motion() {
        let mut detector = FlickDetector::new(FlickSettings::mouse());
        for i in 0..10 {
            assert_eq!(detector.motion(40.0, 0.0, f64::from(i) * 0.01), None);
        }
        assert_eq!(detector.motion(1.0, 0.0, 5.0), Some(Flick::Right));
        assert_eq!(detector.motion(1.0, 0.0, 5.01), None);
    }

    #[test]
    fn strange_numbers_and_clocks_do_no_harm() {
        let mut detector = FlickDetector::new(FlickSettings::mouse());
        for (right, seconds) in [(f32::NAN, 0.0), (1.0, f64::NAN), (f32::INFINITY, 1.0), (f32::MAX, 1.0), (f32::MAX, 1.0)] {
            assert_eq!(detector.motion(right, 0.0, seconds), None);
        }
        for seconds in [2.0, 1.0, 1.0, 0.0] {
            detector.motion(1e30, 0.0, seconds);
        }
        FlickSettings::wand().validate().unwrap();
        assert_eq!(FlickSettings { dominance: 0.5, ..FlickSettings::mouse() }.validate().unwrap_err().key, "dominance");
    }
}
