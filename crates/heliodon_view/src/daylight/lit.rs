//! Vertices that are lit together: what was baked of them, the list of those that are to be lit, and their light of the moment.

use super::flat::flat_texture;
use super::layout::{BLOCK, GROUP, TEXEL_WORDS, VertexLayout};
use bevy::math::UVec2;
use bevy::render::render_resource::{
    BindGroup, BindGroupEntries, BindGroupLayout, Buffer, BufferDescriptor, BufferUsages, Extent3d, Origin3d,
    TexelCopyBufferLayout, TexelCopyTextureInfo, Texture, TextureFormat, TextureUsages, TextureViewDescriptor,
};
use bevy::render::renderer::{RenderDevice, RenderQueue};

/// Rows of a texture: what every WebGPU device has.
pub const MAX_ROWS: u32 = 8192;

/// So many blocks of [`BLOCK`] vertices.
#[derive(Debug)]
pub struct LitVertices {
    /// What was baked, as [`super::layout::pack`] lays it.
    pub baked: Texture,
    /// The light of the moment, four half floats a vertex: the light shader writes it, drawing reads it.
    pub light: Buffer,
    /// Groups of [`GROUP`] that the light shader must do.
    pub work: Buffer,
    /// What the light shader binds.
    pub bind_group: BindGroup,
    blocks: u32,
}

impl LitVertices {
    /// Room for `vertices`, which are whole blocks and no more than [`Self::most`].
    #[must_use]
    pub fn new(device: &RenderDevice, layout: VertexLayout, light_layout: &BindGroupLayout, vertices: u32) -> Self {
        let buffer = |label: &'static str, bytes: u64, usage: BufferUsages| {
            device.create_buffer(&BufferDescriptor {
                label: Some(label),
                size: bytes,
                usage: usage | BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        };
        let (count, blocks) = (u64::from(vertices), vertices / BLOCK);
        let size = UVec2::new(BLOCK, blocks * layout.texels());
        let usage = TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_DST;
        let baked: Texture = flat_texture(device, "stone_baked", size, TextureFormat::Rgba32Uint, usage).into();
        let view = baked.create_view(&TextureViewDescriptor::default());
        let light = buffer("stone_light", count * 8, BufferUsages::STORAGE | BufferUsages::VERTEX | BufferUsages::COPY_SRC);
        let work = buffer("stone_light_work", count / u64::from(GROUP) * 4, BufferUsages::STORAGE);
        let entries = BindGroupEntries::sequential((work.as_entire_buffer_binding(), &view, light.as_entire_buffer_binding()));
        let bind_group = device.create_bind_group("stone_light", light_layout, &entries);
        Self { baked, light, work, bind_group, blocks }
    }

    /// The most vertices: whole blocks.
    #[must_use]
    pub fn most(layout: VertexLayout) -> u32 {
        MAX_ROWS / layout.texels() * BLOCK
    }

    /// Blocks of vertices for which there is room.
    #[must_use]
    pub fn blocks(&self) -> u32 {
        self.blocks
    }

    /// Takes whole blocks of what was baked, from a vertex on that begins one.
    pub fn write(&self, queue: &RenderQueue, layout: VertexLayout, first_vertex: u32, baked: &[u32]) {
        let row_words = (BLOCK * TEXEL_WORDS) as usize;
        let into = TexelCopyTextureInfo {
            origin: Origin3d { x: 0, y: first_vertex / BLOCK * layout.texels(), z: 0 },
            ..self.baked.as_image_copy()
        };
        let row = TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(BLOCK * 4 * TEXEL_WORDS), rows_per_image: None };
        let size = Extent3d { width: BLOCK, height: (baked.len() / row_words) as u32, depth_or_array_layers: 1 };
        queue.write_texture(into, bytemuck::cast_slice(baked), row, size);
    }
}
