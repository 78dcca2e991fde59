//! PointCache2: the positions of a mesh's vertices over time, for Blender, 3ds Max and their like.

use super::{ExportError, write_file};
use glam::Vec3;
use std::io::{self, Write};
use std::path::Path;

/// Writes frames of positions to a file, each as long as the first.
///
/// # Errors
/// Where the file cannot be written, or the frames are none or of unlike lengths; an older file stays as it was.
pub fn write_pc2(path: &Path, frames: &[Vec<Vec3>]) -> Result<(), ExportError> {
    write_file(path, |out| pc2(out, frames))
}

/// Writes frames of positions to `out`, in many small pieces: give it a buffer. One sample a frame, from frame 0 on; how many
/// frames a second has, the format does not say.
///
/// # Errors
/// What `out` answers, or that the frames are none, too many or of unlike lengths.
pub fn pc2(out: &mut dyn Write, frames: &[Vec<Vec3>]) -> io::Result<()> {
    let points = frames.first().map_or(0, Vec::len);
    let (Ok(point_count), Ok(samples)) = (i32::try_from(points), i32::try_from(frames.len())) else {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "more points or frames than the format can count"));
    };
    if points == 0 || frames.iter().any(|frame| frame.len() != points) {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "frames of as many positions each are needed"));
    }
    out.write_all(b"POINTCACHE2\0")?;
    out.write_all(&1_i32.to_le_bytes())?;
    out.write_all(&point_count.to_le_bytes())?;
    out.write_all(&0.0_f32.to_le_bytes())?;
    out.write_all(&1.0_f32.to_le_bytes())?;
    out.write_all(&samples.to_le_bytes())?;
    for p in frames.iter().flatten() {
        out.write_all(bytemuck::bytes_of(&p.to_array().map(f32::to_le_bytes)))?;
    }
    out.flush()
}
