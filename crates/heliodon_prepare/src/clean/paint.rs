//! A mesh coloured by what became of its triangles, to look at.

use super::Mark;
use crate::paint::paint_by;
use glam::Vec3;
use heliodon_mesh::Mesh;

/// The colour of a mark, linear Rec. 709: grey is well, warm is gone, cold is worth a look.
#[must_use]
pub fn color(mark: Mark) -> Vec3 {
    match mark {
        Mark::NonFinite => Vec3::new(0.0, 0.0, 0.0),
        Mark::Degenerate => Vec3::new(0.25, 0.0, 0.0),
        Mark::Duplicate => Vec3::new(1.0, 0.0, 0.0),
        Mark::RemovedDoubleWall => Vec3::new(1.0, 0.2, 0.0),
        Mark::Isolated => Vec3::new(1.0, 0.6, 0.0),
        Mark::Flipped => Vec3::new(0.0, 0.6, 0.1),
        Mark::WrongWay => Vec3::new(0.3, 0.0, 0.6),
        Mark::OneSided => Vec3::new(1.0, 0.0, 0.6),
        Mark::Flat => Vec3::new(0.0, 0.3, 0.3),
        Mark::DoubleWall => Vec3::new(0.8, 0.8, 0.0),
        Mark::NonManifold => Vec3::new(0.0, 0.6, 0.8),
        Mark::TJunction => Vec3::new(0.6, 0.4, 1.0),
        Mark::Open => Vec3::new(0.0, 0.1, 1.0),
        Mark::Kept => Vec3::splat(0.4),
    }
}

/// The mesh as it came, its triangles coloured by what became of them; without those that have no place. A vertex is there once for
/// each colour that its triangles have.
///
/// # Panics
/// If there are not as many marks as triangles.
#[must_use]
pub fn paint(original: &Mesh, marks: &[Mark]) -> Mesh {
    assert_eq!(marks.len(), original.triangles.len(), "one mark for each triangle");
    paint_by(original, &Mark::ALL.map(color), |t| (marks[t] != Mark::NonFinite).then_some(marks[t] as u8))
}
