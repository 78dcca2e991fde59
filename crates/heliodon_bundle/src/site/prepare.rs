//! `[prepare]`: from the geometry as it was scanned or modelled to the geometry that is drawn.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// `[prepare]`: how geometry is cleaned and reduced to what a visitor can tell apart. Without this table it is baked and drawn as it comes.
///
/// What is left out is left out of the picture only: light is baked among all of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Prepare {
    /// Whether vertices are welded, degenerate and doubled faces dropped, loose pieces too where `isolated_m` says so, and T-junctions of fillings and props mended.
    pub clean: bool,
    /// Vertices nearer than this become one, metres. 0 joins only those at the same place, and of all but scans those within 0.01 mm.
    #[schemars(range(min = 0, max = 1))]
    pub weld_m: f64,
    /// Loose pieces whose box has a smaller diagonal than this are left out, metres. 0 keeps all.
    #[schemars(range(min = 0, max = 1000))]
    pub isolated_m: f64,
    /// What is done about faces whose fronts disagree with their neighbours'.
    pub winding: Winding,
    /// Whether closed bodies among fillings and props that run into each other within a part are united, and what is buried in others left out; what those of several parts bury of each other is not drawn.
    pub solids: bool,
    /// How far, in pixels of `[display]` seen from the nearest room, any vertex of the original may lie off what is simplified. 0 simplifies nothing.
    #[schemars(range(min = 0, max = 100))]
    pub error_px: f64,
    /// The edge length, in the same pixels, that triangles are simplified to, and that larger ones are split to: light is stored at
    /// vertices, so this is the grain of shadows. Parts that are lit by texels are not split. 0 splits nothing, and lets
    /// edges grow as long as `error_px` allows, to fifteen times that.
    #[schemars(range(min = 0, max = 1000))]
    pub edge_px: f64,
    /// No eye is taken to come nearer to stone than this, metres: what lies in a room has no finer grain.
    #[schemars(range(max = 1000), extend("exclusiveMinimum" = 0))]
    pub nearest_m: f64,
    /// As `error_px`, in metres, for a site without rooms. Default: nothing is simplified there.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0, max = 1000))]
    pub error_m: Option<f64>,
    /// As `edge_px`, in metres, for a site without rooms. Default: nothing is split there, and edges
    /// grow as long as `error_m` allows.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0, max = 10000))]
    pub edge_m: Option<f64>,
    /// About so many triangles are drawn: where more would be left, `error_px` and `edge_px` (or those in metres) grow together until
    /// it fits, those of ground alone until they are eight times as large (more where there is far more ground than stone), then all. 0 sets no limit.
    pub triangles: u64,
    /// Whether faces that no eye in any room can see are left out.
    pub purge: bool,
    /// Rings of neighbours that are kept around what is seen.
    #[schemars(range(max = 16))]
    pub ring: u32,
    /// How much is looked at before a face counts as one that nobody sees, and how many pixels of random frames may lack one afterwards.
    #[serde(skip_serializing_if = "PurgeEffort::is_usual")]
    pub purge_effort: PurgeEffort,
    /// Texels along the side of each of six faces of a cube around the middle of the site's one room, in which what that sees of the original is laid over what is drawn: its light,
    /// its normals, its colours. The display's `height_px` over the tangent of half its `fov_deg` makes texels as large as its pixels. A multiple of 16, up to 2,048; 0 makes none.
    #[serde(skip_serializing_if = "is_none")]
    #[schemars(range(max = 2048))]
    pub panorama: u32,
    /// Whether the scan itself is kept beside what is drawn of it, with its own light at each of its vertices, for eyes at rest: all of the original, as it was cleaned and split, that
    /// stands behind what is drawn. Parts that are lit by texels or have textures are not in it.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub scan: bool,
}

impl Prepare {
    /// Whether anything shows what was scanned besides what is drawn of it.
    #[must_use]
    pub fn shows_original(&self) -> bool {
        self.scan || self.panorama > 0
    }
}

/// Sites without it are written as they were before there was any.
fn is_none(panorama: &u32) -> bool {
    *panorama == 0
}

impl Default for Prepare {
    fn default() -> Self {
        Self {
            clean: true,
            weld_m: 0.0,
            isolated_m: 0.0,
            winding: Winding::Mend,
            solids: true,
            error_px: 1.0,
            edge_px: 5.0,
            nearest_m: 1.0,
            error_m: None,
            edge_m: None,
            triangles: 700_000,
            purge: true,
            ring: 1,
            purge_effort: PurgeEffort::Usual,
            panorama: 0,
            scan: false,
        }
    }
}

/// How much is looked at before a face counts as one that nobody sees. More takes longer, and misses fewer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum PurgeEffort {
    /// For a first look: one pixel in 10,000 may be wrong.
    Preview,
    /// For delivery: one in 200,000.
    #[default]
    Usual,
    /// For what is kept for good: one in a million. Pictures have four times the pixels, and more of them are drawn.
    Archival,
}

impl PurgeEffort {
    /// Whether it is what sites have that say nothing of it; these are written as they were before there was any.
    #[must_use]
    pub fn is_usual(&self) -> bool {
        *self == Self::Usual
    }
}

/// What is done about faces whose fronts disagree with their neighbours'.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Winding {
    /// They are turned to agree; closed bodies get their fronts outside.
    #[default]
    Mend,
    /// They are told of and left.
    Report,
}
