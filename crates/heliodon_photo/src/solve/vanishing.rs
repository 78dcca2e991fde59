//! One photograph of architecture calibrates itself: parallel edges meet in vanishing points, and three directions at right angles tell the
//! focal length and the turn.
//!
//! B. Caprile, V. Torre: Using Vanishing Points for Camera Calibration, IJCV 4, 1990; the refinement is by the distance of drawn ends from the
//! lines to the vanishing points.

use super::bundle::{self, Free, Lens, Network, Segment, View, off_line};
use super::problem::{Edge, Focal, Problem};
use super::state::{State, with_focal};
use super::triangulate::nearest_to_rays;
use super::two_view::turn;
use crate::camera::{Camera, Intrinsics, Pose};
use glam::{DMat3, DQuat, DVec2, DVec3};
use nalgebra::{Matrix4, SMatrix};

/// A focal length less sure than this part of it is not told: the edges hardly converge.
const MAX_FOCAL_SIGMA: f64 = 0.15;

/// What edges tell of one photograph.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FromEdges {
    /// The lens, its focal length found where it was free.
    pub intrinsics: Intrinsics,
    /// Camera from the edges' frame.
    pub rotation: DQuat,
    /// The standard deviation of the focal length in pixels; 0 where it was known.
    pub focal_sigma_px: f64,
    /// The standard deviation of the turn about the worst axis.
    pub rotation_sigma_rad: f64,
    /// The root mean square of the ends' distances from their lines.
    pub rms_px: f64,
}

/// Calibrates one photograph by its edges; `sigma_px` is how well their ends were drawn.
///
/// # Errors
/// What is missing: edges of a second axis, convergence, a right-handed order of the axes.
pub fn calibrate(lens: &Intrinsics, focal: Focal, edges: &[Edge], sigma_px: f64) -> Result<FromEdges, String> {
    let start = with_focal(
        lens,
        match focal {
            Focal::Known(px) | Focal::Guess(px) => px,
            Focal::Free => f64::from(lens.width.max(lens.height)),
        },
    );
    let mut found: Vec<(usize, DVec3)> = Vec::new();
    for axis in 0..3 {
        let lines = plane_segments(&start, edges, axis);
        if lines.len() >= 2 {
            found.extend(meeting_point(&lines).map(|v| (axis, v)));
        }
    }
    if found.len() < 2 {
        return Err("edges along two axes are needed, two edges each at least".to_owned());
    }
    let mut intrinsics = start;
    if focal == Focal::Free {
        let (mut both, mut square) = (0.0, 0.0);
        for (i, (_, a)) in found.iter().enumerate() {
            for (_, b) in &found[i + 1..] {
                let depth = a.z * b.z;
                both += depth * (a.x * b.x + a.y * b.y);
                square += depth * depth;
            }
        }
        let ratio = -both / square;
        if !(ratio > 0.0) || !ratio.is_finite() {
            return Err("the edges do not tell the focal length: those of one axis at least should visibly converge, and axes stand at \
                        right angles"
                .to_owned());
        }
        intrinsics = with_focal(&start, start.focal_px[0] * ratio.sqrt());
    }
    let ratio = start.focal_px[0] / intrinsics.focal_px[0];
    let (mut axes, mut directions) = (Vec::new(), Vec::new());
    for (axis, v) in &found {
        let Some(along) = DVec3::new(v.x * ratio, v.y * ratio, v.z).try_normalize() else { continue };
        axes.push(DVec3::AXES[*axis]);
        directions.push(along * sense(&intrinsics, edges, *axis, along));
    }
    if let [a, b, c] = directions[..]
        && a.cross(b).dot(c) < 0.0
    {
        return Err("the edges' axes are mirrored: those of one axis are drawn from their greater to their lesser coordinate"
            .to_owned());
    }
    let matrix = turn(&axes, &directions).ok_or("the edges' axes do not stand at right angles")?;
    let solved = refined(&intrinsics, focal, edges, DQuat::from_mat3(&matrix).normalize(), sigma_px);
    if focal == Focal::Free && !(solved.focal_sigma_px < MAX_FOCAL_SIGMA * solved.intrinsics.focal_px[0]) {
        return Err(format!(
            "the edges hardly tell the focal length ({:.0} px, +- {:.0} px): draw longer ones, or edges of a third axis",
            solved.intrinsics.focal_px[0], solved.focal_sigma_px
        ));
    }
    Ok(solved)
}

fn plane_segments(lens: &Intrinsics, edges: &[Edge], axis: usize) -> Vec<[DVec2; 2]> {
    let plane = |e: &Edge| Some([lens.unproject(e.ends[0])?, lens.unproject(e.ends[1])?]);
    edges.iter().filter(|e| e.axis == axis).filter_map(plane).collect()
}

/// Where lines meet, at infinity too, longer segments counting more: the direction most nearly on all of them.
fn meeting_point(segments: &[[DVec2; 2]]) -> Option<DVec3> {
    let mut sum = SMatrix::<f64, 3, 3>::zeros();
    for [a, b] in segments {
        let line = a.extend(1.0).cross(b.extend(1.0));
        let norm = line.truncate().length();
        if !(norm > 0.0) {
            continue;
        }
        let line = line / norm;
        let weight = (*b - *a).length_squared();
        for i in 0..3 {
            for j in 0..3 {
                sum[(i, j)] += weight * line[i] * line[j];
            }
        }
    }
    let eigen = nalgebra::SymmetricEigen::try_new(sum, f64::EPSILON, 1000)?;
    let least = (0..3).min_by(|a, b| eigen.eigenvalues[*a].total_cmp(&eigen.eigenvalues[*b]))?;
    DVec3::from_array(std::array::from_fn(|i| eigen.eigenvectors[(i, least)])).try_normalize()
}

/// 1 where most segments are drawn the way that the direction leads, -1 where against it.
fn sense(lens: &Intrinsics, edges: &[Edge], axis: usize, along: DVec3) -> f64 {
    let votes: f64 = plane_segments(lens, edges, axis)
        .iter()
        .map(|[a, b]| (*b - *a).dot(along.truncate() - *a * along.z).signum() * (*b - *a).length())
        .sum();
    if votes < 0.0 { -1.0 } else { 1.0 }
}

fn refined(lens: &Intrinsics, focal: Focal, edges: &[Edge], rotation: DQuat, sigma_px: f64) -> FromEdges {
    let segment = |e: &Edge| Segment { view: 0, axis: DVec3::AXES[e.axis], ends: e.ends, weight: 1.0 / sigma_px };
    let free = Free { focal: focal == Focal::Free, ..Free::default() };
    let mut network = Network {
        lenses: vec![Lens::new(*lens, free)],
        views: vec![View { pose: Pose { rotation, translation: DVec3::ZERO }, lens: 0, fixed: false }],
        segments: edges.iter().map(segment).collect(),
        frame: DQuat::IDENTITY,
        frame_fixed: true,
        ..Network::default()
    };
    let loss = bundle::Loss::Cauchy(3.0);
    bundle::adjust(&mut network, &bundle::Params { loss, ..bundle::Params::default() });
    let Camera { intrinsics, pose } = network.camera(0);
    let residual = |lens: &Intrinsics, rotation: DQuat, s: &Segment| off_line(lens, s, rotation * s.axis);
    // Four unknowns, differentiated numerically once: for the uncertainties only.
    let mut normal = Matrix4::<f64>::zeros();
    let mut sum = 0.0;
    for s in &network.segments {
        let mut row = [0.0; 4];
        for (i, value) in row.iter_mut().enumerate() {
            let h = if i == 3 { 1e-3 * intrinsics.focal_px[0] } else { 1e-6 };
            let at = |step: f64| {
                if i == 3 {
                    residual(&with_focal(&intrinsics, intrinsics.focal_px[0] + step), pose.rotation, s)
                } else {
                    residual(&intrinsics, bundle::rotation_from_vector(DVec3::AXES[i] * step) * pose.rotation, s)
                }
            };
            *value = (at(h) - at(-h)) / (2.0 * h);
        }
        if !free.focal {
            row[3] = 0.0;
        }
        for i in 0..4 {
            for j in 0..4 {
                normal[(i, j)] += row[i] * row[j];
            }
        }
        let off = residual(&intrinsics, pose.rotation, s) * sigma_px;
        sum += off * off;
    }
    if !free.focal {
        normal[(3, 3)] = 1.0;
    }
    let sigma = |i: usize, inverse: &Matrix4<f64>| inverse[(i, i)].max(0.0).sqrt();
    let inverse = normal.try_inverse().unwrap_or_else(|| Matrix4::from_element(f64::INFINITY));
    FromEdges {
        intrinsics,
        rotation: pose.rotation,
        focal_sigma_px: if free.focal { sigma(3, &inverse) } else { 0.0 },
        rotation_sigma_rad: (0..3).map(|i| sigma(i, &inverse)).fold(0.0, f64::max),
        rms_px: (sum / network.segments.len().max(1) as f64).sqrt(),
    }
}

/// Calibrates every photograph that has edges; lenses of unknown focal length get it from the surest of theirs. What edges do not tell is noted.
pub(super) fn calibrate_all(state: &mut State<'_>, notes: &mut Vec<String>) -> Vec<Option<FromEdges>> {
    let problem = state.problem;
    let mut of_photo: Vec<Vec<Edge>> = vec![Vec::new(); problem.photos.len()];
    for edge in &problem.edges {
        of_photo[edge.photo].push(*edge);
    }
    let mut all: Vec<Option<FromEdges>> = vec![None; problem.photos.len()];
    let mut run = |state: &State<'_>, photo: usize, focal: Focal, notes: &mut Vec<String>| {
        let lens = problem.photos[photo].lens;
        if of_photo[photo].is_empty() {
            return;
        }
        match calibrate(&state.lenses[lens], focal, &of_photo[photo], state.params.mark_sigma_px) {
            Ok(found) => all[photo] = Some(found),
            Err(why) => notes.push(format!("edges in {}: {why}", problem.photos[photo].name)),
        }
    };
    for photo in 0..problem.photos.len() {
        run(state, photo, problem.lenses[problem.photos[photo].lens].focal, notes);
    }
    let mut again = Vec::new();
    for lens in 0..problem.lenses.len() {
        if problem.lenses[lens].focal != Focal::Free {
            continue;
        }
        let of_lens = (0..problem.photos.len()).filter(|p| problem.photos[*p].lens == lens);
        let surest = of_lens.clone().filter_map(|p| all[p]).min_by(|a, b| a.focal_sigma_px.total_cmp(&b.focal_sigma_px));
        if let Some(surest) = surest {
            state.lenses[lens] = surest.intrinsics;
            state.met[lens] = true;
            again.extend(of_lens);
        }
    }
    let run = |photo: usize, lens: &Intrinsics| {
        let focal = Focal::Known(lens.focal_px[0]);
        calibrate(lens, focal, &of_photo[photo], state.params.mark_sigma_px).ok()
    };
    for photo in again {
        let lens = state.lenses[problem.photos[photo].lens];
        all[photo] = run(photo, &lens).or(all[photo]);
    }
    all
}

/// Coordinates of points: those given, and those that a distance and a direction from such a point tell. Where none is given, the first point
/// with both becomes the origin.
pub(super) fn coordinates(problem: &Problem) -> Vec<Option<DVec3>> {
    let mut known: Vec<Option<DVec3>> = problem.points.iter().map(|p| p.known_m).collect();
    let steps: Vec<(usize, usize, DVec3)> = problem
        .directions
        .iter()
        .filter_map(|direction| {
            let [a, b] = direction.between;
            let same = |d: &&super::problem::Distance| d.between == [a, b] || d.between == [b, a];
            problem.distances.iter().find(same).map(|d| (a, b, direction.world * d.metres))
        })
        .collect();
    if known.iter().all(Option::is_none)
        && let Some((a, ..)) = steps.first()
    {
        known[*a] = Some(DVec3::ZERO);
    }
    for _ in 0..steps.len() {
        for (a, b, step) in &steps {
            match (known[*a], known[*b]) {
                (Some(at), None) => known[*b] = Some(at + *step),
                (None, Some(at)) => known[*a] = Some(at - *step),
                _ => {}
            }
        }
    }
    known
}

/// Places photographs whose turn the edges tell by two or more points of known coordinates in each. True where any was.
pub(super) fn place(state: &mut State<'_>, turned: &[Option<FromEdges>], notes: &mut Vec<String>) -> bool {
    let problem = state.problem;
    let known = coordinates(problem);
    let mut any = false;
    for (photo, found) in turned.iter().enumerate() {
        let Some(found) = found else { continue };
        if state.poses[photo].is_some() {
            continue;
        }
        let seen: Vec<(DVec3, DVec2)> = problem
            .marks
            .iter()
            .filter(|m| m.photo == photo && m.pixel.is_finite())
            .filter_map(|m| known[m.point].map(|at| (at, m.pixel)))
            .collect();
        let name = &problem.photos[photo].name;
        if seen.len() < 2 {
            notes.push(format!(
                "edges tell the turn of {name} (+- {:.3} deg) and its focal length ({:.0} px), but not its place: mark a point of known \
                 coordinates in it, and a second one at a known distance and direction from it",
                found.rotation_sigma_rad.to_degrees(),
                found.intrinsics.focal_px[0]
            ));
            continue;
        }
        let camera = Camera { intrinsics: found.intrinsics, pose: Pose { rotation: found.rotation, translation: DVec3::ZERO } };
        let rays: Vec<(DVec3, DVec3)> = seen.iter().map(|(at, pixel)| (*at, camera.ray(*pixel).1)).collect();
        let Some(centre) = nearest_to_rays(&rays) else { continue };
        let lens = problem.photos[photo].lens;
        state.lenses[lens] = found.intrinsics;
        state.met[lens] = true;
        state.poses[photo] = Some(Pose::from_centre(found.rotation, centre));
        // What one photograph tells is told by the edges and the known points; nothing in it is left to adjust.
        state.held[photo] = true;
        state.placed = true;
        any = true;
    }
    any
}

/// The frame of the edges, from the first solved photograph that they turn.
pub(super) fn frame(state: &State<'_>, turned: &[Option<FromEdges>]) -> Option<DQuat> {
    let rotations: Vec<DQuat> = (0..turned.len())
        .filter_map(|p| Some((state.poses[p]?.rotation.conjugate() * turned[p]?.rotation).normalize()))
        .collect();
    // The one nearest to most of the others: single photographs may have been misread.
    let apart = |a: DQuat, b: DQuat| 1.0 - a.dot(b).abs();
    let sum = |a: DQuat| rotations.iter().map(|b| apart(a, *b).sqrt()).sum::<f64>();
    rotations.iter().copied().min_by(|a, b| sum(*a).total_cmp(&sum(*b)))
}

/// The camera's rotation as a matrix of columns, for those who draw vanishing points: where each axis of the frame leads in the camera.
#[must_use]
pub fn axes_in_camera(found: &FromEdges) -> [DVec3; 3] {
    let m = DMat3::from_quat(found.rotation);
    [m.x_axis, m.y_axis, m.z_axis]
}

#[cfg(test)]
mod tests {
    use super::super::random::Random;
    use super::*;

    /// Edges of a box, seen from outside, ends drawn with noise.
    fn edges(camera: &Camera, noise_px: f64) -> Vec<Edge> {
        let mut random = Random::new(5);
        let mut all = Vec::new();
        for axis in 0..3 {
            for corner in 0..4 {
                let mut from = DVec3::ZERO;
                from[(axis + 1) % 3] = if corner & 1 == 0 { -3.0 } else { 3.0 };
                from[(axis + 2) % 3] = if corner & 2 == 0 { -3.0 } else { 3.0 };
                from[axis] = -3.0;
                let mut to = from;
                to[axis] = 3.0;
                let mut end = |p: DVec3| camera.project(p).unwrap() + DVec2::new(random.normal(), random.normal()) * noise_px;
                all.push(Edge { photo: 0, axis, ends: [end(from), end(to)] });
            }
        }
        all
    }

    fn camera() -> Camera {
        let pose = Pose::look_at(DVec3::new(9.0, 5.0, 12.0), DVec3::new(0.2, 0.1, 0.0)).unwrap();
        Camera { intrinsics: Intrinsics::pinhole(2000, 1500, 1800.0), pose }
    }

    #[test]
    fn a_box_tells_focal_length_and_turn() {
        let truth = camera();
        let lens = Intrinsics::pinhole(2000, 1500, 1.0);
        let exact = calibrate(&lens, Focal::Free, &edges(&truth, 0.0), 0.5).unwrap();
        assert!((exact.intrinsics.focal_px[0] - 1800.0).abs() < 1e-3, "{exact:?}");
        assert!(exact.rotation.dot(truth.pose.rotation).abs() > 1.0 - 1e-12);
        let noisy = calibrate(&lens, Focal::Free, &edges(&truth, 0.5), 0.5).unwrap();
        let off = (noisy.intrinsics.focal_px[0] - 1800.0).abs();
        assert!(off < 4.0 * noisy.focal_sigma_px && noisy.focal_sigma_px < 40.0, "{off} {noisy:?}");
    }

    #[test]
    fn what_edges_cannot_tell_is_said() {
        let truth = camera();
        let lens = Intrinsics::pinhole(2000, 1500, 1.0);
        let all = edges(&truth, 0.0);
        let upright: Vec<Edge> = all.iter().copied().filter(|e| e.axis == 1).collect();
        assert!(calibrate(&lens, Focal::Free, &upright, 0.5).unwrap_err().contains("two axes"));
        let mut mirrored = all.clone();
        mirrored.iter_mut().filter(|e| e.axis == 0).for_each(|e| e.ends.swap(0, 1));
        assert!(calibrate(&lens, Focal::Free, &mirrored, 0.5).unwrap_err().contains("mirrored"));
        // Seen straight on, two axes do not converge at all.
        let pose = Pose::look_at(DVec3::new(0.0, 0.0, 15.0), DVec3::ZERO).unwrap();
        let ahead = edges(&Camera { pose, ..truth }, 0.5);
        let two: Vec<Edge> = ahead.into_iter().filter(|e| e.axis < 2).collect();
        assert!(calibrate(&lens, Focal::Free, &two, 0.5).is_err());
        assert!(calibrate(&lens, Focal::Known(1800.0), &two, 0.5).is_ok());
    }
}
