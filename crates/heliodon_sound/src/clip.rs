//! A sound in memory.

use crate::RATE_HZ;
use thiserror::Error;

/// The longest sound that is kept in memory, seconds: 115 MB of a stereo one. Longer ones are [streamed](crate::stream).
pub const LONGEST_CLIP_S: f64 = 300.0;

/// Mono or stereo samples at [`RATE_HZ`]; every one of them finite.
#[derive(Clone, Debug, PartialEq)]
pub struct Clip {
    channels: usize,
    samples: Vec<f32>,
    rms: f32,
}

/// Why samples are no clip.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum ClipError {
    /// Neither mono nor stereo.
    #[error("a sound of {0} channels cannot be placed; mix it down to one or two")]
    Channels(usize),
    /// Nothing to hear.
    #[error("a sound without a single frame; leave it out")]
    Empty,
    /// Half a frame at the end.
    #[error("{samples} samples are no whole number of frames of {channels} channels; cut it where a frame ends")]
    Uneven {
        /// How many there are.
        samples: usize,
        /// Of so many channels.
        channels: usize,
    },
    /// A sample that is no number.
    #[error("sample {at} of a sound is {value}; write the sound again with finite samples")]
    NotFinite {
        /// Which, from 0.
        at: usize,
        /// What it is.
        value: f32,
    },
    /// More than memory should hold.
    #[error("a sound of {seconds:.0} s; sounds in memory end at {LONGEST_CLIP_S} s: stream it")]
    TooLong {
        /// How long it is.
        seconds: f64,
    },
}

impl Clip {
    /// A clip of interleaved samples at [`RATE_HZ`], of one or two channels.
    ///
    /// # Errors
    ///
    /// What [`ClipError`] lists.
    pub fn new(samples: Vec<f32>, channels: usize) -> Result<Self, ClipError> {
        if !(1..=2).contains(&channels) {
            return Err(ClipError::Channels(channels));
        }
        if samples.is_empty() {
            return Err(ClipError::Empty);
        }
        if !samples.len().is_multiple_of(channels) {
            return Err(ClipError::Uneven { samples: samples.len(), channels });
        }
        let seconds = (samples.len() / channels) as f64 / f64::from(RATE_HZ);
        if seconds > LONGEST_CLIP_S {
            return Err(ClipError::TooLong { seconds });
        }
        if let Some((at, value)) = samples.iter().enumerate().find(|(_, sample)| !sample.is_finite()) {
            return Err(ClipError::NotFinite { at, value: *value });
        }
        let power = samples.iter().map(|s| f64::from(*s) * f64::from(*s)).sum::<f64>() / samples.len() as f64;
        Ok(Self { channels, samples, rms: power.sqrt() as f32 })
    }

    /// 1 or 2.
    #[must_use]
    pub fn channels(&self) -> usize {
        self.channels
    }

    /// Interleaved.
    #[must_use]
    pub fn samples(&self) -> &[f32] {
        &self.samples
    }

    /// How many frames: samples of each channel.
    #[must_use]
    pub fn frames(&self) -> usize {
        self.samples.len() / self.channels
    }

    /// How long it is.
    #[must_use]
    pub fn seconds(&self) -> f64 {
        self.frames() as f64 / f64::from(RATE_HZ)
    }

    /// The root of the mean power of its samples.
    #[must_use]
    pub fn rms(&self) -> f32 {
        self.rms
    }

    /// Its loudest sample.
    #[must_use]
    pub fn peak(&self) -> f32 {
        self.samples.iter().fold(0.0, |peak, sample| peak.max(sample.abs()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_sound_is_refused() {
        assert_eq!(Clip::new(vec![], 1), Err(ClipError::Empty));
        assert_eq!(Clip::new(vec![0.0; 3], 2), Err(ClipError::Uneven { samples: 3, channels: 2 }));
        assert_eq!(Clip::new(vec![0.0; 6], 6), Err(ClipError::Channels(6)));
        assert!(matches!(Clip::new(vec![0.0, f32::NAN], 1), Err(ClipError::NotFinite { at: 1, .. })));
        let clip = Clip::new(vec![0.5, -0.5], 1).expect("a clip");
        assert_eq!((clip.frames(), clip.rms(), clip.peak()), (2, 0.5, 0.5));
    }
}
