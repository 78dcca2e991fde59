//! Meshes coloured by what is said of their triangles.

use glam::Vec3;
use heliodon_mesh::Mesh;

/// A mesh whose triangles have the colours of their classes, without those that have none. A vertex is there once for each class
/// that its triangles have.
pub(crate) fn paint_by(original: &Mesh, colors_linear: &[Vec3], class: impl Fn(usize) -> Option<u8>) -> Mesh {
    let mut painted = Mesh::default();
    painted.triangles.resize(original.triangles.len(), [u32::MAX; 3]);
    let mut copies = vec![(u8::MAX, 0_u32); original.positions.len()];
    for (number, &color) in (0..).zip(colors_linear) {
        for (t, triangle) in original.triangles.iter().enumerate().filter(|(t, _)| class(*t) == Some(number)) {
            painted.triangles[t] = triangle.map(|vertex| {
                let copy = &mut copies[vertex as usize];
                if copy.0 != number {
                    *copy = (number, painted.positions.len() as u32);
                    painted.positions.push(original.positions[vertex as usize]);
                    painted.colors_linear.push(color);
                }
                copy.1
            });
        }
    }
    painted.triangles.retain(|triangle| triangle[0] != u32::MAX);
    painted
}
