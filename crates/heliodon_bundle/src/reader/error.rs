//! What keeps a bundle from being read.

use std::io;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// What keeps a bundle from being read.
#[derive(Debug, Error)]
pub enum ReadError {
    /// The folder is not a bundle.
    #[error("{}: not a bundle, for it has no manifest.json; `heliodon bake SITE` makes one", .path.display())]
    NoBundle {
        /// The folder.
        path: PathBuf,
    },
    /// The bundle is of another version.
    #[error(
        "{}: the bundle is of format version {found}, this program reads {known}; {}",
        .path.display(),
        if *found > u64::from(*known) { "update Heliodon" } else { "bake it again" }
    )]
    Version {
        /// The manifest.
        path: PathBuf,
        /// The bundle's version.
        found: u64,
        /// The version that this program knows.
        known: u32,
    },
    /// The file system refused.
    #[error("{}: {source}", .path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What it said.
        source: io::Error,
    },
    /// Something in a file does not fit.
    #[error("{}: {what}; the bundle is damaged, bake it again", .path.display())]
    Malformed {
        /// The file.
        path: PathBuf,
        /// What does not fit.
        what: String,
    },
    /// A file is not what it was when the bundle was written.
    #[error("{}: its bytes are not those that were written; the bundle is damaged, bake it again", .path.display())]
    Changed {
        /// The file.
        path: PathBuf,
    },
}

pub(super) fn io_error(path: &Path) -> impl FnOnce(io::Error) -> ReadError + '_ {
    move |source| ReadError::Io { path: path.to_owned(), source }
}

pub(super) fn malformed(path: &Path, what: impl Into<String>) -> ReadError {
    ReadError::Malformed { path: path.to_owned(), what: what.into() }
}
