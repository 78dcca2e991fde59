//! The picture in display codes, where a processor draws.
//!
//! llvmpipe reads, decodes, blends and encodes all of each 4 x 4 block of an sRGB target that a triangle touches, in floats: some 700
//! instructions a block, whatever the shader does. Of a target without transfer function it only stores bytes. There the shaders
//! encode, as they do for all targets that do not, and the bytes are copied into Bevy's main texture, for the rest of the frame is Bevy's.

use super::flat::flat_texture;
use bevy::math::UVec2;
use bevy::render::camera::ExtractedCamera;
use bevy::render::renderer::RenderDevice;
use bevy::render::view::ViewTarget;
use heliodon_math::color::srgb_from_linear;
use wgpu::{
    Color, CommandEncoder, Extent3d, LoadOp, Operations, RenderPassColorAttachment, StoreOp, Texture, TextureFormat,
    TextureUsages, TextureView, TextureViewDescriptor,
};

/// The format of the codes of a main texture of `format`, if it can be drawn in codes: between the two textures are copied.
#[must_use]
pub fn codes_format(format: TextureFormat, usages: TextureUsages, camera: &ExtractedCamera) -> Option<TextureFormat> {
    let whole = camera.viewport.is_none() && usages.contains(TextureUsages::COPY_DST | TextureUsages::COPY_SRC);
    (whole && format.is_srgb()).then(|| format.remove_srgb_suffix())
}

/// A camera's picture in display codes.
#[derive(Debug)]
pub struct Encoded {
    texture: Texture,
    view: TextureView,
}

impl Encoded {
    /// A picture of this size and format.
    #[must_use]
    pub fn new(device: &RenderDevice, size: UVec2, format: TextureFormat) -> Self {
        let usage = TextureUsages::RENDER_ATTACHMENT | TextureUsages::COPY_SRC | TextureUsages::COPY_DST;
        let texture = flat_texture(device, "stone_codes", size, format, usage);
        let view = texture.create_view(&TextureViewDescriptor::default());
        Self { texture, view }
    }

    /// Whether it is of this size and format.
    #[must_use]
    pub fn is(&self, size: UVec2, format: TextureFormat) -> bool {
        self.texture.size() == Extent3d { width: size.x, height: size.y, depth_or_array_layers: 1 }
            && self.texture.format() == format
    }

    /// Begins with what `target` begins with: its colour, or what other cameras drew.
    pub fn begin(&self, encoder: &mut CommandEncoder, target: &ViewTarget) -> LoadOp<Color> {
        // Bevy clears at the first pass of a frame, which from its sight this one is.
        match target.get_color_attachment().ops.load {
            LoadOp::Clear(Color { r, g, b, a }) => {
                let [r, g, b] = [r, g, b].map(|v| f64::from(srgb_from_linear(v as f32)));
                LoadOp::Clear(Color { r, g, b, a })
            }
            load => {
                copy(encoder, target.main_texture(), &self.texture);
                load
            }
        }
    }

    /// What a pass draws to.
    #[must_use]
    pub fn attachment(&self, load: LoadOp<Color>) -> RenderPassColorAttachment<'_> {
        let ops = Operations { load, store: StoreOp::Store };
        RenderPassColorAttachment { view: &self.view, depth_slice: None, resolve_target: None, ops }
    }

    /// Gives the picture to Bevy.
    pub fn end(&self, encoder: &mut CommandEncoder, target: &ViewTarget) {
        copy(encoder, &self.texture, target.main_texture());
    }
}

/// Copies the bytes: the formats differ in their transfer function alone.
fn copy(encoder: &mut CommandEncoder, from: &Texture, to: &Texture) {
    encoder.copy_texture_to_texture(from.as_image_copy(), to.as_image_copy(), from.size());
}
