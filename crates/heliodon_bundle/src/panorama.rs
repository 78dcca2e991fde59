//! A panorama: what the middle of a room sees of the geometry as it was scanned, texel by texel, for what is drawn of it in fewer triangles.
//!
//! Six faces of a cube around the place lie in one atlas, three beside each other, those along +x, +y and +z above those along -x, -y and -z. Along face k
//! (of axis k) u goes with axis k + 1 and v with axis k + 2. Each face has [`RIM`] texels more on every side than its quarter of the view, so that filtering
//! needs no other face. A texel is what the line from the place through its middle first meets of the original: its light, its normal, its colour. Nothing is
//! said where that is not what is drawn there.
//!
//! | file | texels | holds |
//! | --- | --- | --- |
//! | `panorama/sun.ktx2`, `panorama/sky.ktx2`, `panorama/bounce.ktx2` | as `texels/` has them ([`crate::texels`]) | light |
//! | `panorama/surface.ktx2` | 16-bit floats, three levels | the normal, and 1 over how far along the face's axis what is drawn there lies, metres: 0 says nothing |
//! | `panorama/albedo.ktx2` | 8 bits RGBA, three levels | the albedo as sRGB; alpha 0 where a texture of the part's own tells it |
//!
//! A place that is drawn shows the texels around the line to it as far as they say that they lie in the plane of its triangle, within
//! [`TOLERANCE`] of its own distance; where none does, the light of its vertices. Readers may leave it all out.

use crate::chunk::LightLayout;
use crate::texels::{
    BOUNCE_BLOCK, Shapes, TEXEL_LEVELS, TexelFault, TexelLight, atlas_bytes, float_texture, is_shape, weathering_texture,
};
use glam::{UVec2, Vec2, Vec3};
use half::f16;
use heliodon_image::ktx2::{Ktx2, Ktx2Shape, TexelFormat};
use serde::{Deserialize, Serialize};

/// Texels beyond each side of a face's quarter of the view: on the coarsest level still two.
pub const RIM: u32 = 8;
/// Texels along a face's side that a site may ask for: multiples of 16.
pub const PANORAMA_SIDES: std::ops::RangeInclusive<u32> = 64..=2048;
/// How far off a triangle's plane what a texel tells of may lie, as a part of the distance along the face's axis.
pub const TOLERANCE: f32 = 0.01;
/// The folder of the textures.
pub const PANORAMA_FOLDER: &str = "panorama";
pub(crate) const SUN_FILE: &str = "panorama/sun.ktx2";
pub(crate) const SKY_FILE: &str = "panorama/sky.ktx2";
pub(crate) const BOUNCE_FILE: &str = "panorama/bounce.ktx2";
pub(crate) const SURFACE_FILE: &str = "panorama/surface.ktx2";
pub(crate) const ALBEDO_FILE: &str = "panorama/albedo.ktx2";

/// What a manifest says of a panorama.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PanoramaInfo {
    /// Texels along a face's side, a multiple of 16.
    pub side: u32,
    /// The place that it is seen from, metres.
    pub middle: [f32; 3],
    /// Texels that tell something.
    pub texels: u64,
}

impl PanoramaInfo {
    /// Texels of the atlas along u and v.
    #[must_use]
    pub fn size(&self) -> [u32; 2] {
        size_of(self.side)
    }

    /// Whether it can be one.
    ///
    /// # Errors
    /// What it is.
    pub(crate) fn validate(&self) -> Result<(), TexelFault> {
        if !is_side(self.side) {
            let (least, most) = (PANORAMA_SIDES.start(), PANORAMA_SIDES.end());
            return Err(TexelFault::new(format!(
                "a panorama of faces of {} texels; sides are multiples of 16 from {least} to {most}",
                self.side
            )));
        }
        if !self.middle.iter().all(|x| x.is_finite()) {
            return Err(TexelFault::new("a panorama that is seen from nowhere".to_owned()));
        }
        Ok(())
    }
}

/// Whether faces may have so many texels along a side.
#[must_use]
pub fn is_side(side: u32) -> bool {
    PANORAMA_SIDES.contains(&side) && side.is_multiple_of(BOUNCE_BLOCK * 4)
}

/// Texels along u and v of the atlas of faces of this side.
#[must_use]
pub fn size_of(side: u32) -> [u32; 2] {
    [3 * side, 2 * side]
}

/// The part of a face that is its quarter of the view, along a side.
#[must_use]
pub fn inset(side: u32) -> f32 {
    (side - 2 * RIM) as f32 / side as f32
}

/// The axis and the sign of the face that a direction goes through; true is down the axis.
#[must_use]
pub fn face_of(direction: Vec3) -> (usize, bool) {
    let Vec3 { x, y, z } = direction.abs();
    let axis = if x >= y && x >= z { 0 } else { 1 + usize::from(z > y) };
    (axis, direction[axis] < 0.0)
}

/// Where a place off the middle lies on a face: along u and v, and along the face's axis, which is above 0 in front of it.
#[must_use]
pub fn on_face((axis, down): (usize, bool), off: Vec3) -> Vec3 {
    let along = off[axis];
    Vec3::new(off[(axis + 1) % 3], off[(axis + 2) % 3], if down { -along } else { along })
}

/// Where in the atlas of faces of this side a place off the middle lies, by the face that it is in front of.
#[must_use]
pub fn uv_of(side: u32, off: Vec3) -> Vec2 {
    let face = face_of(off);
    let local = on_face(face, off);
    let within = Vec2::splat(0.5) + 0.5 * inset(side) * local.truncate() / local.z;
    (Vec2::new(face.0 as f32, f32::from(u8::from(face.1))) + within) / Vec2::new(3.0, 2.0)
}

/// From the middle through a texel of a level of the atlas of faces of this side on their finest: 1 along the face's axis.
#[must_use]
pub fn direction_of(side: u32, level: u32, texel: UVec2) -> Vec3 {
    let own = side >> level;
    let face = texel / own;
    let within = ((texel % own).as_vec2() + 0.5) * 2.0 / own as f32 - 1.0;
    let [u, v] = (within / inset(side)).to_array();
    let along = if face.y == 0 { 1.0 } else { -1.0 };
    match face.x {
        0 => Vec3::new(along, u, v),
        1 => Vec3::new(v, along, u),
        _ => Vec3::new(u, v, along),
    }
}

/// A panorama's textures.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Panorama {
    /// Its light.
    pub light: TexelLight,
    /// Normals, and how far what is drawn lies.
    pub surface: Ktx2,
    /// Albedo.
    pub albedo: Ktx2,
}

/// What [`Panorama::surface`] and [`Panorama::albedo`] must be.
pub(crate) fn looks([width, height]: [u32; 2]) -> [Ktx2Shape; 2] {
    [TexelFormat::Rgba16Float, TexelFormat::Rgba8Srgb].map(|format| Ktx2Shape {
        format,
        size: [width, height],
        layers: 1,
        levels: TEXEL_LEVELS,
    })
}

impl Panorama {
    /// Whether the textures are those of a panorama of this size and of light of this layout.
    ///
    /// # Errors
    /// What is not.
    pub fn validate(&self, layout: LightLayout, info: &PanoramaInfo) -> Result<(), TexelFault> {
        info.validate()?;
        self.light.validate(layout, info.size())?;
        let [surface, albedo] = looks(info.size());
        is_shape("surface", self.surface.shape(), surface)?;
        is_shape("albedo", self.albedo.shape(), albedo)?;
        let is_finite = |two: &[u8; 2]| f16::from_le_bytes(*two).is_finite();
        if !self.surface.levels.iter().all(|bytes| bytes.as_chunks().0.iter().all(is_finite)) {
            return Err(TexelFault::new("a panorama's normals that are not finite".to_owned()));
        }
        Ok(())
    }

    /// The files of it that a bundle of this layout has, each with its shape.
    ///
    /// # Errors
    /// Sides that it cannot have.
    pub(crate) fn files(layout: LightLayout, info: &PanoramaInfo) -> Result<Vec<(&'static str, Ktx2Shape)>, TexelFault> {
        info.validate()?;
        let Shapes { sun, sky, bounce } = Shapes::of(layout, info.size())?;
        let [surface, albedo] = looks(info.size());
        let bounce = bounce.map(|shape| (BOUNCE_FILE, shape));
        Ok([(SUN_FILE, sun), (SKY_FILE, sky), (SURFACE_FILE, surface), (ALBEDO_FILE, albedo)]
            .into_iter()
            .chain(bounce)
            .collect())
    }
}

/// The texture of normals and of 1 over distances from levels of them, four numbers a texel.
#[must_use]
pub fn surface_texture(size: [u32; 2], levels: &[Vec<f32>]) -> Ktx2 {
    float_texture(size, 4, levels)
}

/// The texture of albedo from levels of it: of each texel linear colour in [0, 1], and alpha.
#[must_use]
pub fn albedo_texture(size: [u32; 2], levels: &[Vec<[f32; 4]>]) -> Ktx2 {
    weathering_texture(size, levels)
}

/// Bytes in the memory of a viewer of a panorama of faces of this side: those of its light, 12 for each texel, and a third more for the levels above.
#[must_use]
pub fn panorama_bytes(layout: LightLayout, side: u32) -> u64 {
    let size = size_of(side);
    let looks: u64 = looks(size).iter().map(|shape| u64::from(shape.format.block_bytes())).sum();
    let texels = |level: u32| u64::from(size[0] >> level) * u64::from(size[1] >> level);
    atlas_bytes(layout, size) + (0..TEXEL_LEVELS).map(|level| texels(level) * looks).sum::<u64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texels_lie_where_their_directions_go() {
        let side = 64;
        let [width, height] = size_of(side);
        let mut own = 0;
        for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
            let texel = UVec2::new(x, y);
            let off = direction_of(side, 0, texel);
            // beyond its quarter a face shows what others show
            if off.abs().max_element() > 1.0 {
                continue;
            }
            own += 1;
            let at = uv_of(side, 7.0 * off) * Vec2::new(width as f32, height as f32);
            assert!((at - texel.as_vec2() - 0.5).abs().max_element() < 1e-3, "{texel} at {at}");
        }
        assert_eq!(own, 6 * (side - 2 * RIM) * (side - 2 * RIM));
        // a texel of the coarsest level stands in the middle of sixteen
        let coarse = direction_of(side, 2, UVec2::new(40, 5));
        let four: Vec3 =
            [[161, 21], [162, 21], [161, 22], [162, 22]].map(|at| direction_of(side, 0, UVec2::from(at))).iter().sum();
        assert!(coarse.abs_diff_eq(four / 4.0, 1e-5));
    }

    #[test]
    fn sides_are_those_that_all_levels_have() {
        assert!([64, 512, 2048].into_iter().all(is_side));
        assert!(![0, 48, 72, 2064].into_iter().any(is_side));
    }
}
