//! How actors shade the stone: a map of their depth from the sun, and spheres that take its sky.

use bytemuck::{Pod, Zeroable};
use glam::{Mat4, Vec3, Vec4};
use heliodon_math::frame::{orthonormal_basis, unit_or};

/// Actors that shade; `ACTORS` in shade.wgsl.
pub const ACTORS: usize = 8;
/// Spheres of each; `SPHERES` in shade.wgsl.
pub const SPHERES: usize = 24;
/// Spheres that stand for several of them from afar; `MERGED` in shade.wgsl.
const MERGED: usize = SPHERES / MERGE;
/// How many spheres are one from afar.
const MERGE: usize = 4;
/// Both together; `ALL_SPHERES` in shade.wgsl.
const ALL_SPHERES: usize = SPHERES + MERGED;
/// How many radii of an actor from its middle that is.
const FAR: f32 = 1.25;
/// Texels of a tile's side: 4 mm for somebody who fits into two metres.
pub const TILE_PX: u32 = 512;
/// Tiles side by side.
pub const TILES_ACROSS: u32 = 4;
/// The map's rows of tiles.
pub const TILES_DOWN: u32 = ACTORS as u32 / TILES_ACROSS;
/// How many radii of its largest sphere beyond an actor the sky is darker: there that sphere takes a hundredth of it.
const REACH: f32 = 10.0;
/// Texels at a tile's edge that nothing casts into, so that samples stay within it.
const MARGIN_PX: f32 = 3.0;

/// What one actor casts.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Caster {
    /// A sphere around it: centre, and radius in w.
    pub bounds: Vec4,
    /// Spheres that take as much of the sky, radius in w.
    pub lumps: Vec<Vec4>,
    /// How much of it is not there, 0 to 1.
    pub faded: f32,
}

/// `Shade` of shade.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct ShadeUniform {
    sun_over_pi: Vec4,
    right: Vec4,
    up: Vec4,
    along: Vec4,
    tiles: [Vec4; ACTORS],
    reach: [Vec4; ACTORS],
    far: [Vec4; ACTORS],
    spheres: [Vec4; ACTORS * ALL_SPHERES],
}

/// Size of `Shade` in shade.wgsl, which a test compares with what the shader's compiler says.
pub const SHADE_BYTES: usize = size_of::<ShadeUniform>();

impl ShadeUniform {
    /// For casters (no more than [`ACTORS`] are taken) under a sun of this exposed irradiance at normal incidence; also the matrices that draw each caster into its tile.
    #[must_use]
    pub fn new(casters: &[Caster], sun_direction: Vec3, sun_irradiance: Vec3) -> (Self, Vec<Mat4>) {
        let mut uniform = Self::zeroed();
        uniform.sun_over_pi = (sun_irradiance * std::f32::consts::FRAC_1_PI).extend(0.0);
        let axes = sun_axes(sun_direction);
        [uniform.right, uniform.up, uniform.along] = axes.map(|axis| axis.extend(0.0));
        uniform.tiles = [Vec4::NEG_ONE; ACTORS];
        let mut clips = Vec::new();
        for (i, caster) in casters.iter().take(ACTORS).enumerate() {
            let center = caster.bounds.truncate();
            uniform.tiles[i] = Vec3::from(axes.map(|axis| axis.dot(center))).extend(half_width(caster));
            uniform.reach[i] = center.extend(reach(caster).powi(2));
            let there = 1.0 - caster.faded;
            uniform.far[i] = Vec4::new((FAR * caster.bounds.w).powi(2), there, 0.0, 0.0);
            let (all, merged) = uniform.spheres[i * ALL_SPHERES..(i + 1) * ALL_SPHERES].split_at_mut(SPHERES);
            all.iter_mut().zip(&caster.lumps).for_each(|(slot, &lump)| *slot = lump);
            merged.iter_mut().zip(caster.lumps.chunks(MERGE)).for_each(|(slot, lumps)| *slot = merge(lumps));
            // what is half there takes half of the sky
            all.iter_mut().chain(merged).for_each(|sphere| sphere.w *= there.sqrt());
            clips.push(clip_from_world(axes, uniform.tiles[i]));
        }
        (uniform, clips)
    }
}

/// The sphere that takes as much of the sky, seen from afar, as all of these.
fn merge(lumps: &[Vec4]) -> Vec4 {
    let square: f32 = lumps.iter().map(|lump| lump.w * lump.w).sum();
    let center: Vec3 = lumps.iter().map(|lump| lump.truncate() * (lump.w * lump.w)).sum();
    if square > 0.0 { (center / square).extend(square.sqrt()) } else { Vec4::ZERO }
}

/// Unit axes across the sun's light, to the right and up for who looks along it, and along it.
fn sun_axes(sun_direction: Vec3) -> [Vec3; 3] {
    let along = unit_or(-sun_direction, Vec3::NEG_Y);
    let (right, _) = orthonormal_basis(along);
    [right, right.cross(along), along]
}

/// Half of what a caster's tile is wide, metres: it fits in without the margin.
fn half_width(caster: &Caster) -> f32 {
    caster.bounds.w.max(1e-3) * (TILE_PX as f32 / (TILE_PX as f32 - 2.0 * MARGIN_PX))
}

/// How far from its middle a caster darkens the sky, metres.
fn reach(caster: &Caster) -> f32 {
    let largest = caster.lumps.iter().map(|lump| lump.w).fold(0.0, f32::max);
    caster.bounds.w + REACH * largest
}

/// Whether a caster may shade anything in a box of the world under a sun: where its darkness of the sky reaches, or behind it.
#[must_use]
pub fn may_shade(caster: &Caster, sun_direction: Vec3, (low, high): (Vec3, Vec3)) -> bool {
    let (center, radius) = (caster.bounds.truncate(), caster.bounds.w);
    if center.distance_squared(center.clamp(low, high)) < reach(caster).powi(2) {
        return true;
    }
    // A sphere around the box, and the way of the light behind the caster.
    let off = (low + high) * 0.5 - center;
    let wide = radius + 0.5 * low.distance(high);
    let behind = -off.dot(sun_direction);
    behind > -wide && behind < SHADOW_M + wide && (off + sun_direction * behind).length_squared() < wide * wide
}

/// From the world to the clip space of a caster's tile, in which z is 0 nearest to the sun. Casters stand behind nothing: what lies behind them at any distance is beyond 1 there and
/// counts as at 1.
fn clip_from_world([right, up, along]: [Vec3; 3], tile: Vec4) -> Mat4 {
    let row = |axis: Vec3, middle: f32, scale: f32, shift: f32| (axis / scale).extend((shift - middle) / scale);
    Mat4::from_cols(
        row(right, tile.x, tile.w, 0.0),
        row(up, tile.y, tile.w, 0.0),
        // everything from the caster's front on
        row(along, tile.z, SHADOW_M, tile.w),
        Vec4::W,
    )
    .transpose()
}

/// Shadows are this long at most, metres.
const SHADOW_M: f32 = 200.0;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boxes_are_shaded_nearby_and_behind() {
        let caster = Caster { bounds: Vec4::new(0.0, 1.0, 0.0, 1.0), lumps: vec![Vec4::new(0.0, 1.0, 0.0, 0.1)], faded: 0.0 };
        let sun = unit_or(Vec3::new(1.0, 0.5, 0.0), Vec3::Y);
        let at = |center: Vec3| may_shade(&caster, sun, (center - Vec3::splat(0.5), center + Vec3::splat(0.5)));
        assert!(at(Vec3::ZERO) && at(Vec3::new(0.0, 0.0, 2.2)));
        assert!(at(Vec3::new(-20.0, -9.0, 0.0)), "behind");
        assert!(!at(Vec3::new(20.0, 11.0, 0.0)) && !at(Vec3::new(0.0, 0.0, 9.0)) && !at(Vec3::new(-20.0, 9.0, 0.0)));
    }

    #[test]
    fn casters_lie_in_their_tiles_and_what_is_behind_lies_behind() {
        let at = |i: usize| Vec3::new(3.0 * i as f32, 1.0, -2.0);
        let casters: Vec<Caster> =
            (0..10).map(|i| Caster { bounds: at(i).extend(1.0), lumps: vec![at(i).extend(0.2); 30], faded: 0.0 }).collect();
        let sun = unit_or(Vec3::new(0.3, 0.5, 0.2), Vec3::Y);
        let (uniform, clips) = ShadeUniform::new(&casters, sun, Vec3::ONE);
        assert_eq!(clips.len(), ACTORS);
        // as the shader does it: in half tiles from the middle, y up, and the part of the way that a shadow goes
        let on_tile = |i: usize, place: Vec3| {
            let axes = [uniform.right, uniform.up, uniform.along].map(Vec4::truncate);
            let off = Vec3::from(axes.map(|axis| axis.dot(place))) - uniform.tiles[i].truncate();
            let half_width = uniform.tiles[i].w;
            Vec3::new(off.x / half_width, off.y / half_width, (off.z + half_width) / SHADOW_M)
        };
        let inside = (TILE_PX as f32 - 2.0 * MARGIN_PX) / TILE_PX as f32;
        for (i, clip) in clips.iter().enumerate() {
            for offset in [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z, Vec3::ZERO] {
                let place = at(i) + offset;
                let on_map = on_tile(i, place);
                assert!(on_map.truncate().abs().max_element() <= inside, "{i} {on_map}");
                // the same place for who draws and who reads
                assert!(clip.transform_point3(place).abs_diff_eq(on_map, 1e-5) && on_map.z >= 0.0);
                let behind = on_tile(i, place - sun * 5.0);
                assert!((behind.truncate() - on_map.truncate()).length() < 1e-5 && behind.z > on_map.z + 0.02);
            }
        }
        for spheres in uniform.spheres.chunks(ALL_SPHERES) {
            assert!(spheres[..SPHERES].iter().all(|sphere| sphere.w == 0.2));
            // four in one place
            assert!(spheres[SPHERES..].iter().all(|sphere| (sphere.w - 0.4).abs() < 1e-6));
        }
    }
}
