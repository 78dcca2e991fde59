//! Binary glTF of a model with a second set of texture coordinates, for its light map.
//!
//! glTF has no light maps of its own. So either the light is written beside the materials, which stay what they are, and each material's `extras` say
//! which file it is in (`lightMap`: three.js takes it as `material.lightMap`, Bevy as a `Lightmap`, Blender as an image on the second UV map); or albedo and light
//! were multiplied, and what comes is an unlit texture, which every viewer shows as it is.

use super::glb::{ARRAY_BUFFER, Build, ROUGHNESS};
use super::{ExportError, write_file};
use crate::{Mesh, Texture, TextureWrap};
use glam::Vec2;
use heliodon_image::{ImageError, SrgbImage};
use serde_json::{Map, Value, json};
use std::collections::HashMap;
use std::io::{self, Write};
use std::path::Path;
use std::sync::Arc;

/// How the light goes with it.
#[derive(Clone, Copy, Debug)]
pub enum LightTextures<'a> {
    /// In files beside it, one for each texture; what they hold, for people and programs.
    Beside {
        /// Their names relative to the file.
        files: &'a [String],
        /// How a pixel becomes light: `linear`, or `rgbe8`.
        encoding: &'a str,
    },
    /// Multiplied with the albedo, sRGB as a screen shows it, one image for each texture. Viewers are to make no smaller versions of them: charts would mix there.
    Multiplied(&'a [SrgbImage]),
}

impl LightTextures<'_> {
    fn count(&self) -> usize {
        match self {
            Self::Beside { files, .. } => files.len(),
            Self::Multiplied(images) => images.len(),
        }
    }
}

/// A part of a model, unwrapped or not.
#[derive(Clone, Debug, Default)]
pub struct UnwrappedPart {
    /// Its name.
    pub name: String,
    /// Its mesh: its own vertices in their order, behind them those that were split off where charts meet.
    pub mesh: Mesh,
    /// Where each vertex lies in its light map, the origin at the top left; empty where the part has none.
    pub second_uvs: Vec<Vec2>,
    /// The light map of each triangle; empty where the part has none.
    pub sheet: Vec<u16>,
}

impl UnwrappedPart {
    /// Whether its arrays agree, and name no more than so many textures.
    fn validate(&self, textures: usize) -> Result<(), String> {
        let Self { name, mesh, second_uvs, sheet } = self;
        mesh.validate().map_err(|error| format!("{name}: {error}"))?;
        let (vertices, triangles) = (mesh.positions.len(), mesh.triangles.len());
        let has_light = !second_uvs.is_empty() || !sheet.is_empty();
        if has_light && (second_uvs.len() != vertices || sheet.len() != triangles) {
            return Err(format!(
                "{name}: {} second texture coordinates for {vertices} vertices, {} textures for {triangles} triangles",
                second_uvs.len(),
                sheet.len()
            ));
        }
        match sheet.iter().find(|sheet| usize::from(**sheet) >= textures) {
            Some(sheet) => Err(format!("{name}: a triangle names texture {sheet} of {textures}")),
            None => Ok(()),
        }
    }
}

/// Writes parts to a file, each as a node and a mesh of its name, in their order. Vertices and triangles stay in theirs; those of several materials or textures are
/// primitives over the same vertices, in the order in which the triangles name them first. What has no light map keeps its material without a word of one.
///
/// # Errors
/// Where the file cannot be written, or arrays contradict one another; an older file stays as it was.
pub fn write_glb_with_second_uvs(path: &Path, parts: &[UnwrappedPart], light: LightTextures) -> Result<(), ExportError> {
    write_file(path, |out| glb_with_second_uvs(out, parts, light))
}

/// Writes them to `out`.
///
/// # Errors
/// As [`write_glb_with_second_uvs`].
pub fn glb_with_second_uvs(out: &mut dyn Write, parts: &[UnwrappedPart], light: LightTextures) -> io::Result<()> {
    let invalid = |fault: String| io::Error::new(io::ErrorKind::InvalidInput, fault);
    parts.iter().try_for_each(|part| part.validate(light.count())).map_err(invalid)?;
    let mut writer = Writer {
        light,
        build: Build::default(),
        meshes: Vec::new(),
        materials: Vec::new(),
        images: Vec::new(),
        samplers: Vec::new(),
        textures: Vec::new(),
        known: Vec::new(),
        lit: HashMap::new(),
    };
    let json = writer.document(parts).map_err(|error| invalid(error.to_string()))?;
    writer.build.write(out, &json)
}

/// glTF's filters: between texels,
const LINEAR: u32 = 9729;
/// and between smaller versions too, which viewers make.
const LINEAR_MIPMAP_LINEAR: u32 = 9987;

struct Writer<'a> {
    light: LightTextures<'a>,
    build: Build,
    meshes: Vec<Value>,
    materials: Vec<Value>,
    images: Vec<Value>,
    samplers: Vec<Value>,
    textures: Vec<Value>,
    /// Textures that were written.
    known: Vec<(Arc<Texture>, usize)>,
    /// The materials of multiplied textures that were written.
    lit: HashMap<u16, usize>,
}

impl Writer<'_> {
    fn document(&mut self, parts: &[UnwrappedPart]) -> Result<Value, ImageError> {
        let nodes: Vec<Value> = parts.iter().map(|part| self.node(part)).collect::<Result<_, _>>()?;
        let mut root = Map::new();
        root.insert("asset".into(), json!({ "version": "2.0", "generator": "Heliodon" }));
        if !self.lit.is_empty() {
            root.insert("extensionsUsed".into(), json!(["KHR_materials_unlit"]));
        }
        root.insert("scene".into(), json!(0));
        // glTF knows no empty arrays
        let tops: Vec<usize> = (0..nodes.len()).collect();
        root.insert("scenes".into(), if nodes.is_empty() { json!([{}]) } else { json!([{ "nodes": tops }]) });
        let mut insert = |name: &str, values: Vec<Value>| {
            if !values.is_empty() {
                root.insert(name.into(), values.into());
            }
        };
        insert("nodes", nodes);
        insert("meshes", std::mem::take(&mut self.meshes));
        insert("materials", std::mem::take(&mut self.materials));
        insert("textures", std::mem::take(&mut self.textures));
        insert("samplers", std::mem::take(&mut self.samplers));
        insert("images", std::mem::take(&mut self.images));
        insert("accessors", std::mem::take(&mut self.build.accessors));
        insert("bufferViews", std::mem::take(&mut self.build.views));
        self.build.align();
        let length = self.build.bytes.len();
        insert("buffers", if length == 0 { Vec::new() } else { vec![json!({ "byteLength": length })] });
        Ok(root.into())
    }

    fn node(&mut self, part: &UnwrappedPart) -> Result<Value, ImageError> {
        let UnwrappedPart { name, mesh, sheet, .. } = part;
        // glTF knows no mesh without primitives
        if mesh.triangles.is_empty() {
            return Ok(json!({ "name": name }));
        }
        let is_multiplied = matches!(self.light, LightTextures::Multiplied(_));
        let (mut groups, mut places) = (Vec::new(), HashMap::new());
        for (t, triangle) in mesh.triangles.iter().enumerate() {
            let sheet = sheet.get(t).copied();
            // the light's texture shows the material too
            let material = mesh.triangle_material.get(t).filter(|_| !(is_multiplied && sheet.is_some())).copied();
            let look = (material.unwrap_or(0), sheet);
            let place = *places.entry(look).or_insert_with(|| {
                groups.push((look, Vec::new()));
                groups.len() - 1
            });
            groups[place].1.push(*triangle);
        }
        let attributes = self.attributes(part, is_multiplied && !sheet.is_empty());
        let mut primitives = Vec::new();
        for ((material, sheet), triangles) in groups {
            let indices = self.build.indices(&triangles, mesh.positions.len());
            let material = self.material(part, material, sheet)?;
            primitives.push(json!({ "attributes": attributes, "indices": indices, "material": material }));
        }
        self.meshes.push(json!({ "name": name, "primitives": primitives }));
        Ok(json!({ "name": name, "mesh": self.meshes.len() - 1 }))
    }

    fn attributes(&mut self, part: &UnwrappedPart, has_colors_in_texture: bool) -> Map<String, Value> {
        let UnwrappedPart { mesh, second_uvs, .. } = part;
        let mut attributes = Map::new();
        attributes.insert("POSITION".into(), json!(self.build.positions(&mesh.positions)));
        if !mesh.normals.is_empty() {
            attributes.insert("NORMAL".into(), json!(self.build.vectors(&mesh.normals)));
        }
        // glTF counts sets without gaps: the second one stands for a first that is not there
        let first = if mesh.uvs.is_empty() { second_uvs } else { &mesh.uvs };
        for (name, uvs) in [("TEXCOORD_0", first), ("TEXCOORD_1", second_uvs)].into_iter().filter(|(_, uvs)| !uvs.is_empty()) {
            let uvs: Vec<[f32; 2]> = uvs.iter().map(Vec2::to_array).collect();
            attributes.insert(name.into(), json!(self.build.floats(&uvs, Some(ARRAY_BUFFER))));
        }
        if !mesh.colors_linear.is_empty() && !has_colors_in_texture {
            attributes.insert("COLOR_0".into(), json!(self.build.vectors(&mesh.colors_linear)));
        }
        attributes
    }

    /// The number of a part's material on a texture of the light.
    fn material(&mut self, part: &UnwrappedPart, material: u16, sheet: Option<u16>) -> Result<usize, ImageError> {
        let value = match (self.light, sheet) {
            (LightTextures::Multiplied(images), Some(sheet)) => {
                if let Some(known) = self.lit.get(&sheet) {
                    return Ok(*known);
                }
                self.lit.insert(sheet, self.materials.len());
                self.lit_material(&images[usize::from(sheet)], sheet)?
            }
            (LightTextures::Beside { files, encoding }, Some(sheet)) => {
                let mut value = self.plain_material(part, material)?;
                let file = &files[usize::from(sheet)];
                value["extras"] =
                    json!({ "lightMap": { "file": file, "texCoord": 1, "encoding": encoding, "quantity": "irradiance / pi" } });
                value
            }
            (_, None) => self.plain_material(part, material)?,
        };
        self.materials.push(value);
        Ok(self.materials.len() - 1)
    }

    fn lit_material(&mut self, image: &SrgbImage, sheet: u16) -> Result<Value, ImageError> {
        let texture = self.texture(image, [TextureWrap::Clamp; 2], LINEAR)?;
        Ok(json!({
            "name": format!("light {sheet}"),
            "doubleSided": true,
            "pbrMetallicRoughness": {
                "baseColorTexture": { "index": texture, "texCoord": 1 }, "metallicFactor": 0, "roughnessFactor": 1
            },
            "extensions": { "KHR_materials_unlit": {} },
        }))
    }

    fn plain_material(&mut self, part: &UnwrappedPart, material: u16) -> Result<Value, ImageError> {
        let mesh = &part.mesh;
        let known = mesh.materials.get(usize::from(material));
        let unsaid = if mesh.colors_linear.is_empty() { Mesh::UNSAID_ALBEDO } else { glam::Vec3::ONE };
        let [r, g, b] = known.map_or(unsaid, |material| material.base_color_linear).to_array().map(f64::from);
        let mut look =
            json!({ "baseColorFactor": [r, g, b, 1.0], "metallicFactor": 0, "roughnessFactor": f64::from(ROUGHNESS) });
        // an image lies on a set of its own, not on the light's
        let texture = known.and_then(|material| material.texture.as_ref()).filter(|_| !mesh.uvs.is_empty());
        if let Some(texture) = texture {
            look["baseColorTexture"] = json!({ "index": self.shared_texture(texture)?, "texCoord": 0 });
        }
        let name = known.map_or("stone", |material| material.name.as_str());
        Ok(json!({ "name": name, "doubleSided": true, "pbrMetallicRoughness": look }))
    }

    fn shared_texture(&mut self, texture: &Arc<Texture>) -> Result<usize, ImageError> {
        if let Some((_, index)) = self.known.iter().find(|(known, _)| Arc::ptr_eq(known, texture)) {
            return Ok(*index);
        }
        let index = self.texture(&texture.image, texture.wrap, LINEAR_MIPMAP_LINEAR)?;
        self.known.push((texture.clone(), index));
        Ok(index)
    }

    fn texture(&mut self, image: &SrgbImage, wrap: [TextureWrap; 2], smaller: u32) -> Result<usize, ImageError> {
        let png = image.to_png_bytes()?;
        let view = self.build.view(png, None);
        self.images.push(json!({ "bufferView": view, "mimeType": "image/png" }));
        let mode = |wrap: TextureWrap| match wrap {
            TextureWrap::Repeat => 10_497,
            TextureWrap::Mirror => 33_648,
            TextureWrap::Clamp => 33_071,
        };
        let [wrap_s, wrap_t] = wrap.map(mode);
        self.samplers.push(json!({ "magFilter": LINEAR, "minFilter": smaller, "wrapS": wrap_s, "wrapT": wrap_t }));
        self.textures.push(json!({ "source": self.images.len() - 1, "sampler": self.samplers.len() - 1 }));
        Ok(self.textures.len() - 1)
    }
}
