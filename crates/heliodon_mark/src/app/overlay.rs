//! What is drawn over a photograph, as lines in its pixels: where to look for the active point.

use super::MarkApp;
use glam::DVec2;
use heliodon_photo::epipolar::epipolar_lines;

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
