//! Scale, north, level and origin: from the space that the photographs alone define to the world's.

use super::bundle::{DatumSlope, GAUGE};
use super::problem::{Alignment, Check, Problem};
use super::state::State;
use super::two_view::turn;
use crate::camera::Pose;
use glam::{DQuat, DVec3};
use nalgebra::SMatrix;

/// Up to how many points the middle of all of them is followed in the covariances; beyond, its own uncertainty is far below any point's.
const MOST_DATUM_POINTS: usize = 500;

/// World from model: p_world = scale R p_model + t.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Similarity {
    /// Positive.
    pub scale: f64,
    /// A unit quaternion.
    pub rotation: DQuat,
    /// In the world's unit.
    pub translation: DVec3,
}

impl Similarity {
    /// A point in the world.
    #[must_use]
    pub fn point(&self, p: DVec3) -> DVec3 {
        self.scale * (self.rotation * p) + self.translation
    }

    /// A camera's pose in the world; pictures stay what they are.
    #[must_use]
    pub fn pose(&self, pose: &Pose) -> Pose {
        Pose::from_centre((pose.rotation * self.rotation.conjugate()).normalize(), self.point(pose.centre()))
    }
}

/// What an alignment rests on, in words, with what contradicts it.
pub(super) struct Aligned {
    pub(super) similarity: Similarity,
    pub(super) alignment: Alignment,
    pub(super) notes: Vec<String>,
}

/// Aligns what is solved by all that is known.
pub(super) fn align(state: &State<'_>) -> Aligned {
    let problem = state.problem;
    let mut alignment = Alignment::default();
    let mut notes = Vec::new();
    let similarity = similarity(state, &state.points, Some((&mut alignment, &mut notes)));
    alignment.checks = checks(problem, &state.points, &similarity);
    Aligned { similarity, alignment, notes }
}

/// How the alignment of an already aligned state answers to each point it rests on.
pub(super) fn datum(state: &State<'_>) -> Vec<(usize, DatumSlope)> {
    let problem = state.problem;
    let mut rests: Vec<usize> = problem.distances.iter().flat_map(|d| d.between).collect();
    rests.extend(problem.directions.iter().flat_map(|d| d.between));
    rests.extend((0..problem.points.len()).filter(|p| problem.points[*p].ground || problem.points[*p].known_m.is_some()));
    // Without coordinates the origin is the middle of all points, and rests on each of them a little.
    if problem.points.iter().all(|p| p.known_m.is_none()) && problem.points.len() <= MOST_DATUM_POINTS {
        rests.extend(0..problem.points.len());
    }
    rests.sort_unstable();
    rests.dedup();
    let solved: Vec<DVec3> = state.points.iter().flatten().copied().collect();
    let middle = solved.iter().sum::<DVec3>() / solved.len().max(1) as f64;
    let size = solved.iter().map(|p| (*p - middle).length()).fold(0.0, f64::max);
    let h = 1e-5 * size;
    if !(h > 0.0) {
        return Vec::new();
    }
    let base = similarity(state, &state.points, None);
    let mut points = state.points.clone();
    let mut slopes = Vec::new();
    for point in rests {
        let Some(at) = state.points[point] else { continue };
        let mut slope = DatumSlope::zeros();
        for axis in 0..3 {
            let mut logarithm = |s: f64| {
                points[point] = Some(at + DVec3::AXES[axis] * s);
                let moved = logarithm(&similarity(state, &points, None), &base);
                points[point] = Some(at);
                moved
            };
            let (plus, minus) = (logarithm(h), logarithm(-h));
            for k in 0..GAUGE {
                slope[(k, axis)] = (plus[k] - minus[k]) / (2.0 * h);
            }
        }
        slopes.push((point, slope));
    }
    slopes
}

/// A similarity near another, relative to it: shift, turn vector, logarithm of scale.
fn logarithm(near: &Similarity, base: &Similarity) -> [f64; GAUGE] {
    let turned = near.rotation * base.rotation.conjugate();
    let turned = if turned.w < 0.0 { -turned } else { turned };
    let scale = near.scale / base.scale;
    let shift = near.translation - scale * (turned * base.translation);
    [shift.x, shift.y, shift.z, 2.0 * turned.x, 2.0 * turned.y, 2.0 * turned.z, libm::log(scale)]
}

type Said<'s> = Option<(&'s mut Alignment, &'s mut Vec<String>)>;

fn similarity(state: &State<'_>, points: &[Option<DVec3>], mut said: Said<'_>) -> Similarity {
    let problem = state.problem;
    if state.held.iter().any(|h| *h) && nothing_known(problem) {
        if let Some((_, notes)) = &mut said {
            notes.push("place, turn and scale of the whole are those of the cameras taken over".to_owned());
        }
        return Similarity { scale: 1.0, rotation: DQuat::IDENTITY, translation: DVec3::ZERO };
    }
    if state.placed {
        if let Some((alignment, _)) = &mut said {
            let from = Some("coordinates of points and parallel edges".to_owned());
            alignment.scale_from = from.clone();
            alignment.level_from = from.clone();
            alignment.north_from = from.clone();
            alignment.origin_from = from;
        }
        return Similarity { scale: 1.0, rotation: DQuat::IDENTITY, translation: DVec3::ZERO };
    }
    let known: Vec<(DVec3, DVec3)> = problem.points.iter().zip(points).filter_map(|(r, p)| Some(((*p)?, r.known_m?))).collect();
    if known.len() >= 3
        && is_spread(&known)
        && let Some(found) = fit_similarity(&known)
    {
        if let Some((alignment, notes)) = &mut said {
            let from = format!("the coordinates of {} points", known.len());
            alignment.scale_from = Some(from.clone());
            alignment.level_from = Some(from.clone());
            alignment.north_from = Some(from.clone());
            alignment.origin_from = Some(from);
            notes.extend(mirrored(&known, &found));
        }
        return found;
    }
    let scale = scale(problem, points, &known, &mut said);
    let rotation = rotation(state, points, &mut said);
    let turned = |p: DVec3| scale * (rotation * p);
    let translation = translation(problem, points, &known, &turned, &mut said);
    Similarity { scale, rotation, translation }
}

fn nothing_known(problem: &Problem) -> bool {
    let points = problem.points.iter().all(|p| p.known_m.is_none() && !p.ground);
    points && problem.distances.is_empty() && problem.directions.is_empty() && problem.edges.is_empty()
}

fn scale(problem: &Problem, points: &[Option<DVec3>], known: &[(DVec3, DVec3)], said: &mut Said<'_>) -> f64 {
    let pairs = problem.distances.iter().filter_map(|d| {
        let [a, b] = d.between.map(|p| points[p]);
        Some(((a? - b?).length(), d.metres))
    });
    let mut lengths: Vec<(f64, f64)> = pairs.collect();
    let distances = lengths.len();
    if let [first, rest @ ..] = known {
        lengths.extend(rest.iter().map(|other| ((first.0 - other.0).length(), (first.1 - other.1).length())));
    }
    let along: f64 = lengths.iter().map(|(model, metres)| model * metres).sum();
    let square: f64 = lengths.iter().map(|(model, _)| model * model).sum();
    let counted = lengths.len();
    let found = along / square;
    if counted == 0 || !(found > 0.0) || !found.is_finite() {
        if let Some((_, notes)) = said {
            let lost = problem.distances.len();
            let why = if lost > 0 { "; the ends of those given are not solved" } else { "" };
            notes.push(format!("the scale is not known, lengths are relative: give the distance of two marked points{why}"));
        }
        return 1.0;
    }
    if let Some((alignment, _)) = said {
        let words = if distances == 0 { "the coordinates of two points".to_owned() } else { plural(counted, "distance") };
        alignment.scale_from = Some(words);
    }
    found
}

fn plural(count: usize, thing: &str) -> String {
    if count == 1 { format!("one {thing}") } else { format!("{count} {thing}s") }
}

fn rotation(state: &State<'_>, points: &[Option<DVec3>], said: &mut Said<'_>) -> DQuat {
    let problem = state.problem;
    let (mut model, mut world): (Vec<DVec3>, Vec<DVec3>) = (Vec::new(), Vec::new());
    let mut level = Vec::new();
    let mut north = Vec::new();
    for d in &problem.directions {
        let (Some(a), Some(b)) = (points[d.between[0]], points[d.between[1]]) else { continue };
        let Some(along) = (b - a).try_normalize() else { continue };
        model.push(along);
        world.push(d.world);
        if d.world.y.abs() < 0.9 { north.push("directions") } else { level.push("directions") }
    }
    let ground: Vec<DVec3> = problem.points.iter().zip(points).filter(|(r, _)| r.ground).filter_map(|(_, p)| *p).collect();
    if let Some(up) = ground_normal(state, &ground) {
        model.push(up);
        world.push(DVec3::Y);
        level.push("ground points");
    }
    if let Some(frame) = state.frame {
        for axis in 0..3 {
            // Directions given say where north is; edges then say only what is level.
            let drawn = problem.edges.iter().any(|e| e.axis == axis && state.poses[e.photo].is_some());
            if drawn && (axis == 1 || north.is_empty()) {
                model.push(frame * DVec3::AXES[axis]);
                world.push(DVec3::AXES[axis]);
                if axis == 1 { level.push("parallel edges") } else { north.push("parallel edges") }
            }
        }
    }
    let mut guessed = false;
    if level.is_empty() && north.len() < 2 {
        let up = state.poses.iter().flatten().map(|p| p.rotation.conjugate() * DVec3::NEG_Y).sum::<DVec3>();
        if let Some(mut up) = up.try_normalize() {
            // What is known of the horizon stays exact.
            if let [along] = model[..] {
                up = (up - along * up.dot(along)).try_normalize().unwrap_or(up);
            }
            model.push(up);
            world.push(DVec3::Y);
            guessed = true;
        }
    }
    if let Some((alignment, notes)) = said {
        level.dedup();
        north.dedup();
        alignment.level_from = (!level.is_empty()).then(|| level.join(", "));
        alignment.north_from = (!north.is_empty()).then(|| north.join(", "));
        if guessed {
            notes.push(
                "what is level is guessed from how the photographs were held: mark ground points or upright edges".to_owned(),
            );
        }
        if north.is_empty() {
            notes.push("where north is was not said: give a direction between two marked points".to_owned());
        }
    }
    if let Some(matrix) = turn(&model, &world) {
        return DQuat::from_mat3(&matrix).normalize();
    }
    match (model.first(), world.first()) {
        (Some(from), Some(to)) => DQuat::from_rotation_arc(*from, *to),
        _ => DQuat::IDENTITY,
    }
}

/// The normal of the plane nearest to three or more points, on the cameras' side.
fn ground_normal(state: &State<'_>, ground: &[DVec3]) -> Option<DVec3> {
    if ground.len() < 3 {
        return None;
    }
    let middle = ground.iter().sum::<DVec3>() / ground.len() as f64;
    let mut moments = SMatrix::<f64, 3, 3>::zeros();
    for p in ground {
        let d = (*p - middle).to_array();
        for i in 0..3 {
            for j in 0..3 {
                moments[(i, j)] += d[i] * d[j];
            }
        }
    }
    let eigen = nalgebra::SymmetricEigen::try_new(moments, f64::EPSILON, 1000)?;
    let mut order = [0, 1, 2];
    order.sort_by(|a, b| eigen.eigenvalues[*a].total_cmp(&eigen.eigenvalues[*b]));
    // Points on one line leave the plane to chance.
    if eigen.eigenvalues[order[1]] < 1e-4 * eigen.eigenvalues[order[2]] {
        return None;
    }
    let normal = DVec3::from_array(std::array::from_fn(|i| eigen.eigenvectors[(i, order[0])])).try_normalize()?;
    let above: f64 = state.poses.iter().flatten().map(|p| (p.centre() - middle).dot(normal)).sum();
    Some(if above < 0.0 { -normal } else { normal })
}

fn translation(
    problem: &Problem,
    points: &[Option<DVec3>],
    known: &[(DVec3, DVec3)],
    turned: &dyn Fn(DVec3) -> DVec3,
    said: &mut Said<'_>,
) -> DVec3 {
    if !known.is_empty() {
        if let Some((alignment, _)) = said {
            alignment.origin_from = Some(format!("the coordinates of {}", plural(known.len(), "point")));
        }
        return known.iter().map(|(model, world)| *world - turned(*model)).sum::<DVec3>() / known.len() as f64;
    }
    let solved: Vec<DVec3> = points.iter().flatten().map(|p| turned(*p)).collect();
    let middle = solved.iter().sum::<DVec3>() / solved.len().max(1) as f64;
    let ground: Vec<f64> =
        problem.points.iter().zip(points).filter(|(r, _)| r.ground).filter_map(|(_, p)| p.map(|p| turned(p).y)).collect();
    let height = if ground.is_empty() { middle.y } else { ground.iter().sum::<f64>() / ground.len() as f64 };
    if let Some((alignment, _)) = said {
        let of = if ground.is_empty() { "" } else { ", height from ground points" };
        alignment.origin_from = Some(format!("the middle of all points{of}"));
    }
    -DVec3::new(middle.x, height, middle.z)
}

/// Points that are not all on one line.
fn is_spread(known: &[(DVec3, DVec3)]) -> bool {
    let Some((_, first)) = known.first() else { return false };
    let Some(far) = known.iter().map(|k| k.1 - *first).max_by(|a, b| a.length_squared().total_cmp(&b.length_squared())) else {
        return false;
    };
    known.iter().any(|k| (k.1 - *first).cross(far).length() > 1e-3 * far.length_squared())
}

/// The similarity that takes the first of every pair nearest to the second.
///
/// S. Umeyama: Least-squares estimation of transformation parameters between two point patterns, IEEE PAMI 13(4), 1991.
///
/// `None` where the points lie on one line or in one place.
#[must_use]
pub fn fit_similarity(pairs: &[(DVec3, DVec3)]) -> Option<Similarity> {
    let n = pairs.len() as f64;
    let model = pairs.iter().map(|p| p.0).sum::<DVec3>() / n;
    let world = pairs.iter().map(|p| p.1).sum::<DVec3>() / n;
    let (a, b): (Vec<DVec3>, Vec<DVec3>) = pairs.iter().map(|p| (p.0 - model, p.1 - world)).unzip();
    let matrix = turn(&a, &b)?;
    let rotation = DQuat::from_mat3(&matrix).normalize();
    let along: f64 = a.iter().zip(&b).map(|(x, y)| (rotation * *x).dot(*y)).sum();
    let square: f64 = a.iter().map(|x| x.length_squared()).sum();
    let scale = along / square;
    (scale > 0.0 && scale.is_finite()).then(|| Similarity { scale, rotation, translation: world - scale * (rotation * model) })
}

/// A word where the coordinates' mirror image fits much better.
fn mirrored(known: &[(DVec3, DVec3)], found: &Similarity) -> Option<String> {
    let error = |s: &Similarity, flip: f64| {
        let flipped = |p: DVec3| DVec3::new(p.x * flip, p.y, p.z);
        known.iter().map(|(m, w)| (s.point(*m) - flipped(*w)).length_squared()).sum::<f64>()
    };
    let flipped: Vec<(DVec3, DVec3)> = known.iter().map(|(m, w)| (*m, DVec3::new(-w.x, w.y, w.z))).collect();
    let other = fit_similarity(&flipped)?;
    (known.len() >= 4 && error(&other, -1.0) < 0.05 * error(found, 1.0)).then(|| {
        "the known coordinates fit only as in a mirror: one of their axes points the wrong way (+X east, +Y up, -Z north)"
            .to_owned()
    })
}

fn checks(problem: &Problem, points: &[Option<DVec3>], similarity: &Similarity) -> Vec<Check> {
    let at = |p: usize| points[p].map(|p| similarity.point(p));
    let name = |p: usize| &problem.points[p].name;
    let mut all = Vec::new();
    for d in &problem.distances {
        if let (Some(a), Some(b)) = (at(d.between[0]), at(d.between[1])) {
            let what = format!("distance {} - {}", name(d.between[0]), name(d.between[1]));
            all.push(Check { what, off: (a - b).length() - d.metres, unit: "m" });
        }
    }
    for d in &problem.directions {
        if let (Some(a), Some(b)) = (at(d.between[0]), at(d.between[1])) {
            let what = format!("direction {} - {}", name(d.between[0]), name(d.between[1]));
            let off = libm::atan2((b - a).cross(d.world).length(), (b - a).dot(d.world)).to_degrees();
            all.push(Check { what, off, unit: "deg" });
        }
    }
    for (index, point) in problem.points.iter().enumerate() {
        let Some(found) = at(index) else { continue };
        if let Some(known) = point.known_m {
            all.push(Check { what: format!("coordinates of {}", point.name), off: (found - known).length(), unit: "m" });
        } else if point.ground {
            all.push(Check { what: format!("height of {}", point.name), off: found.y, unit: "m" });
        }
    }
    all
}

/// Carries a state over into the world.
pub(super) fn carry(state: &mut State<'_>, similarity: &Similarity) {
    // What is already in place keeps its last digit.
    if *similarity == (Similarity { scale: 1.0, rotation: DQuat::IDENTITY, translation: DVec3::ZERO }) {
        return;
    }
    for point in state.points.iter_mut().flatten() {
        *point = similarity.point(*point);
    }
    for pose in state.poses.iter_mut().flatten() {
        *pose = similarity.pose(pose);
    }
    state.frame = state.frame.map(|f| (similarity.rotation * f).normalize());
}
