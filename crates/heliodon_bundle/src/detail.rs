//! Details of parts: fine grey patterns that are multiplied onto albedo where surfaces are seen from near, as the manifest tells them,
//! and the reference of how they are shown.
//!
//! Papaioannou, Gaitatzes, Christopoulos, "Enhancing Virtual Reality Walkthroughs of Archaeological Sites", VAST 2003, section 2.4. The
//! images are [`DetailTexture`]s below `detail/`, 8-bit grey PNG, square, with a mean of 128.
//!
//! ```text
//! albedo = albedo * max(1 + weight * pattern, 0)        pattern = code / 128 - 1, 0 in the mean
//! weight = strength * distance * level * density
//! distance = clamp(2 - d / near_m, 0, 1)                full up to near_m, gone at twice as much
//! level    = clamp(flat - l, 0, 1)                      l: log2 of the detail's texels along a pixel's longer side
//! density  = clamp(l - b, 0, 1)                         b: the same of the base colour texture; 1 without one
//! ```
//!
//! `flat` is the first mip level on which nobody would see it. Where the base texture is as dense as the detail it has what the detail
//! would add, and the detail is away; it is full where it is twice as dense. The level is the same along all sides, so that a surface that
//! is seen flat loses its detail before it flickers.
//!
//! Triplanar patterns are seen along three axes. An axis counts with `max(n^4 - 0.03, 0)` of the normal's part along it, so that most surfaces
//! take from one; and what is mixed is divided by the root of the weights' squares, which keeps the contrast that a mean would lose
//! (Heitz and Neyret, "High-Performance By-Example Noise using a Histogram-Preserving Blending Operator", HPG 2018, equation 2).

use crate::site::{Along, Detail, DetailMapping};
use glam::{Vec2, Vec3};
use heliodon_image::SrgbImage;
use heliodon_image::detail::{DetailError, DetailImport, DetailLevel, DetailTexture, factor};
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// The folder of the images.
pub const DETAIL_FOLDER: &str = "detail";

/// The sides that images may have, in texels.
pub const DETAIL_SIDES: [u32; 4] = [64, 128, 256, 512];

/// What is taken off the fourth power of a normal's part along an axis.
pub const AXIS_CUT: f32 = 0.03;

/// A standard deviation, in codes, below which a level counts as flat: 1.2 % of the albedo.
const FLAT_CONTRAST: f64 = 1.5;

/// What a manifest says of a part's detail.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DetailInfo {
    /// The image; among the bundle's files.
    pub file: String,
    /// How it is laid on.
    pub mapping: DetailMapping,
    /// Tiles in a metre, or in a unit of the texture coordinates: 0.001 to 100,000.
    pub tiles: f64,
    /// The axis along which the image's columns run, of triplanar mapping.
    pub along: Along,
    /// How much of it is laid on: 0 to 1.
    pub strength: f64,
    /// It is full up to this distance from the eye and gone at twice as much, metres: 0.01 to 100,000.
    pub near_m: f64,
}

/// What is wrong with a detail.
#[derive(Debug, Error)]
pub enum DetailFault {
    /// A number of the manifest.
    #[error("{0}")]
    Number(String),
    /// The image has not the size of one.
    #[error("{name}: {width} x {height} texels; give a square image of 64, 128, 256 or 512 texels along a side: {remedy}")]
    Size {
        /// The image.
        name: String,
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
        /// What to do about it.
        remedy: &'static str,
    },
    /// The image is not grey.
    #[error("{0}: it has colours, and a detail changes brightness only; save it as a grey image")]
    Coloured(String),
    /// What the image's own check says.
    #[error(transparent)]
    Image(#[from] DetailError),
}

impl DetailInfo {
    /// What a site says, with the image at `file` of the bundle.
    #[must_use]
    pub fn new(file: String, settings: &Detail) -> Self {
        Self {
            file,
            mapping: settings.mapping,
            tiles: settings.tiles(),
            along: settings.along,
            strength: settings.strength,
            near_m: settings.near_m,
        }
    }

    /// Whether all numbers are in range.
    ///
    /// # Errors
    /// The first that is not.
    pub fn validate(&self) -> Result<(), DetailFault> {
        for (name, value, range) in [
            ("tiles", self.tiles, 0.001..=100_000.0),
            ("strength", self.strength, 0.0..=1.0),
            ("near_m", self.near_m, 0.01..=100_000.0),
        ] {
            if !range.contains(&value) {
                let (least, most) = (range.start(), range.end());
                return Err(DetailFault::Number(format!("{name} is {value}, not {least} to {most}")));
            }
        }
        Ok(())
    }

    /// The image of a file's bytes, as a bundle holds it: square, grey, of exact mean.
    ///
    /// # Errors
    /// What it is not.
    pub fn texture(bytes: &[u8], name: &str) -> Result<DetailTexture, DetailFault> {
        let image = SrgbImage::from_bytes(bytes, name).map_err(DetailError::from)?;
        Ok(import(&image, name, DetailImport::strict())?.0)
    }
}

/// Whether an image has the sides of a detail.
///
/// # Errors
/// One that is not square, or not of one of [`DETAIL_SIDES`]; `name` is its in the message.
pub fn check_sides(image: &SrgbImage, name: &str) -> Result<(), DetailFault> {
    let (width, height) = (image.width, image.height);
    if width != height || !DETAIL_SIDES.contains(&width) {
        let remedy = match width.min(height) {
            short if short < DETAIL_SIDES[0] => "lay it side by side with itself until it is that large",
            short if short >= 2 * DETAIL_SIDES[3] => "cut a piece out of it that tiles, or scale it down",
            _ => "cut or scale it",
        };
        return Err(DetailFault::Size { name: name.to_owned(), width, height, remedy });
    }
    Ok(())
}

/// Whether an image is grey, as far as compression lets it.
///
/// # Errors
/// One that has colours; `name` is its in the message.
pub fn check_grey(image: &SrgbImage, name: &str) -> Result<(), DetailFault> {
    // compression leaves greys a code or two apart
    if image.pixels.iter().any(|p| p[0].abs_diff(p[1]).max(p[1].abs_diff(p[2])).max(p[0].abs_diff(p[2])) > 4) {
        return Err(DetailFault::Coloured(name.to_owned()));
    }
    Ok(())
}

/// A detail texture of an image, and doubts about it, each in a sentence; `import` says whether another mean is corrected.
///
/// # Errors
/// As [`check_sides`], [`check_grey`] and [`DetailTexture::from_image`].
pub fn import(image: &SrgbImage, name: &str, import: DetailImport) -> Result<(DetailTexture, Vec<String>), DetailFault> {
    check_sides(image, name)?;
    check_grey(image, name)?;
    let imported = DetailTexture::from_image(image, name, &import)?;
    Ok((imported.texture, imported.warnings))
}

/// The first mip level on which nobody would see a pattern, 1 at least: viewers fade it out on the level before.
#[must_use]
pub fn flat_level(levels: &[DetailLevel]) -> f32 {
    let is_flat = |level: &DetailLevel| {
        let squares: u64 = level.codes.iter().map(|&code| u64::from(code.abs_diff(128)).pow(2)).sum();
        (squares as f64) < FLAT_CONTRAST * FLAT_CONTRAST * level.codes.len() as f64
    };
    levels.iter().position(is_flat).unwrap_or(levels.len()).max(1) as f32
}

/// A place on a surface, as a pixel shows it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShownPlace {
    /// In the bundle's space.
    pub place: Vec3,
    /// The surface's unit normal there.
    pub normal: Vec3,
    /// The texture coordinates, where there are any.
    pub uv: Vec2,
    /// From the eye, metres; 0 in parallel projections.
    pub distance_m: f32,
    /// The longer side of the pixel on the surface: metres, or, of mapping by texture coordinates, units of these.
    pub pixel: f32,
    /// Texels of the base colour texture along the longer side of the pixel; 0 without one.
    pub base_texels: f32,
}

/// The reference of how a detail is shown.
#[derive(Clone, Debug)]
pub struct ShownDetail {
    info: DetailInfo,
    levels: Vec<DetailLevel>,
    flat: f32,
}

impl ShownDetail {
    /// Of a part's detail.
    #[must_use]
    pub fn new(info: DetailInfo, texture: &DetailTexture) -> Self {
        let levels = texture.mip_levels();
        Self { info, flat: flat_level(&levels), levels }
    }

    /// What linear albedo is multiplied with, 0 at least.
    #[must_use]
    pub fn factor(&self, at: &ShownPlace) -> f32 {
        let side = self.levels[0].width as f32;
        let level = (at.pixel * self.info.tiles as f32 * side).max(1e-6).log2();
        let distance = (2.0 - at.distance_m / self.info.near_m as f32).clamp(0.0, 1.0);
        let density = (level - at.base_texels.max(1e-6).log2()).clamp(0.0, 1.0);
        let weight = self.info.strength as f32 * distance * (self.flat - level).clamp(0.0, 1.0) * density;
        (1.0 + weight * self.pattern(at, level.max(0.0))).max(0.0)
    }

    fn pattern(&self, at: &ShownPlace, level: f32) -> f32 {
        let tiles = self.info.tiles as f32;
        if self.info.mapping == DetailMapping::Uv {
            return self.sample(at.uv * tiles, level);
        }
        let turned = |v: Vec3| match self.info.along {
            Along::X => Vec3::new(v.y, v.x, v.z),
            Along::Y => v,
            Along::Z => Vec3::new(v.x, v.z, v.y),
        };
        let (p, n) = (turned(at.place), turned(at.normal));
        let weights = n.powf(2.0).powf(2.0).map(|n4| (n4 - AXIS_CUT).max(0.0));
        let seen = [Vec2::new(p.z, -p.y), Vec2::new(p.x, p.z), Vec2::new(p.x, -p.y)].map(|uv| self.sample(uv * tiles, level));
        weights.dot(Vec3::from(seen)) / weights.length().max(1e-3)
    }

    /// Codes mixed linearly within a level and between two, less what does nothing.
    fn sample(&self, uv: Vec2, level: f32) -> f32 {
        let level = level.min(self.levels.len() as f32 - 1.0);
        let (fine, part) = (level as usize, level.fract());
        let coarse = (fine + 1).min(self.levels.len() - 1);
        let of = |level: usize| bilinear(&self.levels[level], uv);
        of(fine) * (1.0 - part) + of(coarse) * part - 1.0
    }
}

fn bilinear(level: &DetailLevel, uv: Vec2) -> f32 {
    let (width, height) = (i64::from(level.width), i64::from(level.height));
    let at = uv * Vec2::new(width as f32, height as f32) - 0.5;
    let (low, part) = (at.floor(), at - at.floor());
    let texel = |x: f32, y: f32| {
        let (x, y) = ((x as i64).rem_euclid(width), (y as i64).rem_euclid(height));
        factor(level.codes[(y * width + x) as usize])
    };
    let row = |y: f32| texel(low.x, y) * (1.0 - part.x) + texel(low.x + 1.0, y) * part.x;
    row(low.y) * (1.0 - part.y) + row(low.y + 1.0) * part.y
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::site::DetailPattern;
    use heliodon_image::detail::{DetailKind, DetailParams};

    fn shown(settings: &Detail) -> ShownDetail {
        let params = settings.generated().unwrap();
        ShownDetail::new(DetailInfo::new("detail/0.png".to_owned(), settings), &DetailTexture::generate(&params).unwrap())
    }

    fn near(place: Vec3) -> ShownPlace {
        ShownPlace { place, normal: Vec3::Z, uv: Vec2::ZERO, distance_m: 1.0, pixel: 1.0 / 256.0, base_texels: 0.0 }
    }

    #[test]
    fn a_tile_of_wall_is_as_bright_with_its_detail_as_without() {
        let shown = shown(&Detail::of_kind(DetailPattern::Stone));
        for (pixel, counted) in [(1.0 / 256.0, 256), (1.0 / 64.0, 64)] {
            let step = 1.0 / counted as f32;
            let at = |i: i32| Vec3::new((i % counted) as f32 + 0.5, (i / counted) as f32 + 0.5, 0.0) * step;
            let sum: f64 = (0..counted * counted).map(|i| f64::from(shown.factor(&ShownPlace { pixel, ..near(at(i)) }))).sum();
            let mean = sum / f64::from(counted * counted);
            assert!((mean - 1.0).abs() < 1e-4, "{mean} at {pixel}");
        }
    }

    #[test]
    fn it_fades_with_distance_with_the_pixel_and_where_the_base_is_denser() {
        let shown = shown(&Detail { near_m: 4.0, ..Detail::of_kind(DetailPattern::Noise) });
        let place = Vec3::new(0.3, 0.7, 0.0);
        let full = shown.factor(&near(place)) - 1.0;
        assert!(full.abs() > 0.01);
        let at = |change: &dyn Fn(&mut ShownPlace)| {
            let mut at = near(place);
            change(&mut at);
            shown.factor(&at) - 1.0
        };
        assert_eq!(at(&|at| at.distance_m = 4.0), full);
        assert!((at(&|at| at.distance_m = 6.0) - 0.5 * full).abs() < 1e-6);
        assert_eq!(at(&|at| at.distance_m = 8.0), 0.0);
        // one texel of the detail along the pixel: the base may have half as many
        assert!((at(&|at| at.base_texels = 0.5) - full).abs() < 1e-6);
        assert_eq!(at(&|at| at.base_texels = 1.0), 0.0);
        assert_eq!(at(&|at| at.pixel = 0.5), 0.0);
        // white noise of 14 codes has 1.75 on level 3 and 0.9 on level 4
        assert_eq!(shown.flat, 4.0);
    }

    #[test]
    fn mixtures_of_axes_keep_the_contrast() {
        let shown = shown(&Detail::of_kind(DetailPattern::Stone));
        let deviation = |normal: Vec3| {
            let at = |i: i32| Vec3::new(0.37, 0.011, 0.5) + Vec3::new(0.013, 0.0171, 0.0093) * i as f32;
            let squares = (0..4000).map(|i| f64::from(shown.factor(&ShownPlace { normal, ..near(at(i)) }) - 1.0).powi(2));
            (squares.sum::<f64>() / 4000.0).sqrt()
        };
        let one = deviation(Vec3::Y);
        assert!((one - 16.0 / 128.0).abs() < 0.02, "{one}");
        let three = deviation(Vec3::splat(1.0 / 3f32.sqrt()));
        assert!((three / one - 1.0).abs() < 0.1, "{three} for {one}");
        // along an axis the two others do not count
        assert_eq!(shown.factor(&near(Vec3::ONE * 0.3)), {
            let tilted = Vec3::new(0.3, 0.3, (1.0f32 - 0.18).sqrt());
            shown.factor(&ShownPlace { normal: tilted, ..near(Vec3::ONE * 0.3) })
        });
    }

    #[test]
    fn images_that_cannot_serve_are_told_with_a_remedy() {
        let grey = |side: u32, of: fn(u32) -> u8| SrgbImage {
            width: side,
            height: side,
            pixels: (0..side * side).map(|i| [of(i), of(i), of(i), 255]).collect(),
        };
        let told = |image: &SrgbImage| import(image, "a.png", DetailImport::strict()).unwrap_err().to_string();
        let checks = |i: u32| if i.is_multiple_of(2) { 100 } else { 156 };
        assert!(told(&grey(32, checks)).contains("32 x 32") && told(&grey(32, checks)).contains("side by side"));
        assert!(told(&grey(1024, checks)).contains("scale it down"));
        assert!(told(&SrgbImage { height: 32, pixels: vec![[128; 4]; 64 * 32], ..grey(64, checks) }).contains("64 x 32"));
        assert!(told(&grey(64, |i| if i.is_multiple_of(2) { 100 } else { 140 })).contains("its mean is 120.00, not 128"));
        let mut coloured = grey(64, checks);
        coloured.pixels[7] = [90, 140, 128, 255];
        assert!(told(&coloured).contains("save it as a grey image"));
        let (made, _) = import(&grey(64, |i| (i % 64) as u8), "a.png", DetailImport::corrected()).unwrap();
        made.validate().unwrap();
        let params = DetailParams::new(DetailKind::Plaster);
        let plaster = DetailTexture::generate(&params).unwrap();
        assert_eq!(DetailInfo::texture(&plaster.to_png_bytes().unwrap(), "p.png").unwrap(), plaster);
    }

    #[test]
    fn numbers_out_of_range_are_refused() {
        let info = DetailInfo::new("detail/0.png".to_owned(), &Detail::of_kind(DetailPattern::Wood));
        info.validate().unwrap();
        for wrong in [
            DetailInfo { tiles: f64::NAN, ..info.clone() },
            DetailInfo { strength: 1.5, ..info.clone() },
            DetailInfo { near_m: 0.0, ..info.clone() },
        ] {
            assert!(wrong.validate().is_err(), "{wrong:?}");
        }
    }
}
