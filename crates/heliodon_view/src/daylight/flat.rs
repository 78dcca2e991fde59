//! Textures of one layer, one level and one sample a texel.

use bevy::math::UVec2;
use bevy::render::renderer::RenderDevice;
use wgpu::{Extent3d, Texture, TextureDescriptor, TextureDimension, TextureFormat, TextureUsages};

/// Such a texture.
#[must_use]
pub fn flat_texture(device: &RenderDevice, label: &str, size: UVec2, format: TextureFormat, usage: TextureUsages) -> Texture {
    device.wgpu_device().create_texture(&TextureDescriptor {
        label: Some(label),
        size: Extent3d { width: size.x, height: size.y, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: TextureDimension::D2,
        format,
        usage,
        view_formats: &[],
    })
}
