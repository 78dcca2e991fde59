//! What is drawn over a photograph, as lines in its pixels: worked out from what was solved.

use super::MarkApp;
use crate::solving::{Outcome, Wire};
use glam::DVec2;
use heliodon_photo::camera::Camera;
use heliodon_photo::epipolar::epipolar_lines;

/// Pieces that a wire is cut into, for lenses that bend.
const PIECES: usize = 12;

/// A line of the model in a photograph.
pub(super) struct Drawn {
    pub line: Vec<DVec2>,
    pub is_inner: bool,
}

/// The model's lines as a camera sees them.
pub(super) fn model_lines(outcome: &Outcome, camera: &Camera) -> Vec<Drawn> {
    let pieces = if camera.intrinsics.is_undistorted() { 1 } else { PIECES };
    let mut drawn = Vec::new();
    for Wire { ends: [a, b], is_inner } in &outcome.wires {
        let mut line = Vec::new();
        for i in 0..=pieces {
            match camera.project(*a + (*b - *a) * (i as f64 / pieces as f64)) {
                Some(pixel) => line.push(pixel),
                None if line.len() > 1 => drawn.push(Drawn { line: std::mem::take(&mut line), is_inner: *is_inner }),
                None => line.clear(),
            }
        }
        if line.len() > 1 {
            drawn.push(Drawn { line, is_inner: *is_inner });
        }
    }
    drawn
}

impl MarkApp {
    /// Where the active point has to lie in a photograph, by its marks in the others: each mark's name and its line.
    pub(super) fn lines_in(&self, photo: &str) -> Vec<(String, Vec<Vec<DVec2>>)> {
        let (Some(outcome), Some(point)) =
            (&self.outcome, self.drag.as_ref().map(|drag| &drag.point).or(self.active_point.as_ref()))
        else {
            return Vec::new();
        };
        let Some(camera) = outcome.camera(photo) else { return Vec::new() };
        let others = self.document.project().file.photo.iter().map(|entry| entry.name()).filter(|name| *name != photo);
        let line = |other: &str| {
            let lines = epipolar_lines(outcome.camera(other)?, self.mark(point, other)?, camera);
            (!lines.is_empty()).then(|| (other.to_owned(), lines))
        };
        others.filter_map(line).collect()
    }

    /// Where a solved point's picture is.
    pub(super) fn predicted(&self, photo: &str, point: &str) -> Option<DVec2> {
        let outcome = self.outcome.as_ref()?;
        outcome.camera(photo)?.project(outcome.position_m(point)?)
    }
}
