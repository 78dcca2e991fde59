//! Cameras and points from marks.
//!
//! A robust start from two photographs (five points), the others added one by one (three points), all adjusted together, wrong marks found by
//! their standardised residuals and left out, the whole laid into the world by what is known of it. What cannot be solved is said by name, what
//! was solved is kept.

mod align;
pub mod bundle;
mod five_point;
mod incremental;
mod polynomial;
mod problem;
pub mod random;
mod refine;
mod resect;
mod state;
mod triangulate;
mod two_view;
pub mod vanishing;
mod wrong;

pub use align::{Similarity, fit_similarity};
pub use problem::*;
pub use refine::{Start, refine};
pub(crate) use state::with_focal;

use crate::camera::Pose;
use bundle::{Inverse, LENS_UNKNOWNS};
use glam::{DMat3, DVec2, DVec3};
use nalgebra::SMatrix;
use state::State;
use vanishing::FromEdges;

/// Solves for all cameras and points that the marks tell. Never fails: what is missing stands in the photographs' and points' reasons and in
/// the notes.
#[must_use]
pub fn solve(problem: &Problem, params: &Params) -> Solution {
    let mut notes = Vec::new();
    let given = problem.marks.len();
    let problem = &cleared(problem, &mut notes);
    let mut state = State::new(problem, *params);
    let turned = vanishing::calibrate_all(&mut state, &mut notes);
    let refusal = begin(&mut state, &turned, &mut notes);
    state.frame = vanishing::frame(&state, &turned);
    let judged = wrong::cleaned(&mut state);
    let mut solution = finish(state, judged, refusal, notes);
    solution.marks.resize(given, MarkResult::Idle);
    solution
}

/// The problem without marks and edges that mean nothing: outside any photograph, not numbers, given twice.
fn cleared(problem: &Problem, notes: &mut Vec<String>) -> Problem {
    let mut problem = problem.clone();
    let (photos, points, lenses) = (problem.photos.len(), problem.points.len(), problem.lenses.len());
    let before = problem.marks.len();
    let mut seen = std::collections::BTreeSet::new();
    problem.marks.iter_mut().for_each(|m| {
        let whole = m.photo < photos && m.point < points && m.pixel.is_finite() && problem.photos[m.photo].lens < lenses;
        if !whole || !seen.insert((m.photo, m.point)) {
            // Marks keep their numbers, which results are told by.
            *m = Mark { photo: 0, point: 0, pixel: DVec2::NAN };
        }
    });
    let bad = problem.marks.iter().filter(|m| m.pixel.is_nan()).count();
    if bad > 0 {
        notes.push(format!(
            "{bad} of {before} marks were not looked at: given twice, or without a photograph, a point or a place"
        ));
    }
    if photos == 0 || points == 0 || lenses == 0 {
        problem.marks.clear();
    }
    problem.edges.retain(|e| {
        e.photo < photos && problem.photos[e.photo].lens < lenses && e.axis < 3 && e.ends.iter().all(|p| p.is_finite())
    });
    problem.distances.retain(|d| d.between.iter().all(|p| *p < points) && d.metres > 0.0 && d.metres.is_finite());
    problem.directions.retain(|d| d.between.iter().all(|p| *p < points) && d.world.is_finite());
    problem
}

/// Finds a start and grows from it; the reason where there is none.
fn begin(state: &mut State<'_>, turned: &[Option<FromEdges>], notes: &mut Vec<String>) -> Option<String> {
    let problem = state.problem;
    for (photo, given) in problem.photos.iter().enumerate() {
        state.poses[photo] = given.pose;
        state.held[photo] = given.pose.is_some();
        state.met[given.lens] |= given.pose.is_some();
    }
    resect_known(state);
    if state.poses.iter().flatten().count() >= 2 {
        incremental::settle(state, 100);
        if state.points.iter().flatten().count() >= incremental::LEAST_SHARED {
            incremental::grow(state);
            return None;
        }
        if problem.marks.is_empty() {
            return None;
        }
    }
    let kept = state.clone();
    state.poses.fill(None);
    state.held.fill(false);
    let (starts, refusals) = incremental::starts(state);
    let mut best = incremental::best_of(state, &starts);
    let guessed = problem.lenses.iter().any(|l| matches!(l.focal, Focal::Guess(_)));
    if guessed && best.as_ref().is_none_or(|b| b.poses.iter().any(Option::is_none)) {
        let doubting = State { doubts_exif: true, ..state.clone() };
        let (starts, _) = incremental::starts(&doubting);
        let other = incremental::best_of(&doubting, &starts);
        if other.as_ref().map(State::rank) > best.as_ref().map(State::rank) {
            best = other;
        }
    }
    match best {
        Some(best) => {
            *state = best;
            None
        }
        None => {
            *state = kept;
            if vanishing::place(state, turned, notes) {
                incremental::settle(state, 100);
                incremental::grow(state);
                return None;
            }
            if state.poses.iter().any(Option::is_some) {
                return None;
            }
            let why = incremental::no_start(problem, &refusals);
            notes.push(why.clone());
            Some(why)
        }
    }
}

/// Photographs that show enough points of known coordinates need no partner.
fn resect_known(state: &mut State<'_>) {
    let problem = state.problem;
    for photo in 0..problem.photos.len() {
        if state.poses[photo].is_some() {
            continue;
        }
        let (world, pixels): (Vec<DVec3>, Vec<DVec2>) = problem
            .marks
            .iter()
            .filter(|m| m.photo == photo && m.pixel.is_finite())
            .filter_map(|m| problem.points[m.point].known_m.map(|p| (p, m.pixel)))
            .unzip();
        if world.len() > incremental::LEAST_SHARED {
            incremental::resect_from(state, photo, &world, &pixels);
        }
    }
}

fn finish(mut state: State<'_>, judged: wrong::Judged, refusal: Option<String>, mut notes: Vec<String>) -> Solution {
    let problem = state.problem;
    notes.extend(judged.notes.iter().cloned());
    let aligned = align::align(&state);
    align::carry(&mut state, &aligned.similarity);
    let given = problem.photos.iter().any(|p| p.pose.is_some());
    notes.extend(aligned.notes.into_iter().filter(|_| state.points.iter().flatten().count() > 0 || given));
    let hold = state.poses.iter().flatten().count() < 3;
    let extract = state.extract(hold);
    let datum: Vec<_> = align::datum(&state)
        .into_iter()
        .filter_map(|(p, slope)| extract.points.binary_search(&p).ok().map(|number| (number, slope)))
        .collect();
    let covariances = Inverse::of(&extract.network).map(|i| i.covariances(&datum));
    // Marks weigh as declared; what they turned out to be scales all covariances.
    let ratio = judged.sigma_px / state.params.mark_sigma_px;
    let mut sums = vec![(0usize, 0.0f64); problem.photos.len()];
    let mut point_sums = vec![(0usize, 0.0f64); problem.points.len()];
    for (mark, result) in problem.marks.iter().zip(&judged.marks) {
        if let MarkResult::Used(off) = result {
            for sum in [&mut sums[mark.photo], &mut point_sums[mark.point]] {
                *sum = (sum.0 + 1, sum.1 + off.length_squared());
            }
        }
    }
    let rms = |(count, sum): (usize, f64)| if count == 0 { 0.0 } else { (sum / count as f64).sqrt() };
    let photos = (0..problem.photos.len())
        .map(|photo| {
            let Some(camera) = state.camera(photo) else {
                return PhotoResult::Unsolved(unsolved_photo(&state, photo, refusal.as_deref()));
            };
            let view = extract.views.iter().position(|v| *v == photo).filter(|_| sums[photo].0 > 0);
            let of = covariances.as_ref().zip(view);
            PhotoResult::Solved(Box::new(SolvedPhoto {
                camera,
                marks: sums[photo].0,
                rms_px: rms(sums[photo]),
                centre_covariance_m2: of.map(|(c, v)| c.centres[v] * (ratio * ratio)),
                rotation_sigma_rad: of.map(|(c, v)| ratio * largest_sigma(&c.views[v].fixed_view::<3, 3>(0, 0).into_owned())),
            }))
        })
        .collect();
    let points = (0..problem.points.len())
        .map(|point| {
            let Some(position_m) = state.points[point] else {
                // a corner that no photograph shows, but that somebody has measured
                let known_m = problem.points[point].known_m.filter(|_| state.marks_of[point].is_empty());
                return match known_m {
                    Some(position_m) => PointResult::Solved(SolvedPoint {
                        position_m,
                        covariance_m2: Some(DMat3::ZERO),
                        marks: 0,
                        rms_px: 0.0,
                        parallax_rad: 0.0,
                    }),
                    None => PointResult::Unsolved(unsolved_point(&state, point)),
                };
            };
            let number = extract.points.binary_search(&point).ok();
            PointResult::Solved(SolvedPoint {
                position_m,
                covariance_m2: covariances.as_ref().zip(number).map(|(c, n)| c.points[n] * (ratio * ratio)),
                marks: point_sums[point].0,
                rms_px: rms(point_sums[point]),
                parallax_rad: parallax(&state, point),
            })
        })
        .collect();
    let lenses: Vec<LensResult> = (0..problem.lenses.len())
        .map(|lens| LensResult {
            intrinsics: state.lenses[lens],
            sigmas: covariances.as_ref().map_or([0.0; LENS_UNKNOWNS], |c| c.lenses[lens].map(|s| s * ratio)),
            solved: (0..problem.photos.len()).any(|p| problem.photos[p].lens == lens && state.poses[p].is_some()),
        })
        .collect();
    for (lens, group) in lenses.iter().zip(&problem.lenses) {
        let (focal, sigma) = (lens.intrinsics.focal_px[0], lens.sigmas[0]);
        if lens.solved && sigma > 0.02 * focal {
            let name = &group.name;
            notes.push(format!("the focal length of lens {name} is hardly determined ({focal:.0} px, +- {sigma:.0} px): mark points nearer and farther, or give it"));
        }
        if lens.solved && hold && group.focal == Focal::Free && refusal.is_none() {
            let name = &group.name;
            notes.push(format!("the focal length of lens {name} is a guess ({focal:.0} px): two photographs do not tell it; add a third, or give it"));
        }
    }
    notes.extend(soft_marks(problem, &judged, &state.params));
    if covariances.is_none() && state.poses.iter().flatten().count() > 0 && !problem.marks.is_empty() {
        notes.push("uncertainties cannot be told: too few marks for what is solved".to_owned());
    }
    Solution { lenses, photos, points, marks: judged.marks, alignment: aligned.alignment, sigma_px: judged.sigma_px, notes }
}

/// So many marks left out, and this part of all, are no slips of a hand ...
const MANY_WRONG: (usize, f64) = (8, 0.05);

/// ... if most of them lie within so many limits: slips go anywhere.
const NEAR_LIMITS: f64 = 3.0;

/// Where a good part of the marks misses by little, corners are softer than marks were taken to be: what setting takes that in.
fn soft_marks(problem: &Problem, judged: &wrong::Judged, params: &Params) -> Option<String> {
    let limit_px = params.wrong_from * judged.sigma_px;
    let wrong: Vec<f64> =
        judged.marks.iter().filter_map(|m| if let MarkResult::Wrong(off) = m { Some(off.length()) } else { None }).collect();
    let (near, far): (Vec<f64>, Vec<f64>) = wrong.into_iter().partition(|off| *off < NEAR_LIMITS * limit_px);
    let many = (MANY_WRONG.1 * problem.marks.len() as f64).max(MANY_WRONG.0 as f64);
    if (near.len() as f64) < many || near.len() < 2 * far.len() {
        return None;
    }
    let farthest = near.iter().copied().fold(0.0, f64::max);
    // With which the farthest of them would just not have been left out, up to a tenth.
    let would = (10.0 * farthest / params.wrong_from).ceil() / 10.0;
    Some(format!(
        "{} of {} marks were left out by less than {farthest:.1} px: if their corners are worn or hard to tell, say so by \
         `mark_sigma_px = {would:.1}` under [project], which is {} now",
        near.len(),
        problem.marks.len(),
        params.mark_sigma_px
    ))
}

fn largest_sigma(covariance: &SMatrix<f64, 3, 3>) -> f64 {
    let eigen = nalgebra::SymmetricEigen::try_new(*covariance, f64::EPSILON, 1000);
    eigen.map_or(0.0, |e| e.eigenvalues.max().max(0.0).sqrt())
}

/// The standard deviation along the worst direction of a covariance.
#[must_use]
pub fn worst_sigma(covariance: &DMat3) -> f64 {
    largest_sigma(&SMatrix::from_column_slice(&covariance.to_cols_array()))
}

fn parallax(state: &State<'_>, point: usize) -> f64 {
    let Some(position) = state.points[point] else { return 0.0 };
    let rays: Vec<DVec3> = state.marks_of[point]
        .iter()
        .filter(|m| state.used[**m])
        .filter_map(|m| state.poses[state.problem.marks[*m].photo])
        .filter_map(|pose: Pose| (position - pose.centre()).try_normalize())
        .collect();
    let mut largest = 0.0f64;
    for i in 0..rays.len() {
        for j in i + 1..rays.len() {
            largest = largest.max(triangulate::angle(rays[i], rays[j]));
        }
    }
    largest
}

fn unsolved_photo(state: &State<'_>, photo: usize, refusal: Option<&str>) -> String {
    let problem = state.problem;
    let marked: Vec<usize> = problem.marks.iter().filter(|m| m.photo == photo).map(|m| m.point).collect();
    let solved = marked.iter().filter(|p| state.points[**p].is_some()).count();
    let need = incremental::LEAST_SHARED;
    if marked.is_empty() {
        return "nothing is marked in it".to_owned();
    }
    if let Some(why) = refusal {
        return if marked.len() <= need {
            format!("only {} points are marked in it, and {} are needed", marked.len(), need + 1)
        } else {
            why.to_owned()
        };
    }
    if solved >= need {
        return format!(
            "of {solved} solved points marked in it too few agree on one camera: look at its marks, or whether it shows the same place"
        );
    }
    // Whom does it share its points with?
    let other = (0..problem.photos.len())
        .filter(|other| *other != photo && state.poses[*other].is_none())
        .any(|other| problem.marks.iter().filter(|m| m.photo == other && marked.contains(&m.point)).count() >= need);
    let also = if other { "; it hangs together with other unsolved photographs, but not with the solved ones" } else { "" };
    format!(
        "it shares {solved} solved points with the solved photographs, and {need} are needed: mark more of them in it{also}"
    )
}

fn unsolved_point(state: &State<'_>, point: usize) -> String {
    let problem = state.problem;
    let all = state.marks_of[point].len();
    let seen: Vec<&str> = state.marks_of[point]
        .iter()
        .map(|m| problem.marks[*m].photo)
        .filter(|p| state.poses[*p].is_some())
        .map(|p| problem.photos[p].name.as_str())
        .collect();
    if state.ambiguous[point] {
        return format!(
            "its {all} marks agree in more than one way, at least one is wrong: look at them, or mark it once more"
        );
    }
    match (all, seen.len()) {
        (0, _) => "it is marked nowhere".to_owned(),
        (1, _) => "it is marked in one photograph only; a second is needed".to_owned(),
        (_, 0 | 1) => format!("of its {all} marks {} lie in solved photographs; two are needed", seen.len()),
        (_, 2) => format!(
            "its marks in {} and {} do not meet in one point, or see it from the same place: one of them may be wrong",
            seen[0], seen[1]
        ),
        (_, n) => format!("no two of its {n} marks agree, or all see it from the same place"),
    }
}
