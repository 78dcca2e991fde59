//! `[[actor]]`: figures that walk or stand in the site and are lit each frame.

use super::types::{Albedo, UpAxis};
use heliodon_math::unit::Unit;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::ops::RangeInclusive;

/// `[[actor]]`: a model that moves, lit by what is baked of the place where it is.
///
/// Its own shape is placed as a part's is: `unit` and `up`, `scale`, `rotate_deg`; then it is turned and carried along its path,
/// or to its place. The model's +Z looks forward, as in glTF. Exactly one of `place` and `path` is given.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Actor {
    /// The actor's name, unique in the site, and that of its folder in the bundle. Default: the file's name without its ending.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// A PLY, OBJ, glTF, GLB or STL file relative to the site's folder; in a bundle's manifest, to the bundle's.
    pub file: String,
    /// A vertex cache (.pc2) for the file's vertices, from the same folder.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cache: Option<String>,
    /// How many of the vertex cache's frames make a second, from 0.001 to 1,000; only with `cache`, whose file does not say. Default: 25.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.001, max = 1000))]
    pub cache_frames_per_s: Option<f64>,
    /// The file's clip that is played. Default: its first.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub animation: Option<String>,
    /// How fast the animation is played; 1 as it was made, 0 holds its first picture.
    #[serde(default = "one")]
    #[schemars(range(min = 0))]
    pub speed: f64,
    /// Where the model's origin stands, in the coordinates of the parts before the site's `origin` is subtracted; in a manifest,
    /// after.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub place: Option<[f64; 3]>,
    /// In place of `place`, at least two points, in the same coordinates, between which the actor walks straight.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub path: Option<Vec<[f64; 3]>>,
    /// How fast it walks, metres a second.
    #[serde(default = "walk_speed")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub walk_speed: f64,
    /// How a path goes on at its end.
    #[serde(default)]
    pub walk: Walk,
    /// What the ground beneath it is to it. In a bundle's manifest it is always the default: there the place or path is on the ground already.
    #[serde(default, skip_serializing_if = "Ground::is_default")]
    pub ground: Ground,
    /// Turns the actor about +Y, counter-clockwise seen from above, degrees; of one that walks, after it has been turned along its path.
    #[serde(default)]
    pub turn_deg: f64,
    /// Multiplies the model's size; negative mirrors it through its origin.
    #[serde(default = "one")]
    pub scale: f64,
    /// The length that the file's numbers count.
    #[serde(default)]
    #[schemars(schema_with = "super::types::unit_schema")]
    pub unit: Unit,
    /// The file's axis that points up. With "z", a point (x, y, z) becomes (x, z, -y).
    #[serde(default)]
    pub up: UpAxis,
    /// Turns the model about the fixed axes X, then Y, then Z, in degrees, before it is turned along its path.
    #[serde(default)]
    pub rotate_deg: [f64; 3],
    /// Albedo in place of whatever colours the file has: linear [r, g, b] in [0, 1], or an image for its texture coordinates.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub albedo: Option<Albedo>,
}

/// How a path goes on at its end.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Walk {
    /// Straight from the last point to the first, and round again.
    #[default]
    Circle,
    /// Back through the points, and forth again.
    BackAndForth,
    /// It stops at the last point.
    Once,
}

/// What the ground beneath an actor is to it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Ground {
    /// The actor goes at the heights that are given, and where it sinks in or floats the bake says so.
    #[default]
    Check,
    /// The bake puts its lowest point onto the first surface beneath its head, all along its path: stairs are walked up.
    Follow,
    /// It hangs or flies: the actor goes at the heights that are given.
    Ignore,
}

impl Ground {
    #[expect(clippy::trivially_copy_pass_by_ref, reason = "serde's skip_serializing_if passes a reference")]
    fn is_default(&self) -> bool {
        *self == Self::default()
    }
}

/// How many frames of a vertex cache can make a second.
pub const CACHE_FRAMES_PER_S_RANGE: RangeInclusive<f64> = 0.001..=1000.0;

/// Metres a second at which an actor walks unless its site says otherwise: a visitor who looks about.
pub const DEFAULT_WALK_SPEED: f64 = 1.3;

impl Actor {
    /// An actor that stands at a place, everything else as it comes.
    #[must_use]
    pub fn at(file: impl Into<String>, place: [f64; 3]) -> Self {
        Self {
            name: None,
            file: file.into(),
            cache: None,
            cache_frames_per_s: None,
            animation: None,
            speed: 1.0,
            place: Some(place),
            path: None,
            walk_speed: DEFAULT_WALK_SPEED,
            walk: Walk::Circle,
            ground: Ground::Check,
            turn_deg: 0.0,
            scale: 1.0,
            unit: Unit::Metre,
            up: UpAxis::Y,
            rotate_deg: [0.0; 3],
            albedo: None,
        }
    }

    /// The actor's name: as given, else of its file, without folders and ending.
    #[must_use]
    pub fn display_name(&self) -> &str {
        let file = self.file.rsplit('/').next().unwrap_or_default();
        let stem = file.rsplit_once('.').map_or(file, |(stem, _)| stem);
        self.name.as_deref().unwrap_or(stem)
    }

    /// The points between which it walks, the first again at the end of a circle; its place alone where it stands.
    #[must_use]
    pub fn stations(&self) -> Vec<[f64; 3]> {
        let mut stations: Vec<[f64; 3]> = self.path.iter().flatten().chain(&self.place).copied().collect();
        if self.walk == Walk::Circle && stations.len() > 1 {
            stations.extend(stations.first().copied());
        }
        stations
    }

    /// The actor with its place or path moved by minus the site's origin: from the site's coordinates to the bundle's.
    #[must_use]
    pub fn relative_to(&self, origin: [f64; 3]) -> Self {
        let moved = |point: [f64; 3]| [0, 1, 2].map(|axis| point[axis] - origin[axis]);
        let path = self.path.as_ref().map(|path| path.iter().copied().map(moved).collect());
        Self { place: self.place.map(moved), path, ..self.clone() }
    }
}

fn one() -> f64 {
    1.0
}

fn walk_speed() -> f64 {
    DEFAULT_WALK_SPEED
}
