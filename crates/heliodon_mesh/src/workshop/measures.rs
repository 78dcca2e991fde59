//! Measures of the workshop in metres. +Y up, the long axis along X, the door in the east (+X), height zero is the floor.
//!
//! Outside, the building has about the plan that is told of the workshop of Pheidias at Olympia, 32.18 x 14.57 m, whose hall was as large as the cella of the
//! temple of Zeus for which the statue was made there. These numbers were not checked against the excavation's publication. Height, windows and roof are a
//! guess, as every reconstruction's are.

/// Half the length over the socle.
pub const HALF_LENGTH: f32 = 16.09;
/// Half the width over the socle.
pub const HALF_WIDTH: f32 = 7.285;
/// Thickness of the stone socle.
pub const SOCLE_THICKNESS: f32 = 1.12;
/// Top of the socle.
pub const SOCLE_TOP: f32 = 1.4;
/// How far the wall of clay bricks stands back from the socle, on both sides.
pub const SETBACK: f32 = 0.09;
/// Thickness of the wall of clay bricks.
pub const WALL_THICKNESS: f32 = SOCLE_THICKNESS - 2.0 * SETBACK;
/// From the long axis to the inside of the long walls above the socle.
pub const INNER_HALF_WIDTH: f32 = HALF_WIDTH - SETBACK - WALL_THICKNESS;
/// From the middle to the inside of the end walls above the socle. End walls stand back two centimetres between the long ones.
pub const INNER_HALF_LENGTH: f32 = HALF_LENGTH - 0.02 - SETBACK - WALL_THICKNESS;
/// Top of the ground around.
pub const GROUND_TOP: f32 = -0.25;
/// The underside of the roof along the ridge.
pub const RIDGE_HEIGHT: f32 = 12.95;
/// What the roof falls a metre.
pub const ROOF_SLOPE: f32 = 0.268;
/// Thickness of boards and tiles, upright.
pub const ROOF_THICKNESS: f32 = 0.17;
/// How far the roof stands out over the eaves, and over the gables.
pub const OVERHANG: (f32, f32) = (0.75, 0.5);

/// Pieces reach this far into what carries them, so that no two faces coincide and no light passes a joint.
pub const BITE: f32 = 0.01;

/// Places of the columns along X, and of their two rows from the axis.
pub const COLUMN_PLACES: [f32; 7] = [-12.6, -8.4, -4.2, 0.0, 4.2, 8.4, 12.6];
/// From the long axis to the axes of the columns.
pub const COLUMN_ROW: f32 = 4.1;
/// Height of the columns with their capitals.
pub const COLUMN_HEIGHT: f32 = 10.0;
/// Radius of the columns at the foot.
pub const COLUMN_RADIUS: f32 = 0.45;

/// Middles of the windows along X, in both long walls between the columns.
pub const WINDOW_PLACES: [f32; 6] = [-10.5, -6.3, -2.1, 2.1, 6.3, 10.5];
/// Half the width of a window outside, and inside, where it is wider.
pub const WINDOW_HALF_WIDTH: (f32, f32) = (1.2, 1.4);
/// The sill of a window outside, and inside, to where it slopes down.
pub const WINDOW_SILL: (f32, f32) = (5.7, 5.25);
/// The head of a window outside and inside.
pub const WINDOW_HEAD: (f32, f32) = (9.7, 9.85);

/// Half the width of the door's opening in the east wall, and its height.
pub const DOOR: (f32, f32) = (1.9, 6.2);
/// The window over the door: half its width, sill and head.
pub const GABLE_WINDOW: (f32, f32, f32) = (1.3, 8.0, 10.4);

/// The opening in the southern slope of the roof, west, east, upper and lower edge: the statue's light before noon.
pub const SKYLIGHT: (f32, f32, f32, f32) = (-11.0, -6.3, 0.9, 3.4);

/// The axis of the statue's body along X; it looks to the door.
pub const STATUE_PLACE: f32 = -10.4;
/// Top of the statue's base.
pub const BASE_TOP: f32 = 1.0;

/// The underside of the roof at a distance from the long axis.
pub fn roof_underside(z: f32) -> f32 {
    RIDGE_HEIGHT - ROOF_SLOPE * z.abs()
}
