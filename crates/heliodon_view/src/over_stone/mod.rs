//! What impostors, films and the air share: quads that are laid over what has been drawn, and go softly into it by its depth.

mod camera;

pub use camera::{BoundCamera, CAMERA_BYTES, CameraLayouts, Seen};

use crate::daylight::DaylightCamera;
use bevy::camera::{Camera3d, MainPassResolutionOverride, Viewport};
use bevy::prelude::*;
use bevy::render::camera::ExtractedCamera;
use bevy::render::render_resource::*;
use bevy::render::renderer::{RenderContext, RenderDevice, RenderQueue};
use bevy::render::sync_world::MainEntity;
use bevy::render::view::{ExtractedView, Msaa, ViewDepthTexture, ViewTarget};

/// WGSL of the camera, its depth, and how far away a pixel is; `ONE_SAMPLE` or `MANY_SAMPLES` is to be defined.
pub const CAMERA_WGSL: &str = include_str!("camera.wgsl");

/// Corners of the strip around a shadow's box, and of a quad.
pub const BOX_CORNERS: u32 = 14;
/// Which of a box's eight corners each of the strip's is, a bit for its side along each axis: for what asks much of a corner, which is then worked out once. As `BOX_X`, `BOX_Y`
/// and `BOX_Z` of camera.wgsl.
pub const BOX_STRIP: [u16; BOX_CORNERS as usize] = [6, 7, 2, 3, 1, 7, 5, 6, 4, 2, 0, 1, 4, 5];
/// See [`BOX_CORNERS`].
pub const QUAD_CORNERS: u32 = 4;

/// A buffer that is made anew where it is too small.
pub struct Grown {
    /// The buffer, of at least as many bytes as were written.
    pub buffer: Buffer,
    bytes: u64,
}

impl Grown {
    /// Writes a list, or what stands for an empty one, into a buffer that holds it.
    pub fn write(before: Option<Self>, device: &RenderDevice, queue: &RenderQueue, label: &str, contents: &[u8]) -> Self {
        let wanted = contents.len() as u64;
        let grown = before.filter(|grown| grown.bytes >= wanted).unwrap_or_else(|| {
            // with room, so that a crowd that grows does not make one in every frame
            let bytes = wanted.next_power_of_two().max(256);
            let usage = BufferUsages::STORAGE | BufferUsages::COPY_DST;
            let buffer =
                device.create_buffer(&BufferDescriptor { label: Some(label), size: bytes, usage, mapped_at_creation: false });
            Self { buffer, bytes }
        });
        queue.write_buffer(&grown.buffer, 0, contents);
        grown
    }
}

/// Lets the depth of cameras be read: where something goes into the stone is seen by it.
pub fn let_depth_be_read(mut cameras: Query<&mut Camera3d, Added<DaylightCamera>>) {
    for mut camera in &mut cameras {
        camera.depth_texture_usages.0 |= TextureUsages::TEXTURE_BINDING.bits();
    }
}

/// What of a camera counts before it draws.
pub type SeenCamera = (
    Entity,
    &'static MainEntity,
    &'static ExtractedCamera,
    &'static Camera3d,
    &'static ExtractedView,
    &'static Msaa,
    &'static ViewDepthTexture,
);

/// What drawing needs of a camera.
pub type DrawnView =
    (&'static ExtractedCamera, &'static ViewTarget, &'static ViewDepthTexture, Option<&'static MainPassResolutionOverride>);

/// Begins a pass over a camera's picture, whose depth is only read.
pub fn begin<'a>(
    context: &'a mut RenderContext,
    label: &str,
    (camera, target, depth, resolution): (
        &ExtractedCamera,
        &ViewTarget,
        &ViewDepthTexture,
        Option<&MainPassResolutionOverride>,
    ),
) -> wgpu::RenderPass<'a> {
    let mut pass = context.command_encoder().begin_render_pass(&RenderPassDescriptor {
        label: Some(label),
        color_attachments: &[Some(target.get_color_attachment())],
        depth_stencil_attachment: Some(RenderPassDepthStencilAttachment {
            view: depth.view(),
            depth_ops: None,
            stencil_ops: None,
        }),
        timestamp_writes: None,
        occlusion_query_set: None,
        multiview_mask: None,
    });
    set_viewport(&mut pass, camera, resolution);
    pass
}

/// Begins a pass that writes only where something is, over what a camera has drawn: whatever is drawn later is hidden by it.
pub fn begin_solid<'a>(
    context: &'a mut RenderContext,
    label: &str,
    (camera, depth, resolution): (&ExtractedCamera, &ViewDepthTexture, Option<&MainPassResolutionOverride>),
) -> wgpu::RenderPass<'a> {
    let mut pass = context.command_encoder().begin_render_pass(&RenderPassDescriptor {
        label: Some(label),
        color_attachments: &[],
        depth_stencil_attachment: Some(depth.get_attachment(StoreOp::Store)),
        timestamp_writes: None,
        occlusion_query_set: None,
        multiview_mask: None,
    });
    set_viewport(&mut pass, camera, resolution);
    pass
}

fn set_viewport(pass: &mut wgpu::RenderPass, camera: &ExtractedCamera, resolution: Option<&MainPassResolutionOverride>) {
    if let Some(viewport) = Viewport::from_viewport_and_override(camera.viewport.as_ref(), resolution) {
        let (at, size) = (viewport.physical_position, viewport.physical_size);
        let [x, y, width, height] = [at.x, at.y, size.x, size.y].map(|v| v as f32);
        pass.set_viewport(x, y, width, height, viewport.depth.start, viewport.depth.end);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_strip_goes_around_the_box_as_the_shaders_does() {
        let [x, y, z] = ["BOX_X", "BOX_Y", "BOX_Z"].map(|name| {
            let bits = CAMERA_WGSL.split(&format!("{name}: u32 = 0x")).nth(1).unwrap();
            u32::from_str_radix(bits.split('u').next().unwrap(), 16).unwrap()
        });
        for (corner, sides) in BOX_STRIP.into_iter().enumerate() {
            let bit = |word: u32| word >> corner & 1;
            assert_eq!(u32::from(sides), bit(x) | bit(y) << 1 | bit(z) << 2, "{corner}");
        }
    }
}
