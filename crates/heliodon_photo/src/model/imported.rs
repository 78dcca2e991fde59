//! Parts of meshes that were modelled elsewhere.

use super::part::Part;
use glam::{Vec2, Vec3};
use heliodon_math::frame::{orthonormal_basis, unit_or};
use heliodon_mesh::topology::{Edges, HalfEdge, places};
use heliodon_mesh::{Mesh, MeshError};

/// The cosine of the angle, 25 degrees, that a face's triangles may be off its first one: laid flat they shrink by a tenth at most.
const SAME_FACE: f32 = 0.906;
/// And that at which two triangles are lit as one.
const FLAT: f32 = 0.999_8;

impl Part {
    /// A part of a mesh that no table made: neighbours that face about the same way become one face, laid flat by looking straight at it. Light runs on smoothly
    /// over faces that are not flat. Of what the mesh has beside positions and triangles nothing is kept.
    ///
    /// # Errors
    /// Where the mesh's arrays contradict one another.
    pub fn from_mesh(name: &str, mesh: &Mesh) -> Result<Self, MeshError> {
        mesh.validate()?;
        let at = places(&mesh.positions, 0.0);
        let is_surface = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| at[v as usize]);
            a != b && b != c && c != a
        };
        let triangles: Vec<[u32; 3]> = mesh.triangles.iter().copied().filter(is_surface).collect();
        let corners = |t: usize| triangles[t].map(|v| mesh.positions[v as usize]);
        let area = |t: usize| {
            let [a, b, c] = corners(t);
            (b - a).cross(c - a)
        };
        let normals: Vec<Vec3> = (0..triangles.len()).map(|t| unit_or(area(t), Vec3::ZERO)).collect();
        let mut neighbors: Vec<Vec<u32>> = vec![Vec::new(); triangles.len()];
        let mut open_edges = 0;
        Edges::new(&triangles, &at, |_| true).for_each(|_, sides| {
            let sides: Vec<HalfEdge> = sides.collect();
            open_edges += sides.len() % 2;
            if let [one, other] = sides.as_slice() {
                neighbors[one.triangle as usize].push(other.triangle);
                neighbors[other.triangle as usize].push(one.triangle);
            }
        });
        // the largest triangles first: a wall is named by its wall, not by its mouldings
        let mut order: Vec<usize> = (0..triangles.len()).collect();
        order.sort_by(|&a, &b| area(b).length_squared().total_cmp(&area(a).length_squared()).then(a.cmp(&b)));
        const NOBODY: u32 = u32::MAX;
        let mut face = vec![NOBODY; triangles.len()];
        let (mut smooth, mut flat) = (Vec::new(), vec![[Vec2::ZERO; 3]; triangles.len()]);
        for seed in order {
            if face[seed] != NOBODY {
                continue;
            }
            let number = smooth.len() as u32;
            face[seed] = number;
            let mut own = vec![seed];
            let mut next = 0;
            while next < own.len() {
                for &neighbor in &neighbors[own[next]] {
                    let t = neighbor as usize;
                    if face[t] == NOBODY && normals[t].dot(normals[seed]) >= SAME_FACE {
                        face[t] = number;
                        own.push(t);
                    }
                }
                next += 1;
            }
            let [a, b, c] = corners(seed);
            let sides = [b - a, c - b, a - c];
            let longest =
                sides.into_iter().fold(Vec3::ZERO, |most, side| if side.length() > most.length() { side } else { most });
            let right = unit_or(longest, orthonormal_basis(unit_or(normals[seed], Vec3::Y)).0);
            let up = normals[seed].cross(right);
            for &t in &own {
                flat[t] = corners(t).map(|p| Vec2::new(right.dot(p - a), up.dot(p - a)));
            }
            smooth.push(own.iter().any(|&t| normals[t].dot(normals[seed]) < FLAT));
        }
        let mesh = Mesh { positions: mesh.positions.clone(), triangles, ..Mesh::default() };
        Ok(Self { name: name.into(), mesh, face, flat, smooth, watertight: open_edges == 0, open_edges })
    }
}
