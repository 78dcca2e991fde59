//! How actors shade the stone: a map of their depth from the sun, and spheres that take its sky.

use bytemuck::{Pod, Zeroable};
use glam::{Mat4, Vec3, Vec4};
use heliodon_math::frame::{orthonormal_basis, unit_or};

/// Actors that shade; `ACTORS` in shade.wgsl.
pub const ACTORS: usize = 8;
/// Spheres of each; `SPHERES` in shade.wgsl.
pub const SPHERES: usize = 24;
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
}

/// `Shade` of shade.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct ShadeUniform {
    sun_over_pi: Vec4,
    sun_direction: Vec4,
    count: [u32; 4],
    tile_from_world: [Mat4; ACTORS],
    reach: [Vec4; ACTORS],
    radius: [Vec4; ACTORS],
    tile: [Vec4; ACTORS],
    spheres: [Vec4; ACTORS * SPHERES],
}

/// Size of `Shade` in shade.wgsl, which a test compares with what the shader's compiler says.
pub const SHADE_BYTES: usize = size_of::<ShadeUniform>();

impl ShadeUniform {
    /// For casters (no more than [`ACTORS`] are taken) under a sun of this exposed irradiance at normal incidence; also the matrices that draw each caster into its tile.
    #[must_use]
    pub fn new(casters: &[Caster], sun_direction: Vec3, sun_irradiance: Vec3) -> (Self, Vec<Mat4>) {
        let mut uniform = Self::zeroed();
        uniform.sun_over_pi = (sun_irradiance * std::f32::consts::FRAC_1_PI).extend(0.0);
        uniform.sun_direction = sun_direction.extend(0.0);
        let mut clips = Vec::new();
        for (i, caster) in casters.iter().take(ACTORS).enumerate() {
            let clip = clip_from_world(caster.bounds, sun_direction);
            let tile = Vec3::new((i as u32 % TILES_ACROSS) as f32, (i as u32 / TILES_ACROSS) as f32, 0.0);
            let across = Vec3::new(1.0 / TILES_ACROSS as f32, 1.0 / TILES_DOWN as f32, 1.0);
            // clip space has y up, textures down
            let to_tile = Mat4::from_translation(Vec3::new(0.5, 0.5, 0.0)) * Mat4::from_scale(Vec3::new(0.5, -0.5, 1.0));
            uniform.tile_from_world[i] = Mat4::from_scale(across) * Mat4::from_translation(tile) * to_tile * clip;
            let margin = Vec3::new(across.x, across.y, 0.0) * (MARGIN_PX / TILE_PX as f32);
            let (low, high) = (tile * across + margin, (tile + Vec3::new(1.0, 1.0, 0.0)) * across - margin);
            uniform.tile[i] = Vec4::new(low.x, low.y, high.x, high.y);
            let largest = caster.lumps.iter().map(|lump| lump.w).fold(0.0, f32::max);
            let reach = caster.bounds.w + REACH * largest;
            uniform.reach[i] = caster.bounds.truncate().extend(reach * reach);
            uniform.radius[i].x = caster.bounds.w * caster.bounds.w;
            for (slot, &lump) in uniform.spheres[i * SPHERES..(i + 1) * SPHERES].iter_mut().zip(&caster.lumps) {
                *slot = lump;
            }
            clips.push(clip);
        }
        uniform.count[0] = clips.len() as u32;
        (uniform, clips)
    }
}

/// Whether a caster may shade anything in a box of the world under a sun: where its darkness of the sky reaches, or behind it.
#[must_use]
pub fn may_shade(caster: &Caster, sun_direction: Vec3, (low, high): (Vec3, Vec3)) -> bool {
    let (center, radius) = (caster.bounds.truncate(), caster.bounds.w);
    let largest = caster.lumps.iter().map(|lump| lump.w).fold(0.0, f32::max);
    let reach = radius + REACH * largest;
    if center.distance_squared(center.clamp(low, high)) < reach * reach {
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
fn clip_from_world(bounds: Vec4, sun_direction: Vec3) -> Mat4 {
    let radius = bounds.w.max(1e-3) * (1.0 + 2.0 * MARGIN_PX / TILE_PX as f32);
    let forward = unit_or(-sun_direction, Vec3::NEG_Y);
    let (x, _) = orthonormal_basis(forward);
    // right-handed, looking along the light
    let y = x.cross(forward);
    let center = bounds.truncate();
    let row = |axis: Vec3, scale: f32, shift: f32| (axis / scale).extend(shift - axis.dot(center) / scale);
    Mat4::from_cols(
        row(x, radius, 0.0),
        row(y, radius, 0.0),
        // everything between the caster's front and a kilometre behind it
        row(forward, SHADOW_M, radius / SHADOW_M),
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
        let caster = Caster { bounds: Vec4::new(0.0, 1.0, 0.0, 1.0), lumps: vec![Vec4::new(0.0, 1.0, 0.0, 0.1)] };
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
            (0..10).map(|i| Caster { bounds: at(i).extend(1.0), lumps: vec![at(i).extend(0.2); 30] }).collect();
        let sun = unit_or(Vec3::new(0.3, 0.5, 0.2), Vec3::Y);
        let (uniform, clips) = ShadeUniform::new(&casters, sun, Vec3::ONE);
        assert_eq!((uniform.count[0] as usize, clips.len()), (ACTORS, ACTORS));
        for (i, clip) in clips.iter().enumerate() {
            let tile = uniform.tile[i];
            for offset in [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z, Vec3::ZERO] {
                let place = at(i) + offset;
                let on_map = uniform.tile_from_world[i].transform_point3(place);
                assert!(on_map.x >= tile.x && on_map.y >= tile.y && on_map.x <= tile.z && on_map.y <= tile.w, "{i} {on_map}");
                // the same place for who draws and who reads
                let clip = clip.transform_point3(place);
                assert!(clip.abs().max_element() <= 1.0 && clip.z >= 0.0);
                let behind = uniform.tile_from_world[i].transform_point3(place - sun * 5.0);
                assert!((behind.truncate() - on_map.truncate()).length() < 1e-5 && behind.z > on_map.z + 0.02);
            }
        }
        assert!(uniform.spheres.iter().all(|sphere| sphere.w == 0.2));
    }
}
