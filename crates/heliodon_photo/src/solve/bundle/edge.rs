//! Parallel edges as witnesses: a drawn segment must point at its axis's vanishing point.

use super::{LENS_UNKNOWNS, Network, unknowns, with_unknowns};
use crate::camera::Intrinsics;
use glam::{DMat3, DVec2, DVec3};

/// An edge drawn in a photograph that runs along an axis of the frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    /// Which photograph.
    pub view: usize,
    /// The axis in the frame, a unit vector.
    pub axis: DVec3,
    /// Both ends in the photograph.
    pub ends: [DVec2; 2],
    /// One over the standard deviation of an end's coordinate in pixels.
    pub weight: f64,
}

/// How far the first end lies from the line through the segment's middle and the vanishing point, in standard deviations.
pub(super) fn residual(network: &Network, segment: &Segment) -> f64 {
    let camera = network.camera(segment.view);
    off_line(&camera.intrinsics, segment, camera.pose.rotation * (network.frame * segment.axis))
}

/// The same for a vanishing direction in the camera's space.
pub(crate) fn off_line(lens: &Intrinsics, segment: &Segment, direction: DVec3) -> f64 {
    let Some((end, middle)) = plane_ends(lens, segment) else { return 0.0 };
    let line = middle.cross(direction);
    let norm = line.truncate().length();
    if norm < f64::MIN_POSITIVE { 0.0 } else { lens.focal_px[0] * segment.weight * line.dot(end) / norm }
}

fn plane_ends(lens: &Intrinsics, segment: &Segment) -> Option<(DVec3, DVec3)> {
    let a = lens.unproject(segment.ends[0])?;
    let b = lens.unproject(segment.ends[1])?;
    Some((a.extend(1.0), (0.5 * (a + b)).extend(1.0)))
}

/// A residual with its derivatives.
pub(super) struct Slope {
    pub(super) residual: f64,
    pub(super) pose: [f64; 6],
    pub(super) lens: [f64; LENS_UNKNOWNS],
    pub(super) frame: [f64; 3],
}

pub(super) fn slope(network: &Network, segment: &Segment, columns: &[usize]) -> Option<Slope> {
    let camera = network.camera(segment.view);
    let lens = camera.intrinsics;
    let (end, middle) = plane_ends(&lens, segment)?;
    let in_world = network.frame * segment.axis;
    let direction = camera.pose.rotation * in_world;
    let line = middle.cross(direction);
    let norm = line.truncate().length();
    if norm < f64::MIN_POSITIVE {
        return None;
    }
    let scale = lens.focal_px[0] * segment.weight;
    let dot = line.dot(end);
    let by_line = scale * (end / norm - dot / (norm * norm * norm) * DVec3::new(line.x, line.y, 0.0));
    // line = middle x direction, so d/d direction = by_line x middle
    let by_direction = by_line.cross(middle);
    let turn = direction.cross(by_direction);
    let by_world = DMat3::from_quat(camera.pose.rotation).transpose() * by_direction;
    let frame = in_world.cross(by_world);
    let mut by_lens = [0.0; LENS_UNKNOWNS];
    // Undistortion has no closed form; few edges are drawn, and central differences of a smooth function serve.
    for &column in columns {
        let values = unknowns(&lens);
        let h = if column < 3 { 1e-3 } else { 1e-6 };
        let at = |s: f64| {
            let mut changed = values;
            changed[column] += s;
            off_line(&with_unknowns(&lens, changed), segment, direction)
        };
        by_lens[column] = (at(h) - at(-h)) / (2.0 * h);
    }
    Some(Slope {
        residual: scale * dot / norm,
        pose: [turn.x, turn.y, turn.z, 0.0, 0.0, 0.0],
        lens: by_lens,
        frame: frame.to_array(),
    })
}

#[cfg(test)]
mod tests {
    use super::super::{Free, Lens, View, rotation_from_vector};
    use super::*;
    use crate::camera::Pose;

    #[test]
    fn an_edges_derivatives_agree_with_differences() {
        let lens = Intrinsics { radial: [-0.1, 0.02, 0.0], ..Intrinsics::pinhole(1200, 900, 800.0) };
        let pose = Pose::look_at(DVec3::new(3.0, 1.0, 6.0), DVec3::ZERO).unwrap();
        let network = Network {
            lenses: vec![Lens::new(lens, Free::default())],
            views: vec![View { pose, lens: 0, fixed: false }],
            frame: rotation_from_vector(DVec3::new(0.02, -0.05, 0.01)),
            ..Network::default()
        };
        let ends = [DVec2::new(300.0, 200.0), DVec2::new(420.0, 260.0)];
        let segment = Segment { view: 0, axis: DVec3::X, ends, weight: 2.0 };
        let slope = slope(&network, &segment, &[]).unwrap();
        assert!((slope.residual - residual(&network, &segment)).abs() < 1e-9);
        for i in 0..3 {
            let h = 1e-6;
            let turned = |s: f64| {
                let mut moved = network.clone();
                moved.views[0].pose.rotation = rotation_from_vector(DVec3::AXES[i] * s) * moved.views[0].pose.rotation;
                residual(&moved, &segment)
            };
            let framed = |s: f64| {
                let mut moved = network.clone();
                moved.frame = rotation_from_vector(DVec3::AXES[i] * s) * moved.frame;
                residual(&moved, &segment)
            };
            assert!((slope.pose[i] - (turned(h) - turned(-h)) / (2.0 * h)).abs() < 1e-4);
            assert!((slope.frame[i] - (framed(h) - framed(-h)) / (2.0 * h)).abs() < 1e-4);
        }
    }
}
