//! Heliodon's bake: from a site to a bundle, resumable.
