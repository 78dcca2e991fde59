//! Maps of depth from the sun and from lamps.

use super::flat::flat_texture;
use bevy::math::UVec2;
use bevy::render::render_resource::{
    CommandEncoder, LoadOp, Operations, RenderPassDepthStencilAttachment, RenderPassDescriptor, StoreOp, Texture,
    TextureFormat, TextureUsages, TextureView, TextureViewDescriptor,
};
use bevy::render::renderer::RenderDevice;
use wgpu::RenderPass;

/// Depth, 0 nearest to the light.
pub const FORMAT: TextureFormat = TextureFormat::Depth32Float;

/// A map of so many texels.
pub fn depth_map(device: &RenderDevice, label: &str, width: u32, height: u32) -> TextureView {
    let usage = TextureUsages::TEXTURE_BINDING | TextureUsages::RENDER_ATTACHMENT;
    let texture: Texture = flat_texture(device, label, UVec2::new(width, height), FORMAT, usage).into();
    texture.create_view(&TextureViewDescriptor::default())
}

/// Begins to draw into a map, over nothing or over what is in it.
pub fn begin(encoder: &mut CommandEncoder, label: &str, map: &TextureView, clear: bool) -> RenderPass<'static> {
    let load = if clear { LoadOp::Clear(1.0) } else { LoadOp::Load };
    encoder
        .begin_render_pass(&RenderPassDescriptor {
            label: Some(label),
            color_attachments: &[],
            depth_stencil_attachment: Some(RenderPassDepthStencilAttachment {
                view: map,
                depth_ops: Some(Operations { load, store: StoreOp::Store }),
                stencil_ops: None,
            }),
            timestamp_writes: None,
            occlusion_query_set: None,
            multiview_mask: None,
        })
        .forget_lifetime()
}
