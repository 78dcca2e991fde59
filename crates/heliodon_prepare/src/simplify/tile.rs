//! One tile: from the mesh to meshoptimizer and back.

use super::evenness::Evenness;
use super::fineness::Allowed;
use super::{Held, SimplifyParams};
use glam::{Vec2, Vec3};
use heliodon_mesh::Mesh;
use meshopt::{SimplifyOptions, SimplifyVertex, VertexDataAdapter};

/// A triangle of the mesh's vertices, and what it is made of.
#[derive(Clone, Copy)]
pub(super) struct Face {
    pub corners: [u32; 3],
    pub material: u16,
}

/// What simplification of a tile needs to know of the whole.
pub(super) struct Context<'a> {
    pub mesh: &'a Mesh,
    pub params: &'a SimplifyParams,
    /// For each material the first that looks the same.
    pub looks: &'a [u16],
    /// For each vertex the first at the same position.
    pub point_of: &'a [u32],
    /// Places whose vertices stay.
    pub held: &'a Held,
}

/// The tile's own vertices: one for each vertex of the mesh and look. Where looks meet, meshoptimizer thus sees a seam and
/// holds it.
struct Locals {
    /// Vertex of the mesh and look of each.
    keys: Vec<(u32, u16)>,
    indices: Vec<u32>,
}

/// Faces that are to be simplified, ready for meshoptimizer: once, or again with other vertices held.
pub(super) struct Bench {
    locals: Locals,
    positions: Vec<Vec3>,
    at_border: Vec<bool>,
    evenness: Evenness,
    attributes: Vec<f32>,
    weights: Vec<f32>,
}

/// Faces simplified.
pub(super) struct Attempt<'a> {
    bench: &'a Bench,
    /// Corners among the tile's own vertices.
    triangles: Vec<[u32; 3]>,
    /// The greatest error that meshoptimizer admits to, metres.
    pub error_m: f32,
}

impl Bench {
    /// Simplifies the faces; vertices that are not `free` stay.
    pub fn simplify(&self, free: impl Fn(u32) -> bool) -> Attempt<'_> {
        let Self { locals: Locals { keys, indices }, positions, at_border, evenness, attributes, weights, .. } = self;
        let locks: Vec<SimplifyVertex> = keys
            .iter()
            .zip(at_border)
            .map(|(&(vertex, _), &at_border)| match (free(vertex), evenness.is_weighty(vertex, at_border)) {
                (false, _) => SimplifyVertex::Lock,
                (true, true) => SimplifyVertex::Priority,
                (true, false) => SimplifyVertex::None,
            })
            .collect();
        let of = |indices: &[u32]| indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect();
        let Ok(adapter) = VertexDataAdapter::new(meshopt::typed_to_bytes(positions), size_of::<Vec3>(), 0) else {
            return Attempt { bench: self, triangles: of(indices), error_m: 0.0 };
        };
        let options = SimplifyOptions::ErrorAbsolute | evenness.options;
        let mut error_m = 0.0;
        let left = if weights.is_empty() {
            meshopt::simplify_with_locks(indices, &adapter, &locks, 0, evenness.error_m, options, Some(&mut error_m))
        } else {
            meshopt::simplify_with_attributes_and_locks(
                indices,
                &adapter,
                attributes,
                weights,
                weights.len() * size_of::<f32>(),
                &locks,
                0,
                evenness.error_m,
                options,
                Some(&mut error_m),
            )
        };
        Attempt { bench: self, triangles: of(&left), error_m }
    }
}

impl Attempt<'_> {
    /// What is left of the faces.
    pub fn faces(&self) -> impl Iterator<Item = Face> {
        self.triangles.iter().map(|t| {
            let corners = t.map(|i| self.bench.locals.keys[i as usize]);
            Face { corners: corners.map(|(vertex, _)| vertex), material: corners[0].1 }
        })
    }

    /// Its surface, and nothing else of it; triangles are counted as faces are.
    pub fn surface(&self) -> Mesh {
        Mesh { positions: self.bench.positions.clone(), triangles: self.triangles.clone(), ..Mesh::default() }
    }
}

impl Context<'_> {
    /// Lays the faces out.
    pub fn bench(&self, faces: &[Face], allowed: Allowed) -> Bench {
        let locals = self.locals(faces);
        let Locals { keys, indices } = &locals;
        let positions = keys.iter().map(|key| self.mesh.positions[key.0 as usize]).collect();
        let at_border = self.at_border(faces, keys, indices);
        let (attributes, weights) = self.attributes(keys, indices, allowed);
        Bench { positions, at_border, evenness: Evenness::of(allowed), attributes, weights, locals }
    }

    fn locals(&self, faces: &[Face]) -> Locals {
        const EMPTY: u32 = u32::MAX;
        // a soup of triangles without neighbours has three vertices for each
        let bits = (faces.len() * 4).next_power_of_two().max(64).ilog2();
        let mut slots = vec![EMPTY; 1 << bits];
        let mask = slots.len() - 1;
        let mut keys: Vec<(u32, u16)> = Vec::with_capacity(faces.len() / 2 + 3);
        let mut indices = Vec::with_capacity(faces.len() * 3);
        for face in faces {
            let look = self.looks.get(usize::from(face.material)).copied().unwrap_or(0);
            for vertex in face.corners {
                let key = (vertex, look);
                // Fibonacci hashing; neighbours in the file land far apart
                let hash = (u64::from(vertex) | u64::from(look) << 32).wrapping_mul(0x9E37_79B9_7F4A_7C15);
                let mut slot = (hash >> (64 - bits)) as usize;
                let index = loop {
                    match slots[slot] {
                        EMPTY => {
                            slots[slot] = keys.len() as u32;
                            keys.push(key);
                            break slots[slot];
                        }
                        index if keys[index as usize] == key => break index,
                        _ => slot = (slot + 1) & mask,
                    }
                };
                indices.push(index);
            }
        }
        Locals { keys, indices }
    }

    /// Which of the tile's vertices lie at an open border: where, around a vertex, not every edge that comes in also goes out.
    /// Vertices at seams may be taken for such.
    fn at_border(&self, faces: &[Face], keys: &[(u32, u16)], indices: &[u32]) -> Vec<bool> {
        let mut balance = vec![0_u32; keys.len()];
        for (face, local) in faces.iter().zip(indices.chunks_exact(3)) {
            let points = face.corners.map(|v| self.point_of[v as usize]);
            for i in 0..3 {
                let sum = &mut balance[local[i] as usize];
                *sum = sum.wrapping_add(points[(i + 1) % 3]).wrapping_sub(points[(i + 2) % 3]);
            }
        }
        balance.into_iter().map(|sum| sum != 0).collect()
    }

    /// Attributes of the tile's vertices, interleaved, and what each weighs.
    fn attributes(&self, keys: &[(u32, u16)], indices: &[u32], allowed: Allowed) -> (Vec<f32>, Vec<f32>) {
        let mesh = self.mesh;
        let (normals, colors) = (!mesh.normals.is_empty(), !mesh.colors_linear.is_empty());
        let uvs = self.textured();
        let mut weights = Vec::with_capacity(8);
        if normals {
            weights.extend([self.params.normal_weight; 3]);
        }
        if colors {
            weights.extend([self.params.color_weight; 3]);
        }
        if uvs {
            weights.extend([uv_weight(mesh, keys, indices, allowed); 2]);
        }
        let mut attributes = Vec::with_capacity(weights.len() * keys.len());
        for &(vertex, _) in keys {
            let vertex = vertex as usize;
            if normals {
                attributes.extend(mesh.normals[vertex].to_array());
            }
            if colors {
                // as eyes see differences: those of square roots, near to those of sRGB
                attributes.extend(mesh.colors_linear[vertex].to_array().map(f32::sqrt));
            }
            if uvs {
                attributes.extend(mesh.uvs[vertex].to_array());
            }
        }
        (attributes, weights)
    }

    fn textured(&self) -> bool {
        !self.mesh.uvs.is_empty() && self.mesh.materials.iter().any(|material| material.texture.is_some())
    }
}

/// By which texture coordinates are multiplied so that a slip of the picture by as much as an edge counts as much as moving a
/// whole edge's width of surface by as much.
fn uv_weight(mesh: &Mesh, keys: &[(u32, u16)], indices: &[u32], allowed: Allowed) -> f32 {
    let (mut area, mut uv_area) = (0.0, 0.0);
    for t in indices.chunks_exact(3) {
        let [a, b, c] = [t[0], t[1], t[2]].map(|i| keys[i as usize].0 as usize);
        area += (mesh.positions[b] - mesh.positions[a]).cross(mesh.positions[c] - mesh.positions[a]).length();
        let (ab, ac): (Vec2, Vec2) = (mesh.uvs[b] - mesh.uvs[a], mesh.uvs[c] - mesh.uvs[a]);
        uv_area += ab.perp_dot(ac).abs();
    }
    let uv_per_m = (uv_area / area).sqrt();
    let weight = 1.0 / (uv_per_m * allowed.edge_m);
    if weight.is_finite() { weight } else { 0.0 }
}
