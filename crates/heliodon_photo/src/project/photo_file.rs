//! A photograph's file, read when it is its turn.

use crate::texture::PictureSource;
use heliodon_image::{ImageError, Picture, PictureFile};
use std::path::PathBuf;

/// The file of a photograph. Its pixels are in memory only while they are looked at.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PhotoFile {
    path: PathBuf,
}

impl PhotoFile {
    /// A file of any kind that [`PictureFile::read`] reads. Nothing is opened yet.
    #[must_use]
    pub fn new(path: PathBuf) -> Self {
        Self { path }
    }
}

impl PictureSource for PhotoFile {
    fn size(&self) -> Result<Option<[u32; 2]>, ImageError> {
        let unread = |source| ImageError::Read { name: self.path.display().to_string(), source };
        std::fs::File::open(&self.path).map_err(unread)?;
        Ok(image::image_dimensions(&self.path).ok().map(|(width, height)| [width, height]))
    }

    fn show(&self, look: &mut dyn FnMut(&Picture)) -> Result<Vec<String>, ImageError> {
        let read = PictureFile::read(&self.path)?;
        look(&read.picture);
        Ok(read.warnings)
    }
}
