//! Plain OBJ: positions, texture coordinates, normals, triangles; numbers in the fewest digits that read back to the same bits.

use super::{ExportError, ensure_whole, write_file};
use crate::Mesh;
use std::io::{self, Write};
use std::path::Path;

/// Writes the mesh's shape to a file; colours, materials and textures are left out.
///
/// # Errors
/// Where the file cannot be written, or an array of the mesh is not as long as the vertices; an older file stays as it was.
pub fn write_obj(path: &Path, mesh: &Mesh) -> Result<(), ExportError> {
    write_file(path, |out| obj(out, mesh))
}

/// Writes the mesh's shape to `out`, in many small pieces: give it a buffer.
///
/// # Errors
/// What `out` answers, or that an array of the mesh is not as long as the vertices.
pub fn obj(out: &mut dyn Write, mesh: &Mesh) -> io::Result<()> {
    ensure_whole(mesh)?;
    writeln!(out, "# written by Heliodon")?;
    for p in &mesh.positions {
        writeln!(out, "v {} {} {}", p.x, p.y, p.z)?;
    }
    for uv in &mesh.uvs {
        // OBJ counts v upwards
        writeln!(out, "vt {} {}", uv.x, 1.0 - uv.y)?;
    }
    for n in &mesh.normals {
        writeln!(out, "vn {} {} {}", n.x, n.y, n.z)?;
    }
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|i| u64::from(i) + 1);
        match (mesh.uvs.is_empty(), mesh.normals.is_empty()) {
            (true, true) => writeln!(out, "f {a} {b} {c}")?,
            (true, false) => writeln!(out, "f {a}//{a} {b}//{b} {c}//{c}")?,
            (false, true) => writeln!(out, "f {a}/{a} {b}/{b} {c}/{c}")?,
            (false, false) => writeln!(out, "f {a}/{a}/{a} {b}/{b}/{b} {c}/{c}/{c}")?,
        }
    }
    out.flush()
}
