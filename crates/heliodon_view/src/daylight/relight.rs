//! An eye at rest, lit pixel by pixel.
//!
//! While the day passes before an eye at rest nothing changes but the light of vertices. Where a processor draws, putting the same
//! triangles through its front end again, one after the other, is half of a frame. Once it is known which triangle each pixel shows
//! (sight.rs), each pixel's three vertices, their weights and its albedo are worked out once; the frames after that take the light
//! of the vertices from a texture, whatever the number of triangles, and the depth from a copy. It is the picture that drawing them
//! gives, to a code of 255: weights have 16 bits, the albedo's roots ten.

use super::layout::BLOCK;
use super::pages::{GpuChunk, Page};
use super::seen::Seen;
use bevy::prelude::*;
use bevy::render::renderer::{RenderDevice, RenderQueue};
use bevy::render::view::ViewDepthTexture;
use bevy::tasks::ComputeTaskPool;
use glam::{DMat3, DVec3};
use wgpu::{
    CommandEncoder, Extent3d, StoreOp, TexelCopyBufferInfo, TexelCopyBufferLayout, TexelCopyTextureInfo, Texture,
    TextureDescriptor, TextureDimension, TextureFormat, TextureUsages, TextureView, TextureViewDescriptor,
};

/// What a pixel without stone holds.
const NO_STONE: [u32; 4] = [u32::MAX; 4];
/// Bits of a vertex's number.
const NUMBER_BITS: u32 = 22;
/// Rows of pixels that one task does.
const TASK_ROWS: usize = 32;
/// Bytes of a vertex's light.
const LIGHT_BYTES: u32 = 8;

/// What the picture of an eye at rest is made of, on the GPU.
#[derive(Debug)]
pub struct Relight {
    /// Vertices, weights and albedo of each pixel.
    pub pixels: TextureView,
    /// The light of all pages' vertices.
    pub light: TextureView,
    light_texture: Texture,
    depth: Texture,
    is_depth_known: bool,
}

/// The row of the light's texture at which each page begins, and how many there are.
fn rows(pages: &[Page]) -> (Vec<u32>, u32) {
    let mut end = 0;
    let mut begins = Vec::with_capacity(pages.len());
    for page in pages {
        begins.push(end);
        end += page.vertex_room() / BLOCK;
    }
    (begins, end)
}

impl Relight {
    /// Of what each pixel shows, by its number in the order of drawing plus 1. None where stone has textures, whose albedo is not known here, or where there
    /// are more vertices than a texture holds.
    #[must_use]
    pub fn new(
        (device, queue): (&RenderDevice, &RenderQueue),
        (pages, chunks): (&[Page], &[GpuChunk]),
        (seen, clip_from_world): (&Seen, &Mat4),
        (numbers, size): (&[u32], UVec2),
    ) -> Option<Self> {
        let (begins, light_rows) = rows(pages);
        let most_rows = device.limits().max_texture_dimension_2d.min((1 << NUMBER_BITS) / BLOCK);
        if light_rows == 0 || light_rows > most_rows || chunks.iter().any(|chunk| chunk.texture.is_some()) {
            return None;
        }
        let texture = |label, width, height, format, usage| {
            device.wgpu_device().create_texture(&TextureDescriptor {
                label: Some(label),
                size: Extent3d { width, height, depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: TextureDimension::D2,
                format,
                usage: usage | TextureUsages::COPY_DST,
                view_formats: &[],
            })
        };
        let read = TextureUsages::TEXTURE_BINDING;
        let pixels = texture("relight_pixels", size.x, size.y, TextureFormat::Rgba32Uint, read);
        let triangles: Vec<Corners> =
            seen.shown().map(|(chunk, number)| Corners::new(&chunks[chunk as usize], &begins, number)).collect();
        let words = words(&triangles, clip_from_world, numbers, size);
        let row = TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(size.x * 16), rows_per_image: None };
        queue.write_texture(pixels.as_image_copy(), bytemuck::cast_slice(&words), row, pixels.size());
        let light_texture = texture("relight_light", BLOCK, light_rows, TextureFormat::Rgba16Float, read);
        let view = |texture: &Texture| texture.create_view(&TextureViewDescriptor::default());
        Some(Self {
            pixels: view(&pixels),
            light: view(&light_texture),
            light_texture,
            depth: texture("relight_depth", size.x, size.y, TextureFormat::Depth32Float, TextureUsages::COPY_SRC),
            is_depth_known: false,
        })
    }

    /// Whether a frame has given it its depth.
    #[must_use]
    pub fn is_ready(&self) -> bool {
        self.is_depth_known
    }

    /// Takes the depth of the stone that was drawn.
    pub fn take_depth(&mut self, encoder: &mut CommandEncoder, depth: &ViewDepthTexture) {
        encoder.copy_texture_to_texture(depth.texture.as_image_copy(), self.depth.as_image_copy(), self.depth.size());
        self.is_depth_known = true;
    }

    /// Gives the depth to Bevy, and takes the light of the moment.
    pub fn begin(&self, encoder: &mut CommandEncoder, depth: &ViewDepthTexture, pages: &[Page]) {
        // Bevy clears at the first pass of a frame, which from its sight this one is.
        let _ = depth.get_attachment(StoreOp::Store);
        encoder.copy_texture_to_texture(self.depth.as_image_copy(), depth.texture.as_image_copy(), self.depth.size());
        let (begins, _) = rows(pages);
        for (page, y) in pages.iter().zip(begins) {
            let layout = TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(BLOCK * LIGHT_BYTES), rows_per_image: None };
            let to = TexelCopyTextureInfo { origin: wgpu::Origin3d { x: 0, y, z: 0 }, ..self.light_texture.as_image_copy() };
            let size = Extent3d { width: BLOCK, height: page.vertex_room() / BLOCK, depth_or_array_layers: 1 };
            encoder.copy_buffer_to_texture(TexelCopyBufferInfo { buffer: &page.light, layout }, to, size);
        }
    }
}

/// A triangle that shows.
#[derive(Clone, Copy, Debug)]
struct Corners {
    places: [Vec3; 3],
    vertices: [u32; 3],
    albedo: [Vec3; 3],
}

impl Corners {
    fn new(chunk: &GpuChunk, begins: &[u32], number: u32) -> Self {
        let corners = chunk.kept.triangle(number).map(usize::from);
        let first = begins[chunk.page] * BLOCK + chunk.base_vertex;
        Self {
            places: corners.map(|vertex| chunk.kept.positions[vertex]),
            vertices: corners.map(|vertex| first + vertex as u32),
            albedo: corners.map(|vertex| {
                let word = chunk.kept.albedo[vertex];
                let root = UVec3::new(word, word >> 10, word >> 20) & 1023;
                root.as_vec3() * root.as_vec3() / (1023.0 * 1023.0)
            }),
        }
    }

    /// From a place in the picture, in [-1, 1] and 1, to the weights of the corners, times any number.
    fn weights_from_clip(&self, clip_from_world: &Mat4) -> DMat3 {
        let [a, b, c] = self.places.map(|place| {
            let clip = clip_from_world.as_dmat4() * place.as_dvec3().extend(1.0);
            DVec3::new(clip.x, clip.y, clip.w)
        });
        // the inverse of (a, b, c) times its determinant, which is the same for all three weights
        DMat3::from_cols(b.cross(c), c.cross(a), a.cross(b)).transpose()
    }

    fn words(&self, weights_from_clip: &DMat3, clip: DVec3) -> [u32; 4] {
        let weights = *weights_from_clip * clip;
        let sum = weights.element_sum();
        let weights = if sum == 0.0 { DVec3::X } else { weights / sum };
        let code = |weight: f64| ((weight + 0.5).clamp(0.0, 2.0) * 0.5 * 65535.0 + 0.5) as u32;
        let inside = weights.as_vec3();
        let albedo = self.albedo[0] * inside.x + self.albedo[1] * inside.y + self.albedo[2] * inside.z;
        let root = albedo.clamp(Vec3::ZERO, Vec3::ONE).map(|v| v.sqrt() * 1023.0 + 0.5).as_uvec3();
        let [a, b, c] = [0, 1, 2].map(|k| self.vertices[k] | root[k] << NUMBER_BITS);
        [a, b, c, code(weights.y) | code(weights.z) << 16]
    }
}

/// The words of all pixels.
fn words(triangles: &[Corners], clip_from_world: &Mat4, numbers: &[u32], size: UVec2) -> Vec<[u32; 4]> {
    let width = size.x as usize;
    let mut words = vec![NO_STONE; numbers.len()];
    let to_clip = 2.0 / size.as_dvec2();
    ComputeTaskPool::get().scope(|scope| {
        let bands = words.chunks_mut(width * TASK_ROWS).zip(numbers.chunks(width * TASK_ROWS));
        for (band, (words, numbers)) in bands.enumerate() {
            scope.spawn(async move {
                // neighbours often show the same triangle
                let mut known = (u32::MAX, DMat3::ZERO);
                for (at, (words, &number)) in words.iter_mut().zip(numbers).enumerate() {
                    let Some(triangle) = number.checked_sub(1).and_then(|number| triangles.get(number as usize)) else {
                        continue;
                    };
                    if known.0 != number {
                        known = (number, triangle.weights_from_clip(clip_from_world));
                    }
                    let (x, y) = (at % width, band * TASK_ROWS + at / width);
                    let clip = DVec3::new((x as f64 + 0.5) * to_clip.x - 1.0, 1.0 - (y as f64 + 0.5) * to_clip.y, 1.0);
                    *words = triangle.words(&known.1, clip);
                }
            });
        }
    });
    words
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_are_those_of_the_place_that_a_pixel_shows() {
        let places = [Vec3::new(-3.0, -1.0, -4.0), Vec3::new(2.0, -1.5, -9.0), Vec3::new(0.5, 2.0, -6.0)];
        let triangle = Corners { places, vertices: [7, 8, 4_000_000], albedo: [Vec3::splat(0.25), Vec3::ONE, Vec3::ZERO] };
        let clip_from_world = Mat4::perspective_infinite_reverse_rh(1.0, 1.5, 0.1);
        for wanted in [Vec3::new(0.2, 0.3, 0.5), Vec3::X, Vec3::new(0.9, 0.05, 0.05), Vec3::new(0.6, 0.6, -0.2)] {
            let place = places[0] * wanted.x + places[1] * wanted.y + places[2] * wanted.z;
            let clip = clip_from_world * place.extend(1.0);
            let clip = DVec3::new((clip.x / clip.w).into(), (clip.y / clip.w).into(), 1.0);
            let words = triangle.words(&triangle.weights_from_clip(&clip_from_world), clip);
            let weight = |code: u32| code as f32 * (2.0 / 65535.0) - 0.5;
            assert!((weight(words[3] & 0xffff) - wanted.y).abs() < 3e-5 && (weight(words[3] >> 16) - wanted.z).abs() < 3e-5);
            assert_eq!([0, 1, 2].map(|k| words[k] & 0x3f_ffff), [7, 8, 4_000_000]);
            let albedo = (0.25 * wanted.x + wanted.y).clamp(0.0, 1.0);
            assert!(((words[0] >> NUMBER_BITS) as f32 / 1023.0 - albedo.sqrt()).abs() < 6e-4);
        }
    }
}
