//! From reports that tremble, lag, fail and jump to where a body is.
//!
//! Positions and orientations go through a One Euro filter each ([`OneEuro`]); the speed of what comes out of it, smoothed once
//! more, carries the body on to the moment that is asked for and [`FilterSettings::prediction_s`] further. A body that is lost
//! coasts to rest; one that comes back, or has jumped, is eased to where it is. What is shown is always continuous but for the
//! filter's own steps.
//!
//! Measured on a head that sways by 15 cm at 0.7 Hz, seen 60 times a second with 0.3 mm of noise, on a screen that lights up 50
//! ms after the report: the tests beside this hold the settings to these figures.
//!
//! | | lag at the eye | error at the eye (rms) | trembling at rest (rms) |
//! | --- | --- | --- | --- |
//! | as reported | 50 ms | 23 mm | 0.30 mm |
//! | smoothed, without prediction | 55 ms | 26 mm | 0.09 mm |
//! | smoothed and predicted by 50 ms, as it comes | 8 ms | 7 mm | 0.15 mm |

mod gate;
mod motion;
mod one_euro;
mod track;

pub use motion::State;
pub(crate) use motion::{Motion, Taken};
pub use one_euro::OneEuro;

use crate::settings::{SettingsError, within};
use serde::{Deserialize, Serialize};

/// How reports become motion.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FilterSettings {
    /// Smoothing of positions; speeds in metres a second.
    pub position: OneEuro,
    /// Smoothing of orientations; speeds in radians a second.
    pub orientation: OneEuro,
    /// The cutoff of the speed that carries a body on, Hz, from 0.001 to 1e6. Less: overshoots where a movement ends. More:
    /// what is predicted trembles.
    pub velocity_cutoff_hz: f32,
    /// How far ahead of the moment that is asked for a body is shown, seconds, from 0 to 0.25: the time from the tracker's
    /// measurement to its report, and from the question to the light of the screen. Less: the picture swims behind the head.
    /// More: it overshoots where movements begin and end, and trembles.
    pub prediction_s: f32,
    /// After how long a silence a body is lost, seconds, from 0.01 to 10. Less: a network's hiccup is a loss. More: a body
    /// sails on for longer after the last report. A loss that the tracker tells of counts at once.
    pub lost_after_s: f32,
    /// The time constant in which a lost body comes to rest, seconds, from 0 to 10. Less: stops short. More: sails further, by
    /// the speed times this.
    pub rest_s: f32,
    /// How long a body takes from where it rested to where it has come back, and over a jump, seconds, from 0 to 10. Less: a
    /// visible leap. More: is wrong for longer.
    pub ease_s: f32,
    /// A report for which the body would have had to be faster is refused, metres a second, from 0.1 to 1e6. Less: quick hands
    /// are held for jumps. More: mistakes of the tracker are shown.
    pub max_speed_m_s: f32,
    /// How long reports have to insist on a place, near one another, until a jump is believed, seconds, from 0 to 10. Less:
    /// believes mistakes. More: stays behind after a true one, such as a target taken up elsewhere.
    pub confirm_s: f32,
}

impl Default for FilterSettings {
    /// For the heads and hands of an optical tracker, before projectors.
    fn default() -> Self {
        Self {
            position: OneEuro { min_cutoff_hz: 1.5, beta: 60.0, derivative_cutoff_hz: 3.0 },
            orientation: OneEuro { min_cutoff_hz: 1.5, beta: 20.0, derivative_cutoff_hz: 3.0 },
            velocity_cutoff_hz: 10.0,
            prediction_s: 0.05,
            lost_after_s: 0.1,
            rest_s: 0.1,
            ease_s: 0.3,
            max_speed_m_s: 15.0,
            confirm_s: 0.1,
        }
    }
}

impl FilterSettings {
    /// For trackers that smooth and predict themselves: what comes is shown, but losses and jumps are handled as ever.
    #[must_use]
    pub fn unfiltered() -> Self {
        Self { position: OneEuro::OFF, orientation: OneEuro::OFF, prediction_s: 0.0, ..Self::default() }
    }

    /// Checks the ranges.
    ///
    /// # Errors
    ///
    /// The first field that is out of its range.
    pub fn validate(&self) -> Result<(), SettingsError> {
        self.position.validate().map_err(|error| error.inside("position"))?;
        self.orientation.validate().map_err(|error| error.inside("orientation"))?;
        within("velocity_cutoff_hz", self.velocity_cutoff_hz, 1e-3, 1e6)?;
        within("prediction_s", self.prediction_s, 0.0, 0.25)?;
        within("lost_after_s", self.lost_after_s, 0.01, 10.0)?;
        within("rest_s", self.rest_s, 0.0, 10.0)?;
        within("ease_s", self.ease_s, 0.0, 10.0)?;
        within("max_speed_m_s", self.max_speed_m_s, 0.1, 1e6)?;
        within("confirm_s", self.confirm_s, 0.0, 10.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pose::Pose;
    use crate::rotation;
    use glam::{Quat, Vec3};
    use heliodon_math::random::Pcg32;

    const RATE_HZ: f64 = 60.0;
    const LATENCY_S: f64 = 0.05;

    /// About a normal distribution of deviation 1: the sum of twelve uniform numbers has variance 1.
    fn normal(rng: &mut Pcg32) -> f32 {
        (0..12).map(|_| rng.next_f32()).sum::<f32>() - 6.0
    }

    fn sway(t: f64) -> f32 {
        0.15 * libm::sin(std::f64::consts::TAU * 0.7 * t) as f32
    }

    /// What is shown at each report, after a second, of a body at `truth` that is reported with 0.3 mm of noise.
    fn shown(settings: &FilterSettings, truth: impl Fn(f64) -> f32) -> Vec<(f64, f32)> {
        let mut rng = Pcg32::new(11, 4);
        let mut motion = Motion::new(*settings);
        let mut list = Vec::new();
        for step in 0..1200 {
            let t = f64::from(step) / RATE_HZ;
            let position = Vec3::X * (truth(t) + 0.0003 * normal(&mut rng));
            motion.hear(&Pose { position, ..Pose::IDENTITY }, t);
            list.push((t, motion.pose(t).unwrap().position.x));
        }
        list.split_off(60)
    }

    /// The root mean square of the distance to the truth `lag_s` before the screen lights up.
    fn error(shown: &[(f64, f32)], lag_s: f64) -> f32 {
        let sum: f32 = shown.iter().map(|(t, x)| (x - sway(t + LATENCY_S - lag_s)).powi(2)).sum();
        (sum / shown.len() as f32).sqrt()
    }

    /// The lag that explains what is shown best, milliseconds.
    fn lag_ms(shown: &[(f64, f32)]) -> i32 {
        let at = |ms: &i32| error(shown, f64::from(*ms) * 0.001);
        (-50..150).min_by(|a, b| at(a).total_cmp(&at(b))).unwrap()
    }

    #[test]
    fn prediction_takes_the_latency_away() {
        let smoothed = FilterSettings { prediction_s: 0.0, ..FilterSettings::default() };
        let of = |settings: &FilterSettings| {
            let shown = shown(settings, sway);
            (lag_ms(&shown), error(&shown, 0.0))
        };
        let (raw, smoothed, predicted) = (of(&FilterSettings::unfiltered()), of(&smoothed), of(&FilterSettings::default()));
        let found = format!("raw {raw:?}, smoothed {smoothed:?}, predicted {predicted:?}");
        assert!((49..=51).contains(&raw.0) && (0.022..0.025).contains(&raw.1), "{found}");
        assert!((53..=59).contains(&smoothed.0) && smoothed.1 < 0.028, "{found}");
        assert!((4..=12).contains(&predicted.0) && predicted.1 < 0.0085, "{found}");
    }

    #[test]
    fn smoothing_stills_a_body_at_rest() {
        let tremble = |settings: &FilterSettings| {
            let shown = shown(settings, |_| 0.0);
            (shown.iter().map(|(_, x)| x * x).sum::<f32>() / shown.len() as f32).sqrt()
        };
        let smoothed = FilterSettings { prediction_s: 0.0, ..FilterSettings::default() };
        let found = [FilterSettings::unfiltered(), smoothed, FilterSettings::default()].map(|settings| tremble(&settings));
        assert!((0.00028..0.00032).contains(&found[0]), "{found:?}");
        assert!(found[1] < 0.00011 && found[2] < 0.00018, "{found:?}");
    }

    #[test]
    fn a_turning_head_is_predicted_too() {
        let mut motion = Motion::new(FilterSettings::default());
        let turned = |t: f64| rotation::from_vector(Vec3::Y * t as f32);
        for step in 0..240 {
            let t = f64::from(step) / RATE_HZ;
            motion.hear(&Pose { position: Vec3::ZERO, orientation: turned(t) }, t);
        }
        let t = 239.0 / RATE_HZ;
        let behind = |shown: Quat, t: f64| rotation::to_vector(turned(t) * shown.conjugate()).y;
        // at a radian a second the filter is 7.4 ms behind: 1 / (2 pi (1.5 + 20)) s
        let shown = motion.pose(t).unwrap().orientation;
        assert!((behind(shown, t + 0.05) - 0.0074).abs() < 0.0005, "{}", behind(shown, t + 0.05));
        let later = motion.pose(t + 0.01).unwrap().orientation;
        assert!((behind(later, t + 0.06) - 0.0074).abs() < 0.0005);
        assert!((motion.velocity(t).angular_rad_s - Vec3::Y).length() < 0.01);
    }

    #[test]
    fn ranges_are_checked_field_by_field() {
        FilterSettings::unfiltered().validate().unwrap();
        let wrong = FilterSettings { ease_s: -1.0, ..FilterSettings::default() };
        assert_eq!(wrong.validate().unwrap_err().to_string(), "ease_s: it is -1; give a number from 0 to 10");
        let wrong = OneEuro { beta: f32::INFINITY, ..OneEuro::OFF };
        let wrong = FilterSettings { position: wrong, ..FilterSettings::default() };
        assert_eq!(wrong.validate().unwrap_err().key, "position.beta");
    }
}
