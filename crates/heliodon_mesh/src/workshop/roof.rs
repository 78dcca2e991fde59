//! The roof: tiles on boards on rafters, purlins and trusses, and the opening above the statue.

use super::measures::*;
use super::palette::{Material, Palette};
use super::pieces::{beam, cuboid, extruded, framed};
use super::slab::{Face, Side, Slab};
use crate::temple::solid::SolidMesh;
use glam::{Vec2, Vec3};

/// Height and depth of the layers under the boards, upright: common rafters, purlins, principal rafters.
const RAFTER_DEPTH: f32 = 0.13;
const PURLIN_DEPTH: f32 = 0.24;
const PRINCIPAL_DEPTH: f32 = 0.34;
/// Distance of the purlins from the axis.
const PURLINS: [f32; 4] = [-5.4, -3.75, 3.75, 5.4];
/// Underside and depth of the tie beams.
const TIE_BEAM: (f32, f32) = (10.5, 0.46);
/// Common rafters between two trusses.
const RAFTERS_A_BAY: usize = 4;

/// Boards and tiles: one sheet over both slopes.
fn cover(palette: &mut Palette) -> SolidMesh {
    let (eaves, gable) = (HALF_WIDTH + OVERHANG.0, HALF_LENGTH + OVERHANG.1);
    let (west, east, upper, lower) = SKYLIGHT;
    let (xs, zs) = ([-gable, west, east, gable], [eaves, lower, upper, 0.0, -eaves]);
    let (tiles, boards) = (palette.pick(Material::RoofTile), palette.pick(Material::Plank) * 0.8);
    Slab {
        columns: 3,
        rows: 4,
        place: |side, i: usize, j: usize| {
            let lift = if side == Side::Front { ROOF_THICKNESS } else { 0.0 };
            Vec3::new(xs[i], roof_underside(zs[j]) + lift, zs[j])
        },
        open: |i, j| i == 1 && j == 1,
        color_linear: |face| match face {
            Face::Cell(Side::Front, ..) => tiles,
            _ => boards,
        },
    }
    .build()
}

/// A timber down a slope from near the ridge to `far` from the axis, its top at `under` below the boards, upright.
fn on_slope(x: f32, (near, far): (f32, f32), under: f32, width: f32, depth: f32, color: Vec3) -> SolidMesh {
    // width is sideways, so the section's height is measured square to the slope
    let square = 1.0 / (1.0 + ROOF_SLOPE * ROOF_SLOPE).sqrt();
    let at = |z: f32| Vec3::new(x, roof_underside(z) - under - 0.5 * depth, z);
    beam(at(near), at(far), width, depth * square, Vec3::Y, color)
}

/// One truss, a colonnade's beam apart from the next.
fn truss(x: f32, palette: &mut Palette, solids: &mut Vec<SolidMesh>) {
    let (low, depth) = TIE_BEAM;
    let mut wood = || palette.pick(Material::Timber);
    let end = INNER_HALF_WIDTH + 0.3;
    solids.push(cuboid(Vec3::new(x - 0.19, low, -end), Vec3::new(x + 0.19, low + depth, end), wood()));
    let under = RAFTER_DEPTH + PURLIN_DEPTH - 3.0 * BITE;
    for way in [1.0, -1.0] {
        // the two meet in the king post
        // and one is a little narrower than the other where they cross
        let width = 0.275 + 0.005 * way;
        solids.push(on_slope(x, (0.04 * way, end * way), under, width, PRINCIPAL_DEPTH, wood()));
        let (foot, head) = (Vec3::new(x, low + depth + 0.12, 0.1 * way), 3.55 * way);
        let top = roof_underside(head) - under - PRINCIPAL_DEPTH + 0.06;
        solids.push(beam(foot, Vec3::new(x, top, head), 0.17, 0.17, Vec3::Y, wood()));
    }
    let top = RIDGE_HEIGHT - RAFTER_DEPTH - 0.1;
    solids.push(cuboid(Vec3::new(x - 0.17, low + depth - BITE, -0.15), Vec3::new(x + 0.17, top, 0.15), wood()));
}

/// Rafters between the trusses, but none across the skylight.
fn rafters(palette: &mut Palette, solids: &mut Vec<SolidMesh>) {
    let bay = COLUMN_PLACES[1] - COLUMN_PLACES[0];
    let step = bay / RAFTERS_A_BAY as f32;
    let (west, east, upper, lower) = SKYLIGHT;
    let end = HALF_WIDTH + OVERHANG.0 - 0.2;
    let count = (INNER_HALF_LENGTH / step) as i32;
    for k in -count..=count {
        let x = k as f32 * step;
        for way in [1.0, -1.0] {
            let across = way > 0.0 && x > west - 0.1 && x < east + 0.1;
            let spans = if across { vec![(0.04, upper - 0.1), (lower + 0.1, end)] } else { vec![(0.04, end)] };
            for (near, far) in spans {
                let wood = palette.pick(Material::Timber);
                solids.push(on_slope(x, (near * way, far * way), -3.0 * BITE, 0.11, RAFTER_DEPTH + 3.0 * BITE, wood));
            }
        }
    }
}

/// A frame around the skylight that keeps the rain of the slope out of it, and trimmers below.
fn skylight_frame(palette: &mut Palette, solids: &mut Vec<SolidMesh>) {
    let (west, east, upper, lower) = SKYLIGHT;
    for x in [west - 0.06, east + 0.06] {
        let wood = palette.pick(Material::Timber);
        solids.push(on_slope(x, (upper - 0.1, lower + 0.1), -ROOF_THICKNESS - 0.16, 0.09, ROOF_THICKNESS + 0.3, wood));
    }
    for z in [upper - 0.055, lower + 0.055] {
        let wood = palette.pick(Material::Timber);
        let y = roof_underside(z);
        let high = y + ROOF_THICKNESS + 0.12;
        solids.push(cuboid(Vec3::new(west - 0.13, y - 0.12, z - 0.05), Vec3::new(east + 0.13, high, z + 0.05), wood));
    }
}

/// Rows of cover tiles down the slopes and along the ridge, seen from outside.
fn cover_tiles(palette: &mut Palette, solids: &mut Vec<SolidMesh>) {
    const SPACING: f32 = 0.92;
    let (eaves, gable) = (HALF_WIDTH + OVERHANG.0 + 0.03, HALF_LENGTH + OVERHANG.1 - 0.1);
    let (west, east, _, lower) = SKYLIGHT;
    let count = (gable / SPACING) as i32;
    for k in -count..=count {
        let x = k as f32 * SPACING;
        for way in [1.0, -1.0] {
            let across = way > 0.0 && x > west - 0.2 && x < east + 0.2;
            let near = if across { lower + 0.25 } else { 0.02 };
            let color = palette.pick(Material::RoofTile);
            solids.push(on_slope(x, (near * way, eaves * way), -ROOF_THICKNESS - 0.09, 0.17, 0.09 + BITE, color));
        }
    }
    let top = RIDGE_HEIGHT + ROOF_THICKNESS;
    let ridge = [(-0.2, -0.1), (0.2, -0.1), (0.2, 0.04), (0.0, 0.16), (-0.2, 0.04)].map(|(z, y)| Vec2::new(z, top + y));
    let color = palette.pick(Material::RoofTile);
    let mesh = extruded(&ridge, -gable - 0.15, gable + 0.15, color);
    solids.push(framed(mesh, Vec3::ZERO, [Vec3::NEG_Z, Vec3::Y, Vec3::X]));
}

/// Roof and timbers.
pub fn roof(palette: &mut Palette) -> Vec<SolidMesh> {
    let mut solids = vec![cover(palette)];
    for x in COLUMN_PLACES {
        truss(x, palette, &mut solids);
    }
    // purlins reach into the gable walls
    let end = INNER_HALF_LENGTH + 0.3;
    let top = RAFTER_DEPTH - BITE;
    for z in PURLINS {
        // upright, so the rafters lie on its upper edge
        let high = roof_underside(z.abs() + 0.1) - top;
        let wood = palette.pick(Material::Timber);
        solids.push(cuboid(Vec3::new(-end, high - PURLIN_DEPTH, z - 0.1), Vec3::new(end, high, z + 0.1), wood));
    }
    let high = RIDGE_HEIGHT - top;
    let wood = palette.pick(Material::Timber);
    solids.push(cuboid(Vec3::new(-end, high - 0.3, -0.11), Vec3::new(end, high, 0.11), wood));
    // the beams that the columns carry
    let low = COLUMN_HEIGHT - BITE;
    for z in [COLUMN_ROW, -COLUMN_ROW] {
        let wood = palette.pick(Material::Timber);
        let corner = |x: f32, y: f32, dz: f32| Vec3::new(x, y, z + dz);
        solids.push(cuboid(corner(-end, low, -0.3), corner(end, TIE_BEAM.0 + 2.0 * BITE, 0.3), wood));
    }
    rafters(palette, &mut solids);
    skylight_frame(palette, &mut solids);
    cover_tiles(palette, &mut solids);
    solids
}
