//! The albedo of vertices, textures included.

use crate::chunk::LitChunk;
use crate::reader::{BundleReader, ReadError};
use glam::Vec3;
use heliodon_image::SrgbImage;

/// Looks up the whole albedo of vertices: a chunk's own factor times its texture. Keeps the last texture decoded, since
/// chunks of one texture follow one another.
pub struct VertexAlbedo<'a> {
    reader: &'a BundleReader,
    decoded: Option<(u32, SrgbImage)>,
}

impl<'a> VertexAlbedo<'a> {
    /// Looks up in the textures of a bundle.
    #[must_use]
    pub fn new(reader: &'a BundleReader) -> Self {
        Self { reader, decoded: None }
    }

    /// The linear albedo of the chunk's vertices.
    ///
    /// # Errors
    /// If the chunk's texture cannot be read.
    pub fn of(&mut self, chunk: &LitChunk) -> Result<Vec<Vec3>, ReadError> {
        let Some(index) = chunk.texture else { return Ok(chunk.albedo.clone()) };
        let image = match self.decoded.take() {
            Some(kept) if kept.0 == index => kept,
            _ => (index, self.reader.texture_image(index as usize)?),
        };
        let wrap = self.reader.texture_wrap(index as usize);
        let texel = |(factor, uv): (&Vec3, &glam::Vec2)| *factor * image.1.sample_bilinear(uv.x, uv.y, wrap).truncate();
        let albedo = chunk.albedo.iter().zip(&chunk.uvs).map(texel).collect();
        self.decoded = Some(image);
        Ok(albedo)
    }
}
