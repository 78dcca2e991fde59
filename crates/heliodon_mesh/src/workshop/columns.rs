//! Two rows of Doric columns that carry the roof.

use super::measures::*;
use super::palette::{Material, Palette};
use super::pieces::{cuboid, lathe, placed};
use crate::temple::solid::SolidMesh;
use glam::Vec3;

const SIDES: u32 = 20;
const ABACUS_HEIGHT: f32 = 0.2;
const PLINTH_HEIGHT: f32 = 0.16;

/// One column about its axis.
fn column(palette: &mut Palette) -> Vec<SolidMesh> {
    let stone = palette.pick(Material::Marble) * 0.94;
    let (foot, top) = (COLUMN_RADIUS, 0.8 * COLUMN_RADIUS);
    let abacus = COLUMN_HEIGHT - ABACUS_HEIGHT;
    let (echinus, shaft) = (abacus + BITE, abacus - 0.42);
    let profile = [
        (foot, PLINTH_HEIGHT - BITE),
        // the shaft swells a little
        (foot * 0.955, PLINTH_HEIGHT + 0.4 * shaft),
        (top, shaft),
        (top + 0.03, shaft + 0.03),
        (top + 0.03, shaft + 0.09),
        (top + 0.07, shaft + 0.15),
        (top + 0.2, echinus - 0.1),
        (top + 0.24, echinus),
    ];
    let square = |half: f32, low: f32, high: f32| cuboid(Vec3::new(-half, low, -half), Vec3::new(half, high, half), stone);
    vec![square(0.58, -0.02, PLINTH_HEIGHT), lathe(&profile, SIDES, stone), square(0.64, abacus, COLUMN_HEIGHT)]
}

/// All columns.
pub fn columns(palette: &mut Palette) -> Vec<SolidMesh> {
    let mut solids = Vec::new();
    for x in COLUMN_PLACES {
        for z in [COLUMN_ROW, -COLUMN_ROW] {
            let one = column(palette);
            solids.extend(placed(one, Vec3::new(x, 0.0, z), 0.0));
        }
    }
    solids
}
