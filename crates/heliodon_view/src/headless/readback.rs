//! A target texture's way into memory.

use bevy::prelude::*;
use bevy::render::RenderApp;
use bevy::render::render_asset::RenderAssets;
use bevy::render::render_resource::{
    Buffer, BufferDescriptor, BufferUsages, CommandEncoderDescriptor, MapMode, PollType, TexelCopyBufferInfo,
    TexelCopyBufferLayout,
};
use bevy::render::renderer::{RenderDevice, RenderQueue};
use bevy::render::texture::GpuImage;
use std::sync::mpsc::{Receiver, channel};
use thiserror::Error;

/// Why a picture did not come back.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum ReadbackError {
    /// The texture is not there.
    #[error("the picture was not drawn: its texture does not exist on the GPU")]
    NoTarget,
    /// The device failed.
    #[error("the GPU did not give the picture back: {0}")]
    Device(String),
}

/// The longest side of a texture on the app's device.
pub(super) fn longest_side(app: &App) -> u32 {
    app.sub_app(RenderApp).world().resource::<RenderDevice>().limits().max_texture_dimension_2d
}

/// A copy under way.
pub(super) struct Pending {
    buffer: Buffer,
    mapped: Receiver<Result<(), String>>,
    row_bytes: usize,
    padded_bytes: usize,
    rows: usize,
}

/// Asks for the content of `target` as it is after all work so far.
pub(super) fn begin_readback(app: &App, target: &Handle<Image>) -> Result<Pending, ReadbackError> {
    let world = app.sub_app(RenderApp).world();
    let device = world.resource::<RenderDevice>();
    let queue = world.resource::<RenderQueue>();
    let image = world.resource::<RenderAssets<GpuImage>>().get(target).ok_or(ReadbackError::NoTarget)?;
    let size = image.texture_descriptor.size;
    let texel_bytes = image.texture_descriptor.format.block_copy_size(None).ok_or(ReadbackError::NoTarget)?;
    let row_bytes = size.width as usize * texel_bytes as usize;
    let padded_bytes = RenderDevice::align_copy_bytes_per_row(row_bytes);
    let buffer = device.create_buffer(&BufferDescriptor {
        label: Some("picture"),
        size: (padded_bytes * size.height as usize) as u64,
        usage: BufferUsages::MAP_READ | BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    let mut encoder = device.create_command_encoder(&CommandEncoderDescriptor { label: Some("picture") });
    encoder.copy_texture_to_buffer(
        image.texture.as_image_copy(),
        TexelCopyBufferInfo {
            buffer: &buffer,
            layout: TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(padded_bytes as u32), rows_per_image: None },
        },
        size,
    );
    queue.submit([encoder.finish()]);
    let (sender, mapped) = channel();
    buffer.slice(..).map_async(MapMode::Read, move |result| {
        // Whoever does not wait any more does not want to know.
        sender.send(result.map_err(|error| error.to_string())).ok();
    });
    Ok(Pending { buffer, mapped, row_bytes, padded_bytes, rows: size.height as usize })
}

impl Pending {
    /// The rows, without padding, once the copy is done.
    pub(super) fn wait(self, app: &App) -> Result<Vec<u8>, ReadbackError> {
        let device = app.sub_app(RenderApp).world().resource::<RenderDevice>();
        loop {
            if let Ok(result) = self.mapped.try_recv() {
                result.map_err(ReadbackError::Device)?;
                break;
            }
            device
                .poll(PollType::Wait { submission_index: None, timeout: None })
                .map_err(|error| ReadbackError::Device(error.to_string()))?;
        }
        let mapped = self.buffer.slice(..).get_mapped_range();
        let mut rows = Vec::with_capacity(self.row_bytes * self.rows);
        for row in mapped.chunks_exact(self.padded_bytes) {
            rows.extend_from_slice(&row[..self.row_bytes]);
        }
        Ok(rows)
    }
}
