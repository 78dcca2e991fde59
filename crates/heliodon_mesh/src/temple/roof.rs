//! The roof of marble tiles and the ceilings below it, for the temple as it was.

use super::block::{Block, FACE_BOTTOM, Wear};
use super::entablature::FACE;
use super::marble::Look;
use super::measures::{ARCHITRAVE_HEIGHT, COLUMN_TOP, FRIEZE_HEIGHT, GEISON_PROJECTION, GEISON_TOP, HALF_AXES, ROOF_SLOPE};
use super::yard::{Frame, Span, Yard};
use glam::Vec3;

/// Width of a row of tiles.
const TILE_WIDTH: f32 = 0.72;
/// Rows of tiles from the eaves to the ridge.
const COURSES: u32 = 17;

/// Adds roof and ceilings.
pub fn build(yard: &mut Yard) {
    let eaves = HALF_AXES.1 + FACE + GEISON_PROJECTION;
    let half_length = HALF_AXES.0 + FACE + GEISON_PROJECTION - 0.2;
    for out in [Vec3::NEG_Z, Vec3::Z] {
        let frame = Frame::facing(out, Vec3::ZERO);
        let segments = 16_u32.div_ceil(yard.merge);
        let courses = COURSES.div_ceil(yard.merge);
        let place = |i: u32| half_length * (2.0 * i as f32 / segments as f32 - 1.0);
        // flat tiles overlap down the slope: each course lies a little over the one below
        for course in 0..courses {
            let at = |c: u32| eaves * c as f32 / courses as f32;
            let (low, high) = (at(course + 1) + 0.12, at(course));
            for i in 0..segments {
                let look = yard.marble(0.0, 0.0);
                let (near, far) = (0.075, 0.03);
                slab(yard, &frame, (place(i), place(i + 1)), (high, low.min(eaves + 0.05)), (near, far), 0.22, look);
            }
        }
        // cover tiles over the joints, from ridge to eaves, each row ending in an antefix
        let rows = ((2.0 * half_length / TILE_WIDTH) as u32).div_ceil(yard.merge);
        for row in 0..=rows {
            let s = half_length * (2.0 * row as f32 / rows as f32 - 1.0);
            let look = yard.marble(0.0, 0.0);
            slab(yard, &frame, (s - 0.085, s + 0.085), (0.02, eaves + 0.08), (0.15, 0.15), 0.20, look).ornament = true;
            let y = over(eaves) + 0.10;
            let antefix = yard.ashlar(
                &frame,
                (s - 0.12, s + 0.12),
                (y - 0.06, y + 0.36),
                (eaves + 0.02, eaves + 0.12),
                FACE_BOTTOM,
                look,
            );
            antefix.ornament = true;
            antefix.wear = Wear { round: 0.05, chip: 0.0, rough: 0.002, breaks: 0 };
        }
    }
    let frame = Frame::facing(Vec3::Z, Vec3::ZERO);
    let ridge = over(0.0) + 0.05;
    for i in 0..24 {
        let at = |i: u32| half_length * (2.0 * i as f32 / 24.0 - 1.0);
        let look = yard.marble(0.0, 0.0);
        yard.ashlar(&frame, (at(i), at(i + 1)), (ridge - 0.1, ridge + 0.28), (-0.2, 0.2), FACE_BOTTOM, look);
    }
    ceilings(yard);
}

/// Height of the roof's bed at a distance from the ridge.
fn over(o: f32) -> f32 {
    GEISON_TOP + 0.10 + (HALF_AXES.1 + FACE - o) * ROOF_SLOPE + 0.18
}

/// A slab down the slope: from and to distances from the ridge, its top that much over the bed there.
fn slab<'a>(
    yard: &'a mut Yard,
    frame: &Frame,
    s: Span,
    o: Span,
    over_bed: (f32, f32),
    thick: f32,
    look: Look,
) -> &'a mut Block {
    let sunk = yard.range(0.0, 0.004);
    let corner = |c: usize| {
        let s = if c & 1 == 0 { s.0 - 0.002 } else { s.1 + 0.002 };
        let front = c & 4 != 0;
        let (at, top) = if front { (o.1, over_bed.0) } else { (o.0, over_bed.1) };
        let y = over(at) + top - sunk - if c & 2 == 0 { thick } else { 0.0 };
        frame.point(s, y, at)
    };
    let wear = Wear::dressed(yard.erosion * 0.5);
    let mut block = Block::new(std::array::from_fn(corner), wear, look, FACE_BOTTOM);
    block.seed = yard.seed();
    yard.push_block(block)
}

/// Coffered slabs over the colonnades, here as beams and plates.
fn ceilings(yard: &mut Yard) {
    let frame = Frame::facing(Vec3::Z, Vec3::ZERO);
    let y = COLUMN_TOP + ARCHITRAVE_HEIGHT + 0.45 * FRIEZE_HEIGHT;
    let (half_x, half_z) = (HALF_AXES.0 - 0.5, HALF_AXES.1 - 0.5);
    for i in 0..16 {
        let at = |i: u32| half_x * (2.0 * i as f32 / 16.0 - 1.0);
        let look = yard.marble(0.6, 0.0);
        yard.ashlar(&frame, (at(i), at(i + 1)), (y, y + 0.3), (-half_z, half_z), 0, look).coarser = 2.0;
    }
}
