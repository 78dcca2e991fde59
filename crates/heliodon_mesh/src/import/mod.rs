//! Reading meshes: PLY, OBJ, glTF and GLB, STL.
//!
//! Every reader streams its file once and places each vertex in `f64` before it is rounded (see [`crate::place`]). It keeps the
//! file's vertices in the file's order; those that texture seams or hard edges split are appended behind them. What is wrong with
//! a file ends in an [`ImportError`] that names file, place and remedy; what can be left out is left out and told in the
//! [`ImportReport`]:
//!
//! - a vertex that is NaN, infinite or more than [`FARTHEST_M`] metres away stays in its row, moved onto the first good vertex,
//!   and the triangles that use it are dropped (scanners write such points; a hole beats a refusal);
//! - an index beyond the vertices is an error, because it means that the file is damaged;
//! - a triangle with one vertex twice is dropped; a mesh that ends without triangles is an error;
//! - a missing material file or texture is a warning, and the surface takes its constant colour.

mod assembly;
mod corners;
mod error;
mod gltf;
mod material;
mod number;
mod obj;
mod ply;
mod polygon;
mod source;
mod stl;
mod wedges;

pub use error::{ImportError, ImportReport, Place};
pub use gltf::percent_decoded;
pub(crate) use gltf::{Component, raw, read_moving as read_moving_gltf};
pub use material::locate;

use crate::Mesh;
use crate::place::Placement;
pub(crate) use assembly::{Imported, rounded};
use source::BYTE_ORDER_MARK;
pub(crate) use source::Source;
use std::path::Path;
use wedges::Wedges;

/// Positions farther from the site's origin than this, in metres, count as damaged: products of two such lengths squared still
/// fit an `f32` ((2e8)^2 squared is 1.6e33), and `f32` resolves only 8 m there.
pub const FARTHEST_M: f64 = 1.0e8;

/// Edges of STL files are hard where faces meet at more than this: its facets are all that it has. The angle is the one at which
/// vertices in one place smooth one another ([`crate::normals::SEAM_ANGLE_RAD`]), so that a model looks the same from STL as from a format
/// with a vertex for each face.
pub const STL_CREASE_DEG: f32 = 60.0;

/// Which normals a mesh gets.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum NormalSource {
    /// The file's, made unit; where it has none, or one without direction, computed.
    #[default]
    FileOrComputed,
    /// Computed, whatever the file says.
    Computed,
}

/// How a mesh is read.
#[derive(Clone, Debug, PartialEq)]
pub struct ImportOptions {
    /// Where it stands.
    pub placement: Placement,
    /// Which normals it gets.
    pub normals: NormalSource,
    /// Edges where faces meet at more than this get a normal for each side where normals are computed, and vertices are split (appended)
    /// for it; 180 splits nothing. `None` is [`STL_CREASE_DEG`] for STL and 180 for all other formats, whose vertices say themselves
    /// where they part.
    pub crease_deg: Option<f32>,
    /// Whether materials are kept for their names where none of them says what it reflects; without it such a file has none.
    pub material_names: bool,
    /// More vertices or triangles than this are refused. How many a file may make by instancing depends on its size, too.
    pub most_elements: u32,
}

impl Default for ImportOptions {
    fn default() -> Self {
        Self {
            placement: Placement::default(),
            normals: NormalSource::FileOrComputed,
            crease_deg: None,
            material_names: false,
            // 50 million triangles that share no corner
            most_elements: 150_000_000,
        }
    }
}

/// A mesh file format.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Format {
    /// Stanford PLY.
    Ply,
    /// Wavefront OBJ.
    Obj,
    /// glTF 2.0, as JSON or binary.
    Gltf,
    /// STL, text or binary.
    Stl,
}

impl Format {
    /// The format that a file's name ends in.
    #[must_use]
    pub fn of_name(path: &Path) -> Option<Self> {
        let ending = path.extension()?.to_string_lossy().to_ascii_lowercase();
        match ending.as_str() {
            "ply" => Some(Self::Ply),
            "obj" => Some(Self::Obj),
            "gltf" | "glb" => Some(Self::Gltf),
            "stl" => Some(Self::Stl),
            _ => None,
        }
    }

    /// The format that a file's first bytes show; `None` for OBJ, which begins with anything.
    fn of_bytes(first: &[u8]) -> Option<Self> {
        let first = first.strip_prefix(BYTE_ORDER_MARK).unwrap_or(first);
        if first.starts_with(b"ply\n") || first.starts_with(b"ply\r") {
            Some(Self::Ply)
        } else if first.starts_with(b"glTF") {
            Some(Self::Gltf)
        } else {
            None
        }
    }
}

/// Reads a mesh file. What was left out goes unsaid: see [`read_reporting`].
///
/// # Errors
/// Where the file cannot be read, or holds no triangles that are fit for use.
pub fn read(path: &Path, options: &ImportOptions) -> Result<Mesh, ImportError> {
    read_reporting(path, options, &mut ImportReport::default())
}

/// Reads a mesh file and adds to `report` what was left out or mended.
///
/// # Errors
/// Where the file cannot be read, or holds no triangles that are fit for use.
pub fn read_reporting(path: &Path, options: &ImportOptions, report: &mut ImportReport) -> Result<Mesh, ImportError> {
    read_telling(path, options, report, &|_| ())
}

/// As [`read_reporting`]; `tell` hears how many bytes of the file are read so far, a few times a second at least. What a glTF file's bytes mean
/// is looked at once all are there, so its last bytes take the longest.
///
/// # Errors
/// As [`read_reporting`].
pub fn read_telling(
    path: &Path,
    options: &ImportOptions,
    report: &mut ImportReport,
    tell: &dyn Fn(u64),
) -> Result<Mesh, ImportError> {
    let (source, format) = open(path)?;
    read_source(&mut source.telling(tell), format, path.parent(), options, report).map(|imported| imported.mesh)
}

/// A file's bytes, and the format that they or its name show.
pub(crate) fn open(path: &Path) -> Result<(Source<'_>, Format), ImportError> {
    let mut source = Source::open(path)?;
    match Format::of_bytes(source.peek(8)?).or_else(|| Format::of_name(path)) {
        Some(format) => Ok((source, format)),
        None => {
            let remedy = "name a file that ends in .ply, .obj, .gltf, .glb or .stl, or convert it to one";
            Err(source.fail("is no mesh in a known format", remedy))
        }
    }
}

/// Reads a mesh from the bytes of a file; `name` is for messages. Files that it names (materials, textures, buffers) are not read.
///
/// # Errors
/// As [`read_reporting`].
pub fn from_bytes(
    bytes: &[u8],
    format: Format,
    name: &Path,
    options: &ImportOptions,
    report: &mut ImportReport,
) -> Result<Mesh, ImportError> {
    read_source(&mut Source::from_bytes(name, bytes), format, None, options, report).map(|imported| imported.mesh)
}

pub(crate) fn read_source(
    source: &mut Source,
    format: Format,
    folder: Option<&Path>,
    options: &ImportOptions,
    report: &mut ImportReport,
) -> Result<Imported, ImportError> {
    // The counts of several files add up in the report, but each reader tells its own.
    let mut own = ImportReport::default();
    let result = match format {
        Format::Ply => ply::read(source, folder, options, &mut own),
        Format::Obj => obj::read(source, folder, options, &mut own),
        Format::Gltf => gltf::read(source, folder, options, &mut own),
        Format::Stl => stl::read(source, options, &mut own),
    };
    report.add(own);
    result
}
