//! Why a bake ends early. Each error names its file, place and remedy itself; here they are only joined.

use std::path::PathBuf;

/// Why a bake, an estimate or a check ends early.
#[derive(Debug, thiserror::Error)]
pub enum BakeError {
    /// `site.toml` asks for what cannot be done.
    #[error(transparent)]
    Site(#[from] heliodon_bundle::ConfigError),
    /// A mesh cannot be read.
    #[error(transparent)]
    Mesh(#[from] heliodon_mesh::import::ImportError),
    /// The meshes do not fit into one.
    #[error("the parts do not fit into one site: {0}; leave some out, or join their materials")]
    Join(#[from] heliodon_mesh::MeshError),
    /// Large triangles cannot be split.
    #[error("{0}; or write edge_px = 0 into [prepare]")]
    Split(#[from] heliodon_prepare::split::SplitError),
    /// Cleaning has left no triangle.
    #[error(
        "nothing is left of the {triangles} triangles of {files} after cleaning: all are without area, doubled, buried or small and loose; mend the files, or write clean = false (solids = false, or a smaller isolated_m) into [prepare] of site.toml"
    )]
    NothingLeft {
        /// Triangles in the files.
        triangles: u64,
        /// The files, as people write them.
        files: String,
    },
    /// An image cannot be read.
    #[error(transparent)]
    Image(#[from] heliodon_image::ImageError),
    /// The sky cannot be made.
    #[error(transparent)]
    Sky(#[from] heliodon_sky::SkyError),
    /// The geometry cannot be made ready for rays.
    #[error("the geometry cannot be prepared for rays: {0}")]
    Rays(#[from] heliodon_rays::BuildError),
    /// The solver refuses its input.
    #[error("the light cannot be solved: {0}")]
    Light(#[from] heliodon_light::LightError),
    /// The weather's solver refuses its input.
    #[error("the weathering cannot be solved: {0}")]
    Weather(#[from] heliodon_lightmap::weathering::WeatherError),
    /// A mesh that shows what was found cannot be written.
    #[error(transparent)]
    Export(#[from] heliodon_mesh::export::ExportError),
    /// Finished work cannot be kept.
    #[error(transparent)]
    Cache(#[from] crate::cache::CacheError),
    /// Shards and their merge do not agree.
    #[error(transparent)]
    Merge(#[from] crate::merge::MergeError),
    /// The bundle cannot be written.
    #[error("the bundle cannot be written: {0} (nothing that was there has been touched)")]
    Bundle(#[from] heliodon_bundle::WriteError),
    /// The bundle that is there cannot be read.
    #[error(transparent)]
    OldBundle(#[from] heliodon_bundle::ReadError),
    /// A file was written while it was read.
    #[error("{}: was changed while it was read; run the same again once nobody writes it", path.display())]
    Changed {
        /// The file.
        path: PathBuf,
    },
    /// What this bake has kept until it would need it is gone.
    #[error("{}: what the bake kept there is missing or damaged; run it again: it goes on where it stopped", path.display())]
    Lost {
        /// The file, or those that begin so.
        path: PathBuf,
    },
    /// A step needs more memory than `[budget]` gives.
    #[error(
        "{what} would take about {needs} MiB of memory, {least} at the least, and [budget] bake_mib in site.toml gives {budget}; allow more, bake on a machine that has more, or make it smaller: fewer triangles (in the files, or [prepare]), transfer = \"mono\", fewer sun_steps"
    )]
    Budget {
        /// What.
        what: &'static str,
        /// MiB that it would take.
        needs: u64,
        /// MiB that it takes where it does as little at once as it can and keeps nothing.
        least: u64,
        /// MiB that it may take.
        budget: u64,
    },
    /// Fewer threads than there are cannot be started.
    #[error("the threads cannot be started: {0}")]
    Threads(String),
    /// A file cannot be read.
    #[error("{}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the operating system said.
        source: std::io::Error,
    },
}
