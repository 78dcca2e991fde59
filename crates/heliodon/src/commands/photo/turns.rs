//! Photographs' files, read when it is their turn, and how far that is.

use crate::App;
use heliodon_bake::report::Reporter;
use heliodon_image::{ImageError, Picture};
use heliodon_photo::project::{PhotoFile, Project};
use heliodon_photo::texture::PictureSource;

/// A photograph's file that tells when it has been looked at.
pub(super) struct Turn<'a> {
    app: &'a App,
    /// How many photographs come before it.
    before: u64,
    file: PhotoFile,
}

/// The files of a project's photographs, in the order in which they will be asked for; a stage of as many units is to be under way then.
pub(super) fn turns<'a>(app: &'a App, project: &Project, files: &[String]) -> Vec<Turn<'a>> {
    let turn = |(before, file): (u64, &String)| Turn { app, before, file: PhotoFile::new(project.folder().join(file)) };
    (0..).zip(files).map(turn).collect()
}

impl PictureSource for Turn<'_> {
    fn size(&self) -> Result<Option<[u32; 2]>, ImageError> {
        self.file.size()
    }

    fn show(&self, look: &mut dyn FnMut(&Picture)) -> Result<Vec<String>, ImageError> {
        let told = self.file.show(look)?;
        self.app.progress.progress(self.before + 1);
        Ok(told)
    }
}
