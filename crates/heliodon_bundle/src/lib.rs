//! What Heliodon keeps on disk: site.toml, the bundle's glTF profile, manifest, lapse.
