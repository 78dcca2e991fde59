//! PointCache2: the positions of a mesh's vertices over time, for Blender, 3ds Max and their like.

use super::{ExportError, write_file};
use crate::motion::pc2::{PointCache, write};
use std::path::Path;

/// Writes a cache to a file.
///
/// # Errors
/// Where the file cannot be written, or the cache breaks a promise of [`PointCache::validate`]; an older file stays as it was.
pub fn write_pc2(path: &Path, cache: &PointCache) -> Result<(), ExportError> {
    write_file(path, |out| write(out, cache))
}
