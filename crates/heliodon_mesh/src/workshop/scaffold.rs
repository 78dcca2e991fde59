//! The scaffold beside the statue, with ladders.

use super::measures::{BITE, STATUE_PLACE};
use super::palette::{Material, Palette};
use super::pieces::{beam, cuboid, pole};
use crate::temple::solid::SolidMesh;
use glam::Vec3;

/// Places of the poles along X, and of their two rows along Z: between the base and the columns in the north.
const PLACES: [f32; 3] = [STATUE_PLACE - 1.5, STATUE_PLACE + 0.9, STATUE_PLACE + 3.1];
const ROWS: (f32, f32) = (-2.9, -3.54);
/// Tops of the platforms.
const PLATFORMS: [f32; 3] = [2.5, 4.7, 6.9];
/// Tops of the poles.
const TOP: f32 = 8.1;
const POLE_RADIUS: f32 = 0.055;

/// A ladder between two points of its middle line, leaning along X.
pub fn ladder(foot: Vec3, head: Vec3, palette: &mut Palette) -> Vec<SolidMesh> {
    const HALF_WIDTH: f32 = 0.21;
    const RUNG_SPACING: f32 = 0.3;
    let wood = palette.pick(Material::Plank);
    let mut solids: Vec<SolidMesh> = [HALF_WIDTH, -HALF_WIDTH]
        .map(|z| Vec3::Z * z)
        .map(|side| beam(foot + side, head + side, 0.05, 0.075, Vec3::Y, wood))
        .into();
    let rungs = (foot.distance(head) / RUNG_SPACING) as u32;
    for k in 1..rungs {
        let middle = foot.lerp(head, k as f32 / rungs as f32);
        let reach = Vec3::Z * (HALF_WIDTH + 0.04);
        solids.push(pole(middle - reach, middle + reach, (0.02, 0.02), 6, wood));
    }
    solids
}

/// Poles, ledgers, braces, platforms and ladders.
pub fn scaffold(palette: &mut Palette) -> Vec<SolidMesh> {
    let mut solids = Vec::new();
    let round = |from: Vec3, to: Vec3, palette: &mut Palette| {
        pole(from, to, (POLE_RADIUS, 0.85 * POLE_RADIUS), 8, palette.pick(Material::Timber) * 1.25)
    };
    let (inner, outer) = ROWS;
    let (first, last) = (PLACES[0], PLACES[PLACES.len() - 1]);
    for x in PLACES {
        for z in [inner, outer] {
            let top = TOP + palette.between(-0.3, 0.5);
            solids.push(round(Vec3::new(x, -0.02, z), Vec3::new(x + palette.between(-0.03, 0.03), top, z), palette));
        }
    }
    for top in PLATFORMS {
        // transoms lie on the ledgers, planks on the transoms
        let (transom, ledger) = (top - 0.04 - POLE_RADIUS + BITE, top - 0.04 - 2.7 * POLE_RADIUS);
        for z in [inner - 0.5 * POLE_RADIUS, outer + 0.5 * POLE_RADIUS] {
            solids.push(round(Vec3::new(first - 0.35, ledger, z), Vec3::new(last + 0.35, ledger, z), palette));
        }
        for x in PLACES {
            let x = x + 1.5 * POLE_RADIUS;
            solids.push(round(Vec3::new(x, transom, outer - 0.12), Vec3::new(x, transom, inner + 0.18), palette));
        }
        for k in 0..3 {
            let z = outer + 0.03 + 0.245 * k as f32;
            let wood = palette.pick(Material::Plank);
            let ends = (first - palette.between(0.15, 0.45), last + palette.between(0.15, 0.45));
            // one plank a little higher than the next: they are not alike
            let high = top + 0.004 * k as f32;
            solids.push(cuboid(Vec3::new(ends.0, high - 0.045, z), Vec3::new(ends.1, high, z + 0.225), wood));
        }
        let rail = top + 1.0;
        if rail < TOP - 0.2 {
            let z = outer + 0.4 * POLE_RADIUS;
            solids.push(round(Vec3::new(first - 0.3, rail, z), Vec3::new(last + 0.3, rail, z), palette));
        }
    }
    let outside = outer - 0.6 * POLE_RADIUS;
    let mut low = 0.25;
    for top in PLATFORMS {
        let z = outside;
        solids.push(round(Vec3::new(PLACES[1] - 0.15, low, z), Vec3::new(PLACES[0] + 0.15, top - 0.3, z), palette));
        low = top + 0.2;
    }
    let middle = 0.5 * (inner + outer);
    let (foot, head) = (last + 1.6, last + 0.42);
    solids.extend(ladder(Vec3::new(foot, -0.01, middle), Vec3::new(head, PLATFORMS[0] + 0.7, middle), palette));
    solids
}
