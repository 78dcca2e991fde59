//! Photographs' views on the GPU: two array textures, a layer for each photograph.

use crate::stage::texture::halved;
use bevy::render::render_resource::*;
use bevy::render::renderer::{RenderDevice, RenderQueue};
use heliodon_image::SrgbImage;
use heliodon_image::view_layers::{ViewLayer, ViewLayers};
use heliodon_math::color::linear_from_srgb8_table;
use std::borrow::Cow;

/// What the shader reads.
pub struct ViewTextures {
    /// Colours with all their levels; alpha is how much they count.
    pub colors: TextureView,
    /// Directions to cameras.
    pub directions: TextureView,
}

/// Puts views on the GPU; of none, a texel that is never read. Images larger than the device takes are halved until it does.
pub fn views_on_gpu(device: &RenderDevice, queue: &RenderQueue, views: Option<&ViewLayers>) -> ViewTextures {
    let one = || SrgbImage::filled(1, 1, [128, 128, 128, 0]);
    let none = ViewLayers { layers: vec![ViewLayer { colors: one(), directions: one() }] };
    let views = views.unwrap_or(&none);
    let decode = linear_from_srgb8_table();
    let most = device.limits().max_texture_dimension_2d;
    let of = |pick: fn(&ViewLayer) -> &SrgbImage, smaller: &dyn Fn(&SrgbImage) -> SrgbImage| {
        let fitting = |layer| {
            let mut image = Cow::Borrowed(pick(layer));
            while image.width.max(image.height) > most {
                image = Cow::Owned(smaller(&image));
            }
            image
        };
        views.layers.iter().map(fitting).collect::<Vec<_>>()
    };
    let colors = of(|layer| &layer.colors, &|image| halved(image, &decode));
    let directions = of(|layer| &layer.directions, &thinned);
    let levelled = |mut image: SrgbImage| {
        let mut levels = Vec::new();
        while image.width.max(image.height) > 1 {
            let smaller = halved(&image, &decode);
            levels.push(std::mem::replace(&mut image, smaller));
        }
        levels.push(image);
        levels
    };
    let colors: Vec<Vec<SrgbImage>> = colors.into_iter().map(|image| levelled(image.into_owned())).collect();
    let directions: Vec<Vec<SrgbImage>> = directions.into_iter().map(|image| vec![image.into_owned()]).collect();
    ViewTextures {
        colors: array(device, queue, &colors, TextureFormat::Rgba8UnormSrgb),
        directions: array(device, queue, &directions, TextureFormat::Rgba8Unorm),
    }
}

/// Every other texel: directions are no colours to be averaged, and neighbours hardly differ.
fn thinned(image: &SrgbImage) -> SrgbImage {
    let (width, height) = ((image.width / 2).max(1), (image.height / 2).max(1));
    let places = (0..height).flat_map(|y| (0..width).map(move |x| (2 * x, 2 * y)));
    let pixels = places.map(|(x, y)| image.pixel(x.min(image.width - 1), y.min(image.height - 1))).collect();
    SrgbImage { width, height, pixels }
}

/// A texture of layers, each with the same levels, the finest first.
fn array(device: &RenderDevice, queue: &RenderQueue, layers: &[Vec<SrgbImage>], format: TextureFormat) -> TextureView {
    let (width, height) = layers.first().and_then(|levels| levels.first()).map_or((1, 1), |image| (image.width, image.height));
    let texture = device.create_texture(&TextureDescriptor {
        label: Some("photographs_views"),
        size: Extent3d { width, height, depth_or_array_layers: layers.len() as u32 },
        mip_level_count: layers.first().map_or(1, |levels| levels.len() as u32),
        sample_count: 1,
        dimension: TextureDimension::D2,
        format,
        usage: TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_DST,
        view_formats: &[],
    });
    for (layer, levels) in layers.iter().enumerate() {
        for (mip_level, image) in levels.iter().enumerate() {
            let origin = Origin3d { x: 0, y: 0, z: layer as u32 };
            queue.write_texture(
                TexelCopyTextureInfo { texture: &texture, mip_level: mip_level as u32, origin, aspect: TextureAspect::All },
                bytemuck::cast_slice(&image.pixels),
                TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(image.width * 4), rows_per_image: None },
                Extent3d { width: image.width, height: image.height, depth_or_array_layers: 1 },
            );
        }
    }
    texture.create_view(&TextureViewDescriptor { dimension: Some(TextureViewDimension::D2Array), ..Default::default() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thinned_images_keep_every_other_texel() {
        let pixels = (0..15).map(|i| [i, 0, 0, 255]).collect();
        let image = thinned(&SrgbImage { width: 5, height: 3, pixels });
        assert_eq!((image.width, image.height), (2, 1));
        assert_eq!(image.pixels.iter().map(|pixel| pixel[0]).collect::<Vec<_>>(), [0, 2]);
        assert_eq!(thinned(&SrgbImage::filled(1, 1, [7; 4])), SrgbImage::filled(1, 1, [7; 4]));
    }
}
