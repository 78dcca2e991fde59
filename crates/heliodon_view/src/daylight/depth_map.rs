//! Maps of depth from the sun and from lamps.

use bevy::render::render_resource::{
    CommandEncoder, Extent3d, LoadOp, Operations, RenderPassDepthStencilAttachment, RenderPassDescriptor, StoreOp,
    TextureDescriptor, TextureDimension, TextureFormat, TextureUsages, TextureView, TextureViewDescriptor,
};
use bevy::render::renderer::RenderDevice;
use wgpu::RenderPass;

/// Depth, 0 nearest to the light.
pub const FORMAT: TextureFormat = TextureFormat::Depth32Float;

/// A map of so many texels.
pub fn depth_map(device: &RenderDevice, label: &str, width: u32, height: u32) -> TextureView {
    let texture = device.create_texture(&TextureDescriptor {
        label: Some(label),
        size: Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: TextureDimension::D2,
        format: FORMAT,
        usage: TextureUsages::TEXTURE_BINDING | TextureUsages::RENDER_ATTACHMENT,
        view_formats: &[],
    });
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
