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

/// Views on their way to the GPU, with the levels of their colours: these take their time, and are made where bundles are read.
#[derive(Clone, Debug)]
pub struct PreparedViews {
    /// Of each layer, the finest level first, down to one texel.
    colors: Vec<Vec<SrgbImage>>,
    /// Of each layer.
    directions: Vec<SrgbImage>,
}

impl PreparedViews {
    /// Makes the levels of a part's views.
    pub fn new(views: ViewLayers) -> Self {
        let decode = linear_from_srgb8_table();
        let levelled = |mut image: SrgbImage| {
            let mut levels = Vec::new();
            while image.width.max(image.height) > 1 {
                let smaller = halved(&image, &decode);
                levels.push(std::mem::replace(&mut image, smaller));
            }
            levels.push(image);
            levels
        };
        let (colors, directions) = views.layers.into_iter().map(|layer| (levelled(layer.colors), layer.directions)).unzip();
        Self { colors, directions }
    }

    /// A texel that is never read.
    fn none() -> Self {
        let one = || SrgbImage::filled(1, 1, [128, 128, 128, 0]);
        Self::new(ViewLayers { layers: vec![ViewLayer { colors: one(), directions: one() }] })
    }

    /// How many layers.
    pub fn layers(&self) -> usize {
        self.colors.len()
    }

    /// Bytes on the device.
    pub fn bytes(&self) -> usize {
        self.colors.iter().flatten().chain(&self.directions).map(|image| 4 * image.pixels.len()).sum()
    }
}

/// Puts views on the GPU; of none, a texel that is never read. Images larger than the device takes lose their finest levels.
pub fn views_on_gpu(device: &RenderDevice, queue: &RenderQueue, views: Option<&PreparedViews>) -> ViewTextures {
    let none = PreparedViews::none();
    let views = views.unwrap_or(&none);
    let most = device.limits().max_texture_dimension_2d;
    let fits = |image: &SrgbImage| image.width.max(image.height) <= most;
    let colors: Vec<&[SrgbImage]> =
        views.colors.iter().map(|levels| &levels[levels.iter().position(fits).unwrap_or(0)..]).collect();
    let fitting = |image: &SrgbImage| {
        let mut image = Cow::Borrowed(image);
        while !fits(&image) {
            image = Cow::Owned(thinned(&image));
        }
        image.into_owned()
    };
    let directions: Vec<SrgbImage> = views.directions.iter().map(fitting).collect();
    let directions: Vec<&[SrgbImage]> = directions.iter().map(std::slice::from_ref).collect();
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
fn array(device: &RenderDevice, queue: &RenderQueue, layers: &[&[SrgbImage]], format: TextureFormat) -> TextureView {
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
    fn levels_go_down_to_a_texel_and_are_counted() {
        let layer = || ViewLayer { colors: SrgbImage::filled(8, 4, [9; 4]), directions: SrgbImage::filled(8, 4, [9; 4]) };
        let views = PreparedViews::new(ViewLayers { layers: vec![layer(), layer()] });
        let sizes = |levels: &Vec<SrgbImage>| levels.iter().map(|image| (image.width, image.height)).collect::<Vec<_>>();
        assert_eq!(views.colors.iter().map(sizes).collect::<Vec<_>>(), vec![vec![(8, 4), (4, 2), (2, 1), (1, 1)]; 2]);
        assert_eq!((views.layers(), views.bytes()), (2, 2 * 4 * (32 + 8 + 2 + 1 + 32)));
    }

    #[test]
    fn thinned_images_keep_every_other_texel() {
        let pixels = (0..15).map(|i| [i, 0, 0, 255]).collect();
        let image = thinned(&SrgbImage { width: 5, height: 3, pixels });
        assert_eq!((image.width, image.height), (2, 1));
        assert_eq!(image.pixels.iter().map(|pixel| pixel[0]).collect::<Vec<_>>(), [0, 2]);
        assert_eq!(thinned(&SrgbImage::filled(1, 1, [7; 4])), SrgbImage::filled(1, 1, [7; 4]));
    }
}
