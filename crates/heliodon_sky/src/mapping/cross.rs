//! The cube unfolded to a cross.

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

/// 4 x 3: right of the east face, its left edge the east face's right one.
static HORIZONTAL: [Face; 6] = [NORTH, WEST, EAST, UP, DOWN, face((3.0, 1.0), DVec3::Z, DVec3::NEG_X, DVec3::Y)];
/// 3 x 4: below the lower face, so upside down.
static VERTICAL: [Face; 6] = [NORTH, WEST, EAST, UP, DOWN, face((1.0, 3.0), DVec3::Z, DVec3::X, DVec3::NEG_Y)];

/// (columns, rows) of faces of an image that has the shape of a cross.
pub(super) fn face_count(width: u32, height: u32) -> Option<(f64, f64)> {
    if u64::from(width) * 4 == u64::from(height) * 3 {
        Some((3.0, 4.0))
    } else if u64::from(width) * 3 == u64::from(height) * 4 {
        Some((4.0, 3.0))
    } else {
        None
    }
}

fn layout(w: f64, h: f64) -> (&'static [Face; 6], f64) {
    if w < h { (&VERTICAL, w / 3.0) } else { (&HORIZONTAL, w / 4.0) }
}

/// The face at a position, and the place on it: s to the right and t up, in [-1, 1].
fn locate(w: f64, h: f64, x: f64, y: f64) -> Option<(&'static Face, f64, f64)> {
    let (faces, size) = layout(w, h);
    let (column, row) = ((x / size).floor(), (y / size).floor());
    let (columns, rows) = if w < h { (3.0, 4.0) } else { (4.0, 3.0) };
    let cell = (column.min(columns - 1.0), row.min(rows - 1.0));
    let face = faces.iter().find(|f| f.cell == cell)?;
    Some((face, 2.0 * (x / size - cell.0) - 1.0, 1.0 - 2.0 * (y / size - cell.1)))
}

pub(super) fn direction(w: f64, h: f64, x: f64, y: f64) -> Option<DVec3> {
    let (face, s, t) = locate(w, h, x, y)?;
    (face.forward + face.right * s + face.up * t).try_normalize()
}

pub(super) fn position(w: f64, h: f64, d: DVec3) -> (f64, f64) {
    let (faces, size) = layout(w, h);
    let mut best = &faces[0];
    for face in faces {
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
