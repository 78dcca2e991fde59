//! `[budget]`: the memory that there is.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::ops::RangeInclusive;

/// The memory that a budget may give, MiB: from what the smallest bake needs to sixteen TiB.
pub(super) const MIB: RangeInclusive<u64> = 16..=16_777_216;

/// `[budget]`: the memory that the bake may take, and that the viewer has.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Budget {
    /// What `bake` and `prepare` may take, MiB. Where they would take more, they do less at once and read what rays have met from the disk rather than hold it;
    /// where that does not suffice either, they refuse before they begin. Default: as much as they need.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 16, max = 16_777_216))]
    pub bake_mib: Option<u64>,
    /// What the viewer may take for the bundle beyond what its empty window takes, MiB: `check` and `bake` warn where the bundle needs more.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 16, max = 16_777_216))]
    pub viewer_mib: Option<u64>,
}

impl Budget {
    /// Whether nothing is limited.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// Bytes that a bake may take; none where it may take what it needs.
    #[must_use]
    pub fn bake_bytes(&self) -> Option<u64> {
        self.bake_mib.map(|mib| mib << 20)
    }

    /// Bytes that the viewer may take.
    #[must_use]
    pub fn viewer_bytes(&self) -> Option<u64> {
        self.viewer_mib.map(|mib| mib << 20)
    }
}
