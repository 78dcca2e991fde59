//! A chunk of the bundle made ready for the GPU, on the loading thread.

use super::cluster::{Cluster, cluster};
use super::layout::{Baked, VertexLayout, albedo_roots, pack};
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

/// What the GPU gets of a chunk.
#[derive(Clone, Debug)]
pub struct PreparedChunk {
    /// What stays.
    pub kept: Arc<KeptChunk>,
    /// Texture coordinates, where the chunk has a texture.
    pub uvs: Vec<Vec2>,
    /// The baked light, as [`pack`] lays it.
    pub baked: Vec<u32>,
    /// Index of the bundle's texture.
    pub texture: Option<u32>,
}

impl PreparedChunk {
    /// Clusters the triangles, drops vertices that none uses, and packs what remains.
    #[must_use]
    pub fn new(layout: VertexLayout, chunk: &LitChunk) -> Self {
        let made = cluster(&chunk.positions, &chunk.triangles);
        let order = &made.vertices;
        let positions: Vec<Vec3> = order.iter().map(|&v| chunk.positions[v as usize]).collect();
        let bounds = positions.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), &p| (low.min(p), high.max(p)));
        Self {
            uvs: match chunk.texture {
                Some(_) => order.iter().map(|&v| chunk.uvs[v as usize]).collect(),
                None => Vec::new(),
            },
            baked: pack(layout, Baked { normals: &chunk.normals, light: &chunk.light }, order),
            kept: Arc::new(KeptChunk {
                positions,
                indices: made.indices,
                clusters: made.clusters,
                bounds,
                albedo: order.iter().map(|&v| albedo_roots(chunk.albedo[v as usize])).collect(),
            }),
            texture: chunk.texture,
        }
    }
}
