//! The vertices of a PLY file.

use super::find_scalar;
use super::header::{Element, Encoding, Kind, Scalar};
use super::rows::{Rows, decode};
use crate::import::assembly::Assembly;
use crate::import::error::ImportError;
use glam::{DVec3, Vec2, Vec3};
use heliodon_math::color::{linear_from_srgb, linear_from_srgb8_table};

/// Values of a row that have a meaning here, and where each goes.
const SLOTS: usize = 11;
const NORMAL: usize = 3;
const COLOR: usize = 6;
const UV: usize = 9;

/// Which property holds what, and as what.
struct Layout {
    /// For each property the slot that it fills.
    slot: Vec<Option<usize>>,
    has_normals: bool,
    has_uvs: bool,
    color: Option<ColorScale>,
}

/// What full red is.
#[derive(Clone, Copy, PartialEq)]
enum ColorScale {
    /// Bytes.
    Byte,
    /// Integers up to the divisor.
    Divisor(f64),
    /// Floats, either up to 1 or up to 255; told apart by the largest.
    Float,
}

fn layout(element: &Element) -> Layout {
    let mut slot = vec![None; element.properties.len()];
    let mut fill = |first: usize, names: &[&[&str]]| {
        let found: Option<Vec<usize>> = names.iter().map(|names| find_scalar(element, names)).collect();
        if let Some(found) = &found {
            found.iter().enumerate().for_each(|(k, &property)| slot[property] = Some(first + k));
        }
        found
    };
    fill(0, &[&["x"], &["y"], &["z"]]);
    let has_normals = fill(NORMAL, &[&["nx", "normal_x"], &["ny", "normal_y"], &["nz", "normal_z"]]).is_some();
    let colors = fill(COLOR, &[&["red", "diffuse_red", "r"], &["green", "diffuse_green", "g"], &["blue", "diffuse_blue", "b"]]);
    let u = ["u", "s", "texture_u", "texture_s", "tex_u"];
    let v = ["v", "t", "texture_v", "texture_t", "tex_v"];
    let has_uvs = fill(UV, &[&u, &v]).is_some();
    let color = colors.and_then(|found| match element.properties[found[0]].kind {
        Kind::Scalar(Scalar::U8 | Scalar::I8) => Some(ColorScale::Byte),
        Kind::Scalar(Scalar::U16 | Scalar::I16) => Some(ColorScale::Divisor(65535.0)),
        Kind::Scalar(Scalar::F32 | Scalar::F64) => Some(ColorScale::Float),
        // whole numbers in wide types are bytes all the same
        Kind::Scalar(_) => Some(ColorScale::Divisor(255.0)),
        Kind::List { .. } => None,
    });
    Layout { slot, has_normals, has_uvs, color }
}

pub(super) fn read(rows: &mut Rows, element: &Element, assembly: &mut Assembly) -> Result<(), ImportError> {
    let layout = layout(element);
    let count = element.count as usize;
    assembly.mesh.positions.reserve_exact(count);
    assembly.mesh.normals.reserve_exact(if layout.has_normals { count } else { 0 });
    assembly.mesh.colors_linear.reserve_exact(if layout.color.is_some() { count } else { 0 });
    assembly.mesh.uvs.reserve_exact(if layout.has_uvs { count } else { 0 });
    let mut push = Push { layout: &layout, table: linear_from_srgb8_table(), raw_colors: Vec::new() };
    match (element.fixed_row(), rows.encoding()) {
        (Some(row), Encoding::Little) => read_fixed::<false>(rows, element, row, &mut push, assembly)?,
        (Some(row), Encoding::Big) => read_fixed::<true>(rows, element, row, &mut push, assembly)?,
        _ => {
            for _ in 0..count {
                let mut values = [0.0; SLOTS];
                for (property, slot) in element.properties.iter().zip(&layout.slot) {
                    match (property.kind, slot) {
                        (Kind::Scalar(scalar), Some(slot)) => values[*slot] = rows.scalar(scalar)?,
                        (kind, _) => rows.skip(kind)?,
                    }
                }
                push.vertex(&values, assembly);
            }
        }
    }
    push.finish(assembly);
    Ok(())
}

fn read_fixed<const BIG: bool>(
    rows: &mut Rows,
    element: &Element,
    row: usize,
    push: &mut Push,
    assembly: &mut Assembly,
) -> Result<(), ImportError> {
    let mut wanted = Vec::new();
    let mut offset = 0;
    for (property, slot) in element.properties.iter().zip(&push.layout.slot) {
        if let Kind::Scalar(scalar) = property.kind {
            if let Some(slot) = slot {
                wanted.push((offset, scalar, *slot));
            }
            offset += scalar.size();
        }
    }
    for _ in 0..element.count {
        let bytes = rows.source.take(row)?;
        let mut values = [0.0; SLOTS];
        for &(offset, scalar, slot) in &wanted {
            values[slot] = decode::<BIG>(scalar, &bytes[offset..]);
        }
        push.vertex(&values, assembly);
    }
    Ok(())
}

struct Push<'l> {
    layout: &'l Layout,
    table: [f32; 256],
    /// Float colours wait here until it is known whether they go to 1 or to 255.
    raw_colors: Vec<Vec3>,
}

impl Push<'_> {
    #[inline]
    fn vertex(&mut self, values: &[f64; SLOTS], assembly: &mut Assembly) {
        let three = |first: usize| DVec3::new(values[first], values[first + 1], values[first + 2]);
        assembly.push_position(three(0));
        if self.layout.has_normals {
            assembly.push_normal(three(NORMAL));
        }
        if self.layout.has_uvs {
            assembly.mesh.uvs.push(Vec2::new(values[UV] as f32, (1.0 - values[UV + 1]) as f32));
        }
        match self.layout.color {
            None => {}
            Some(ColorScale::Byte) => {
                // `as u8` saturates; the sign of a `char` is a byte's top bit
                let code = |value: f64| self.table[if value < 0.0 { (value + 256.0) as u8 } else { value as u8 } as usize];
                assembly.push_color(Vec3::new(code(values[COLOR]), code(values[COLOR + 1]), code(values[COLOR + 2])));
            }
            Some(ColorScale::Divisor(divisor)) => {
                let srgb = (three(COLOR) / divisor).as_vec3().to_array();
                assembly.push_color(Vec3::from(srgb.map(linear_from_srgb)));
            }
            Some(ColorScale::Float) => self.raw_colors.push(three(COLOR).as_vec3()),
        }
    }

    fn finish(self, assembly: &mut Assembly) {
        if self.layout.color == Some(ColorScale::Float) {
            crate::import::material::push_srgb_colors(&self.raw_colors, assembly);
        }
    }
}
