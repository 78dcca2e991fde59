//! Sky maps as GPU images: shared-exponent RGB, four bytes a pixel.

use bevy::asset::RenderAssetUsages;
use bevy::image::Image;
use bevy::render::render_resource::{Extent3d, TextureDimension, TextureFormat};
use glam::Vec3;
use heliodon_image::HdrImage;

/// The widest map that is kept; wider ones are halved. A map of 4,096 columns has 569 of them in a view of 50 degrees and
/// takes 32 MiB, of which three are resident.
pub const MAX_COLUMNS: u32 = 4096;

/// The largest component that the format holds.
const MAX_VALUE: f32 = 65_408.0;

/// Three floats with nine bits each and one exponent (OpenGL EXT_texture_shared_exponent, also Vulkan's and WebGPU's
/// `rgb9e5ufloat`). Relative error of the largest component at most 1/512; negative and not-a-number become 0.
#[must_use]
pub fn rgb9e5(color: Vec3) -> u32 {
    let clamped = color.map(|c| if c > 0.0 { c.min(MAX_VALUE) } else { 0.0 });
    let largest = clamped.max_element();
    // floor(log2(largest)), at least -16, from the bits of the float.
    let floor_log2 = ((largest.to_bits() >> 23) as i32 - 127).max(-16);
    let mut exponent = floor_log2 + 16;
    let scale_of = |exponent: i32| f32::from_bits(((24 - exponent + 127) as u32) << 23);
    if (largest * scale_of(exponent) + 0.5) as u32 == 512 {
        exponent += 1;
    }
    let scale = scale_of(exponent);
    let [r, g, b] = clamped.to_array().map(|c| (c * scale + 0.5) as u32);
    r | g << 9 | b << 18 | (exponent as u32) << 27
}

/// Half the size, by the mean of four; columns and rows that are odd lose their last.
fn halved(map: &HdrImage) -> HdrImage {
    let (width, height) = ((map.width / 2).max(1), (map.height / 2).max(1));
    let at = |x: u32, y: u32| map.pixels[(y.min(map.height - 1) * map.width + x.min(map.width - 1)) as usize];
    let pixels = (0..height)
        .flat_map(|y| (0..width).map(move |x| (2 * x, 2 * y)))
        .map(|(x, y)| (at(x, y) + at(x + 1, y) + at(x, y + 1) + at(x + 1, y + 1)) * 0.25)
        .collect();
    HdrImage { width, height, pixels }
}

/// The map as an image for the GPU alone.
#[must_use]
pub fn image(mut map: HdrImage) -> Image {
    while map.width > MAX_COLUMNS {
        map = halved(&map);
    }
    let data: Vec<u8> = map.pixels.iter().flat_map(|&pixel| rgb9e5(pixel).to_le_bytes()).collect();
    Image::new(
        Extent3d { width: map.width, height: map.height, depth_or_array_layers: 1 },
        TextureDimension::D2,
        data,
        TextureFormat::Rgb9e5Ufloat,
        RenderAssetUsages::RENDER_WORLD,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decode(word: u32) -> Vec3 {
        let scale = ((word >> 27) as f32 - 24.0).exp2();
        Vec3::new((word & 511) as f32, (word >> 9 & 511) as f32, (word >> 18 & 511) as f32) * scale
    }

    #[test]
    fn shared_exponents_keep_the_largest_component_within_a_five_hundredth() {
        let mut value = 1e-4f32;
        while value < 60_000.0 {
            let color = Vec3::new(value, value * 0.5, value * 0.01);
            let back = decode(rgb9e5(color));
            assert!((back - color).abs().max_element() <= value / 511.0, "{color} {back}");
            value *= 1.037;
        }
        assert_eq!(decode(rgb9e5(Vec3::new(-1.0, f32::NAN, 0.0))), Vec3::ZERO);
        assert_eq!(decode(rgb9e5(Vec3::splat(f32::INFINITY))), Vec3::splat(MAX_VALUE));
    }

    #[test]
    fn wide_maps_are_halved() {
        let map = HdrImage { width: 8192, height: 2, pixels: vec![Vec3::ONE; 8192 * 2] };
        assert_eq!(image(map).texture_descriptor.size.width, 4096);
    }
}
