//! A chunk of the bundle made ready for the GPU, on the loading thread.

use super::cluster::{Cluster, cluster};
use super::layout::{Baked, VertexLayout, albedo_roots, octahedral, pack};
use super::pipelines::StoneKind;
use glam::{Vec2, Vec3};
use heliodon_bundle::LitChunk;
use std::sync::Arc;

/// What stays in main memory of a chunk: positions and indices for walking, clusters for culling.
#[derive(Clone, Debug)]
pub struct KeptChunk {
    /// World positions.
    pub positions: Vec<Vec3>,
    /// Three a triangle, cluster by cluster.
    pub indices: Vec<u16>,
    /// The clusters.
    pub clusters: Vec<Cluster>,
    /// Least and greatest corner.
    pub bounds: (Vec3, Vec3),
    /// [`albedo_roots`] of each vertex.
    pub albedo: Vec<u32>,
}

impl KeptChunk {
    /// The vertices of a triangle.
    #[must_use]
    pub fn triangle(&self, number: u32) -> [u16; 3] {
        let at = 3 * number as usize;
        [self.indices[at], self.indices[at + 1], self.indices[at + 2]]
    }
}

/// Where the colour and the light of a chunk with this texture come from, in a bundle with or without a panorama.
#[must_use]
pub fn stone_kind(texture: Option<u32>, by_texels: bool, panorama: bool) -> StoneKind {
    match (by_texels, panorama, texture) {
        (true, ..) => StoneKind::Texels,
        (false, true, _) => StoneKind::Panorama,
        (false, false, Some(_)) => StoneKind::Textured,
        (false, false, None) => StoneKind::Plain,
    }
}

/// What the GPU gets of a chunk.
#[derive(Clone, Debug)]
pub struct PreparedChunk {
    /// What stays.
    pub kept: Arc<KeptChunk>,
    /// Texture coordinates, where the chunk has a texture, is lit by texels or shows a panorama.
    pub uvs: Vec<Vec2>,
    /// Places in the atlas of light in texels, where it is lit by that,
    pub texel_uvs: Vec<Vec2>,
    /// and normals then, [`octahedral`].
    pub normals: Vec<u32>,
    /// The baked light, as [`pack`] lays it.
    pub baked: Vec<u32>,
    /// Index of its part.
    pub part: u16,
    /// Index of the bundle's texture.
    pub texture: Option<u32>,
    /// Number of its detail.
    pub detail: Option<u32>,
    /// Where its colour and its light come from.
    pub kind: StoneKind,
}

impl PreparedChunk {
    /// What the most of it takes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.baked.len() * 4 + self.kept.positions.len() * 16
    }

    /// Clusters the triangles, drops vertices that none uses, and packs what remains; of a bundle with or without a panorama.
    #[must_use]
    pub fn new(layout: VertexLayout, chunk: &LitChunk, panorama: bool) -> Self {
        let made = cluster(&chunk.positions, &chunk.triangles);
        let order = &made.vertices;
        let positions: Vec<Vec3> = order.iter().map(|&v| chunk.positions[v as usize]).collect();
        let bounds = positions.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), &p| (low.min(p), high.max(p)));
        let by_texels = !chunk.texel_uvs.is_empty();
        let kind = stone_kind(chunk.texture, by_texels, panorama);
        Self {
            kind,
            uvs: match chunk.texture {
                Some(_) => order.iter().map(|&v| chunk.uvs[v as usize]).collect(),
                None if kind != StoneKind::Plain => vec![Vec2::ZERO; order.len()],
                None => Vec::new(),
            },
            texel_uvs: if by_texels { order.iter().map(|&v| chunk.texel_uvs[v as usize]).collect() } else { Vec::new() },
            normals: if by_texels {
                order.iter().map(|&v| octahedral(chunk.normals[v as usize])).collect()
            } else {
                Vec::new()
            },
            baked: pack(layout, Baked { normals: &chunk.normals, light: &chunk.light }, order),
            kept: Arc::new(KeptChunk {
                positions,
                indices: made.indices,
                clusters: made.clusters,
                bounds,
                albedo: order.iter().map(|&v| albedo_roots(chunk.albedo[v as usize])).collect(),
            }),
            part: chunk.part,
            texture: chunk.texture,
            detail: None,
        }
    }
}
