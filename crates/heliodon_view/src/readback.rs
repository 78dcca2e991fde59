//! A texture's way into memory.

use bevy::prelude::UVec2;
use bevy::render::renderer::RenderDevice;
use wgpu::{
    Buffer, BufferAsyncError, BufferDescriptor, BufferUsages, BufferView, CommandEncoder, MapMode, TexelCopyBufferInfo,
    TexelCopyBufferLayout, Texture,
};

/// A buffer that takes textures of one size, their rows padded as copies need it.
#[derive(Debug)]
pub(crate) struct TextureReadback {
    buffer: Buffer,
    size: UVec2,
    row_bytes: u32,
    padded_bytes: u32,
}

impl TextureReadback {
    pub(crate) fn new(device: &RenderDevice, label: &str, size: UVec2, texel_bytes: u32) -> Self {
        let row_bytes = size.x * texel_bytes;
        let padded_bytes = row_bytes.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let buffer = device.wgpu_device().create_buffer(&BufferDescriptor {
            label: Some(label),
            size: u64::from(padded_bytes) * u64::from(size.y),
            usage: BufferUsages::MAP_READ | BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        Self { buffer, size, row_bytes, padded_bytes }
    }

    pub(crate) fn size(&self) -> UVec2 {
        self.size
    }

    /// From one row to the next in [`Self::mapped`].
    pub(crate) fn padded_bytes(&self) -> usize {
        self.padded_bytes as usize
    }

    /// Copies `texture` here.
    pub(crate) fn copy(&self, encoder: &mut CommandEncoder, texture: &Texture) {
        let layout = TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(self.padded_bytes), rows_per_image: None };
        let to = TexelCopyBufferInfo { buffer: &self.buffer, layout };
        encoder.copy_texture_to_buffer(texture.as_image_copy(), to, texture.size());
    }

    /// Asks for what was submitted so far; `told` hears when it is here.
    pub(crate) fn map(&self, told: impl FnOnce(Result<(), BufferAsyncError>) + Send + 'static) {
        self.buffer.slice(..).map_async(MapMode::Read, told);
    }

    /// What is here, padding included, once [`Self::map`] has told so.
    pub(crate) fn mapped(&self) -> BufferView {
        self.buffer.slice(..).get_mapped_range()
    }

    /// The rows of what is [mapped](Self::mapped), without padding.
    pub(crate) fn rows<'a>(&self, mapped: &'a [u8]) -> impl Iterator<Item = &'a [u8]> {
        let row_bytes = self.row_bytes as usize;
        mapped.chunks_exact(self.padded_bytes()).map(move |row| &row[..row_bytes])
    }

    /// Gives the buffer back to the GPU.
    pub(crate) fn unmap(&self) {
        self.buffer.unmap();
    }
}
