//! The Parthenon's published measures, in metres.
//!
//! F. C. Penrose, "An Investigation of the Principles of Athenian Architecture", 1888 (curvature, entasis, inclination);
//! N. Balanos, "Les monuments de l'Acropole", 1938; A. K. Orlandos, "I architektoniki tou Parthenonos", 1977-78; M. Korres,
//! "The Parthenon", in P. Tournikiotis (ed.), "The Parthenon and its Impact in Modern Times", 1994. Where they differ by
//! millimetres between stones, the usual value stands here.

/// Length of the stylobate, along the temple's long axis.
pub const STYLOBATE_LENGTH: f32 = 69.50;
/// Width of the stylobate.
pub const STYLOBATE_WIDTH: f32 = 30.88;
/// Rise of the stylobate's middle over its corners on the long sides.
pub const CURVATURE_LONG: f32 = 0.11;
/// The same on the short sides.
pub const CURVATURE_SHORT: f32 = 0.06;
/// Heights of the three steps, from below.
pub const STEP_HEIGHTS: [f32; 3] = [0.512, 0.512, 0.552];
/// Depth of a tread.
pub const STEP_TREAD: f32 = 0.705;
/// Height of the stylobate's corner over the euthynteria, which is height zero.
pub const STYLOBATE_TOP: f32 = STEP_HEIGHTS[0] + STEP_HEIGHTS[1] + STEP_HEIGHTS[2];

/// Columns of a short side, those of the corners included.
pub const COLUMNS_SHORT: usize = 8;
/// Columns of a long side, those of the corners included.
pub const COLUMNS_LONG: usize = 17;
/// From axis to axis of the columns, but for the last bays at the corners.
pub const AXIAL_SPACING: f32 = 4.296;
/// From the axis of the outer columns to the edge of the stylobate.
pub const AXIS_TO_EDGE: f32 = 1.01;
/// Height of a column with its capital.
pub const COLUMN_HEIGHT: f32 = 10.43;
/// Lower diameter of a column, over the arrises.
pub const COLUMN_LOWER_DIAMETER: f32 = 1.905;
/// The same of a corner column.
pub const CORNER_LOWER_DIAMETER: f32 = 1.944;
/// Upper diameter of a column, under the capital.
pub const COLUMN_UPPER_DIAMETER: f32 = 1.481;
/// The same of a corner column.
pub const CORNER_UPPER_DIAMETER: f32 = 1.520;
/// Flutes of a column.
pub const FLUTES: u32 = 20;
/// Greatest swelling of the shaft beyond the straight taper.
pub const ENTASIS: f32 = 0.017;
/// How far a column's top leans inwards.
pub const INCLINATION: f32 = 0.07;
/// Height of the abacus.
pub const ABACUS_HEIGHT: f32 = 0.35;
/// Side of the abacus.
pub const ABACUS_WIDTH: f32 = 2.04;

/// Height of the architrave.
pub const ARCHITRAVE_HEIGHT: f32 = 1.35;
/// Depth of the architrave, over its beams.
pub const ARCHITRAVE_DEPTH: f32 = 1.77;
/// Height of the frieze of triglyphs and metopes.
pub const FRIEZE_HEIGHT: f32 = 1.345;
/// Width of a triglyph.
pub const TRIGLYPH_WIDTH: f32 = 0.845;
/// Height of the horizontal cornice.
pub const GEISON_HEIGHT: f32 = 0.60;
/// How far the cornice stands out before the frieze.
pub const GEISON_PROJECTION: f32 = 0.70;
/// Slope of the pediments and the roof: the tangent of 13.5 degrees.
pub const ROOF_SLOPE: f32 = 0.2401;

/// Length and width of the platform of the cella.
pub const CELLA_LENGTH: f32 = 59.02;
/// Width over the cella's walls.
pub const CELLA_WIDTH: f32 = 21.72;
/// Thickness of the cella's long walls.
pub const CELLA_WALL: f32 = 1.17;
/// Height of the cella's platform over the stylobate, in two steps.
pub const CELLA_PLATFORM: f32 = 0.70;
/// Columns of a porch.
pub const PORCH_COLUMNS: usize = 6;
/// Height of a porch's columns.
pub const PORCH_COLUMN_HEIGHT: f32 = 10.08;
/// Lower diameter of a porch's columns.
pub const PORCH_LOWER_DIAMETER: f32 = 1.65;
/// From axis to axis of a porch's columns.
pub const PORCH_SPACING: f32 = 4.18;
/// Height of an ordinary course of the cella's walls.
pub const COURSE_HEIGHT: f32 = 0.522;
/// Length of an ordinary block of those walls.
pub const COURSE_LENGTH: f32 = 1.22;
/// Height of the orthostates, the walls' first course.
pub const ORTHOSTATE_HEIGHT: f32 = 1.17;
/// Width and height of the great doors.
pub const DOOR: (f32, f32) = (4.92, 9.75);
/// Lower diameter and height of the cella's inner columns, lower storey.
pub const INNER_LOWER: (f32, f32) = (1.11, 5.70);
/// The same, upper storey.
pub const INNER_UPPER: (f32, f32) = (0.83, 3.75);

/// Top of the columns over the euthynteria, at the corners.
pub const COLUMN_TOP: f32 = STYLOBATE_TOP + COLUMN_HEIGHT;
/// Top of the horizontal cornice.
pub const GEISON_TOP: f32 = COLUMN_TOP + ARCHITRAVE_HEIGHT + FRIEZE_HEIGHT + GEISON_HEIGHT;

/// Half the distance between the axes of opposite rows of columns: along the temple and across it.
pub const HALF_AXES: (f32, f32) = (0.5 * STYLOBATE_LENGTH - AXIS_TO_EDGE, 0.5 * STYLOBATE_WIDTH - AXIS_TO_EDGE);

/// Rise of the curved stylobate, and of all that stands on it, at a place of the plan.
pub fn curvature(x: f32, z: f32) -> f32 {
    let (u, v) = (2.0 * x / STYLOBATE_LENGTH, 2.0 * z / STYLOBATE_WIDTH);
    CURVATURE_LONG * (1.0 - u * u) + CURVATURE_SHORT * (1.0 - v * v)
}

/// Places of the columns' axes along a side of `count` columns whose outer axes are `2 * half` apart: the usual spacing, and
/// what remains for the two contracted bays at the corners.
pub fn column_places(count: usize, half: f32) -> Vec<f32> {
    let inner = (count - 3) as f32 * AXIAL_SPACING;
    let mut places = vec![-half];
    places.extend((0..count - 2).map(|i| -0.5 * inner + i as f32 * AXIAL_SPACING));
    places.push(half);
    places
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corner_bays_are_contracted_as_measured() {
        for (count, half) in [(COLUMNS_LONG, HALF_AXES.0), (COLUMNS_SHORT, HALF_AXES.1)] {
            let places = column_places(count, half);
            assert_eq!(places.len(), count);
            let corner = places[1] - places[0];
            // published: 3.66 to 3.71
            assert!((3.65..3.72).contains(&corner), "{corner}");
            assert!((places[2] - places[1] - AXIAL_SPACING).abs() < 1e-4);
        }
    }

    #[test]
    fn the_stylobate_rises_to_its_middles() {
        let (x, z) = (0.5 * STYLOBATE_LENGTH, 0.5 * STYLOBATE_WIDTH);
        assert!(curvature(x, z).abs() < 1e-6);
        assert!((curvature(0.0, z) - CURVATURE_LONG).abs() < 1e-6 && (curvature(x, 0.0) - CURVATURE_SHORT).abs() < 1e-6);
    }
}
