//! Sound files: WAV, Ogg Vorbis, FLAC and MP3, through Symphonia; and WAV written.

mod wav;

pub use wav::{WavError, wav_bytes, write_wav};

use crate::RATE_HZ;
use crate::clip::{Clip, ClipError, LONGEST_CLIP_S};
use crate::resample::{RATES_HZ, Resampler};
use std::fs::File;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use symphonia::core::codecs::audio::{AudioDecoder, AudioDecoderOptions};
use symphonia::core::errors::Error as DecodeError;
use symphonia::core::formats::probe::Hint;
use symphonia::core::formats::{FormatOptions, FormatReader, SeekMode, SeekTo, TrackType};
use symphonia::core::io::MediaSourceStream;
use symphonia::core::meta::MetadataOptions;
use symphonia::core::units::Time;
use thiserror::Error;

/// What is read, for messages.
const KNOWN: &str = "WAV, Ogg Vorbis, FLAC and MP3 are read: convert it to one of these";

/// A sample louder than this is no sample: full scale is 1.
const LOUDEST: f32 = 64.0;

/// Channels that a file may have; more than two are mixed down.
const MOST_CHANNELS: usize = 16;

/// Packets without a sample after which a file is taken to have none.
const MOST_EMPTY: usize = 10_000;

/// Why a file is not heard.
#[derive(Debug, Error)]
pub enum FileError {
    /// It cannot be opened or read.
    #[error("{path}: {source}; is the path right, and may it be read?")]
    Read {
        /// Which.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// It is no sound.
    #[error("{path}: no sound that can be read ({what}); {KNOWN}")]
    Unknown {
        /// Which.
        path: PathBuf,
        /// What was met.
        what: String,
    },
    /// It is damaged.
    #[error("{path}: damaged {seconds:.2} s from its beginning ({what}); save it again from its original")]
    Damaged {
        /// Which.
        path: PathBuf,
        /// Where.
        seconds: f64,
        /// What was met.
        what: String,
    },
    /// Nothing is in it.
    #[error("{path}: not one frame of sound; leave it out, or save it again")]
    Empty {
        /// Which.
        path: PathBuf,
    },
    /// More than memory should hold.
    #[error("{path}: longer than {LONGEST_CLIP_S} s; stream it, or cut it")]
    TooLong {
        /// Which.
        path: PathBuf,
    },
    /// A clip that cannot be.
    #[error("{path}: {source}")]
    Clip {
        /// Which.
        path: PathBuf,
        /// Why.
        source: ClipError,
    },
}

impl From<WavError> for FileError {
    fn from(error: WavError) -> Self {
        Self::Read { path: error.path, source: error.source }
    }
}

/// What is told of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct FileFacts {
    /// Its own rate, hertz.
    pub rate_hz: u32,
    /// Its own channels.
    pub channels: usize,
    /// Its length, seconds.
    pub seconds: f64,
    /// Stretches that could not be decoded and are left out.
    pub damaged: u32,
}

/// A file that is read from its beginning to its end, mixed to one or two channels, at its own rate.
pub struct SoundFile {
    path: PathBuf,
    format: Box<dyn FormatReader>,
    decoder: Box<dyn AudioDecoder>,
    track: u32,
    rate_hz: u32,
    channels: usize,
    own_channels: usize,
    told_frames: Option<u64>,
    read_frames: u64,
    damaged: u32,
    raw: Vec<f32>,
}

impl std::fmt::Debug for SoundFile {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("SoundFile").field("path", &self.path).field("rate_hz", &self.rate_hz).finish_non_exhaustive()
    }
}

/// What a decoder says, whatever it does: Symphonia is safe code, yet a file made to break it may still end in one of its panics.
fn guarded<T>(work: impl FnOnce() -> Result<T, DecodeError>) -> Result<T, String> {
    match catch_unwind(AssertUnwindSafe(work)) {
        Ok(Ok(done)) => Ok(done),
        Ok(Err(error)) => Err(error.to_string()),
        Err(_) => Err("the decoder gave up".to_owned()),
    }
}

impl SoundFile {
    /// Opens a file.
    ///
    /// # Errors
    ///
    /// What cannot be read, and what is no sound.
    pub fn open(path: &Path) -> Result<Self, FileError> {
        let read = |source| FileError::Read { path: path.to_owned(), source };
        let unknown = |what: String| FileError::Unknown { path: path.to_owned(), what };
        let file = File::open(path).map_err(read)?;
        if file.metadata().map_err(read)?.is_dir() {
            return Err(unknown("it is a folder".to_owned()));
        }
        let source = MediaSourceStream::new(Box::new(file), Default::default());
        let mut hint = Hint::new();
        if let Some(ending) = path.extension().and_then(|ending| ending.to_str()) {
            hint.with_extension(ending);
        }
        let (format, meta) = (FormatOptions::default(), MetadataOptions::default());
        let format = guarded(|| symphonia::default::get_probe().probe(&hint, source, format, meta)).map_err(unknown)?;
        let track = format.default_track(TrackType::Audio).ok_or_else(|| unknown("no track of sound in it".to_owned()))?;
        let (id, told_frames) = (track.id, track.num_frames);
        let params = track.codec_params.as_ref().and_then(|params| params.audio());
        let params = params.ok_or_else(|| unknown("its track says nothing of its sound".to_owned()))?;
        let options = AudioDecoderOptions::default();
        let decoder = guarded(|| symphonia::default::get_codecs().make_audio_decoder(params, &options)).map_err(unknown)?;
        let mut file = Self {
            path: path.to_owned(),
            format,
            decoder,
            track: id,
            rate_hz: 0,
            channels: 0,
            own_channels: 0,
            told_frames,
            read_frames: 0,
            damaged: 0,
            raw: Vec::new(),
        };
        // rate and channels are known for sure from the first packet only
        let mut first = Vec::new();
        file.packet(&mut first)?;
        if file.rate_hz == 0 {
            return Err(FileError::Empty { path: path.to_owned() });
        }
        file.rewind(0.0)?;
        Ok(file)
    }

    /// Its rate, hertz.
    #[must_use]
    pub fn rate_hz(&self) -> u32 {
        self.rate_hz
    }

    /// Channels that are handed out: 1 or 2.
    #[must_use]
    pub fn channels(&self) -> usize {
        self.channels
    }

    /// The length that the file tells of itself, seconds, if it does.
    #[must_use]
    pub fn told_seconds(&self) -> Option<f64> {
        self.told_frames.map(|frames| frames as f64 / f64::from(self.rate_hz.max(1)))
    }

    /// Packets that could not be decoded and were left out.
    #[must_use]
    pub fn damaged(&self) -> u32 {
        self.damaged
    }

    /// To a time, seconds; returns where it is really read from, which may be some milliseconds earlier.
    ///
    /// # Errors
    ///
    /// Files that cannot be wound.
    pub fn rewind(&mut self, seconds: f64) -> Result<f64, FileError> {
        if seconds <= 0.0 {
            // opened anew: the one thing that works with every file
            let file = File::open(&self.path).map_err(|source| FileError::Read { path: self.path.clone(), source })?;
            let source = MediaSourceStream::new(Box::new(file), Default::default());
            let (format, meta) = (FormatOptions::default(), MetadataOptions::default());
            let probe = symphonia::default::get_probe();
            self.format = guarded(|| probe.probe(&Hint::new(), source, format, meta)).map_err(|what| self.damage(what))?;
            (self.track, self.read_frames) =
                (self.format.default_track(TrackType::Audio).map_or(self.track, |track| track.id), 0);
            self.decoder.reset();
            return Ok(0.0);
        }
        let time = Time::try_from_secs_f64(seconds).ok_or_else(|| self.damage(format!("{seconds} s is no time in it")))?;
        let (format, track) = (&mut self.format, self.track);
        let to = SeekTo::Time { time, track_id: Some(track) };
        let sought = guarded(|| format.seek(SeekMode::Accurate, to)).map_err(|what| self.damage(what))?;
        self.decoder.reset();
        // a sound's time base is its rate in all formats that are read here
        self.read_frames = sought.actual_ts.get().max(0) as u64;
        Ok(self.read_frames as f64 / f64::from(self.rate_hz))
    }

    fn damage(&self, what: String) -> FileError {
        let seconds = self.read_frames as f64 / f64::from(self.rate_hz.max(1));
        FileError::Damaged { path: self.path.clone(), seconds, what }
    }

    /// Appends what the next packet holds, interleaved. Returns false at the end.
    ///
    /// # Errors
    ///
    /// Samples that are none, and a rate or channels that change on the way.
    pub fn packet(&mut self, out: &mut Vec<f32>) -> Result<bool, FileError> {
        for _ in 0..MOST_EMPTY {
            let format = &mut self.format;
            let packet = match guarded(|| format.next_packet()) {
                Ok(Some(packet)) => packet,
                Ok(None) => return Ok(false),
                // what was read is whole; files that were cut off end so
                Err(_) if self.read_frames > 0 => {
                    self.damaged += 1;
                    return Ok(false);
                }
                Err(what) => return Err(FileError::Unknown { path: self.path.clone(), what }),
            };
            if packet.track_id != self.track {
                continue;
            }
            let (decoder, raw) = (&mut self.decoder, &mut self.raw);
            raw.clear();
            let decoded = guarded(|| {
                let buffer = decoder.decode(&packet)?;
                buffer.copy_to_vec_interleaved(raw);
                Ok((buffer.spec().rate(), buffer.spec().channels().count()))
            });
            let Ok((rate_hz, channels)) = decoded else {
                self.damaged += 1;
                continue;
            };
            if raw.is_empty() || channels == 0 {
                continue;
            }
            if self.rate_hz == 0 {
                if !RATES_HZ.contains(&rate_hz) || channels > MOST_CHANNELS {
                    let what = format!("{channels} channels at {rate_hz} Hz");
                    return Err(FileError::Unknown { path: self.path.clone(), what });
                }
                (self.rate_hz, self.own_channels, self.channels) = (rate_hz, channels, channels.min(2));
            }
            if (rate_hz, channels) != (self.rate_hz, self.own_channels) {
                return Err(self.damage(format!("it goes on with {channels} channels at {rate_hz} Hz")));
            }
            if let Some(at) = self.raw.iter().position(|sample| sample.is_nan() || sample.abs() > LOUDEST) {
                self.read_frames += (at / channels) as u64;
                return Err(self.damage(format!("a sample of {}, where full scale is 1", self.raw[at])));
            }
            self.read_frames += (self.raw.len() / channels) as u64;
            mix_down(&self.raw, channels, out);
            return Ok(true);
        }
        Ok(false)
    }
}

/// To two channels, where there are more: the centre to both, a low-frequency channel (the fourth of six or more) to none.
fn mix_down(raw: &[f32], channels: usize, out: &mut Vec<f32>) {
    if channels <= 2 {
        out.extend_from_slice(raw);
        return;
    }
    const HALF_POWER: f32 = std::f32::consts::FRAC_1_SQRT_2;
    for frame in raw.chunks_exact(channels) {
        let (mut left, mut right) = (frame[0], frame[1]);
        for (channel, sample) in frame.iter().enumerate().skip(2) {
            match channel {
                2 => (left, right) = (left + sample * HALF_POWER, right + sample * HALF_POWER),
                3 if channels >= 6 => {}
                _ if channel % 2 == 0 => left += sample * HALF_POWER,
                _ => right += sample * HALF_POWER,
            }
        }
        // as loud as two channels of full scale at most
        let scale = 1.0 / (1.0 + HALF_POWER * (channels - 2).min(3) as f32);
        out.extend([left * scale, right * scale]);
    }
}

/// Reads a whole file into memory, at [`RATE_HZ`].
///
/// # Errors
///
/// What [`FileError`] lists.
pub fn read_clip(path: &Path) -> Result<(Clip, FileFacts), FileError> {
    let mut file = SoundFile::open(path)?;
    // what a file tells of its length is not asked: recorders that were cut off leave anything there
    let channels = file.channels();
    let clip = |source| FileError::Clip { path: path.to_owned(), source };
    let mut resampler = Resampler::new(file.rate_hz(), RATE_HZ, channels)
        .map_err(|error| FileError::Unknown { path: path.to_owned(), what: error.to_string() })?;
    let (mut samples, mut packet) = (Vec::new(), Vec::new());
    while file.packet(&mut packet)? {
        resampler.push(&packet, &mut samples);
        packet.clear();
        if samples.len() / channels > (LONGEST_CLIP_S * f64::from(RATE_HZ)) as usize {
            return Err(FileError::TooLong { path: path.to_owned() });
        }
    }
    if file.read_frames == 0 {
        return Err(FileError::Empty { path: path.to_owned() });
    }
    resampler.finish(&mut samples);
    let seconds = file.read_frames as f64 / f64::from(file.rate_hz);
    let facts = FileFacts { rate_hz: file.rate_hz, channels: file.own_channels, seconds, damaged: file.damaged };
    Ok((Clip::new(samples, channels).map_err(clip)?, facts))
}
