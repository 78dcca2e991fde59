//! How a bake stays within the memory that `[budget]` gives it, and whether its bundle will fit into the viewer's.

use crate::error::BakeError;
use heliodon_bundle::LightLayout;
use heliodon_bundle::manifest::Counts;
use heliodon_bundle::panorama::panorama_bytes;
use heliodon_bundle::texels::atlas_bytes;

/// What a step needs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Need {
    /// What it cannot do without.
    pub least: u64,
    /// What each thread takes while it works.
    pub thread: u64,
    /// What it holds where there is room, and reads again where there is not.
    pub kept: u64,
}

/// With what a step does its work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Means {
    /// Threads.
    pub threads: usize,
    /// Bytes of what it may keep.
    pub kept: u64,
}

impl Need {
    /// What it takes with so many threads where nothing limits it.
    pub fn with(self, threads: usize) -> u64 {
        self.least + self.kept + self.thread * threads as u64
    }

    /// As many threads as fit, up to so many, and as much kept as there is room for beside them.
    ///
    /// # Errors
    /// Where not even one thread that keeps nothing fits.
    pub fn within(self, what: &'static str, budget: Option<u64>, threads: usize) -> Result<Means, BakeError> {
        let Some(budget) = budget else { return Ok(Means { threads, kept: self.kept }) };
        let room = budget.saturating_sub(self.least);
        if room < self.thread || budget < self.least {
            let (mib, least) = (|bytes: u64| bytes.div_ceil(1 << 20), self.least + self.thread);
            let (needs, least, budget) = (mib(self.with(threads)), mib(least), budget >> 20);
            return Err(BakeError::Budget { what, needs, least, budget });
        }
        let fit = usize::try_from(room / self.thread.max(1)).unwrap_or(usize::MAX);
        // half of the room for threads, for what is not kept costs more than what is done one after the other
        let some = usize::try_from(room / 2 / self.thread.max(1)).unwrap_or(usize::MAX);
        let threads = if self.kept == 0 { fit } else { some }.clamp(1, threads);
        Ok(Means { threads, kept: self.kept.min(room - self.thread * threads as u64) })
    }
}

impl Means {
    /// Does work with these threads; where they are all that there are, with those.
    ///
    /// # Errors
    /// Those of the work, and threads that cannot be started.
    pub fn run<T: Send>(self, work: impl FnOnce() -> Result<T, BakeError> + Send) -> Result<T, BakeError> {
        if self.threads >= rayon::current_num_threads() {
            return work();
        }
        let pool = rayon::ThreadPoolBuilder::new().num_threads(self.threads).build();
        pool.map_err(|error| BakeError::Threads(error.to_string()))?.install(work)
    }
}

/// What the viewer needs for a bundle beyond what its empty window takes, as measured where a processor draws (BENCHMARKS.md, "Memory"): of the
/// temple of 450,797 vertices with coloured light of 15 functions 150 to 178 MiB, 58 of them in 136 bytes a vertex: 24, and texels of 16
/// bytes that hold a word of normal, the sky transfer as half floats, the functions (coloured ones in a word each), and the masks. An atlas of light in texels
/// (`atlas` along a side) comes to that, and a panorama (along a side of its faces).
pub(crate) fn viewer_bytes(
    counts: Counts,
    layout: LightLayout,
    texture_bytes: u64,
    [atlas, panorama]: [Option<u32>; 2],
) -> u64 {
    let functions = u64::from(layout.sun_bounce_functions);
    let bounce = if layout.channels == 3 { functions } else { functions.div_ceil(2) };
    let words = 1 + layout.transfer_floats().div_ceil(2) as u64 + bounce + layout.mask_words() as u64;
    let vertex = VIEWER_VERTEX_BYTES + words.div_ceil(TEXEL_WORDS) * TEXEL_BYTES;
    // a texture comes with its halved images
    let texels =
        atlas.map_or(0, |side| atlas_bytes(layout, [side; 2])) + panorama.map_or(0, |side| panorama_bytes(layout, side));
    VIEWER_BYTES + counts.vertices * vertex + counts.triangles * VIEWER_TRIANGLE_BYTES + texture_bytes / 3 * 4 + texels
}

/// How much a viewer shows: what is drawn, and the scan itself for eyes at rest.
pub(crate) fn shown_counts(drawn: Counts, scan: Option<Counts>) -> Counts {
    let Counts { vertices, triangles, .. } = scan.unwrap_or_default();
    Counts { vertices: drawn.vertices + vertices, triangles: drawn.triangles + triangles, ..drawn }
}

/// What is not the stone's: most of it software Vulkan's own for triangles that are being drawn.
const VIEWER_BYTES: u64 = 110 << 20;
const VIEWER_VERTEX_BYTES: u64 = 24;
const VIEWER_TRIANGLE_BYTES: u64 = 6;
const TEXEL_WORDS: u64 = 4;
const TEXEL_BYTES: u64 = 16;

/// A sentence where the viewer will need more than it may have.
pub(crate) fn viewer_doubt(budget: Option<u64>, needs: u64) -> Option<String> {
    let budget = budget.filter(|&budget| needs > budget)?;
    Some(format!(
        "the viewer will need about {} MiB for this beyond what its empty window takes, and [budget] viewer_mib in site.toml gives {}; draw fewer \
         triangles (triangles in [prepare]), bake transfer = \"mono\" or smaller textures, or allow more",
        needs.div_ceil(1 << 20),
        budget >> 20
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    const NEED: Need = Need { least: 100 << 20, thread: 10 << 20, kept: 50 << 20 };

    #[test]
    fn less_is_done_at_once_and_kept_where_there_is_less_room() {
        let within = |mib: u64| NEED.within("the light", Some(mib << 20), 4).map(|means| (means.threads, means.kept >> 20));
        assert_eq!(NEED.within("the light", None, 4).unwrap(), Means { threads: 4, kept: 50 << 20 });
        assert_eq!(within(1000).unwrap(), (4, 50));
        assert_eq!(within(160).unwrap(), (3, 30));
        assert_eq!(within(125).unwrap(), (1, 15));
        assert_eq!(within(110).unwrap(), (1, 0));
        let refused = within(109).unwrap_err().to_string();
        for word in ["the light", "190 MiB", "110", "109", "bake_mib"] {
            assert!(refused.contains(word), "{word}: {refused}");
        }
        let keeps_nothing = Need { kept: 0, ..NEED };
        assert_eq!(keeps_nothing.within("the light", Some(130 << 20), 4).unwrap().threads, 3);
    }

    #[test]
    fn work_is_done_by_as_many_threads_as_it_may_use() {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
        let threads =
            |may: usize| pool.install(|| Means { threads: may, kept: 0 }.run(|| Ok(rayon::current_num_threads()))).unwrap();
        assert_eq!([1, 2, 3, 8].map(threads), [1, 2, 3, 3]);
    }

    #[test]
    fn the_viewer_needs_what_was_measured_of_the_temple() {
        let counts = Counts { vertices: 450_797, triangles: 703_276, ..Counts::default() };
        let layout = LightLayout { sun_steps: 92, coefficients: 4, channels: 3, sun_bounce_functions: 15 };
        let needs = viewer_bytes(counts, layout, 0, [None; 2]);
        assert!((150 << 20..=178 << 20).contains(&needs), "{}", needs >> 20);
        assert_eq!(viewer_bytes(counts, layout, 3 << 20, [None; 2]) - needs, 4 << 20);
        // 12 bytes of masks on three levels, 24 of sky and 8 that it is lit into on two of a quarter, 12 x 8 of bounce and 8 of a sixteenth
        let texels = viewer_bytes(counts, layout, 0, [Some(2048), None]) - needs;
        assert_eq!(texels, (12 << 22) + (12 << 20) + (12 << 18) + (32 << 20) + (32 << 18) + (104 << 18));
        assert_eq!(viewer_doubt(None, needs), None);
        assert_eq!(viewer_doubt(Some(needs), needs), None);
        assert!(viewer_doubt(Some(100 << 20), needs).unwrap().contains("gives 100;"));
    }
}
