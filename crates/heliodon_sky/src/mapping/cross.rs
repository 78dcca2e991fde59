//! The cube unfolded to a cross, or its faces in a row.

use glam::DVec3;

/// A face's place in the cross (column, row) and its frame: where its middle looks, its right and its up.
struct Face {
    cell: (f64, f64),
    forward: DVec3,
    right: DVec3,
    up: DVec3,
}

const fn face(cell: (f64, f64), forward: DVec3, right: DVec3, up: DVec3) -> Face {
    Face { cell, forward, right, up }
}

const NORTH: Face = face((1.0, 1.0), DVec3::NEG_Z, DVec3::X, DVec3::Y);
const WEST: Face = face((0.0, 1.0), DVec3::NEG_X, DVec3::NEG_Z, DVec3::Y);
const EAST: Face = face((2.0, 1.0), DVec3::X, DVec3::Z, DVec3::Y);
const UP: Face = face((1.0, 0.0), DVec3::Y, DVec3::X, DVec3::Z);
const DOWN: Face = face((1.0, 2.0), DVec3::NEG_Y, DVec3::X, DVec3::NEG_Z);
/// Right of the east face, its left edge the east face's right one.
const SOUTH: Face = face((3.0, 1.0), DVec3::Z, DVec3::NEG_X, DVec3::Y);
/// Below the lower face, so upside down.
const SOUTH_BELOW: Face = face((1.0, 3.0), DVec3::Z, DVec3::X, DVec3::NEG_Y);

/// How the faces lie in an image.
struct Layout {
    /// Cells, in columns and rows.
    cells: (u32, u32),
    faces: [Face; 6],
}

/// Right, left, top, bottom, front, back, each so many columns and rows from the one before.
const fn strip(columns: f64, rows: f64) -> [Face; 6] {
    const fn at(number: f64, columns: f64, rows: f64, of: Face) -> Face {
        face((number * columns, number * rows), of.forward, of.right, of.up)
    }
    [
        at(0.0, columns, rows, EAST),
        at(1.0, columns, rows, WEST),
        at(2.0, columns, rows, UP),
        at(3.0, columns, rows, DOWN),
        at(4.0, columns, rows, NORTH),
        at(5.0, columns, rows, SOUTH),
    ]
}

static LAYOUTS: [Layout; 4] = [
    Layout { cells: (4, 3), faces: [NORTH, WEST, EAST, UP, DOWN, SOUTH] },
    Layout { cells: (3, 4), faces: [NORTH, WEST, EAST, UP, DOWN, SOUTH_BELOW] },
    Layout { cells: (6, 1), faces: strip(1.0, 0.0) },
    Layout { cells: (1, 6), faces: strip(0.0, 1.0) },
];

fn find(width: u32, height: u32) -> Option<&'static Layout> {
    LAYOUTS.iter().find(|layout| u64::from(width) * u64::from(layout.cells.1) == u64::from(height) * u64::from(layout.cells.0))
}

/// (columns, rows) of faces of an image that has the shape of a cross or a strip.
pub(super) fn face_count(width: u32, height: u32) -> Option<(f64, f64)> {
    find(width, height).map(|layout| (f64::from(layout.cells.0), f64::from(layout.cells.1)))
}

/// Pixels of a face's side where the faces lie in a row, so that those side by side are no neighbours on the cube.
pub(super) fn strip_side(width: u32, height: u32) -> Option<u32> {
    find(width, height).filter(|layout| layout.cells.0.min(layout.cells.1) == 1).map(|_| width.min(height))
}

/// The layout and the pixels of a face's side. What is no layout was refused before.
fn layout(w: f64, h: f64) -> (&'static Layout, f64) {
    let layout = find(w as u32, h as u32).unwrap_or(&LAYOUTS[0]);
    (layout, w / f64::from(layout.cells.0))
}

/// The face at a position, and the place on it: s to the right and t up, in [-1, 1].
fn locate(w: f64, h: f64, x: f64, y: f64) -> Option<(&'static Face, f64, f64)> {
    let (layout, size) = layout(w, h);
    let (column, row) = ((x / size).floor(), (y / size).floor());
    let cell = (column.min(f64::from(layout.cells.0) - 1.0), row.min(f64::from(layout.cells.1) - 1.0));
    let face = layout.faces.iter().find(|f| f.cell == cell)?;
    Some((face, 2.0 * (x / size - cell.0) - 1.0, 1.0 - 2.0 * (y / size - cell.1)))
}

pub(super) fn direction(w: f64, h: f64, x: f64, y: f64) -> Option<DVec3> {
    let (face, s, t) = locate(w, h, x, y)?;
    (face.forward + face.right * s + face.up * t).try_normalize()
}

pub(super) fn position(w: f64, h: f64, d: DVec3) -> (f64, f64) {
    let (layout, size) = layout(w, h);
    let mut best = &layout.faces[0];
    for face in &layout.faces {
        if face.forward.dot(d) > best.forward.dot(d) {
            best = face;
        }
    }
    let depth = best.forward.dot(d);
    let (s, t) = (best.right.dot(d) / depth, best.up.dot(d) / depth);
    ((best.cell.0 + 0.5 * (1.0 + s)) * size, (best.cell.1 + 0.5 * (1.0 - t)) * size)
}

/// Solid angle for area, in sr per square pixel.
pub(super) fn density(w: f64, h: f64, x: f64, y: f64) -> f64 {
    let Some((_, s, t)) = locate(w, h, x, y) else { return 0.0 };
    let size = layout(w, h).1;
    let r2 = 1.0 + s * s + t * t;
    4.0 / (size * size * r2 * r2.sqrt())
}

/// The solid angle of a pixel, exactly: that of a rectangle of a face seen from the cube's middle.
pub(super) fn pixel_solid_angle(w: f64, h: f64, x: u32, y: u32) -> f64 {
    let Some((_, s, t)) = locate(w, h, f64::from(x) + 0.5, f64::from(y) + 0.5) else { return 0.0 };
    let half = 1.0 / layout(w, h).1;
    let corner = |s: f64, t: f64| libm::atan2(s * t, (1.0 + s * s + t * t).sqrt());
    corner(s + half, t + half) - corner(s - half, t + half) - corner(s + half, t - half) + corner(s - half, t - half)
}
