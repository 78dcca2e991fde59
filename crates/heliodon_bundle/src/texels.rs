//! Daylight in texels: what lights parts whose triangles are too large for light at their vertices.
//!
//! Chunks of such parts have `_TEXEL_UV`, places in one atlas in which no two places of the surfaces share a texel. The atlas is three KTX 2 textures, whose
//! numbers are those that vertices have:
//!
//! | file | texels | holds |
//! | --- | --- | --- |
//! | `texels/sun.ktx2` | W words of the sun mask, one a layer | bit t is bit t mod 32 of word t / 32 |
//! | `texels/sky.ktx2` | the sky transfer's numbers as 16-bit floats, four a layer, zero-padded; of coloured light a texel for every 2 x 2 of the masks | coefficient-major, then channel |
//! | `texels/bounce.ktx2` | the sun bounce likewise, a texel for every 4 x 4 of the masks | function-major, then channel |
//! | `texels/weathering.ktx2` | where there is any: 8 bits RGBA, a texel for every 2 x 2 of the masks | what the weather has left, over the albedo: colour times cover as sRGB, and the cover |
//!
//! Charts lie in whole squares of 4 x 4 texels, so that sun and sky have mip levels down to those squares in which no chart takes from another; a mask's
//! coarser levels hold what most of four texels have, and of a tie one of them. Sky and bounce are filtered linearly. Of the sun the moment's bits are taken, and what each says is mixed from nine
//! texels by a quadratic B-spline and made steeper by a smooth step from 1/4 to 3/4: the part of the sun that reaches a place, whose edges have no stairs. Normals are the mesh's own.
//!
//! Weathering is filtered linearly, decoded before: `albedo * (1 - cover) + colour` is the albedo beneath the light. Readers may leave it out.

use crate::chunk::LightLayout;
use crate::moment::Moment;
use crate::shade::{Light, weighted};
use glam::{UVec2, Vec2, Vec3};
use half::f16;
use heliodon_image::ImageError;
use heliodon_image::ktx2::{Ktx2, Ktx2Shape, TexelFormat};
use heliodon_math::color::{linear_from_srgb, srgb8_from_linear};
use serde::{Deserialize, Serialize};
use std::f32::consts::FRAC_1_PI;
use thiserror::Error;

/// Texels of sun and sky along a side of one of the bounce.
pub const BOUNCE_BLOCK: u32 = 4;
/// Levels down to those squares, the finest with them.
pub const TEXEL_LEVELS: u32 = 3;
/// The largest side of an atlas: sides are multiples of [`BOUNCE_BLOCK`].
pub const MAX_TEXEL_SIDE: u32 = 16_384;
/// The folder of the textures.
pub const TEXELS_FOLDER: &str = "texels";
pub(crate) const SUN_FILE: &str = "texels/sun.ktx2";
pub(crate) const SKY_FILE: &str = "texels/sky.ktx2";
pub(crate) const WEATHERING_FILE: &str = "texels/weathering.ktx2";
pub(crate) const BOUNCE_FILE: &str = "texels/bounce.ktx2";

/// What a manifest says of light in texels.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TexelInfo {
    /// Texels along u, a multiple of 4.
    pub width: u32,
    /// And along v.
    pub height: u32,
    /// Texels for a metre of the densest surface.
    pub per_m: f32,
    /// The part of the atlas that triangles cover.
    pub utilisation: f32,
    /// Texels that filtering may ask for.
    pub texels: u64,
}

impl TexelInfo {
    /// Texels along u and v.
    #[must_use]
    pub fn size(&self) -> [u32; 2] {
        [self.width, self.height]
    }
}

/// Bytes in the memory of a viewer of an atlas of so many texels along both sides: what its textures take, and what sky and bounced sun are lit into.
#[must_use]
pub fn atlas_bytes(layout: LightLayout, [width, height]: [u32; 2]) -> u64 {
    let texels = |level: u32| u64::from(side(width, level)) * u64::from(side(height, level));
    let fours = |numbers: usize| numbers.div_ceil(4) as u64;
    let sun: u64 = (0..TEXEL_LEVELS).map(|level| texels(level) * 4 * layout.mask_words() as u64).sum();
    let sky: u64 =
        (sky_level(layout.channels)..TEXEL_LEVELS).map(|level| texels(level) * 8 * (fours(layout.transfer_floats()) + 1)).sum();
    let lit = u64::from(layout.sun_bounce_functions > 0);
    sun + sky + texels(TEXEL_LEVELS - 1) * 8 * (fours(layout.bounce_floats()) + lit)
}

/// What is wrong with light in texels.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("light in texels: {0}")]
pub struct TexelFault(String);

impl TexelFault {
    pub(crate) fn new(what: String) -> Self {
        Self(what)
    }
}

/// The atlas.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TexelLight {
    /// Sun masks.
    pub sun: Ktx2,
    /// Sky transfer.
    pub sky: Ktx2,
    /// Sun bounce, where there is one.
    pub bounce: Option<Ktx2>,
}

/// The level whose texels the sky of light of so many channels has on its finest: the light of the sky changes less from place to place than the sun's, and in colour it is three times as
/// large.
#[must_use]
pub fn sky_level(channels: u32) -> u32 {
    u32::from(channels == 3)
}

/// Texels of a level along a side, at least one.
fn side(texels: u32, level: u32) -> u32 {
    (texels >> level).max(1)
}

/// What the textures of an atlas must be.
pub(crate) struct Shapes {
    pub(crate) sun: Ktx2Shape,
    pub(crate) sky: Ktx2Shape,
    pub(crate) bounce: Option<Ktx2Shape>,
}

impl Shapes {
    /// Of light of a layout.
    ///
    /// # Errors
    /// Sides that an atlas cannot have.
    pub(crate) fn of(layout: LightLayout, [width, height]: [u32; 2]) -> Result<Self, TexelFault> {
        let sides = [width, height].iter().all(|side| (4..=MAX_TEXEL_SIDE).contains(side) && side.is_multiple_of(BOUNCE_BLOCK));
        if !sides {
            return Err(TexelFault(format!("an atlas of {width} x {height}; sides are multiples of 4 up to 16,384")));
        }
        let above = sky_level(layout.channels);
        let floats = |numbers: usize, level: u32, levels: u32| Ktx2Shape {
            format: TexelFormat::Rgba16Float,
            size: [width >> level, height >> level],
            layers: numbers.div_ceil(4) as u32,
            levels,
        };
        let bounced = layout.bounce_floats();
        Ok(Self {
            sun: Ktx2Shape {
                format: TexelFormat::R32Uint,
                size: [width, height],
                layers: layout.mask_words() as u32,
                levels: TEXEL_LEVELS,
            },
            sky: floats(layout.transfer_floats(), above, TEXEL_LEVELS - above),
            bounce: (bounced > 0).then(|| floats(bounced, TEXEL_LEVELS - 1, 1)),
        })
    }

    /// Of weathering.
    pub(crate) fn weathering(info: &TexelInfo) -> Ktx2Shape {
        let size = [info.width, info.height].map(|texels| side(texels, WEATHERING_LEVEL));
        Ktx2Shape { format: TexelFormat::Rgba8Srgb, size, layers: 1, levels: TEXEL_LEVELS - WEATHERING_LEVEL }
    }
}

/// Whether a texture is what is wanted.
///
/// # Errors
/// What it is.
pub(crate) fn is_shape(name: &str, found: Ktx2Shape, wanted: Ktx2Shape) -> Result<(), TexelFault> {
    if found == wanted { Ok(()) } else { Err(TexelFault(format!("{name} is {found}, not {wanted}"))) }
}

impl TexelLight {
    /// Whether the textures are those of an atlas of this size and of light of this layout.
    ///
    /// # Errors
    /// What is not.
    pub fn validate(&self, layout: LightLayout, size: [u32; 2]) -> Result<(), TexelFault> {
        let fault = |what: String| Err(TexelFault(what));
        let wanted = Shapes::of(layout, size)?;
        if self.bounce.is_some() != wanted.bounce.is_some() {
            return fault("a bounce that the vertices have not, or the other way round".to_owned());
        }
        is_shape("sun", self.sun.shape(), wanted.sun)?;
        is_shape("sky", self.sky.shape(), wanted.sky)?;
        if let (Some(bounce), Some(wanted)) = (&self.bounce, wanted.bounce) {
            is_shape("bounce", bounce.shape(), wanted)?;
        }
        let floats = self.sky.levels.iter().chain(self.bounce.iter().flat_map(|bounce| &bounce.levels));
        let is_finite = |two: &[u8; 2]| f16::from_le_bytes(*two).is_finite();
        if !floats.into_iter().all(|bytes| bytes.as_chunks().0.iter().all(is_finite)) {
            return fault("numbers that are not finite".to_owned());
        }
        Ok(())
    }

    /// Bytes in the memory of a viewer.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        let of = |texture: &Ktx2| texture.levels.iter().map(|level| level.len() as u64).sum::<u64>();
        of(&self.sun) + of(&self.sky) + self.bounce.as_ref().map_or(0, of)
    }

    /// The light at a place of the atlas, of a surface of unit normal `normal` there, on the finest level: the reference of shaders.
    ///
    /// # Panics
    /// If the light has not the mask bits that the moment names.
    #[must_use]
    pub fn light(&self, layout: LightLayout, moment: &Moment, uv: Vec2, normal: Vec3) -> Light {
        let [first, second] = moment.mask_bits.map(|bit| self.reached(uv, bit));
        let reached = moment.mask_weights[0] * first + moment.mask_weights[1] * second;
        let channels = layout.channels as usize;
        let numbers = |texture: &Ktx2, count: usize| -> Vec<f32> {
            (0..count).map(|number| filtered(texture, uv, |texel| float_of(texture, texel, number))).collect()
        };
        let transfer = numbers(&self.sky, layout.transfer_floats());
        let bounced = self.bounce.as_ref().map_or_else(Vec::new, |bounce| numbers(bounce, layout.bounce_floats()));
        let functions = moment.bounce.iter().map(|&f| Vec3::splat(f));
        Light {
            sun: moment.shading.sun_irradiance * (reached * normal.dot(moment.sun_direction).max(0.0) * FRAC_1_PI),
            sky: weighted(&transfer, channels, moment.shading.sky.iter().copied()).max(Vec3::ZERO),
            bounce: moment.shading.sun_irradiance * weighted(&bounced, channels, functions).max(Vec3::ZERO),
        }
    }

    /// The part of the sun of a step that reaches a place.
    fn reached(&self, uv: Vec2, bit: u32) -> f32 {
        let size = UVec2::new(self.sun.width, self.sun.height);
        let at = uv * size.as_vec2();
        let (middle, off) = (at.floor(), at - at.floor() - 0.5);
        let taps = [0.5 * (0.5 - off) * (0.5 - off), 0.75 - off * off, 0.5 * (0.5 + off) * (0.5 + off)];
        let mut mixed = 0.0;
        for (j, i) in (0..3).flat_map(|j| (0..3).map(move |i| (j, i))) {
            let texel = (middle + Vec2::new(i as f32, j as f32) - 1.0).max(Vec2::ZERO).as_uvec2().min(size - 1);
            let reaches = self.mask_word(texel, bit / 32) >> (bit % 32) & 1 == 1;
            mixed += if reaches { taps[i].x * taps[j].y } else { 0.0 };
        }
        let step = ((mixed - 0.25) / 0.5).clamp(0.0, 1.0);
        step * step * (3.0 - 2.0 * step)
    }

    fn mask_word(&self, texel: UVec2, word: u32) -> u32 {
        let at = place(&self.sun, texel, word) * 4;
        self.sun.levels[0][at..].first_chunk().map_or(0, |&four| u32::from_le_bytes(four))
    }
}

/// The level whose texels weathering has on its finest.
pub const WEATHERING_LEVEL: u32 = 1;

/// The texture of weathering from levels of layers, the finest of so many texels: of each texel its colour times its cover, linear in [0, 1], and its cover.
#[must_use]
pub fn weathering_texture([width, height]: [u32; 2], levels: &[Vec<[f32; 4]>]) -> Ktx2 {
    // from 0 to 1 onto 8 bits, to the nearest
    let cover = |cover: f32| (cover.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
    let texel = |&[r, g, b, a]: &[f32; 4]| [srgb8_from_linear(r), srgb8_from_linear(g), srgb8_from_linear(b), cover(a)];
    let levels = levels.iter().map(|level| level.iter().flat_map(texel).collect()).collect();
    Ktx2 { format: TexelFormat::Rgba8Srgb, width, height, layers: 1, levels }
}

/// Whether weathering is that of an atlas of this size.
///
/// # Errors
/// What is not.
pub fn validate_weathering(layer: &Ktx2, info: &TexelInfo) -> Result<(), TexelFault> {
    is_shape("weathering", layer.shape(), Shapes::weathering(info))
}

/// What weathering leaves of an albedo at a place of the atlas, on the finest level: the reference of shaders.
#[must_use]
pub fn weathered(layer: &Ktx2, uv: Vec2, albedo: Vec3) -> Vec3 {
    let part = |channel: usize| {
        filtered(layer, uv, |texel| {
            let code = f32::from(layer.levels[0][place(layer, texel, 0) * 4 + channel]) / 255.0;
            if channel == 3 { code } else { linear_from_srgb(code) }
        })
    };
    albedo * (1.0 - part(3)) + Vec3::new(part(0), part(1), part(2))
}

/// The number of a texel of the first level, counted through the layers.
fn place(texture: &Ktx2, texel: UVec2, layer: u32) -> usize {
    ((layer as usize * texture.height as usize) + texel.y as usize) * texture.width as usize + texel.x as usize
}

fn float_of(texture: &Ktx2, texel: UVec2, number: usize) -> f32 {
    let at = (place(texture, texel, (number / 4) as u32) * 4 + number % 4) * 2;
    texture.levels[0][at..].first_chunk().map_or(0.0, |&two| f16::from_le_bytes(two).to_f32())
}

/// What texels have, mixed linearly at a place; at its edges the texture goes on as it ends.
fn filtered(texture: &Ktx2, uv: Vec2, of: impl Fn(UVec2) -> f32) -> f32 {
    let size = UVec2::new(texture.width, texture.height);
    let at = uv * size.as_vec2() - 0.5;
    let (low, part) = (at.floor(), at - at.floor());
    let corners = [Vec2::ZERO, Vec2::X, Vec2::Y, Vec2::ONE];
    let mix = |corner: Vec2| {
        let texel = (low + corner).max(Vec2::ZERO).as_uvec2().min(size - 1);
        (Vec2::ONE - (part - corner).abs()).element_product() * of(texel)
    };
    corners.into_iter().map(mix).sum()
}

/// A texture of 16-bit floats from levels of numbers, `per_texel` for each texel; what is too large for them becomes their largest.
#[must_use]
pub fn float_texture([width, height]: [u32; 2], per_texel: usize, levels: &[Vec<f32>]) -> Ktx2 {
    let layers = per_texel.div_ceil(4).max(1);
    let level = |(level, numbers): (u32, &Vec<f32>)| {
        let texels = (side(width, level) * side(height, level)) as usize;
        let mut bytes = vec![0_u8; texels * layers * 8];
        for (texel, own) in numbers.chunks_exact(per_texel.max(1)).take(texels).enumerate() {
            for (number, value) in own.iter().enumerate() {
                let half = f16::from_f32(value.clamp(f16::MIN.to_f32(), f16::MAX.to_f32()));
                let at = ((number / 4 * texels + texel) * 4 + number % 4) * 2;
                bytes[at..at + 2].copy_from_slice(&half.to_le_bytes());
            }
        }
        bytes
    };
    let levels = (0..).zip(levels).map(level).collect();
    Ktx2 { format: TexelFormat::Rgba16Float, width, height, layers: layers as u32, levels }
}

/// The texture of sun masks from levels of their words, W for each texel.
#[must_use]
pub fn sun_texture(layout: LightLayout, [width, height]: [u32; 2], levels: &[Vec<u32>]) -> Ktx2 {
    let words = layout.mask_words();
    let level = |(level, masks): (u32, &Vec<u32>)| {
        let texels = (side(width, level) * side(height, level)) as usize;
        let mut bytes = vec![0_u8; texels * words * 4];
        for (texel, own) in masks.chunks_exact(words.max(1)).take(texels).enumerate() {
            for (word, value) in own.iter().enumerate() {
                let at = (word * texels + texel) * 4;
                bytes[at..at + 4].copy_from_slice(&value.to_le_bytes());
            }
        }
        bytes
    };
    let levels = (0..).zip(levels).map(level).collect();
    Ktx2 { format: TexelFormat::R32Uint, width, height, layers: words as u32, levels }
}

impl From<ImageError> for TexelFault {
    fn from(error: ImageError) -> Self {
        Self(error.to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LAYOUT: LightLayout = LightLayout { sun_steps: 40, coefficients: 4, channels: 1, sun_bounce_functions: 5 };
    const INFO: TexelInfo = TexelInfo { width: 8, height: 4, per_m: 1.0, utilisation: 1.0, texels: 32 };

    fn light() -> TexelLight {
        let sizes = [32, 8, 2];
        let masks: Vec<Vec<u32>> = sizes.map(|n| (0..2 * n).map(|i| if i % 2 == 0 { i << 3 } else { 1 }).collect()).into();
        let floats: Vec<Vec<f32>> = sizes.map(|n| (0..4 * n).map(|i| i as f32 / 8.0).collect()).into();
        let bounced: Vec<f32> = (0..2 * 5).map(|i| i as f32).collect();
        TexelLight {
            sun: sun_texture(LAYOUT, [8, 4], &masks),
            sky: float_texture([8, 4], 4, &floats),
            bounce: Some(float_texture([2, 1], 5, &[bounced])),
        }
    }

    #[test]
    fn numbers_are_found_where_they_were_put() {
        let light = light();
        light.validate(LAYOUT, INFO.size()).unwrap();
        // what is lit: the sky on three levels, the bounce on the last
        assert_eq!(light.bytes() + (32 + 8 + 2 + 2) * 8, atlas_bytes(LAYOUT, [8, 4]));
        assert_eq!((light.mask_word(UVec2::new(3, 2), 0), light.mask_word(UVec2::new(3, 2), 1)), (38 << 3, 1));
        assert_eq!(float_of(&light.sky, UVec2::new(3, 2), 2), (4.0 * 19.0 + 2.0) / 8.0);
        let bounce = light.bounce.as_ref().unwrap();
        assert_eq!((bounce.layers, float_of(bounce, UVec2::new(1, 0), 4)), (2, 9.0));
        let between = filtered(bounce, Vec2::new(0.5, 0.3), |texel| float_of(bounce, texel, 0));
        assert_eq!(between, 2.5);
        assert_eq!(filtered(bounce, Vec2::new(0.0, 1.0), |texel| float_of(bounce, texel, 1)), 1.0);
    }

    #[test]
    fn weathering_is_an_albedo_over_another() {
        // paint of half cover in the left half, none in the right
        let texel = |i: u32| if i % 4 < 2 { [0.3, 0.2, 0.1, 0.5] } else { [0.0; 4] };
        let levels = [(0..8).map(texel).collect(), (0..2).map(texel).collect()];
        let layer = weathering_texture([4, 2], &levels);
        validate_weathering(&layer, &INFO).unwrap();
        let (left, right) = (weathered(&layer, Vec2::new(0.2, 0.5), Vec3::ONE), weathered(&layer, Vec2::ONE, Vec3::ONE));
        assert!(left.abs_diff_eq(Vec3::new(0.8, 0.7, 0.6), 0.005), "{left}");
        assert_eq!(right, Vec3::ONE);
        let between = weathered(&layer, Vec2::new(0.5, 0.5), Vec3::ONE);
        assert!(between.abs_diff_eq(Vec3::new(0.9, 0.85, 0.8), 0.005), "{between}");
        let other = validate_weathering(&layer, &TexelInfo { width: 16, ..INFO }).unwrap_err();
        assert!(other.to_string().contains("weathering is"), "{other}");
    }

    #[test]
    fn textures_of_another_light_are_refused() {
        let other = |layout, info: TexelInfo| light().validate(layout, info.size()).unwrap_err().to_string();
        assert!(other(LightLayout { sun_steps: 92, ..LAYOUT }, INFO).contains("sun is"));
        assert!(other(LightLayout { sun_bounce_functions: 0, ..LAYOUT }, INFO).contains("bounce"));
        assert!(other(LAYOUT, TexelInfo { width: 12, ..INFO }).contains("not"));
        assert!(other(LAYOUT, TexelInfo { width: 10, ..INFO }).contains("multiples of 4"));
        let mut broken = light();
        broken.sky.levels[1][1] = 0x7C;
        broken.sky.levels[1][0] = 0;
        assert!(broken.validate(LAYOUT, INFO.size()).unwrap_err().to_string().contains("finite"));
    }
}
