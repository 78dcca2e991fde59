//! Arches: a segment of a ring, drawn back.

use super::body::Body;
use super::edges::sights;
use super::fit::{Witness, fit};
use super::shape::{Fitted, Measure, Names, circle_in_space, frame_about, measure};
use super::table::{Rim, ShapeRow};
use super::{ModelError, NamedPoint, toward_cameras};
use glam::DVec3;

/// Numbers: the middle, how the front's normal leans along x and z of where it began, inner and outer radius, depth.
pub(super) fn arch(row: &ShapeRow, names: &Names, points: &[NamedPoint]) -> Result<Fitted, ModelError> {
    let [inner, outer, back] = [names.points(&row.inner)?, names.points(&row.outer)?, names.points(&row.back)?];
    if inner.len() < 3 || outer.is_empty() {
        return Err(
            names.refused("needs three points on its inner edge, from springing to springing, and one on its outer".into())
        );
    }
    if back.is_empty() && row.depth_m.is_none() {
        return Err(names.refused("needs a point of its back, or depth_m".into()));
    }
    let place = |i: usize| points[i].position;
    let of_inner: Vec<DVec3> = inner.iter().map(|&i| place(i)).collect();
    let (middle, normal, inner_m) =
        circle_in_space(&of_inner).ok_or_else(|| names.refused("has its inner points on a line".into()))?;
    let behind = back.first().map(|&i| place(i) - middle);
    let is_turned = match behind {
        Some(behind) => normal.dot(behind) > 0.0,
        None => toward_cameras(middle, inner.iter().map(|&i| &points[i]), names.photographs).dot(normal) < 0.0,
    };
    let normal = if is_turned { -normal } else { normal };
    let begun = frame_about(normal);
    let frame_of = move |numbers: &[f64]| {
        let lean = normal + begun.col(0) * numbers[3] + begun.col(2) * numbers[4];
        (DVec3::from_slice(&numbers[0..3]), lean / lean.length())
    };
    // ahead of the front, and away from the axis
    let at = move |numbers: &[f64], p: DVec3| {
        let (middle, normal) = frame_of(numbers);
        let ahead = normal.dot(p - middle);
        (ahead, (p - middle - normal * ahead).length())
    };
    let outer_m = outer.iter().map(|&i| (place(i) - middle).reject_from(normal).length()).sum::<f64>() / outer.len() as f64;
    let mut numbers = vec![middle.x, middle.y, middle.z, 0.0, 0.0, inner_m, outer_m];
    let depth_m = row.depth_m.or(behind.map(|behind| -normal.dot(behind))).unwrap_or(0.0);
    numbers.extend((!back.is_empty()).then_some(depth_m));
    let sights = sights(row, names)?;
    let mut witnesses: Vec<Witness> = Vec::new();
    for (edge, radius) in [(&inner, 5), (&outer, 6)] {
        for &point in edge {
            witnesses.push(Witness::On { point, off_m: Box::new(move |numbers, p| at(numbers, p).0) });
            witnesses.push(Witness::On { point, off_m: Box::new(move |numbers, p| at(numbers, p).1 - numbers[radius]) });
        }
    }
    for &point in &back {
        witnesses.push(Witness::On { point, off_m: Box::new(move |numbers, p| at(numbers, p).0 + numbers[7]) });
    }
    for (sight, marked) in sights.iter().zip(&row.edges) {
        let radius = if marked.of == Some(Rim::Inner) { 5 } else { 6 };
        for along in sight.rays {
            let off_px = move |numbers: &[f64]| {
                let (middle, normal) = frame_of(numbers);
                // where the ray meets the front's plane; one that runs along it tells nothing
                let distance_m = normal.dot(middle - sight.origin) / normal.dot(along);
                if !distance_m.is_finite() {
                    return 0.0;
                }
                (at(numbers, sight.origin + along * distance_m).1 - numbers[radius]) * sight.focal_px
                    / distance_m.abs().max(1.0e-6)
            };
            witnesses.push(Witness::Touches { edge: sight.edge, off_px: Box::new(off_px) });
        }
    }
    let solution = fit(&witnesses, points, names.tolerance_m, numbers)
        .ok_or_else(|| names.refused("is not held by what is marked: mark more of its edges".into()))?;
    let numbers = &solution.numbers;
    let (inner_m, outer_m, depth_m) = (numbers[5], numbers[6], numbers.get(7).copied().unwrap_or(depth_m));
    if !(inner_m > 0.0 && outer_m > inner_m && depth_m > 0.0) {
        let why = format!("would have radii of {inner_m:.3} m inside and {outer_m:.3} m outside and a depth of {depth_m:.3} m");
        return Err(names.refused(why));
    }
    let (middle, normal) = frame_of(numbers);
    let first = of_inner[0] - middle;
    let x = first.reject_from(normal).try_normalize().unwrap_or(begun.col(0));
    let y = normal.cross(x);
    let angle = |p: DVec3| {
        let angle = libm::atan2((p - middle).dot(y), (p - middle).dot(x));
        if angle < 0.0 { angle + std::f64::consts::TAU } else { angle }
    };
    // whichever way passes the marked points between
    let end = angle(of_inner[of_inner.len() - 1]);
    let is_ahead = angle(of_inner[of_inner.len() / 2]) <= end;
    let (from, to) = if is_ahead { (0.0, end) } else { (end, std::f64::consts::TAU) };
    let sides = row.sides.unwrap_or(16).max(1);
    let mut body = Body::default();
    let mut edge = |radius_m: f64, ahead_m: f64| -> Vec<u32> {
        let vertex = |i: u32| {
            let angle = from + (to - from) * f64::from(i) / f64::from(sides);
            middle + (x * libm::cos(angle) + y * libm::sin(angle)) * radius_m + normal * ahead_m
        };
        (0..=sides).map(|i| body.vertex(vertex(i))).collect()
    };
    let [front_in, front_out] = [edge(inner_m, 0.0), edge(outer_m, 0.0)];
    let [back_in, back_out] = [edge(inner_m, -depth_m), edge(outer_m, -depth_m)];
    let ring = |near: &[u32], far: &[u32]| near.iter().copied().chain(far.iter().rev().copied()).collect::<Vec<u32>>();
    body.polygon(&ring(&front_out, &front_in));
    body.polygon(&ring(&back_in, &back_out));
    body.strip(&front_in, &back_in);
    body.strip(&back_out, &front_out);
    let last = sides as usize;
    body.polygon(&[front_out[0], front_in[0], back_in[0], back_out[0]]);
    body.polygon(&[front_in[last], front_out[last], back_out[last], back_in[last]]);
    let mut measures = vec![measure("inner_radius_m", &solution, 5), measure("outer_radius_m", &solution, 6)];
    measures.push(Measure { name: "depth_m", value: depth_m, sigma: solution.sigmas.get(7).copied().unwrap_or(0.0) });
    Ok(names.fitted(body, &witnesses, points, numbers, measures))
}
