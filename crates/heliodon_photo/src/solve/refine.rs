//! Cameras that another program made of automatic matches, adjusted once more.
//!
//! A matcher's marks are many, and wrong ones are told by their mass: they need not be sought one by one as a hand's are ([`super::solve`]).
//! What is left has tails, since features found in small copies of a photograph are placed as coarsely as those copies are: the loss stays
//! Cauchy's to the end, which costs 5 % of the precision where the noise is normal (P. J. Huber: Robust Statistics, 1981) and hardly follows
//! the tails where it is not.

use super::bundle::{self, Free, Loss};
use super::parallax;
use super::problem::{MarkResult, Params, Problem, Solution};
use super::state::State;
use super::wrong::{Judged, drop_lonely, result};
use crate::camera::{Intrinsics, Pose};
use glam::DVec3;

/// Cauchy's scale, in standard deviations, at which 95 % of the precision are left where the noise is normal.
const CAUCHY_SIGMAS: f64 = 2.385;

/// How often the noise is estimated anew and marks are judged by it: the first two with part of the lens free; after two or three more nothing
/// changes.
const ROUNDS: usize = 6;

/// What the adjustment starts from.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Start {
    /// Of every lens of the problem.
    pub lenses: Vec<Intrinsics>,
    /// Of every photograph, where it has a camera.
    pub poses: Vec<Option<Pose>>,
    /// Of every point, where it has a place.
    pub points: Vec<Option<DVec3>>,
}

/// Adjusts cameras, lenses and points together, robustly against marks that are wrong, and tells how sure all of it is. What has no place to
/// start from stays without one. Two photographs keep their lenses: they tell focal lengths badly.
///
/// # Panics
/// Where `start` is not as long as the problem, or a mark names a photograph or a point that is not there.
#[must_use]
pub fn refine(problem: &Problem, start: &Start, params: &Params) -> Solution {
    let lengths = [start.lenses.len(), start.poses.len(), start.points.len()];
    assert_eq!(lengths, [problem.lenses.len(), problem.photos.len(), problem.points.len()], "a start for all of the problem");
    let mut state = State::new(problem, *params);
    state.lenses.clone_from(&start.lenses);
    state.poses.clone_from(&start.poses);
    state.points.clone_from(&start.points);
    state.met.fill(true);
    state.used.fill(true);
    let judged = settled(&mut state);
    super::finish(state, judged, None, Vec::new())
}

fn settled(state: &mut State<'_>) -> Judged {
    let declared = state.params.mark_sigma_px;
    let mut sigma_px = declared;
    let alone = state.poses.iter().flatten().count() < 3;
    for round in 0..ROUNDS {
        drop_weak(state);
        // From a lens that was guessed, all of it at once may end in a valley where centre and distortion make up for each other.
        let freed = |free: Free| match round {
            _ if alone => Free::default(),
            0 => Free { focal: free.focal, ..Free::default() },
            1 => Free { radial: 0, tangential: false, ..free },
            _ => free,
        };
        let mut extract = state.extract(false);
        extract.network.lenses.iter_mut().for_each(|lens| lens.free = freed(lens.free));
        let loss = Loss::Cauchy(CAUCHY_SIGMAS * sigma_px / declared);
        bundle::adjust(&mut extract.network, &bundle::Params { loss, ..bundle::Params::default() });
        state.take(&extract);
        let off: Vec<Option<f64>> = (0..state.problem.marks.len())
            .map(|m| match result(state, m) {
                MarkResult::Used(off) | MarkResult::Wrong(off) => Some(off.length()),
                MarkResult::Idle => None,
            })
            .collect();
        let Some(spread) = spread_px(state, &off) else { break };
        sigma_px = spread;
        for (used, off) in state.used.iter_mut().zip(off) {
            *used = off.is_some_and(|off| off < state.params.wrong_from * sigma_px);
        }
    }
    drop_weak(state);
    let marks = (0..state.problem.marks.len()).map(|m| result(state, m)).collect();
    Judged { marks, sigma_px, notes: Vec::new() }
}

/// Leaves points out that one mark is left of, or whose marks see them from one place: they have no depth, and with one of them nothing's
/// uncertainty could be told.
fn drop_weak(state: &mut State<'_>) {
    drop_lonely(state);
    for point in 0..state.points.len() {
        if state.points[point].is_some() && !(parallax(state, point) >= 0.5 * state.params.min_parallax_rad) {
            state.points[point] = None;
            state.marks_of[point].iter().for_each(|m| state.used[*m] = false);
        }
    }
}

/// The standard deviation of a mark's coordinate, by the median distance, which a third of wrong marks hardly moves.
fn spread_px(state: &State<'_>, off: &[Option<f64>]) -> Option<f64> {
    let mut squares: Vec<f64> =
        off.iter().zip(&state.used).filter(|(_, used)| **used).filter_map(|(off, _)| *off).map(|o| o * o).collect();
    if squares.is_empty() {
        return None;
    }
    squares.sort_by(f64::total_cmp);
    let count = 2.0 * squares.len() as f64;
    let unknowns = 3 * state.points.iter().flatten().count() + 6 * state.poses.iter().flatten().count();
    // The solution follows its marks: what is left of the noise is as much as they outnumber the unknowns. At least a tenth, since a network
    // without redundancy shows no noise at all.
    let left = (1.0 - unknowns as f64 / count).max(0.1);
    // The median of a chi squared distribution of two degrees of freedom is 2 ln 2.
    Some((squares[squares.len() / 2] / (2.0 * std::f64::consts::LN_2) / left).sqrt())
}
