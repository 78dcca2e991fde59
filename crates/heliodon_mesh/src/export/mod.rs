//! Writing meshes: PLY and OBJ; objects that move: GLB and PC2. (The glTF of monuments is the bundle's.)

mod glb;
mod obj;
mod pc2;
mod ply;
pub mod scene;

pub use glb::{glb, write_glb};
pub use obj::{obj, write_obj};
pub use pc2::write_pc2;
pub use ply::{ply, write_ply};

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

/// A mesh file that could not be written.
#[derive(Debug, thiserror::Error)]
#[error("{}: cannot be written: {source}; check the folder, its rights and the room on the disk", file.display())]
pub struct ExportError {
    /// The file.
    pub file: PathBuf,
    /// What the system said.
    pub source: std::io::Error,
}

/// Writes to a file beside the wanted one and renames it, so that a failure leaves what was there.
fn write_file(path: &Path, write: impl FnOnce(&mut dyn Write) -> std::io::Result<()>) -> Result<(), ExportError> {
    let mut name = path.file_name().unwrap_or_default().to_os_string();
    name.push(format!(".tmp-{}", std::process::id()));
    let beside = path.with_file_name(name);
    let attempt = || {
        let mut out = BufWriter::with_capacity(1 << 18, File::create(&beside)?);
        write(&mut out)?;
        out.into_inner()?.sync_all()?;
        std::fs::rename(&beside, path)
    };
    attempt().map_err(|source| {
        // What is left of the attempt is of no use; that it cannot be removed either adds nothing to the first error.
        let _ = std::fs::remove_file(&beside);
        ExportError { file: path.to_owned(), source }
    })
}
