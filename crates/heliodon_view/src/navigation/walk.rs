//! How a visitor moves: through the air, or on foot over the ground and along walls.

use crate::stage::ground::{Ground, Touch};
use glam::Vec3;

/// Eyes above feet, metres.
pub const EYE_HEIGHT_M: f32 = 1.65;
/// The highest step that feet take: the Parthenon's own are 0.52 m.
pub(crate) const STEP_UP_M: f32 = 0.6;
/// What keeps the eyes out of walls.
pub(crate) const BODY_RADIUS_M: f32 = 0.3;
/// How deep below the feet ground is looked for; without any, a visitor stays at his height.
pub(crate) const FALL_M: f32 = 200.0;
const GRAVITY_M_S2: f32 = 9.81;
/// Stairs are taken at this rate, per second.
const RISE_RATE: f32 = 12.0;

/// Heights, below the eyes, at which walls are felt: the head, which beams would hit, the chest, and just above the highest step.
const FELT_BELOW_EYES_M: [f32; 3] = [0.0, 0.4, EYE_HEIGHT_M - STEP_UP_M - 0.05];

/// Vertical motion of someone on foot.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Fall {
    speed_m_s: f32,
}

/// Where an eye at `eye` gets that wants to move by the horizontal `wish` in `seconds` on foot.
#[must_use]
pub fn walk(ground: &Ground, eye: Vec3, wish: Vec3, seconds: f32, fall: &mut Fall) -> Vec3 {
    stand(ground, eye + unblocked(ground, eye, Vec3::new(wish.x, 0.0, wish.z)), None, seconds, fall)
}

/// Where an eye gets in `seconds` whose feet look for ground, or for something else at the height `on` if that is higher.
pub(crate) fn stand(ground: &Ground, eye: Vec3, on: Option<f32>, seconds: f32, fall: &mut Fall) -> Vec3 {
    let mut eye = eye;
    let knee = Vec3::new(eye.x, eye.y - EYE_HEIGHT_M + STEP_UP_M, eye.z);
    let stone = ground.cast(knee, Vec3::NEG_Y, FALL_M).map(|below| knee.y - below.distance);
    let Some(floor) = stone.into_iter().chain(on).reduce(f32::max) else {
        *fall = Fall::default();
        return eye;
    };
    let standing = floor + EYE_HEIGHT_M;
    if standing >= eye.y {
        fall.speed_m_s = 0.0;
        eye.y += (standing - eye.y) * (1.0 - (-RISE_RATE * seconds).exp());
    } else {
        fall.speed_m_s += GRAVITY_M_S2 * seconds;
        eye.y = (eye.y - fall.speed_m_s * seconds).max(standing);
    }
    eye
}

/// What of a horizontal step no wall takes away: twice it may slide along one.
fn unblocked(ground: &Ground, eye: Vec3, wish: Vec3) -> Vec3 {
    let mut step = wish;
    for _ in 0..2 {
        let Some(direction) = step.try_normalize() else { return Vec3::ZERO };
        let length = step.length();
        let Some(touch) = nearest_wall(ground, eye, direction, length) else { return step };
        let Some(wall) = Vec3::new(touch.normal.x, 0.0, touch.normal.z).try_normalize() else { return step };
        let into = step.dot(wall).min(0.0);
        step -= wall * into;
    }
    // Caught in a corner.
    let blocked = step.try_normalize().is_some_and(|direction| nearest_wall(ground, eye, direction, step.length()).is_some());
    if blocked { Vec3::ZERO } else { step }
}

/// What a body meets first on a step of `length`.
fn nearest_wall(ground: &Ground, eye: Vec3, direction: Vec3, length: f32) -> Option<Touch> {
    FELT_BELOW_EYES_M
        .into_iter()
        .filter_map(|down| ground.cast(eye - Vec3::Y * down, direction, length + BODY_RADIUS_M))
        .min_by(|a, b| a.distance.total_cmp(&b.distance))
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::daylight::chunk::KeptChunk;
    use crate::daylight::cluster::cluster;
    use std::sync::Arc;

    pub(crate) fn quad(corners: [Vec3; 4]) -> Arc<KeptChunk> {
        let made = cluster(&corners, &[[0, 1, 2], [0, 2, 3]]);
        let positions: Vec<Vec3> = made.vertices.iter().map(|&v| corners[v as usize]).collect();
        let bounds = positions.iter().fold((corners[0], corners[0]), |(a, b), &p| (a.min(p), b.max(p)));
        Arc::new(KeptChunk { positions, indices: made.indices, clusters: made.clusters, bounds, albedo: Vec::new() })
    }

    pub(crate) fn court() -> Ground {
        let mut ground = Ground::default();
        let flat = |y: f32, x0: f32, x1: f32| [[x0, -9.0], [x0, 9.0], [x1, 9.0], [x1, -9.0]].map(|[x, z]| Vec3::new(x, y, z));
        ground.push(quad(flat(0.0, -9.0, 9.0)));
        ground.push(quad(flat(0.5, 2.0, 9.0)));
        let wall = [[0.0, -9.0], [3.0, -9.0], [3.0, 9.0], [0.0, 9.0]].map(|[y, z]| Vec3::new(6.0, y, z));
        ground.push(quad(wall));
        ground
    }

    fn wander(from: Vec3, wish: Vec3, count: usize) -> Vec3 {
        let (ground, mut fall) = (court(), Fall::default());
        (0..count).fold(from, |eye, _| walk(&ground, eye, wish * 0.02, 0.02, &mut fall))
    }

    #[test]
    fn feet_come_down_and_climb_a_step() {
        let down = wander(Vec3::new(-5.0, 4.0, 0.0), Vec3::ZERO, 200);
        assert!((down.y - EYE_HEIGHT_M).abs() < 1e-3);
        let up = wander(down, Vec3::X * 1.5, 300);
        assert!(up.x > 3.0 && (up.y - 0.5 - EYE_HEIGHT_M).abs() < 1e-2, "{up}");
    }

    #[test]
    fn walls_stop_and_let_slide() {
        let at = wander(Vec3::new(4.0, 0.5 + EYE_HEIGHT_M, 0.0), Vec3::new(1.5, 0.0, 1.0), 150);
        assert!(at.x < 6.0 - BODY_RADIUS_M + 0.05 && at.z > 2.0, "{at}");
    }

    #[test]
    fn beams_stop_the_head() {
        let mut ground = court();
        // From a hand above the chest to a hand above the eyes.
        let beam = [[1.5, -9.0], [1.8, -9.0], [1.8, 9.0], [1.5, 9.0]].map(|[y, z]| Vec3::new(0.0, y, z));
        ground.push(quad(beam));
        let mut fall = Fall::default();
        let from = Vec3::new(-2.0, EYE_HEIGHT_M, 0.0);
        let at = (0..200).fold(from, |eye, _| walk(&ground, eye, Vec3::X * 0.03, 0.02, &mut fall));
        assert!(at.x < -BODY_RADIUS_M + 0.05, "{at}");
    }

    #[test]
    fn without_ground_the_height_stays() {
        assert_eq!(wander(Vec3::new(50.0, 3.0, 0.0), Vec3::ZERO, 50).y, 3.0);
    }
}
