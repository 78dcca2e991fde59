//! The bundle's primitives: spatially tight pieces of at most 20,000 triangles, each of one part, one texture and one detail, with the
//! light of their vertices.

use crate::details::material_kinds;
use crate::light::BakedLight;
use crate::scene::Scene;
use crate::texels::Atlas;
use crate::weathering::WeatheredAlbedo;
use half::f16;
use half::slice::HalfFloatSliceExt;
use heliodon_bundle::chunk::MAX_CHUNK_TRIANGLES;
use heliodon_bundle::site::{Detail, SiteFile};
use heliodon_bundle::{LightLayout, LitChunk, VertexLight};
use heliodon_mesh::Mesh;
use heliodon_mesh::chunk::{Chunk, split_by_kind};
use std::collections::HashMap;

/// The light of a scene's N vertices, as chunks show it.
#[derive(Clone, Copy, Debug)]
pub struct VertexValues<'a> {
    /// 1 where a vertex sees the open.
    pub valid: &'a [u8],
    /// W words for each.
    pub masks: &'a [u32],
    /// The sky transfer's numbers for each.
    pub sky: Numbers<'a>,
    /// The sun bounce's numbers for each.
    pub bounce: Numbers<'a>,
}

/// Numbers as they are held in memory.
#[derive(Clone, Copy, Debug)]
pub enum Numbers<'a> {
    /// In 32 bits each.
    Single(&'a [f32]),
    /// In 16.
    Half(&'a [f16]),
}

impl Numbers<'_> {
    /// The `width` numbers of each of `vertices`.
    fn pick(self, width: usize, vertices: &[usize]) -> Vec<f32> {
        match self {
            Self::Single(numbers) => pick(numbers, width, vertices),
            Self::Half(numbers) => pick(numbers, width, vertices).to_f32_vec(),
        }
    }
}

impl<'a> VertexValues<'a> {
    /// Those of solved light.
    #[must_use]
    pub fn of(baked: &'a BakedLight) -> Self {
        let light = &baked.light;
        let bounce = light.sun_bounce.as_ref().map_or(&[][..], |bounce| &bounce.coefficients);
        Self {
            valid: &light.validity.valid,
            masks: &baked.masks.words,
            sky: Numbers::Single(&light.sky_transfer),
            bounce: Numbers::Single(bounce),
        }
    }
}

/// Makes the chunks of a scene, part by part.
pub struct ChunkMaker<'a> {
    /// The details of each part, which may be of some of its materials; none where nobody tells.
    details: Vec<&'a [Detail]>,
    scene: &'a Scene,
    atlas: Option<&'a Atlas>,
    light: VertexValues<'a>,
    layout: LightLayout,
    weathered: Option<WeatheredAlbedo<'a>>,
}

impl<'a> ChunkMaker<'a> {
    /// For `scene`, whose vertices have `light`.
    #[must_use]
    pub fn new(scene: &'a Scene, atlas: Option<&'a Atlas>, light: VertexValues<'a>, layout: LightLayout) -> Self {
        Self { details: Vec::new(), scene, atlas, light, layout, weathered: None }
    }

    /// With the details of the site's parts.
    #[must_use]
    pub fn detailed(self, site: &'a SiteFile) -> Self {
        Self { details: site.parts.iter().map(|part| part.detail.as_slice()).collect(), ..self }
    }

    /// Pieces of a part's mesh, apart where its materials have details of their own.
    fn split(&self, part: usize, of_part: &Mesh) -> Vec<Chunk> {
        let kinds = self.details.get(part).map_or_else(Vec::new, |details| material_kinds(details, &of_part.materials));
        split_by_kind(of_part, MAX_CHUNK_TRIANGLES, &kinds)
    }

    /// With the weathered albedo of vertices; what is lit by texels has its weathering in texels.
    #[must_use]
    pub fn weathered(self, weathered: Option<WeatheredAlbedo<'a>>) -> Self {
        Self { weathered, ..self }
    }

    /// The pieces of a part; indices of their vertices count from the part's first, or are those of the atlas where it is lit by texels.
    #[must_use]
    pub fn pieces(&self, part: usize) -> Vec<Chunk> {
        if let Some((atlas, triangles)) = self.in_texels(part) {
            return self.unwrapped(part, atlas, triangles);
        }
        let range = &self.scene.parts[part];
        let mesh = &self.scene.mesh;
        let first = range.vertices.start as u32;
        let some = |array: usize| if array == 0 { 0..0 } else { range.vertices.clone() };
        // what decides the division, and only for this part
        let of_part = Mesh {
            positions: mesh.positions[range.vertices.clone()].to_vec(),
            uvs: mesh.uvs[some(mesh.uvs.len())].to_vec(),
            triangles: mesh.triangles[range.drawn_triangles()].iter().map(|t| t.map(|vertex| vertex - first)).collect(),
            triangle_material: match mesh.triangle_material.len() {
                0 => Vec::new(),
                _ => mesh.triangle_material[range.drawn_triangles()].to_vec(),
            },
            materials: mesh.materials.clone(),
            ..Mesh::default()
        };
        self.split(part, &of_part)
    }

    /// The atlas and its triangles of a part that is lit by texels.
    fn in_texels(&self, part: usize) -> Option<(&'a Atlas, &'a [[u32; 3]])> {
        let atlas = self.atlas?;
        Some((atlas, atlas.of_part(part)?))
    }

    /// The pieces of a part whose vertices are split where charts meet.
    fn unwrapped(&self, part: usize, atlas: &Atlas, triangles: &[[u32; 3]]) -> Vec<Chunk> {
        let mesh = &self.scene.mesh;
        // the part's own of all that the atlas has
        let mut own = triangles.as_flattened().to_vec();
        own.sort_unstable();
        own.dedup();
        let numbers: HashMap<u32, u32> = own.iter().copied().zip(0..).collect();
        let vertices = || own.iter().map(|&vertex| atlas.vertex(vertex));
        let of_part = Mesh {
            positions: vertices().map(|vertex| mesh.positions[vertex]).collect(),
            uvs: if mesh.uvs.is_empty() { Vec::new() } else { vertices().map(|vertex| mesh.uvs[vertex]).collect() },
            triangles: triangles.iter().map(|t| t.map(|vertex| numbers[&vertex])).collect(),
            triangle_material: match mesh.triangle_material.len() {
                0 => Vec::new(),
                _ => mesh.triangle_material[self.scene.parts[part].drawn_triangles()].to_vec(),
            },
            materials: mesh.materials.clone(),
            ..Mesh::default()
        };
        let mut pieces = self.split(part, &of_part);
        for vertex in pieces.iter_mut().flat_map(|piece| &mut piece.vertices) {
            *vertex = own[*vertex as usize];
        }
        pieces
    }

    /// The chunk of a piece; `texture` is the bundle's number of its texture.
    #[must_use]
    pub fn make(&self, part: usize, piece: &Chunk, texture: Option<u32>) -> LitChunk {
        let mesh = &self.scene.mesh;
        let first = self.scene.parts[part].vertices.start;
        let atlas = self.in_texels(part).map(|(atlas, _)| atlas);
        let vertex = |&vertex: &u32| atlas.map_or(first + vertex as usize, |atlas| atlas.vertex(vertex));
        let vertices: Vec<usize> = piece.vertices.iter().map(vertex).collect();
        // where there is a texture, it brings the rest
        let weathered = self.weathered.as_ref().filter(|_| atlas.is_none());
        let albedo = |(&vertex, &material): (&usize, &u16)| {
            let albedo = mesh.corner_albedo(vertex, material);
            weathered.map_or(albedo, |weathered| weathered.of(part, vertex, texture.map(|_| material), albedo))
        };
        LitChunk {
            part: part as u16,
            texture,
            detail: piece.kind.checked_sub(1),
            positions: vertices.iter().map(|&vertex| mesh.positions[vertex]).collect(),
            normals: vertices.iter().map(|&vertex| mesh.normals[vertex]).collect(),
            uvs: texture.map_or_else(Vec::new, |_| vertices.iter().map(|&vertex| mesh.uvs[vertex]).collect()),
            texel_uvs: atlas.map_or_else(Vec::new, |atlas| piece.vertices.iter().map(|&vertex| atlas.uv(vertex)).collect()),
            albedo: vertices.iter().zip(&piece.materials).map(albedo).collect(),
            triangles: piece.triangles.clone(),
            valid: vertices.iter().map(|&vertex| self.light.valid[vertex]).collect(),
            light: self.vertex_light(&vertices),
        }
    }

    fn vertex_light(&self, vertices: &[usize]) -> VertexLight {
        let (layout, light) = (self.layout, self.light);
        VertexLight {
            sun_steps: layout.sun_steps,
            coefficients: layout.coefficients,
            channels: layout.channels,
            sun_bounce_functions: layout.sun_bounce_functions,
            sun_mask: pick(light.masks, layout.mask_words(), vertices),
            sky_transfer: light.sky.pick(layout.transfer_floats(), vertices),
            sun_bounce: light.bounce.pick(layout.bounce_floats(), vertices),
        }
    }
}

/// The `width` values of each of `vertices`.
fn pick<T: Copy>(values: &[T], width: usize, vertices: &[usize]) -> Vec<T> {
    vertices.iter().flat_map(|&vertex| &values[vertex * width..(vertex + 1) * width]).copied().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_picked_in_the_order_of_the_vertices() {
        assert_eq!(pick(&[0, 1, 10, 11, 20, 21], 2, &[2, 0]), [20, 21, 0, 1]);
        assert_eq!(pick::<f32>(&[], 0, &[5, 7]), [0.0; 0]);
    }
}
