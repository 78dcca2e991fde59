//! The One Euro filter: a low-pass that is slow where the hand is still and quick where it moves.
//!
//! Géry Casiez, Nicolas Roussel, Daniel Vogel: "1€ Filter: A Simple Speed-based Low-pass Filter for Noisy Input in Interactive
//! Systems", CHI 2012. For the quantities of their Algorithm 1: the derivative is taken between raw values, as their own C++
//! does, and both low-passes are written so that no time step divides by zero; reports that arrive in one burst do no harm
//! then.
//!
//! Why not a Kalman filter: its constant-velocity form has the same two poles at a fixed pace, and its noises are harder to set
//! by trying than "how much may it tremble" and "how much may it lag" are.

use crate::rotation;
use crate::settings::{SettingsError, within};
use glam::{Quat, Vec3};
use serde::{Deserialize, Serialize};
use std::f32::consts::TAU;

/// How strongly to smooth.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OneEuro {
    /// The cutoff where nothing moves, Hz, from 0.001 to 1e6 (`fcmin`). Less: stiller at rest, and slower to start. More:
    /// trembles with the tracker's noise.
    pub min_cutoff_hz: f32,
    /// How much the cutoff rises with the speed: Hz for each metre a second, or radian a second; from 0 to 1e6 (`beta`). Less:
    /// lags behind quick movements. More: lets noise through sooner.
    pub beta: f32,
    /// The cutoff of the speed itself, Hz, from 0.001 to 1e6 (`dcutoff`). Less: takes longer to notice that a movement began.
    /// More: takes noise for movement.
    pub derivative_cutoff_hz: f32,
}

impl OneEuro {
    /// Lets everything through.
    pub const OFF: Self = Self { min_cutoff_hz: 1e6, beta: 0.0, derivative_cutoff_hz: 1.0 };

    pub(super) fn validate(&self) -> Result<(), SettingsError> {
        within("min_cutoff_hz", self.min_cutoff_hz, 1e-3, 1e6)?;
        within("beta", self.beta, 0.0, 1e6)?;
        within("derivative_cutoff_hz", self.derivative_cutoff_hz, 1e-3, 1e6)
    }

    /// How much of a new value is taken after `dt_s` at this speed: `alpha` of equation 4 with the cutoff of equation 5.
    fn gain(&self, speed: f32, dt_s: f32) -> f32 {
        let tau = time_constant(self.min_cutoff_hz + self.beta * speed);
        dt_s / (tau + dt_s)
    }
}

fn time_constant(cutoff_hz: f32) -> f32 {
    1.0 / (TAU * cutoff_hz)
}

/// A low-pass of how fast something changes.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Rate(pub(super) Vec3);

impl Rate {
    /// Takes a change within `dt_s`: `alpha (change / dt) + (1 - alpha) rate` with the time step multiplied out.
    pub(super) fn step(&mut self, change: Vec3, dt_s: f32, cutoff_hz: f32) {
        self.0 += (change - self.0 * dt_s) / (time_constant(cutoff_hz) + dt_s);
    }
}

/// A filtered position.
#[derive(Clone, Copy, Debug)]
pub(super) struct Position {
    pub(super) value: Vec3,
    raw: Vec3,
    rate: Rate,
}

impl Position {
    pub(super) fn new(raw: Vec3) -> Self {
        Self { value: raw, raw, rate: Rate::default() }
    }

    /// Takes the next raw value; answers how the filtered one changes.
    pub(super) fn step(&mut self, settings: &OneEuro, raw: Vec3, dt_s: f32) -> Vec3 {
        self.rate.step(raw - self.raw, dt_s, settings.derivative_cutoff_hz);
        self.raw = raw;
        let change = (raw - self.value) * settings.gain(self.rate.0.length(), dt_s);
        self.value += change;
        change
    }
}

/// A filtered orientation: the same on the rotations from one value to the next.
#[derive(Clone, Copy, Debug)]
pub(super) struct Orientation {
    pub(super) value: Quat,
    raw: Quat,
    rate: Rate,
}

impl Orientation {
    pub(super) fn new(raw: Quat) -> Self {
        Self { value: raw, raw, rate: Rate::default() }
    }

    /// Takes the next raw value; answers by which rotation the filtered one changes, axis times angle.
    pub(super) fn step(&mut self, settings: &OneEuro, raw: Quat, dt_s: f32) -> Vec3 {
        self.rate.step(rotation::to_vector(raw * self.raw.conjugate()), dt_s, settings.derivative_cutoff_hz);
        self.raw = raw;
        let gain = settings.gain(self.rate.0.length(), dt_s);
        let change = rotation::to_vector(raw * self.value.conjugate()) * gain;
        let turned = rotation::from_vector(change) * self.value;
        self.value = rotation::unit(turned).unwrap_or(raw);
        change
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use heliodon_math::random::Pcg32;

    const STILL: OneEuro = OneEuro { min_cutoff_hz: 1.0, beta: 0.0, derivative_cutoff_hz: 1.0 };
    const DT_S: f32 = 1.0 / 60.0;

    #[test]
    fn a_step_is_answered_as_a_low_pass_answers() {
        // after n steps 1 - (1 - alpha)^n is there, alpha = dt / (tau + dt)
        let mut filter = Position::new(Vec3::ZERO);
        for _ in 0..30 {
            filter.step(&STILL, Vec3::X, DT_S);
        }
        let alpha = DT_S / (1.0 / TAU + DT_S);
        assert!((filter.value.x - (1.0 - (1.0 - alpha).powi(30))).abs() < 1e-5);
    }

    #[test]
    fn the_cutoff_rises_with_the_speed() {
        let lag = |beta: f32| {
            let mut filter = Position::new(Vec3::ZERO);
            let settings = OneEuro { beta, ..STILL };
            for i in 1..=300 {
                filter.step(&settings, Vec3::X * (i as f32 * DT_S), DT_S);
            }
            300.0 * DT_S - filter.value.x
        };
        // at a metre a second a low-pass is behind by its time constant in metres
        assert!((lag(0.0) - 1.0 / TAU).abs() < 1e-3, "{}", lag(0.0));
        assert!((lag(9.0) - 0.1 / TAU).abs() < 1e-3, "{}", lag(9.0));
    }

    #[test]
    fn orientations_lag_and_settle_like_positions() {
        let turn = |angle: f32| rotation::from_vector(Vec3::Y * angle);
        let mut filter = Orientation::new(turn(0.0));
        for i in 1..=300 {
            filter.step(&STILL, turn(i as f32 * DT_S), DT_S);
        }
        let behind = rotation::to_vector(turn(300.0 * DT_S) * filter.value.conjugate());
        assert!((behind - Vec3::Y / TAU).length() < 1e-3, "{behind}");
        for _ in 0..600 {
            filter.step(&STILL, turn(1.0), DT_S);
        }
        assert!(rotation::to_vector(turn(1.0) * filter.value.conjugate()).length() < 1e-4);
    }

    #[test]
    fn a_burst_without_any_time_changes_little_and_breaks_nothing() {
        let mut rng = Pcg32::new(2, 2);
        let mut filter = Position::new(Vec3::ZERO);
        for _ in 0..1000 {
            let change = filter.step(&OneEuro { beta: 100.0, ..STILL }, Vec3::X * rng.range_f32(-0.01, 0.01), 0.0);
            assert!(change == Vec3::ZERO && filter.rate.0.is_finite());
        }
    }

    #[test]
    fn off_is_what_comes() {
        let mut filter = Position::new(Vec3::ZERO);
        filter.step(&OneEuro::OFF, Vec3::X, DT_S);
        assert!((filter.value.x - 1.0).abs() < 2e-5);
    }
}
