//! The mesh.

use super::query::Asked;
use crate::GpuError;
use crate::buffers::{filled, fits, storage};
use crate::hierarchy::{Extent, usable};
use glam::Vec3;
use heliodon_math::frame::unit_or;
use wgpu::{Buffer, BufferUsages, Device, Queue};

/// Vertices that ask and triangles that occlude.
pub(super) struct Points {
    pub count: u32,
    /// Fourth: 1, or 0 for a vertex that is nowhere; such a one stands in the middle.
    pub positions: Buffer,
    pub normals: Buffer,
    pub indices: Buffer,
    pub index_count: u32,
    /// [`Extent`] with the bounding sphere of the vertices.
    pub extent: Buffer,
    /// Its radius.
    pub radius: f32,
    /// The median length of the triangles' edges.
    pub edge: f32,
    /// What the GPU has as well: zero where a vertex sees nothing.
    pub unit_normals: Vec<Vec3>,
    /// Where the vertices are.
    pub places: Vec<Vec3>,
    /// All triangles as they were given.
    pub all_triangles: Vec<[u32; 3]>,
    /// Those that a depth map can draw.
    triangles: Vec<[u32; 3]>,
}

/// Edges of so many triangles at most decide the median.
const EDGE_SAMPLE: usize = 20_000;

impl Points {
    pub fn new(device: &Device, positions: &[Vec3], normals: &[Vec3], triangles: &[[u32; 3]]) -> Result<Self, GpuError> {
        if positions.len() != normals.len() {
            return Err(GpuError::Input("there must be one normal for each vertex"));
        }
        let count =
            u32::try_from(positions.len()).map_err(|_| GpuError::Input("there are more vertices than an index can count"))?;
        if triangles.as_flattened().iter().any(|&i| i >= count) {
            return Err(GpuError::Input("a triangle names a vertex that is not there"));
        }
        let needed_bytes = (16 * u64::from(count)).max(12 * triangles.len() as u64);
        fits(device, "the vertices", needed_bytes, "split the mesh, or compute on the processor")?;
        let kept: Vec<[u32; 3]> =
            triangles.iter().copied().filter(|t| t.iter().all(|&i| positions[i as usize].is_finite())).collect();
        let shape = Shape::of(positions, normals);
        let position_usage = BufferUsages::STORAGE | BufferUsages::VERTEX | BufferUsages::COPY_DST;
        let constants = BufferUsages::UNIFORM | BufferUsages::COPY_DST;
        let indices = bytemuck::cast_slice(kept.as_flattened());
        Ok(Self {
            count,
            positions: filled(device, "visibility_positions", bytemuck::cast_slice(&shape.flagged(positions)), position_usage),
            normals: storage(device, "visibility_normals", bytemuck::cast_slice(&shape.normals_and_spread(&kept))),
            indices: filled(device, "visibility_indices", indices, BufferUsages::INDEX),
            index_count: 3 * kept.len() as u32,
            extent: filled(device, "visibility_extent", bytemuck::bytes_of(&shape.extent()), constants),
            radius: shape.radius,
            edge: median_edge(&shape.positions, &kept),
            unit_normals: shape.normals,
            places: positions.to_vec(),
            all_triangles: triangles.to_vec(),
            triangles: kept,
        })
    }

    pub fn asked(&self) -> Asked<'_> {
        Asked { points: self.count, positions: &self.positions, normals: &self.normals }
    }

    pub fn write(&mut self, queue: &Queue, positions: &[Vec3], normals: &[Vec3]) -> Result<(), GpuError> {
        if positions.len() != self.count as usize || normals.len() != self.count as usize {
            return Err(GpuError::Input("a mesh that moves keeps its number of vertices"));
        }
        let shape = Shape::of(positions, normals);
        queue.write_buffer(&self.positions, 0, bytemuck::cast_slice(&shape.flagged(positions)));
        queue.write_buffer(&self.normals, 0, bytemuck::cast_slice(&shape.normals_and_spread(&self.triangles)));
        queue.write_buffer(&self.extent, 0, bytemuck::bytes_of(&shape.extent()));
        self.edge = median_edge(&shape.positions, &self.triangles);
        (self.radius, self.unit_normals) = (shape.radius, shape.normals);
        self.places.copy_from_slice(positions);
        Ok(())
    }
}

/// Vertices as the GPU can take them.
struct Shape {
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    center: Vec3,
    radius: f32,
}

impl Shape {
    fn of(positions: &[Vec3], normals: &[Vec3]) -> Self {
        let finite = || positions.iter().copied().filter(|p| p.is_finite());
        let (low, high) = finite().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
        let center = if low.x <= high.x { 0.5 * low + 0.5 * high } else { Vec3::ZERO };
        let radius = finite().map(|p| p.distance(center)).fold(0.0, f32::max);
        let seeing = |(&p, &n): (&Vec3, &Vec3)| if usable(p) { unit_or(n, Vec3::ZERO) } else { Vec3::ZERO };
        Self {
            normals: positions.iter().zip(normals).map(seeing).collect(),
            positions: positions.iter().map(|&p| if p.is_finite() { p } else { center }).collect(),
            center,
            // A point has a sphere as well; so has what reaches almost to infinity.
            radius: if radius.is_finite() { radius.max(f32::MIN_POSITIVE * 1e8) } else { f32::MAX * 1e-8 },
        }
    }
}

impl Shape {
    /// Positions, and whether each vertex is anywhere.
    fn flagged(&self, given: &[Vec3]) -> Vec<[f32; 4]> {
        self.positions.iter().zip(given).map(|(p, &given)| p.extend(f32::from(usable(given))).to_array()).collect()
    }

    fn extent(&self) -> Extent {
        Extent { center: self.center.to_array(), radius: self.radius, ..Extent::default() }
    }
}

/// Triangles that stand at more than this from a vertex's normal are edges of the mesh, not its roughness.
const MOST_SPREAD: f32 = 1.7;

impl Shape {
    /// Each normal, and the tangent of the largest angle between it and the triangles around its vertex.
    fn normals_and_spread(&self, triangles: &[[u32; 3]]) -> Vec<[f32; 4]> {
        let mut least = vec![1.0f32; self.normals.len()];
        for triangle in triangles {
            let [a, b, c] = triangle.map(|i| self.positions[i as usize]);
            let face = unit_or((b - a).cross(c - a), Vec3::ZERO);
            for &i in triangle.iter().filter(|_| face != Vec3::ZERO) {
                let cosine = &mut least[i as usize];
                *cosine = cosine.min(face.dot(self.normals[i as usize]).abs());
            }
        }
        let tangent = |cosine: f32| ((1.0 - cosine * cosine).max(0.0).sqrt() / cosine.max(1e-3)).min(MOST_SPREAD);
        self.normals.iter().zip(least).map(|(n, cosine)| n.extend(tangent(cosine)).to_array()).collect()
    }
}

/// The median length of the triangles' edges, 0 without any.
pub(crate) fn median_edge(positions: &[Vec3], triangles: &[[u32; 3]]) -> f32 {
    let stride = triangles.len().div_ceil(EDGE_SAMPLE).max(1);
    let edge = |t: &[u32; 3]| positions[t[0] as usize].distance(positions[t[1] as usize]);
    let mut edges: Vec<f32> = triangles.iter().step_by(stride).map(edge).collect();
    if edges.is_empty() {
        return 0.0;
    }
    let middle = edges.len() / 2;
    *edges.select_nth_unstable_by(middle, f32::total_cmp).1
}
