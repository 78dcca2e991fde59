//! Binary little-endian PLY with whatever the mesh has: normals, texture coordinates, sRGB colours, and a number for each vertex.

use super::{ExportError, ensure_whole, write_file};
use crate::Mesh;
use heliodon_math::color::srgb8_from_linear;
use std::io::{self, Write};
use std::path::Path;

/// Writes the mesh to a file; `quality`, if given, is a number for each vertex under the name that MeshLab knows.
///
/// # Errors
/// Where the file cannot be written, or `quality` or an array of the mesh is not as long as the vertices; an older file stays as it was.
pub fn write_ply(path: &Path, mesh: &Mesh, quality: Option<&[f32]>) -> Result<(), ExportError> {
    write_file(path, |out| ply(out, mesh, quality))
}

/// Writes the mesh to `out`, in many small pieces: give it a buffer.
///
/// # Errors
/// What `out` answers, or that `quality` or an array of the mesh is not as long as the vertices.
pub fn ply(out: &mut dyn Write, mesh: &Mesh, quality: Option<&[f32]>) -> io::Result<()> {
    if quality.is_some_and(|q| q.len() != mesh.positions.len()) {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "as many numbers as vertices are needed"));
    }
    ensure_whole(mesh)?;
    header(out, mesh, quality.is_some())?;
    let mut row = Vec::with_capacity(64);
    for (i, p) in mesh.positions.iter().enumerate() {
        row.clear();
        row.extend_from_slice(bytemuck::bytes_of(&p.to_array().map(|c| c.to_le_bytes())));
        if let Some(n) = mesh.normals.get(i) {
            row.extend_from_slice(bytemuck::bytes_of(&n.to_array().map(|c| c.to_le_bytes())));
        }
        if let Some(uv) = mesh.uvs.get(i) {
            // PLY counts v upwards
            row.extend_from_slice(bytemuck::bytes_of(&[uv.x.to_le_bytes(), (1.0 - uv.y).to_le_bytes()]));
        }
        if let Some(color) = mesh.colors_linear.get(i) {
            row.extend_from_slice(&color.to_array().map(srgb8_from_linear));
        }
        if let Some(quality) = quality {
            row.extend_from_slice(&quality[i].to_le_bytes());
        }
        out.write_all(&row)?;
    }
    for triangle in &mesh.triangles {
        let mut row = [3_u8; 13];
        for (bytes, index) in row[1..].chunks_exact_mut(4).zip(triangle) {
            bytes.copy_from_slice(&index.to_le_bytes());
        }
        out.write_all(&row)?;
    }
    out.flush()
}

fn header(out: &mut dyn Write, mesh: &Mesh, quality: bool) -> io::Result<()> {
    writeln!(out, "ply\nformat binary_little_endian 1.0\ncomment written by Heliodon")?;
    let properties = |names: &[&str], kind: &str, present: bool| {
        let present = if present { names } else { &[] };
        present.iter().map(|name| format!("property {kind} {name}\n")).collect::<String>()
    };
    let vertex = [
        properties(&["x", "y", "z"], "float", true),
        properties(&["nx", "ny", "nz"], "float", !mesh.normals.is_empty()),
        properties(&["texture_u", "texture_v"], "float", !mesh.uvs.is_empty()),
        properties(&["red", "green", "blue"], "uchar", !mesh.colors_linear.is_empty()),
        properties(&["quality"], "float", quality),
    ];
    write!(out, "element vertex {}\n{}", mesh.positions.len(), vertex.concat())?;
    let index = if mesh.positions.len() > i32::MAX as usize { "uint" } else { "int" };
    writeln!(out, "element face {}\nproperty list uchar {index} vertex_indices\nend_header", mesh.triangles.len())
}
