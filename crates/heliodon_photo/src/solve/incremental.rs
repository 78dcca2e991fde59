//! From a first pair of photographs to all of them.

use super::bundle::Loss;
use super::problem::{Focal, Problem};
use super::resect;
use super::state::{State, focal_candidates, with_focal};
use super::two_view::{self, Pair};
use crate::camera::Pose;
use glam::{DQuat, DVec2, DVec3};
use rayon::prelude::*;

/// Points that two photographs must share to be a start, and that a photograph must share with what is solved. Three give four poses and a
/// fourth chooses; the fifth says whether the choice is right.
pub(super) const LEAST_SHARED: usize = 5;

/// How many starts are followed to their end before the best is taken.
const STARTS: usize = 6;

/// What part of a pair's points one plane may explain before an unknown focal length is called undetermined.
const PLANAR: f64 = 0.95;

/// Two photographs that could be a start.
#[derive(Clone, Debug)]
pub(super) struct Start {
    pub(super) photos: [usize; 2],
    focal_px: [f64; 2],
    pair: Pair,
    score: f64,
}

/// Why pairs of photographs are no start.
#[derive(Clone, Debug, Default)]
pub(super) struct Refusals {
    pub(super) few: usize,
    pub(super) most_shared: usize,
    pub(super) planar: Vec<[usize; 2]>,
    pub(super) turned: Vec<[usize; 2]>,
    pub(super) wrong: usize,
}

/// Pairs that could be a start, the best first.
pub(super) fn starts(state: &State<'_>) -> (Vec<Start>, Refusals) {
    let problem = state.problem;
    let mut by_photo: Vec<Vec<(usize, DVec2)>> = vec![Vec::new(); problem.photos.len()];
    for mark in problem.marks.iter().filter(|m| m.pixel.is_finite()) {
        by_photo[mark.photo].push((mark.point, mark.pixel));
    }
    by_photo.iter_mut().for_each(|m| m.sort_by_key(|(point, _)| *point));
    let pairs: Vec<[usize; 2]> = (0..by_photo.len()).flat_map(|a| (a + 1..by_photo.len()).map(move |b| [a, b])).collect();
    let tried: Vec<(Vec<Start>, Refusals)> = pairs.par_iter().map(|pair| try_pair(state, &by_photo, *pair)).collect();
    let (mut all, mut refusals) = (Vec::new(), Refusals::default());
    for (starts, refused) in tried {
        all.extend(starts);
        refusals.few += refused.few;
        refusals.wrong += refused.wrong;
        refusals.most_shared = refusals.most_shared.max(refused.most_shared);
        refusals.planar.extend(refused.planar);
        refusals.turned.extend(refused.turned);
    }
    all.sort_by(|a, b| b.score.total_cmp(&a.score));
    (all, refusals)
}

fn common(a: &[(usize, DVec2)], b: &[(usize, DVec2)]) -> Vec<(DVec2, DVec2)> {
    let find = |(point, pixel): &(usize, DVec2)| b.binary_search_by_key(point, |(p, _)| *p).ok().map(|at| (*pixel, b[at].1));
    a.iter().filter_map(find).collect()
}

fn try_pair(state: &State<'_>, by_photo: &[Vec<(usize, DVec2)>], photos: [usize; 2]) -> (Vec<Start>, Refusals) {
    let problem = state.problem;
    let mut refusals = Refusals::default();
    let shared = common(&by_photo[photos[0]], &by_photo[photos[1]]);
    refusals.most_shared = shared.len();
    if shared.len() <= LEAST_SHARED {
        refusals.few = 1;
        return (Vec::new(), refusals);
    }
    let groups = photos.map(|p| problem.photos[p].lens);
    let unknown = groups.map(|g| state.problem.lenses[g].focal == Focal::Free && !state.met[g]);
    let options = groups.map(|g| {
        let lens = &state.lenses[g];
        if state.met[g] { vec![lens.focal_px[0]] } else { focal_candidates(&problem.lenses[g].focal, lens, state.doubts_exif) }
    });
    // Of two unknown lenses, the same guess for both: all combinations would be many, and the adjustment tells them apart.
    let tries = options[0].len().max(options[1].len());
    let mut found: Vec<Start> = Vec::new();
    for t in 0..tries {
        let focal_px = [0, 1].map(|k| options[k][t.min(options[k].len() - 1)]);
        let lenses = [0, 1].map(|k| with_focal(&state.lenses[groups[k]], focal_px[k]));
        let direction =
            |lens: usize, pixel: DVec2| lenses[lens].unproject(pixel).map(|p| p.extend(1.0)).map(|p| p / p.length());
        let (first, second): (Vec<DVec3>, Vec<DVec3>) =
            shared.iter().filter_map(|(a, b)| Some((direction(0, *a)?, direction(1, *b)?))).unzip();
        let reach_rad = state.reach_px(groups[0]) / focal_px[0].max(focal_px[1]);
        let seed = state.params.seed ^ ((photos[0] as u64) << 32 | photos[1] as u64);
        // Distances to epipolar planes leave half of the noise unseen; the reach is halved for them.
        let Some(pair) = two_view::relate(&first, &second, 0.5 * reach_rad, state.params.rounds, seed) else { continue };
        if pair.turned > PLANAR || pair.parallax_rad < state.params.min_parallax_rad {
            refusals.turned.push(photos);
            continue;
        }
        if pair.planar > PLANAR && unknown.iter().any(|u| *u) {
            refusals.planar.push(photos);
            continue;
        }
        // Wide baselines fix depths, but beyond 30 degrees they add little and fewer marks agree.
        let parallax = (pair.parallax_rad / 0.5).min(1.0);
        let plane = if pair.planar > PLANAR { 0.5 } else { 1.0 };
        let score = pair.count() as f64 * parallax.sqrt() * plane;
        found.push(Start { photos, focal_px, pair, score });
    }
    if found.is_empty() && refusals.planar.is_empty() && refusals.turned.is_empty() {
        refusals.wrong = 1;
    }
    refusals.planar.dedup();
    refusals.turned.dedup();
    // Of one pair the two focal lengths that fit best: two photographs alone tell them badly.
    found.sort_by(|a, b| b.score.total_cmp(&a.score));
    found.truncate(2);
    (found, refusals)
}

/// Follows the best starts to their ends and keeps the one that explains most marks.
pub(super) fn best_of<'a>(state: &State<'a>, starts: &[Start]) -> Option<State<'a>> {
    let mut firsts: Vec<&Start> = Vec::new();
    // different pairs before the same pair at another focal length
    let mut seen: Vec<[usize; 2]> = Vec::new();
    for start in starts {
        if !seen.contains(&start.photos) {
            seen.push(start.photos);
            firsts.push(start);
        }
        if firsts.len() == STARTS - 2 {
            break;
        }
    }
    firsts.extend(starts.iter().filter(|s| firsts.iter().all(|f| !std::ptr::eq(*f, *s))).take(2).collect::<Vec<_>>());
    let ends: Vec<State<'a>> = firsts.par_iter().filter_map(|start| follow(state.clone(), start)).collect();
    let mut best: Option<State<'a>> = None;
    for end in ends {
        if best.as_ref().is_none_or(|b| end.rank() > b.rank()) {
            best = Some(end);
        }
    }
    best
}

fn follow<'a>(mut state: State<'a>, start: &Start) -> Option<State<'a>> {
    let [a, b] = start.photos;
    state.poses[a] = Some(Pose { rotation: DQuat::IDENTITY, translation: DVec3::ZERO });
    state.poses[b] = Some(start.pair.second_from_first);
    for k in 0..2 {
        let lens = state.problem.photos[start.photos[k]].lens;
        state.lenses[lens] = with_focal(&state.lenses[lens], start.focal_px[k]);
        state.met[lens] = true;
    }
    state.triangulate();
    state.adjust(true, Loss::Cauchy(2.0), 50);
    state.triangulate();
    if state.points.iter().flatten().count() < LEAST_SHARED {
        return None;
    }
    grow(&mut state);
    Some(state)
}

/// Adds photographs, the best connected first, until none is left that shares enough.
pub(super) fn grow(state: &mut State<'_>) {
    let mut refused: Vec<usize> = Vec::new();
    loop {
        let mut waiting: Vec<(usize, usize)> =
            state.waiting().into_iter().filter(|(p, n)| *n >= LEAST_SHARED && !refused.contains(p)).collect();
        waiting.sort_by_key(|(photo, shared)| (std::cmp::Reverse(*shared), *photo));
        let Some(&(photo, _)) = waiting.first() else { break };
        if add(state, photo) {
            settle(state, 20);
            // what did not fit before may fit now
            refused.clear();
        } else {
            refused.push(photo);
        }
    }
    settle(state, 100);
}

/// Adjusts, finds the points anew, adjusts.
pub(super) fn settle(state: &mut State<'_>, max_steps: usize) {
    let alone = state.poses.iter().flatten().count() < 3;
    for _ in 0..2 {
        state.triangulate();
        // Two photographs tell a focal length badly: it waits for the third.
        state.adjust(alone, Loss::Cauchy(3.0), max_steps);
    }
    state.triangulate();
}

/// Finds one photograph's camera from the points that are solved.
pub(super) fn add(state: &mut State<'_>, photo: usize) -> bool {
    let (world, pixels): (Vec<DVec3>, Vec<DVec2>) = state
        .problem
        .marks
        .iter()
        .filter(|m| m.photo == photo && m.pixel.is_finite())
        .filter_map(|m| state.points[m.point].map(|p| (p, m.pixel)))
        .unzip();
    resect_from(state, photo, &world, &pixels)
}

/// Finds one photograph's camera from points given.
pub(super) fn resect_from(state: &mut State<'_>, photo: usize, world: &[DVec3], pixels: &[DVec2]) -> bool {
    let lens = state.problem.photos[photo].lens;
    let candidates = if state.met[lens] {
        vec![state.lenses[lens].focal_px[0]]
    } else {
        focal_candidates(&state.problem.lenses[lens].focal, &state.lenses[lens], state.doubts_exif)
    };
    let reach = state.reach_px(lens) * if state.met[lens] { 1.5 } else { 3.0 };
    let seed = state.params.seed ^ (photo as u64).wrapping_mul(0x9e37_79b9);
    let best = candidates
        .iter()
        .filter_map(|f| resect::robustly(&with_focal(&state.lenses[lens], *f), world, pixels, reach, state.params.rounds, seed))
        .min_by(|a, b| a.cost.total_cmp(&b.cost));
    let Some(best) = best else { return false };
    // Three marks always agree; two more must, and with many marks chance agrees with some.
    let least = LEAST_SHARED.min(world.len()).max(4).max(world.len() / 4);
    if best.count() < least {
        return false;
    }
    state.poses[photo] = Some(best.camera.pose);
    state.lenses[lens] = best.camera.intrinsics;
    state.met[lens] = true;
    true
}

/// Why there is no start, in words that say what is missing.
pub(super) fn no_start(problem: &Problem, refusals: &Refusals) -> String {
    let name = |p: [usize; 2]| format!("{} and {}", problem.photos[p[0]].name, problem.photos[p[1]].name);
    if let Some(pair) = refusals.planar.first() {
        return format!(
            "the points that {} share lie in one plane, which does not tell an unknown focal length: give the focal length, or mark \
             points off that plane",
            name(*pair)
        );
    }
    if let Some(pair) = refusals.turned.first() {
        return format!(
            "{} were taken from one place (their rays hardly meet at an angle), so no depth can be told: take photographs from places \
             further apart",
            name(*pair)
        );
    }
    if refusals.wrong > 0 {
        return "no pair of photographs fits together: look whether their marks belong to the same points".to_owned();
    }
    format!(
        "no two photographs share enough points: {} are marked in both at most, and a start needs {}",
        refusals.most_shared,
        LEAST_SHARED + 1
    )
}
