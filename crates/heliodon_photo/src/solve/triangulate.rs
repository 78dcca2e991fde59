//! Points from their marks in photographs whose cameras are known.

use crate::camera::{Camera, Pose};
use glam::{DMat3, DVec2, DVec3};

/// The point nearest to some rays, squared distances weighted; `None` where the rays are parallel.
pub(super) fn nearest_to_rays(rays: &[(DVec3, DVec3)]) -> Option<DVec3> {
    let (mut normal, mut right) = (DMat3::ZERO, DVec3::ZERO);
    let origin = rays.first()?.0;
    for (from, direction) in rays {
        let d = *direction;
        let across = DMat3::IDENTITY - DMat3::from_cols(d * d.x, d * d.y, d * d.z);
        normal += across;
        right += across * (*from - origin);
    }
    let inverse = normal.inverse();
    let point = origin + inverse * right;
    (normal.determinant() > 1e-12 && point.is_finite()).then_some(point)
}

/// The point of two directions in a pair of cameras, in the first one's space.
pub(super) fn of_pair(second_from_first: &Pose, first: DVec3, second: DVec3) -> Option<DVec3> {
    let back = second_from_first.rotation.conjugate();
    nearest_to_rays(&[(DVec3::ZERO, first), (second_from_first.centre(), back * second)])
}

/// A point found robustly, and which marks agree with it.
pub(super) struct Found {
    pub(super) position: DVec3,
    pub(super) agrees: Vec<bool>,
    /// Which marks agree on the point of each pair that was tried, where two or more do.
    pub(super) sets: Vec<Vec<bool>>,
}

/// What a point must have.
#[derive(Clone, Copy)]
pub(super) struct Gate {
    pub(super) reach_px: f64,
    pub(super) min_parallax_rad: f64,
}

/// How many pairs of rays are tried: with a third of the marks wrong, that many miss all right pairs once in 10^17.
const MOST_PAIRS: usize = 60;

/// Tries pairs of rays with enough parallax, keeps the point that most marks agree with (of equals the one of least error), and moves it to
/// where its pictures' squared errors are least. A point by hand has so few marks that all pairs are tried and nothing is drawn by chance.
pub(super) fn robustly(cameras: &[Camera], pixels: &[DVec2], gate: Gate) -> Option<Found> {
    let rays: Vec<(DVec3, DVec3)> = cameras.iter().zip(pixels).map(|(c, p)| c.ray(*p)).collect();
    let reach = gate.reach_px * gate.reach_px;
    let error = |point: DVec3, i: usize| match cameras[i].project(point) {
        Some(picture) => (picture - pixels[i]).length_squared(),
        None => f64::INFINITY,
    };
    let mut best: Option<(f64, DVec3)> = None;
    let mut sets: Vec<Vec<bool>> = Vec::new();
    let all = rays.len() * rays.len().saturating_sub(1) / 2;
    let stride = all.div_ceil(MOST_PAIRS).max(1);
    let pairs = (0..rays.len()).flat_map(|i| (i + 1..rays.len()).map(move |j| (i, j)));
    for (i, j) in pairs.step_by(stride) {
        if angle(rays[i].1, rays[j].1) < gate.min_parallax_rad {
            continue;
        }
        let Some(point) = nearest_to_rays(&[rays[i], rays[j]]) else { continue };
        let agrees: Vec<bool> = (0..rays.len()).map(|k| error(point, k) < reach).collect();
        if agrees.iter().filter(|a| **a).count() >= 2 {
            sets.push(agrees);
        }
        let cost: f64 = (0..rays.len()).map(|k| error(point, k).min(reach)).sum();
        if best.is_none_or(|(least, _)| cost < least) {
            best = Some((cost, point));
        }
    }
    let (_, mut position) = best?;
    let mut agrees = Vec::new();
    // what agrees depends on the place and the place on what agrees
    for _ in 0..3 {
        agrees = (0..rays.len()).map(|k| error(position, k) < reach).collect();
        let chosen: Vec<usize> = (0..rays.len()).filter(|k| agrees[*k]).collect();
        if chosen.len() < 2 {
            return None;
        }
        position = refined(cameras, pixels, &chosen, position);
    }
    let wide = (0..rays.len())
        .flat_map(|i| (i + 1..rays.len()).map(move |j| (i, j)))
        .any(|(i, j)| agrees[i] && agrees[j] && angle(rays[i].1, rays[j].1) >= gate.min_parallax_rad);
    wide.then_some(Found { position, agrees, sets })
}

/// The angle between unit vectors, exact for small ones.
pub(super) fn angle(a: DVec3, b: DVec3) -> f64 {
    libm::atan2(a.cross(b).length(), a.dot(b))
}

/// Gauss-Newton on the pictures' errors; keeps the start where a step does not help.
fn refined(cameras: &[Camera], pixels: &[DVec2], chosen: &[usize], start: DVec3) -> DVec3 {
    let cost = |p: DVec3| {
        let each = |k: &usize| cameras[*k].project(p).map_or(f64::INFINITY, |q| (q - pixels[*k]).length_squared());
        chosen.iter().map(each).sum::<f64>()
    };
    let (mut point, mut least) = (start, cost(start));
    for _ in 0..10 {
        let (mut normal, mut gradient) = (DMat3::ZERO, DVec3::ZERO);
        for &k in chosen {
            let Some((picture, rows)) = super::bundle::point_slope(&cameras[k], point) else { continue };
            for (row, r) in rows.into_iter().zip((picture - pixels[k]).to_array()) {
                normal += DMat3::from_cols(row * row.x, row * row.y, row * row.z);
                gradient += row * r;
            }
        }
        let next = point - normal.inverse() * gradient;
        let next_cost = cost(next);
        if !(next_cost < least) {
            break;
        }
        let done = next_cost > least * (1.0 - 1e-10);
        (point, least) = (next, next_cost);
        if done {
            break;
        }
    }
    point
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Intrinsics;

    #[test]
    fn one_wrong_mark_of_five_does_not_move_a_point() {
        let truth = DVec3::new(0.4, 1.2, -0.3);
        let cameras: Vec<Camera> = (0..5)
            .map(|i| {
                let a = f64::from(i) * 0.3;
                let pose = Pose::look_at(DVec3::new(9.0 * a.sin(), 2.0, 9.0 * a.cos()), DVec3::ZERO).unwrap();
                Camera { intrinsics: Intrinsics::pinhole(1000, 800, 900.0), pose }
            })
            .collect();
        let mut pixels: Vec<DVec2> = cameras.iter().map(|c| c.project(truth).unwrap()).collect();
        pixels[2] += DVec2::new(15.0, 60.0);
        let gate = Gate { reach_px: 4.0, min_parallax_rad: 0.02 };
        let found = robustly(&cameras, &pixels, gate).unwrap();
        assert!((found.position - truth).length() < 1e-8);
        assert_eq!(found.agrees, [true, true, false, true, true]);
        assert!(found.sets.iter().filter(|s| s[2]).all(|s| s.iter().filter(|a| **a).count() < 4));
        // Two photographs from one place say nothing of a depth.
        assert!(robustly(&[cameras[0], cameras[0]], &[pixels[0], pixels[0]], gate).is_none());
    }
}
