//! The motion of one body: filtered, carried on, brought to rest where it is lost, eased back where it returns.

use super::FilterSettings;
use super::gate::Verdict;
use super::track::Track;
use crate::pose::{Pose, Velocity};
use glam::Quat;

/// Reports older than the last by less than this have overtaken one another; if by more, the clock was set back.
const OVERTAKEN_S: f64 = 1.0;

/// What became of a report.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Taken {
    /// It is used.
    Used,
    /// It would be a jump.
    Refused,
    /// A later one has come before it.
    Overtaken,
}

/// Whether a body is seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum State {
    /// It never was.
    Never,
    /// It is.
    Tracked,
    /// It was.
    Lost {
        /// How long ago it was seen last, seconds, from 0 up.
        for_s: f64,
    },
}

/// One body's motion.
#[derive(Clone, Debug)]
pub(crate) struct Motion {
    settings: FilterSettings,
    track: Option<Track>,
}

impl Motion {
    pub(crate) fn new(settings: FilterSettings) -> Self {
        Self { settings, track: None }
    }

    /// Takes a report of a pose in the room that is checked ([`Pose::checked`]), at a finite time.
    pub(crate) fn hear(&mut self, pose: &Pose, arrival_s: f64) -> Taken {
        let settings = self.settings;
        let Some(track) = &mut self.track else {
            self.track = Some(Track::new(pose, arrival_s));
            return Taken::Used;
        };
        let dt_s = arrival_s - track.seen_s;
        if dt_s < -OVERTAKEN_S {
            // from the last moment of the old clock
            let shown = track.pose(&settings, track.seen_s);
            *track = Track::new(pose, arrival_s).eased_from(&shown);
            return Taken::Used;
        }
        if dt_s < 0.0 {
            return Taken::Overtaken;
        }
        let verdict = track.gate.judge(pose.position, arrival_s, settings.max_speed_m_s, settings.confirm_s);
        match verdict {
            Verdict::Refused => return Taken::Refused,
            Verdict::Moved if dt_s <= f64::from(settings.lost_after_s) => track.step(&settings, pose, arrival_s),
            Verdict::Moved | Verdict::Confirmed => {
                let shown = track.pose(&settings, arrival_s);
                let gate = track.gate;
                *track = Track::new(pose, arrival_s).eased_from(&shown);
                track.gate = gate;
            }
        }
        Taken::Used
    }

    /// Takes a report that the tracker does not see the body.
    pub(crate) fn lose(&mut self, arrival_s: f64) {
        if let Some(track) = &mut self.track
            && track.lost_s.is_none()
            && arrival_s >= track.seen_s
        {
            track.lost_s = Some(arrival_s);
        }
    }

    /// Where the body is shown at a time; nothing where it was never seen. Finite whatever the time is.
    pub(crate) fn pose(&self, now_s: f64) -> Option<Pose> {
        Some(self.track.as_ref()?.pose(&self.settings, now_s))
    }

    /// How it is carried on at a time.
    pub(crate) fn velocity(&self, now_s: f64) -> Velocity {
        self.track.as_ref().map_or_else(Velocity::default, |track| {
            let (_, left) = track.carried(&self.settings, now_s);
            Velocity { linear_m_s: track.linear.0 * left, angular_rad_s: track.angular.0 * left }
        })
    }

    /// Whether it is tracked at a time.
    pub(crate) fn state(&self, now_s: f64) -> State {
        let Some(track) = &self.track else { return State::Never };
        let for_s = (now_s - track.seen_s).max(0.0);
        let told = track.lost_s.is_some_and(|lost_s| lost_s <= now_s);
        if told || for_s > f64::from(self.settings.lost_after_s) { State::Lost { for_s } } else { State::Tracked }
    }

    /// The last filtered orientation.
    pub(crate) fn orientation(&self) -> Option<Quat> {
        Some(self.track.as_ref()?.orientation.value)
    }

    /// When it was seen last.
    pub(crate) fn seen_s(&self) -> Option<f64> {
        Some(self.track.as_ref()?.seen_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rotation;
    use glam::Vec3;

    const RATE_HZ: f64 = 100.0;

    fn at(x: f32) -> Pose {
        Pose { position: Vec3::X * x, ..Pose::IDENTITY }
    }

    /// A body that has walked along X at a metre a second for two seconds, and the time at which it was seen last.
    fn walker(settings: FilterSettings) -> (Motion, f64) {
        let mut motion = Motion::new(settings);
        for step in 0..=200 {
            motion.hear(&at(step as f32 / RATE_HZ as f32), f64::from(step) / RATE_HZ);
        }
        (motion, 2.0)
    }

    fn x(motion: &Motion, now_s: f64) -> f32 {
        motion.pose(now_s).unwrap().position.x
    }

    /// How much what is shown changes at most between two moments a thousandth of a second apart.
    fn greatest_change(shown: &[f32]) -> f32 {
        shown.windows(2).map(|two| (two[1] - two[0]).abs()).fold(0.0, f32::max)
    }

    #[test]
    fn a_lost_body_sails_to_rest() {
        let (mut motion, lost_s) = walker(FilterSettings::default());
        assert_eq!(motion.state(lost_s + 0.05), State::Tracked);
        motion.lose(lost_s + 0.01);
        assert!(matches!(motion.state(lost_s + 0.01), State::Lost { for_s } if (for_s - 0.01).abs() < 1e-9));
        let shown: Vec<f32> = (0..2000).map(|ms| x(&motion, lost_s + f64::from(ms) * 0.001)).collect();
        assert!(greatest_change(&shown) < 0.001_05, "never faster than it walked");
        assert!(shown.windows(2).all(|two| two[1] >= two[0]));
        // a centimetre until the loss, then the speed times the time constant
        assert!((shown[1999] - shown[0] - 0.11).abs() < 0.001, "{}", shown[1999] - shown[0]);
        assert!(motion.velocity(lost_s + 2.0).linear_m_s.length() < 1e-3);
    }

    #[test]
    fn silence_is_a_loss_after_its_time() {
        let (motion, last_s) = walker(FilterSettings::default());
        assert_eq!(motion.state(last_s + 0.0999), State::Tracked);
        assert!(matches!(motion.state(last_s + 0.1001), State::Lost { .. }));
        assert!((x(&motion, last_s + 10.0) - x(&motion, last_s) - 0.2).abs() < 0.001);
        assert_eq!(Motion::new(FilterSettings::default()).state(last_s), State::Never);
    }

    #[test]
    fn a_body_that_returns_is_eased_from_where_it_rested() {
        let (mut motion, last_s) = walker(FilterSettings::default());
        motion.lose(last_s);
        let mut shown = Vec::new();
        for ms in 0..2500 {
            let now_s = last_s + f64::from(ms) * 0.001;
            if ms >= 1000 && ms % 10 == 0 {
                motion.hear(&at(4.0), now_s);
            }
            shown.push(x(&motion, now_s));
        }
        // 1.85 m in 0.3 s: smoothstep is at most half as fast again as the mean
        assert!(greatest_change(&shown) < 0.0095, "{}", greatest_change(&shown));
        assert!((shown[1299] - 4.0).abs() < 0.001 && (shown[1150] - (shown[999] + 4.0) / 2.0).abs() < 0.02);
        assert_eq!(motion.state(last_s + 2.5), State::Tracked);
    }

    #[test]
    fn a_loss_of_a_moment_is_passed_over_without_easing() {
        let (mut motion, last_s) = walker(FilterSettings::default());
        motion.lose(last_s + 0.01);
        motion.hear(&at(2.05), last_s + 0.05);
        assert_eq!(motion.state(last_s + 0.05), State::Tracked);
        assert!((x(&motion, last_s + 0.05) - 2.1).abs() < 0.01, "as if nothing had been");
    }

    #[test]
    fn a_jump_is_refused_then_eased() {
        let (mut motion, last_s) = walker(FilterSettings::default());
        let mut shown = Vec::new();
        for ms in 1..1500 {
            let now_s = last_s + f64::from(ms) * 0.001;
            if ms % 10 == 0 {
                let taken = motion.hear(&at(7.0), now_s);
                // first heard at 10 ms; at 110 ms the clock's rounding decides
                assert!(ms == 110 || (taken == Taken::Refused) == (ms < 110), "{ms}");
            }
            shown.push(x(&motion, now_s));
        }
        assert!(greatest_change(&shown) < 0.025 && (shown[1498] - 7.0).abs() < 0.001);
        // one glitch amid good reports leaves no trace
        let (mut glitched, last_s) = walker(FilterSettings::default());
        assert_eq!(glitched.hear(&at(-3.0), last_s + 0.005), Taken::Refused);
        assert_eq!(glitched.pose(last_s + 0.01), walker(FilterSettings::default()).0.pose(last_s + 0.01));
    }

    #[test]
    fn orientations_are_eased_the_shorter_way() {
        let turned = |angle: f32| Pose { orientation: rotation::from_vector(Vec3::Y * angle), ..Pose::IDENTITY };
        let mut motion = Motion::new(FilterSettings::default());
        motion.hear(&turned(3.0), 0.0);
        motion.hear(&turned(-3.0), 1.0);
        for ms in 0..400 {
            let shown = motion.pose(1.0 + f64::from(ms) * 0.001).unwrap().orientation;
            assert!(rotation::to_vector(shown).length() > 2.99);
        }
    }

    #[test]
    fn time_that_stands_still_or_runs_back_does_no_harm() {
        let (mut motion, last_s) = walker(FilterSettings::default());
        for _ in 0..1000 {
            assert_eq!(motion.hear(&at(2.01), last_s), Taken::Used);
        }
        assert!((x(&motion, last_s) - 2.05).abs() < 0.02, "{}", x(&motion, last_s));
        assert_eq!(motion.hear(&at(2.0), last_s - 0.01), Taken::Overtaken);
        motion.lose(last_s - 0.01);
        assert_eq!(motion.state(last_s), State::Tracked);
        // a clock that is set back by an hour
        let before = x(&motion, last_s);
        assert_eq!(motion.hear(&at(3.0), -3600.0), Taken::Used);
        assert!((x(&motion, -3600.0) - before).abs() < 0.001 && (x(&motion, -3599.0) - 3.0).abs() < 0.001);
        // and one that leaps ahead
        assert_eq!(motion.hear(&at(3.0), 1e12), Taken::Used);
        for now_s in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 0.0, 1e300] {
            assert!(motion.pose(now_s).unwrap().is_finite());
        }
    }

    #[test]
    fn settings_at_their_ends_do_no_harm() {
        let ends = FilterSettings { rest_s: 0.0, ease_s: 0.0, confirm_s: 0.0, ..FilterSettings::unfiltered() };
        let (mut motion, last_s) = walker(ends);
        motion.lose(last_s);
        let rested = x(&motion, last_s + 5.0);
        assert!((rested - 2.0).abs() < 1e-4);
        motion.hear(&at(9.0), last_s + 5.0);
        assert!((x(&motion, last_s + 5.0) - 9.0).abs() < 1e-4, "at once, as it was bidden");
    }
}
