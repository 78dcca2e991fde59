//! `[[actor]]`: figures that walk or stand in the site and are lit each frame.

use super::living::Thing;
use super::types::{Albedo, UpAxis};
use crate::impostor::IMPOSTOR_ENDING;
use heliodon_math::random::Pcg32;
use heliodon_math::unit::Unit;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;
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
    /// A PLY, OBJ, glTF, GLB or STL file relative to the site's folder, or an impostor (.impostor.ktx2); in a bundle's manifest, to the bundle's.
    pub file: String,
    /// How many of them there are, 1 to 10,000, each with its own phase and pace; more than one only of an impostor.
    #[serde(default = "one_of_them", skip_serializing_if = "is_one")]
    #[schemars(range(min = 1, max = 10_000))]
    pub count: u32,
    /// How far off the place or to the sides of the path they are, metres; only where there are several.
    #[serde(default, skip_serializing_if = "is_zero")]
    #[schemars(range(min = 0))]
    pub spread_m: f64,
    /// Another number scatters them in another way.
    #[serde(default, skip_serializing_if = "is_zero_seed")]
    pub seed: u32,
    /// In a bundle's manifest: where several of them stand, or the ways that they take side by side. A site has none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(skip)]
    pub lanes: Vec<Vec<[f64; 3]>>,
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
    /// What makes it a thing that can be touched and taken; without, it is somebody.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub thing: Option<Thing>,
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

/// The most of one impostor.
pub const MAX_COUNT: u32 = 10_000;
/// The most ways side by side: who walks along a path shares one of them with others, before and behind.
pub const MAX_LANES: u32 = 24;

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
            count: 1,
            spread_m: 0.0,
            seed: 0,
            lanes: Vec::new(),
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
            thing: None,
        }
    }

    /// The actor's name: as given, else of its file, without folders and ending.
    #[must_use]
    pub fn display_name(&self) -> &str {
        let file = self.file.rsplit('/').next().unwrap_or_default();
        let stem = file.strip_suffix(IMPOSTOR_ENDING).or_else(|| file.rsplit_once('.').map(|(stem, _)| stem)).unwrap_or(file);
        self.name.as_deref().unwrap_or(stem)
    }

    /// Whether it is an image of a model rather than a model.
    #[must_use]
    pub fn is_impostor(&self) -> bool {
        self.file.ends_with(IMPOSTOR_ENDING)
    }

    /// The points between which it walks, the first again at the end of a circle; its place alone where it stands.
    #[must_use]
    pub fn stations(&self) -> Vec<[f64; 3]> {
        let stations: Vec<[f64; 3]> = self.path.iter().flatten().chain(&self.place).copied().collect();
        self.rounded(stations)
    }

    /// All stations of all of its ways: of its lanes, where it has any.
    #[must_use]
    pub fn ways(&self) -> Vec<Vec<[f64; 3]>> {
        if self.lanes.is_empty() {
            return vec![self.stations()];
        }
        self.lanes.iter().map(|lane| self.rounded(lane.clone())).collect()
    }

    fn rounded(&self, mut stations: Vec<[f64; 3]>) -> Vec<[f64; 3]> {
        if self.walk == Walk::Circle && stations.len() > 1 {
            stations.extend(stations.first().copied());
        }
        stations
    }

    /// Where several of them stand around its place, or walk beside its path, at its heights: as many lanes as there are of them, at most [`MAX_LANES`] beside
    /// a path. None for one alone.
    #[must_use]
    pub fn scattered(&self) -> Vec<Vec<[f64; 3]>> {
        if self.count <= 1 {
            return Vec::new();
        }
        let mut random = Pcg32::new(u64::from(self.seed), 0x1a9e5);
        let mut unit = || f64::from(random.next_f32());
        match (&self.place, &self.path) {
            (Some([x, y, z]), _) => {
                let around = |_| {
                    // evenly over the disc
                    let (radius, turn) = (self.spread_m * unit().sqrt(), TAU * unit());
                    vec![[x + radius * libm::cos(turn), *y, z + radius * libm::sin(turn)]]
                };
                (0..self.count).map(around).collect()
            }
            (None, Some(path)) => {
                let lanes = self.count.min(MAX_LANES);
                // each in its strip, somewhere
                let off = |lane: u32| ((f64::from(lane) + unit()) / f64::from(lanes) * 2.0 - 1.0) * self.spread_m;
                (0..lanes).map(off).map(|off| self.beside(path, off)).collect()
            }
            (None, None) => Vec::new(),
        }
    }

    /// A path so many metres to the right of another one.
    fn beside(&self, path: &[[f64; 3]], off: f64) -> Vec<[f64; 3]> {
        let (last, closed) = (path.len() - 1, self.walk == Walk::Circle && path.len() > 2);
        let right_of = |from: [f64; 3], to: [f64; 3]| {
            let (x, z) = (to[0] - from[0], to[2] - from[2]);
            let length = (x * x + z * z).sqrt();
            if length > 0.0 { [-z / length, x / length] } else { [0.0; 2] }
        };
        let moved = |i: usize| {
            let before = (i > 0 || closed).then(|| right_of(path[if i > 0 { i - 1 } else { last }], path[i]));
            let after = (i < last || closed).then(|| right_of(path[i], path[if i < last { i + 1 } else { 0 }]));
            let (a, b) = (before.or(after).unwrap_or_default(), after.or(before).unwrap_or_default());
            // at a bend as far out as keeps both pieces parallel, within reason
            let sum = [a[0] + b[0], a[1] + b[1]];
            let scale = 2.0 / (sum[0] * sum[0] + sum[1] * sum[1]).max(1.0);
            [path[i][0] + sum[0] * scale * off, path[i][1], path[i][2] + sum[1] * scale * off]
        };
        (0..path.len()).map(moved).collect()
    }

    /// The actor with its place or path moved by minus the site's origin: from the site's coordinates to the bundle's.
    #[must_use]
    pub fn relative_to(&self, origin: [f64; 3]) -> Self {
        let moved = |point: [f64; 3]| [0, 1, 2].map(|axis| point[axis] - origin[axis]);
        let path = self.path.as_ref().map(|path| path.iter().copied().map(moved).collect());
        let lanes = self.lanes.iter().map(|lane| lane.iter().copied().map(moved).collect()).collect();
        Self { place: self.place.map(moved), path, lanes, ..self.clone() }
    }
}

fn one_of_them() -> u32 {
    1
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde's skip_serializing_if passes a reference")]
fn is_one(count: &u32) -> bool {
    *count == 1
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "as above")]
fn is_zero(metres: &f64) -> bool {
    *metres == 0.0
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "as above")]
fn is_zero_seed(seed: &u32) -> bool {
    *seed == 0
}

fn one() -> f64 {
    1.0
}

fn walk_speed() -> f64 {
    DEFAULT_WALK_SPEED
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn several_stand_around_a_place_each_in_its_own() {
        let crowd = Actor { count: 300, spread_m: 4.0, ..Actor::at("somebody.impostor.ktx2", [10.0, 2.0, -5.0]) };
        let lanes = crowd.scattered();
        assert_eq!(lanes.len(), 300);
        let off: Vec<f64> = lanes.iter().map(|lane| (lane[0][0] - 10.0).hypot(lane[0][2] + 5.0)).collect();
        assert!(lanes.iter().all(|lane| lane.len() == 1 && lane[0][1] == 2.0) && off.iter().all(|off| *off <= 4.0));
        // half of them beyond 0.7 of the radius
        let far = off.iter().filter(|off| **off > 4.0 / 2.0_f64.sqrt()).count();
        assert!((120..180).contains(&far), "{far}");
        assert_eq!(crowd.scattered(), lanes);
        assert_ne!(Actor { seed: 1, ..crowd.clone() }.scattered(), lanes);
        assert_eq!(crowd.display_name(), "somebody");
        assert_eq!(Actor { count: 1, ..crowd }.scattered(), Vec::<Vec<[f64; 3]>>::new());
    }

    #[test]
    fn several_walk_beside_a_path() {
        let path = Some(vec![[0.0, 0.0, 0.0], [10.0, 1.0, 0.0], [10.0, 1.0, 10.0]]);
        let actor =
            Actor { count: 8, spread_m: 2.0, place: None, path, walk: Walk::Once, ..Actor::at("a.impostor.ktx2", [0.0; 3]) };
        let lanes = actor.scattered();
        assert_eq!(lanes.len(), 8);
        for lane in &lanes {
            let off = lane[0][2];
            assert!(off.abs() <= 2.0 && lane[0][0].abs() < 1e-9 && lane[1][1] == 1.0);
            // the bend keeps both pieces as far off: to the right is +Z along +X, and -X along +Z
            assert!(
                (lane[1][2] - off).abs() < 1e-9
                    && (lane[1][0] - (10.0 - off)).abs() < 1e-9
                    && (lane[2][0] - (10.0 - off)).abs() < 1e-9
            );
        }
        assert_eq!(Actor { lanes: lanes.clone(), ..actor.clone() }.ways(), lanes);
        assert_eq!(Actor { walk: Walk::Circle, lanes, ..actor }.ways()[0].len(), 4);
    }
}
