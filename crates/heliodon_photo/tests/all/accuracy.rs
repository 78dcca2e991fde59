//! How far cameras are from known ones, once both are laid onto each other.

use glam::{DQuat, DVec3};
use heliodon_photo::camera::Camera;
use heliodon_photo::solve::fit_similarity;

/// Differences of cameras to known ones.
#[derive(Clone, Copy, Debug)]
pub struct Accuracy {
    /// The worst turn, degrees.
    pub turn_deg: f64,
    /// The root of the mean squared turn, degrees.
    pub turn_rms_deg: f64,
    /// The worst distance of places, as a part of the longest baseline.
    pub place: f64,
    /// The root of the mean squared distance.
    pub place_rms: f64,
}

/// Compares cameras with known ones, in the same order. Places are compared after the similarity that fits places best, turns after the turn that
/// fits turns best: places alone do not tell it where they lie nearly on one line, as those of a walk along a facade do.
pub fn compare(found: &[Camera], known: &[Camera]) -> Accuracy {
    let places: Vec<(DVec3, DVec3)> = found.iter().zip(known).map(|(f, k)| (f.centre(), k.centre())).collect();
    let similarity = fit_similarity(&places).unwrap();
    let all = || known.iter().map(Camera::centre);
    let baseline = all().flat_map(|a| all().map(move |b| (a - b).length())).fold(0.0, f64::max);
    let place = worst_and_rms(places.iter().map(|(f, k)| (similarity.point(*f) - *k).length() / baseline));
    let turns: Vec<DQuat> = found.iter().zip(known).map(|(f, k)| k.pose.rotation.conjugate() * f.pose.rotation).collect();
    let sum =
        turns.iter().fold(DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0), |sum, q| sum + if q.dot(turns[0]) < 0.0 { -*q } else { *q });
    let mean = sum.normalize();
    let turn = worst_and_rms(turns.iter().map(|q| {
        let off = mean.conjugate() * *q;
        2.0 * DVec3::new(off.x, off.y, off.z).length().asin().to_degrees()
    }));
    Accuracy { turn_deg: turn.0, turn_rms_deg: turn.1, place: place.0, place_rms: place.1 }
}

fn worst_and_rms(all: impl Iterator<Item = f64>) -> (f64, f64) {
    let (count, worst, sum) = all.fold((0.0, 0.0f64, 0.0), |(n, worst, sum), x| (n + 1.0, worst.max(x), sum + x * x));
    (worst, f64::sqrt(sum / count))
}
