//! Lit geometry as at one hour, for programs that know nothing of us.
//!
//! The file is plain glTF with `KHR_materials_unlit`: vertex colours are linear, as glTF has them, and hold
//! `albedo * light * 2^exposure`, clamped to [0, 1]; a viewer that shows them with the sRGB transfer function and no tone
//! curve shows what Heliodon's viewer shows with its clamp. In Blender set the view transform to Standard.
//!
//! Textured parts keep their texture, which the vertex colour `light * 2^exposure` multiplies. glTF allows no colour above 1,
//! so a light that exposure brings above 1 could not be said; then the whole file's exposure is lowered until the brightest
//! textured vertex is at 1, and the report says by how much. Relations within the picture stay right that way; the viewer
//! can raise its exposure by the same amount. Parts without a texture need none of it: their product is clamped as a whole.

use crate::chunk::LitChunk;
use crate::glb::{GlbBuilder, bounds};
use crate::gltf::{Asset, AssetExtras, Material, MaterialExtensions, Mesh, Node, Pbr, Primitive, Scene, TextureRef, Unlit};
use crate::layout::{self, COLOR_U16, VEC2_F32, VEC3_F32};
use crate::moment::{Blend, Day, Moment};
use crate::reader::{BundleReader, ReadError};
use crate::shade::chunk_light;
use crate::site::TimeOfDay;
use crate::storage::{WriteFault, io_fault};
use glam::Vec3;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// What keeps lit geometry from being written.
#[derive(Debug, Error)]
pub enum ExportError {
    /// The bundle cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The file cannot be written.
    #[error(transparent)]
    Write(#[from] WriteFault),
    /// The bundle knows no light of that time.
    #[error("{time} is outside of the bundle's day; give a time from {first} to {last}")]
    OutsideOfDay {
        /// The time that was asked for.
        time: TimeOfDay,
        /// The first entry's.
        first: String,
        /// The last entry's.
        last: String,
    },
}

/// How lit geometry is made.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ExportOptions {
    /// Exposure in stops; the moment's own where none is given.
    pub exposure_stops: Option<f32>,
    /// How the steps around the time are joined.
    pub blend: Blend,
}

/// What was written.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ExportReport {
    /// The time of day.
    pub time: String,
    /// The exposure of the file's colours, in stops.
    pub exposure_stops: f32,
    /// By how many stops it was lowered for the sake of textured parts; 0 or more.
    pub lowered_stops: f32,
    /// Triangles.
    pub triangles: u64,
    /// Size of the file.
    pub bytes: u64,
}

/// Writes the monument lit as at `time` to a GLB file. Holds one chunk in memory. A file that is there is replaced when the
/// new one is whole.
///
/// # Errors
/// If the time lies outside of the day (a lapse of one entry has light for any time), the bundle cannot be read, or the file
/// cannot be written.
pub fn export_lit(
    reader: &BundleReader,
    time: TimeOfDay,
    options: &ExportOptions,
    out: &Path,
) -> Result<ExportReport, ExportError> {
    let lapse = reader.lapse();
    let day = Day::new(lapse);
    let seconds = f64::from(time.seconds());
    let (first, last) = day.span_seconds();
    if lapse.steps.len() > 1 && !(first..=last).contains(&seconds) {
        let of = |step: Option<&heliodon_sky::lapse::LapseStep>| step.map_or(String::new(), |s| s.time.clone());
        return Err(ExportError::OutsideOfDay { time, first: of(lapse.steps.first()), last: of(lapse.steps.last()) });
    }
    let moment = day.at(seconds, options.blend);
    let wanted_stops = options.exposure_stops.unwrap_or(moment.exposure_stops);
    let brightest = brightest_textured(reader, &moment)? * libm::exp2f(wanted_stops);
    let lowered_stops = if brightest > 1.0 { libm::log2f(brightest) } else { 0.0 };
    let exposure_stops = wanted_stops - lowered_stops;

    let name = out.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let part = TemporaryFile::beside(out, &name, "part");
    let spool = TemporaryFile::beside(out, &name, "spool");
    let mut file = LitFile { builder: GlbBuilder::create(spool.0.clone())?, materials: BTreeMap::new(), mesh: None };
    file.builder.gltf.asset = Asset {
        version: "2.0".to_owned(),
        generator: Some(reader.manifest().tool.clone()),
        extras: Some(AssetExtras {
            lit_at: Some(time.to_string()),
            exposure_stops: Some(f64::from(exposure_stops)),
            ..AssetExtras::default()
        }),
    };
    file.builder.gltf.extensions_used = vec!["KHR_materials_unlit".to_owned()];
    file.builder.gltf.scene = Some(0);
    file.builder.gltf.scenes = vec![Scene::default()];
    let exposure = libm::exp2f(exposure_stops);
    for index in 0..reader.chunk_count() {
        let chunk = reader.read_chunk(index)?;
        let light = chunk_light(&moment, &chunk);
        let colors: Vec<Vec3> = light.iter().zip(&chunk.albedo).map(|(&l, &a)| a * l * exposure).collect();
        file.push(reader, &chunk, &colors)?;
    }
    let stored = file.builder.finish(&part.0, &name)?;
    std::fs::rename(&part.0, out).map_err(io_fault(out))?;
    let triangles = reader.triangle_count();
    Ok(ExportReport { time: time.to_string(), exposure_stops, lowered_stops, triangles, bytes: stored.bytes })
}

/// The brightest component of light times factor over the vertices of textured chunks.
fn brightest_textured(reader: &BundleReader, moment: &Moment) -> Result<f32, ReadError> {
    let mut brightest = 0.0_f32;
    for index in (0..reader.chunk_count()).filter(|&i| reader.chunk_info(i).texture.is_some()) {
        let chunk = reader.read_chunk(index)?;
        for (light, &factor) in chunk_light(moment, &chunk).into_iter().zip(&chunk.albedo) {
            brightest = brightest.max((light * factor).max_element());
        }
    }
    Ok(brightest)
}

struct LitFile {
    builder: GlbBuilder,
    /// Material by texture.
    materials: BTreeMap<Option<u32>, usize>,
    /// The part whose mesh takes the next chunk.
    mesh: Option<u16>,
}

impl LitFile {
    fn push(&mut self, reader: &BundleReader, chunk: &LitChunk, colors: &[Vec3]) -> Result<(), ExportError> {
        let material = match self.materials.get(&chunk.texture) {
            Some(&material) => material,
            None => self.add_material(reader, chunk.texture)?,
        };
        let mut attributes = BTreeMap::new();
        let mut add = |builder: &mut GlbBuilder, name: &str, kind, bytes: &[u8], bounds| -> Result<(), WriteFault> {
            attributes.insert(name.to_owned(), builder.push_attribute(kind, bytes, bounds)?);
            Ok(())
        };
        let builder = &mut self.builder;
        let around = Some(bounds(&chunk.positions));
        add(builder, "POSITION", VEC3_F32, &layout::vec3_bytes(&chunk.positions), around)?;
        add(builder, "NORMAL", VEC3_F32, &layout::vec3_bytes(&chunk.normals), None)?;
        if chunk.texture.is_some() {
            add(builder, "TEXCOORD_0", VEC2_F32, &layout::vec2_bytes(&chunk.uvs), None)?;
        }
        add(builder, "COLOR_0", COLOR_U16, &layout::color_bytes(colors), None)?;
        let indices = builder.push_triangles(&chunk.triangles)?;
        let gltf = &mut builder.gltf;
        if self.mesh != Some(chunk.part) {
            self.mesh = Some(chunk.part);
            let name = Some(reader.manifest().parts[usize::from(chunk.part)].name.clone());
            gltf.meshes.push(Mesh { name: name.clone(), primitives: Vec::new() });
            gltf.nodes.push(Node { name, mesh: Some(gltf.meshes.len() - 1), ..Node::default() });
            gltf.scenes[0].nodes.push(gltf.nodes.len() - 1);
        }
        if let Some(mesh) = gltf.meshes.last_mut() {
            mesh.primitives.push(Primitive { attributes, indices: Some(indices), material: Some(material), mode: None });
        }
        Ok(())
    }

    fn add_material(&mut self, reader: &BundleReader, texture: Option<u32>) -> Result<usize, ExportError> {
        let shown = match texture {
            Some(index) => {
                let info = &reader.manifest().textures[index as usize];
                let bytes = reader.texture_bytes(index as usize)?;
                let wrap = reader.texture_wrap(index as usize);
                Some(TextureRef { index: self.builder.push_texture(index, &info.name, &info.mime, wrap, &bytes)? })
            }
            None => None,
        };
        let materials = &mut self.builder.gltf.materials;
        materials.push(Material {
            name: None,
            pbr_metallic_roughness: Pbr { base_color_texture: shown, metallic_factor: 0.0, roughness_factor: 1.0 },
            double_sided: true,
            extensions: Some(MaterialExtensions { unlit: Some(Unlit {}) }),
            extras: None,
        });
        self.materials.insert(texture, materials.len() - 1);
        Ok(materials.len() - 1)
    }
}

/// A file that goes when this does, unless it was renamed.
struct TemporaryFile(PathBuf);

impl TemporaryFile {
    fn beside(out: &Path, name: &str, ending: &str) -> Self {
        let path = out.with_file_name(format!(".{name}.{ending}"));
        // what a killed run may have left
        let _ = std::fs::remove_file(&path);
        Self(path)
    }
}

impl Drop for TemporaryFile {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.0);
    }
}
