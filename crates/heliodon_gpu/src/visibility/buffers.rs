//! The mesh, and other buffers of the GPU.

use crate::GpuError;
use glam::Vec3;
use heliodon_math::frame::unit_or;
use wgpu::util::{BufferInitDescriptor, DeviceExt};
use wgpu::{BindGroupEntry, Buffer, BufferUsages, Device, Queue};

/// Vertices that ask and triangles that occlude.
pub(super) struct Points {
    pub count: u32,
    pub positions: Buffer,
    pub normals: Buffer,
    pub indices: Buffer,
    pub index_count: u32,
    /// The bounding sphere.
    pub center: Vec3,
    pub radius: f32,
    /// The median length of the triangles' edges.
    pub edge: f32,
    /// What the GPU has as well: zero where a vertex sees nothing.
    pub unit_normals: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
}

/// As storage buffers have vectors.
pub(super) fn padded(vectors: &[Vec3]) -> Vec<[f32; 4]> {
    vectors.iter().map(|v| v.extend(0.0).to_array()).collect()
}

/// A buffer that shaders read.
pub(super) fn storage(device: &Device, label: &str, contents: &[u8]) -> Buffer {
    // An empty binding is none.
    let contents = if contents.is_empty() { &[0; 16] } else { contents };
    device.create_buffer_init(&BufferInitDescriptor {
        label: Some(label),
        contents,
        usage: BufferUsages::STORAGE | BufferUsages::COPY_DST,
    })
}

/// A buffer of constants.
pub(super) fn uniform(device: &Device, contents: &[u8]) -> Buffer {
    device.create_buffer_init(&BufferInitDescriptor { label: Some("uniform"), contents, usage: BufferUsages::UNIFORM })
}

/// Bindings from 0 on.
pub(super) fn entries<'a>(buffers: &[&'a Buffer]) -> Vec<BindGroupEntry<'a>> {
    let entry = |(binding, buffer): (u32, &&'a Buffer)| BindGroupEntry { binding, resource: buffer.as_entire_binding() };
    (0..).zip(buffers).map(entry).collect()
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
        let limits = device.limits();
        let most_bytes = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        let needed_bytes = (16 * u64::from(count)).max(12 * triangles.len() as u64);
        if needed_bytes > most_bytes {
            let remedy = "split the mesh, or compute on the processor";
            return Err(GpuError::TooLarge { what: "the vertices", needed_bytes, most_bytes, remedy });
        }
        let kept: Vec<[u32; 3]> =
            triangles.iter().copied().filter(|t| t.iter().all(|&i| positions[i as usize].is_finite())).collect();
        let shape = Shape::of(positions, normals);
        let init = |label, contents: &[u8], usage| {
            let contents = if contents.is_empty() { &[0; 16] } else { contents };
            device.create_buffer_init(&BufferInitDescriptor { label: Some(label), contents, usage })
        };
        let position_usage = BufferUsages::STORAGE | BufferUsages::VERTEX | BufferUsages::COPY_DST;
        Ok(Self {
            count,
            positions: init("visibility_positions", bytemuck::cast_slice(&padded(&shape.positions)), position_usage),
            normals: storage(device, "visibility_normals", bytemuck::cast_slice(&shape.normals_and_spread(&kept))),
            indices: init("visibility_indices", bytemuck::cast_slice(kept.as_flattened()), BufferUsages::INDEX),
            index_count: 3 * kept.len() as u32,
            center: shape.center,
            radius: shape.radius,
            edge: median_edge(&shape.positions, &kept),
            unit_normals: shape.normals,
            triangles: kept,
        })
    }

    pub fn write(&mut self, queue: &Queue, positions: &[Vec3], normals: &[Vec3]) -> Result<(), GpuError> {
        if positions.len() != self.count as usize || normals.len() != self.count as usize {
            return Err(GpuError::Input("a mesh that moves keeps its number of vertices"));
        }
        let shape = Shape::of(positions, normals);
        queue.write_buffer(&self.positions, 0, bytemuck::cast_slice(&padded(&shape.positions)));
        queue.write_buffer(&self.normals, 0, bytemuck::cast_slice(&shape.normals_and_spread(&self.triangles)));
        (self.center, self.radius, self.unit_normals) = (shape.center, shape.radius, shape.normals);
        self.edge = median_edge(&shape.positions, &self.triangles);
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
        let seeing = |(&p, &n): (&Vec3, &Vec3)| if p.is_finite() { unit_or(n, Vec3::ZERO) } else { Vec3::ZERO };
        Self {
            normals: positions.iter().zip(normals).map(seeing).collect(),
            positions: positions.iter().map(|&p| if p.is_finite() { p } else { center }).collect(),
            center,
            // A point has a sphere as well; so has what reaches almost to infinity.
            radius: if radius.is_finite() { radius.max(f32::MIN_POSITIVE * 1e8) } else { f32::MAX * 1e-8 },
        }
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

fn median_edge(positions: &[Vec3], triangles: &[[u32; 3]]) -> f32 {
    let stride = triangles.len().div_ceil(EDGE_SAMPLE).max(1);
    let edge = |t: &[u32; 3]| positions[t[0] as usize].distance(positions[t[1] as usize]);
    let mut edges: Vec<f32> = triangles.iter().step_by(stride).map(edge).collect();
    if edges.is_empty() {
        return 0.0;
    }
    let middle = edges.len() / 2;
    *edges.select_nth_unstable_by(middle, f32::total_cmp).1
}
