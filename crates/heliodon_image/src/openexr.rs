//! OpenEXR through the `exr` crate: any layer with R, G, B or Y, any sample type, scanlines or tiles.

use crate::error::{ImageError, check_expansion, check_size};
use crate::primaries::{self, Primaries};
use crate::{HdrImage, MAX_PIXELS};
use exr::prelude::*;
use glam::{DVec2, Mat3, Vec3};
use std::io::Cursor;

/// The first bytes of every OpenEXR file.
pub(crate) const MAGIC: [u8; 4] = [0x76, 0x2f, 0x31, 0x01];

/// How samples are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ExrSamples {
    /// 16 bits: 11 bits of precision, clipped at 65,504.
    Half,
    /// 32 bits: lossless.
    Float,
}

/// Compression in OpenEXR packs pixels at most about this many to one; a header that promises more is not believed.
const MAX_EXPANSION: u64 = 4096;

/// Decodes the first layer that holds R, G and B, or else the first that holds Y.
pub(crate) fn decode(bytes: &[u8], name: &str) -> std::result::Result<HdrImage, ImageError> {
    let bad = |place: &str, problem: String| {
        ImageError::malformed(name, place, problem, "export it as an RGB scanline OpenEXR again")
    };
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(|e| bad("its header", e.to_string()))?;
    let mut sample_bytes = 0_u64;
    let mut shown_pixels = 0;
    for header in &meta.headers {
        let size = |size: Vec2<usize>| (size.x() as u64, size.y() as u64);
        let (width, height) = size(header.layer_size);
        check_size(name, "the size in its header", width, height, MAX_PIXELS)?;
        sample_bytes += width * height * header.channels.bytes_per_pixel as u64;
        // what lies in the window is taken from the layer, or is black: it takes memory all the same
        let (width, height) = size(header.shared_attributes.display_window.size);
        check_size(name, "the display window in its header", width, height, MAX_PIXELS)?;
        shown_pixels = shown_pixels.max(width * height);
    }
    check_expansion(name, sample_bytes.max(shown_pixels * size_of::<Vec3>() as u64), bytes.len(), MAX_EXPANSION)?;
    // Not in parallel: a broken block then ends in an error here and never in another thread.
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .non_parallel()
        .from_buffered(Cursor::new(bytes))
        .map_err(|e| bad("its pixels", e.to_string()))?;
    let matrix = match image.attributes.chromaticities {
        Some(c) => {
            let xy = |v: Vec2<f32>| DVec2::new(f64::from(v.x()), f64::from(v.y()));
            let given = Primaries { red: xy(c.red), green: xy(c.green), blue: xy(c.blue), white: xy(c.white) };
            primaries::rec709_from(&given)
                .ok_or_else(|| bad("its attribute `chromaticities`", "spans no triangle of colours".into()))?
        }
        None => Mat3::IDENTITY,
    };
    for wanted in [&["R", "G", "B"][..], &["Y"]] {
        for layer in &image.layer_data {
            if let Some(channels) = find_channels(&layer.channel_data.list, wanted) {
                if channels.iter().any(|c| c.sampling != Vec2(1, 1)) {
                    return Err(bad("its channels", "are sampled at less than every pixel".into()));
                }
                let matrix = if channels.len() == 3 { matrix } else { Mat3::IDENTITY };
                return Ok(place(layer, &channels, image.attributes.display_window, matrix));
            }
        }
    }
    let found: Vec<String> =
        image.layer_data.iter().flat_map(|l| &l.channel_data.list).take(12).map(|c| c.name.to_string()).collect();
    Err(bad("its channels", format!("has neither R, G, B nor Y but {}", found.join(", "))))
}

/// The channels named `wanted`, bare or behind a common prefix such as `Combined.`.
fn find_channels<'a>(list: &'a [AnyChannel<FlatSamples>], wanted: &[&str]) -> Option<Vec<&'a AnyChannel<FlatSamples>>> {
    let base = |channel: &AnyChannel<FlatSamples>| channel.name.to_string();
    list.iter().find_map(|first| {
        let name = base(first);
        let prefix = name.strip_suffix(wanted[0]).filter(|p| p.is_empty() || p.ends_with('.'))?;
        wanted.iter().map(|w| list.iter().find(|c| base(c) == format!("{prefix}{w}"))).collect()
    })
}

/// The layer's pixels as the display window shows them; black where the layer has none.
fn place(
    layer: &Layer<AnyChannels<FlatSamples>>,
    channels: &[&AnyChannel<FlatSamples>],
    display: IntegerBounds,
    matrix: Mat3,
) -> HdrImage {
    let (width, height) = (display.size.x(), display.size.y());
    let offset = (
        i64::from(layer.attributes.layer_position.x()) - i64::from(display.position.x()),
        i64::from(layer.attributes.layer_position.y()) - i64::from(display.position.y()),
    );
    let planes: Vec<Vec<f32>> = channels.iter().map(|c| c.sample_data.values_as_f32().collect()).collect();
    let mut image = HdrImage::filled(width as u32, height as u32, Vec3::ZERO);
    for y in 0..layer.size.y() {
        let Some(row) = usize::try_from(y as i64 + offset.1).ok().filter(|&r| r < height) else { continue };
        for x in 0..layer.size.x() {
            let Some(column) = usize::try_from(x as i64 + offset.0).ok().filter(|&c| c < width) else { continue };
            let at = y * layer.size.x() + x;
            let sample = |channel: usize| planes[channel][at];
            image.pixels[row * width + column] = match planes.len() {
                3 if matrix == Mat3::IDENTITY => Vec3::new(sample(0), sample(1), sample(2)),
                3 => matrix * Vec3::new(sample(0), sample(1), sample(2)),
                _ => Vec3::splat(sample(0)),
            };
        }
    }
    image
}

/// The bytes of a ZIP-compressed scanline file.
pub(crate) fn encode(image: &HdrImage, samples: ExrSamples) -> std::result::Result<Vec<u8>, Error> {
    let plane = |channel: usize| match samples {
        ExrSamples::Float => FlatSamples::F32(image.pixels.iter().map(|p| p[channel]).collect()),
        ExrSamples::Half => {
            FlatSamples::F16(image.pixels.iter().map(|p| f16::from_f32(p[channel].clamp(-65_504.0, 65_504.0))).collect())
        }
    };
    let channels = AnyChannels::sort(smallvec::smallvec![
        AnyChannel::new("R", plane(0)),
        AnyChannel::new("G", plane(1)),
        AnyChannel::new("B", plane(2)),
    ]);
    let layer = Layer::new(
        (image.width as usize, image.height as usize),
        LayerAttributes::default(),
        Encoding { compression: Compression::ZIP16, ..Encoding::FAST_LOSSLESS },
        channels,
    );
    let mut out = Cursor::new(Vec::new());
    Image::from_layer(layer).write().non_parallel().to_buffered(&mut out)?;
    Ok(out.into_inner())
}
