//! Texture coordinates that belong to corners, spread over vertices.

use super::assembly::Assembly;
use super::corners::Corners;
use glam::Vec2;

/// Corners whose key is the bits of their texture coordinates.
#[derive(Default)]
pub(crate) struct Wedges {
    pub corners: Corners,
}

impl Wedges {
    /// Appends the vertices that seams split, and gives all vertices their texture coordinates; nothing where no corner had any.
    pub fn apply_uvs(&self, assembly: &mut Assembly) {
        if self.corners.is_empty() {
            return;
        }
        let mesh = &mut assembly.mesh;
        let count = mesh.positions.len();
        assembly.file_vertices = Some(count as u64);
        assembly.appended = self.corners.extra_bases().to_vec();
        Corners::number(&mut mesh.triangles, count as u32);
        repeat(&mut mesh.positions, self.corners.extra_bases());
        repeat(&mut mesh.normals, self.corners.extra_bases());
        repeat(&mut mesh.colors_linear, self.corners.extra_bases());
        mesh.uvs = self
            .corners
            .keys(count)
            .map(|key| key.map_or(Vec2::ZERO, |[u, v]| Vec2::new(f32::from_bits(u), 1.0 - f32::from_bits(v))))
            .collect();
    }
}

/// Appends the entries at `bases`, where there are entries at all.
pub(crate) fn repeat<T: Copy>(values: &mut Vec<T>, bases: &[u32]) {
    if !values.is_empty() {
        values.reserve_exact(bases.len());
        for &base in bases {
            values.push(values[base as usize]);
        }
    }
}
