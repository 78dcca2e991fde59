//! Wrong marks, found by what the solution would be without them.
//!
//! W. Baarda: A testing procedure for use in geodetic networks, 1968 (data snooping): a residual is judged by its own standard deviation, which
//! is smaller the more the solution follows that mark, so that a wrong mark in a weak place is found although it hardly shows. The worst goes,
//! the rest is solved again, and what fits then comes back.

use super::bundle::{Inverse, Loss, Segment, off_line};
use super::problem::MarkResult;
use super::resect;
use super::state::State;
use super::triangulate::{self, Found, Gate};
use crate::camera::Camera;
use glam::{DMat2, DVec2, DVec3};

/// How many standard deviations of a mark an edge's end may lie off its line: stone is less straight than a mark is sharp.
const WRONG_EDGE: f64 = 20.0;

/// How many reaches a mark must be off before the point that it speaks for is another one.
const FAR_OFF: f64 = 4.0;

/// How often photographs and points are sought anew with the final reach.
const MOST_REVISIONS: usize = 3;

/// How often marks are taken out and solved again.
const MOST_ROUNDS: usize = 60;

/// Redundancy below which a mark cannot be judged: the solution follows it nearly all the way.
const LEAST_REDUNDANCY: f64 = 0.02;

/// Photographs with more marks come from a matcher, whose wrong ones are many and single ones do not decide.
const MOST_REVISED: usize = 2000;

/// The residuals' own standard deviation, robust against those that are wrong.
pub(super) fn spread_px(residuals: &[(DVec2, DMat2)]) -> Option<f64> {
    // r^T (I - H)^-1 r / sigma^2 has two degrees of freedom, its median is 2 ln 2
    let mut squares: Vec<f64> = residuals.iter().filter_map(|(r, h)| judged(*r, DMat2::IDENTITY - *h)).collect();
    if squares.is_empty() {
        return None;
    }
    squares.sort_by(f64::total_cmp);
    Some((squares[squares.len() / 2] / (2.0 * std::f64::consts::LN_2)).sqrt())
}

/// r^T C^-1 r; `None` where C says nothing.
fn judged(residual: DVec2, covariance: DMat2) -> Option<f64> {
    let trace = covariance.x_axis.x + covariance.y_axis.y;
    let determinant = covariance.determinant();
    if !(determinant > 0.0) || determinant / trace < LEAST_REDUNDANCY {
        return None;
    }
    let value = residual.dot(covariance.inverse() * residual);
    value.is_finite().then_some(value)
}

/// What the wrong marks leave.
pub(super) struct Judged {
    pub(super) marks: Vec<MarkResult>,
    pub(super) sigma_px: f64,
    /// Edges that were left out, in words.
    pub(super) notes: Vec<String>,
}

/// Adjusts, takes wrong marks out and lets right ones in until neither is left.
pub(super) fn cleaned(state: &mut State<'_>) -> Judged {
    let problem = state.problem;
    let mut sigma_px = state.params.mark_sigma_px;
    // A mark that came back once and was thrown out again stays out: otherwise two could take turns.
    let mut thrown = vec![0u8; problem.marks.len()];
    let mut loss = Loss::Cauchy(3.0);
    let mut revisions = 0;
    let mut notes = Vec::new();
    for _ in 0..MOST_ROUNDS {
        let hold = state.poses.iter().flatten().count() < 3;
        state.adjust(hold, loss, 100);
        let extract = state.extract(hold);
        let Some(inverse) = Inverse::of(&extract.network) else { break };
        let declared = state.params.mark_sigma_px;
        let mut used = Vec::new();
        for (o, &m) in extract.network.observations.iter().zip(&extract.marks) {
            let Some(residual) = extract.network.residual_px(o) else { continue };
            let Some(h) = inverse.picture(o.view, o.point) else { continue };
            used.push((m, residual, h * (1.0 / (declared * declared))));
        }
        let pairs: Vec<(DVec2, DMat2)> = used.iter().map(|(_, r, h)| (*r, *h)).collect();
        sigma_px = spread_px(&pairs).unwrap_or(declared).max(state.params.least_sigma_px);
        let limit = state.params.wrong_from * state.params.wrong_from * sigma_px * sigma_px;
        let mut suspects: Vec<(f64, usize)> = used
            .iter()
            .filter_map(|(m, r, h)| judged(*r, DMat2::IDENTITY - *h).map(|v| (v, *m)))
            .filter(|(v, _)| *v > limit)
            .collect();
        suspects.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let mut changed = false;
        // A wrong mark spoils its neighbours' residuals: one of a point and of a photograph at a time.
        let (mut points, mut photos) = (Vec::new(), Vec::new());
        for (_, m) in suspects {
            let mark = problem.marks[m];
            if points.contains(&mark.point) || photos.contains(&mark.photo) {
                continue;
            }
            points.push(mark.point);
            photos.push(mark.photo);
            state.used[m] = false;
            thrown[m] = thrown[m].saturating_add(1);
            changed = true;
        }
        let view_of = |photo: usize| extract.views.iter().position(|v| *v == photo);
        let point_of = |point: usize| extract.points.binary_search(&point).ok();
        for (m, mark) in problem.marks.iter().enumerate() {
            if state.used[m] || thrown[m] > 1 || points.contains(&mark.point) {
                continue;
            }
            let (Some(view), Some(point)) = (view_of(mark.photo), point_of(mark.point)) else { continue };
            let Some(picture) = extract.network.camera(view).project(extract.network.points[point].position) else { continue };
            let Some(h) = inverse.picture(view, point) else { continue };
            let covariance = DMat2::IDENTITY + h * (1.0 / (declared * declared));
            // Short of the limit, so that what comes in does not go out in the next round.
            if judged(picture - mark.pixel, covariance).is_some_and(|v| v < 0.85 * limit) {
                state.used[m] = true;
                changed = true;
            }
        }
        drop_lonely(state);
        if changed {
            continue;
        }
        let before = notes.len();
        drop_edges(state, &mut notes);
        if notes.len() > before {
            continue;
        }
        if revisions < MOST_REVISIONS && revise(state, state.params.wrong_from * sigma_px) {
            revisions += 1;
            loss = Loss::Cauchy(3.0);
            thrown.fill(0);
        } else if loss == Loss::Squared {
            // What goes had pulled at its photographs.
            if !drop_ambiguous(state, state.params.wrong_from * sigma_px) {
                break;
            }
        } else {
            loss = Loss::Squared;
            thrown.fill(0);
        }
    }
    let marks = (0..problem.marks.len()).map(|m| result(state, m)).collect();
    Judged { marks, sigma_px, notes }
}

/// Seeks every photograph and every point anew from the others, now that lenses are known and the reach is narrow. A photograph that was first
/// placed by a wrong mark would otherwise throw out its right ones one by one. True where anything is better now.
fn revise(state: &mut State<'_>, reach_px: f64) -> bool {
    let problem = state.problem;
    let mut better = false;
    let mut of_photo: Vec<Vec<usize>> = vec![Vec::new(); problem.photos.len()];
    for (m, mark) in problem.marks.iter().enumerate().filter(|(_, mark)| mark.pixel.is_finite()) {
        of_photo[mark.photo].push(m);
    }
    for (photo, marks) in of_photo.iter().enumerate() {
        let Some(camera) = state.camera(photo) else { continue };
        if marks.iter().all(|m| state.used[*m]) || marks.len() > MOST_REVISED {
            continue;
        }
        // Points as the other photographs see them: those that this one shares with few have followed it.
        let apart: Vec<(usize, DVec3)> = marks
            .iter()
            .filter_map(|&m| sought(state, problem.marks[m].point, reach_px, Some(photo)).map(|(_, f)| (m, f.position)))
            .collect();
        let now = apart.iter().filter(|(m, at)| {
            let off = camera.project(*at).map_or(f64::INFINITY, |p| (p - problem.marks[*m].pixel).length());
            off < reach_px
        });
        let now = now.count();
        let (world, pixels): (Vec<DVec3>, Vec<DVec2>) = apart.iter().map(|(m, at)| (*at, problem.marks[*m].pixel)).unzip();
        let seed = state.params.seed ^ 0x7265_7669_7365 ^ photo as u64;
        let found = resect::robustly(&camera.intrinsics, &world, &pixels, reach_px, state.params.rounds, seed);
        let Some(found) = found.filter(|f| f.count() > now) else { continue };
        marks.iter().for_each(|m| state.used[*m] = false);
        state.poses[photo] = Some(found.camera.pose);
        for ((m, at), agrees) in apart.iter().zip(found.agrees) {
            state.used[*m] = agrees;
            if agrees {
                state.points[problem.marks[*m].point] = Some(*at);
            }
        }
        better = true;
    }
    for point in 0..state.points.len() {
        let now = state.marks_of[point].iter().filter(|m| state.used[**m]).count();
        let Some((seen, found)) = sought(state, point, reach_px, None) else { continue };
        if found.agrees.iter().filter(|a| **a).count() > now {
            state.points[point] = Some(found.position);
            for (m, agrees) in seen.iter().zip(found.agrees) {
                state.used[*m] = agrees;
            }
            better = true;
        }
    }
    better
}

fn sought(state: &State<'_>, point: usize, reach_px: f64, without: Option<usize>) -> Option<(Vec<usize>, Found)> {
    let marks = &state.problem.marks;
    let (seen, cameras): (Vec<usize>, Vec<Camera>) =
        (state.marks_of[point].iter().filter(|m| Some(marks[**m].photo) != without))
            .filter_map(|&m| state.camera(marks[m].photo).map(|c| (m, c)))
            .unzip();
    let pixels: Vec<DVec2> = seen.iter().map(|m| marks[*m].pixel).collect();
    let gate = Gate { reach_px, min_parallax_rad: 0.5 * state.params.min_parallax_rad };
    triangulate::robustly(&cameras, &pixels, gate).map(|found| (seen, found))
}

/// Points whose marks agree in two ways cannot be told from points made of wrong marks. True where there are any.
fn drop_ambiguous(state: &mut State<'_>, reach_px: f64) -> bool {
    let mut dropped = false;
    for point in 0..state.points.len() {
        let used = state.marks_of[point].iter().filter(|m| state.used[**m]).count();
        if state.points[point].is_none() || used == state.marks_of[point].len() || used > 4 {
            continue;
        }
        // A rival is as large and has a mark that is far off now: of marks that differ little any choice is nearly right.
        let far_off = |m: usize| match result(state, m) {
            MarkResult::Wrong(off) => off.length() > FAR_OFF * reach_px,
            _ => false,
        };
        let rivals = |(seen, found): (Vec<usize>, Found)| {
            found.sets.iter().any(|set| {
                let left_out = set.iter().zip(&seen).any(|(agrees, m)| *agrees && far_off(*m));
                left_out && set.iter().filter(|a| **a).count() >= used
            })
        };
        if sought(state, point, reach_px, None).is_none_or(rivals) {
            state.points[point] = None;
            state.ambiguous[point] = true;
            state.marks_of[point].iter().for_each(|m| state.used[*m] = false);
            dropped = true;
        }
    }
    dropped
}

/// Takes edges out that miss their vanishing point by far: drawn along another axis, or not straight.
fn drop_edges(state: &mut State<'_>, notes: &mut Vec<String>) {
    let Some(frame) = state.frame else { return };
    for (index, edge) in state.problem.edges.iter().enumerate() {
        let Some(camera) = state.camera(edge.photo).filter(|_| state.edges_used[index]) else { continue };
        let segment = Segment { view: 0, axis: DVec3::AXES[edge.axis], ends: edge.ends, weight: 1.0 };
        let off = off_line(&camera.intrinsics, &segment, camera.pose.rotation * (frame * segment.axis)).abs();
        if off > WRONG_EDGE * state.params.mark_sigma_px {
            state.edges_used[index] = false;
            let (axis, photo) = (["x", "y", "z"][edge.axis], &state.problem.photos[edge.photo].name);
            let [x, y] = edge.ends[0].to_array();
            notes.push(format!(
                "an edge along {axis} in {photo}, from ({x:.0}, {y:.0}), misses its direction by {off:.0} px and was left out"
            ));
        }
    }
}

/// A point that one mark is left of has no depth.
pub(super) fn drop_lonely(state: &mut State<'_>) {
    for point in 0..state.points.len() {
        if state.points[point].is_some() && state.marks_of[point].iter().filter(|m| state.used[**m]).count() < 2 {
            state.points[point] = None;
            state.marks_of[point].iter().for_each(|m| state.used[*m] = false);
        }
    }
}

pub(super) fn result(state: &State<'_>, m: usize) -> MarkResult {
    let mark = state.problem.marks[m];
    let (Some(camera), Some(position)) = (state.camera(mark.photo), state.points[mark.point]) else { return MarkResult::Idle };
    let Some(picture) = camera.project(position) else { return MarkResult::Idle };
    let off = picture - mark.pixel;
    if state.used[m] { MarkResult::Used(off) } else { MarkResult::Wrong(off) }
}
