//! The parts that a procedural monument is made of.

use crate::Mesh;

/// What a part of the site is, as the site file names it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PartRole {
    /// The monument as a scanner would see it.
    Scan,
    /// What it stands on.
    Ground,
    /// What lies about, or was rebuilt with few polygons.
    Filling,
    /// What stands in it and could be carried away.
    Prop,
}

impl PartRole {
    /// The word in `site.toml`.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Scan => "scan",
            Self::Ground => "ground",
            Self::Filling => "filling",
            Self::Prop => "prop",
        }
    }
}

/// One mesh of the site.
#[derive(Clone, Debug)]
pub struct SitePart {
    /// A short name, fit for a file.
    pub name: &'static str,
    /// What it is.
    pub role: PartRole,
    /// Positions, normals, linear vertex colours and triangles; closed solids, counter-clockwise seen from outside.
    pub mesh: Mesh,
}
