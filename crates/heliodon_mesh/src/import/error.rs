//! What importers say when a file cannot be read, and what they say when it can.

use std::fmt;
use std::path::{Path, PathBuf};

/// A place in a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Place {
    /// The file as a whole.
    File,
    /// A line of a text file, counted from 1.
    Line(u64),
    /// A byte, counted from 0.
    Byte(u64),
    /// Something that the format numbers or names, such as `face 12` or `meshes[0].primitives[2]`.
    Item(String),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File => Ok(()),
            Self::Line(line) => write!(f, " line {line}:"),
            Self::Byte(byte) => write!(f, " byte {byte}:"),
            Self::Item(item) => write!(f, " {item}:"),
        }
    }
}

/// A file that is no mesh: names the file, the place in it and what to do.
#[derive(Debug, thiserror::Error)]
#[error("{}:{} {}; {}", detail.file.display(), detail.place, detail.problem, detail.remedy)]
pub struct ImportError {
    detail: Box<Detail>,
    #[source]
    source: Option<std::io::Error>,
}

#[derive(Debug)]
struct Detail {
    file: PathBuf,
    place: Place,
    problem: String,
    remedy: String,
}

impl ImportError {
    pub(crate) fn new(file: &Path, place: Place, problem: impl Into<String>, remedy: impl Into<String>) -> Self {
        let detail = Detail { file: file.to_owned(), place, problem: problem.into(), remedy: remedy.into() };
        Self { detail: Box::new(detail), source: None }
    }

    pub(crate) fn io(file: &Path, doing: &str, source: std::io::Error) -> Self {
        let remedy = match source.kind() {
            std::io::ErrorKind::NotFound => "check the path and its spelling",
            std::io::ErrorKind::PermissionDenied => "check who may read it",
            _ => "check the disk and the file",
        };
        let mut error = Self::new(file, Place::File, format!("cannot {doing}: {source}"), remedy);
        error.source = Some(source);
        error
    }

    /// The file.
    #[must_use]
    pub fn file(&self) -> &Path {
        &self.detail.file
    }

    /// Where in the file.
    #[must_use]
    pub fn place(&self) -> &Place {
        &self.detail.place
    }

    /// What is wrong.
    #[must_use]
    pub fn problem(&self) -> &str {
        &self.detail.problem
    }

    /// What to do about it.
    #[must_use]
    pub fn remedy(&self) -> &str {
        &self.detail.remedy
    }
}

/// What an import met that did not stop it, to be told at the end of the work.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ImportReport {
    /// One sentence each, with the file's name; at most [`ImportReport::MOST_WARNINGS`] of one file, the rest is counted in the last.
    pub warnings: Vec<String>,
    /// Vertices of the file itself, in its order; those that seams and hard edges split come behind them.
    pub file_vertices: u64,
    /// Triangles left out because a vertex is not finite or out of reach.
    pub dropped_triangles: u64,
    /// Triangles left out because two of their corners are one vertex.
    pub collapsed_triangles: u64,
    /// Vertices whose position is not finite or out of reach.
    pub bad_vertices: u64,
    /// Normals of the file that had no direction and were computed anew.
    pub mended_normals: u64,
    suppressed: u64,
}

impl ImportReport {
    /// After so many warnings, further ones are only counted.
    pub const MOST_WARNINGS: usize = 40;

    /// Adds what another file's import met.
    pub fn add(&mut self, other: Self) {
        self.warnings.extend(other.warnings);
        self.file_vertices += other.file_vertices;
        self.dropped_triangles += other.dropped_triangles;
        self.collapsed_triangles += other.collapsed_triangles;
        self.bad_vertices += other.bad_vertices;
        self.mended_normals += other.mended_normals;
    }

    pub(crate) fn warn(&mut self, file: &Path, message: impl fmt::Display) {
        if self.warnings.len() < Self::MOST_WARNINGS {
            self.warnings.push(format!("{}: {message}", file.display()));
            return;
        }
        self.suppressed += 1;
        self.warnings.truncate(Self::MOST_WARNINGS);
        self.warnings.push(format!("{}: and {} more warnings", file.display(), self.suppressed));
    }
}
