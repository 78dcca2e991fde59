//! The stone in GPU memory: chunks in pages, a page a texture and a handful of buffers.
//!
//! Pages exist because textures and buffers end somewhere on portable devices, and are as large as that allows because every
//! page costs a dispatch and a few bindings a frame. A chunk begins at a whole block of vertices.

use super::chunk::{KeptChunk, PreparedChunk};
use super::layout::{BLOCK, GROUP, VertexLayout};
use super::lit::LitVertices;
use super::parts::Parts;
use super::pipelines::StoneKind;
use crate::stage::texture::LevelledTexture;
use bevy::render::render_resource::{
    BindGroup, BindGroupEntries, BindGroupLayout, Buffer, BufferDescriptor, BufferUsages, Sampler, TextureViewDescriptor,
};
use bevy::render::renderer::{RenderDevice, RenderQueue};
use std::sync::{Arc, OnceLock};

/// The most indices of a page.
const MAX_INDICES: u64 = 32 << 20;

/// How much of a bundle is still to come, of what goes into the same pages: they are not made larger than that.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Remaining {
    /// Vertices.
    pub vertices: u64,
    /// Triangles.
    pub triangles: u64,
    /// Chunks.
    pub chunks: u64,
}

impl Remaining {
    /// Adds a chunk.
    pub fn add(&mut self, vertices: u64, triangles: u64) {
        self.vertices += vertices;
        self.triangles += triangles;
        self.chunks += 1;
    }

    /// What of this is left after `done`.
    #[must_use]
    pub fn after(self, done: Self) -> Self {
        Self {
            vertices: self.vertices.saturating_sub(done.vertices),
            triangles: self.triangles.saturating_sub(done.triangles),
            chunks: self.chunks.saturating_sub(done.chunks),
        }
    }

    /// Room for vertices and indices in a page of these, of which `vertices` and `indices` come next.
    fn room(self, layout: VertexLayout, vertices: u32, indices: u32) -> (u32, u32) {
        let wanted_vertices = in_blocks(self.vertices + self.chunks * u64::from(BLOCK));
        let wanted_indices = self.triangles * 3 + self.chunks * 2;
        let most = u64::from(LitVertices::most(layout));
        let room = wanted_vertices.min(most).max(u64::from(vertices));
        // Where not all vertices fit, neither need all indices; chunks have more triangles a vertex here and fewer there.
        let share = room as f64 / wanted_vertices.max(1) as f64 * INDEX_SLACK;
        let index_room = (wanted_indices as f64 * share.min(1.0)).ceil() as u64;
        (room as u32, index_room.min(MAX_INDICES).max(u64::from(indices)) as u32)
    }
}

/// How many times a page's share of the indices it has room for.
const INDEX_SLACK: f64 = 1.125;

/// Buffers that several chunks share.
#[derive(Debug)]
pub struct Page {
    /// Positions, 12 bytes a vertex.
    pub positions: Buffer,
    /// Albedo roots, 4 bytes a vertex.
    pub albedo: Buffer,
    /// Of what stone it is.
    kind: StoneKind,
    /// Texture coordinates, 8 bytes a vertex, in pages of all but plain chunks.
    pub uvs: Option<Buffer>,
    /// Normals and places in the atlas, 12 bytes a vertex, in pages of chunks that are lit by texels.
    pub texels: Option<PageTexels>,
    /// What lights its vertices.
    pub lit: LitVertices,
    /// 16-bit indices.
    pub indices: Buffer,
    /// Normals, where lamps need them.
    pub normals: Option<PageNormals>,
    capacity: (u32, u32),
    used: (u32, u32),
}

/// What a page of chunks that are lit by texels has for it.
#[derive(Debug)]
pub struct PageTexels {
    /// Normals, 4 bytes a vertex: 2 x snorm16 on the octahedron.
    pub normals: Buffer,
    /// Places in the atlas, 8 bytes a vertex.
    pub uvs: Buffer,
}

/// A page's normals, 4 bytes a vertex: 2 x snorm16 on the octahedron.
#[derive(Debug)]
pub struct PageNormals {
    /// The normals.
    pub buffer: Buffer,
    /// What makes them binds.
    pub bind_group: BindGroup,
}

/// A chunk in a page.
#[derive(Debug)]
pub struct GpuChunk {
    /// Index of the page.
    pub page: usize,
    /// The first vertex, a multiple of [`BLOCK`].
    pub base_vertex: u32,
    /// The first index.
    pub first_index: u32,
    /// Clusters and bounds.
    pub kept: Arc<KeptChunk>,
    /// Its parts, once they are drawn by the processor.
    pub parts: OnceLock<Parts>,
    /// Index of its part.
    pub part: u16,
    /// Index of the bundle's texture.
    pub texture: Option<u32>,
    /// Number of its detail.
    pub detail: Option<u32>,
    /// Where its colour and its light come from.
    pub kind: StoneKind,
    /// Whether it is part of closed bodies only: their backs are not drawn.
    pub closed: bool,
    /// The moments, by their serial numbers, whose light the groups of vertices have.
    pub lit_at: Vec<u64>,
}

impl GpuChunk {
    /// Its parts, which the first call makes.
    pub fn parts(&self) -> &Parts {
        self.parts.get_or_init(|| Parts::new(&self.kept))
    }
}

/// A base colour image.
#[derive(Debug)]
pub struct GpuTexture {
    /// What the stone shader binds.
    pub bind_group: BindGroup,
    /// The image.
    pub texture: LevelledTexture,
    /// How it is read.
    pub sampler: Sampler,
}

impl Page {
    fn new(
        device: &RenderDevice,
        layout: VertexLayout,
        light_layout: &BindGroupLayout,
        vertices: u32,
        indices: u32,
        kind: StoneKind,
    ) -> Self {
        let buffer = |label: &'static str, bytes: u64, usage: BufferUsages| {
            device.create_buffer(&BufferDescriptor {
                label: Some(label),
                size: bytes.next_multiple_of(4).max(4),
                usage: usage | BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        };
        let count = u64::from(vertices);
        Self {
            positions: buffer("stone_positions", count * 12, BufferUsages::VERTEX),
            albedo: buffer("stone_albedo", count * 4, BufferUsages::VERTEX),
            kind,
            uvs: (kind != StoneKind::Plain).then(|| buffer("stone_uvs", count * 8, BufferUsages::VERTEX)),
            texels: (kind == StoneKind::Texels).then(|| PageTexels {
                normals: buffer("stone_texel_normals", count * 4, BufferUsages::VERTEX),
                uvs: buffer("stone_texel_uvs", count * 8, BufferUsages::VERTEX),
            }),
            lit: LitVertices::new(device, layout, light_layout, vertices),
            indices: buffer("stone_indices", u64::from(indices) * 2, BufferUsages::INDEX),
            normals: None,
            capacity: (vertices, indices),
            used: (0, 0),
        }
    }

    /// Makes room for normals; answers with how many workgroups of [`BLOCK`] fill it.
    pub fn want_normals(&mut self, device: &RenderDevice, layout: &BindGroupLayout) -> u32 {
        let buffer = device.create_buffer(&BufferDescriptor {
            label: Some("stone_normals"),
            size: u64::from(self.capacity.0) * 4,
            usage: BufferUsages::STORAGE | BufferUsages::VERTEX,
            mapped_at_creation: false,
        });
        let view = self.lit.baked.create_view(&TextureViewDescriptor::default());
        let entries = BindGroupEntries::sequential((&view, buffer.as_entire_buffer_binding()));
        let bind_group = device.create_bind_group("stone_normals", layout, &entries);
        self.normals = Some(PageNormals { buffer, bind_group });
        self.capacity.0 / BLOCK
    }

    /// Vertices for which it has room: whole blocks.
    #[must_use]
    pub fn vertex_room(&self) -> u32 {
        self.capacity.0
    }

    fn fits(&self, vertices: u32, indices: u32, kind: StoneKind) -> bool {
        self.kind == kind && self.used.0 + vertices <= self.capacity.0 && self.used.1 + indices <= self.capacity.1
    }
}

/// Vertices rounded up to whole blocks.
fn in_blocks(vertices: u64) -> u64 {
    vertices.next_multiple_of(u64::from(BLOCK))
}

/// Puts a chunk into a page that has room, or into a new one for what is `remaining`, this chunk included.
pub fn upload(
    device: &RenderDevice,
    queue: &RenderQueue,
    layout: VertexLayout,
    light_layout: &BindGroupLayout,
    pages: &mut Vec<Page>,
    chunk: &PreparedChunk,
    remaining: Remaining,
) -> GpuChunk {
    let kept = &chunk.kept;
    let kind = chunk.kind;
    let vertices = in_blocks(kept.positions.len() as u64) as u32;
    let index_count = kept.indices.len() as u32;
    // Writes are in multiples of four bytes, so that an odd number of indices takes one more.
    let indices = index_count.next_multiple_of(2);
    let page = match pages.iter().position(|page| page.fits(vertices, indices, kind)) {
        Some(page) => page,
        None => {
            let (room, index_room) = remaining.room(layout, vertices, indices);
            pages.push(Page::new(device, layout, light_layout, room, index_room, kind));
            pages.len() - 1
        }
    };
    let to = &mut pages[page];
    let (base_vertex, first_index) = to.used;
    to.used = (base_vertex + vertices, first_index + indices);
    let at = u64::from(base_vertex);
    queue.write_buffer(&to.positions, at * 12, bytemuck::cast_slice(&kept.positions));
    queue.write_buffer(&to.albedo, at * 4, bytemuck::cast_slice(&kept.albedo));
    if let Some(uvs) = &to.uvs {
        queue.write_buffer(uvs, at * 8, bytemuck::cast_slice(&chunk.uvs));
    }
    if let Some(texels) = &to.texels {
        queue.write_buffer(&texels.normals, at * 4, bytemuck::cast_slice(&chunk.normals));
        queue.write_buffer(&texels.uvs, at * 8, bytemuck::cast_slice(&chunk.texel_uvs));
    }
    to.lit.write(queue, layout, base_vertex, &chunk.baked);
    if kept.indices.len().is_multiple_of(2) {
        queue.write_buffer(&to.indices, u64::from(first_index) * 2, bytemuck::cast_slice(&kept.indices));
    } else {
        let padded: Vec<u16> = kept.indices.iter().copied().chain([0]).collect();
        queue.write_buffer(&to.indices, u64::from(first_index) * 2, bytemuck::cast_slice(&padded));
    }
    GpuChunk {
        page,
        base_vertex,
        first_index,
        kept: Arc::clone(kept),
        parts: OnceLock::new(),
        part: chunk.part,
        texture: chunk.texture,
        detail: chunk.detail,
        kind,
        closed: false,
        lit_at: vec![0; kept.positions.len().div_ceil(GROUP as usize)],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use heliodon_bundle::LightLayout;

    #[test]
    fn pages_have_room_for_what_comes_and_little_more() {
        let layout = VertexLayout(LightLayout { sun_steps: 92, coefficients: 4, channels: 3, sun_bounce_functions: 28 });
        let all = Remaining { vertices: 3_000_000, triangles: 5_800_000, chunks: 400 };
        let mut left = all;
        let (mut vertices, mut indices) = (0u64, 0u64);
        while left.chunks > 0 {
            let (room, index_room) = left.room(layout, 10_240, 58_000);
            assert!(room <= LitVertices::most(layout));
            (vertices, indices) = (vertices + u64::from(room), indices + u64::from(index_room));
            let chunks = (u64::from(room) / 7_756).min(u64::from(index_room) / 43_502).min(left.chunks);
            assert!(chunks > 0, "a page takes a chunk");
            left = left.after(Remaining { vertices: chunks * 7_500, triangles: chunks * 14_500, chunks });
        }
        assert!(vertices < all.vertices * 6 / 5 && indices < all.triangles * 3 * 6 / 5, "{vertices} {indices}");
    }

    #[test]
    fn a_small_bundle_takes_one_page_of_its_size() {
        let layout = VertexLayout(LightLayout { sun_steps: 1, coefficients: 4, channels: 1, sun_bounce_functions: 0 });
        let all = Remaining { vertices: 100, triangles: 30, chunks: 1 };
        assert_eq!(all.room(layout, 256, 90), (512, 92));
        assert_eq!(Remaining::default().room(layout, 256, 90), (256, 90), "what was not announced has room all the same");
    }
}
