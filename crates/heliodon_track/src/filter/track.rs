//! What carries a body on between reports, to rest after the last, and back where it returns.

use super::FilterSettings;
use super::gate::Gate;
use super::one_euro::{Orientation, Position, Rate};
use crate::pose::Pose;
use crate::rotation;
use glam::Vec3;

/// The fastest that a body is believed to turn, radians a second: three times a gymnast.
const MAX_TURN_RAD_S: f32 = 50.0;

/// What is known of a body that was seen at least once.
#[derive(Clone, Copy, Debug)]
pub(super) struct Track {
    pub(super) position: Position,
    pub(super) orientation: Orientation,
    pub(super) linear: Rate,
    pub(super) angular: Rate,
    /// When the last report was used.
    pub(super) seen_s: f64,
    /// Since when the tracker says that it does not see it.
    pub(super) lost_s: Option<f64>,
    ease: Option<Ease>,
    pub(super) gate: Gate,
}

/// The way back from where a body was shown to where it is.
#[derive(Clone, Copy, Debug)]
struct Ease {
    since_s: f64,
    /// From where it is to where it was shown.
    away: Vec3,
    /// The same of its orientation, axis times angle.
    turned: Vec3,
}

impl Track {
    /// A body that is seen for the first time, or anew.
    pub(super) fn new(pose: &Pose, arrival_s: f64) -> Self {
        Self {
            position: Position::new(pose.position),
            orientation: Orientation::new(pose.orientation),
            linear: Rate::default(),
            angular: Rate::default(),
            seen_s: arrival_s,
            lost_s: None,
            ease: None,
            gate: Gate::new(pose.position, arrival_s),
        }
    }

    /// The same, shown at first where `shown` is.
    pub(super) fn eased_from(self, shown: &Pose) -> Self {
        let away = shown.position - self.position.value;
        let turned = rotation::to_vector(shown.orientation * self.orientation.value.conjugate());
        Self { ease: Some(Ease { since_s: self.seen_s, away, turned }), ..self }
    }

    /// Takes the next report of a body that moves on.
    pub(super) fn step(&mut self, settings: &FilterSettings, pose: &Pose, arrival_s: f64) {
        let dt_s = (arrival_s - self.seen_s) as f32;
        let moved = self.position.step(&settings.position, pose.position, dt_s);
        self.linear.step(moved, dt_s, settings.velocity_cutoff_hz);
        self.linear.0 = self.linear.0.clamp_length_max(settings.max_speed_m_s);
        let turned = self.orientation.step(&settings.orientation, pose.orientation, dt_s);
        self.angular.step(turned, dt_s, settings.velocity_cutoff_hz);
        self.angular.0 = self.angular.0.clamp_length_max(MAX_TURN_RAD_S);
        self.seen_s = arrival_s;
        self.lost_s = None;
    }

    /// For how many seconds the speed of the last report has carried the body by `now_s`, and which part of it is left.
    pub(super) fn carried(&self, settings: &FilterSettings, now_s: f64) -> (f32, f32) {
        let silence_s = f64::from(settings.lost_after_s);
        let steady_s = self.lost_s.map_or(silence_s, |lost_s| (lost_s - self.seen_s).min(silence_s));
        // a question about the past, or at no time at all, is one about the last report
        let age_s = (now_s - self.seen_s).max(0.0);
        if age_s <= steady_s {
            return (age_s as f32 + settings.prediction_s, 1.0);
        }
        let left = if settings.rest_s > 0.0 { libm::exp((steady_s - age_s) / f64::from(settings.rest_s)) as f32 } else { 0.0 };
        (steady_s as f32 + settings.prediction_s + settings.rest_s * (1.0 - left), left)
    }

    /// Where the body is shown.
    pub(super) fn pose(&self, settings: &FilterSettings, now_s: f64) -> Pose {
        let (carried_s, _) = self.carried(settings, now_s);
        let mut position = self.position.value + self.linear.0 * carried_s;
        let mut turn = rotation::from_vector(self.angular.0 * carried_s);
        if let Some(ease) = &self.ease {
            let part = ease.part_left(f64::from(settings.ease_s), now_s);
            position += ease.away * part;
            turn = rotation::from_vector(ease.turned * part) * turn;
        }
        let orientation = turn * self.orientation.value;
        Pose { position, orientation: rotation::unit(orientation).unwrap_or(self.orientation.value) }
    }
}

impl Ease {
    /// From 1 to 0, without a jolt at either end.
    fn part_left(&self, ease_s: f64, now_s: f64) -> f32 {
        let done = (now_s - self.since_s) / ease_s;
        if done <= 0.0 {
            return 1.0;
        }
        // no time to ease in divides by zero
        if done < 1.0 { (1.0 - done * done * (3.0 - 2.0 * done)) as f32 } else { 0.0 }
    }
}
