//! What covers say of the stone's chunks: which are there, which can be seen through, and which pipelines they need.

use super::gpu::{CoversGpu, Sight};
use crate::daylight::key::{STONES, StoneKind, Subject};
use crate::daylight::pages::GpuChunk;
use crate::daylight::view::ClusterRef;
use glam::Vec3;

impl CoversGpu {
    /// Of these clusters those that are there: not of parts that have faded wholly.
    #[must_use]
    pub fn there(&self, chunks: &[GpuChunk], mut clusters: Vec<ClusterRef>) -> Vec<ClusterRef> {
        if !self.parts().is_empty() {
            clusters.retain(|one| self.part(chunks[one.chunk as usize].part).sight != Sight::Hidden);
        }
        clusters
    }

    /// Boxes around the chunks of parts of which something is not there.
    #[must_use]
    pub fn faded(&self, chunks: &[GpuChunk]) -> Vec<(Vec3, Vec3)> {
        if self.parts().is_empty() {
            return Vec::new();
        }
        let faded = chunks.iter().filter(|chunk| self.part(chunk.part).sight != Sight::Whole);
        faded.map(|chunk| chunk.kept.bounds).collect()
    }

    /// Of which stone there is any that wears something, actors among it.
    #[must_use]
    pub fn subjects(&self, chunks: &[GpuChunk]) -> [bool; STONES] {
        let mut worn = [false; STONES];
        if self.any() {
            let dressed = chunks.iter().filter(|chunk| self.part(chunk.part).slot > 0);
            dressed.for_each(|chunk| worn[Subject::stone_index(chunk.kind, chunk.closed)] = true);
            for (kind, of_actors) in [StoneKind::Plain, StoneKind::Textured].into_iter().zip(self.actors()) {
                worn[Subject::stone_index(kind, true)] |= of_actors;
            }
        }
        worn
    }
}
