//! A mesh as a document: one node, one mesh, a primitive for each material.

use crate::import::raw::{RawArray, RawAttributes, RawPrimitive, RawScene};
use crate::{Mesh, Texture, TextureWrap};
use serde_json::{Map, Value, json};
use std::sync::Arc;

/// Stone and bone: hardly a gloss.
const ROUGHNESS: f64 = 0.9;

/// The document, with the mesh file's length and those of its images.
pub(super) fn scene(mesh: &Mesh, file_bytes: u64) -> Result<RawScene, String> {
    let mut scene = RawScene { bytes: file_bytes, stretch: vec![1.0], ..RawScene::default() };
    let mut textures = Textures::default();
    let mut materials = Vec::new();
    for material in &mesh.materials {
        let [r, g, b] = material.base_color_linear.to_array().map(f64::from);
        let mut look = json!({ "baseColorFactor": [r, g, b, 1.0], "metallicFactor": 0, "roughnessFactor": ROUGHNESS });
        if let Some(texture) = material.texture.as_ref().filter(|_| !mesh.uvs.is_empty()) {
            look["baseColorTexture"] = json!({ "index": textures.number(texture)? });
        }
        let mut value = json!({ "pbrMetallicRoughness": look });
        if !material.name.is_empty() {
            value["name"] = json!(material.name);
        }
        materials.push(value);
    }
    if materials.is_empty() {
        // without a colour, so that readers take it for what it is: unsaid
        materials.push(json!({ "pbrMetallicRoughness": { "metallicFactor": 0, "roughnessFactor": ROUGHNESS } }));
    }
    let mut primitives = Vec::new();
    for material in 0..materials.len() {
        let corners = corners(mesh, material);
        if !corners.is_empty() {
            scene.meshes.resize_with(1, Vec::new);
            scene.meshes[0].push(primitive(mesh, &corners));
            primitives.push(json!({ "attributes": {}, "material": material }));
        }
    }
    let root = json!({
        "asset": { "version": "2.0" }, "scene": 0, "scenes": [{ "nodes": [0] }], "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": primitives }], "materials": materials,
    });
    let Value::Object(mut root) = root else { return Ok(scene) };
    textures.finish(&mut root);
    scene.bytes += textures.file_bytes;
    scene.images = textures.images;
    scene.root = root;
    Ok(scene)
}

fn corners(mesh: &Mesh, material: usize) -> Vec<u32> {
    let of = |t: usize| mesh.triangle_material.get(t).map_or(0, |&m| usize::from(m));
    (0..mesh.triangles.len()).filter(|&t| of(t) == material).flat_map(|t| mesh.triangles[t]).collect()
}

fn primitive(mesh: &Mesh, corners: &[u32]) -> RawPrimitive {
    let mut used = corners.to_vec();
    used.sort_unstable();
    used.dedup();
    let place = |corner: &u32| used.binary_search(corner).map_or(0, |place| place as u32);
    let mut attributes = RawAttributes::new();
    let mut put = |name: &str, width: usize, values: Vec<f32>| {
        attributes.insert(name.to_owned(), RawArray::floats(width, values));
    };
    let vectors = |all: &[glam::Vec3]| used.iter().flat_map(|&v| all[v as usize].to_array()).collect::<Vec<f32>>();
    put("POSITION", 3, vectors(&mesh.positions));
    if !mesh.normals.is_empty() {
        put("NORMAL", 3, vectors(&mesh.normals));
    }
    if !mesh.colors_linear.is_empty() {
        put("COLOR_0", 3, vectors(&mesh.colors_linear));
    }
    if !mesh.uvs.is_empty() {
        put("TEXCOORD_0", 2, used.iter().flat_map(|&v| mesh.uvs[v as usize].to_array()).collect());
    }
    RawPrimitive {
        mode: super::attributes::TRIANGLES,
        corners: corners.iter().map(place).collect(),
        attributes,
        targets: Vec::new(),
    }
}

#[derive(Default)]
struct Textures {
    known: Vec<*const Texture>,
    images: Vec<Option<Arc<Vec<u8>>>>,
    samplers: Vec<Value>,
    file_bytes: u64,
}

impl Textures {
    fn number(&mut self, texture: &Arc<Texture>) -> Result<usize, String> {
        let key = Arc::as_ptr(texture);
        if let Some(known) = self.known.iter().position(|known| *known == key) {
            return Ok(known);
        }
        // the file itself where it still is one that glTF knows; else its pixels
        let file = std::fs::read(&texture.source).ok().filter(|bytes| super::document::image_kind(bytes).is_some());
        self.file_bytes += file.as_ref().map_or(0, |bytes| bytes.len() as u64);
        let bytes = match file {
            Some(bytes) => bytes,
            None => texture.image.to_png_bytes().map_err(|error| error.to_string())?,
        };
        let code = |wrap: TextureWrap| match wrap {
            TextureWrap::Clamp => 33071,
            TextureWrap::Mirror => 33648,
            TextureWrap::Repeat => 10497,
        };
        self.samplers.push(json!({ "wrapS": code(texture.wrap[0]), "wrapT": code(texture.wrap[1]) }));
        self.images.push(Some(Arc::new(bytes)));
        self.known.push(key);
        Ok(self.known.len() - 1)
    }

    fn finish(&self, root: &mut Map<String, Value>) {
        if self.known.is_empty() {
            return;
        }
        let each = |value: fn(usize) -> Value| (0..self.known.len()).map(value).collect::<Vec<_>>();
        root.insert("textures".to_owned(), each(|k| json!({ "source": k, "sampler": k })).into());
        root.insert("images".to_owned(), each(|_| json!({})).into());
        root.insert("samplers".to_owned(), self.samplers.clone().into());
    }
}
