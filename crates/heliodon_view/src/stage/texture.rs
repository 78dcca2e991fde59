//! Base colour images on the GPU, with their smaller levels, which the loading thread makes and the render thread only copies.

use crate::tonemap::codes;
use bevy::render::render_resource::*;
use bevy::render::renderer::{RenderDevice, RenderQueue};
use glam::Vec3;
use heliodon_image::{SrgbImage, TextureWrap};

/// A level of a base colour image.
#[derive(Clone, Debug)]
pub struct Level {
    /// Index of the image in the bundle.
    pub texture: usize,
    /// How the image goes on along u and v.
    pub wrap: [TextureWrap; 2],
    /// Half the size of the level before it.
    pub image: SrgbImage,
}

/// Half the size, averaged in linear light; `decode` is the table of sRGB codes.
pub(crate) fn halved(image: &SrgbImage, decode: &[f32; 256]) -> SrgbImage {
    let (width, height) = ((image.width / 2).max(1), (image.height / 2).max(1));
    let mut pixels = Vec::with_capacity(width as usize * height as usize);
    for y in 0..height {
        for x in 0..width {
            let (mut sum, mut alpha) = (Vec3::ZERO, 0);
            for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                let column = (2 * x + dx).min(image.width - 1);
                let row = (2 * y + dy).min(image.height - 1);
                let [r, g, b, a] = image.pixels[row as usize * image.width as usize + column as usize];
                sum += Vec3::from([r, g, b].map(|code| decode[usize::from(code)]));
                alpha += u16::from(a);
            }
            let [r, g, b] = codes::nearest(sum * 0.25);
            pixels.push([r, g, b, ((alpha + 2) / 4) as u8]);
        }
    }
    SrgbImage { width, height, pixels }
}

/// An image on the GPU, while its levels come in.
#[derive(Debug)]
pub struct LevelledTexture {
    texture: Texture,
    written: u32,
}

impl LevelledTexture {
    /// A texture that begins with `level`; `None` if that is larger than the device takes.
    pub fn new(device: &RenderDevice, level: &SrgbImage) -> Option<Self> {
        if level.width.max(level.height) > device.limits().max_texture_dimension_2d {
            return None;
        }
        let size = Extent3d { width: level.width, height: level.height, depth_or_array_layers: 1 };
        let texture = device.create_texture(&TextureDescriptor {
            label: Some("stone_base_colour"),
            size,
            mip_level_count: size.max_mips(TextureDimension::D2),
            sample_count: 1,
            dimension: TextureDimension::D2,
            format: TextureFormat::Rgba8UnormSrgb,
            usage: TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_DST,
            view_formats: &[],
        });
        Some(Self { texture, written: 0 })
    }

    /// All of its levels.
    pub fn view(&self) -> TextureView {
        self.texture.create_view(&TextureViewDescriptor::default())
    }

    /// Writes the next level.
    pub fn write(&mut self, queue: &RenderQueue, level: &SrgbImage) {
        queue.write_texture(
            TexelCopyTextureInfo {
                texture: &self.texture,
                mip_level: self.written,
                origin: Origin3d::ZERO,
                aspect: TextureAspect::All,
            },
            bytemuck::cast_slice(&level.pixels),
            TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(level.width * 4), rows_per_image: None },
            Extent3d { width: level.width, height: level.height, depth_or_array_layers: 1 },
        );
        self.written += 1;
    }
}

/// How base colour images are read that go on as `wrap` says; with `anisotropic`, sharp on floors that are seen flat, too. On software Vulkan that is not
/// worth its time.
#[must_use]
pub fn sampler(device: &RenderDevice, anisotropic: bool, wrap: [TextureWrap; 2]) -> Sampler {
    let [address_mode_u, address_mode_v] = wrap.map(|wrap| match wrap {
        TextureWrap::Repeat => AddressMode::Repeat,
        TextureWrap::Mirror => AddressMode::MirrorRepeat,
        TextureWrap::Clamp => AddressMode::ClampToEdge,
    });
    device.create_sampler(&SamplerDescriptor {
        label: Some("stone_base_colour"),
        address_mode_u,
        address_mode_v,
        mag_filter: FilterMode::Linear,
        min_filter: FilterMode::Linear,
        mipmap_filter: MipmapFilterMode::Linear,
        anisotropy_clamp: if anisotropic { 8 } else { 1 },
        ..Default::default()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use heliodon_math::color::linear_from_srgb8_table;

    #[test]
    fn levels_are_averaged_in_linear_light() {
        let image = SrgbImage { width: 2, height: 1, pixels: vec![[0, 0, 0, 255], [255, 255, 255, 255]] };
        let half = halved(&image, &linear_from_srgb8_table());
        assert_eq!((half.width, half.height), (1, 1));
        assert_eq!(half.pixels[0], [188, 188, 188, 255]);
    }

    #[test]
    fn flat_levels_stay_what_they_are() {
        let decode = linear_from_srgb8_table();
        for code in 0..=255u8 {
            let image = SrgbImage { width: 3, height: 2, pixels: vec![[code, 255 - code, code, code]; 6] };
            assert_eq!(halved(&image, &decode).pixels, [[code, 255 - code, code, code]]);
        }
    }
}
