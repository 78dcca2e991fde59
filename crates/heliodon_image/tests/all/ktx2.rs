//! KTX 2 files as another reader understands them: what this crate writes and reads alike could still be wrong.

#![expect(clippy::unwrap_used, reason = "a test may panic")]

use glam::Vec3;
use heliodon_image::ktx2::{Ktx2, TexelFormat};
use heliodon_image::{HdrImage, ktx2_bc6h};
use ktx2::{ColorModel, Format, Reader, TransferFunction};

/// What a file says of its texels.
type Coding = (Option<Format>, Option<ColorModel>, Option<TransferFunction>);

/// That, its size, and the bytes of its levels.
fn told(bytes: &[u8]) -> (Coding, [u32; 2], Vec<usize>) {
    let reader = Reader::new(bytes).unwrap();
    let header = reader.header();
    let coding = (header.format, reader.color_model(), reader.transfer_function());
    (coding, [header.pixel_width, header.pixel_height], reader.levels().map(|level| level.data.len()).collect())
}

#[test]
fn formats_are_those_that_are_meant() {
    let linear = Some(TransferFunction::Linear);
    for (ours, format, model, transfer, texel) in [
        (TexelFormat::R32Uint, Format::R32_UINT, ColorModel::RGBSDA, linear, 4),
        (TexelFormat::Rgba16Float, Format::R16G16B16A16_SFLOAT, ColorModel::RGBSDA, linear, 8),
        (TexelFormat::Rgba8Srgb, Format::R8G8B8A8_SRGB, ColorModel::RGBSDA, Some(TransferFunction::SRGB), 4),
        (TexelFormat::Bc7, Format::BC7_UNORM_BLOCK, ColorModel::BC7, linear, 1),
        (TexelFormat::Bc7Srgb, Format::BC7_SRGB_BLOCK, ColorModel::BC7, Some(TransferFunction::SRGB), 1),
        (TexelFormat::Bc6h, Format::BC6H_UFLOAT_BLOCK, ColorModel::BC6H, linear, 1),
    ] {
        let levels = vec![vec![7; 8 * 4 * texel]];
        let texture = Ktx2 { format: ours, width: 8, height: 4, layers: 1, levels };
        let bytes = texture.to_plain_bytes(&[], "a.ktx2").unwrap();
        assert_eq!(told(&bytes), ((Some(format), Some(model), transfer), [8, 4], vec![8 * 4 * texel]));
    }
}

#[test]
fn light_maps_are_bc6h() {
    let image = HdrImage::from_fn(16, 8, |x, y| Vec3::new(1.0, 0.5, 0.25) * (1 + x + y) as f32);
    let coding = (Some(Format::BC6H_UFLOAT_BLOCK), Some(ColorModel::BC6H), Some(TransferFunction::Linear));
    assert_eq!(told(&ktx2_bc6h(&image, 4)), (coding, [16, 8], vec![128, 32, 16, 16]));
}
