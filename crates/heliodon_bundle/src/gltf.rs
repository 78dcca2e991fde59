//! The JSON of the glTF profile: the few properties that bundles use, written and read by serde.
//!
//! Why not the gltf crate: it reads whole files, and for writing offers the JSON types only, with far more than the profile
//! has. What is unknown here is skipped on reading.

use heliodon_image::TextureWrap;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(crate) struct Gltf {
    pub(crate) asset: Asset,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) extensions_used: Vec<String>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) extensions_required: Vec<String>,
    pub(crate) scene: Option<usize>,
    pub(crate) scenes: Vec<Scene>,
    pub(crate) nodes: Vec<Node>,
    pub(crate) meshes: Vec<Mesh>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) materials: Vec<Material>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) textures: Vec<Texture>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) images: Vec<Image>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) samplers: Vec<Sampler>,
    pub(crate) accessors: Vec<Accessor>,
    pub(crate) buffer_views: Vec<BufferView>,
    pub(crate) buffers: Vec<Buffer>,
}

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct Asset {
    pub(crate) version: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) generator: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) extras: Option<AssetExtras>,
}

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct AssetExtras {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) heliodon_profile: Option<u32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) lit_at: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) exposure_stops: Option<f64>,
}

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Scene {
    pub(crate) nodes: Vec<usize>,
}

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Node {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) name: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) mesh: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) extras: Option<NodeExtras>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) matrix: Option<Vec<f64>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) translation: Option<Vec<f64>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) rotation: Option<Vec<f64>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) scale: Option<Vec<f64>>,
}

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct NodeExtras {
    pub(crate) part: u16,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) role: Option<crate::site::Role>,
}

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Mesh {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) name: Option<String>,
    pub(crate) primitives: Vec<Primitive>,
}

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Primitive {
    pub(crate) attributes: BTreeMap<String, usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) indices: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) material: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) mode: Option<u32>,
}

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Material {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) name: Option<String>,
    #[serde(default)]
    pub(crate) pbr_metallic_roughness: Pbr,
    #[serde(default)]
    pub(crate) double_sided: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) extensions: Option<MaterialExtensions>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) extras: Option<MaterialExtras>,
}

/// What a bundle says of a material.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(crate) struct MaterialExtras {
    /// The detail of what shows it, by its index in [`crate::manifest::PartInfo::material_details`].
    pub(crate) detail: Option<u32>,
}

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(crate) struct Pbr {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) base_color_texture: Option<TextureRef>,
    pub(crate) metallic_factor: f32,
    pub(crate) roughness_factor: f32,
}

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct MaterialExtensions {
    #[serde(rename = "KHR_materials_unlit", skip_serializing_if = "Option::is_none")]
    pub(crate) unlit: Option<Unlit>,
}

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Unlit {}

#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(crate) struct TextureRef {
    pub(crate) index: usize,
}

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Texture {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) sampler: Option<usize>,
    pub(crate) source: Option<usize>,
}

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Image {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) name: Option<String>,
    pub(crate) mime_type: Option<String>,
    pub(crate) buffer_view: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) extras: Option<ImageExtras>,
}

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct ImageExtras {
    pub(crate) texture: u32,
}

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Sampler {
    pub(crate) mag_filter: u32,
    pub(crate) min_filter: u32,
    pub(crate) wrap_s: u32,
    pub(crate) wrap_t: u32,
}

/// glTF's numbers for the ways in which a texture goes on.
const WRAPS: [(TextureWrap, u32); 3] =
    [(TextureWrap::Repeat, 10_497), (TextureWrap::Mirror, 33_648), (TextureWrap::Clamp, 33_071)];

impl Sampler {
    /// Trilinear, going on as `wrap` says: what a stock viewer should do with a scan's atlas.
    pub(crate) fn trilinear(wrap: [TextureWrap; 2]) -> Self {
        let [wrap_s, wrap_t] = wrap.map(|wrap| WRAPS.iter().find(|(known, _)| *known == wrap).map_or(WRAPS[0].1, |w| w.1));
        Self { mag_filter: 9729, min_filter: 9987, wrap_s, wrap_t }
    }

    /// How a texture goes on with it along u and v; `None` for numbers that glTF has not.
    pub(crate) fn wrap(&self) -> Option<[TextureWrap; 2]> {
        let known = |code: u32| WRAPS.iter().find(|(_, known)| *known == code).map(|w| w.0);
        Some([known(self.wrap_s)?, known(self.wrap_t)?])
    }
}

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Accessor {
    pub(crate) buffer_view: Option<usize>,
    #[serde(default, skip_serializing_if = "is_zero")]
    pub(crate) byte_offset: u64,
    pub(crate) component_type: u32,
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub(crate) normalized: bool,
    pub(crate) count: u64,
    #[serde(rename = "type")]
    pub(crate) kind: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) min: Option<Vec<f64>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) max: Option<Vec<f64>>,
    #[serde(default, skip_serializing)]
    pub(crate) sparse: Option<Sparse>,
}

/// Sparse accessors are not of the profile; only their presence is noticed.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Sparse {}

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct BufferView {
    pub(crate) buffer: usize,
    #[serde(default, skip_serializing_if = "is_zero")]
    pub(crate) byte_offset: u64,
    pub(crate) byte_length: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) byte_stride: Option<u32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) target: Option<u32>,
}

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Buffer {
    pub(crate) byte_length: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) uri: Option<String>,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde's skip_serializing_if passes a reference")]
fn is_zero(value: &u64) -> bool {
    *value == 0
}
