//! Wrong marks, found by what the solution would be without them.
//!
//! W. Baarda: A testing procedure for use in geodetic networks, 1968 (data snooping): a residual is judged by its own standard deviation, which
//! is smaller the more the solution follows that mark, so that a wrong mark in a weak place is found although it hardly shows. The worst goes,
//! the rest is solved again, and what fits then comes back.

use super::bundle::{Inverse, Loss};
use super::problem::MarkResult;
use super::state::State;
use glam::{DMat2, DVec2};

/// How often marks are taken out and solved again.
const MOST_ROUNDS: usize = 60;

/// Redundancy below which a mark cannot be judged: the solution follows it nearly all the way.
const LEAST_REDUNDANCY: f64 = 0.02;

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
}

/// Adjusts, takes wrong marks out and lets right ones in until neither is left.
pub(super) fn cleaned(state: &mut State<'_>) -> Judged {
    let problem = state.problem;
    let mut sigma_px = state.params.mark_sigma_px;
    // A mark that came back once and was thrown out again stays out: otherwise two could take turns.
    let mut thrown = vec![0u8; problem.marks.len()];
    let mut loss = Loss::Cauchy(3.0);
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
        // Few marks tell their spread badly, and a lucky fit must not condemn honest marks.
        sigma_px = spread_px(&pairs).unwrap_or(declared).max(0.5 * declared);
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
            // Half way to the limit, so that what comes in does not go out in the next round.
            if judged(picture - mark.pixel, covariance).is_some_and(|v| v < 0.5 * limit) {
                state.used[m] = true;
                changed = true;
            }
        }
        drop_lonely(state);
        if !changed && loss == Loss::Squared {
            break;
        }
        if !changed {
            loss = Loss::Squared;
        }
    }
    let marks = (0..problem.marks.len()).map(|m| result(state, m)).collect();
    Judged { marks, sigma_px }
}

/// A point that one mark is left of has no depth.
fn drop_lonely(state: &mut State<'_>) {
    for point in 0..state.points.len() {
        if state.points[point].is_some() && state.marks_of[point].iter().filter(|m| state.used[**m]).count() < 2 {
            state.points[point] = None;
            state.marks_of[point].iter().for_each(|m| state.used[*m] = false);
        }
    }
}

fn result(state: &State<'_>, m: usize) -> MarkResult {
    let mark = state.problem.marks[m];
    let (Some(camera), Some(position)) = (state.camera(mark.photo), state.points[mark.point]) else { return MarkResult::Idle };
    let Some(picture) = camera.project(position) else { return MarkResult::Idle };
    let off = picture - mark.pixel;
    if state.used[m] { MarkResult::Used(off) } else { MarkResult::Wrong(off) }
}
