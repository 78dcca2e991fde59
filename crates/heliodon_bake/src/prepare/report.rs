//! What preparation found and did, in all.

use super::PartReport;
use crate::memory::peak_resident_bytes;
use crate::scene::Scene;
use heliodon_prepare::purge::PurgeReport;
use serde::Serialize;

/// What preparation found and did.
#[derive(Clone, Debug, Default, Serialize)]
pub struct PrepareReport {
    /// Part by part.
    pub parts: Vec<PartReport>,
    /// What the purge did; none where there are no rooms, or none is asked for.
    pub purge: Option<PurgeReport>,
    /// Triangles in the files.
    pub triangles_read: u64,
    /// Triangles that rays of light meet.
    pub triangles_original: u64,
    /// Triangles that are drawn.
    pub triangles_drawn: u64,
    /// Triangles that are not drawn and hold the light that they reflect.
    pub triangles_hidden: u64,
    /// Vertices at which light is solved.
    pub vertices: u64,
    /// Seconds that each step over all parts took.
    pub seconds: Vec<(String, f64)>,
    /// The most memory that the process has needed so far, where the system tells.
    pub peak_memory_bytes: Option<u64>,
}

impl PrepareReport {
    /// Counts what has become of the parts.
    pub(super) fn count(&mut self, scene: &Scene) {
        for (part, range) in self.parts.iter_mut().zip(&scene.parts) {
            part.triangles_drawn = range.drawn as u64;
            part.triangles_hidden = (range.triangles.len() - range.drawn) as u64;
        }
        let sum = |of: fn(&PartReport) -> u64| self.parts.iter().map(of).sum();
        self.triangles_read = sum(|part| part.triangles_read);
        self.triangles_original = sum(|part| part.triangles_original);
        self.triangles_drawn = sum(|part| part.triangles_drawn);
        self.triangles_hidden = sum(|part| part.triangles_hidden);
        self.vertices = scene.mesh.positions.len() as u64;
        self.peak_memory_bytes = peak_resident_bytes();
    }
}
