//! All parts as one surface, and what rays meet.

use super::TextureError;
use crate::model::Part;
use glam::Vec3;
use heliodon_math::frame::unit_or;
use heliodon_mesh::Mesh;
use heliodon_mesh::topology::places;
use heliodon_rays::{BuildParams, TriangleScene};
use std::collections::HashMap;

/// One triangle of a part.
#[derive(Clone, Copy, Debug)]
pub(super) struct Triangle {
    pub corners: [Vec3; 3],
    /// Where it faces; zero without an area.
    pub normal: Vec3,
    /// At its corners, as light is to see the surface.
    pub normals: [Vec3; 3],
}

/// A face of a part: a chart of the atlas.
#[derive(Clone, Debug)]
pub(super) struct Face {
    pub part: usize,
    /// The face's number in its part.
    pub number: u32,
    /// Its triangles, in all parts' order.
    pub triangles: Vec<u32>,
}

pub(super) struct Surface {
    pub triangles: Vec<Triangle>,
    pub faces: Vec<Face>,
    /// The face of each triangle.
    pub face_of: Vec<u32>,
    /// Where each part's triangles begin.
    pub starts: Vec<u32>,
    /// Of what stands in the way, whose triangles come after the parts'.
    pub others: Vec<[Vec3; 3]>,
    pub scene: TriangleScene,
}

impl Surface {
    pub fn new(parts: &[Part], occluders: &[&Mesh]) -> Result<Self, TextureError> {
        let (mut triangles, mut faces, mut starts) = (Vec::new(), Vec::new(), Vec::new());
        let (mut positions, mut indices): (Vec<Vec3>, Vec<[u32; 3]>) = (Vec::new(), Vec::new());
        let mut gather = |mesh: &Mesh| {
            let first = positions.len() as u32;
            positions.extend(&mesh.positions);
            indices.extend(mesh.triangles.iter().map(|t| t.map(|v| v + first)));
        };
        for (index, part) in parts.iter().enumerate() {
            let broken = |why: String| TextureError::Part { part: part.name.clone(), why };
            part.mesh.validate().map_err(|error| broken(error.to_string()))?;
            let count = part.mesh.triangles.len();
            if part.face.len() != count || part.flat.len() != count {
                return Err(broken("has not one face and one flat place for each triangle".into()));
            }
            if part.face.iter().any(|&face| face as usize >= part.smooth.len()) {
                return Err(broken("has a triangle of a face that there is not".into()));
            }
            let first = triangles.len() as u32;
            starts.push(first);
            let of_corners = corner_normals(part);
            let normals = (0..count).map(|t| {
                let corners = part.mesh.corners(t);
                Triangle { corners, normal: unit_or(area(corners), Vec3::ZERO), normals: of_corners[t] }
            });
            triangles.extend(normals);
            let mut of_face: Vec<Vec<u32>> = vec![Vec::new(); part.smooth.len()];
            part.face.iter().enumerate().for_each(|(t, &face)| of_face[face as usize].push(first + t as u32));
            let used = of_face.into_iter().enumerate().filter(|(_, triangles)| !triangles.is_empty());
            faces.extend(used.map(|(number, triangles)| Face { part: index, number: number as u32, triangles }));
            gather(&part.mesh);
        }
        if triangles.is_empty() {
            return Err(TextureError::NoModel);
        }
        for mesh in occluders {
            mesh.validate()
                .map_err(|error| TextureError::Part { part: "what stands in the way".into(), why: error.to_string() })?;
            gather(mesh);
        }
        let others = indices[triangles.len()..].iter().map(|t| t.map(|v| positions[v as usize])).collect();
        let mut face_of = vec![0; triangles.len()];
        for (index, face) in faces.iter().enumerate() {
            face.triangles.iter().for_each(|&t| face_of[t as usize] = index as u32);
        }
        let scene = TriangleScene::build(&positions, &indices, &BuildParams::default())?;
        Ok(Self { triangles, faces, face_of, starts, others, scene })
    }

    /// The corners of a triangle that a ray met.
    pub fn corners(&self, triangle: u32) -> Option<[Vec3; 3]> {
        let index = triangle as usize;
        let own = self.triangles.get(index).map(|triangle| triangle.corners);
        own.or_else(|| self.others.get(index.checked_sub(self.triangles.len())?).copied())
    }

    /// Whether light falls otherwise on one triangle than on another: they are of two faces, and these meet at an angle.
    pub fn is_crease(&self, one: u32, other: u32) -> bool {
        let [a, b] = [one, other].map(|t| self.face_of.get(t as usize).copied());
        let normal = |t: u32| self.corners(t).map(|corners| unit_or(area(corners), Vec3::ZERO));
        a != b && normal(one).zip(normal(other)).is_none_or(|(one, other)| one.dot(other) < SAME_LIGHT)
    }
}

/// The cosine of the angle from which on two faces are lit differently: fifteen degrees change the sun's light by a quarter.
const SAME_LIGHT: f32 = 0.966;

/// Twice the triangle's area, along its normal.
fn area([a, b, c]: [Vec3; 3]) -> Vec3 {
    (b - a).cross(c - a)
}

/// Each triangle's normals at its corners: its own, or where its face is smooth the mean of the face's triangles there by their angles.
fn corner_normals(part: &Part) -> Vec<[Vec3; 3]> {
    let at = places(&part.mesh.positions, 0.0);
    let angle = |t: usize, k: usize| {
        let corners = part.mesh.corners(t);
        let [to_next, to_last] = [1, 2].map(|step| unit_or(corners[(k + step) % 3] - corners[k], Vec3::ZERO));
        libm::acosf(to_next.dot(to_last).clamp(-1.0, 1.0))
    };
    let normal = |t: usize| unit_or(area(part.mesh.corners(t)), Vec3::ZERO);
    let mut sums: HashMap<(u32, u32), Vec3> = HashMap::new();
    for (t, triangle) in part.mesh.triangles.iter().enumerate().filter(|(t, _)| part.smooth[part.face[*t] as usize]) {
        for (k, &v) in triangle.iter().enumerate() {
            *sums.entry((part.face[t], at[v as usize])).or_default() += normal(t) * angle(t, k);
        }
    }
    let of_corner = |t: usize, v: u32| {
        let sum = sums.get(&(part.face[t], at[v as usize])).copied().unwrap_or(Vec3::ZERO);
        unit_or(sum, unit_or(normal(t), Vec3::Y))
    };
    part.mesh.triangles.iter().enumerate().map(|(t, corners)| corners.map(|v| of_corner(t, v))).collect()
}
