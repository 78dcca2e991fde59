//! Where a photograph's pixels come from: memory, or a file that is read when it is that photograph's turn.

use heliodon_image::{ImageError, Picture};

/// A photograph's pixels, wherever they are.
///
/// Whoever textures asks for each photograph's pixels once and for one photograph's at a time, so that a source that reads a file needs to hold nothing before
/// and nothing after: a hundred megapixels take 0.8 GB while they are looked at, by the dozen they would take all there is.
pub trait PictureSource {
    /// Columns and rows, where that can be told without the pixels: a photograph of another size than its camera's is then refused before the work begins.
    ///
    /// # Errors
    /// Where there is nothing to be read.
    fn size(&self) -> Result<Option<[u32; 2]>, ImageError>;

    /// Hands the pixels to `look`, once, and lets go of them. What was changed on the way is returned, in words.
    ///
    /// # Errors
    /// Where the pixels cannot be read; `look` is not called then.
    fn show(&self, look: &mut dyn FnMut(&Picture)) -> Result<Vec<String>, ImageError>;
}

impl PictureSource for Picture {
    fn size(&self) -> Result<Option<[u32; 2]>, ImageError> {
        Ok(Some(self.size()))
    }

    fn show(&self, look: &mut dyn FnMut(&Picture)) -> Result<Vec<String>, ImageError> {
        look(self);
        Ok(Vec::new())
    }
}
