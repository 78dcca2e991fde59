//! glTF 2.0, as JSON with files beside it or as one binary file: the scene's triangles in their rest pose.
//!
//! Read here: node transforms in `f64`, also mirroring ones; indexed and plain triangles, strips and fans; all component types,
//! normalised and sparse accessors; `COLOR_0`, texture coordinates with `KHR_texture_transform`; base colours with their textures;
//! `KHR_mesh_quantization`, `EXT_meshopt_compression` and `KHR_draco_mesh_compression`. Points and lines are passed over.
//! Skins, morph targets and animations are left out here: [`crate::motion`] reads what moves.

mod accessor;
mod buffers;
mod container;
mod draco;
mod keyframes;
mod materials;
mod meshopt;
mod model;
mod moving;
pub(crate) mod raw;
mod scene;
mod size;
mod skins;

pub(crate) use accessor::Component;
pub use container::percent_decoded;

use super::ImportOptions;
use super::assembly::{Assembly, Imported};
use super::error::{ImportError, ImportReport, Place};
use super::source::Source;
use crate::Mesh;
use crate::motion::rig::Rig;
use buffers::Buffers;
use draco::Decompressed;
use model::{Document, Motion};
use std::fmt;
use std::path::Path;

/// What is wrong with an item of the document; the file's name is added where it is known.
#[derive(Clone, Debug)]
pub(super) struct Failure {
    item: String,
    problem: String,
    remedy: String,
}

type Outcome<T> = Result<T, Failure>;

impl Failure {
    fn new(item: &str, problem: impl Into<String>, remedy: &str) -> Self {
        Self { item: item.to_owned(), problem: problem.into(), remedy: remedy.to_owned() }
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}; {}", self.item, self.problem, self.remedy)
    }
}

fn fail<T>(item: &str, problem: impl Into<String>, remedy: &str) -> Outcome<T> {
    Err(Failure::new(item, problem, remedy))
}

impl Failure {
    fn of_file(self, file: &Path) -> ImportError {
        ImportError::new(file, Place::Item(self.item), self.problem, self.remedy)
    }
}

pub(super) fn read(
    source: &mut Source,
    folder: Option<&Path>,
    options: &ImportOptions,
    report: &mut ImportReport,
) -> Result<Imported, ImportError> {
    let file = source.file();
    let (json, bin) = container::open(whole(source)?, file)?;
    let (document, decompressed) = open(json, bin, (file, folder), options.most_elements)?;
    let mut assembly = Assembly::new(file, options, report)?;
    decompressed.warnings.iter().for_each(|warning| assembly.warn(warning));
    let buffers = Buffers::new(&document, bin, folder).holding(decompressed.held);
    let built = scene::build(&document, &buffers, &mut assembly);
    built.map_err(|failure| failure.of_file(file))?;
    assembly.finish()
}

/// The scene in its default pose, and what moves it; no rig where nothing does.
pub(crate) fn read_moving(
    source: &mut Source,
    folder: Option<&Path>,
    options: &ImportOptions,
    report: &mut ImportReport,
) -> Result<(Mesh, Option<Rig>), ImportError> {
    let file = source.file();
    let (json, bin) = container::open(whole(source)?, file)?;
    let (document, decompressed) = open(json, bin, (file, folder), options.most_elements)?;
    let motion: Motion = parse(json, file)?;
    let mut assembly = Assembly::new(file, options, report)?;
    decompressed.warnings.iter().for_each(|warning| assembly.warn(warning));
    let buffers = Buffers::new(&document, bin, folder).holding(decompressed.held);
    let built = moving::build(&document, &motion, &buffers, &mut assembly);
    let rig = built.map_err(|failure| failure.of_file(file))?;
    let imported = assembly.finish()?;
    Ok(rig.settle(imported))
}

fn whole<'s>(source: &'s mut Source) -> Result<&'s [u8], ImportError> {
    let length = usize::try_from(source.length())
        .map_err(|_| source.fail("is too large for this machine's memory", "split it into several files"))?;
    source.take(length)
}

/// The document, and what its compressed primitives hold: at most so many vertices or triangles.
fn open(
    json: &[u8],
    bin: Option<&[u8]>,
    (file, folder): (&Path, Option<&Path>),
    most: u32,
) -> Result<(Document, Decompressed), ImportError> {
    let mut document: Document = parse(json, file)?;
    check_version(&document).map_err(|failure| failure.of_file(file))?;
    let decompressed = draco::decompress(&mut document, bin, folder, most);
    Ok((document, decompressed))
}

fn parse<'j, T: serde::Deserialize<'j>>(json: &'j [u8], file: &Path) -> Result<T, ImportError> {
    serde_json::from_slice(json).map_err(|error| {
        let problem = format!("is no glTF document: {error}");
        let remedy = "check the file in a glTF validator, or export it again";
        ImportError::new(file, Place::Line(error.line() as u64), problem, remedy)
    })
}

/// Extensions without which the triangles would be wrong, and what to do about them.
const UNREADABLE: [(&str, &str); 1] =
    [("EXT_mesh_gpu_instancing", "expand its instances first (for example: gltf-transform with --instance=false)")];

fn check_version(document: &Document) -> Outcome<()> {
    let version = document.asset.min_version.as_deref().unwrap_or(&document.asset.version);
    if !(version == "2.0" || version.starts_with("2.")) {
        let problem = if version.is_empty() { "names no version".to_owned() } else { format!("is of version {version}") };
        return fail("asset", problem, "convert it to glTF 2.0");
    }
    let required = |name: &str| document.extensions_required.iter().any(|e| e == name);
    match UNREADABLE.iter().find(|(name, _)| required(name)) {
        Some((name, remedy)) => fail("extensionsRequired", format!("names {name}, which is not read here"), remedy),
        None => Ok(()),
    }
}
