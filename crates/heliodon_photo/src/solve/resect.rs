//! A camera's pose from known points in its photograph.

use super::bundle::{self, Free, Lens, Loss, Network, Observation, Params, Point, View};
use super::polynomial::real_roots;
use super::random::Random;
use super::two_view::enough_rounds;
use crate::camera::{Camera, Intrinsics, Pose};
use glam::{DMat3, DQuat, DVec2, DVec3};

/// The poses from which three points lie in three unit directions: at most four.
///
/// J. A. Grunert, 1841, as in R. Haralick, C. Lee, K. Ottenberg, M. Nolle: Review and Analysis of Solutions of the Three Point Perspective Pose
/// Estimation Problem, IJCV 13(3), 1994, equations 4 to 9.
pub(super) fn three_points(world: [DVec3; 3], directions: [DVec3; 3]) -> Vec<Pose> {
    let [p1, p2, p3] = world;
    let [j1, j2, j3] = directions;
    let (a2, b2, c2) = ((p2 - p3).length_squared(), (p1 - p3).length_squared(), (p1 - p2).length_squared());
    if a2.min(b2).min(c2) <= 0.0 {
        return Vec::new();
    }
    let (cos_a, cos_b, cos_c) = (j2.dot(j3), j1.dot(j3), j1.dot(j2));
    let (minus, plus) = ((a2 - c2) / b2, (a2 + c2) / b2);
    let (ca, ab) = (c2 / b2, a2 / b2);
    let coefficients = [
        (1.0 + minus) * (1.0 + minus) - 4.0 * ab * cos_c * cos_c,
        4.0 * (-minus * (1.0 + minus) * cos_b + 2.0 * ab * cos_c * cos_c * cos_b - (1.0 - plus) * cos_a * cos_c),
        2.0 * (minus * minus - 1.0 + 2.0 * minus * minus * cos_b * cos_b + 2.0 * (1.0 - ca) * cos_a * cos_a
            - 4.0 * plus * cos_a * cos_b * cos_c
            + 2.0 * (1.0 - ab) * cos_c * cos_c),
        4.0 * (minus * (1.0 - minus) * cos_b - (1.0 - plus) * cos_a * cos_c + 2.0 * ca * cos_a * cos_a * cos_b),
        (minus - 1.0) * (minus - 1.0) - 4.0 * ca * cos_a * cos_a,
    ];
    let mut found = Vec::new();
    for v in real_roots(&coefficients) {
        let divisor = 2.0 * (cos_c - v * cos_a);
        let u = ((minus - 1.0) * v * v - 2.0 * minus * cos_b * v + 1.0 + minus) / divisor;
        let s1 = (b2 / (1.0 + v * v - 2.0 * v * cos_b)).sqrt();
        if v > 0.0 && u > 0.0 && u.is_finite() && s1.is_finite() {
            found.extend(superposed(world, [j1 * s1, j2 * u * s1, j3 * v * s1]));
        }
    }
    found
}

/// The pose that lays one triangle upon another of the same shape.
fn superposed(world: [DVec3; 3], camera: [DVec3; 3]) -> Option<Pose> {
    let basis = |p: [DVec3; 3]| {
        let x = (p[1] - p[0]).try_normalize()?;
        let z = x.cross(p[2] - p[0]).try_normalize()?;
        Some(DMat3::from_cols(x, z.cross(x), z))
    };
    let rotation = DQuat::from_mat3(&(basis(camera)? * basis(world)?.transpose())).normalize();
    let middle = |p: [DVec3; 3]| (p[0] + p[1] + p[2]) / 3.0;
    rotation.is_finite().then(|| Pose { rotation, translation: middle(camera) - rotation * middle(world) })
}

/// A pose found robustly.
#[derive(Clone, Debug)]
pub(super) struct Resection {
    pub(super) camera: Camera,
    pub(super) agrees: Vec<bool>,
    pub(super) cost: f64,
}

impl Resection {
    pub(super) fn count(&self) -> usize {
        self.agrees.iter().filter(|a| **a).count()
    }
}

/// RANSAC over three points, every candidate scored over all.
pub(super) fn robustly(
    lens: &Intrinsics,
    world: &[DVec3],
    pixels: &[DVec2],
    reach_px: f64,
    rounds: usize,
    seed: u64,
) -> Option<Resection> {
    let n = world.len();
    if n < 4 {
        return None;
    }
    let directions: Vec<Option<DVec3>> =
        pixels.iter().map(|p| lens.unproject(*p).map(|q| q.extend(1.0)).map(|q| q / q.length())).collect();
    let limit = reach_px * reach_px;
    let mut random = Random::new(seed);
    let mut best: Option<(f64, Camera)> = None;
    let error =
        |camera: &Camera, i: usize| camera.project(world[i]).map_or(f64::INFINITY, |p| (p - pixels[i]).length_squared());
    let (mut round, mut wanted) = (0, rounds);
    while round < wanted {
        round += 1;
        let drawn: [usize; 3] = random.sample(n);
        let [Some(a), Some(b), Some(c)] = drawn.map(|i| directions[i]) else { continue };
        for pose in three_points(drawn.map(|i| world[i]), [a, b, c]) {
            let camera = Camera { intrinsics: *lens, pose };
            let cost: f64 = (0..n).map(|i| error(&camera, i).min(limit)).sum();
            if best.is_none_or(|(least, _)| cost < least) {
                best = Some((cost, camera));
                let inside = (0..n).filter(|i| error(&camera, *i) < limit).count();
                wanted = enough_rounds(inside as f64 / n as f64, 3).min(rounds);
            }
        }
    }
    let (mut cost, mut camera) = best?;
    // Three noisy points place a camera worse than all that agree.
    for _ in 0..3 {
        let agreeing: Vec<usize> = (0..n).filter(|i| error(&camera, *i) < 4.0 * limit).collect();
        let moved = refined(&camera, world, pixels, &agreeing, reach_px);
        let moved_cost: f64 = (0..n).map(|i| error(&moved, i).min(limit)).sum();
        if !(moved_cost < cost) {
            break;
        }
        (cost, camera) = (moved_cost, moved);
    }
    let agrees = (0..n).map(|i| error(&camera, i) < limit).collect();
    Some(Resection { camera, agrees, cost })
}

/// The pose of least error over some points, the lens held.
fn refined(camera: &Camera, world: &[DVec3], pixels: &[DVec2], chosen: &[usize], reach_px: f64) -> Camera {
    let mut network = Network {
        lenses: vec![Lens::new(camera.intrinsics, Free::default())],
        views: vec![View { pose: camera.pose, lens: 0, fixed: false }],
        points: chosen.iter().map(|i| Point { position: world[*i], fixed: true, known: None }).collect(),
        observations: (chosen.iter().enumerate())
            .map(|(point, i)| Observation { view: 0, point, pixel: pixels[*i], weight: 1.0 })
            .collect(),
        ..Network::default()
    };
    bundle::adjust(&mut network, &Params { max_steps: 20, loss: Loss::Cauchy(0.5 * reach_px), ..Params::default() });
    network.camera(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_camera_is_found_among_wrong_marks() {
        let lens = Intrinsics { radial: [-0.1, 0.0, 0.0], ..Intrinsics::pinhole(1600, 1200, 1500.0) };
        let camera = Camera { intrinsics: lens, pose: Pose::look_at(DVec3::new(5.0, 2.0, 9.0), DVec3::ZERO).unwrap() };
        let mut random = Random::new(2);
        for flat in [false, true] {
            let world: Vec<DVec3> = (0..20)
                .map(|_| DVec3::new(random.normal(), random.normal(), if flat { 0.0 } else { random.normal() }))
                .collect();
            let mut pixels: Vec<DVec2> = world.iter().map(|p| camera.project(*p).unwrap()).collect();
            for i in 0..6 {
                pixels[i * 3] += DVec2::new(40.0, -55.0);
            }
            let found = robustly(&lens, &world, &pixels, 3.0, 1000, 5).unwrap();
            assert_eq!(found.count(), 14);
            assert!((found.camera.centre() - camera.centre()).length() < 1e-6);
        }
    }

    #[test]
    fn three_points_in_one_place_or_line_give_nothing() {
        let p = DVec3::new(1.0, 2.0, 3.0);
        let d = DVec3::Z;
        assert!(three_points([p, p, DVec3::X], [d, d, d]).is_empty());
        let line = [DVec3::ZERO, DVec3::X, DVec3::X * 2.0];
        let seen = line.map(|q| q + DVec3::new(0.0, 0.0, 5.0)).map(|q| q / q.length());
        assert!(three_points(line, seen).iter().all(|pose| pose.rotation.is_finite()));
    }
}
