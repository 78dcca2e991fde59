//! Small filters whose coefficients move without a click, and values that glide.

use crate::head::SPEED_OF_SOUND_M_S;
use crate::{RATE_HZ, SLICE};

/// Added to what filters hear: states never sink into denormal numbers, which processors are slow with. -360 dB.
pub(crate) const BIAS: f32 = 1.0e-18;

/// The frequency at which dulling is told, hertz.
pub const DULLED_AT_HZ: f32 = 4000.0;

/// What air takes at [`DULLED_AT_HZ`], decibels a metre: ISO 9613-1:1993 for 20 degrees Celsius and half the humidity that air can
/// hold says 0.0297.
pub const AIR_DB_PER_M: f32 = 0.03;

/// What a monument in the way takes from all frequencies, decibels, where nothing of the source is seen.
///
/// Z. Maekawa, "Noise reduction by screens", Applied Acoustics 1, 1968: an edge that makes the way half a metre longer takes
/// 12 dB at 200 Hz and 24 dB at 4 kHz.
pub const OCCLUDED_DB: f32 = 12.0;

/// What it takes at [`DULLED_AT_HZ`] beyond [`OCCLUDED_DB`], decibels.
pub const OCCLUDED_TREBLE_DB: f32 = 12.0;

/// Decibels as a factor of amplitude.
#[must_use]
pub fn gain_from_db(db: f32) -> f32 {
    libm::exp2f(db * (std::f32::consts::LOG2_10 / 20.0))
}

/// The coefficient `a` of the one-pole low-pass `y += (1 - a) (x - y)` that takes `db` (0 or more) at [`DULLED_AT_HZ`] exactly and
/// nothing at 0 Hz. In [0, 1).
#[must_use]
pub fn dull_coefficient(db: f32) -> f32 {
    if db < 1.0e-3 {
        return 0.0;
    }
    // (1 - a)^2 = g^2 (1 - 2 a cos w + a^2), solved for the root below 1
    let power = gain_from_db(-2.0 * db.min(80.0));
    let cosine = libm::cosf(std::f32::consts::TAU * DULLED_AT_HZ / RATE_HZ as f32);
    let (square, half) = (1.0 - power, 1.0 - power * cosine);
    ((half - (half * half - square * square).max(0.0).sqrt()) / square).clamp(0.0, 0.9999)
}

/// The level that such a filter leaves at a frequency.
#[must_use]
pub fn dull_response(coefficient: f32, frequency_hz: f32) -> f32 {
    let cosine = libm::cosf(std::f32::consts::TAU * frequency_hz / RATE_HZ as f32);
    let a = coefficient;
    (1.0 - a) / (1.0 - 2.0 * a * cosine + a * a).sqrt()
}

/// A value that moves in a straight line within a slice.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Line {
    pub(crate) from: f32,
    pub(crate) step: f32,
}

impl Line {
    #[inline]
    pub(crate) fn at(&self, frame: usize) -> f32 {
        self.from + self.step * (frame + 1) as f32
    }
}

/// A value that follows what it is told, critically damped: neither it nor its speed ever jumps by what could be heard.
///
/// Two equal low-passes one after the other, worked out once a slice. With 20 milliseconds each it is 40 behind one that moves
/// evenly, and smooth though it is told only 60 times a second.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Glide {
    first: f32,
    value: f32,
}

impl Glide {
    pub(crate) fn at(value: f32) -> Self {
        Self { first: value, value }
    }

    pub(crate) fn value(&self) -> f32 {
        self.value
    }

    /// The next slice on the way to `target`, with what [`glide_rate`] gives.
    #[inline]
    pub(crate) fn slice(&mut self, target: f32, rate: f32) -> Line {
        let from = self.value;
        self.first += (target - self.first) * rate;
        self.value += (self.first - self.value) * rate;
        // so near that a float's rounding is all that is left: it arrives
        if (self.value - target).abs() <= target.abs() * 4.0e-6 + 1.0e-9 {
            (self.first, self.value) = (target, target);
        }
        Line { from, step: (self.value - from) / SLICE as f32 }
    }
}

/// What a [`Glide`] does in a slice whose low-passes have this time constant.
pub(crate) fn glide_rate(seconds: f32) -> f32 {
    1.0 - libm::expf(-(SLICE as f32) / (seconds * RATE_HZ as f32))
}

/// A one-pole low-pass: air, and what stands in the way.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Dull {
    state: f32,
}

impl Dull {
    #[inline]
    pub(crate) fn next(&mut self, coefficient: f32, sample: f32) -> f32 {
        self.state = (sample + BIAS) + (self.state - sample) * coefficient;
        self.state
    }
}

/// The head's shadow: Brown and Duda's filter by the bilinear transform.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Shadow {
    heard: f32,
    state: f32,
}

/// The bilinear transform's constants for a head of some radius: `p = w0 / rate`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ShadowPole {
    /// `p / (p + 1)`, `1 / (p + 1)` and `(p - 1) / (p + 1)`.
    low: f32,
    high: f32,
    back: f32,
}

impl ShadowPole {
    pub(crate) fn new(radius_m: f32) -> Self {
        let p = SPEED_OF_SOUND_M_S / (radius_m * RATE_HZ as f32);
        Self { low: p / (p + 1.0), high: 1.0 / (p + 1.0), back: (p - 1.0) / (p + 1.0) }
    }
}

impl Shadow {
    /// `alpha` as [`crate::head::shadow`] gives it.
    #[inline]
    pub(crate) fn next(&mut self, pole: &ShadowPole, alpha: f32, sample: f32) -> f32 {
        // s = 2 rate (1 - z) / (1 + z): ((p + alpha) + (p - alpha) z) / ((p + 1) + (p - 1) z)
        let (sample, high) = (sample + BIAS, alpha * pole.high);
        let y = (pole.low + high) * sample + (pole.low - high) * self.heard - pole.back * self.state;
        (self.heard, self.state) = (sample, y);
        y
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dulling_is_exact_at_four_kilohertz_and_nothing_at_the_bottom() {
        for db in [0.1, 1.0, 3.0, 12.0, 30.0] {
            let a = dull_coefficient(db);
            assert!((20.0 * dull_response(a, 4000.0).log10() + db).abs() < 0.02, "{db}");
            assert!(dull_response(a, 20.0) > 0.98);
        }
        assert_eq!(dull_coefficient(0.0), 0.0);
        assert!(dull_coefficient(1e9) < 1.0);
    }

    #[test]
    fn a_glide_arrives_and_stays() {
        let rate = glide_rate(0.02);
        let mut glide = Glide::at(1.0);
        for _ in 0..1000 {
            glide.slice(3.0, rate);
        }
        assert_eq!(glide.value(), 3.0);
        assert_eq!(glide.slice(3.0, rate).step, 0.0);
    }

    #[test]
    fn the_shadow_has_its_levels_at_both_ends() {
        let pole = ShadowPole::new(0.0875);
        let (mut low, mut high) = (Shadow::default(), Shadow::default());
        let (mut at_rest, mut peak) = (0.0, 0.0_f32);
        for k in 0..2000 {
            at_rest = low.next(&pole, 0.3, 1.0);
            let y = high.next(&pole, 0.3, if k % 2 == 0 { 1.0 } else { -1.0 });
            peak = if k > 1000 { peak.max(y.abs()) } else { 0.0 };
        }
        assert!((at_rest - 1.0).abs() < 1e-4 && (peak - 0.3).abs() < 1e-3, "{at_rest} {peak}");
    }
}
