//! What marked edges tell: of shapes that are fitted, and of points that polygons are drawn over.

use super::fit::{Witness, fit};
use super::shape::Names;
use super::table::{EdgeRow, Kind, ShapeRow};
use super::{EdgeResidual, ModelError, NamedPoint};
use crate::camera::Camera;
use glam::{DVec2, DVec3};
use std::collections::BTreeMap;

/// An edge's rays: what its pixels saw.
pub(super) struct Sight {
    /// Which of the row's edges.
    pub edge: usize,
    /// The photograph.
    pub photograph: usize,
    /// The eye.
    pub origin: DVec3,
    /// Unit vectors through both pixels.
    pub rays: [DVec3; 2],
    /// Pixels to a radian.
    pub focal_px: f64,
}

impl Sight {
    fn new(edge: usize, marked: &EdgeRow, names: &Names) -> Result<Self, ModelError> {
        let photograph = names.photograph(&marked.photograph)?;
        let camera = &names.photographs[photograph].1;
        let rays = [marked.from, marked.to].map(|pixel| camera.ray(DVec2::from(pixel)).1);
        Ok(Self { edge, photograph, origin: camera.centre(), rays, focal_px: camera.intrinsics.focal_px[0] })
    }

    /// By how many pixels the ray `along` misses the line through two places.
    pub fn misses_line(&self, along: DVec3, [a, b]: [DVec3; 2]) -> f64 {
        // the angle between the ray and the plane through the eye and the line
        let normal = (a - self.origin).cross(b - self.origin).try_normalize();
        normal.map_or(0.0, |normal| normal.dot(along) * self.focal_px)
    }
}

/// The rays of all of a row's edges.
pub(super) fn sights(row: &ShapeRow, names: &Names) -> Result<Vec<Sight>, ModelError> {
    row.edges.iter().enumerate().map(|(edge, marked)| Sight::new(edge, marked, names)).collect()
}

/// Between how many places along a ray the one is looked for that is least outside, before it is closed in on.
const PLACES: usize = 32;
/// Steps that close in: each leaves 62 % of what was left, so that these leave a hundred-thousandth.
const CLOSING: usize = 24;

/// How far a ray passes outside of something round about an axis, and how far along it does: where it touches this is 0. `axis` is a place and a unit
/// vector; nothing that counts is further from it than `reach_m`.
pub(super) fn passes(
    (origin, along): (DVec3, DVec3),
    (middle, axis): (DVec3, DVec3),
    reach_m: f64,
    outside: impl Fn(DVec3) -> f64,
) -> (f64, f64) {
    let across = along - axis * along.dot(axis);
    let to_axis = middle - origin;
    let nearest = (to_axis - axis * to_axis.dot(axis)).dot(across) / across.length_squared().max(1.0e-12);
    let reach = reach_m / across.length().max(1.0e-6);
    let off = |t: f64| outside(origin + along * t);
    let place = |i: usize| nearest + reach * (2.0 * i as f64 / PLACES as f64 - 1.0);
    let least = (0..=PLACES).min_by(|&a, &b| off(place(a)).total_cmp(&off(place(b)))).unwrap_or(PLACES / 2);
    let (mut low, mut high) = (place(least.saturating_sub(1)), place((least + 1).min(PLACES)));
    // the golden section
    let part = 0.5 * (5.0_f64.sqrt() - 1.0);
    for _ in 0..CLOSING {
        let (a, b) = (high - part * (high - low), low + part * (high - low));
        if off(a) < off(b) { high = b } else { low = a }
    }
    let t = 0.5 * (low + high);
    (off(t), t)
}

/// The edges of polygons and extrusions: between two of their points.
fn drawn_over(row: &ShapeRow) -> bool {
    matches!(row.kind, Kind::Polygon | Kind::Extrusion) && !row.edges.is_empty()
}

/// Moves the points that polygons and extrusions are drawn over to where marked edges between them have them too: all at once, so that polygons that share
/// points still do. Rows with mistakes are passed over; they are refused when they are made.
pub(super) fn settle(
    rows: &[ShapeRow],
    (index, photographs): (&BTreeMap<&str, usize>, &[(String, Camera)]),
    points: &mut [NamedPoint],
) {
    let mut edges: Vec<(Sight, [usize; 2])> = Vec::new();
    for row in rows.iter().filter(|row| drawn_over(row)) {
        edges.extend(ends(row, &Names::of(row, index, photographs)).into_iter().flatten());
    }
    let mut moved: Vec<usize> = edges.iter().flat_map(|(_, ends)| *ends).collect();
    moved.sort_unstable();
    moved.dedup();
    if moved.is_empty() {
        return;
    }
    let number = |point: usize| 3 * moved.partition_point(|&other| other < point);
    let place = |numbers: &[f64], point: usize| DVec3::from_slice(&numbers[number(point)..number(point) + 3]);
    let mut witnesses: Vec<Witness> = Vec::new();
    for &point in &moved {
        witnesses.push(Witness::At { point, place: Box::new(move |numbers| place(numbers, point)) });
    }
    for (sight, ends) in &edges {
        for along in sight.rays {
            let off_px = move |numbers: &[f64]| sight.misses_line(along, ends.map(|point| place(numbers, point)));
            witnesses.push(Witness::Touches { edge: sight.edge, off_px: Box::new(off_px) });
        }
    }
    let start = moved.iter().flat_map(|&point| points[point].position.to_array()).collect();
    // a point that is known exactly has a covariance of nothing, which no fit can weigh by
    let Some(found) = fit(&witnesses, points, EXACT_M, start) else { return };
    let places: Vec<DVec3> = moved.iter().map(|&point| place(&found.numbers, point)).collect();
    for (&point, at) in moved.iter().zip(places) {
        points[point].position = at;
    }
}

/// What is known exactly is known to a tenth of a millimetre.
const EXACT_M: f64 = 1.0e-4;

/// The edges of a row and the points that each runs between; none for one with a mistake.
fn ends(row: &ShapeRow, names: &Names) -> Option<Vec<(Sight, [usize; 2])>> {
    let ring = names.points(&row.points).ok()?;
    let sights = sights(row, names).ok()?;
    let end = |corner: usize| ring.get(corner).copied();
    let ends = sights.into_iter().zip(&row.edges).map(|(sight, marked)| {
        let [a, b] = marked.between?;
        Some((sight, [end(a)?, end(b)?])).filter(|_| a != b)
    });
    ends.collect()
}

/// How far the edges of a polygon or an extrusion are off its points.
///
/// # Errors
/// Edges that run between no two of its corners.
pub(super) fn residuals(row: &ShapeRow, names: &Names, points: &[NamedPoint]) -> Result<Vec<EdgeResidual>, ModelError> {
    if row.edges.is_empty() {
        return Ok(Vec::new());
    }
    sights(row, names)?;
    let Some(ends) = ends(row, names) else {
        let wrong = row.edges.iter().filter_map(|edge| edge.between);
        let wrong = wrong.filter(|[a, b]| a == b || a.max(b) >= &row.points.len()).map(|[a, b]| format!("{a} and {b}"));
        return Err(names.refused(format!("has no edge between the corners {}", wrong.collect::<Vec<_>>().join(", nor "))));
    };
    let residual = |(sight, ends): &(Sight, [usize; 2])| {
        let line = ends.map(|point| points[point].position);
        let squares = sight.rays.map(|along| sight.misses_line(along, line)).map(|off_px| off_px * off_px);
        EdgeResidual { edge: sight.edge, off_px: (0.5 * (squares[0] + squares[1])).sqrt() }
    };
    Ok(ends.iter().map(residual).collect())
}
