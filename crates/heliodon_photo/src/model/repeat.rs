//! Symmetry and repetition: mark one column, get eight.

use super::body::Body;
use super::shape::{Names, best_plane, rotation};
use super::table::{RepeatRow, ShapeRow};
use super::{ModelError, NamedPoint};
use glam::DVec3;

/// The most copies of one shape.
const MOST: u32 = 10_000;

/// The body with its image in the mirror, and both repeated.
pub(super) fn repeated(body: Body, row: &ShapeRow, names: &Names, points: &[NamedPoint]) -> Result<Body, ModelError> {
    let mut all = body;
    if !row.mirror.is_empty() {
        let (place, normal) = mirror(&row.mirror, names, points)?;
        let image = all.moved(true, |p| p - normal * (2.0 * normal.dot(p - place)));
        all.append(&image);
    }
    let Some(repeat) = &row.repeat else { return Ok(all) };
    if !(1..=MOST).contains(&repeat.count) {
        return Err(names.refused(format!("is repeated {} times; it is 1 to {MOST}", repeat.count)));
    }
    let place = step(repeat, names, points)?;
    let one = all.clone();
    for copy in 1..repeat.count {
        all.append(&one.moved(false, |p| place(f64::from(copy), p)));
    }
    Ok(all)
}

fn mirror(row: &[String], names: &Names, points: &[NamedPoint]) -> Result<(DVec3, DVec3), ModelError> {
    let places: Vec<DVec3> = names.points(row)?.iter().map(|&i| points[i].position).collect();
    let plane = match places.as_slice() {
        [a, b] => (*b - *a).try_normalize().map(|normal| ((*a + *b) * 0.5, normal)),
        [_] | [] => None,
        more => best_plane(&more.iter().map(|p| (*p, 1.0)).collect::<Vec<_>>()),
    };
    plane.ok_or_else(|| {
        names.refused("needs two points that mirror each other, or three of the mirror's plane that are not on a line".into())
    })
}

/// Where the copy of a number puts a place.
fn step(repeat: &RepeatRow, names: &Names, points: &[NamedPoint]) -> Result<Box<dyn Fn(f64, DVec3) -> DVec3>, ModelError> {
    let between = |pair: &[String; 2]| {
        let [a, b] = names.pair(pair)?;
        Ok((points[a].position, points[b].position - points[a].position))
    };
    match (&repeat.step, &repeat.span, &repeat.around) {
        (Some(pair), None, None) if repeat.angle_deg.is_none() => {
            let (_, step) = between(pair)?;
            Ok(Box::new(move |copy, p| p + step * copy))
        }
        (None, Some(pair), None) if repeat.angle_deg.is_none() => {
            let (_, span) = between(pair)?;
            let step = span / f64::from(repeat.count.max(2) - 1);
            Ok(Box::new(move |copy, p| p + step * copy))
        }
        (None, None, Some(pair)) => {
            let (origin, along) = between(pair)?;
            let axis =
                along.try_normalize().ok_or_else(|| names.refused("is repeated around an axis without length".into()))?;
            let angle = repeat.angle_deg.map_or(std::f64::consts::TAU / f64::from(repeat.count), f64::to_radians);
            Ok(Box::new(move |copy, p| origin + rotation(axis * (angle * copy)) * (p - origin)))
        }
        _ => Err(names.refused("is to be repeated by one of step, span and around (angle_deg goes with around)".into())),
    }
}
