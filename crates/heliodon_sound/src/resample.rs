//! From any sample rate to any other: a sine windowed by Kaiser's window, 32 zero crossings to each side.
//!
//! Julius O. Smith, "Digital Audio Resampling Home Page", CCRMA, 2002: what is above the lower of both rates' halves is cut off
//! before it folds back. Places are counted in whole numbers, so a film of hours does not drift.

use crate::kernel::{kaiser, sinc};
use thiserror::Error;

/// Zero crossings to each side. More: a steeper edge, more time.
const CROSSINGS: usize = 32;
/// Entries of the table from one zero crossing to the next; between them it is interpolated.
const STEPS: usize = 512;
/// Kaiser's beta: 90 dB down beyond the edge.
const BETA: f64 = 9.0;
/// The edge against half of the lower rate: what lies between folds back from beyond hearing only.
const EDGE: f64 = 0.94;
/// With so many different phases or fewer their weights are worked out once.
const KEPT_PHASES: u64 = 1024;

/// Rates that can be converted, hertz.
pub const RATES_HZ: std::ops::RangeInclusive<u32> = 1000..=768_000;

/// A rate that no sound has.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
#[error("a sample rate of {0} Hz; give one from 1,000 to 768,000")]
pub struct RateError(pub u32);

/// Converts as sound comes.
#[derive(Debug)]
pub struct Resampler {
    channels: usize,
    /// Both rates without their common divisor.
    from: u64,
    to: u64,
    /// The next output's place: `whole + part / to` input frames from the first of `history`.
    part: u64,
    history: Vec<f32>,
    /// Input frames to each side of a place that take part.
    half: usize,
    scale: f64,
    table: Vec<f32>,
    kept: Vec<Option<Box<[f32]>>>,
    fresh: Vec<f32>,
    first: usize,
}

fn divisor(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { divisor(b, a % b) }
}

impl Resampler {
    /// From one rate to another, of interleaved frames with at least one channel.
    ///
    /// # Errors
    ///
    /// Rates outside [`RATES_HZ`].
    pub fn new(from_hz: u32, to_hz: u32, channels: usize) -> Result<Self, RateError> {
        if let Some(rate) = [from_hz, to_hz].into_iter().find(|rate| !RATES_HZ.contains(rate)) {
            return Err(RateError(rate));
        }
        let common = divisor(from_hz.into(), to_hz.into());
        let (from, to) = (u64::from(from_hz) / common, u64::from(to_hz) / common);
        let scale = (f64::from(to_hz) / f64::from(from_hz)).min(1.0) * EDGE;
        let half = (CROSSINGS as f64 / scale).ceil() as usize;
        let table = (0..=CROSSINGS * STEPS + 1).map(|k| {
            let x = k as f64 / STEPS as f64;
            (sinc(x) * kaiser(x / CROSSINGS as f64, BETA)) as f32
        });
        let kept = if to <= KEPT_PHASES { vec![None; to as usize] } else { Vec::new() };
        let channels = channels.max(1);
        // as much silence as stands before the first frame
        let history = vec![0.0; half * channels];
        Ok(Self {
            channels,
            from,
            to,
            part: 0,
            history,
            half,
            scale,
            table: table.collect(),
            kept,
            fresh: Vec::new(),
            first: half,
        })
    }

    /// Whether there is nothing to do.
    #[must_use]
    pub fn is_identity(&self) -> bool {
        self.from == self.to
    }

    /// How many frames come out for so many, at most.
    #[must_use]
    pub fn most_frames(&self, frames: usize) -> usize {
        (frames as u64 * self.to / self.from) as usize + 2
    }

    /// Takes whole frames, and appends those that can be told by now: it is 32 zero crossings behind.
    pub fn push(&mut self, input: &[f32], out: &mut Vec<f32>) {
        if self.is_identity() {
            out.extend_from_slice(input);
            return;
        }
        self.history.extend_from_slice(input);
        while (self.first + self.half + 1) * self.channels <= self.history.len() {
            self.frame(out);
            self.part += self.from;
            self.first += (self.part / self.to) as usize;
            self.part %= self.to;
        }
        // what lies behind for good goes; in large steps, for it moves the rest
        let behind = self.first.saturating_sub(self.half).min(self.history.len() / self.channels);
        if behind > 4096 {
            self.history.drain(..behind * self.channels);
            self.first -= behind;
        }
    }

    /// The last frames, with silence after them: in all `ceil(frames in x to / from)`.
    pub fn finish(&mut self, out: &mut Vec<f32>) {
        if !self.is_identity() {
            self.push(&vec![0.0; self.half * self.channels], out);
        }
    }

    fn frame(&mut self, out: &mut Vec<f32>) {
        let start = (self.first + 1 - self.half) * self.channels;
        let window = &self.history[start..start + 2 * self.half * self.channels];
        let (half, scale, fraction) = (self.half, self.scale, self.part as f64 / self.to as f64);
        let weigh = |into: &mut Vec<f32>, table: &[f32]| {
            into.clear();
            into.extend((0..2 * half).map(|tap| {
                let x = ((tap as f64 - (half as f64 - 1.0) - fraction) * scale).abs() * STEPS as f64;
                let (row, t) = ((x as usize).min(CROSSINGS * STEPS), (x - x.floor()) as f32);
                (table[row] + (table[row + 1] - table[row]) * t) * scale as f32
            }));
        };
        let weights: &[f32] = match self.kept.get_mut(self.part as usize) {
            Some(kept) => kept.get_or_insert_with(|| {
                weigh(&mut self.fresh, &self.table);
                self.fresh.clone().into_boxed_slice()
            }),
            None => {
                weigh(&mut self.fresh, &self.table);
                &self.fresh
            }
        };
        for channel in 0..self.channels {
            let samples = window[channel..].iter().step_by(self.channels);
            out.push(weights.iter().zip(samples).map(|(w, s)| w * s).sum());
        }
    }
}

/// A whole sound at another rate.
///
/// # Errors
///
/// Rates outside [`RATES_HZ`].
pub fn resample(samples: &[f32], channels: usize, from_hz: u32, to_hz: u32) -> Result<Vec<f32>, RateError> {
    let mut resampler = Resampler::new(from_hz, to_hz, channels)?;
    let mut out = Vec::with_capacity(resampler.most_frames(samples.len()));
    resampler.push(samples, &mut out);
    resampler.finish(&mut out);
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    fn tone(hz: f64, rate: u32, seconds: f64) -> Vec<f32> {
        (0..(f64::from(rate) * seconds) as usize).map(|k| (TAU * hz * k as f64 / f64::from(rate)).sin() as f32 * 0.5).collect()
    }

    #[test]
    fn tones_stay_what_they_were_from_every_usual_rate() {
        for rate in [8000, 11_025, 16_000, 22_050, 32_000, 44_100, 88_200, 96_000, 192_000, 44_101] {
            for hz in [100.0, 1000.0, f64::from(rate).min(48_000.0) * 0.4] {
                let out = resample(&tone(hz, rate, 0.5), 1, rate, 48_000).expect("a rate");
                assert!((out.len() as i64 - 24_000).abs() <= 2, "{rate}: {}", out.len());
                let expected = tone(hz, 48_000, 0.5);
                let error = out[4000..20_000].iter().zip(&expected[4000..]).map(|(a, b)| f64::from(a - b).powi(2)).sum::<f64>()
                    / 16_000.0;
                let snr_db = 10.0 * (0.125 / error).log10();
                assert!(snr_db > 80.0, "{rate} Hz, a tone of {hz}: {snr_db:.1} dB");
            }
        }
    }

    #[test]
    fn what_the_lower_rate_cannot_hold_is_gone() {
        let out = resample(&tone(30_000.0, 96_000, 0.5), 1, 96_000, 48_000).expect("a rate");
        let loudest = out[4000..20_000].iter().fold(0.0_f32, |a, b| a.max(b.abs()));
        assert!(loudest < 0.5 * 1e-4, "{loudest}");
    }

    #[test]
    fn parts_make_the_same_bits_as_the_whole() {
        let whole = tone(440.0, 44_100, 0.4);
        let mut resampler = Resampler::new(44_100, 48_000, 2).expect("rates");
        let mut out = Vec::new();
        let mut rest: &[f32] = &whole;
        for size in [2, 1000, 64, 4096, 10_000].into_iter().cycle() {
            let (now, later) = rest.split_at(size.min(rest.len()));
            resampler.push(now, &mut out);
            rest = later;
            if rest.is_empty() {
                break;
            }
        }
        resampler.finish(&mut out);
        assert_eq!(out, resample(&whole, 2, 44_100, 48_000).expect("rates"));
        assert_eq!(Resampler::new(0, 48_000, 1).err(), Some(RateError(0)));
    }
}
