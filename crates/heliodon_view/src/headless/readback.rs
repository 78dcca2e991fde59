//! Pictures of a target, in memory.

use crate::readback::TextureReadback;
use bevy::prelude::*;
use bevy::render::RenderApp;
use bevy::render::render_asset::RenderAssets;
use bevy::render::render_resource::{CommandEncoderDescriptor, PollType};
use bevy::render::renderer::{RenderDevice, RenderQueue};
use bevy::render::texture::GpuImage;
use std::sync::mpsc::{Receiver, channel};
use thiserror::Error;
use wgpu::SubmissionIndex;

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
pub(crate) fn longest_side(app: &App) -> u32 {
    app.sub_app(RenderApp).world().resource::<RenderDevice>().limits().max_texture_dimension_2d
}

/// A copy under way.
pub(crate) struct Pending {
    readback: TextureReadback,
    submission: SubmissionIndex,
    mapped: Receiver<Result<(), String>>,
}

/// Asks for the content of `target` as it is after all work so far.
pub(crate) fn begin_readback(app: &App, target: &Handle<Image>) -> Result<Pending, ReadbackError> {
    let world = app.sub_app(RenderApp).world();
    let device = world.resource::<RenderDevice>();
    let queue = world.resource::<RenderQueue>();
    let image = world.resource::<RenderAssets<GpuImage>>().get(target).ok_or(ReadbackError::NoTarget)?;
    let size = image.texture_descriptor.size;
    let texel_bytes = image.texture_descriptor.format.block_copy_size(None).ok_or(ReadbackError::NoTarget)?;
    let readback = TextureReadback::new(device, "picture", UVec2::new(size.width, size.height), texel_bytes);
    let mut encoder = device.create_command_encoder(&CommandEncoderDescriptor { label: Some("picture") });
    readback.copy(&mut encoder, &image.texture);
    let submission = queue.submit([encoder.finish()]);
    let (sender, mapped) = channel();
    readback.map(move |result| {
        // Whoever does not wait any more does not want to know.
        sender.send(result.map_err(|error| error.to_string())).ok();
    });
    Ok(Pending { readback, submission, mapped })
}

impl Pending {
    /// The rows, without padding, once the copy is done.
    pub(crate) fn wait(self, app: &App) -> Result<Vec<u8>, ReadbackError> {
        let device = app.sub_app(RenderApp).world().resource::<RenderDevice>();
        // Not for what was submitted since: the GPU draws the next picture while this one is taken.
        let poll = PollType::Wait { submission_index: Some(self.submission), timeout: None };
        device.poll(poll).map_err(|error| ReadbackError::Device(error.to_string()))?;
        let told = self.mapped.recv().map_err(|error| ReadbackError::Device(error.to_string()))?;
        told.map_err(ReadbackError::Device)?;
        let mapped = self.readback.mapped();
        Ok(self.readback.rows(&mapped).collect::<Vec<_>>().concat())
    }
}
