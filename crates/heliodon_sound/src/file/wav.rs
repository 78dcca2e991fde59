//! WAV, 16 bits: what the commands write and every program reads.

use crate::RATE_HZ;
use heliodon_math::random::Pcg32;
use std::io::Write;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// A file that cannot be written.
#[derive(Debug, Error)]
#[error("{path}: {source}; is there space, and may it be written?")]
pub struct WavError {
    /// Which.
    pub path: PathBuf,
    /// Why.
    pub source: std::io::Error,
}

/// Interleaved samples as a WAV file of 16 bits at [`RATE_HZ`]: the same bytes for the same samples. With triangular dither of one step,
/// the same each time, so that what fades does not crackle; silence stays silence. Beyond full scale it is cut.
#[must_use]
pub fn wav_bytes(samples: &[f32], channels: usize) -> Vec<u8> {
    let data = (samples.len() * 2).min(u32::MAX as usize - 36) as u32;
    let frame = channels as u32 * 2;
    let mut bytes = Vec::with_capacity(44 + data as usize);
    bytes.extend(b"RIFF");
    bytes.extend((36 + data).to_le_bytes());
    bytes.extend(b"WAVEfmt ");
    bytes.extend(16_u32.to_le_bytes());
    bytes.extend(1_u16.to_le_bytes());
    bytes.extend((channels as u16).to_le_bytes());
    bytes.extend(RATE_HZ.to_le_bytes());
    bytes.extend((RATE_HZ * frame).to_le_bytes());
    bytes.extend((frame as u16).to_le_bytes());
    bytes.extend(16_u16.to_le_bytes());
    bytes.extend(b"data");
    bytes.extend(data.to_le_bytes());
    let mut random = Pcg32::new(16, 0);
    for sample in &samples[..data as usize / 2] {
        let dither = random.next_f32() - random.next_f32();
        let code = if *sample == 0.0 || !sample.is_finite() { 0.0 } else { (sample * 32767.0 + dither).round() };
        bytes.extend((code.clamp(-32768.0, 32767.0) as i16).to_le_bytes());
    }
    bytes
}

/// Writes [`wav_bytes`].
///
/// # Errors
///
/// Where it cannot be written.
pub fn write_wav(path: &Path, samples: &[f32], channels: usize) -> Result<(), WavError> {
    let failed = |source| WavError { path: path.to_owned(), source };
    let mut file = std::fs::File::create(path).map_err(failed)?;
    file.write_all(&wav_bytes(samples, channels)).map_err(failed)
}
