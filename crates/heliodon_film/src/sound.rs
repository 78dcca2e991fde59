//! The sound of a film, from the same zero of time as its pictures.

use crate::frames::{Stopper, seek};
use crate::process::{self, Reins};
use crate::{Film, FilmError};
use std::io::Read;
use std::process::ChildStdout;
use std::sync::Arc;
use std::thread::JoinHandle;

/// Reads a film's sound as interleaved samples.
///
/// Sample 0 belongs to the time that was asked for: where the sound begins later than the pictures, there is silence before it, and gaps in
/// its times are filled with silence, so that it never runs ahead of them.
#[derive(Debug)]
pub struct SoundReader {
    reins: Arc<Reins>,
    name: u64,
    stdout: ChildStdout,
    complaints: Option<JoinHandle<String>>,
    rate_hz: u32,
    channels: u32,
    /// Bytes of a sample that came in two pieces.
    rest: Vec<u8>,
}

impl SoundReader {
    /// Starts a decoder at `start_s` seconds that delivers `rate_hz` samples a second in `channels` channels; `None` where the film is silent.
    ///
    /// # Errors
    /// If there is no `ffmpeg`.
    pub fn open(film: &Film, start_s: f64, rate_hz: u32, channels: u32) -> Result<Option<Self>, FilmError> {
        if film.sound.is_none() {
            return Ok(None);
        }
        let (rate_hz, channels) = (rate_hz.max(1), channels.max(1));
        let mut command = process::command("ffmpeg");
        command.arg("-nostdin").args(seek(start_s)).args(process::input(&film.path));
        command.args(["-map", "0:a:0", "-vn", "-sn", "-dn", "-af", "aresample=async=1:first_pts=0"]);
        command.args(["-ar", &rate_hz.to_string(), "-ac", &channels.to_string(), "-f", "f32le", "pipe:1"]);
        let mut child = process::spawn(&mut command, "ffmpeg")?;
        let complaints = Some(process::listen(child.stderr.take()));
        let stdout = child.stdout.take();
        let reins = Reins::new();
        let name = reins.adopt(child);
        let stdout = stdout.ok_or_else(|| FilmError::Program { program: "ffmpeg", problem: "it has no output".into() })?;
        Ok(Some(Self { reins, name, stdout, complaints, rate_hz, channels, rest: Vec::new() }))
    }

    /// Samples a second.
    #[must_use]
    pub fn rate_hz(&self) -> u32 {
        self.rate_hz
    }

    /// Channels, whose samples take turns.
    #[must_use]
    pub fn channels(&self) -> u32 {
        self.channels
    }

    /// Ends this reader from elsewhere.
    #[must_use]
    pub fn stopper(&self) -> Stopper {
        Stopper::of(self.reins.clone())
    }

    /// Fills `samples` from the front, nominally in [-1, 1]; how many there are. Less than asked for is the end.
    pub fn read(&mut self, samples: &mut [f32]) -> usize {
        let mut bytes = std::mem::take(&mut self.rest);
        let wanted = size_of_val(samples);
        let mut filled = bytes.len().min(wanted);
        bytes.resize(wanted, 0);
        while filled < wanted {
            match self.stdout.read(&mut bytes[filled..]) {
                Ok(0) => break,
                Ok(count) => filled += count,
                Err(error) if error.kind() == std::io::ErrorKind::Interrupted => {}
                Err(_) => break,
            }
        }
        let whole = filled / size_of::<f32>();
        for (sample, raw) in samples.iter_mut().zip(bytes[..whole * size_of::<f32>()].as_chunks::<4>().0) {
            *sample = f32::from_le_bytes(*raw);
        }
        self.rest = bytes[whole * size_of::<f32>()..filled].to_vec();
        whole
    }
}

impl Drop for SoundReader {
    fn drop(&mut self) {
        self.reins.end(self.name);
        if let Some(complaints) = self.complaints.take() {
            let _ = complaints.join();
        }
    }
}
