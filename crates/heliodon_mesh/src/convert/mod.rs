//! Models into the form that loads fastest: binary glTF of welded, ordered and quantised vertices.
//!
//! What a glTF scene is stays as it is: nodes, names, materials, images, skins, morph targets, animations, cameras, `extras`. What its vertices are
//! stored as changes:
//!
//! - floats become whole numbers (`KHR_mesh_quantization`) where an error bound is kept: positions 16 bits on a cubic grid around the mesh, its
//!   place and size in a node of its own or, for skins, in the inverse bind matrices; normals and tangents 8 or 16 bits; texture coordinates 16 bits where they lie
//!   within [-1, 1]; colours and weights 16 bits. What is stored as whole numbers already stays;
//! - vertices whose numbers are then the same become one, and triangles that became nothing go;
//! - triangles are ordered for the vertex cache, then against overdraw, and vertices by first use (meshoptimizer, Arseny Kapoulkine);
//! - with [`ConvertParams::compress`], views are packed by `EXT_meshopt_compression`, without filters, so that they unpack to the same numbers.
//!
//! PLY, OBJ and STL are read as [`crate::import`] reads them, with the normals that it computes, and become one mesh of a primitive for each material.
//! The order of vertices is a new one: what is stored by vertex elsewhere (vertex caches, `.npy`) belongs to the file that it was made for.
//!
//! Images are put into the file and are not converted: glTF has no ratified way to hold BC7. Points and lines stay; strips and fans become triangles.

mod attributes;
mod document;
mod grid;
mod order;
mod still;
mod views;

use crate::import::{self, Format, ImportError, ImportOptions, ImportReport, Place, raw};
use crate::motion::MovingMesh;
use attributes::{Encoded, Encoding};
use grid::Grid;
use raw::RawScene;
use rayon::prelude::*;
use std::path::Path;

/// What `asset.generator` says of files that are written here.
pub const GENERATOR: &str = "Heliodon convert";

/// Bits of a normal's component.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum NormalBits {
    /// Four bytes a normal, off by 0.4 degrees at most.
    #[default]
    Eight,
    /// Eight bytes, off by 0.002 degrees at most.
    Sixteen,
}

/// How a model is written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConvertParams {
    /// How far a vertex may come to lie from where it was, metres in the scene at rest; a mesh for which 16 bits are too coarse keeps floats. More
    /// lets larger meshes take half of the memory. A mesh of 1 m is off by 13 micrometres.
    pub tolerance_m: f64,
    /// How normals and tangents are stored.
    pub normals: NormalBits,
    /// Whether views are packed: vertices and indices take some two fifths of their bytes on disk, and are unpacked at about a gigabyte a second when they are read (the bunny).
    pub compress: bool,
}

impl Default for ConvertParams {
    fn default() -> Self {
        Self { tolerance_m: 1.0e-3, normals: NormalBits::default(), compress: false }
    }
}

/// How far what was written may be from what was read, at most.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bounds {
    /// Metres in the scene at rest; with morph targets, for weights that sum to 1. 0 where positions are as they were.
    pub position_m: f64,
    /// Degrees, in a mesh's own frame: a node that scales it unevenly widens angles by the ratio of its scales at most.
    pub normal_deg: f64,
    /// Of a texture's side.
    pub uv: f64,
    /// Of a colour's component, linear.
    pub color: f64,
    /// Of a joint's weight.
    pub weight: f64,
}

/// A size, before and after.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Change {
    /// Of what was read.
    pub before: u64,
    /// Of what is written.
    pub after: u64,
}

/// What became of a model.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ModelReport {
    /// Bytes of the file with those that it names, and of the new one.
    pub bytes: Change,
    /// Bytes that vertices and indices take in a device's memory.
    pub gpu_bytes: Change,
    /// Vertices, once for each primitive that uses them.
    pub vertices: Change,
    /// Triangles; those that became nothing, or that had a corner which is no place, are gone.
    pub triangles: Change,
    /// Vertices worked on for a triangle, in hundredths, by a cache of 16: 300 without sharing, 50 at best.
    pub cache_misses: Change,
    /// How far off it is.
    pub bounds: Bounds,
    /// Meshes whose positions stay floats, because 16 bits would be off by more than was allowed.
    pub kept_floats: u64,
}

/// A model, converted.
#[derive(Clone, Debug)]
pub struct Converted {
    /// The bytes of a GLB file.
    pub bytes: Vec<u8>,
    /// What became of it.
    pub report: ModelReport,
}

/// Converts a mesh file. What was left out or mended on the way is added to `told`.
///
/// # Errors
/// Where the file cannot be read, holds no triangles that are fit for use, uses extensions that hold numbers of their own, or becomes larger than 4 GiB.
pub fn convert(path: &Path, params: &ConvertParams, told: &mut ImportReport) -> Result<Converted, ImportError> {
    let options = ImportOptions::default();
    let (mut source, format) = import::open(path)?;
    let scene = if format == Format::Gltf {
        let scene = raw::read(&mut source, path.parent())?;
        scene.warnings.iter().for_each(|warning| told.warn(path, warning));
        scene
    } else {
        let length = source.length();
        let imported = import::read_source(&mut source, format, path.parent(), &options, told)?;
        still::scene(&imported.mesh, length).map_err(|problem| fail(path, problem, "check its images"))?
    };
    document::check_extensions(&scene.root).map_err(|(item, problem)| {
        let remedy = "take that extension out first (for example with gltf-transform)";
        ImportError::new(path, Place::Item(item), problem, remedy)
    })?;
    written(path, scene, params)
}

fn fail(path: &Path, problem: String, remedy: &str) -> ImportError {
    ImportError::new(path, Place::File, problem, remedy)
}

/// A mesh on its way.
struct Quantised {
    grid: Option<Grid>,
    primitives: Vec<Option<Encoded>>,
}

fn written(path: &Path, scene: RawScene, params: &ConvertParams) -> Result<Converted, ImportError> {
    let mut report = ModelReport { bytes: Change { before: scene.bytes, after: 0 }, ..ModelReport::default() };
    let bound = document::unbound_meshes(&scene);
    let mut meshes = Vec::with_capacity(scene.meshes.len());
    for (m, mesh) in scene.meshes.iter().enumerate() {
        let fits = grid::around(mesh).filter(|_| !bound[m]);
        let grid = fits.filter(|grid| grid.error() * scene.stretch[m] <= params.tolerance_m);
        report.kept_floats += u64::from(fits.is_some() && grid.is_none());
        if let Some(grid) = &grid {
            report.bounds.position_m = report.bounds.position_m.max(grid.error() * scene.stretch[m]);
        }
        let encoding = Encoding { grid, normals: params.normals };
        let primitives: Vec<Option<Encoded>> =
            mesh.par_iter().map(|primitive| attributes::encode(primitive, &encoding)).collect();
        meshes.push(Quantised { grid, primitives });
    }
    for (raw, encoded) in scene.meshes.iter().flatten().zip(meshes.iter().flat_map(|mesh| &mesh.primitives)) {
        count(&mut report, raw, encoded.as_ref());
    }
    let per_triangle = |misses: u64, triangles: u64| (100 * misses).checked_div(triangles).unwrap_or(0);
    let Change { before, after } = report.cache_misses;
    report.cache_misses =
        Change { before: per_triangle(before, report.triangles.before), after: per_triangle(after, report.triangles.after) };
    if report.triangles.after == 0 {
        let problem = "has no triangle that is left of what it was: all are without extent, or have a corner that is no place";
        return Err(fail(path, problem.to_owned(), "check the export, and its unit"));
    }
    let bytes =
        document::glb(scene, &meshes, params.compress).map_err(|problem| fail(path, problem, "split it into several files"))?;
    report.bytes.after = bytes.len() as u64;
    Ok(Converted { bytes, report })
}

fn count(report: &mut ModelReport, raw: &raw::RawPrimitive, encoded: Option<&Encoded>) {
    let vertices = raw.attributes.get("POSITION").map_or(0, |positions| positions.count);
    let arrays = raw.attributes.values().chain(raw.targets.iter().flat_map(|target| target.values()));
    let index_bytes = |vertices: usize| if vertices <= views::MOST_SHORT { 2 } else { 4 };
    report.vertices.before += vertices as u64;
    report.gpu_bytes.before += arrays.map(|array| array.bytes.len() as u64).sum::<u64>();
    report.gpu_bytes.before += (raw.corners.len() * index_bytes(vertices)) as u64;
    if raw.mode == attributes::TRIANGLES {
        report.triangles.before += raw.corners.len() as u64 / 3;
        report.cache_misses.before += order::cache_misses(&raw.corners, vertices);
    }
    let Some(encoded) = encoded else { return };
    report.vertices.after += encoded.vertices as u64;
    report.gpu_bytes.after += encoded.streams.iter().map(|stream| stream.bytes.len() as u64).sum::<u64>();
    report.gpu_bytes.after += (encoded.corners.len() * index_bytes(encoded.vertices)) as u64;
    if raw.mode == attributes::TRIANGLES {
        report.triangles.after += encoded.corners.len() as u64 / 3;
        report.cache_misses.after += order::cache_misses(&encoded.corners, encoded.vertices);
    }
    let Bounds { normal_deg, uv, color, weight, .. } = &mut report.bounds;
    *normal_deg = normal_deg.max(encoded.bounds.normal_deg);
    *uv = uv.max(encoded.bounds.uv);
    *color = color.max(encoded.bounds.color);
    *weight = weight.max(encoded.bounds.weight);
}

/// How far two readings of a model are apart, as their boxes and numbers of triangles tell: whoever writes a file reads it back.
///
/// # Errors
/// In words, where one is not the other within the bounds.
pub fn compare(before: &MovingMesh, after: &MovingMesh, report: &ModelReport) -> Result<(), String> {
    let (a, b) = (before.rest(), after.rest());
    let gone = report.triangles.before.saturating_sub(report.triangles.after);
    let names = |model: &MovingMesh| model.clips().iter().map(|clip| clip.name.clone()).collect::<Vec<_>>();
    if names(before) != names(after) {
        return Err(format!("its clips were {:?} and are {:?}", names(before), names(after)));
    }
    if gone == 0 && a.triangles.len() != b.triangles.len() {
        return Err(format!("it had {} triangles and has {}", a.triangles.len(), b.triangles.len()));
    }
    let (Some(a), Some(b)) = (used_box(a), used_box(b)) else { return Err("it has no vertices".to_owned()) };
    // what floats are exact to at such a distance, in a few sums
    let size = a.0.abs().max(a.1.abs()).max_element();
    let allowed = report.bounds.position_m as f32 * 1.01 + size * 8.0 * f32::EPSILON;
    let off = (a.0 - b.0).abs().max((a.1 - b.1).abs()).max_element();
    if gone == 0 && off > allowed {
        return Err(format!("its box is off by {off} m, more than {allowed} m"));
    }
    Ok(())
}

/// The box around what triangles use.
fn used_box(mesh: &crate::Mesh) -> Option<(glam::Vec3, glam::Vec3)> {
    let mut used = mesh.triangles.as_flattened().iter().map(|&corner| mesh.positions[corner as usize]);
    let first = used.next()?;
    Some(used.fold((first, first), |(low, high), p| (low.min(p), high.max(p))))
}

/// Whether the bytes are a GLB file that [`convert`] has written.
#[must_use]
pub fn wrote(bytes: &[u8]) -> bool {
    let length = bytes.get(12..16).and_then(|length| length.first_chunk()).map(|&length| u32::from_le_bytes(length) as usize);
    let json = length.and_then(|length| bytes.get(20..)?.get(..length)).filter(|_| bytes.starts_with(b"glTF"));
    let document = json.and_then(|json| serde_json::from_slice::<serde_json::Value>(json).ok());
    document.is_some_and(|document| document["asset"]["generator"] == GENERATOR)
}
