//! Base colour images on the GPU, with their smaller levels.

use bevy::render::render_resource::*;
use bevy::render::renderer::{RenderDevice, RenderQueue};
use heliodon_image::SrgbImage;
use heliodon_math::color::{linear_from_srgb8_table, srgb8_from_linear};

/// Half the size, averaged in linear light.
fn halved(image: &SrgbImage, table: &[f32; 256]) -> SrgbImage {
    let (width, height) = ((image.width / 2).max(1), (image.height / 2).max(1));
    let mut pixels = Vec::with_capacity(width as usize * height as usize);
    for y in 0..height {
        for x in 0..width {
            let mut sum = [0.0f32; 4];
            for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                let column = (2 * x + dx).min(image.width - 1);
                let row = (2 * y + dy).min(image.height - 1);
                let pixel = image.pixels[(row * image.width + column) as usize];
                for c in 0..3 {
                    sum[c] += table[usize::from(pixel[c])] * 0.25;
                }
                sum[3] += f32::from(pixel[3]) * 0.25;
            }
            let [r, g, b, a] = sum;
            pixels.push([srgb8_from_linear(r), srgb8_from_linear(g), srgb8_from_linear(b), (a + 0.5) as u8]);
        }
    }
    SrgbImage { width, height, pixels }
}

/// Uploads `image` and all its levels. Images larger than the device takes are halved until they fit.
pub fn upload(device: &RenderDevice, queue: &RenderQueue, image: &SrgbImage) -> TextureView {
    let table = linear_from_srgb8_table();
    let most = device.limits().max_texture_dimension_2d;
    let mut level = image.clone();
    while level.width.max(level.height) > most {
        level = halved(&level, &table);
    }
    let size = Extent3d { width: level.width, height: level.height, depth_or_array_layers: 1 };
    let levels = size.max_mips(TextureDimension::D2);
    let texture = device.create_texture(&TextureDescriptor {
        label: Some("stone_base_colour"),
        size,
        mip_level_count: levels,
        sample_count: 1,
        dimension: TextureDimension::D2,
        format: TextureFormat::Rgba8UnormSrgb,
        usage: TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_DST,
        view_formats: &[],
    });
    for mip_level in 0..levels {
        if mip_level > 0 {
            level = halved(&level, &table);
        }
        queue.write_texture(
            TexelCopyTextureInfo { texture: &texture, mip_level, origin: Origin3d::ZERO, aspect: TextureAspect::All },
            bytemuck::cast_slice(&level.pixels),
            TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(level.width * 4), rows_per_image: None },
            Extent3d { width: level.width, height: level.height, depth_or_array_layers: 1 },
        );
    }
    texture.create_view(&TextureViewDescriptor::default())
}

/// How base colour images are read; with `anisotropic`, sharp on floors that are seen flat, too. On software Vulkan that is not
/// worth its time.
#[must_use]
pub fn sampler(device: &RenderDevice, anisotropic: bool) -> Sampler {
    device.create_sampler(&SamplerDescriptor {
        label: Some("stone_base_colour"),
        address_mode_u: AddressMode::Repeat,
        address_mode_v: AddressMode::Repeat,
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

    #[test]
    fn levels_are_averaged_in_linear_light() {
        let image = SrgbImage { width: 2, height: 1, pixels: vec![[0, 0, 0, 255], [255, 255, 255, 255]] };
        let half = halved(&image, &linear_from_srgb8_table());
        assert_eq!((half.width, half.height), (1, 1));
        assert_eq!(half.pixels[0], [188, 188, 188, 255]);
    }
}
