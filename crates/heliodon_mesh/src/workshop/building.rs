//! What stands of stone and clay: walls with their openings, socle, floor, and the ground around.

use super::measures::*;
use super::palette::{Material, Palette};
use super::pieces::{cuboid, framed, placed};
use super::slab::{Face, Side, Slab};
use crate::temple::solid::SolidMesh;
use glam::Vec3;

/// What of the long walls is cut where: the ends, and both sides of each window, as (outside, inside).
fn long_wall_cuts() -> Vec<(f32, f32)> {
    let end = HALF_LENGTH - SETBACK;
    let (outside, inside) = WINDOW_HALF_WIDTH;
    let windows = WINDOW_PLACES.iter().flat_map(|x| [(x - outside, x - inside), (x + outside, x + inside)]);
    std::iter::once((-end, -end)).chain(windows).chain(std::iter::once((end, end))).collect()
}

/// The southern long wall: its front is the outside. It reaches into the socle and into the roof.
fn long_wall(color: Vec3) -> SolidMesh {
    let cuts = long_wall_cuts();
    let outer = HALF_WIDTH - SETBACK;
    let rows = [(SOCLE_TOP - BITE, SOCLE_TOP - BITE), WINDOW_SILL, WINDOW_HEAD];
    Slab {
        columns: cuts.len() - 1,
        rows: 3,
        place: |side, i: usize, j: usize| {
            let pick = |(outside, inside)| if side == Side::Front { outside } else { inside };
            let z = pick((outer, outer - WALL_THICKNESS));
            Vec3::new(pick(cuts[i]), rows.get(j).map_or(roof_underside(z) + BITE, |&row| pick(row)), z)
        },
        // every second strip is a window
        open: |i, j| j == 1 && i % 2 == 1,
        color_linear: |_| color,
    }
    .build()
}

/// An end wall with its gable, front outside, as if the front were the south; `openings` has the half widths and heights of
/// what is open, from below.
fn end_wall(openings: &[(f32, f32, f32)], color: Vec3) -> SolidMesh {
    // it reaches into the long walls
    let end = INNER_HALF_WIDTH + 0.35;
    let mut columns = vec![0.0, -end, end];
    let mut rows = vec![SOCLE_TOP - 2.0 * BITE];
    for &(half_width, low, high) in openings {
        columns.extend([-half_width, half_width]);
        rows.extend([low, high].into_iter().filter(|&y| y > SOCLE_TOP));
    }
    columns.sort_by(f32::total_cmp);
    let outer = INNER_HALF_LENGTH + WALL_THICKNESS;
    let is_open = |i: usize, j: usize| {
        let middle = 0.5 * (columns[i] + columns[i + 1]);
        let inside = |&(half_width, low, high): &(f32, f32, f32)| {
            middle.abs() < half_width && rows.get(j + 1).is_some_and(|&top| top <= high && rows[j] >= low)
        };
        openings.iter().any(inside)
    };
    Slab {
        columns: columns.len() - 1,
        rows: rows.len(),
        place: |side, i: usize, j: usize| {
            let x = columns[i];
            let y = rows.get(j).copied().unwrap_or(roof_underside(x) + 2.0 * BITE);
            Vec3::new(x, y, if side == Side::Front { outer } else { outer - WALL_THICKNESS })
        },
        open: is_open,
        color_linear: |_| color,
    }
    .build()
}

/// Crossed bars in a window whose front looks south, about the middle of the opening's outside: half its width, its height.
fn window_bars(half_width: f32, height: f32, palette: &mut Palette) -> Vec<SolidMesh> {
    let bite = 0.03;
    let wood = palette.pick(Material::Timber);
    let upright = |x: f32| {
        cuboid(Vec3::new(x - 0.035, -0.5 * height - bite, -0.26), Vec3::new(x + 0.035, 0.5 * height + bite, -0.17), wood)
    };
    let across = |y: f32| {
        // a little thinner than the uprights, so that faces do not coincide where they cross
        cuboid(Vec3::new(-half_width - bite, y - 0.03, -0.25), Vec3::new(half_width + bite, y + 0.03, -0.18), wood)
    };
    let third = half_width / 3.0;
    vec![upright(-third), upright(third), across(height / 6.0), across(-height / 6.0)]
}

/// Walls, socle, door and bars of the windows.
pub fn walls(palette: &mut Palette) -> Vec<SolidMesh> {
    let plaster = palette.pick(Material::Plaster);
    let turned = |mesh: SolidMesh, quarters: u8| {
        let (x, z) = [(Vec3::X, Vec3::Z), (Vec3::NEG_Z, Vec3::X), (Vec3::NEG_X, Vec3::NEG_Z), (Vec3::Z, Vec3::NEG_X)]
            [usize::from(quarters % 4)];
        framed(mesh, Vec3::ZERO, [x, Vec3::Y, z])
    };
    let (door_half, door_top) = DOOR;
    let openings = [(door_half, f32::MIN, door_top), GABLE_WINDOW];
    let mut solids = vec![
        turned(long_wall(plaster), 0),
        turned(end_wall(&openings, plaster), 1),
        turned(long_wall(plaster), 2),
        turned(end_wall(&[], plaster), 3),
    ];
    socle(palette, &mut solids);
    let window = (WINDOW_HALF_WIDTH.0, 0.5 * (WINDOW_SILL.0 + WINDOW_HEAD.0), WINDOW_HEAD.0 - WINDOW_SILL.0);
    for x in WINDOW_PLACES {
        for (way, yaw) in [(1.0, 0.0), (-1.0, std::f32::consts::PI)] {
            let at = Vec3::new(x, window.1, way * (HALF_WIDTH - SETBACK));
            solids.extend(placed(window_bars(window.0, window.2, palette), at, yaw));
        }
    }
    let (half_width, low, high) = GABLE_WINDOW;
    let at = Vec3::new(INNER_HALF_LENGTH + WALL_THICKNESS, 0.5 * (low + high), 0.0);
    solids.extend(placed(window_bars(half_width, high - low, palette), at, std::f32::consts::FRAC_PI_2));
    door(palette, &mut solids);
    solids
}

/// Courses of large blocks under the walls, with a gap for the door.
fn socle(palette: &mut Palette, solids: &mut Vec<SolidMesh>) {
    const BOTTOM: f32 = -0.45;
    let stone = palette.pick(Material::Limestone);
    let inner = HALF_WIDTH - SOCLE_THICKNESS;
    for z in [(inner, HALF_WIDTH), (-HALF_WIDTH, -inner)] {
        solids.push(cuboid(Vec3::new(-HALF_LENGTH, BOTTOM, z.0), Vec3::new(HALF_LENGTH, SOCLE_TOP, z.1), stone));
    }
    // a hair lower where they reach into the long sides, so that their tops do not coincide there
    let top = SOCLE_TOP - 0.002;
    // back by two centimetres as the walls above, and into the long sides
    let (outer, end) = (HALF_LENGTH - 0.02, inner + 0.3);
    let (near, door) = (outer - SOCLE_THICKNESS, DOOR.0 - 0.02);
    solids.push(cuboid(Vec3::new(-outer, BOTTOM + BITE, -end), Vec3::new(-near, top, end), stone));
    for z in [(door, end), (-end, -door)] {
        solids.push(cuboid(Vec3::new(near, BOTTOM + BITE, z.0), Vec3::new(outer, top, z.1), stone));
    }
    let step = palette.pick(Material::Limestone);
    solids.push(cuboid(Vec3::new(near - 0.03, BOTTOM + 0.02, -door - 0.05), Vec3::new(outer + 0.03, 0.04, door + 0.05), step));
    solids.push(cuboid(Vec3::new(outer - 0.1, BOTTOM + 0.04, -2.4), Vec3::new(outer + 0.5, -0.1, 2.4), step));
}

/// The door's frame and its two leaves, open.
fn door(palette: &mut Palette, solids: &mut Vec<SolidMesh>) {
    let wood = palette.pick(Material::Timber);
    let (half, top) = DOOR;
    let (x0, x1) = (INNER_HALF_LENGTH + 0.2, INNER_HALF_LENGTH + 0.5);
    let clear = half - 0.25;
    for z in [(clear, half + 0.035), (-half - 0.035, -clear)] {
        solids.push(cuboid(Vec3::new(x0, 0.02, z.0), Vec3::new(x1, top - 0.2, z.1), wood));
    }
    solids.push(cuboid(Vec3::new(x0 - 0.02, top - 0.25, -half - 0.04), Vec3::new(x1 + 0.02, top + 0.03, half + 0.04), wood));
    for way in [1.0_f32, -1.0] {
        // along +X from the hinge; turned so that the leaves stand open into the hall
        let panel = palette.pick(Material::Plank);
        let batten = palette.pick(Material::Timber);
        let mut leaf = vec![cuboid(Vec3::new(0.0, 0.06, -0.035), Vec3::new(clear - 0.03, top - 0.27, 0.035), panel)];
        for y in [0.5, 2.2, 3.9, 5.4] {
            leaf.push(cuboid(Vec3::new(0.08, y, -0.065), Vec3::new(clear - 0.12, y + 0.2, 0.066), batten));
        }
        let yaw = std::f32::consts::PI + way * 0.14;
        solids.extend(placed(leaf, Vec3::new(x0 - 0.05, 0.0, way * (clear + 0.02)), yaw));
    }
}

/// Flagstones, each a shade of its own.
pub fn floor(palette: &mut Palette) -> Vec<SolidMesh> {
    const TILES: (usize, usize) = (22, 9);
    let (half_x, half_z) = (HALF_LENGTH - 0.5, HALF_WIDTH - 0.6);
    let shades: Vec<Vec3> = (0..TILES.0 * TILES.1).map(|_| palette.pick(Material::Flagstone)).collect();
    let at = |half: f32, i: usize, of: usize| half * (2.0 * i as f32 / of as f32 - 1.0);
    let slab = Slab {
        columns: TILES.0,
        rows: TILES.1,
        place: |side, i, j| {
            let y = if side == Side::Front { 0.0 } else { -0.32 };
            Vec3::new(at(half_x, i, TILES.0), y, -at(half_z, j, TILES.1))
        },
        open: |_, _| false,
        color_linear: |face| match face {
            Face::Cell(Side::Front, i, j) => shades[j * TILES.0 + i],
            _ => Vec3::splat(0.3),
        },
    };
    vec![slab.build()]
}

/// Where the ground is cut on one side of the hall: near cells are smaller.
const GROUND_CUTS: [f32; 5] = [5.0, 11.0, 20.0, 34.0, 55.0];

/// Trodden earth around the building, with a hole that its walls fill.
pub fn ground(palette: &mut Palette) -> Vec<SolidMesh> {
    let earth = palette.pick(Material::Earth);
    let cuts = |half: f32, inside: usize| -> Vec<f32> {
        let low = GROUND_CUTS.iter().rev().map(|cut| -half - cut);
        let middle = (0..=inside).map(|i| half * (2.0 * i as f32 / inside as f32 - 1.0));
        low.chain(middle).chain(GROUND_CUTS.iter().map(|cut| half + cut)).collect()
    };
    let first = GROUND_CUTS.len();
    let (xs, zs) = (cuts(HALF_LENGTH - 0.4, 6), cuts(HALF_WIDTH - 0.4, 3));
    let slab = Slab {
        columns: xs.len() - 1,
        rows: zs.len() - 1,
        place: |side, i: usize, j: usize| Vec3::new(xs[i], if side == Side::Front { GROUND_TOP } else { -0.8 }, -zs[j]),
        open: |i, j| (first..first + 6).contains(&i) && (first..first + 3).contains(&j),
        color_linear: |_| earth,
    };
    vec![slab.build()]
}
