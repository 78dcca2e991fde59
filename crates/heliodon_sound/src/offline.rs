//! The mixer without a device: for tests, and for films, whose sound is rendered picture by picture.

use crate::RATE_HZ;
use crate::control::{Control, ControlError};
use crate::file::{WavError, write_wav};
use crate::mixer::{Mixer, MixerSettings};
use std::path::Path;

/// A mixer, what it is told by, and what has been heard.
#[derive(Debug)]
pub struct OffLine {
    /// Tells it what to do.
    pub control: Control,
    mixer: Mixer,
    samples: Vec<f32>,
    /// Frames that were to be rendered, with the fractions that pictures leave.
    due: f64,
}

impl OffLine {
    /// A mixer of its own.
    #[must_use]
    pub fn new(settings: &MixerSettings) -> Self {
        let (control, mixer) = settings.build();
        Self { control, mixer, samples: Vec::new(), due: 0.0 }
    }

    /// Renders so many frames more.
    pub fn advance_frames(&mut self, frames: usize) {
        let before = self.samples.len();
        self.samples.resize(before + frames * 2, 0.0);
        self.mixer.render(&mut self.samples[before..]);
        self.due += frames as f64;
        self.control.collect();
    }

    /// Renders so many seconds more; what is left of a frame is rendered with the next: sixty pictures make a second.
    pub fn advance(&mut self, seconds: f64) {
        let done = self.due.floor();
        let due = self.due + seconds.clamp(0.0, 3600.0) * f64::from(RATE_HZ);
        // 1.0e-6: sixty times a sixtieth of a second is a second
        let frames = (due + 1.0e-6).floor() - done;
        self.advance_frames(frames as usize);
        self.due = due;
    }

    /// Renders `seconds`, and before each step of `step_s` lets `told` say what changes at that time.
    ///
    /// # Errors
    ///
    /// What `told` returns.
    pub fn script(
        &mut self,
        seconds: f64,
        step_s: f64,
        mut told: impl FnMut(f64, &mut Control) -> Result<(), ControlError>,
    ) -> Result<(), ControlError> {
        let steps = (seconds / step_s.max(1.0e-4)).round() as usize;
        for step in 0..steps {
            told(step as f64 * step_s, &mut self.control)?;
            self.advance(step_s);
        }
        Ok(())
    }

    /// Everything that was rendered and not taken, left and right interleaved.
    #[must_use]
    pub fn samples(&self) -> &[f32] {
        &self.samples
    }

    /// The same, taken: a picture's worth, for a film.
    pub fn take(&mut self) -> Vec<f32> {
        std::mem::take(&mut self.samples)
    }

    /// One ear of it: 0 left, 1 right.
    #[must_use]
    pub fn ear(&self, ear: usize) -> Vec<f32> {
        self.samples.iter().skip(ear.min(1)).step_by(2).copied().collect()
    }

    /// Writes it as WAV.
    ///
    /// # Errors
    ///
    /// Where it cannot be written.
    pub fn write_wav(&self, path: &Path) -> Result<(), WavError> {
        write_wav(path, &self.samples, 2)
    }
}
