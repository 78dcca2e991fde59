//! Automatic matching by COLMAP, where it is installed.
//!
//! Run as a program, not linked: it is large, brings its own CUDA, and a project is as well marked by hand.
//!
//! | module | what it does |
//! | --- | --- |
//! | `program` | runs a step, keeps its log, finds what is wrong in it |
//! | `features` | features and matches: one run a lens, so that photographs share lenses as the project says |
//! | `maps` | cameras and points, and what helps where the mapper finds few |
//! | `refined` | the same adjusted once more by ours |
//! | `left_out` | why photographs have no camera |
//!
//! What COLMAP's mapper finds is adjusted by [`crate::solve::refine`]: it frees the lens's centre under a prior, and does not follow the tails of
//! the matches' noise. On photographs with known cameras that is nearer the truth, up to five times (`tests/all/colmap.rs`, docs/decisions/042).

mod features;
mod left_out;
mod maps;
mod program;
mod refined;
#[cfg(test)]
mod tests;

use crate::formats::{FormatError, ImportedCameras};
use crate::solve::{Problem, Solution};
use features::{EXTRACTOR, extracted};
use program::Program;
use std::ffi::OsStr;
use std::path::Path;

pub use left_out::LeftOut;

/// The folder beside the project that COLMAP works in.
pub const COLMAP_FOLDER: &str = "colmap";

/// Why nothing was matched.
#[derive(Debug, thiserror::Error)]
pub enum MatchError {
    /// COLMAP is not there.
    #[error(
        "COLMAP is not installed (no program `{0}`): Debian and Ubuntu have it as `apt-get install colmap`, others at https://colmap.github.io; \
         or mark points by hand"
    )]
    NotInstalled(String),
    /// Too few photographs.
    #[error("the project has {0} photographs, and matching needs two")]
    TooFew(usize),
    /// A photograph lies outside the project's folder, or there is none.
    #[error("{0}: COLMAP needs the photographs inside the project's folder")]
    Photograph(String),
    /// A folder or list could not be written.
    #[error("{file}: {why}")]
    Write {
        /// Which.
        file: String,
        /// The system's words.
        why: String,
    },
    /// A step failed.
    #[error("colmap {step} failed{why}; its log is {log}")]
    Step {
        /// Which.
        step: String,
        /// What its log complains of.
        why: String,
        /// Where it is.
        log: String,
    },
    /// Nothing came of it.
    #[error("COLMAP found no two photographs that fit together: they need to overlap by half or more{}", told(.0))]
    Nothing(Vec<LeftOut>),
    /// What it wrote cannot be read, or ours cannot be written.
    #[error(transparent)]
    Format(#[from] FormatError),
}

impl MatchError {
    fn unwritten(path: &Path, error: &std::io::Error) -> Self {
        Self::Write { file: path.display().to_string(), why: error.to_string() }
    }
}

/// Where every photograph has the same reason, it is said once.
fn told(left_out: &[LeftOut]) -> String {
    let mut reasons: Vec<(&str, Vec<&str>)> = Vec::new();
    for LeftOut { photo, why } in left_out {
        match reasons.iter_mut().find(|(w, _)| w == why) {
            Some((_, photos)) => photos.push(photo),
            None => reasons.push((why, vec![photo])),
        }
    }
    reasons.iter().map(|(why, photos)| format!("\n  {}: {why}", photos.join(", "))).collect()
}

/// What is to be matched.
#[derive(Clone, Copy, Debug)]
pub struct Request<'a> {
    /// `colmap`, or the path of one.
    pub program: &'a OsStr,
    /// The project's folder; the files lie in it, and so does what COLMAP writes.
    pub folder: &'a Path,
    /// The photographs' files from the folder, in the problem's order.
    pub files: &'a [String],
    /// The photographs and their lenses; its points and marks are not looked at.
    pub problem: &'a Problem,
}

/// What COLMAP made.
#[derive(Clone, Debug)]
pub struct Matched {
    /// Cameras and points, adjusted.
    pub cameras: ImportedCameras,
    /// The same with uncertainties, for the photographs of the request; its points are those of the mapper.
    pub solution: Solution,
    /// The model's folder, from the project's own.
    pub model: String,
    /// How many separate models COLMAP made; the one with most photographs was taken.
    pub models: usize,
    /// Photographs without a camera, in the request's order.
    pub left_out: Vec<LeftOut>,
    /// What went other than usual.
    pub notes: Vec<String>,
}

/// Finds features, matches all pairs, maps and adjusts; `stage` is told what happens. A step that fails half way need not end it: what there is
/// by then is used, and told in the notes.
///
/// # Errors
/// Where COLMAP is not installed, a step fails before there is anything, or nothing comes of it.
///
/// # Panics
/// Where files and photographs are not equally many.
pub fn run(request: &Request<'_>, stage: &mut dyn FnMut(&str)) -> Result<Matched, MatchError> {
    assert_eq!(request.files.len(), request.problem.photos.len(), "a file for each photograph");
    if request.files.len() < 2 {
        return Err(MatchError::TooFew(request.files.len()));
    }
    let outside = |file: &&String| Path::new(file).is_absolute() || !request.folder.join(file).is_file();
    if let Some(file) = request.files.iter().find(outside) {
        return Err(MatchError::Photograph(file.clone()));
    }
    let work = request.folder.join(COLMAP_FOLDER);
    std::fs::create_dir_all(&work).map_err(|e| MatchError::unwritten(&work, &e))?;
    let database = features::database(&work);
    let mut program = Program { program: request.program, work: &work, stage };
    let mut notes = features::extract(&mut program, request, &database)?;
    let failure = match features::match_all(&mut program, request, &database) {
        Ok(()) => None,
        Err(error @ MatchError::Step { .. }) => Some(error),
        Err(error) => return Err(error),
    };
    let photos = extracted(&program.said(EXTRACTOR));
    let maps = maps::map(&mut program, request, &database, &photos, &mut notes)?;
    let said = program.said(maps::MAPPER);
    let reasons = |best| left_out::reasons(request.files, best, &maps.all, &photos, &said);
    let Some(best) = maps.best() else { return Err(failure.unwrap_or_else(|| MatchError::Nothing(reasons(None)))) };
    notes.extend(failure.map(|error| format!("{error}; what had been matched by then was used")));
    (program.stage)("adjusting cameras");
    let (cameras, solution) = refined::refined(request, best);
    let left_out = reasons(Some(best));
    let model = format!("{COLMAP_FOLDER}/{}", refined::FOLDER);
    refined::write(&request.folder.join(&model), &cameras)?;
    notes.extend(solution.notes.iter().cloned());
    Ok(Matched { cameras, solution, model, models: maps.models, left_out, notes })
}
