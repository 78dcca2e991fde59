//! Sizes of a mesh, and putting meshes together.

use crate::{Material, Mesh, MeshError, normals};
use glam::{Vec2, Vec3};

/// The linear albedo of a surface of which nothing is said.
pub const UNSAID_ALBEDO: f32 = 0.5;

/// Edges that a median is taken of, at most; evenly spread over the triangles.
const MOST_EDGES: usize = 3 << 18;

/// Some of the values; none where there are none.
fn pick<T: Copy>(all: &[T], which: &[u32]) -> Vec<T> {
    if all.is_empty() { Vec::new() } else { which.iter().map(|&i| all[i as usize]).collect() }
}

impl Mesh {
    /// The area of all triangles in square metres.
    #[must_use]
    pub fn surface_area(&self) -> f64 {
        (0..self.triangles.len())
            .map(|t| {
                let [a, b, c] = self.corners(t).map(Vec3::as_dvec3);
                (b - a).cross(c - a).length() * 0.5
            })
            .sum()
    }

    /// The median length of the triangles' edges in metres, of at most 786,432 of them; 0 without triangles.
    #[must_use]
    pub fn median_edge_length(&self) -> f32 {
        let step = (self.triangles.len() * 3).div_ceil(MOST_EDGES).max(1);
        let mut lengths: Vec<f32> = (0..self.triangles.len())
            .step_by(step)
            .flat_map(|t| {
                let [a, b, c] = self.corners(t);
                [a.distance(b), b.distance(c), c.distance(a)]
            })
            .collect();
        if lengths.is_empty() {
            return 0.0;
        }
        let middle = lengths.len() / 2;
        *lengths.select_nth_unstable_by(middle, f32::total_cmp).1
    }

    /// Some of the triangles as a mesh of their own, as [`Mesh::with_corners`].
    ///
    /// # Panics
    /// Where there is no such triangle, or it names no such vertex.
    #[must_use]
    pub fn with_triangles(&self, triangles: &[u32]) -> (Self, Vec<u32>) {
        let corners = triangles.iter().map(|&t| self.triangles[t as usize]);
        self.with_corners(corners, pick(&self.triangle_material, triangles))
    }

    /// Other triangles over the vertices as a mesh of their own, with the vertices that they use in the order in which they use them, and all
    /// materials; and which vertex of this mesh each of its vertices is. `triangle_material` is empty or has one for each.
    ///
    /// # Panics
    /// Where a triangle names no such vertex.
    #[must_use]
    pub fn with_corners(&self, corners: impl Iterator<Item = [u32; 3]>, triangle_material: Vec<u16>) -> (Self, Vec<u32>) {
        const UNUSED: u32 = u32::MAX;
        let mut place = vec![UNUSED; self.positions.len()];
        let mut vertices = Vec::new();
        let corners = corners.map(|corners| {
            corners.map(|vertex| {
                let place = &mut place[vertex as usize];
                if *place == UNUSED {
                    *place = vertices.len() as u32;
                    vertices.push(vertex);
                }
                *place
            })
        });
        let triangles = corners.collect();
        (self.with_vertices(&vertices, triangles, triangle_material), vertices)
    }

    /// Some of the vertices, each as often as it is named and in that order, under triangles over these, and all materials.
    ///
    /// # Panics
    /// Where there is no such vertex.
    #[must_use]
    pub fn with_vertices(&self, vertices: &[u32], triangles: Vec<[u32; 3]>, triangle_material: Vec<u16>) -> Self {
        Self {
            positions: pick(&self.positions, vertices),
            normals: pick(&self.normals, vertices),
            uvs: pick(&self.uvs, vertices),
            colors_linear: pick(&self.colors_linear, vertices),
            triangles,
            triangle_material,
            materials: self.materials.clone(),
        }
    }

    /// Adds another mesh of the same space. What only one of them has is filled in for the other: computed normals, texture
    /// coordinates of zero, colours that leave the look as it was.
    ///
    /// # Errors
    /// When both together have more vertices than a `u32` or more materials than a `u16` counts; nothing is added then.
    pub fn append(&mut self, other: &Self) -> Result<(), MeshError> {
        let (vertices, triangles) = (self.positions.len(), self.triangles.len());
        let first = u32::try_from(vertices + other.positions.len())
            .map(|_| vertices as u32)
            .map_err(|_| MeshError::TooMany("vertices"))?;
        self.append_materials(other, triangles)?;
        if !(self.normals.is_empty() && other.normals.is_empty()) || triangles == 0 {
            append_normals(self, other);
        }
        fill(&mut self.uvs, &other.uvs, vertices, other.positions.len(), [Vec2::ZERO; 2]);
        // where there are materials now, what is said of nothing is said by them already
        let plain = if self.materials.is_empty() { Vec3::splat(UNSAID_ALBEDO) } else { Vec3::ONE };
        fill(&mut self.colors_linear, &other.colors_linear, vertices, other.positions.len(), [plain; 2]);
        self.positions.extend_from_slice(&other.positions);
        self.triangles.extend(other.triangles.iter().map(|t| t.map(|i| i + first)));
        Ok(())
    }

    fn append_materials(&mut self, other: &Self, triangles: usize) -> Result<(), MeshError> {
        if self.materials.is_empty() && other.materials.is_empty() {
            self.triangle_material.clear();
            return Ok(());
        }
        let own_first = self.materials.len();
        // A mesh without materials takes a neutral one: its colours say all there is.
        let needs_neutral = |mesh: &Self| usize::from(mesh.materials.is_empty());
        let total = own_first + other.materials.len() + needs_neutral(self) + needs_neutral(other);
        if total > usize::from(u16::MAX) {
            return Err(MeshError::TooMany("materials"));
        }
        let neutral = |mesh: &Self| Material {
            name: String::new(),
            base_color_linear: Vec3::splat(if mesh.colors_linear.is_empty() { UNSAID_ALBEDO } else { 1.0 }),
            texture: None,
        };
        if self.materials.is_empty() {
            self.materials.push(neutral(self));
        }
        self.triangle_material.resize(triangles, 0);
        let first = self.materials.len() as u16;
        if other.materials.is_empty() {
            self.materials.push(neutral(other));
        }
        self.materials.extend_from_slice(&other.materials);
        let material = |t: usize| first + other.triangle_material.get(t).copied().unwrap_or(0);
        self.triangle_material.extend((0..other.triangles.len()).map(material));
        Ok(())
    }
}

fn append_normals(mesh: &mut Mesh, other: &Mesh) {
    if mesh.normals.is_empty() && !mesh.positions.is_empty() {
        normals::compute(mesh);
    }
    if other.normals.is_empty() && !other.positions.is_empty() {
        let mut bare = Mesh { positions: other.positions.clone(), triangles: other.triangles.clone(), ..Mesh::default() };
        normals::compute(&mut bare);
        mesh.normals.append(&mut bare.normals);
    } else {
        mesh.normals.extend_from_slice(&other.normals);
    }
}

/// Appends `more`; where only one of the two has entries, the other takes its filler.
fn fill<T: Copy>(own: &mut Vec<T>, more: &[T], own_count: usize, more_count: usize, filler: [T; 2]) {
    if own.is_empty() && more.is_empty() {
        return;
    }
    own.resize(own_count, filler[0]);
    own.extend_from_slice(more);
    own.resize(own_count + more_count, filler[1]);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle() -> Mesh {
        Mesh { positions: vec![Vec3::ZERO, Vec3::X * 3.0, Vec3::Y * 4.0], triangles: vec![[0, 1, 2]], ..Mesh::default() }
    }

    #[test]
    fn sizes_of_a_triangle() {
        assert_eq!(triangle().surface_area(), 6.0);
        assert_eq!(triangle().median_edge_length(), 4.0);
        assert_eq!(Mesh::default().median_edge_length(), 0.0);
    }

    #[test]
    fn what_one_mesh_lacks_is_filled_in() {
        let mut site = triangle();
        let mut colored = triangle();
        colored.colors_linear = vec![Vec3::X; 3];
        colored.normals = vec![Vec3::Z; 3];
        let mut textured = triangle();
        textured.uvs = vec![Vec2::ONE; 3];
        site.append(&colored).unwrap();
        site.append(&textured).unwrap();
        site.validate().unwrap();
        assert_eq!(site.triangles, [[0, 1, 2], [3, 4, 5], [6, 7, 8]]);
        assert_eq!(site.normals, [Vec3::Z; 9]);
        assert_eq!([site.uvs[0], site.uvs[3], site.uvs[6]], [Vec2::ZERO, Vec2::ZERO, Vec2::ONE]);
    }

    #[test]
    fn meshes_keep_their_look_in_whatever_order_they_come() {
        let look = |colors: Option<f32>, base: Option<f32>| {
            let material = |c| Material { name: String::new(), base_color_linear: Vec3::splat(c), texture: None };
            Mesh {
                colors_linear: colors.map_or_else(Vec::new, |c| vec![Vec3::splat(c); 3]),
                materials: base.map(material).into_iter().collect(),
                ..triangle()
            }
        };
        // bare, coloured, of a material, of both
        let meshes = [look(None, None), look(Some(0.75), None), look(None, Some(0.25)), look(Some(0.75), Some(0.5))];
        let expected = [0.5, 0.75, 0.25, 0.375];
        for number in 0..4 * 4 * 4 * 4 {
            let order = [number % 4, number / 4 % 4, number / 16 % 4, number / 64];
            for length in 2..=4 {
                let mut site = meshes[order[0]].clone();
                order[1..length].iter().for_each(|&mesh| site.append(&meshes[mesh]).unwrap());
                site.validate().unwrap();
                let albedo = crate::albedo::MeshAlbedo::new(&site, 0.0);
                for (triangle, &mesh) in order[..length].iter().enumerate() {
                    let found = albedo.mean(triangle as u32);
                    assert!((found - expected[mesh]).abs().max_element() < 1e-6, "{:?}: {found}", &order[..length]);
                }
            }
        }
    }
}
