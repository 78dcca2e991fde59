//! The faces and triangle strips of a PLY file.

use super::find_scalar;
use super::header::{Element, Encoding, Kind, Scalar};
use super::rows::Rows;
use crate::import::Wedges;
use crate::import::assembly::Assembly;
use crate::import::error::ImportError;
use crate::import::polygon::triangulate;
use glam::DVec3;

/// The property that lists a face's vertices.
pub(super) fn index_list(element: &Element) -> Option<(usize, Scalar, Scalar)> {
    let at = element.find(&["vertex_indices", "vertex_index", "vertex_indexes", "vertices"])?;
    match element.properties[at].kind {
        Kind::List { count, item } if !item.is_float() => Some((at, count, item)),
        _ => None,
    }
}

pub(super) fn read(
    rows: &mut Rows,
    element: &Element,
    vertices: u32,
    assembly: &mut Assembly,
    wedges: &mut Wedges,
) -> Result<(), ImportError> {
    let Some((at, count_type, item_type)) = index_list(element) else { return Ok(()) };
    let texcoords = element.find(&["texcoord"]).filter(|&i| matches!(element.properties[i].kind, Kind::List { .. }));
    let texture_number = find_scalar(element, &["texnumber"]);
    // what a header promises takes no memory that the file has no bytes for
    let held = rows.source.remaining() / element.least_row(rows.encoding()).max(1);
    assembly.mesh.triangles.reserve_exact(element.count.min(held) as usize);
    let mut face = Face::default();
    let plain = element.properties.len() == 1 && rows.encoding() != Encoding::Ascii;
    for number in 0..element.count {
        face.indices.clear();
        face.uvs.clear();
        let mut texture = 0.0;
        if plain {
            read_indices(rows, count_type, item_type, number, vertices, &mut face.indices)?;
        } else {
            for (i, property) in element.properties.iter().enumerate() {
                match property.kind {
                    _ if i == at => read_indices(rows, count_type, item_type, number, vertices, &mut face.indices)?,
                    Kind::List { count, item } if Some(i) == texcoords => {
                        for _ in 0..rows.list_count(count, item)? {
                            face.uvs.push(rows.scalar(item)? as f32);
                        }
                    }
                    Kind::Scalar(scalar) if Some(i) == texture_number => texture = rows.scalar(scalar)?,
                    kind => rows.skip(kind)?,
                }
            }
        }
        let material = (texture_number.is_some()).then_some(texture.clamp(0.0, 65535.0) as u16);
        face.push(number, rows, assembly, wedges, material)?;
    }
    Ok(())
}

#[derive(Default)]
struct Face {
    indices: Vec<u32>,
    uvs: Vec<f32>,
    cut: Vec<[usize; 3]>,
}

impl Face {
    fn push(
        &mut self,
        number: u64,
        rows: &Rows,
        assembly: &mut Assembly,
        wedges: &mut Wedges,
        material: Option<u16>,
    ) -> Result<(), ImportError> {
        let bases = self.indices.len();
        if bases > 3 {
            // Faces may stand before the vertices in the file; then all that is left is a fan.
            let positions = &assembly.mesh.positions;
            let position = |i: usize| positions.get(self.indices[i] as usize).map_or(DVec3::ZERO, |p| p.as_dvec3());
            triangulate(bases, position, &mut self.cut);
            assembly.check_count((assembly.mesh.triangles.len() + bases) as u64, "triangles")?;
        } else {
            self.cut.clear();
            self.cut.extend((bases == 3).then_some([0, 1, 2]));
        }
        let own_uvs = !self.uvs.is_empty() && self.uvs.len() >= 2 * bases;
        if own_uvs {
            for (index, uv) in self.indices.iter_mut().zip(self.uvs.chunks_exact(2)) {
                let key = [uv[0].to_bits(), uv[1].to_bits()];
                *index = wedges.corners.vertex(*index, key).ok_or_else(|| {
                    let remedy = "split it into several files";
                    rows.source.fail_at(format!("face {number}"), "has more texture seams than indices can count", remedy)
                })?;
            }
        }
        for &[a, b, c] in &self.cut {
            assembly.push_triangle([self.indices[a], self.indices[b], self.indices[c]], material);
        }
        Ok(())
    }
}

#[inline]
fn read_indices(
    rows: &mut Rows,
    count_type: Scalar,
    item_type: Scalar,
    face: u64,
    vertices: u32,
    out: &mut Vec<u32>,
) -> Result<(), ImportError> {
    let count = rows.list_count(count_type, item_type)?;
    for _ in 0..count {
        let index = rows.scalar(item_type)?;
        out.push(check_index(rows, index, vertices, || format!("face {face}"))?);
    }
    Ok(())
}

#[inline]
fn check_index(rows: &Rows, index: f64, vertices: u32, item: impl Fn() -> String) -> Result<u32, ImportError> {
    // false for NaN
    if index >= 0.0 && index < f64::from(vertices) {
        return Ok(index as u32);
    }
    let problem = format!("names vertex {index}, but there are {vertices} (counted from 0)");
    Err(rows.source.fail_at(item(), problem, crate::import::source::DAMAGED))
}

/// Strips of triangles, every other one turned round, with -1 where a new one begins: as Cyberware's and Stanford's tools wrote.
pub(super) fn read_strips(
    rows: &mut Rows,
    element: &Element,
    vertices: u32,
    assembly: &mut Assembly,
) -> Result<(), ImportError> {
    let Some((at, count_type, item_type)) = index_list(element) else { return Ok(()) };
    for number in 0..element.count {
        for (i, property) in element.properties.iter().enumerate() {
            if i != at {
                rows.skip(property.kind)?;
                continue;
            }
            let count = rows.list_count(count_type, item_type)?;
            assembly.check_count((assembly.mesh.triangles.len() + count) as u64, "triangles")?;
            let mut strip = Strip::default();
            for place in 0..count {
                let index = rows.scalar(item_type)?;
                // an unsigned type holds -1 as its largest number
                if index == -1.0 || (index == f64::from(u32::MAX) && item_type == Scalar::U32) {
                    strip = Strip::default();
                    continue;
                }
                let index = check_index(rows, index, vertices, || format!("strip {number}, entry {place}"))?;
                if let Some(triangle) = strip.next(index) {
                    assembly.push_triangle(triangle, None);
                }
            }
        }
    }
    Ok(())
}

/// A triangle strip, index by index.
#[derive(Default)]
pub(crate) struct Strip {
    last: [u32; 2],
    length: u64,
}

impl Strip {
    /// The triangle that this index completes; one with two equal corners only turns the strip and is none.
    #[inline]
    pub fn next(&mut self, index: u32) -> Option<[u32; 3]> {
        let [a, b] = self.last;
        let (whole, odd) = (self.length >= 2, self.length % 2 == 1);
        self.last = [b, index];
        self.length += 1;
        if !whole || a == b || b == index || a == index {
            return None;
        }
        Some(if odd { [b, a, index] } else { [a, b, index] })
    }
}
