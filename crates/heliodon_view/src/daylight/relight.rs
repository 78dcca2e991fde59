//! Stone lit pixel by pixel, where a processor draws.
//!
//! Once it is known which triangle each pixel shows (raster.rs), each pixel has three vertices, their weights and its albedo, and takes the
//! vertices' light of the moment from a texture, whatever the number of triangles. It is the picture that drawing them gives, to a
//! code of 255: weights have 16 bits, the albedo's roots ten.

use super::flat::flat_texture;
use super::layout::BLOCK;
use super::lit::LitVertices;
use super::pages::Page;
use super::raster::NUMBER_BITS;
use bevy::prelude::*;
use bevy::render::renderer::{RenderDevice, RenderQueue};
use wgpu::{
    CommandEncoder, Extent3d, TexelCopyBufferInfo, TexelCopyBufferLayout, TexelCopyTextureInfo, Texture, TextureFormat,
    TextureUsages, TextureView, TextureViewDescriptor,
};

/// Bytes of a vertex's light.
const LIGHT_BYTES: u32 = 8;

/// The row of the light's texture at which each of these begins, and how many there are.
fn rows<'a>(all: impl Iterator<Item = &'a LitVertices>) -> (Vec<u32>, u32) {
    let mut end = 0;
    let begins = all.map(|lit| {
        let begin = end;
        end += lit.blocks();
        begin
    });
    (begins.collect(), end)
}

/// Whether no stone has a texture: another bundle may have one in pages of the same size.
fn are_plain(pages: &[Page]) -> bool {
    pages.iter().all(|page| page.uvs.is_none())
}

/// What a picture is lit from, on the GPU.
#[derive(Debug)]
pub struct Relight {
    /// Vertices, weights and albedo of each pixel.
    pub pixels: TextureView,
    /// Its depth.
    pub depth: TextureView,
    /// The light of all pages' vertices.
    pub light: TextureView,
    textures: [Texture; 3],
    /// The row of the light at which each page begins.
    pub page_rows: Vec<u32>,
}

impl Relight {
    /// For pictures of this size of what pages hold. None where stone has textures, whose albedo is not known here, or where there are more vertices than a texture holds.
    #[must_use]
    pub fn new(device: &RenderDevice, pages: &[Page], size: UVec2) -> Option<Self> {
        if are_plain(pages) { Self::of(device, pages.iter().map(|page| &page.lit), size) } else { None }
    }

    /// For pictures of this size that take the light of these. None where there are more vertices than a texture holds.
    #[must_use]
    pub fn of<'a>(device: &RenderDevice, all: impl Iterator<Item = &'a LitVertices>, size: UVec2) -> Option<Self> {
        let (page_rows, light_rows) = rows(all);
        let most_rows = device.limits().max_texture_dimension_2d.min((1 << NUMBER_BITS) / BLOCK);
        if light_rows == 0 || light_rows > most_rows {
            return None;
        }
        let usage = TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_DST;
        let texture = |label, size, format| flat_texture(device, label, size, format, usage);
        let textures = [
            texture("relight_pixels", size, TextureFormat::Rgba32Uint),
            texture("relight_depth", size, TextureFormat::R32Float),
            texture("relight_light", UVec2::new(BLOCK, light_rows), TextureFormat::Rgba16Float),
        ];
        let [pixels, depth, light] = textures.each_ref().map(|texture| texture.create_view(&TextureViewDescriptor::default()));
        Some(Self { pixels, depth, light, textures, page_rows })
    }

    /// Whether it is for pictures of this size of what these pages hold.
    #[must_use]
    pub fn is(&self, size: UVec2, pages: &[Page]) -> bool {
        let [pixels, _, light] = &self.textures;
        let (page_rows, light_rows) = rows(pages.iter().map(|page| &page.lit));
        let same = page_rows == self.page_rows && light.height() == light_rows && are_plain(pages);
        same && UVec2::new(pixels.width(), pixels.height()) == size
    }

    /// Takes what the pixels show: [`super::raster::Raster::words`] and [`super::raster::Raster::depth`].
    pub fn show(&self, queue: &RenderQueue, words: &[[u32; 4]], depths: &[f32]) {
        let [pixels, depth, _] = &self.textures;
        let write = |texture: &Texture, bytes: &[u8], of_pixel: u32| {
            let row =
                TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(texture.width() * of_pixel), rows_per_image: None };
            queue.write_texture(texture.as_image_copy(), bytes, row, texture.size());
        };
        write(pixels, bytemuck::cast_slice(words), 16);
        write(depth, bytemuck::cast_slice(depths), 4);
    }

    /// Takes the light of the moment.
    pub fn light<'a>(&self, encoder: &mut CommandEncoder, all: impl Iterator<Item = &'a LitVertices>) {
        let [_, _, light] = &self.textures;
        for (lit, &y) in all.zip(&self.page_rows) {
            let layout = TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(BLOCK * LIGHT_BYTES), rows_per_image: None };
            let to = TexelCopyTextureInfo { origin: wgpu::Origin3d { x: 0, y, z: 0 }, ..light.as_image_copy() };
            let size = Extent3d { width: BLOCK, height: lit.blocks(), depth_or_array_layers: 1 };
            encoder.copy_buffer_to_texture(TexelCopyBufferInfo { buffer: &lit.light, layout }, to, size);
        }
    }
}
