//! How far cameras are from known ones, once both are laid onto each other.

use glam::{DQuat, DVec3};
use heliodon_photo::camera::Camera;
use heliodon_photo::solve::Similarity;

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

/// Compares cameras with known ones, in the same order. The turn between both spaces is the mean over the cameras' own turns: places alone
/// do not tell it where they lie nearly on one line, as those of a walk along a facade do. Scale and shift are by the places.
pub fn compare(found: &[Camera], known: &[Camera]) -> Accuracy {
    let turns: Vec<DQuat> =
        found.iter().zip(known).map(|(f, k)| k.pose.rotation.conjugate() * f.pose.rotation).collect();
    let sum = turns.iter().fold(DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0), |sum, q| {
        let q = if q.dot(turns[0]) < 0.0 { -*q } else { *q };
        DQuat::from_xyzw(sum.x + q.x, sum.y + q.y, sum.z + q.z, sum.w + q.w)
    });
    let rotation = sum.normalize();
    let count = found.len() as f64;
    let middle = |all: &[Camera]| all.iter().map(Camera::centre).sum::<DVec3>() / count;
    let (here, there) = (middle(found), middle(known));
    let pairs = || found.iter().zip(known).map(|(f, k)| (rotation * (f.centre() - here), k.centre() - there));
    let scale = pairs().map(|(f, k)| f.dot(k)).sum::<f64>() / pairs().map(|(f, _)| f.length_squared()).sum::<f64>();
    let world = Similarity { scale, rotation, translation: there - scale * (rotation * here) };
    let baseline = known
        .iter()
        .flat_map(|a| known.iter().map(move |b| (a.centre() - b.centre()).length()))
        .fold(0.0, f64::max);
    let (mut turn, mut place) = ((0.0f64, 0.0), (0.0f64, 0.0));
    for (camera, truth) in found.iter().zip(known) {
        let pose = world.pose(&camera.pose);
        let between = pose.rotation * truth.pose.rotation.conjugate();
        let angle = 2.0 * DVec3::new(between.x, between.y, between.z).length().asin().to_degrees();
        let off = (pose.centre() - truth.centre()).length() / baseline;
        turn = (turn.0.max(angle), turn.1 + angle * angle / count);
        place = (place.0.max(off), place.1 + off * off / count);
    }
    Accuracy { turn_deg: turn.0, turn_rms_deg: turn.1.sqrt(), place: place.0, place_rms: place.1.sqrt() }
}
