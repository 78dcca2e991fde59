//! What of a moving mesh is taken to the GPU once.

use super::Corner;
use crate::GpuError;
use crate::buffers::{filled, fits, storage};
use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use heliodon_mesh::Mesh;
use heliodon_mesh::motion::{MovingMesh, PoseRules};
use wgpu::{Buffer, BufferUsages, Device};

/// `Rule` of rule.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct Rule {
    position: [f32; 3],
    part: u32,
    normal: [f32; 3],
    influences: u32,
    rest: [f32; 3],
    deltas: u32,
    rest_normal: [f32; 3],
    renews: u32,
}

/// `Delta` of pose.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct Delta {
    position: [f32; 3],
    weight: u32,
    normal: [f32; 3],
    padding: u32,
}

/// STAYS of pose.wgsl.
const STAYS: u32 = u32::MAX;
/// Above a corner's vertex: that it is seen from the back.
const BACK: u32 = 1 << 31;

/// Rules and corners in buffers.
pub(super) struct Upload {
    pub corners: u32,
    pub vertices: usize,
    pub parts: usize,
    pub weights: usize,
    pub matrices: usize,
    pub cached: bool,
    /// Whether any part's normals are computed from the pose.
    pub renews: bool,
    pub sources: Buffer,
    pub rules: Buffer,
    pub influences: Buffer,
    pub deltas: Buffer,
    /// Triangles' corners around each vertex, as normals.wgsl has them.
    pub around: Buffer,
    /// Corners of the triangles, three each; also to be drawn by.
    pub triangles: Buffer,
    pub triangle_count: u32,
    /// At rest.
    pub places: Vec<Vec3>,
    pub normals: Vec<Vec3>,
    pub triangle_list: Vec<[u32; 3]>,
    /// At rest.
    pub radius: f32,
    /// The median length of the triangles' edges.
    pub edge: f32,
}

impl Upload {
    pub fn new(device: &Device, moving: &MovingMesh, corners: &[Corner]) -> Result<Self, GpuError> {
        let (rules, rest) = (moving.rules(), moving.rest());
        rules.validate().map_err(GpuError::Input)?;
        if corners.len() >= BACK as usize || rest.positions.len() >= BACK as usize {
            return Err(GpuError::Input("there are more vertices than a corner can name"));
        }
        if corners.iter().any(|corner| corner.vertex as usize >= rest.positions.len()) {
            return Err(GpuError::Input("a corner names a vertex that is not there"));
        }
        let mut front = vec![u32::MAX; rest.positions.len()];
        for (i, corner) in (0..).zip(corners).filter(|(_, corner)| !corner.back) {
            front[corner.vertex as usize] = front[corner.vertex as usize].min(i);
        }
        let triangle_list: Vec<[u32; 3]> = rest.triangles.iter().map(|t| t.map(|v| front[v as usize])).collect();
        if triangle_list.as_flattened().contains(&u32::MAX) {
            return Err(GpuError::Input("a vertex of a triangle has no corner that is seen from the front"));
        }
        let remedy = "split the mesh, or light it by the processor";
        let around = around(&rules, rest);
        fits(device, "the triangles around the vertices", 4 * around.len() as u64, remedy)?;
        let records: Vec<Rule> = records(&rules, rest);
        fits(device, "the vertices' rules", size_of_val(&records[..]) as u64, remedy)?;
        fits(device, "the vertices' influences", 8 * rules.influences.len() as u64, remedy)?;
        fits(device, "the morph targets", (size_of::<Delta>() * rules.deltas.len()) as u64, remedy)?;
        fits(device, "the corners", 16 * corners.len() as u64, remedy)?;
        let influences: Vec<[u32; 2]> = rules.influences.iter().map(|&(matrix, share)| [matrix, share.to_bits()]).collect();
        let delta = |delta: &heliodon_mesh::motion::rules::Delta| Delta {
            position: delta.position.to_array(),
            weight: delta.weight,
            normal: delta.normal.to_array(),
            padding: 0,
        };
        let deltas: Vec<Delta> = rules.deltas.iter().map(delta).collect();
        let sources: Vec<u32> = corners.iter().map(|c| c.vertex | if c.back { BACK } else { 0 }).collect();
        let places: Vec<Vec3> = corners.iter().map(|c| rest.positions[c.vertex as usize]).collect();
        let side = |c: &Corner| if c.back { -1.0 } else { 1.0 };
        let (low, high) = rest.bounds().unwrap_or_default();
        let indices = bytemuck::cast_slice(triangle_list.as_flattened());
        Ok(Self {
            corners: corners.len() as u32,
            vertices: rest.positions.len(),
            parts: rules.renews.len(),
            weights: rules.weights,
            matrices: rules.matrices,
            cached: rules.cached,
            renews: rules.renews.contains(&true),
            sources: storage(device, "moving_sources", bytemuck::cast_slice(&sources)),
            rules: storage(device, "moving_rules", bytemuck::cast_slice(&records)),
            influences: storage(device, "moving_influences", bytemuck::cast_slice(&influences)),
            deltas: storage(device, "moving_deltas", bytemuck::cast_slice(&deltas)),
            around: storage(device, "moving_around", bytemuck::cast_slice(&around)),
            triangles: filled(device, "moving_triangles", indices, BufferUsages::STORAGE | BufferUsages::INDEX),
            triangle_count: triangle_list.len() as u32,
            normals: corners.iter().map(|c| rest.normals[c.vertex as usize] * side(c)).collect(),
            edge: crate::visibility::median_edge(&places, &triangle_list),
            places,
            triangle_list,
            radius: 0.5 * low.distance(high),
        })
    }
}

/// Rules, and one more where the last one's lists end.
fn records(rules: &PoseRules, rest: &Mesh) -> Vec<Rule> {
    let record = |(v, rule): (usize, &heliodon_mesh::motion::rules::VertexRule)| Rule {
        position: rule.position.to_array(),
        part: rule.part.unwrap_or(STAYS),
        normal: rule.normal.to_array(),
        influences: rule.influences.start,
        rest: rest.positions[v].to_array(),
        deltas: rule.deltas.start,
        rest_normal: rest.normals[v].to_array(),
        renews: u32::from(rule.part.is_some_and(|part| rules.renews[part as usize])),
    };
    let mut records: Vec<Rule> = rules.vertices.iter().enumerate().map(record).collect();
    let (influences, deltas) = (rules.influences.len() as u32, rules.deltas.len() as u32);
    records.push(Rule { part: STAYS, influences, deltas, ..Rule::zeroed() });
    records
}

/// For each vertex the corners of triangles around it and around those that share its normal, behind a list of where each vertex's begin.
fn around(rules: &PoseRules, rest: &Mesh) -> Vec<u32> {
    let mut own: Vec<Vec<u32>> = vec![Vec::new(); rest.positions.len()];
    for (t, triangle) in (0..).zip(&rest.triangles) {
        for (k, &v) in (0..).zip(triangle) {
            own[v as usize].push(4 * t + k);
        }
    }
    for group in &rules.shared {
        let all: Vec<u32> = group.iter().flat_map(|&v| std::mem::take(&mut own[v as usize])).collect();
        group.iter().for_each(|&v| own[v as usize].clone_from(&all));
    }
    let mut list = Vec::with_capacity(own.len() + 1 + 3 * rest.triangles.len());
    let mut next = own.len() as u32 + 1;
    for corners in &own {
        list.push(next);
        next += corners.len() as u32;
    }
    list.push(next);
    list.extend(own.into_iter().flatten());
    list
}
