//! The start: two photographs, related by the points that both show.

use super::five_point::{Solver, poses};
use super::random::Random;
use super::triangulate::{angle, of_pair};
use crate::camera::Pose;
use glam::{DMat3, DVec3};
use nalgebra::SMatrix;

/// How two photographs are related.
#[derive(Clone, Debug)]
pub(super) struct Pair {
    /// The second camera from the first; the baseline has length 1.
    pub(super) second_from_first: Pose,
    /// Which common points agree.
    pub(super) agrees: Vec<bool>,
    /// The median angle under which the agreeing points see both cameras.
    pub(super) parallax_rad: f64,
    /// The part of the agreeing points that one plane, or a turn on the spot, explains as well.
    pub(super) planar: f64,
    /// The part that a turn on the spot alone explains.
    pub(super) turned: f64,
}

impl Pair {
    pub(super) fn count(&self) -> usize {
        self.agrees.iter().filter(|a| **a).count()
    }
}

/// Relates two cameras by unit directions to common points; `reach_rad` is how far a direction may lie off its epipolar plane.
/// RANSAC (M. Fischler, R. Bolles, 1981) over five points, candidates compared by their truncated squares (MSAC).
pub(super) fn relate(first: &[DVec3], second: &[DVec3], reach_rad: f64, rounds: usize, seed: u64) -> Option<Pair> {
    let n = first.len();
    if n < 6 {
        return None;
    }
    let solver = Solver::new();
    let mut random = Random::new(seed);
    let limit = reach_rad * reach_rad;
    let mut best: Option<(f64, DMat3)> = None;
    let mut wanted = rounds;
    let mut round = 0;
    while round < wanted {
        round += 1;
        let drawn: [usize; 5] = random.sample(n);
        for e in solver.essentials(&drawn.map(|i| first[i]), &drawn.map(|i| second[i])) {
            let cost: f64 = (0..n).map(|i| off_plane_squared(&e, first[i], second[i]).min(limit)).sum();
            if best.as_ref().is_none_or(|(least, _)| cost < *least) {
                best = Some((cost, e));
                let inside = (0..n).filter(|i| off_plane_squared(&e, first[*i], second[*i]) < limit).count();
                wanted = enough_rounds(inside as f64 / n as f64, 5).min(rounds);
            }
        }
    }
    let (_, essential) = best?;
    let mut pair = chosen_pose(&essential, first, second, limit)?;
    let agreeing: Vec<usize> = (0..n).filter(|i| pair.agrees[*i]).collect();
    let count = agreeing.len().max(1) as f64;
    let (a, b): (Vec<DVec3>, Vec<DVec3>) = agreeing.iter().map(|i| (first[*i], second[*i])).unzip();
    pair.planar = plane_explains(&a, &b, limit, seed) as f64 / count;
    pair.turned = turn_explains(&a, &b, limit, seed) as f64 / count;
    Some(pair)
}

/// Rounds after which a draw without a wrong point has come up with 99.99 % certainty.
pub(super) fn enough_rounds(inside: f64, drawn: i32) -> usize {
    let good = (0..drawn).fold(1.0, |p, _| p * inside);
    if good >= 1.0 {
        return 1;
    }
    let rounds = libm::log(1e-4) / libm::log1p(-good);
    if rounds.is_finite() { rounds.ceil() as usize + 10 } else { usize::MAX }
}

/// Sampson's squared distance, in squared radians for unit directions.
fn off_plane_squared(essential: &DMat3, first: DVec3, second: DVec3) -> f64 {
    let line = *essential * first;
    let back = essential.transpose() * second;
    let off = second.dot(line);
    let slope = line.cross(second).length_squared() + back.cross(first).length_squared();
    if slope > 0.0 { off * off / slope } else { f64::INFINITY }
}

/// Of the four poses the one with most points before both cameras.
fn chosen_pose(essential: &DMat3, first: &[DVec3], second: &[DVec3], limit: f64) -> Option<Pair> {
    let n = first.len();
    let mut best: Option<Pair> = None;
    for pose in poses(essential) {
        let mut angles = Vec::new();
        let agrees: Vec<bool> = (0..n)
            .map(|i| {
                let off = off_plane_squared(essential, first[i], second[i]);
                let before = of_pair(&pose, first[i], second[i])
                    .is_some_and(|p| p.dot(first[i]) > 0.0 && pose.to_camera(p).dot(second[i]) > 0.0);
                let good = off < limit && before;
                if good {
                    angles.push(angle(first[i], pose.rotation.conjugate() * second[i]));
                }
                good
            })
            .collect();
        angles.sort_by(f64::total_cmp);
        let parallax_rad = angles.get(angles.len() / 2).copied().unwrap_or(0.0);
        let pair = Pair { second_from_first: pose, agrees, parallax_rad, planar: 0.0, turned: 0.0 };
        if best.as_ref().is_none_or(|b| pair.count() > b.count()) {
            best = Some(pair);
        }
    }
    best.filter(|b| b.count() >= 5)
}

/// How many pairs of directions one homography explains.
fn plane_explains(first: &[DVec3], second: &[DVec3], limit: f64, seed: u64) -> usize {
    let n = first.len();
    if n < 4 {
        return n;
    }
    let mut random = Random::new(seed ^ 0x70_6c61_6e65);
    let count = |h: &DMat3| {
        let inverse = h.inverse();
        let near = |a: DVec3, b: DVec3| {
            let off = angle_squared(a, b);
            off < limit
        };
        (0..n).filter(|i| near(*h * first[*i], second[*i]) && near(inverse * second[*i], first[*i])).count()
    };
    let mut most = 0;
    let mut best = None;
    for _ in 0..200 {
        let drawn: [usize; 4] = random.sample(n);
        let Some(h) = homography(&drawn.map(|i| first[i]), &drawn.map(|i| second[i])) else { continue };
        let inside = count(&h);
        if inside > most {
            most = inside;
            best = Some(h);
        }
    }
    // Once more from all that agree: four noisy points explain fewer than their plane does.
    for _ in 0..3 {
        let Some(h) = best else { break };
        let inside: Vec<usize> = (0..n).filter(|i| angle_squared(h * first[*i], second[*i]) < limit).collect();
        let (a, b): (Vec<DVec3>, Vec<DVec3>) = inside.iter().map(|i| (first[*i], second[*i])).unzip();
        best = homography(&a, &b);
        most = most.max(best.as_ref().map_or(0, count));
    }
    most
}

fn angle_squared(a: DVec3, b: DVec3) -> f64 {
    let off = angle(a, b);
    // a homography knows no sign
    off.min(std::f64::consts::PI - off) * off.min(std::f64::consts::PI - off)
}

/// The homography of four or more pairs: second x (H first) = 0.
fn homography(first: &[DVec3], second: &[DVec3]) -> Option<DMat3> {
    if first.len() < 4 {
        return None;
    }
    let mut normal = SMatrix::<f64, 9, 9>::zeros();
    for (a, b) in first.iter().zip(second) {
        let cross = [[0.0, -b.z, b.y], [b.z, 0.0, -b.x], [-b.y, b.x, 0.0]];
        for line in cross {
            let row: [f64; 9] = std::array::from_fn(|k| line[k / 3] * a[k % 3]);
            for i in 0..9 {
                for j in 0..9 {
                    normal[(i, j)] += row[i] * row[j];
                }
            }
        }
    }
    let eigen = nalgebra::SymmetricEigen::try_new(normal, f64::EPSILON, 1000)?;
    let least = (0..9).min_by(|a, b| eigen.eigenvalues[*a].total_cmp(&eigen.eigenvalues[*b]))?;
    let entries: [f64; 9] = std::array::from_fn(|i| eigen.eigenvectors[(i, least)]);
    let h = DMat3::from_cols_array(&entries).transpose();
    (h.determinant().abs() > 1e-12).then_some(h)
}

/// How many pairs of directions a turn on the spot explains.
fn turn_explains(first: &[DVec3], second: &[DVec3], limit: f64, seed: u64) -> usize {
    let n = first.len();
    if n < 2 {
        return n;
    }
    let mut random = Random::new(seed ^ 0x7475_726e);
    let count = |r: &DMat3| (0..n).filter(|i| angle(*r * first[*i], second[*i]) < limit.sqrt()).count();
    let mut most = 0;
    let mut best = None;
    for _ in 0..100 {
        let drawn: [usize; 2] = random.sample(n);
        let Some(r) = turn(&drawn.map(|i| first[i]), &drawn.map(|i| second[i])) else { continue };
        let inside = count(&r);
        if inside > most {
            most = inside;
            best = Some(r);
        }
    }
    if let Some(r) = best {
        let inside: Vec<usize> = (0..n).filter(|i| angle(r * first[*i], second[*i]) < limit.sqrt()).collect();
        let (a, b): (Vec<DVec3>, Vec<DVec3>) = inside.iter().map(|i| (first[*i], second[*i])).unzip();
        most = most.max(turn(&a, &b).as_ref().map_or(0, count));
    }
    most
}

/// The rotation that takes the first directions nearest to the second ones (W. Kabsch, 1976).
pub(super) fn turn(first: &[DVec3], second: &[DVec3]) -> Option<DMat3> {
    let mut sum = DMat3::ZERO;
    for (a, b) in first.iter().zip(second) {
        sum += DMat3::from_cols(*b * a.x, *b * a.y, *b * a.z);
    }
    let m = SMatrix::<f64, 3, 3>::from_column_slice(&sum.to_cols_array());
    let svd = nalgebra::SVD::try_new(m, true, true, f64::EPSILON, 1000)?;
    let (u, vt) = (svd.u?, svd.v_t?);
    let mut order = [0, 1, 2];
    order.sort_by(|a, b| svd.singular_values[*b].total_cmp(&svd.singular_values[*a]));
    // Two directions already fix a turn; the third singular value may be zero.
    if svd.singular_values[order[1]] <= 1e-12 * svd.singular_values[order[0]] {
        return None;
    }
    let column = |k: usize| DVec3::new(u[(0, order[k])], u[(1, order[k])], u[(2, order[k])]);
    let row = |k: usize| DVec3::new(vt[(order[k], 0)], vt[(order[k], 1)], vt[(order[k], 2)]);
    let left = DMat3::from_cols(column(0), column(1), column(0).cross(column(1)));
    let right = DMat3::from_cols(row(0), row(1), row(0).cross(row(1)));
    Some(left * right.transpose())
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DQuat;

    fn directions(points: &[DVec3], pose: &Pose) -> Vec<DVec3> {
        points.iter().map(|p| pose.to_camera(*p)).map(|p| p / p.length()).collect()
    }

    fn cloud(n: usize, flat: bool) -> Vec<DVec3> {
        let mut random = Random::new(17);
        (0..n).map(|_| DVec3::new(random.normal(), random.normal(), 6.0 + if flat { 0.0 } else { random.normal() })).collect()
    }

    const START: Pose = Pose { rotation: DQuat::IDENTITY, translation: DVec3::ZERO };

    #[test]
    fn wrong_pairs_do_not_turn_the_cameras() {
        let pose = Pose { rotation: DQuat::from_rotation_y(0.3), translation: DVec3::new(-1.8, 0.1, 0.3) };
        let points = cloud(40, false);
        let (first, mut second) = (directions(&points, &START), directions(&points, &pose));
        for i in 0..10 {
            second[i * 4] = second[(i * 7 + 3) % 40];
        }
        let pair = relate(&first, &second, 1e-3, 2000, 1).unwrap();
        assert!(pair.second_from_first.rotation.dot(pose.rotation).abs() > 1.0 - 1e-10);
        assert!(pair.planar < 0.8 && pair.turned < 0.5, "{pair:?}");
        assert!((pair.parallax_rad - 0.3).abs() < 0.15);
    }

    #[test]
    fn planes_and_turns_on_the_spot_are_known() {
        let pose = Pose { rotation: DQuat::from_rotation_y(0.3), translation: DVec3::new(-1.8, 0.1, 0.3) };
        let flat = cloud(30, true);
        let pair = relate(&directions(&flat, &START), &directions(&flat, &pose), 1e-3, 2000, 1).unwrap();
        assert!(pair.planar > 0.95 && pair.turned < 0.5, "{pair:?}");
        let spot = Pose { translation: DVec3::ZERO, ..pose };
        let points = cloud(30, false);
        let pair = relate(&directions(&points, &START), &directions(&points, &spot), 1e-3, 2000, 1);
        assert!(pair.is_none_or(|p| p.turned > 0.95));
    }
}
