//! Where benches, tools, wares and lamps stand. The middle of the hall stays free for visitors.

use super::measures::BITE;
use super::palette::{Material, Palette};
use super::pieces::{beam, cuboid, placed};
use super::props::{self, BENCH_HEIGHT, FLAME_HEIGHT};
use super::scaffold::ladder;
use crate::temple::solid::SolidMesh;
use glam::Vec3;
use std::f32::consts::{FRAC_PI_2, PI};

/// What is carried stands a few millimetres over what carries it, its own foot being a little below its height zero: a face that
/// lies in something has no light, and the bake would say so.
pub const STANDS_OVER: f32 = BITE + 0.003;

/// Feet of the lamps.
const LAMPS: [Vec3; 3] =
    [Vec3::new(-4.9, STANDS_OVER, 2.95), Vec3::new(-4.9, STANDS_OVER, -2.75), Vec3::new(6.3, STANDS_OVER, -3.2)];

/// Where glass is melted: between the ivory's bench and the caster's.
pub const FURNACE: Vec3 = Vec3::new(0.0, STANDS_OVER, -3.05);

/// Flames of the lamps.
pub fn lamps() -> Vec<Vec3> {
    LAMPS.iter().map(|foot| *foot + Vec3::Y * FLAME_HEIGHT).collect()
}

/// Things on a bench that stands at `at`, turned by `yaw_rad`.
struct Laid<'a> {
    solids: &'a mut Vec<SolidMesh>,
    at: Vec3,
    yaw_rad: f32,
}

impl Laid<'_> {
    /// Lays things at a place of the bench's top.
    fn lay(&mut self, things: Vec<SolidMesh>, x: f32, z: f32, yaw_rad: f32) {
        let on_bench = placed(things, Vec3::new(x, BENCH_HEIGHT + STANDS_OVER, z), yaw_rad).collect();
        self.solids.extend(placed(on_bench, self.at, self.yaw_rad));
    }
}

/// Everything that could be carried out of the hall.
#[derive(Default)]
pub struct Furnishing {
    /// Benches, stools, buckets, beams and planks: what is of wood.
    pub wooden: Vec<SolidMesh>,
    /// Lamps, tools, and what is worked on.
    pub wares: Vec<SolidMesh>,
    /// Coals in the furnace.
    pub coals: Vec<SolidMesh>,
}

/// All of it.
pub fn furnishing(palette: &mut Palette) -> Furnishing {
    let mut all = Furnishing::default();
    for foot in LAMPS {
        all.wares.extend(placed(props::lamp_stand(palette), foot, palette.between(0.0, 1.0)));
    }
    benches(palette, &mut all);
    let Furnishing { mut wooden, mut wares, .. } = all;
    let at = |x: f32, z: f32| Vec3::new(x, STANDS_OVER, z);
    let mut stand = |things: Vec<SolidMesh>, x: f32, z: f32, yaw_rad: f32| wares.extend(placed(things, at(x, z), yaw_rad));
    stand(props::unfinished_youth(palette), 6.3, 3.3, PI + 0.35);
    stand(props::sledge(palette), 10.4, -3.3, 0.06);
    stand(props::furnace(palette), FURNACE.x, FURNACE.z, 0.0);
    // blocks along the southern wall
    for (x, z, size, yaw) in [
        (-6.4, 5.35, Vec3::new(1.5, 0.9, 0.8), 0.1),
        (-4.5, 5.45, Vec3::new(1.1, 0.6, 0.75), -0.2),
        (10.6, 5.3, Vec3::new(1.3, 1.1, 0.9), 0.25),
        (12.3, 5.5, Vec3::new(0.8, 0.5, 0.7), -0.1),
    ] {
        stand(vec![props::rough_block(size, palette)], x, z, yaw);
    }
    for (x, z, height) in
        [(-1.3, -5.6, 0.95), (-0.7, -5.75, 0.85), (-0.15, -5.55, 0.9), (0.2, 5.7, 0.9), (0.75, 5.6, 0.75), (13.9, -5.5, 1.0)]
    {
        stand(props::amphora(height, palette), x, z, palette.between(0.0, 3.0));
    }
    for (x, z) in [(8.15, 2.75), (-3.2, -3.2)] {
        wooden.extend(placed(props::bucket(palette), at(x, z), 0.0));
    }
    for (x, z, yaw_rad) in [(2.6, 2.6, 0.3), (8.2, 4.9, 0.9), (5.1, -4.9, 0.0)] {
        wooden.extend(placed(props::stool(palette), at(x, z), yaw_rad));
    }
    chips(palette, &mut wares);
    timber(palette, &mut wooden);
    let coals = placed(props::coals(palette), FURNACE, 0.0).collect();
    Furnishing { wooden, wares, coals }
}

/// Four benches with what is worked on.
fn benches(palette: &mut Palette, all: &mut Furnishing) {
    // in the nave, before the statue: the model of its head
    let (at, yaw_rad) = (Vec3::new(2.1, STANDS_OVER, 3.2), 0.0);
    all.wooden.extend(placed(props::bench(2.7, 0.8, palette), at, yaw_rad));
    let mut top = Laid { solids: &mut all.wares, at, yaw_rad };
    top.lay(props::clay_head(palette), -0.75, 0.05, PI - 0.5);
    top.lay(props::chisels(4, palette), 0.55, -0.05, 0.25);
    top.lay(props::bowl(0.13, palette), 1.05, 0.15, 0.0);
    // opposite: ivory
    let (at, yaw_rad) = (Vec3::new(-2.0, STANDS_OVER, -3.25), 0.0);
    all.wooden.extend(placed(props::bench(2.4, 0.75, palette), at, yaw_rad));
    let mut top = Laid { solids: &mut all.wares, at, yaw_rad };
    for (x, z, turn) in [(-1.0, 0.05, 0.1), (-0.9, -0.15, -0.15)] {
        top.lay(vec![props::tusk(palette.between(0.85, 1.05), palette)], x, z, turn);
    }
    top.lay(props::bowl(0.11, palette), 0.9, -0.15, 0.0);
    top.lay(props::mallet(palette), 0.75, 0.2, 2.4);
    // the caster's and the goldsmith's
    all.wooden.extend(placed(props::bench(2.7, 0.8, palette), Vec3::new(2.1, STANDS_OVER, -3.25), 0.0));
    // along the northern wall: moulds for the golden robe
    let (at, yaw_rad) = (Vec3::new(5.6, STANDS_OVER, -5.65), 0.0);
    all.wooden.extend(placed(props::bench(4.2, 0.8, palette), at, yaw_rad));
    let mut top = Laid { solids: &mut all.wares, at, yaw_rad };
    for (x, z, turn) in [(-1.75, 0.0, 0.4), (-1.1, 0.1, 1.3), (-0.45, -0.05, 0.1), (0.25, 0.05, 2.0)] {
        top.lay(vec![props::mould(palette)], x, z, turn);
    }
    top.lay(props::amphora(0.42, palette), 0.95, -0.1, 0.0);
    top.lay(props::amphora(0.34, palette), 1.25, 0.1, 1.0);
    top.lay(props::bowl(0.15, palette), 1.75, -0.05, 0.0);
}

/// Chips of marble about the youth and the sledge.
fn chips(palette: &mut Palette, solids: &mut Vec<SolidMesh>) {
    for (x, z) in [(6.3, 3.3), (10.4, -3.3)] {
        const CHIPS: u32 = 11;
        for k in 0..CHIPS {
            let turn = 2.0 * PI * (k as f32 + palette.between(-0.2, 0.2)) / CHIPS as f32;
            let far = palette.between(0.85, 1.0);
            let (sin, cos) = libm::sincosf(turn);
            let at = Vec3::new(x + 1.4 * far * cos, STANDS_OVER, z + 0.92 * far * sin);
            let size = Vec3::new(palette.between(0.05, 0.14), palette.between(0.02, 0.07), palette.between(0.05, 0.12));
            solids.extend(placed(vec![props::rough_block(size, palette)], at, turn * 3.0));
        }
    }
}

/// Beams and a ladder that lean on the northern wall, and planks on trestles in the south.
fn timber(palette: &mut Palette, solids: &mut Vec<SolidMesh>) {
    for k in 0..4 {
        let x = 9.6 + 0.34 * k as f32;
        let (foot, head) = (Vec3::new(x, 0.05, -5.0 - 0.1 * k as f32), Vec3::new(x + 0.25, 4.4 + 0.25 * k as f32, -6.1));
        solids.push(beam(foot, head, 0.16, 0.12, Vec3::Z, palette.pick(Material::Plank)));
    }
    let up = ladder(Vec3::new(0.0, 0.0, 0.0), Vec3::new(1.25, 5.2, 0.0), palette);
    solids.extend(placed(up, Vec3::new(-6.6, 0.0, -4.95), FRAC_PI_2));
    for x in [2.4, 4.6] {
        let wood = palette.pick(Material::Timber);
        solids.push(cuboid(Vec3::new(x - 0.1, -0.01, 5.1), Vec3::new(x + 0.1, 0.22, 6.05), wood));
    }
    for k in 0..5 {
        let (row, high) = (k % 3, if k < 3 { 0.21 } else { 0.262 });
        let z = 5.17 + 0.29 * row as f32 + if k < 3 { 0.0 } else { 0.12 };
        let (left, right) = (palette.between(1.5, 2.1), palette.between(4.9, 5.5));
        let thick = 0.055 - 0.002 * row as f32;
        solids.push(cuboid(Vec3::new(left, high, z), Vec3::new(right, high + thick, z + 0.27), palette.pick(Material::Plank)));
    }
}
