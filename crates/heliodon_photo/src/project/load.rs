//! From a project's file to what can be solved: the one place where photographs and other programs' files are opened.

use super::{CameraFormat, CamerasEntry};
use super::{Project, ProjectError};
use crate::exif::PhotoFacts;
use crate::formats::{self, FormatError, ImportedCameras};
use crate::solve::Problem;
use rayon::prelude::*;

/// A project with all that its files say.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// What is to be solved.
    pub problem: Problem,
    /// Cameras that were taken over, in the project's order.
    pub imported: Vec<ImportedCameras>,
    /// What the files lack, in words.
    pub notes: Vec<String>,
}

/// Why a project cannot be loaded.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LoadError {
    /// The project itself.
    #[error(transparent)]
    Project(#[from] ProjectError),
    /// A file that it takes cameras from.
    #[error(transparent)]
    Format(#[from] FormatError),
}

impl Project {
    /// Opens the photographs and the files that cameras are taken from. A photograph that cannot be opened is noted only: marks in it count
    /// where its size is known.
    ///
    /// # Errors
    /// Where cameras cannot be taken over, or a photograph's size is known from nowhere.
    pub fn load(&self) -> Result<Loaded, LoadError> {
        let facts = self.facts();
        let imported = self.imported()?;
        let problem = self.problem(&facts, &imported)?;
        let mut notes: Vec<String> = imported.iter().flat_map(|i| i.notes.clone()).collect();
        for (photo, facts) in problem.photos.iter().zip(&facts) {
            // A lens that is given or taken over needs no EXIF.
            let guessed = problem.lenses[photo.lens].focal == crate::solve::Focal::Free;
            notes.extend(facts.notes.iter().filter(|_| guessed).cloned());
        }
        Ok(Loaded { problem, imported, notes })
    }

    /// What the photographs' files say, in their order.
    pub(super) fn facts(&self) -> Vec<PhotoFacts> {
        self.file.photo.par_iter().map(|photo| PhotoFacts::read(&self.folder().join(&photo.file))).collect()
    }

    /// The cameras of other programs that the project takes over, in its order.
    pub(super) fn imported(&self) -> Result<Vec<ImportedCameras>, FormatError> {
        let names: Vec<String> = self.file.photo.iter().map(|p| p.name().to_owned()).collect();
        self.file.cameras.iter().map(|entry| formats::read(self.folder(), entry, &names)).collect()
    }

    /// Takes cameras over from a file from now on; the same file twice counts once.
    pub fn take_over(&mut self, file: &str, format: CameraFormat) {
        let entry = CamerasEntry { file: file.to_owned(), format };
        if !self.file.cameras.contains(&entry) {
            self.file.cameras.push(entry);
        }
    }
}
