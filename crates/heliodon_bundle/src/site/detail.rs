//! `detail` of a part: a fine pattern on its surfaces, for who comes near.

use heliodon_image::detail::{DetailKind, DetailParams};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Texels along a side of a built-in pattern unless a site says otherwise.
pub const DEFAULT_DETAIL_TEXELS: u32 = 256;
/// Details of a part at most.
pub const MAX_DETAILS: usize = 256;

/// `detail` of `[[part]]`: a grey pattern that is multiplied onto the albedo where surfaces are seen from near (Papaioannou et al. 2003,
/// section 2.4). 128 leaves a surface as it is. The light that is baked knows nothing of it. Exactly one of `file` and `kind` is given.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Detail {
    /// The materials of the part's files that it is for, by their names; `*` and `?` stand for any letters and for one. Of several details of a part the first that fits counts. Default: all materials.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub material: Option<String>,
    /// A grey image (PNG, JPEG) relative to the site's folder, square, of 64, 128, 256 or 512 texels along a side, whose mean is 128.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// A built-in pattern.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub kind: Option<DetailPattern>,
    /// Texels along a side of a built-in pattern: 64, 128, 256 or 512. Default 256.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 64, max = 512))]
    pub texels: Option<u32>,
    /// Which of all built-in patterns of its kind. Default 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seed: Option<u64>,
    /// How it is laid onto surfaces.
    #[serde(default)]
    pub mapping: DetailMapping,
    /// Of "triplanar": the length of a tile, metres. Default 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.001, max = 1000))]
    pub size_m: Option<f64>,
    /// Of "uv": tiles in a unit of the texture coordinates. Default 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.001, max = 100_000))]
    pub repeat: Option<f64>,
    /// Of "triplanar": the site's axis along which the image's columns run, and with them the fibre of wood.
    #[serde(default)]
    pub along: Along,
    /// How much of the pattern is laid on: 0 nothing, 1 all of it.
    #[serde(default = "strength")]
    #[schemars(range(min = 0, max = 1))]
    pub strength: f64,
    /// It is full up to this distance from the eye, in metres, and gone at twice as much.
    #[serde(default = "near_m")]
    #[schemars(range(min = 0.01, max = 100_000))]
    pub near_m: f64,
    /// Whether an image whose mean is not 128 is shifted until it is; without it such an image is refused.
    #[serde(default, skip_serializing_if = "is_false")]
    pub correct: bool,
}

/// Whether a material's name is as a pattern has it. Nothing but `*` and `?` stands for anything, for names have brackets, too.
fn fits(pattern: &str, name: &str) -> bool {
    let mut pattern = pattern.replace('[', "[[]");
    while pattern.contains("**") {
        pattern = pattern.replace("**", "*");
    }
    glob::Pattern::new(&pattern).is_ok_and(|pattern| pattern.matches(name))
}

/// A built-in pattern.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum DetailPattern {
    /// White Gaussian noise, the paper's own.
    Noise,
    /// Dressed stone.
    Stone,
    /// Plaster.
    Plaster,
    /// Wood cut along the fibre.
    Wood,
}

/// How a detail is laid onto surfaces.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum DetailMapping {
    /// From three sides, by the place in the world; whatever looks between them takes a mixture.
    #[default]
    Triplanar,
    /// By the texture coordinates of the base colour texture.
    Uv,
}

/// An axis of the site.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Along {
    /// East.
    X,
    /// Up.
    #[default]
    Y,
    /// South.
    Z,
}

impl Detail {
    /// A built-in pattern, everything else as it comes.
    #[must_use]
    pub fn of_kind(kind: DetailPattern) -> Self {
        Self {
            material: None,
            file: None,
            kind: Some(kind),
            texels: None,
            seed: None,
            mapping: DetailMapping::Triplanar,
            size_m: None,
            repeat: None,
            along: Along::Y,
            strength: strength(),
            near_m: near_m(),
            correct: false,
        }
    }

    /// Whether it is for a material of that name.
    #[must_use]
    pub fn is_for(&self, material: &str) -> bool {
        self.material.as_deref().is_none_or(|pattern| fits(pattern, material))
    }

    /// What is generated, where the pattern is a built-in one.
    #[must_use]
    pub fn generated(&self) -> Option<DetailParams> {
        let kind = match self.kind? {
            DetailPattern::Noise => DetailKind::Noise,
            DetailPattern::Stone => DetailKind::Stone,
            DetailPattern::Plaster => DetailKind::Plaster,
            DetailPattern::Wood => DetailKind::Wood { knots: 0 },
        };
        let size = self.texels.unwrap_or(DEFAULT_DETAIL_TEXELS);
        Some(DetailParams { size, seed: self.seed.unwrap_or_default(), ..DetailParams::new(kind) })
    }

    /// Tiles in a metre, or in a unit of the texture coordinates.
    #[must_use]
    pub fn tiles(&self) -> f64 {
        match self.mapping {
            DetailMapping::Triplanar => 1.0 / self.size_m.unwrap_or(1.0),
            DetailMapping::Uv => self.repeat.unwrap_or(1.0),
        }
    }
}

/// One table, or an array of tables; one that is for all materials is written as the table that it was before there were several.
pub(super) mod one_or_several {
    use super::Detail;
    use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
    use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
    use serde::de::{Deserialize, Deserializer, MapAccess, SeqAccess, Visitor};
    use serde::ser::{Serialize, Serializer};
    use std::fmt;

    pub fn serialize<S: Serializer>(details: &[Detail], serializer: S) -> Result<S::Ok, S::Error> {
        match details {
            [one] if one.material.is_none() => one.serialize(serializer),
            several => several.serialize(serializer),
        }
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<Detail>, D::Error> {
        // not untagged, which would tell nothing of what is wrong inside of one
        struct Tables;
        impl<'de> Visitor<'de> for Tables {
            type Value = Vec<Detail>;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a table, [part.detail], or several, [[part.detail]]")
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Self::Value, A::Error> {
                Ok(vec![Detail::deserialize(MapAccessDeserializer::new(map))?])
            }

            fn visit_seq<A: SeqAccess<'de>>(self, several: A) -> Result<Self::Value, A::Error> {
                Vec::deserialize(SeqAccessDeserializer::new(several))
            }
        }
        deserializer.deserialize_any(Tables)
    }

    pub fn schema(generator: &mut SchemaGenerator) -> Schema {
        let (one, several) = (generator.subschema_for::<Detail>(), <Vec<Detail>>::json_schema(generator));
        json_schema!({ "anyOf": [one, several] })
    }
}

fn strength() -> f64 {
    1.0
}

fn near_m() -> f64 {
    8.0
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde's skip_serializing_if passes a reference")]
fn is_false(value: &bool) -> bool {
    !*value
}
