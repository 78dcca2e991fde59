//! A mesh coloured by what became of its triangles, to look at.

use super::Mark;
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
        Mark::DoubleWall => Vec3::new(0.8, 0.8, 0.0),
        Mark::NonManifold => Vec3::new(0.0, 0.6, 0.8),
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
    let mut painted = Mesh { triangles: original.triangles.clone(), ..Mesh::default() };
    let mut copies = vec![(Mark::NonFinite, 0_u32); original.positions.len()];
    for mark in Mark::ALL.into_iter().filter(|&mark| mark != Mark::NonFinite) {
        for (triangle, _) in painted.triangles.iter_mut().zip(marks).filter(|(_, m)| **m == mark) {
            for vertex in triangle {
                let copy = &mut copies[*vertex as usize];
                if copy.0 != mark {
                    *copy = (mark, painted.positions.len() as u32);
                    painted.positions.push(original.positions[*vertex as usize]);
                    painted.colors_linear.push(color(mark));
                }
                *vertex = copy.1;
            }
        }
    }
    let mut placed = marks.iter().map(|&mark| mark != Mark::NonFinite);
    painted.triangles.retain(|_| placed.next().unwrap_or(false));
    painted
}
