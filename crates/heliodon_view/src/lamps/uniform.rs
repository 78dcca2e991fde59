//! What the shaders know of the lamps, and which way each tile of their shadow maps looks.

use super::Lamp;
use bytemuck::{Pod, Zeroable};
use glam::{Mat4, Vec3, Vec4};

/// Lamps that are lit at a time; `LAMPS` in lamps.wgsl.
pub const MOST_LAMPS: usize = 8;
/// Faces of a lamp that shines to all sides.
const CUBE: usize = 6;
/// Tiles of the maps at most; the length of `clip_from_world` in lamps.wgsl.
pub const MOST_TILES: usize = MOST_LAMPS * CUBE;
/// Texels of a tile's side; `TILE_PX` in lamps.wgsl: 2 cm, five metres from a lamp that shines to all sides.
pub const TILE_PX: u32 = 512;
/// Tiles side by side; `TILES_ACROSS` in lamps.wgsl.
pub const TILES_ACROSS: u32 = 8;
/// Texels around a tile's picture, so that samples stay in the tile.
const MARGIN_PX: f32 = 3.0;
/// Nearer to a lamp nothing casts a shadow: its own body would.
const NEAR_M: f32 = 0.05;

/// `Lamps` of lamps.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct LampsUniform {
    place: [Vec4; MOST_LAMPS],
    light: [Vec4; MOST_LAMPS],
    cone: [Vec4; MOST_LAMPS],
    shadow: [Vec4; MOST_LAMPS],
    clip_from_world: [Mat4; MOST_TILES],
}

/// Size of `Lamps` in lamps.wgsl, which a test compares with what the shader's compiler says.
pub const LAMPS_BYTES: usize = size_of::<LampsUniform>();

/// A tile of the shadow maps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tile {
    /// The lamp, by its number among those that are lit.
    pub lamp: usize,
    /// World to the tile's clip space; depth is 0 near the lamp and 1 at its reach.
    pub clip_from_world: Mat4,
}

/// The lamps that are lit: the first that give any light.
#[must_use]
pub fn lit<'a>(lamps: impl IntoIterator<Item = &'a Lamp>) -> Vec<Lamp> {
    let gives = |lamp: &&Lamp| lamp.intensity.max_element() > 0.0 && lamp.reach_m > 0.0 && lamp.place.is_finite();
    lamps.into_iter().filter(gives).take(MOST_LAMPS).copied().collect()
}

/// The tiles that the shadows of [`lit`] lamps need, lamp by lamp: one for a spot light, six for others in the order of +X, -X, +Y, -Y, +Z, -Z.
#[must_use]
pub fn tiles(lamps: &[Lamp]) -> Vec<Tile> {
    let mut tiles = Vec::new();
    for (number, lamp) in lamps.iter().enumerate().filter(|(_, lamp)| lamp.shadows) {
        match lamp.cone {
            Some(cone) => tiles.push(tile(number, lamp, cone.direction, cone.half_angle_rad)),
            None => {
                let faces = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z];
                tiles.extend(faces.map(|axis| tile(number, lamp, axis, std::f32::consts::FRAC_PI_4)));
            }
        }
    }
    tiles
}

fn tile(lamp: usize, at: &Lamp, direction: Vec3, half_angle_rad: f32) -> Tile {
    let tangent = libm::tanf(half_angle_rad) * (TILE_PX as f32 / (TILE_PX as f32 - 2.0 * MARGIN_PX));
    let up = if direction.y.abs() > 0.9 { Vec3::Z } else { Vec3::Y };
    let project = Mat4::perspective_rh(2.0 * libm::atanf(tangent), 1.0, NEAR_M.min(0.5 * at.reach_m), at.reach_m);
    Tile { lamp, clip_from_world: project * Mat4::look_to_rh(at.place, direction, up) }
}

impl LampsUniform {
    /// For [`lit`] lamps and their [`tiles`], with all light multiplied by `exposure`.
    #[must_use]
    pub fn new(lamps: &[Lamp], tiles: &[Tile], exposure: f32) -> Self {
        let mut uniform = Self::zeroed();
        // Nothing is within the reach of a lamp that is not there.
        uniform.place = [Vec3::ZERO.extend(f32::MAX); MOST_LAMPS];
        for (i, lamp) in lamps.iter().enumerate() {
            uniform.place[i] = lamp.place.extend(1.0 / (lamp.reach_m * lamp.reach_m));
            uniform.light[i] = (lamp.intensity * (exposure * std::f32::consts::FRAC_1_PI)).extend(0.0);
            // Without a cone every cosine is far above the edge's.
            (uniform.cone[i], uniform.light[i].w) = match lamp.cone {
                Some(cone) => {
                    let edge = libm::cosf(cone.half_angle_rad);
                    let full = libm::cosf(cone.half_angle_rad * (1.0 - cone.edge));
                    (cone.direction.extend(edge), 1.0 / (full - edge).max(1e-4))
                }
                None => (Vec3::ZERO.extend(-2.0), 1.0),
            };
            let first = tiles.iter().position(|tile| tile.lamp == i);
            let half_angle_rad = lamp.cone.map_or(std::f32::consts::FRAC_PI_4, |cone| cone.half_angle_rad);
            // What a texel is wide, one metre away.
            let texel = 2.0 * libm::tanf(half_angle_rad) / TILE_PX as f32;
            let faces = if lamp.cone.is_some() { 1.0 } else { CUBE as f32 };
            uniform.shadow[i] = Vec4::new(first.map_or(-1.0, |first| first as f32), faces, texel, 0.0);
        }
        for (slot, tile) in uniform.clip_from_world.iter_mut().zip(tiles) {
            *slot = tile.clip_from_world;
        }
        uniform
    }
}

/// Whether any lamp may light what lies in a box of the world.
#[must_use]
pub fn may_light(lamps: &[Lamp], (low, high): (Vec3, Vec3)) -> bool {
    lamps.iter().any(|lamp| {
        let near = lamp.place.distance_squared(lamp.place.clamp(low, high)) < lamp.reach_m * lamp.reach_m;
        near && lamp.cone.is_none_or(|cone| {
            // A sphere around the box and the cone: the angle from the axis, less that under which the sphere is seen.
            let (to, radius) = ((low + high) * 0.5 - lamp.place, 0.5 * low.distance(high));
            let distance = to.length();
            distance <= radius
                || cone.direction.angle_between(to) < cone.half_angle_rad + libm::asinf((radius / distance).min(1.0))
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lamps::Cone;

    fn lamp(place: Vec3, cone: Option<Cone>) -> Lamp {
        Lamp { place, intensity: Vec3::ONE, cone, reach_m: 5.0, shadows: true }
    }

    fn spot(direction: Vec3) -> Option<Cone> {
        Some(Cone { direction, half_angle_rad: 0.4, edge: 0.3 })
    }

    #[test]
    fn every_direction_is_in_the_tile_of_its_face() {
        let place = Vec3::new(3.0, 1.0, -2.0);
        let tiles = tiles(&[lamp(place, None)]);
        assert_eq!(tiles.len(), CUBE);
        for direction in heliodon_math::sphere::fibonacci_sphere(500) {
            // as the shader chooses it
            let size = direction.abs();
            let axis = if size.x >= size.y && size.x >= size.z {
                0
            } else if size.y >= size.z {
                1
            } else {
                2
            };
            let face = 2 * axis + usize::from(direction[axis] < 0.0);
            for distance in [0.1, 1.0, 4.9] {
                let on = tiles[face].clip_from_world.project_point3(place + direction * distance);
                assert!(on.x.abs() < 1.0 && on.y.abs() < 1.0 && (0.0..1.0).contains(&on.z), "{direction} {distance}: {on}");
            }
        }
    }

    #[test]
    fn lamps_take_tiles_one_after_the_other() {
        let dark = Lamp { shadows: false, ..lamp(Vec3::ZERO, None) };
        let off = Lamp { intensity: Vec3::ZERO, ..lamp(Vec3::ZERO, None) };
        let lamps = lit(&[lamp(Vec3::X, spot(Vec3::NEG_Y)), off, dark, lamp(Vec3::Y, None)]);
        let tiles = tiles(&lamps);
        assert_eq!(tiles.iter().map(|tile| tile.lamp).collect::<Vec<_>>(), [0, 2, 2, 2, 2, 2, 2]);
        let uniform = LampsUniform::new(&lamps, &tiles, 2.0);
        assert_eq!(uniform.shadow.map(|shadow| shadow.x)[..3], [0.0, -1.0, 1.0]);
        assert_eq!((uniform.light[0].x, uniform.place[0].w), (2.0 * std::f32::consts::FRAC_1_PI, 0.04));
        assert_eq!(lit(&vec![lamp(Vec3::ZERO, None); 20]).len(), MOST_LAMPS);
    }

    #[test]
    fn boxes_are_lit_within_reach_and_cone() {
        let at = |lamp: Lamp, center: Vec3| may_light(&[lamp], (center - 0.5, center + 0.5));
        let all = lamp(Vec3::ZERO, None);
        assert!(at(all, Vec3::ZERO) && at(all, Vec3::new(0.0, 5.4, 0.0)) && !at(all, Vec3::new(4.0, 4.0, 4.0)));
        let down = lamp(Vec3::ZERO, spot(Vec3::NEG_Y));
        assert!(at(down, Vec3::new(0.0, -3.0, 0.0)) && at(down, Vec3::new(1.9, -3.0, 0.0)));
        assert!(!at(down, Vec3::new(0.0, 3.0, 0.0)) && !at(down, Vec3::new(3.5, -2.0, 0.0)));
    }
}
