//! What sounds are drawn with: noise, filters, ringing bodies, and a loop in which everything wraps around.

use crate::RATE_HZ;
use heliodon_math::random::Pcg32;
use std::f64::consts::{PI, TAU};

pub(super) const RATE: f64 = RATE_HZ as f64;

/// A sound that is being made.
#[derive(Clone, Debug)]
pub(super) struct Canvas {
    pub(super) samples: Vec<f64>,
    /// Whether what runs over its end goes on at its beginning.
    pub(super) looping: bool,
}

/// A number evenly between two.
pub(super) fn between(random: &mut Pcg32, low: f64, high: f64) -> f64 {
    low + (high - low) * f64::from(random.next_f32())
}

/// The time to the next of events that come `rate` times a second on average, seconds.
pub(super) fn wait(random: &mut Pcg32, rate: f64) -> f64 {
    -libm::log(1.0 - f64::from(random.next_f32())) / rate
}

/// Samples in some seconds.
pub(super) fn frames(seconds: f64) -> usize {
    (seconds * RATE) as usize
}

/// White noise of unit range.
pub(super) fn noise(random: &mut Pcg32, count: usize) -> Vec<f64> {
    (0..count).map(|_| between(random, -1.0, 1.0)).collect()
}

/// A filter of second order: Robert Bristow-Johnson, "Cookbook formulae for audio EQ biquad filter coefficients".
#[derive(Clone, Copy, Debug)]
pub(super) struct Biquad {
    b: [f64; 3],
    a: [f64; 2],
    x: [f64; 2],
    y: [f64; 2],
}

/// Which frequencies a [`Biquad`] lets through.
#[derive(Clone, Copy, Debug)]
pub(super) enum Pass {
    Low,
    High,
    /// Around one, where its level stays as it is.
    Band,
}

impl Biquad {
    pub(super) fn new(pass: Pass, hz: f64, q: f64) -> Self {
        let w = TAU * (hz / RATE).clamp(1.0e-5, 0.49);
        let (sine, cosine) = libm::sincos(w);
        let alpha = sine / (2.0 * q);
        let b = match pass {
            Pass::Low => [(1.0 - cosine) / 2.0, 1.0 - cosine, (1.0 - cosine) / 2.0],
            Pass::High => [f64::midpoint(1.0, cosine), -(1.0 + cosine), f64::midpoint(1.0, cosine)],
            Pass::Band => [alpha, 0.0, -alpha],
        };
        let a0 = 1.0 + alpha;
        Self { b: b.map(|c| c / a0), a: [-2.0 * cosine / a0, (1.0 - alpha) / a0], x: [0.0; 2], y: [0.0; 2] }
    }

    pub(super) fn next(&mut self, x: f64) -> f64 {
        let Self { b, a, x: [x1, x2], y: [y1, y2] } = self;
        let y = b[0] * x + b[1] * *x1 + b[2] * *x2 - a[0] * *y1 - a[1] * *y2;
        (*x2, *x1, *y2, *y1) = (*x1, x, *y1, y);
        y
    }

    /// The same filter elsewhere, with what it holds: for formants that move.
    pub(super) fn moved(&self, pass: Pass, hz: f64, q: f64) -> Self {
        Self { x: self.x, y: self.y, ..Self::new(pass, hz, q) }
    }
}

/// `samples` through a filter.
pub(super) fn filtered(mut samples: Vec<f64>, pass: Pass, hz: f64, q: f64) -> Vec<f64> {
    let mut filter = Biquad::new(pass, hz, q);
    samples.iter_mut().for_each(|sample| *sample = filter.next(*sample));
    samples
}

/// One way in which a body rings.
#[derive(Clone, Copy, Debug)]
pub(super) struct Mode {
    pub(super) hz: f64,
    /// In this time it falls to a thousandth, seconds.
    pub(super) t60_s: f64,
    pub(super) level: f64,
}

/// A struck body.
pub(super) fn ring(modes: &[Mode], seconds: f64) -> Vec<f64> {
    let mut out = vec![0.0; frames(seconds)];
    for mode in modes.iter().filter(|mode| mode.hz < 0.45 * RATE) {
        let decay = libm::exp(-6.907_755 / (mode.t60_s * RATE));
        let (sine, cosine) = libm::sincos(TAU * mode.hz / RATE);
        let (mut re, mut im) = (0.0, mode.level);
        for sample in &mut out {
            *sample += re;
            (re, im) = ((re * cosine + im * sine) * decay, (im * cosine - re * sine) * decay);
        }
    }
    out
}

/// A burst of noise that rises in `rise_s` and falls to a thousandth in `fall_s`.
pub(super) fn burst(random: &mut Pcg32, rise_s: f64, fall_s: f64, level: f64) -> Vec<f64> {
    let rise = frames(rise_s).max(1);
    noise(random, rise + frames(fall_s))
        .into_iter()
        .enumerate()
        .map(|(k, sample)| {
            let envelope = if k < rise {
                k as f64 / rise as f64
            } else {
                libm::exp(-6.907_755 * (k - rise) as f64 / (fall_s * RATE).max(1.0))
            };
            sample * envelope * level
        })
        .collect()
}

impl Canvas {
    pub(super) fn new(seconds: f64, looping: bool) -> Self {
        Self { samples: vec![0.0; frames(seconds).max(1)], looping }
    }

    /// Adds a sound at a time.
    pub(super) fn add(&mut self, seconds: f64, sound: &[f64], level: f64) {
        let (start, length) = ((seconds.max(0.0) * RATE) as usize, self.samples.len());
        for (k, sample) in sound.iter().enumerate() {
            let at = start + k;
            if at < length {
                self.samples[at] += sample * level;
            } else if self.looping {
                self.samples[at % length] += sample * level;
            } else {
                return;
            }
        }
    }

    /// Its length, seconds.
    pub(super) fn seconds(&self) -> f64 {
        self.samples.len() as f64 / RATE
    }

    /// Noise over the whole of it, through filters, whose level follows a curve; a loop goes through them twice, so that they end as
    /// they began.
    pub(super) fn bed(&mut self, random: &mut Pcg32, filters: &[(Pass, f64, f64)], level: f64, curve: &[f64]) {
        let white = noise(random, self.samples.len());
        let mut filters: Vec<Biquad> = filters.iter().map(|(pass, hz, q)| Biquad::new(*pass, *hz, *q)).collect();
        let mut through = |sample: f64| filters.iter_mut().fold(sample, |sample, filter| filter.next(sample));
        if self.looping {
            white.iter().for_each(|sample| {
                through(*sample);
            });
        }
        for ((sample, white), curve) in self.samples.iter_mut().zip(&white).zip(curve) {
            *sample += through(*white) * level * curve;
        }
    }

    /// A curve in 0 to 1 that wanders, with about `hz` turns a second, and ends as it began.
    pub(super) fn drift(&self, random: &mut Pcg32, hz: f64) -> Vec<f64> {
        let knots = ((self.seconds() * hz) as usize).max(2);
        let values: Vec<f64> = (0..knots).map(|_| f64::from(random.next_f32())).collect();
        let step = knots as f64 / self.samples.len() as f64;
        (0..self.samples.len())
            .map(|k| {
                let at = k as f64 * step;
                let (knot, t) = (at as usize % knots, at - at.floor());
                let smooth = t * t * (3.0 - 2.0 * t);
                values[knot] + (values[(knot + 1) % knots] - values[knot]) * smooth
            })
            .collect()
    }

    /// Filters the whole of it.
    pub(super) fn filter(&mut self, pass: Pass, hz: f64, q: f64) {
        let mut filter = Biquad::new(pass, hz, q);
        if self.looping {
            self.samples.iter().for_each(|sample| {
                filter.next(*sample);
            });
        }
        self.samples.iter_mut().for_each(|sample| *sample = filter.next(*sample));
    }

    /// The last part of one that does not loop falls to nothing.
    pub(super) fn fade_out(&mut self, seconds: f64) {
        let (length, fade) = (self.samples.len(), frames(seconds).clamp(1, self.samples.len()));
        for (k, sample) in self.samples[length - fade..].iter_mut().enumerate() {
            *sample *= 0.5 + 0.5 * libm::cos(PI * (k + 1) as f64 / fade as f64);
        }
    }
}
