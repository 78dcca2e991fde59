//! Shafts and what is turned about an axis.

use super::body::{Body, Level};
use super::edges::{Sight, passes, sights};
use super::fit::{Witness, fit};
use super::shape::{Fitted, Measure, Names, circle, circle_in_space, frame_about, measure};
use super::table::{Kind, ShapeRow};
use super::{ModelError, NamedPoint};
use glam::{DMat3, DVec2, DVec3};

/// A shaft's numbers: where its axis begins and ends, the radii there, and how much it swells half way up beyond a straight taper.
#[derive(Clone, Copy, Debug)]
struct Shaft {
    foot: DVec3,
    head: DVec3,
    radii: [f64; 2],
    swelling: f64,
}

/// How a list of numbers stands for a shaft.
#[derive(Clone, Copy, Debug)]
struct Numbers {
    upright: bool,
    tapers: bool,
    swells: bool,
}

impl Numbers {
    fn of(self, shaft: &Shaft) -> Vec<f64> {
        let mut numbers = shaft.foot.to_array().to_vec();
        if self.upright {
            numbers.push(shaft.head.y - shaft.foot.y);
        } else {
            numbers.extend(shaft.head.to_array());
        }
        numbers.push(shaft.radii[0]);
        numbers.extend(self.tapers.then_some(shaft.radii[1]));
        numbers.extend(self.swells.then_some(shaft.swelling));
        numbers
    }

    /// Which number is the lower radius.
    fn radius(self) -> usize {
        if self.upright { 4 } else { 6 }
    }

    fn shaft(self, numbers: &[f64]) -> Shaft {
        let foot = DVec3::from_slice(&numbers[0..3]);
        let head = if self.upright { foot + DVec3::Y * numbers[3] } else { DVec3::from_slice(&numbers[3..6]) };
        let first = self.radius();
        let last = if self.tapers { first + 1 } else { first };
        let swelling = if self.swells { numbers[last + 1] } else { 0.0 };
        Shaft { foot, head, radii: [numbers[first], numbers[last]], swelling }
    }
}

impl Shaft {
    fn axis(&self) -> DVec3 {
        (self.head - self.foot).try_normalize().unwrap_or(DVec3::Y)
    }

    fn height(&self, p: DVec3) -> f64 {
        self.axis().dot(p - self.foot)
    }

    fn radius(&self, height: f64) -> f64 {
        let part = height / self.foot.distance(self.head).max(f64::MIN_POSITIVE);
        self.radii[0] + (self.radii[1] - self.radii[0]) * part + 4.0 * self.swelling * part * (1.0 - part)
    }

    /// How far a place is outside of the shaft, or of what it would be if it went on.
    fn outside(&self, p: DVec3) -> f64 {
        let height = self.height(p);
        (p - self.foot - self.axis() * height).length() - self.radius(height)
    }
}

pub(super) fn shaft(row: &ShapeRow, names: &Names, points: &[NamedPoint]) -> Result<Fitted, ModelError> {
    let kind =
        Numbers { upright: row.upright, tapers: row.kind == Kind::Column, swells: row.kind == Kind::Column && row.entasis };
    let [bottom, top, anywhere] = [names.points(&row.bottom)?, names.points(&row.top)?, names.points(&row.points)?];
    if bottom.is_empty() || top.is_empty() {
        return Err(names.refused("needs a point on its lower rim (bottom) and one on its upper rim (top)".into()));
    }
    let sights = sights(row, names)?;
    let start = begun(row, names, points, [&bottom, &top, &anywhere], &sights)?;
    let mut witnesses: Vec<Witness> = Vec::new();
    let outside = move |numbers: &[f64], p: DVec3| kind.shaft(numbers).outside(p);
    for &point in bottom.iter().chain(&top).chain(&anywhere) {
        witnesses.push(Witness::On { point, off_m: Box::new(outside) });
    }
    for &point in &bottom {
        let off_m = move |numbers: &[f64], p: DVec3| kind.shaft(numbers).height(p);
        witnesses.push(Witness::On { point, off_m: Box::new(off_m) });
    }
    for &point in &top {
        let off_m = move |numbers: &[f64], p: DVec3| {
            let shaft = kind.shaft(numbers);
            shaft.axis().dot(p - shaft.head)
        };
        witnesses.push(Witness::On { point, off_m: Box::new(off_m) });
    }
    for sight in &sights {
        for along in sight.rays {
            let (origin, focal_px) = (sight.origin, sight.focal_px);
            let off_px = move |numbers: &[f64]| {
                let shaft = kind.shaft(numbers);
                let reach_m = 2.0 * shaft.radii[0].abs().max(shaft.radii[1].abs());
                let (off_m, distance_m) = passes((origin, along), (shaft.foot, shaft.axis()), reach_m, |p| shaft.outside(p));
                off_m * focal_px / distance_m.abs().max(1.0e-6)
            };
            witnesses.push(Witness::Touches { edge: sight.edge, off_px: Box::new(off_px) });
        }
    }
    let solution = fit(&witnesses, points, names.tolerance_m, kind.of(&start)).ok_or_else(|| {
        names.refused("is not held by what is marked: mark its edges in one more photograph, or more points on its rims".into())
    })?;
    let shaft = kind.shaft(&solution.numbers);
    if shaft.radii.iter().any(|radius| radius.is_nan() || *radius <= 0.0) {
        return Err(names.refused(format!(
            "would have radii of {:.3} m and {:.3} m: look at its marks again",
            shaft.radii[0], shaft.radii[1]
        )));
    }
    let height_m = shaft.foot.distance(shaft.head);
    // a swelling is followed by six straight pieces, a taper needs one
    let pieces = if kind.swells { 6 } else { 1 };
    let level = |i: u32| {
        let height_m = height_m * f64::from(i) / f64::from(pieces);
        Level { height_m, radius_m: shaft.radius(height_m) }
    };
    let levels: Vec<Level> = (0..=pieces).map(level).collect();
    let mut body = Body::default();
    body.turned(shaft.foot, frame_about(shaft.axis()), &levels, row.sides.unwrap_or(24), row.watertight);
    let first = kind.radius();
    let mut measures = vec![measure("lower_radius_m", &solution, first)];
    if kind.tapers {
        measures.push(measure("upper_radius_m", &solution, first + 1));
    }
    if kind.swells {
        measures.push(measure("swelling_m", &solution, first + 2));
    }
    let ends = if kind.upright { &solution.sigmas[3..4] } else { &solution.sigmas[0..6] };
    let sigma = ends.iter().map(|s| s * s).sum::<f64>().sqrt() / if kind.upright { 1.0 } else { 3.0_f64.sqrt() };
    measures.push(Measure { name: "height_m", value: height_m, sigma });
    Ok(names.fitted(body, &witnesses, points, &solution.numbers, measures))
}

/// A shaft to start from, by the first of these that what is marked allows: circles through rims, a circle seen from above, planes half way between the edges
/// in two photographs, the axis that the row names.
fn begun(
    row: &ShapeRow,
    names: &Names,
    points: &[NamedPoint],
    [bottom, top, anywhere]: [&[usize]; 3],
    sights: &[Sight],
) -> Result<Shaft, ModelError> {
    let places = |of: &[usize]| of.iter().map(|&i| points[i].position).collect::<Vec<DVec3>>();
    let (low, high) = (places(bottom), places(top));
    let all: Vec<DVec3> = low.iter().chain(&high).copied().chain(places(anywhere)).collect();
    let circles = || Some((circle_in_space(&low)?.0, circle_in_space(&high)?.0));
    let from_above = || {
        let flat: Vec<DVec2> = all.iter().map(|p| DVec2::new(p.x, p.z)).collect();
        let (middle, _) = circle(&flat)?;
        let at = |y: f64| DVec3::new(middle.x, y, middle.y);
        Some((at(low[0].y), at(high[0].y)))
    };
    let axis = if let Some(axis) = &row.axis {
        let [a, b] = names.pair(axis)?;
        Some((points[a].position, points[b].position))
    } else if row.upright && all.len() >= 3 && row.edges.is_empty() {
        from_above()
    } else {
        let of_rims = if low.len() >= 3 && high.len() >= 3 { circles() } else { None };
        of_rims.or_else(|| between_edges(sights))
    };
    let missing = "needs one of these to begin with: three points on each rim, both its edges marked in two photographs, \
                   upright = true and three points, or its axis";
    let (a, b) = axis.ok_or_else(|| names.refused(missing.into()))?;
    let mut along = (b - a).try_normalize().ok_or_else(|| names.refused("has an axis without length".into()))?;
    if row.upright {
        along = DVec3::Y;
    }
    let mean = |of: &[DVec3]| of.iter().map(|p| along.dot(*p - a)).sum::<f64>() / of.len() as f64;
    let ends = [mean(&low), mean(&high)].map(|height| a + along * height);
    let radius = |of: &[DVec3], end: DVec3| {
        let out = |p: &DVec3| (*p - end - along * along.dot(*p - end)).length();
        of.iter().map(out).sum::<f64>() / of.len() as f64
    };
    let radii = [radius(&low, ends[0]), radius(&high, ends[1])];
    if ends[0].distance(ends[1]) < 1.0e-6 {
        return Err(names.refused("has its lower and its upper rim at one height".into()));
    }
    Ok(Shaft { foot: ends[0], head: ends[1], radii, swelling: 0.0 })
}

/// The line in which planes meet that run half way between a shaft's two edges, as two photographs show them.
fn between_edges(sights: &[Sight]) -> Option<(DVec3, DVec3)> {
    let mut planes: Vec<(DVec3, DVec3)> = Vec::new();
    let mut photographs: Vec<usize> = sights.iter().map(|sight| sight.photograph).collect();
    photographs.dedup();
    photographs.sort_unstable();
    photographs.dedup();
    for photograph in photographs {
        let mut of_photograph = sights.iter().filter(|sight| sight.photograph == photograph);
        let (Some(one), Some(other)) = (of_photograph.next(), of_photograph.next_back()) else { continue };
        let normal = |sight: &Sight, inward: DVec3| {
            let normal = sight.rays[0].cross(sight.rays[1]).try_normalize()?;
            Some(if normal.dot(inward) < 0.0 { -normal } else { normal })
        };
        let middle = |sight: &Sight| sight.rays.iter().sum::<DVec3>();
        let (Some(left), Some(right)) = (normal(one, middle(other)), normal(other, middle(one))) else { continue };
        planes.extend((left - right).try_normalize().map(|normal| (one.origin, normal)));
    }
    let (&first, rest) = planes.split_first()?;
    // the one that is seen most from the side
    let square = |plane: &(DVec3, DVec3)| first.1.cross(plane.1).length();
    let second = rest.iter().max_by(|a, b| square(a).total_cmp(&square(b)))?;
    let along = first.1.cross(second.1).try_normalize()?;
    let planes = DMat3::from_cols(first.1, second.1, along).transpose();
    let offsets = DVec3::new(first.1.dot(first.0), second.1.dot(second.0), along.dot(first.0));
    let place = planes.inverse() * offsets;
    place.is_finite().then(|| (place, place + along))
}

/// The radius at a height of a profile: heights and radii in turn, from the bottom up, straight between them and beyond.
fn radius_at(profile: &[f64], height: f64) -> f64 {
    let rings: Vec<&[f64]> = profile.chunks_exact(2).collect();
    let above = rings.partition_point(|ring| ring[0] < height).clamp(1, rings.len() - 1);
    let (low, high) = (rings[above - 1], rings[above]);
    let part = (height - low[0]) / (high[0] - low[0]).max(1.0e-9);
    low[1] + (high[1] - low[1]) * part
}

/// Numbers: where the axis crosses the plane through its start, how it leans from there, then each ring's height and radius.
pub(super) fn revolution(row: &ShapeRow, names: &Names, points: &[NamedPoint]) -> Result<Fitted, ModelError> {
    let rings: Vec<Vec<usize>> = row.rings.iter().map(|ring| names.points(ring)).collect::<Result<_, _>>()?;
    if rings.len() < 2 || rings.iter().any(Vec::is_empty) {
        return Err(names.refused("needs two rings or more, with a point in each".into()));
    }
    let places = |ring: &[usize]| ring.iter().map(|&i| points[i].position).collect::<Vec<DVec3>>();
    let axis = if let Some(axis) = &row.axis {
        let [a, b] = names.pair(axis)?;
        Some((points[a].position, points[b].position - points[a].position))
    } else {
        let circles: Vec<_> = rings.iter().filter(|r| r.len() >= 3).filter_map(|r| circle_in_space(&places(r))).collect();
        let first = circles.first();
        let upright = row.upright.then_some(DVec3::Y);
        let between = circles.last().zip(first).map(|(last, first)| last.0 - first.0).filter(|way| way.length() > 1.0e-6);
        first.map(|(middle, normal, _)| (*middle, upright.or(between).unwrap_or(*normal)))
    };
    let missing = || names.refused("needs a ring of three points, or its axis".into());
    let (origin, along) = axis.and_then(|(at, along)| along.try_normalize().map(|along| (at, along))).ok_or_else(missing)?;
    let (first, last) = (places(&rings[0])[0], places(&rings[rings.len() - 1])[0]);
    let along = if along.dot(last - first) < 0.0 { -along } else { along };
    let begun = frame_about(along);
    let leans = if row.upright { 0 } else { 2 };
    let axis_of = move |numbers: &[f64]| {
        let at = origin + begun.col(0) * numbers[0] + begun.col(2) * numbers[1];
        let lean = if leans == 2 { begun.col(0) * numbers[2] + begun.col(2) * numbers[3] } else { DVec3::ZERO };
        (at, (along + lean) / (along + lean).length())
    };
    let place = move |numbers: &[f64], p: DVec3| {
        let (at, axis) = axis_of(numbers);
        let height = axis.dot(p - at);
        (height, (p - at - axis * height).length())
    };
    let mut numbers = vec![0.0; 2 + leans];
    for ring in &rings {
        let all: Vec<(f64, f64)> = places(ring).into_iter().map(|p| place(&numbers, p)).collect();
        let n = all.len() as f64;
        numbers.extend([all.iter().map(|p| p.0).sum::<f64>() / n, all.iter().map(|p| p.1).sum::<f64>() / n]);
    }
    let sights = sights(row, names)?;
    let mut witnesses: Vec<Witness> = Vec::new();
    for (index, ring) in rings.iter().enumerate() {
        let at = 2 + leans + 2 * index;
        for &point in ring {
            let height = move |numbers: &[f64], p: DVec3| place(numbers, p).0 - numbers[at];
            let radius = move |numbers: &[f64], p: DVec3| place(numbers, p).1 - numbers[at + 1];
            witnesses.push(Witness::On { point, off_m: Box::new(height) });
            witnesses.push(Witness::On { point, off_m: Box::new(radius) });
        }
    }
    for sight in &sights {
        for along in sight.rays {
            let (origin, focal_px) = (sight.origin, sight.focal_px);
            let off_px = move |numbers: &[f64]| {
                let profile = &numbers[2 + leans..];
                let reach_m = 2.0 * profile.chunks_exact(2).map(|ring| ring[1].abs()).fold(0.0, f64::max);
                let outside = |p: DVec3| {
                    let (height, distance) = place(numbers, p);
                    distance - radius_at(profile, height)
                };
                let (off_m, distance_m) = passes((origin, along), axis_of(numbers), reach_m, outside);
                off_m * focal_px / distance_m.abs().max(1.0e-6)
            };
            witnesses.push(Witness::Touches { edge: sight.edge, off_px: Box::new(off_px) });
        }
    }
    // each pixel of an outline tells one thing, each point of a ring beyond its first two
    let told = rings.iter().map(|ring| ring.len() - 1).sum::<usize>() * 2 + 2 * sights.len();
    let held = told >= 2 + leans;
    let solution = if held { fit(&witnesses, points, names.tolerance_m, numbers.clone()) } else { None };
    let mut notes = Vec::new();
    if solution.is_none() {
        if row.axis.is_none() {
            return Err(names.refused("is not held by what is marked: mark more points on its rings, or name its axis".into()));
        }
        notes.push("its axis is taken as named: rings have too few points to tell it better".into());
    }
    let numbers = solution.as_ref().map_or(numbers, |fit| fit.numbers.clone());
    let (at, axis) = axis_of(&numbers);
    let of_rings = &numbers[2 + leans..];
    let level = |ring: &[f64]| Level { height_m: ring[0], radius_m: ring[1].abs() };
    let levels: Vec<Level> = of_rings.chunks_exact(2).map(level).collect();
    let mut body = Body::default();
    body.turned(at, frame_about(axis), &levels, row.sides.unwrap_or(24), row.watertight);
    let sigma = |number: usize| solution.as_ref().map_or(f64::NAN, |fit| fit.sigmas[number]);
    let radius = |(index, level): (usize, &Level)| Measure {
        name: "ring_radius_m",
        value: level.radius_m,
        sigma: sigma(3 + leans + 2 * index),
    };
    let measures = levels.iter().enumerate().map(radius).collect();
    let mut fitted = names.fitted(body, &witnesses, points, &numbers, measures);
    fitted.notes = notes;
    Ok(fitted)
}
