//! PointCache2: the positions of a mesh's vertices at evenly spaced times, as 3ds Max, Blender, Houdini and Marvelous Designer write them.
//!
//! 32 bytes of header, little-endian: `POINTCACHE2\0`, the version (`i32`, 1), the number of points (`i32`), the first frame (`f32`), the
//! sample rate (`f32`, in frames from one sample to the next), the number of samples (`i32`); then for each sample for each point x, y
//! and z (`f32`) in the mesh's own space and order.

use crate::import::{ImportError, Place, Source};
use glam::Vec3;
use std::io::Write;
use std::path::Path;

const MAGIC: [u8; 12] = *b"POINTCACHE2\0";
const HEADER: usize = 32;
const VERSION: i32 = 1;
const REMEDY: &str = "the cache may be cut off or damaged, copy or write it again";

/// A vertex cache.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PointCache {
    /// Points in each sample; at least 1.
    pub points: usize,
    /// The frame of the first sample.
    pub start_frame: f32,
    /// Frames from one sample to the next; above 0.
    pub frames_per_sample: f32,
    /// The samples one after the other, `points` positions each, in the file's unit and axes; not checked to be finite.
    pub positions: Vec<Vec3>,
}

impl PointCache {
    /// A sample for each frame, from frame 0 on; frames of unlike lengths make a cache that [`PointCache::validate`] refuses.
    #[must_use]
    pub fn of_frames(frames: &[Vec<Vec3>]) -> Self {
        let points = frames.first().map_or(0, Vec::len);
        let alike = frames.iter().all(|frame| frame.len() == points);
        let positions = if alike { frames.concat() } else { Vec::new() };
        Self { points, start_frame: 0.0, frames_per_sample: 1.0, positions }
    }

    /// How many samples there are.
    #[must_use]
    pub fn samples(&self) -> usize {
        self.positions.len().checked_div(self.points).unwrap_or(0)
    }

    /// Checks every promise that the fields' documentation makes.
    ///
    /// # Errors
    /// The first promise that is broken, in words.
    pub fn validate(&self) -> Result<(), String> {
        let whole = self.points > 0 && !self.positions.is_empty() && self.positions.len().is_multiple_of(self.points);
        if !whole || i32::try_from(self.points).is_err() || i32::try_from(self.samples()).is_err() {
            return Err(format!("{} positions are no whole samples of {} points", self.positions.len(), self.points));
        }
        if !(self.frames_per_sample > 0.0 && self.frames_per_sample.is_finite()) {
            return Err(format!("the sample rate is {} frames", self.frames_per_sample));
        }
        Ok(())
    }
}

/// Reads a cache.
///
/// # Errors
/// Where the file cannot be read, is no such cache, or does not hold the samples that its header promises.
pub fn read(path: &Path) -> Result<PointCache, ImportError> {
    read_source(&mut Source::open(path)?)
}

/// Reads a cache from the bytes of a file; `name` is for messages.
///
/// # Errors
/// As [`read`].
pub fn from_bytes(bytes: &[u8], name: &Path) -> Result<PointCache, ImportError> {
    read_source(&mut Source::from_bytes(name, bytes))
}

fn read_source(source: &mut Source) -> Result<PointCache, ImportError> {
    let (file, length) = (source.file(), source.length());
    let fail = |byte: u64, problem: String, remedy: &str| Err(ImportError::new(file, Place::Byte(byte), problem, remedy));
    if !source.peek(MAGIC.len())?.starts_with(&MAGIC) {
        return fail(0, "is no PointCache2 file".to_owned(), "write the vertex cache as PC2");
    }
    let header: [u8; HEADER] = source.take(HEADER)?.try_into().unwrap_or([0; HEADER]);
    let word = |at: usize| [header[at], header[at + 1], header[at + 2], header[at + 3]];
    let (version, points, samples) = (i32::from_le_bytes(word(12)), i32::from_le_bytes(word(16)), i32::from_le_bytes(word(28)));
    let (start_frame, frames_per_sample) = (f32::from_le_bytes(word(20)), f32::from_le_bytes(word(24)));
    if version != VERSION {
        return fail(12, format!("is of version {version}"), "write it as version 1");
    }
    let (Ok(count), Ok(sample_count)) = (u64::try_from(points), u64::try_from(samples)) else {
        return fail(16, format!("promises {samples} samples of {points} points"), REMEDY);
    };
    if count == 0 || sample_count == 0 {
        return fail(
            16,
            format!("has {samples} samples of {points} points"),
            "check that the cache was baked before it was written",
        );
    }
    if !(frames_per_sample > 0.0 && frames_per_sample.is_finite()) {
        return fail(24, format!("has a sample rate of {frames_per_sample} frames"), "write it with one sample a frame");
    }
    // both below 2^31, so the product fits
    let promised = count * sample_count;
    let held = source.remaining() / 12;
    if promised > held {
        let problem = format!(
            "promises {samples} samples of {points} points, but its {length} bytes hold {} whole samples",
            held / count
        );
        return fail(16, problem, REMEDY);
    }
    let mut positions = Vec::with_capacity(promised as usize);
    for _ in 0..sample_count {
        let sample = source.take(count as usize * 12)?;
        positions.extend(sample.chunks_exact(12).map(|p| {
            let at = |k: usize| f32::from_le_bytes([p[k], p[k + 1], p[k + 2], p[k + 3]]);
            Vec3::new(at(0), at(4), at(8))
        }));
    }
    let start_frame = if start_frame.is_finite() { start_frame } else { 0.0 };
    Ok(PointCache { points: count as usize, start_frame, frames_per_sample, positions })
}

/// Writes a cache.
///
/// # Errors
/// Where the writer fails, or the cache breaks a promise of [`PointCache::validate`].
pub fn write(writer: &mut dyn Write, cache: &PointCache) -> std::io::Result<()> {
    cache.validate().map_err(|problem| std::io::Error::new(std::io::ErrorKind::InvalidInput, problem))?;
    writer.write_all(&MAGIC)?;
    writer.write_all(&VERSION.to_le_bytes())?;
    writer.write_all(&(cache.points as i32).to_le_bytes())?;
    writer.write_all(&cache.start_frame.to_le_bytes())?;
    writer.write_all(&cache.frames_per_sample.to_le_bytes())?;
    writer.write_all(&(cache.samples() as i32).to_le_bytes())?;
    for p in &cache.positions {
        writer.write_all(&p.to_array().map(f32::to_le_bytes).concat())?;
    }
    Ok(())
}
