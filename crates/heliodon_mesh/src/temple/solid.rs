//! The mesh of one stone, and the seams that join rows of unlike counts without a crack.

use super::marble::Look;
use crate::Mesh;
use glam::Vec3;
use heliodon_math::frame::unit_or;
use std::ops::Range;

/// Triangles of one closed solid. Vertices at creases are doubled, at equal positions.
#[derive(Clone, Debug, Default)]
pub struct SolidMesh {
    pub positions: Vec<Vec3>,
    pub normals: Vec<Vec3>,
    pub colors_linear: Vec<Vec3>,
    pub triangles: Vec<[u32; 3]>,
}

impl SolidMesh {
    /// Fills `normals` with angle-weighted ones of the triangles (Thürmer and Wüthrich, "Computing Vertex Normals from
    /// Polygonal Facets", 1998). Triangles in the `covered` ranges count only where no others meet.
    pub fn compute_normals(&mut self, covered: &[Range<usize>]) {
        let mut sums = vec![Vec3::ZERO; self.positions.len()];
        let is_covered = |t: usize| covered.iter().any(|range| range.contains(&t));
        self.add_normals((0..self.triangles.len()).filter(|&t| !is_covered(t)), &mut sums);
        let mut rest = vec![Vec3::ZERO; if covered.is_empty() { 0 } else { sums.len() }];
        self.add_normals(covered.iter().cloned().flatten(), &mut rest);
        for (sum, rest) in sums.iter_mut().zip(rest).filter(|(sum, _)| **sum == Vec3::ZERO) {
            *sum = rest;
        }
        self.normals = sums.into_iter().map(|sum| unit_or(sum, Vec3::Y)).collect();
    }

    fn add_normals(&self, triangles: impl Iterator<Item = usize>, sums: &mut [Vec3]) {
        for triangle in triangles.map(|t| self.triangles[t]) {
            let corner = triangle.map(|i| self.positions[i as usize]);
            let normal = unit_or((corner[1] - corner[0]).cross(corner[2] - corner[0]), Vec3::ZERO);
            for k in 0..3 {
                let a = unit_or(corner[(k + 1) % 3] - corner[k], Vec3::ZERO);
                let b = unit_or(corner[(k + 2) % 3] - corner[k], Vec3::ZERO);
                sums[triangle[k] as usize] += normal * libm::acosf(a.dot(b).clamp(-1.0, 1.0));
            }
        }
    }

    /// Makes the normals of doubled vertices one where the crease is blunter than the cosine.
    pub fn soften(&mut self, pairs: &[(u32, u32)], cosine: f32) {
        for &(a, b) in pairs {
            let (na, nb) = (self.normals[a as usize], self.normals[b as usize]);
            if na.dot(nb) > cosine {
                let mean = unit_or(na + nb, na);
                self.normals[a as usize] = mean;
                self.normals[b as usize] = mean;
            }
        }
    }

    /// Fills `colors_linear`; `lost` is how deep the stone is lost at each vertex.
    pub fn paint(&mut self, look: &Look, lost: &[f32]) {
        let places = self.positions.iter().zip(&self.normals).zip(lost);
        self.colors_linear = places.map(|((&p, &n), &gone)| look.albedo(p, n, gone)).collect();
    }

    /// Adds a vertex, answers its index. Normal and colour follow later.
    #[inline]
    pub fn vertex(&mut self, position: Vec3) -> u32 {
        self.positions.push(position);
        self.positions.len() as u32 - 1
    }

    /// Moves another solid's triangles into this mesh.
    pub fn append(&mut self, other: &Self) {
        let base = self.positions.len() as u32;
        self.positions.extend_from_slice(&other.positions);
        self.normals.extend_from_slice(&other.normals);
        self.colors_linear.extend_from_slice(&other.colors_linear);
        self.triangles.extend(other.triangles.iter().map(|t| t.map(|i| i + base)));
    }
}

/// One mesh of many solids, in their order.
pub fn join(solids: Vec<SolidMesh>) -> Mesh {
    let vertices = solids.iter().map(|s| s.positions.len()).sum();
    let triangles = solids.iter().map(|s| s.triangles.len()).sum();
    let mut all = SolidMesh {
        positions: Vec::with_capacity(vertices),
        normals: Vec::with_capacity(vertices),
        colors_linear: Vec::with_capacity(vertices),
        triangles: Vec::with_capacity(triangles),
    };
    for solid in solids {
        all.append(&solid);
    }
    Mesh {
        positions: all.positions,
        normals: all.normals,
        colors_linear: all.colors_linear,
        triangles: all.triangles,
        ..Mesh::default()
    }
}

/// A vertex in a row: where along the row, and which.
pub type RowVertex = (f32, u32);

/// Triangles between two rows that run side by side from one common end to the other: `(a.len() - 1) + (b.len() - 1)` of
/// them, whatever the counts. Counter-clockwise seen from where `b` lies to the left of `a`.
pub fn zip_rows(a: &[RowVertex], b: &[RowVertex], triangles: &mut Vec<[u32; 3]>) {
    let (mut i, mut j) = (0, 0);
    while i + 1 < a.len() || j + 1 < b.len() {
        // advance on the row whose next step ends first; ties alternate, which spreads the diagonals
        let next_a = a.get(i + 1).map(|v| v.0);
        let next_b = b.get(j + 1).map(|v| v.0);
        let advance_a = match (next_a, next_b) {
            (Some(x), Some(y)) if x == y => (i ^ a.len()) & 1 == 0,
            (Some(x), Some(y)) => x < y,
            (Some(_), None) => true,
            _ => false,
        };
        if advance_a {
            triangles.push([a[i].1, a[i + 1].1, b[j].1]);
            i += 1;
        } else {
            triangles.push([a[i].1, b[j + 1].1, b[j].1]);
            j += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_of_unlike_counts_are_joined_without_gap_or_overlap() {
        for (na, nb) in [(1, 1), (4, 4), (7, 3), (1, 9)] {
            let mut mesh = SolidMesh::default();
            let row = |mesh: &mut SolidMesh, n: u32, y: f32| -> Vec<RowVertex> {
                (0..=n).map(|i| i as f32 / n as f32).map(|x| (x, mesh.vertex(Vec3::new(x, y, 0.0)))).collect()
            };
            let a = row(&mut mesh, na, 0.0);
            let b = row(&mut mesh, nb, 1.0);
            zip_rows(&a, &b, &mut mesh.triangles);
            assert_eq!(mesh.triangles.len() as u32, na + nb);
            let mut area = 0.0;
            for t in &mesh.triangles {
                let [p, q, r] = t.map(|i| mesh.positions[i as usize]);
                let z = (q - p).cross(r - p).z * 0.5;
                assert!(z > 0.0, "turned over");
                area += z;
            }
            assert!((area - 1.0).abs() < 1e-6);
        }
    }
}
