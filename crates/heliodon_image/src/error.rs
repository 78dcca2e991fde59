//! What can go wrong with an image file.

use std::path::Path;

/// An image that could not be read or written: which file, where in it, and what to do.
#[derive(Debug, thiserror::Error)]
pub enum ImageError {
    /// The file could not be opened or read.
    #[error("{name}: cannot be read ({source}); check that it exists and that you may read it")]
    Read {
        /// The file.
        name: String,
        /// What the system said.
        source: std::io::Error,
    },
    /// The bytes are no image of a kind that is known.
    #[error("{name}: its first bytes are those of no image known here; give a Radiance .hdr, OpenEXR, PNG or JPEG file")]
    UnknownFormat {
        /// The file.
        name: String,
    },
    /// The file is broken, or holds what is not supported.
    #[error("{name}: {place}: {problem}; {remedy}")]
    Malformed {
        /// The file.
        name: String,
        /// Where in the file.
        place: String,
        /// What is wrong there.
        problem: String,
        /// What to do about it.
        remedy: &'static str,
    },
    /// The file could not be written.
    #[error("{name}: cannot be written ({problem}); check the folder, the free space and your rights")]
    Write {
        /// The file.
        name: String,
        /// What the system or the encoder said.
        problem: String,
    },
}

/// What to do about most broken files.
pub(crate) const COPY_AGAIN: &str = "copy or export the file again";

impl ImageError {
    pub(crate) fn malformed(name: &str, place: impl Into<String>, problem: impl Into<String>, remedy: &'static str) -> Self {
        Self::Malformed { name: name.into(), place: place.into(), problem: problem.into(), remedy }
    }

    pub(crate) fn write(path: &Path, problem: impl ToString) -> Self {
        Self::Write { name: path.display().to_string(), problem: problem.to_string() }
    }
}

/// Reads a whole file.
pub(crate) fn read_file(path: &Path) -> Result<(Vec<u8>, String), ImageError> {
    let name = path.display().to_string();
    match std::fs::read(path) {
        Ok(bytes) => Ok((bytes, name)),
        Err(source) => Err(ImageError::Read { name, source }),
    }
}

/// Memory below this is taken whatever the file's length.
const FREE_BYTES: u64 = 16 << 20;

/// Refuses sizes of nothing and of more than `most` pixels.
pub(crate) fn check_size(name: &str, place: &str, width: u64, height: u64, most: u64) -> Result<(), ImageError> {
    if width == 0 || height == 0 {
        return Err(ImageError::malformed(name, place, format!("an image of {width} x {height} pixels"), COPY_AGAIN));
    }
    let count = u128::from(width) * u128::from(height);
    if count <= u128::from(most) {
        return Ok(());
    }
    let problem = format!("{width} x {height} pixels are {count}, more than the {most} that are read");
    Err(ImageError::malformed(name, place, problem, "scale the image down, or cut it into several"))
}

/// Refuses what would take `needed` bytes of memory where each byte of the file can stand for `expansion` at most.
pub(crate) fn check_expansion(name: &str, needed: u64, file_bytes: usize, expansion: u64) -> Result<(), ImageError> {
    if needed <= FREE_BYTES + expansion * file_bytes as u64 {
        return Ok(());
    }
    Err(ImageError::malformed(name, "its header", "promises more pixels than the file can hold", COPY_AGAIN))
}
