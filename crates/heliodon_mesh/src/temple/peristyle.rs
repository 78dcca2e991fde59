//! The forty-six outer columns and the porches' twelve, and what the centuries left of them.

use super::State;
use super::column::Column;
use super::measures::{
    CELLA_LENGTH, CELLA_PLATFORM, COLUMN_HEIGHT, COLUMN_LOWER_DIAMETER, COLUMN_UPPER_DIAMETER, COLUMNS_LONG, COLUMNS_SHORT,
    CORNER_LOWER_DIAMETER, CORNER_UPPER_DIAMETER, HALF_AXES, INCLINATION, PORCH_COLUMN_HEIGHT, PORCH_COLUMNS,
    PORCH_LOWER_DIAMETER, PORCH_SPACING, STYLOBATE_TOP, column_places, curvature,
};
use super::yard::Yard;
use glam::Vec3;

/// How much of the column at a place of the long side still stands: 1 with its capital, 0 not at all. Places run from
/// west to east. Morosini's bomb opened the middle of both flanks in 1687, the south more than the north.
pub fn long_side_standing(state: State, south: bool, place: usize) -> f32 {
    match (state, south, place) {
        (State::Intact, _, _) => 1.0,
        (_, false, 8) => 0.62,
        (_, false, 9) => 0.33,
        (_, true, 6) => 0.80,
        (_, true, 7) => 0.24,
        (_, true, 8) => 0.13,
        (_, true, 9) => 0.0,
        (_, true, 10) => 0.46,
        (_, true, 11) => 0.18,
        _ => 1.0,
    }
}

/// The same for the porches' columns, from north to south.
pub fn porch_standing(state: State, east: bool, place: usize) -> f32 {
    match (state, east, place) {
        (State::Intact, _, _) | (_, false, _) => 1.0,
        (_, true, 0) => 0.55,
        (_, true, 1) => 0.20,
        (_, true, 4) => 0.35,
        (_, true, 5) => 1.0,
        _ => 0.12,
    }
}

/// The outer columns as (place, standing part), each once.
pub fn outer_columns(state: State) -> Vec<(Vec3, f32)> {
    let (half_x, half_z) = HALF_AXES;
    let mut columns = Vec::new();
    for (south, z) in [(false, -half_z), (true, half_z)] {
        for (i, x) in column_places(COLUMNS_LONG, half_x).into_iter().enumerate() {
            columns.push((Vec3::new(x, 0.0, z), long_side_standing(state, south, i)));
        }
    }
    let short = column_places(COLUMNS_SHORT, half_z);
    for x in [-half_x, half_x] {
        columns.extend(short[1..COLUMNS_SHORT - 1].iter().map(|&z| (Vec3::new(x, 0.0, z), 1.0)));
    }
    columns
}

/// The outer column at a place of the plan.
pub fn outer_column(place: Vec3, standing: f32) -> Column {
    let (half_x, half_z) = HALF_AXES;
    let on_long = place.z.abs() > half_z - 0.1;
    let on_short = place.x.abs() > half_x - 0.1;
    let corner = on_long && on_short;
    let lean = Vec3::new(
        if on_short { -INCLINATION * place.x.signum() } else { 0.0 },
        0.0,
        if on_long { -INCLINATION * place.z.signum() } else { 0.0 },
    );
    Column {
        foot: Vec3::new(place.x, STYLOBATE_TOP + curvature(place.x, place.z), place.z) - lean * 0.5,
        lean,
        lower_diameter: if corner { CORNER_LOWER_DIAMETER } else { COLUMN_LOWER_DIAMETER },
        upper_diameter: if corner { CORNER_UPPER_DIAMETER } else { COLUMN_UPPER_DIAMETER },
        height: COLUMN_HEIGHT,
        standing,
        coarser: 1.0,
    }
}

/// Distance of the porches' columns from the middle of the temple.
pub const PORCH_AXIS: f32 = 0.5 * CELLA_LENGTH - 0.92;

/// Adds all columns.
pub fn build(yard: &mut Yard, state: State) {
    for (place, standing) in outer_columns(state) {
        let look = yard.marble(0.12, 0.0);
        if standing > 0.0 {
            outer_column(place, standing).build(yard, look);
        }
    }
    for (east, x) in [(false, -PORCH_AXIS), (true, PORCH_AXIS)] {
        for i in 0..PORCH_COLUMNS {
            let z = (i as f32 - 2.5) * PORCH_SPACING;
            let look = yard.marble(0.35, 0.0);
            let column = Column {
                foot: Vec3::new(x, STYLOBATE_TOP + CELLA_PLATFORM + curvature(x, z), z),
                lean: Vec3::ZERO,
                lower_diameter: PORCH_LOWER_DIAMETER,
                upper_diameter: PORCH_LOWER_DIAMETER * COLUMN_UPPER_DIAMETER / COLUMN_LOWER_DIAMETER,
                height: PORCH_COLUMN_HEIGHT,
                standing: porch_standing(state, east, i),
                coarser: if east { 1.6 } else { 1.0 },
            };
            column.build(yard, look);
        }
    }
}
