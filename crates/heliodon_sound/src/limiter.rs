//! The end of the mixer: nothing leaves it louder than [`CEILING`], and what is softer leaves it as it was, to the bit.
//!
//! It looks 64 samples ahead. The gain that each sample needs is held for as long (a sliding minimum), let go slowly, and averaged
//! over the same 64: whatever sample comes out, every gain in its average was at most the one that it needs.

use crate::{RATE_HZ, SLICE};
use std::collections::VecDeque;

/// The loudest sample that leaves: -0.3 dB, so that converters which read between samples do not clip either.
pub const CEILING: f32 = 0.966;

/// Samples that it looks ahead, and is late by, less one.
const LOOK: usize = SLICE;

/// How late it is.
pub(crate) const LIMITER_LATENCY: usize = LOOK - 1;

/// The time constant in which it lets go, seconds.
const RELEASE_S: f64 = 0.12;

/// See the module.
#[derive(Debug)]
pub(crate) struct Limiter {
    late: [[f32; 2]; LOOK],
    at: usize,
    /// The minimum's candidates: when (sample number) and how much, rising.
    least: VecDeque<(u64, f32)>,
    gains: [f64; LOOK],
    sum: f64,
    /// In double precision: in single it would stop short of 1.
    released: f64,
    release: f64,
    count: u64,
}

impl Limiter {
    pub(crate) fn new() -> Self {
        Self {
            late: [[0.0; 2]; LOOK],
            at: 0,
            // one more than it ever holds: it never allocates again
            least: VecDeque::with_capacity(LOOK + 1),
            gains: [1.0; LOOK],
            sum: LOOK as f64,
            released: 1.0,
            release: 1.0 - libm::exp(-1.0 / (RELEASE_S * f64::from(RATE_HZ))),
            count: 0,
        }
    }

    /// The next sample of both ears in, the one of [`LIMITER_LATENCY`] samples ago out.
    #[inline]
    pub(crate) fn next(&mut self, ears: [f32; 2]) -> [f32; 2] {
        // what is no number is silence: nothing that is heard may depend on it
        let ears = ears.map(|ear| if ear.is_finite() { ear } else { 0.0 });
        let peak = ears[0].abs().max(ears[1].abs());
        let needed = if peak > CEILING { CEILING / peak } else { 1.0 };
        while self.least.back().is_some_and(|(_, gain)| *gain >= needed) {
            self.least.pop_back();
        }
        self.least.push_back((self.count, needed));
        while self.least.front().is_some_and(|(when, _)| when + LOOK as u64 <= self.count) {
            self.least.pop_front();
        }
        let held = self.least.front().map_or(1.0, |(_, gain)| f64::from(*gain));
        self.released += (1.0 - self.released) * self.release;
        // so near 1 that only rounding is left
        self.released = if self.released > 0.999_999 { 1.0 } else { self.released }.min(held);
        let gain = self.released;
        self.sum += gain - self.gains[self.at];
        self.gains[self.at] = gain;
        self.late[self.at] = ears;
        self.at = (self.at + 1) % LOOK;
        self.count += 1;
        let out = self.late[self.at];
        let mean = (self.sum / LOOK as f64) as f32;
        let gain = if mean >= 0.999_999 { 1.0 } else { mean };
        out.map(|ear| (ear * gain).clamp(-CEILING, CEILING))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use heliodon_math::random::Pcg32;

    #[test]
    fn nothing_is_ever_louder_than_the_ceiling() {
        let (mut limiter, mut random) = (Limiter::new(), Pcg32::new(3, 0));
        for k in 0..200_000_u32 {
            let loud = if k % 7919 < 50 { 1.0e4 } else { 1.5 };
            let odd = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX][(k % 4) as usize];
            let left = if k % 1000 == 0 { odd } else { random.range_f32(-loud, loud) };
            let out = limiter.next([left, random.range_f32(-loud, loud)]);
            assert!(out.iter().all(|ear| ear.abs() <= CEILING), "{k}: {out:?}");
        }
    }

    #[test]
    fn what_is_soft_leaves_as_it_came_also_after_something_loud() {
        let (mut limiter, mut random) = (Limiter::new(), Pcg32::new(4, 0));
        let input: Vec<f32> = (0..200_000).map(|k| random.range_f32(-0.9, 0.9) * if k == 500 { 30.0 } else { 1.0 }).collect();
        let out: Vec<f32> = input.iter().map(|s| limiter.next([*s, -*s])[0]).collect();
        assert_eq!(out[LIMITER_LATENCY..400], input[..400 - LIMITER_LATENCY]);
        assert_eq!(out[150_000..], input[150_000 - LIMITER_LATENCY..200_000 - LIMITER_LATENCY]);
    }

    #[test]
    fn a_loud_tone_is_bent_not_broken() {
        let mut limiter = Limiter::new();
        let step = std::f32::consts::TAU * 200.0 / RATE_HZ as f32;
        let out: Vec<f32> = (0..48_000).map(|k| limiter.next([(step * k as f32).sin() * 4.0; 2])[0]).collect();
        // from where the tone has come through: its first sample is a corner
        let bend = out[2 * LOOK..].windows(3).map(|w| (w[0] - 2.0 * w[1] + w[2]).abs()).fold(0.0, f32::max);
        // a clean tone of that level bends by step^2
        assert!(bend < 4.0 * step * step * CEILING, "{bend} {}", step * step);
    }
}
