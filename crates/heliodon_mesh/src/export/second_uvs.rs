//! Binary glTF of a mesh with a second set of texture coordinates, for its light map.
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
use std::collections::BTreeMap;
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
    /// Multiplied with the albedo, sRGB as a screen shows it, one image for each texture.
    Multiplied(&'a [SrgbImage]),
}

/// A mesh, unwrapped.
#[derive(Clone, Copy, Debug)]
pub struct WithSecondUvs<'a> {
    /// The mesh, its vertices split where charts meet.
    pub mesh: &'a Mesh,
    /// Where each vertex lies in its light map, the origin at the top left.
    pub second_uvs: &'a [Vec2],
    /// The light map of each triangle.
    pub sheet: &'a [u16],
    /// The light.
    pub light: LightTextures<'a>,
}

/// Writes it to a file.
///
/// # Errors
/// Where the file cannot be written, or arrays contradict one another; an older file stays as it was.
pub fn write_glb_with_second_uvs(path: &Path, model: &WithSecondUvs) -> Result<(), ExportError> {
    write_file(path, |out| glb_with_second_uvs(out, model))
}

/// Writes it to `out`.
///
/// # Errors
/// As [`write_glb_with_second_uvs`].
pub fn glb_with_second_uvs(out: &mut dyn Write, model: &WithSecondUvs) -> io::Result<()> {
    let invalid = |fault: String| io::Error::new(io::ErrorKind::InvalidInput, fault);
    model.mesh.validate().map_err(|error| invalid(error.to_string()))?;
    let (vertices, triangles) = (model.mesh.positions.len(), model.mesh.triangles.len());
    if model.second_uvs.len() != vertices || model.sheet.len() != triangles {
        return Err(invalid(format!(
            "{} second texture coordinates for {vertices} vertices, {} textures for {triangles} triangles",
            model.second_uvs.len(),
            model.sheet.len()
        )));
    }
    let mut writer =
        Writer { build: Build::default(), images: Vec::new(), samplers: Vec::new(), textures: Vec::new(), known: Vec::new() };
    let json = writer.document(model).map_err(|error| invalid(error.to_string()))?;
    writer.build.write(out, &json)
}

struct Writer {
    build: Build,
    images: Vec<Value>,
    samplers: Vec<Value>,
    textures: Vec<Value>,
    /// Textures that were written.
    known: Vec<(Arc<Texture>, usize)>,
}

impl Writer {
    fn document(&mut self, model: &WithSecondUvs) -> Result<Value, ImageError> {
        let mesh = model.mesh;
        let multiplied = matches!(model.light, LightTextures::Multiplied(_));
        let mut attributes = Map::new();
        attributes.insert("POSITION".into(), json!(self.build.positions(&mesh.positions)));
        if !mesh.normals.is_empty() {
            attributes.insert("NORMAL".into(), json!(self.build.vectors(&mesh.normals)));
        }
        // viewers want the first set where there is a second
        let first: Vec<[f32; 2]> =
            if mesh.uvs.is_empty() { model.second_uvs } else { &mesh.uvs }.iter().map(Vec2::to_array).collect();
        let second: Vec<[f32; 2]> = model.second_uvs.iter().map(Vec2::to_array).collect();
        attributes.insert("TEXCOORD_0".into(), json!(self.build.floats(&first, Some(ARRAY_BUFFER))));
        attributes.insert("TEXCOORD_1".into(), json!(self.build.floats(&second, Some(ARRAY_BUFFER))));
        if !mesh.colors_linear.is_empty() && !multiplied {
            attributes.insert("COLOR_0".into(), json!(self.build.vectors(&mesh.colors_linear)));
        }
        let mut groups: BTreeMap<(u16, u16), Vec<[u32; 3]>> = BTreeMap::new();
        for (t, (triangle, &sheet)) in mesh.triangles.iter().zip(model.sheet).enumerate() {
            let material = if multiplied { 0 } else { mesh.triangle_material.get(t).copied().unwrap_or(0) };
            groups.entry((material, sheet)).or_default().push(*triangle);
        }
        let (mut materials, mut primitives) = (Vec::new(), Vec::new());
        for ((material, sheet), triangles) in groups {
            let indices = self.build.indices(&triangles, mesh.positions.len());
            primitives.push(json!({ "attributes": attributes, "indices": indices, "material": materials.len() }));
            materials.push(self.material(model, material, sheet)?);
        }
        let mut root = Map::new();
        root.insert("asset".into(), json!({ "version": "2.0", "generator": "Heliodon" }));
        if multiplied && !materials.is_empty() {
            root.insert("extensionsUsed".into(), json!(["KHR_materials_unlit"]));
        }
        root.insert("scene".into(), json!(0));
        // glTF knows no empty arrays
        if primitives.is_empty() {
            root.insert("scenes".into(), json!([{}]));
            return Ok(root.into());
        }
        root.insert("scenes".into(), json!([{ "nodes": [0] }]));
        root.insert("nodes".into(), json!([{ "name": "model", "mesh": 0 }]));
        root.insert("meshes".into(), json!([{ "name": "model", "primitives": primitives }]));
        let mut insert = |name: &str, values: Vec<Value>| {
            if !values.is_empty() {
                root.insert(name.into(), values.into());
            }
        };
        insert("materials", materials);
        insert("textures", std::mem::take(&mut self.textures));
        insert("samplers", std::mem::take(&mut self.samplers));
        insert("images", std::mem::take(&mut self.images));
        insert("accessors", std::mem::take(&mut self.build.accessors));
        insert("bufferViews", std::mem::take(&mut self.build.views));
        self.build.align();
        root.insert("buffers".into(), json!([{ "byteLength": self.build.bytes.len() }]));
        Ok(root.into())
    }

    fn material(&mut self, model: &WithSecondUvs, material: u16, sheet: u16) -> Result<Value, ImageError> {
        if let LightTextures::Multiplied(images) = model.light {
            let texture = match images.get(usize::from(sheet)) {
                Some(image) => json!({ "index": self.texture(image, [TextureWrap::Clamp; 2])?, "texCoord": 1 }),
                None => return Ok(json!({ "name": "light" })),
            };
            return Ok(json!({
                "name": format!("light {sheet}"),
                "doubleSided": true,
                "pbrMetallicRoughness": { "baseColorTexture": texture, "metallicFactor": 0, "roughnessFactor": 1 },
                "extensions": { "KHR_materials_unlit": {} },
            }));
        }
        let known = model.mesh.materials.get(usize::from(material));
        let unsaid = if model.mesh.colors_linear.is_empty() { Mesh::UNSAID_ALBEDO } else { glam::Vec3::ONE };
        let [r, g, b] = known.map_or(unsaid, |material| material.base_color_linear).to_array().map(f64::from);
        let mut look =
            json!({ "baseColorFactor": [r, g, b, 1.0], "metallicFactor": 0, "roughnessFactor": f64::from(ROUGHNESS) });
        if let Some(texture) = known.and_then(|material| material.texture.as_ref()) {
            look["baseColorTexture"] = json!({ "index": self.shared_texture(texture)?, "texCoord": 0 });
        }
        let name = known.map_or("stone", |material| material.name.as_str());
        let mut value = json!({ "name": name, "doubleSided": true, "pbrMetallicRoughness": look });
        if let LightTextures::Beside { files, encoding } = model.light
            && let Some(file) = files.get(usize::from(sheet))
        {
            value["extras"] =
                json!({ "lightMap": { "file": file, "texCoord": 1, "encoding": encoding, "quantity": "irradiance / pi" } });
        }
        Ok(value)
    }

    fn shared_texture(&mut self, texture: &Arc<Texture>) -> Result<usize, ImageError> {
        if let Some((_, index)) = self.known.iter().find(|(known, _)| Arc::ptr_eq(known, texture)) {
            return Ok(*index);
        }
        let index = self.texture(&texture.image, texture.wrap)?;
        self.known.push((texture.clone(), index));
        Ok(index)
    }

    fn texture(&mut self, image: &SrgbImage, wrap: [TextureWrap; 2]) -> Result<usize, ImageError> {
        let png = image.to_png_bytes()?;
        let view = self.build.view(png, None);
        self.images.push(json!({ "bufferView": view, "mimeType": "image/png" }));
        let mode = |wrap: TextureWrap| match wrap {
            TextureWrap::Repeat => 10_497,
            TextureWrap::Mirror => 33_648,
            TextureWrap::Clamp => 33_071,
        };
        // linear, and between smaller versions
        self.samplers.push(json!({ "magFilter": 9729, "minFilter": 9987, "wrapS": mode(wrap[0]), "wrapT": mode(wrap[1]) }));
        self.textures.push(json!({ "source": self.images.len() - 1, "sampler": self.samplers.len() - 1 }));
        Ok(self.textures.len() - 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    fn json_of(model: &WithSecondUvs) -> Value {
        let mut out = Vec::new();
        glb_with_second_uvs(&mut out, model).unwrap();
        let length = u32::from_le_bytes(out[12..16].try_into().unwrap()) as usize;
        assert_eq!(u32::from_le_bytes(out[8..12].try_into().unwrap()) as usize, out.len());
        serde_json::from_slice(&out[20..20 + length]).unwrap()
    }

    #[test]
    fn both_sets_of_coordinates_are_there_and_materials_say_where_the_light_is() {
        let mesh = Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z],
            uvs: vec![Vec2::ZERO; 4],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            ..Mesh::default()
        };
        let second = [Vec2::new(0.1, 0.2), Vec2::X, Vec2::Y, Vec2::ONE];
        let files = ["a.exr".to_owned(), "b.exr".to_owned()];
        let light = LightTextures::Beside { files: &files, encoding: "linear" };
        let mut model = WithSecondUvs { mesh: &mesh, second_uvs: &second, sheet: &[0, 1], light };
        let json = json_of(&model);
        let primitives = json["meshes"][0]["primitives"].as_array().unwrap();
        assert_eq!(primitives.len(), 2);
        let uvs = json["accessors"][primitives[0]["attributes"]["TEXCOORD_1"].as_u64().unwrap() as usize].clone();
        assert_eq!((uvs["type"].as_str(), uvs["count"].as_u64()), (Some("VEC2"), Some(4)));
        assert_eq!(json["materials"][1]["extras"]["lightMap"]["file"], "b.exr");
        let images = [SrgbImage::filled(2, 2, [9, 9, 9, 255]), SrgbImage::filled(2, 2, [1, 2, 3, 255])];
        model.light = LightTextures::Multiplied(&images);
        let json = json_of(&model);
        assert_eq!(json["extensionsUsed"][0], "KHR_materials_unlit");
        assert_eq!(json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["texCoord"], 1);
        assert_eq!(json["images"].as_array().unwrap().len(), 2);
        model.sheet = &[0];
        assert!(glb_with_second_uvs(&mut Vec::new(), &model).is_err());
    }
}
