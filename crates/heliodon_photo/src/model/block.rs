//! Boxes and roofs of two slopes: corners whose places are signs times half sizes, turned and moved.

use super::body::{Body, newell};
use super::edges::sights;
use super::fit::{Witness, fit};
use super::shape::{Fitted, Measure, Names, rotation, turned_about_up};
use super::table::{Kind, ShapeRow};
use super::{ModelError, NamedPoint};
use glam::{DMat3, DVec3};

/// What corners there are, in halves of its size along x, y and z from its middle.
struct Form {
    corners: &'static [[i8; 3]],
    faces: &'static [(&'static str, &'static [usize])],
}

const BOX: Form = Form {
    corners: &[[-1, -1, 1], [1, -1, 1], [1, -1, -1], [-1, -1, -1], [-1, 1, 1], [1, 1, 1], [1, 1, -1], [-1, 1, -1]],
    faces: &[
        ("bottom", &[3, 2, 1, 0]),
        ("top", &[4, 5, 6, 7]),
        ("side-01", &[0, 1, 5, 4]),
        ("side-12", &[1, 2, 6, 5]),
        ("side-23", &[2, 3, 7, 6]),
        ("side-30", &[3, 0, 4, 7]),
    ],
};

const GABLE: Form = Form {
    corners: &[[-1, -1, 1], [1, -1, 1], [1, -1, -1], [-1, -1, -1], [-1, 1, 0], [1, 1, 0]],
    faces: &[
        ("bottom", &[3, 2, 1, 0]),
        ("side-01", &[0, 1, 5, 4]),
        ("side-12", &[1, 2, 5]),
        ("side-23", &[2, 3, 4, 5]),
        ("side-30", &[3, 0, 4]),
    ],
};

fn sign(corner: [i8; 3]) -> DVec3 {
    DVec3::from(corner.map(f64::from))
}

/// The form's numbers: its middle, its half sizes, and how it is turned from where it began: about all axes, or the vertical only.
struct Turned {
    begun: DMat3,
    upright: bool,
}

impl Turned {
    fn frame(&self, numbers: &[f64]) -> DMat3 {
        if self.upright {
            turned_about_up(numbers[6]) * self.begun
        } else {
            rotation(DVec3::new(numbers[6], numbers[7], numbers[8])) * self.begun
        }
    }

    fn corner(&self, numbers: &[f64], sign: DVec3) -> DVec3 {
        let (middle, half) = (DVec3::from_slice(&numbers[0..3]), DVec3::from_slice(&numbers[3..6]));
        middle + self.frame(numbers) * (sign * half)
    }
}

pub(super) fn block(row: &ShapeRow, names: &Names, points: &[NamedPoint]) -> Result<Fitted, ModelError> {
    let form = if row.kind == Kind::Gable { GABLE } else { BOX };
    if row.points.len() != form.corners.len() {
        return Err(names.refused(format!(
            "lists {} corners where {} belong; write \"-\" for one that is not marked",
            row.points.len(),
            form.corners.len()
        )));
    }
    let mut corners: Vec<(usize, DVec3)> = Vec::new();
    for (name, &corner) in row.points.iter().zip(form.corners).filter(|(name, _)| *name != "-") {
        corners.push((names.point(name)?, sign(corner)));
    }
    let mut on_faces: Vec<(usize, &'static [usize])> = Vec::new();
    for (face, listed) in &row.on {
        let known = form.faces.iter().find(|(name, _)| name == face);
        let Some((_, face)) = known else {
            let faces: Vec<&str> = form.faces.iter().map(|(name, _)| *name).collect();
            return Err(names.refused(format!("has no face \"{face}\"; its faces are {}", faces.join(", "))));
        };
        for name in listed {
            on_faces.push((names.point(name)?, face));
        }
    }
    let turned = Turned { begun: axes(row.upright, &corners, points, names)?, upright: row.upright };
    let mut numbers = sized(&turned.begun, &form, &corners, &on_faces, points, names)?;
    numbers.extend(if row.upright { [0.0].as_slice() } else { &[0.0; 3] });
    let turned = &turned;
    let sights = sights(row, names)?;
    let mut witnesses: Vec<Witness> = Vec::new();
    for &(point, sign) in &corners {
        witnesses.push(Witness::At { point, place: Box::new(move |numbers| turned.corner(numbers, sign)) });
    }
    for &(point, face) in &on_faces {
        let off_m = move |numbers: &[f64], p: DVec3| {
            let ring: Vec<DVec3> = face.iter().map(|&c| turned.corner(numbers, sign(form.corners[c]))).collect();
            newell(&ring).try_normalize().map_or(0.0, |normal| normal.dot(p - ring[0]))
        };
        witnesses.push(Witness::On { point, off_m: Box::new(off_m) });
    }
    for (sight, marked) in sights.iter().zip(&row.edges) {
        let [a, b] = marked.between.unwrap_or_default();
        if a == b || a.max(b) >= form.corners.len() {
            return Err(names.refused(format!("has no edge between the corners {a} and {b}")));
        }
        let ends = [a, b].map(|corner| sign(form.corners[corner]));
        for along in sight.rays {
            let off_px = move |numbers: &[f64]| sight.misses_line(along, ends.map(|sign| turned.corner(numbers, sign)));
            witnesses.push(Witness::Touches { edge: sight.edge, off_px: Box::new(off_px) });
        }
    }
    let solution = fit(&witnesses, points, names.tolerance_m, numbers)
        .ok_or_else(|| names.refused("is not held by what is marked: mark more of its corners".into()))?;
    let numbers = &solution.numbers;
    if numbers[3..6].iter().any(|&half| half <= 0.0) {
        return Err(names.refused(
            "has its corners in another order than bottom ones counter-clockwise seen from above, then the upper ones".into(),
        ));
    }
    let mut body = Body::default();
    for &corner in form.corners {
        body.vertex(turned.corner(numbers, sign(corner)));
    }
    for (_, ring) in form.faces {
        let ring: Vec<u32> = ring.iter().map(|&c| c as u32).collect();
        body.polygon(&ring);
    }
    let size = |name, i: usize| Measure { name, value: 2.0 * numbers[i], sigma: 2.0 * solution.sigmas[i] };
    let measures = vec![size("length_m", 3), size("height_m", 4), size("width_m", 5)];
    Ok(names.fitted(body, &witnesses, points, numbers, measures))
}

/// Directions of its axes from corners that differ along one of them only.
fn axes(upright: bool, corners: &[(usize, DVec3)], points: &[NamedPoint], names: &Names) -> Result<DMat3, ModelError> {
    let along = |axis: usize| {
        let mut sum = DVec3::ZERO;
        for (a, at_a) in corners {
            for (b, at_b) in corners {
                let mut between = *at_b - *at_a;
                let is_ahead = between[axis] > 0.0;
                between[axis] = 0.0;
                if is_ahead && between == DVec3::ZERO {
                    sum += points[*b].position - points[*a].position;
                }
            }
        }
        sum.try_normalize()
    };
    let up = if upright { Some(DVec3::Y) } else { along(1) };
    let missing = || names.refused("needs two marked corners along each of two of its sides (one where it is upright)".into());
    let square = |a: DVec3, b: DVec3| (b - a * a.dot(b)).try_normalize();
    let frame = match (along(0), up, along(2)) {
        (Some(x), Some(y), _) if upright => square(y, x).map(|x| DMat3::from_cols(x, y, x.cross(y))),
        (_, Some(y), Some(z)) if upright => square(y, z).map(|z| DMat3::from_cols(y.cross(z), y, z)),
        (Some(x), _, Some(z)) => square(x, z).map(|z| DMat3::from_cols(x, z.cross(x), z)),
        (Some(x), Some(y), None) => square(x, y).map(|y| DMat3::from_cols(x, y, x.cross(y))),
        (None, Some(y), Some(z)) => square(y, z).map(|z| DMat3::from_cols(y.cross(z), y, z)),
        _ => None,
    };
    frame.ok_or_else(missing)
}

/// Middle and half sizes along given axes: one line through coordinates over signs for each axis.
fn sized(
    frame: &DMat3,
    form: &Form,
    corners: &[(usize, DVec3)],
    on_faces: &[(usize, &[usize])],
    points: &[NamedPoint],
    names: &Names,
) -> Result<Vec<f64>, ModelError> {
    let (mut middle, mut half) = (DVec3::ZERO, DVec3::ZERO);
    for axis in 0..3 {
        let coordinate = |point: usize| frame.col(axis).dot(points[point].position);
        let of_corners = corners.iter().map(|(point, sign)| (sign[axis], coordinate(*point)));
        let of_faces = on_faces.iter().filter_map(|(point, face)| {
            let first = form.corners[face[0]][axis];
            face.iter().all(|&c| form.corners[c][axis] == first).then(|| (f64::from(first), coordinate(*point)))
        });
        let known: Vec<(f64, f64)> = of_corners.chain(of_faces).collect();
        let n = known.len() as f64;
        let mean = |of: &dyn Fn(&(f64, f64)) -> f64| known.iter().map(of).sum::<f64>() / n;
        let (sign, place) = (mean(&|k| k.0), mean(&|k| k.1));
        let spread = mean(&|k| (k.0 - sign) * (k.0 - sign));
        if spread.is_nan() || spread < 1.0e-9 {
            let side = ["length (from corner 0 to 1)", "height", "width (from corner 1 to 2)"][axis];
            return Err(names.refused(format!("has nothing marked that tells its {side}")));
        }
        half[axis] = mean(&|k| (k.0 - sign) * (k.1 - place)) / spread;
        middle += frame.col(axis) * (place - half[axis] * sign);
    }
    Ok(vec![middle.x, middle.y, middle.z, half.x, half.y, half.z])
}
