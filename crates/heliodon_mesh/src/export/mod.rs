//! Writing meshes: PLY and OBJ; objects that move: GLB and PC2; meshes with a light map: GLB. (The glTF of monuments is the bundle's.)

mod beside;
mod glb;
mod obj;
mod pc2;
mod ply;
pub mod scene;
mod second_uvs;

pub use beside::{beside, token};
pub use glb::{glb, write_glb};
pub use obj::{obj, write_obj};
pub use pc2::write_pc2;
pub use ply::{ply, write_ply};
pub use second_uvs::{LightTextures, UnwrappedPart, glb_with_second_uvs, write_glb_with_second_uvs};

use crate::Mesh;
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

/// Refuses a mesh that has a normal, texture coordinate or colour for some of its vertices only: these formats cannot say so, and their
/// readers would take the numbers of one vertex for another's.
fn ensure_whole(mesh: &Mesh) -> std::io::Result<()> {
    let vertices = mesh.positions.len();
    for (what, length) in
        [("normals", mesh.normals.len()), ("texture coordinates", mesh.uvs.len()), ("colours", mesh.colors_linear.len())]
    {
        if length != 0 && length != vertices {
            let fault = format!("the mesh has {length} {what} for {vertices} vertices");
            return Err(std::io::Error::new(std::io::ErrorKind::InvalidInput, fault));
        }
    }
    Ok(())
}

/// Writes to a file beside the wanted one and renames it, so that a failure leaves what was there.
fn write_file(path: &Path, write: impl FnOnce(&mut dyn Write) -> std::io::Result<()>) -> Result<(), ExportError> {
    let beside = beside(path);
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

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn meshes_with_gaps_are_not_written() {
        let mesh = Mesh { positions: vec![Vec3::ZERO; 3], normals: vec![Vec3::Y; 2], ..Mesh::default() };
        for write in [obj as fn(&mut dyn Write, &Mesh) -> std::io::Result<()>, |out, mesh| ply(out, mesh, None)] {
            let mut out = Vec::new();
            let error = write(&mut out, &mesh).unwrap_err().to_string();
            assert!(error.contains("2 normals for 3 vertices") && out.is_empty(), "{error}");
        }
    }
}
