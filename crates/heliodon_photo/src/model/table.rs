//! What a project file says of its model: the `[[shape]]` tables.
//!
//! ```toml
//! [[shape]]
//! name = "corner column"
//! kind = "column"
//! bottom = ["base west", "base south"]
//! top = ["neck west", "neck south"]
//! sides = 20
//! watertight = true
//! edges = [{ photograph = "north-east.jpg", from = [812.0, 300.5], to = [808.2, 1204.0] }]
//! repeat = { count = 8, step = ["base west", "second base west"] }
//! ```

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// What a shape is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// A polygon whose vertices are `points`, in order. Polygons of one part share the vertices that they name alike.
    Polygon,
    /// A box. `points` are its eight corners: the bottom ones counter-clockwise seen from above, then those above them; "-" stands for one that is not
    /// marked.
    Box,
    /// A roof of two slopes. `points` are four eaves counter-clockwise seen from above, of which the first two lie along the ridge, then the ridge's ends:
    /// the one at the side of the first eaves' corner first.
    Gable,
    /// A round shaft of one radius; `bottom` and `top` lie on its rims, `points` anywhere on it.
    Cylinder,
    /// A round shaft that tapers; as a cylinder.
    Column,
    /// A ring's segment with depth: `inner` and `outer` lie on the front's edges, `inner` from one springing to the other, `back` on the back.
    Arch,
    /// A profile turned about an axis: `rings` from the bottom up, the points of each at one height and one distance from the axis.
    Revolution,
    /// A polygon of `points` drawn along the way from the first to the second name of `along`.
    Extrusion,
}

/// One `[[shape]]`.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ShapeRow {
    /// What messages call it.
    pub name: String,
    /// What it is.
    pub kind: Kind,
    /// The mesh that it goes into; shapes without have one of their own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub part: Option<String>,
    /// Names of points, as the kind asks.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub points: Vec<String>,
    /// Points on a box's or a roof's faces: `bottom`, `top`, `side-01`, `side-12`, `side-23`, `side-30`, named by the bottom corners that they run between.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub on: BTreeMap<String, Vec<String>>,
    /// Points on a shaft's lower rim.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub bottom: Vec<String>,
    /// Points on a shaft's upper rim.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub top: Vec<String>,
    /// Points on an arch's inner edge, in order.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub inner: Vec<String>,
    /// Points on its outer edge.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub outer: Vec<String>,
    /// Points on its back.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub back: Vec<String>,
    /// The rings of a profile.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub rings: Vec<Vec<String>>,
    /// Two points whose difference an extrusion is drawn along.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub along: Option<[String; 2]>,
    /// Two points near the axis of what is round, to start from; needed where rings have fewer than three points.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub axis: Option<[String; 2]>,
    /// Where edges were marked: where what is round ends to the eye, left and right; those between two corners of a box, a roof, a polygon or what is drawn
    /// from one; those of an arch's front.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub edges: Vec<EdgeRow>,
    /// An arch's depth where no point of its back is marked, metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub depth_m: Option<f64>,
    /// Whether its axis, or its sides, are plumb.
    #[serde(default, skip_serializing_if = "is_no")]
    pub upright: bool,
    /// Whether a polygon is laid onto its best plane; its vertices then are no longer the named points.
    #[serde(default, skip_serializing_if = "is_no")]
    pub flatten: bool,
    /// Whether a polygon's front is where its points run counter-clockwise. Without, it is where the photographs are that show them: not so of a roof that all
    /// of them saw from below.
    #[serde(default, skip_serializing_if = "is_no")]
    pub as_listed: bool,
    /// Whether a column's shaft swells.
    #[serde(default, skip_serializing_if = "is_no")]
    pub entasis: bool,
    /// Whether shafts and extrusions get caps, and a part of polygons must close.
    #[serde(default, skip_serializing_if = "is_no")]
    pub watertight: bool,
    /// How many sides stand for a circle, or for an arch's curve.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sides: Option<u32>,
    /// The plane in which it is mirrored: two points that are each other's image, or three or more of the plane.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub mirror: Vec<String>,
    /// How it is repeated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub repeat: Option<RepeatRow>,
    /// How far stone is from such a shape anyhow, metres; counts beside the points' own uncertainty. 0.005 without.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tolerance_m: Option<f64>,
}

/// An edge of a shape as a photograph shows it.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct EdgeRow {
    /// The photograph.
    pub photograph: String,
    /// One pixel of the edge.
    pub from: [f64; 2],
    /// Another; what is between them is not used where a lens bends it.
    pub to: [f64; 2],
    /// The corners that a box's, a roof's, a polygon's or an extrusion's edge runs between, numbered from 0 as `points` lists them. Not for what is round,
    /// whose edges are where it ends to the eye.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub between: Option<[usize; 2]>,
    /// Which edge of an arch's front; both pixels lie on it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub of: Option<Rim>,
}

/// An edge of an arch's front.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Rim {
    /// The inner.
    Inner,
    /// The outer.
    Outer,
}

/// How often a shape stands, and where: either along `step` or around `around`.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RepeatRow {
    /// How many there are, the first one included.
    pub count: u32,
    /// Two points that are one step apart.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub step: Option<[String; 2]>,
    /// Two points, the first and the last place.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub span: Option<[String; 2]>,
    /// Two points of the axis around which it is turned.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub around: Option<[String; 2]>,
    /// From one to the next around the axis, degrees; a full turn is divided without.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub angle_deg: Option<f64>,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde asks for a reference")]
fn is_no(value: &bool) -> bool {
    !*value
}
