//! The depth maps of a batch of directions, side by side in one texture.

use super::WORD;
use wgpu::{Device, Extent3d, TextureDescriptor, TextureDimension, TextureFormat, TextureUsages, TextureView};

/// What the depth is stored as.
pub(crate) const DEPTH_FORMAT: TextureFormat = TextureFormat::Depth32Float;

/// Sides of the texture at most, where the device allows it.
const LARGEST_PX: u32 = 4096;
/// Sides of a map.
const MAP_PX: std::ops::RangeInclusive<u32> = 128..=2048;
/// Texels for each of the mesh's median edges.
const TEXELS_PER_EDGE: f32 = 6.0;
/// Triangles that one submission draws at most, for drivers give up on what takes seconds.
const MOST_TRIANGLES: u32 = 32 << 20;

pub(crate) struct Atlas {
    pub view: TextureView,
    pub size_px: u32,
    pub tile_px: u32,
    /// Tiles in a row.
    pub across: u32,
    /// Directions of a batch: whole words, or an even part of one.
    pub batch: u32,
}

impl Atlas {
    /// For a mesh of so many triangles in a sphere, its edges of a median length.
    pub fn new(device: &Device, radius: f32, edge: f32, triangles: u32, size_px: Option<u32>) -> Self {
        let largest = LARGEST_PX.min(device.limits().max_texture_dimension_2d);
        let across = 2.0 * radius / edge.max(f32::MIN_POSITIVE) * TEXELS_PER_EDGE;
        let wanted = size_px.unwrap_or_else(|| (across as u32).clamp(*MAP_PX.start(), *MAP_PX.end()).next_power_of_two());
        let tile_px = wanted.clamp(16, largest);
        let tiles = (largest / tile_px).pow(2).min((MOST_TRIANGLES / triangles.max(1)).max(1));
        // A batch is whole words, or an even part of one.
        let batch = if tiles < WORD { 1 << tiles.ilog2() } else { tiles / WORD * WORD };
        let across = (1..).find(|side| side * side >= batch).unwrap_or(batch);
        let size_px = across * tile_px;
        let texture = device.create_texture(&TextureDescriptor {
            label: Some("visibility_depth"),
            size: Extent3d { width: size_px, height: size_px, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: TextureDimension::D2,
            format: DEPTH_FORMAT,
            usage: TextureUsages::RENDER_ATTACHMENT | TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        });
        Self { view: texture.create_view(&wgpu::TextureViewDescriptor::default()), size_px, tile_px, across, batch }
    }
}
