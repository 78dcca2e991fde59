//! What visitors take and work on: pieces of life size, since a hand does not reach a god. What is done here is hoisted onto him.

use super::furnishing::{FURNACE, STANDS_OVER};
use super::palette::{Material, Palette};
use super::pieces::{beam, cuboid, pole, smooth};
use super::props::{self, BENCH_HEIGHT, FURNACE_HEIGHTS};
use crate::Mesh;
use crate::figures::shape::ball;
use crate::temple::solid::{SolidMesh, join};
use glam::Vec3;

/// Between a thing and its bench, metres: a face that lies in another has no light.
const GAP_M: f32 = 0.003;

/// A thing in its own space, whose origin is where a hand holds it.
#[derive(Clone, Debug)]
pub struct WorkshopThing {
    /// Its name for scripts.
    pub name: &'static str,
    /// Where its origin is, so that it rests upon a bench.
    pub place: Vec3,
    /// Its closed solids.
    pub mesh: Mesh,
}

fn ladle(palette: &mut Palette) -> Vec<SolidMesh> {
    let bronze = palette.pick(Material::Bronze);
    vec![
        smooth(ball(Vec3::new(0.0, 0.0, 0.3), Vec3::new(0.06, 0.045, 0.06), 8, 16), bronze),
        beam(Vec3::new(0.0, 0.0, -0.15), Vec3::new(0.0, 0.0, 0.26), 0.018, 0.018, Vec3::Y, bronze),
    ]
}

/// What is carved, with the chisel set upon it.
fn block_with_chisel(palette: &mut Palette) -> Vec<SolidMesh> {
    const HEIGHT: f32 = 0.2;
    let block = props::rough_block(Vec3::new(0.24, HEIGHT, 0.2), palette);
    let edge = Vec3::new(0.02, HEIGHT - 0.012, 0.0);
    let head = edge + Vec3::new(0.07, 0.19, 0.03);
    let iron = palette.pick(Material::Bronze) * 0.6;
    vec![block, pole(edge, head, (0.008, 0.012), 8, iron)]
}

/// A length of cloth's folds in relief, to be covered with gold.
fn robe_panel(palette: &mut Palette) -> Vec<SolidMesh> {
    let core = palette.pick(Material::Plank);
    let mut solids = vec![cuboid(Vec3::new(-0.2, 0.0, -0.25), Vec3::new(0.2, 0.03, 0.25), core)];
    solids.extend((0..5).map(|k| {
        let x = -0.16 + 0.08 * k as f32;
        pole(Vec3::new(x, 0.025, -0.24), Vec3::new(x + 0.02, 0.025, 0.24), (0.03, 0.022), 12, core)
    }));
    solids
}

/// All of them, where they lie when the visit begins.
pub fn things(seed: u32) -> Vec<WorkshopThing> {
    let palette = &mut Palette::new(seed, 9);
    let plate = |color: Vec3, thick: f32| vec![cuboid(Vec3::new(-0.11, 0.0, -0.14), Vec3::new(0.11, thick, 0.14), color)];
    let ivory = palette.pick(Material::Ivory);
    let gold = palette.pick(Material::Gold);
    let all = [
        ("mallet", (2.2, 3.05), props::mallet(palette)),
        ("ivory-block", (1.8, 3.2), block_with_chisel(palette)),
        ("ivory-plate", (-1.5, -3.2), plate(ivory, 0.012)),
        ("face-form", (-2.05, -3.2), props::clay_head(palette)),
        ("ladle", (1.75, -3.1), ladle(palette)),
        ("victory-mould", (1.2, -3.2), vec![props::mould(palette)]),
        ("gold-sheet", (2.45, -3.1), plate(gold, 0.004)),
        ("robe-panel", (2.95, -3.2), robe_panel(palette)),
    ];
    let on = |top: f32, name, (x, z): (f32, f32), solids| {
        let mesh = join(solids);
        let foot = mesh.bounds().map_or(0.0, |(low, _)| low.y);
        WorkshopThing { name, place: Vec3::new(x, top + STANDS_OVER + GAP_M - foot, z), mesh }
    };
    let mut things: Vec<_> = all.into_iter().map(|(name, place, solids)| on(BENCH_HEIGHT, name, place, solids)).collect();
    // how far the coals lie over their bed at most
    const COALS_M: f32 = 0.035;
    things.push(on(FURNACE_HEIGHTS.1 + COALS_M, "crucible", (FURNACE.x, FURNACE.z), vec![props::crucible(palette)]));
    things
}
