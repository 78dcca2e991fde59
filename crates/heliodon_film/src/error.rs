//! What can be wrong with a film, or with the programs that read it.

use std::path::Path;

/// A film that cannot be read or written: which, why, and what to do.
#[derive(Debug, thiserror::Error)]
pub enum FilmError {
    /// `ffmpeg` or `ffprobe` is not there.
    #[error("{program} is not installed, and films are read and written with it; {INSTALL}")]
    NoProgram {
        /// Which.
        program: &'static str,
    },
    /// It is there, but cannot be started or spoken to.
    #[error("{program} cannot be run: {problem}; {INSTALL}")]
    Program {
        /// Which.
        program: &'static str,
        /// What the operating system says.
        problem: String,
    },
    /// A file that no film can be read from.
    #[error("{name}: {problem}; {remedy}")]
    Unusable {
        /// The file.
        name: String,
        /// What is wrong, and where.
        problem: String,
        /// What to do.
        remedy: &'static str,
    },
    /// A film that cannot be written.
    #[error("cannot write {name}: {problem}; {remedy}")]
    Write {
        /// The file.
        name: String,
        /// What is wrong.
        problem: String,
        /// What to do.
        remedy: &'static str,
    },
}

const INSTALL: &str = "install it (Debian, Ubuntu: apt-get install ffmpeg, or ./x setup; elsewhere: https://ffmpeg.org/download.html), so that it is in the PATH";

/// The remedy for what was damaged on its way here.
pub(crate) const COPY_AGAIN: &str = "copy or export it again";

impl FilmError {
    pub(crate) fn unusable(path: &Path, problem: impl Into<String>, remedy: &'static str) -> Self {
        Self::Unusable { name: path.display().to_string(), problem: problem.into(), remedy }
    }

    pub(crate) fn write(path: &Path, problem: impl Into<String>, remedy: &'static str) -> Self {
        Self::Write { name: path.display().to_string(), problem: problem.into(), remedy }
    }
}
