//! What can go wrong with a sky.

/// A sky that could not be made: what is wrong, and what to do.
#[derive(Debug, thiserror::Error)]
pub enum SkyError {
    /// An image could not be read or written.
    #[error(transparent)]
    Image(#[from] heliodon_image::ImageError),
    /// A probe's shape does not go with its mapping.
    #[error("{name}: {problem}; {remedy}")]
    Probe {
        /// The file.
        name: String,
        /// What is wrong.
        problem: String,
        /// What to do.
        remedy: &'static str,
    },
    /// A setting has no meaning.
    #[error("{setting}: {problem}; {remedy}")]
    Setting {
        /// The setting, as in `site.toml`.
        setting: &'static str,
        /// What is wrong.
        problem: String,
        /// What to do.
        remedy: &'static str,
    },
    /// The receiver of the sky maps failed.
    #[error("sky map {name}: {problem}")]
    Map {
        /// The map's name.
        name: String,
        /// What the receiver said.
        problem: String,
    },
}

impl SkyError {
    /// A setting that has no meaning, with what to do.
    pub fn setting(setting: &'static str, problem: impl Into<String>, remedy: &'static str) -> Self {
        Self::Setting { setting, problem: problem.into(), remedy }
    }

    pub(crate) fn no_probes() -> Self {
        Self::setting("probes", "there is none", "name at least one .hdr or .exr file")
    }
}
