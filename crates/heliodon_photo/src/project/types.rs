//! What stands in `photos.toml`.

use crate::model::table::ShapeRow;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::borrow::Cow;
use std::collections::BTreeMap;

/// A project's file.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ProjectFile {
    /// What it is about.
    #[serde(default)]
    pub project: ProjectInfo,
    /// Cameras taken over from other programs.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub cameras: Vec<CamerasEntry>,
    /// Lenses that photographs share.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub lens: Vec<LensEntry>,
    /// Photographs.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub photo: Vec<PhotoEntry>,
    /// Reference points.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub point: Vec<PointEntry>,
    /// Parallel edges.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub edge: Vec<EdgeEntry>,
    /// Known distances.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub distance: Vec<DistanceEntry>,
    /// Known directions.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub direction: Vec<DirectionEntry>,
    /// What the model is made of.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub shape: Vec<ShapeRow>,
    /// The sky that photographs were taken under; only for the stone's own colour.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sky: Option<SkyEntry>,
    /// What photographs show that somebody has measured; only for the stone's own colour.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub grey: Vec<GreyEntry>,
    /// What stands about the model, hides it and throws light onto it, and gets no texture.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub around: Vec<AroundEntry>,
}

impl ProjectFile {
    /// The JSON schema of `photos.toml`, as committed in `schema/photos.schema.json`.
    #[must_use]
    pub fn json_schema() -> String {
        let mut text = serde_json::to_string_pretty(&schemars::schema_for!(Self)).unwrap_or_default();
        text.push('\n');
        text
    }
}

/// The project itself.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ProjectInfo {
    /// For people.
    #[serde(default)]
    pub name: String,
    /// The standard deviation of a mark's coordinate; half a pixel, or less if so they fit, where it is not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mark_sigma_px: Option<f64>,
    /// Of all random draws.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seed: Option<u64>,
    /// Whether all photographs were taken with one exposure and white balance, and developed alike; albedo then need not guess them.
    #[serde(default, skip_serializing_if = "is_false")]
    pub same_exposure: bool,
}

/// Which program wrote cameras.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum CameraFormat {
    /// A folder with cameras, images and points3D, text or binary.
    Colmap,
    /// `bundle.out`; its photographs in the order of the project's.
    Bundler,
    /// `sfm_data.json`.
    Openmvg,
    /// A folder with `sensors/`.
    Kapture,
    /// Lines of a name and twelve numbers of P, or K, R, t in 21 (Middlebury).
    Projection,
}

/// Cameras taken over.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CamerasEntry {
    /// The file or folder, from the project's own folder.
    pub file: String,
    /// Who wrote it.
    pub format: CameraFormat,
}

/// What is known of a focal length.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum FocalEntry {
    /// In pixels.
    Known(f64),
    /// As the photographs' EXIF says, a start that marks correct; free where there is none.
    #[default]
    Exif,
    /// Nothing.
    Free,
}

impl Serialize for FocalEntry {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Known(px) => serializer.serialize_f64(*px),
            Self::Exif => serializer.serialize_str("exif"),
            Self::Free => serializer.serialize_str("free"),
        }
    }
}

impl<'de> Deserialize<'de> for FocalEntry {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Visitor;
        impl serde::de::Visitor<'_> for Visitor {
            type Value = FocalEntry;

            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("a focal length in pixels, \"exif\" or \"free\"")
            }

            fn visit_f64<E: serde::de::Error>(self, px: f64) -> Result<FocalEntry, E> {
                if px > 0.0 && px.is_finite() { Ok(FocalEntry::Known(px)) } else { Err(E::custom("a focal length is above 0")) }
            }

            fn visit_i64<E: serde::de::Error>(self, px: i64) -> Result<FocalEntry, E> {
                self.visit_f64(px as f64)
            }

            fn visit_str<E: serde::de::Error>(self, word: &str) -> Result<FocalEntry, E> {
                match word {
                    "exif" => Ok(FocalEntry::Exif),
                    "free" => Ok(FocalEntry::Free),
                    _ => Err(E::custom("write a focal length in pixels, \"exif\" or \"free\"")),
                }
            }
        }
        deserializer.deserialize_any(Visitor)
    }
}

impl JsonSchema for FocalEntry {
    fn schema_name() -> Cow<'static, str> {
        "FocalEntry".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "description": "A focal length in pixels; exif: as the photographs' EXIF says, a start that marks correct; free: nothing is known.",
            "anyOf": [{ "type": "number", "exclusiveMinimum": 0 }, { "enum": ["exif", "free"] }]
        })
    }
}

/// How much of a lens's distortion is solved for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum DistortionEntry {
    /// None.
    None,
    /// k1: enough for most lenses.
    #[default]
    #[serde(rename = "radial-1")]
    Radial1,
    /// k1 and k2.
    #[serde(rename = "radial-2")]
    Radial2,
    /// k1 to k3, p1, p2 and the centre: wants many marks near the margins.
    Full,
}

/// A lens at one setting.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LensEntry {
    /// What photographs call it by.
    pub name: String,
    /// Its focal length.
    #[serde(default)]
    pub focal: FocalEntry,
    /// What of its distortion is solved for.
    #[serde(default)]
    pub distortion: DistortionEntry,
    /// Where its axis meets the photograph; the middle where it is not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub centre_px: Option<[f64; 2]>,
    /// k1, k2, k3 to start from, held where they are not solved for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub radial: Option<[f64; 3]>,
    /// p1, p2 to start from.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tangential: Option<[f64; 2]>,
}

/// A photograph.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PhotoEntry {
    /// The file, from the project's own folder; marks call the photograph by its last part.
    pub file: String,
    /// The lens; without one, photographs whose EXIF and size agree share theirs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lens: Option<String>,
    /// Width and height, where the file is not at hand.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub size_px: Option<[u32; 2]>,
    /// When it was taken by the clock of `[sky]`, `YYYY-MM-DD HH:MM[:SS]`; as its EXIF says where this is not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub time: Option<String>,
    /// A photograph of the whole sky at that time, from the project's own folder: HDR or EXR. It goes before the sky's model.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub probe: Option<String>,
}

/// The sky over the photographs.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SkyEntry {
    /// Degrees north.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub latitude_deg: Option<f64>,
    /// Degrees east.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub longitude_deg: Option<f64>,
    /// By how much the clock is ahead of universal time, `+02:00`; as the photographs' EXIF says where this is not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub utc_offset: Option<String>,
    /// The compass bearing, clockwise, of the project's -Z: 0 where a `[[direction]]` has said where north is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub north_deg: Option<f64>,
    /// `atmosphere` or `hosek-wilkie`, where photographs have no probe.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub model: Option<String>,
    /// How hazy the model's sky is, 1 to 10: 2 is very clear, 6 hazy.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub turbidity: Option<f32>,
    /// The linear albedo of the land as far as the horizon.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ground_albedo: Option<[f32; 3]>,
    /// How probes' pixels lie on the sphere: `lat-long`, `angular`, `mirror-ball`, `cube-cross` or `fisheye`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mapping: Option<String>,
    /// The angle across a fisheye's disc, degrees.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub opening_deg: Option<f64>,
    /// The compass bearing, clockwise, of what the mapping calls north.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub turn_deg: Option<f64>,
    /// What gives light below a probe's horizon: `keep`, `black` or `mirror`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub below_horizon: Option<String>,
    /// Irradiance of the sun where probes are too dark for it, in their unit times steradians.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sun_irradiance: Option<[f32; 3]>,
}

/// A place of known albedo in a photograph: a grey card that lay on the model's surface, or stone that was measured.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GreyEntry {
    /// The photograph's name.
    pub photo: String,
    /// Its pixel.
    pub at: [f64; 2],
    /// Over so many pixels about it all is as grey; 2 where it is not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub radius_px: Option<f64>,
    /// Its linear albedo: 0.18 for the usual card, or for red, green and blue.
    pub albedo: GreyAlbedo,
}

/// One albedo, or one for each colour.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum GreyAlbedo {
    /// The same for all colours.
    Grey(f32),
    /// For red, green and blue.
    Rgb([f32; 3]),
}

impl GreyAlbedo {
    /// For red, green and blue.
    #[must_use]
    pub fn rgb(self) -> [f32; 3] {
        match self {
            Self::Grey(grey) => [grey; 3],
            Self::Rgb(rgb) => rgb,
        }
    }
}

/// What stands about the model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AroundEntry {
    /// A mesh in the project's place and metres, from the project's own folder.
    pub file: String,
    /// Its linear albedo, where its own colours are not to be taken.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub albedo: Option<[f32; 3]>,
}

impl PhotoEntry {
    /// What marks call it by: the file's name without its folders.
    #[must_use]
    pub fn name(&self) -> &str {
        self.file.rsplit(['/', '\\']).next().unwrap_or(&self.file)
    }
}

/// A reference point.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PointEntry {
    /// Its name.
    pub name: String,
    /// Its coordinates in the world, where they are known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub known_m: Option<[f64; 3]>,
    /// Whether it lies on level ground of height 0.
    #[serde(default, skip_serializing_if = "is_false")]
    pub ground: bool,
    /// Where it was marked, by the photographs' names.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub marks: BTreeMap<String, [f64; 2]>,
}

fn is_false(value: &bool) -> bool {
    !*value
}

/// An axis of the building.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum AxisEntry {
    /// East, or along the building.
    X,
    /// Up.
    Y,
    /// South, or across.
    Z,
}

/// Edges along one axis in one photograph.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct EdgeEntry {
    /// Which axis they run along.
    pub axis: AxisEntry,
    /// The photograph's name.
    pub photo: String,
    /// Both ends of each, from the axis's lesser to its greater coordinate: uprights from foot to top.
    pub segments: Vec<[[f64; 2]; 2]>,
}

/// A known distance.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DistanceEntry {
    /// Two points.
    pub between: [String; 2],
    /// How far apart.
    pub metres: f64,
}

/// A known direction.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DirectionEntry {
    /// The point where it begins.
    pub from: String,
    /// The point where it ends.
    pub to: String,
    /// Where it leads.
    pub toward: Toward,
}

/// A direction of the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Toward {
    /// -Z.
    North,
    /// +Z.
    South,
    /// +X.
    East,
    /// -X.
    West,
    /// +Y.
    Up,
    /// -Y.
    Down,
    /// Level, at this compass bearing: degrees clockwise from north.
    Bearing(f64),
}

impl Toward {
    /// Those that have a word, with it.
    pub const WORDS: [(Self, &'static str); 6] = [
        (Self::North, "north"),
        (Self::South, "south"),
        (Self::East, "east"),
        (Self::West, "west"),
        (Self::Up, "up"),
        (Self::Down, "down"),
    ];

    /// The unit vector.
    #[must_use]
    pub fn unit(self) -> glam::DVec3 {
        match self {
            Self::North => glam::DVec3::NEG_Z,
            Self::South => glam::DVec3::Z,
            Self::East => glam::DVec3::X,
            Self::West => glam::DVec3::NEG_X,
            Self::Up => glam::DVec3::Y,
            Self::Down => glam::DVec3::NEG_Y,
            Self::Bearing(bearing_deg) => {
                let bearing = bearing_deg.to_radians();
                glam::DVec3::new(libm::sin(bearing), 0.0, -libm::cos(bearing))
            }
        }
    }
}

impl std::fmt::Display for Toward {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Bearing(bearing_deg) => write!(f, "{bearing_deg}\u{b0}"),
            known => f.write_str(Self::WORDS.iter().find(|(each, _)| each == known).map_or("", |(_, word)| word)),
        }
    }
}

impl Serialize for Toward {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Bearing(bearing_deg) => serializer.serialize_f64(*bearing_deg),
            known => serializer.collect_str(known),
        }
    }
}

impl JsonSchema for Toward {
    fn schema_name() -> Cow<'static, str> {
        "Toward".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let words = Self::WORDS.map(|(_, word)| word);
        json_schema!({
            "description": "A word, or a level direction by its compass bearing, degrees clockwise from north.",
            "anyOf": [{ "type": "number" }, { "enum": words }]
        })
    }
}

impl<'de> Deserialize<'de> for Toward {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Visitor;
        impl serde::de::Visitor<'_> for Visitor {
            type Value = Toward;

            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("north, south, east, west, up, down or a bearing in degrees")
            }

            fn visit_f64<E: serde::de::Error>(self, bearing_deg: f64) -> Result<Toward, E> {
                if bearing_deg.abs() <= 360.0 {
                    Ok(Toward::Bearing(bearing_deg))
                } else {
                    Err(E::custom("a bearing is -360 to 360 degrees, clockwise from north"))
                }
            }

            fn visit_i64<E: serde::de::Error>(self, bearing_deg: i64) -> Result<Toward, E> {
                self.visit_f64(bearing_deg as f64)
            }

            fn visit_str<E: serde::de::Error>(self, word: &str) -> Result<Toward, E> {
                let known = Toward::WORDS.iter().find(|(_, known)| *known == word).map(|(toward, _)| *toward);
                let wrong = || format!("`{word}` is no direction: write north, south, east, west, up, down or degrees");
                known.ok_or_else(|| E::custom(wrong()))
            }
        }
        deserializer.deserialize_any(Visitor)
    }
}
