//! Stanford PLY, as scanners, Stanford's, Cyberware's and MeshLab's tools wrote it.
//!
//! Greg Turk: "The PLY Polygon File Format", 1994. Read here: text and both binary orders; `vertex` with positions, normals,
//! colours and texture coordinates under the names that are in use; `face` with lists of any width; `tristrips` with -1 between
//! strips; MeshLab's texture coordinates for each corner (`texcoord`, `texnumber`) and its `comment TextureFile`. All other
//! elements and properties are passed over.

mod faces;
mod header;
mod rows;
mod vertices;

use super::assembly::{Assembly, Imported};
use super::error::{ImportError, ImportReport};
use super::material::{Textures, UNSAID_ALBEDO, keep_colors_without};
use super::source::Source;
use super::{ImportOptions, Wedges};
use crate::{Material, TextureWrap};
pub(super) use faces::Strip;
use glam::Vec3;
use header::{Element, Header, Kind};
use rows::Rows;
use std::path::Path;

pub(super) fn read(
    source: &mut Source,
    folder: Option<&Path>,
    options: &ImportOptions,
    report: &mut ImportReport,
) -> Result<Imported, ImportError> {
    source.skip_byte_order_mark()?;
    let header = header::read(source)?;
    let mut assembly = Assembly::new(source.file(), options, report)?;
    let vertex_count = check(source, &header, &assembly)?;
    let mut wedges = Wedges::default();
    let mut rows = Rows::new(source, header.encoding);
    let mut vertices_read = false;
    let (mut faces_read, mut vertices_left_over) = (false, false);
    for element in &header.elements {
        match element.name.as_str() {
            "vertex" if !vertices_read => {
                vertices::read(&mut rows, element, &mut assembly)?;
                vertices_read = true;
            }
            "face" if faces::index_list(element).is_some() => {
                faces::read(&mut rows, element, vertex_count, &mut assembly, &mut wedges)?;
                faces_read = true;
            }
            "tristrips" if faces::index_list(element).is_some() => {
                faces::read_strips(&mut rows, element, vertex_count, &mut assembly)?;
                faces_read = true;
            }
            "vertex" => {
                vertices_left_over = true;
                rows.skip_element(element)?;
            }
            _ => rows.skip_element(element)?,
        }
    }
    if vertices_left_over {
        assembly.warn("has several \"vertex\" elements; only the first is read");
    }
    let left_over = rows.left_over()?;
    if !faces_read || (assembly.mesh.triangles.is_empty() && assembly.report.collapsed_triangles == 0) {
        return Err(if left_over > 0 {
            left_over_fault(source, left_over)
        } else {
            without_faces(source, &header, vertex_count)
        });
    }
    if left_over > 0 {
        assembly.warn(format_args!(
            "{left_over} bytes behind its last row are not read; the header may count too few rows, then export it again"
        ));
    }
    wedges.apply_uvs(&mut assembly);
    materials(&header, folder, &mut assembly);
    assembly.finish()
}

/// The number of vertices, once it is sure that there are some and that indices can name them.
fn check(source: &Source, header: &Header, assembly: &Assembly) -> Result<u32, ImportError> {
    let Some(vertex) = header.elements.iter().find(|e| e.name == "vertex") else {
        return Err(source.fail("has no element \"vertex\"", "check that it holds a mesh"));
    };
    if vertex.count == 0 {
        return Err(source.fail("has no vertices", "check that the export was not empty"));
    }
    for axis in ["x", "y", "z"] {
        let scalar = vertex.find(&[axis]).is_some_and(|i| matches!(vertex.properties[i].kind, Kind::Scalar(_)));
        if !scalar {
            return Err(source.fail(format!("its vertices have no \"{axis}\""), "export it with positions"));
        }
    }
    assembly.check_count(vertex.count, "vertices")?;
    let faces: u64 = header.elements.iter().filter(|e| e.name == "face").map(|e| e.count).sum();
    assembly.check_count(faces, "faces")?;
    Ok(vertex.count as u32)
}

/// Rows that a header counts too few of are read as those of the next element, and make no sense there.
fn left_over_fault(source: &Source, bytes: u64) -> ImportError {
    let problem =
        format!("its rows make no triangles, and {bytes} bytes are left behind the last: the header's counts are wrong");
    source.fail(problem, "export it again")
}

fn without_faces(source: &Source, header: &Header, vertices: u32) -> ImportError {
    let named = |name: &str| header.elements.iter().find(|e| e.name == name);
    if named("range_grid").is_some() {
        let remedy = "turn it into triangles first (Stanford's ply2tri, or MeshLab's import of range maps)";
        return source.fail("is a range image (range_grid), not a surface", remedy);
    }
    if let Some(face) = named("face").filter(|f| f.count > 0) {
        let has: Vec<&str> = face.properties.iter().map(|p| p.name.as_str()).collect();
        let problem = format!("its faces have no list \"vertex_indices\" with triangles in it (only: {})", has.join(", "));
        return source.fail(problem, "export it with faces");
    }
    let remedy = "make a surface of the points first (for example in MeshLab or CloudCompare)";
    source.fail(format!("is a cloud of {vertices} points without faces"), remedy)
}

/// A material for each texture that the header names; the triangles name them already.
fn materials(header: &Header, folder: Option<&Path>, assembly: &mut Assembly) {
    if header.textures.is_empty() {
        assembly.mesh.triangle_material.clear();
        return;
    }
    let mut textures = Textures::default();
    let folders: Vec<&Path> = folder.into_iter().collect();
    let wrap = [TextureWrap::Repeat; 2];
    let loaded: Vec<_> = header.textures.iter().map(|name| textures.load(&folders, name, wrap, assembly)).collect();
    let has_colors = keep_colors_without(loaded.iter().any(Option::is_some), assembly);
    for (name, texture) in header.textures.iter().zip(loaded) {
        let plain = texture.is_none() && !has_colors;
        let base_color_linear = if plain { Vec3::splat(UNSAID_ALBEDO) } else { Vec3::ONE };
        assembly.mesh.materials.push(Material { name: name.clone(), base_color_linear, texture });
    }
    let last = assembly.mesh.materials.len() as u16 - 1;
    assembly.mesh.triangle_material.iter_mut().for_each(|m| *m = (*m).min(last));
}

fn find_scalar(element: &Element, names: &[&str]) -> Option<usize> {
    element.find(names).filter(|&i| matches!(element.properties[i].kind, Kind::Scalar(_)))
}
