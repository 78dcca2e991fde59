//! What is asked, and where the answer goes: the same for both methods.

use super::WORD;
use crate::GpuError;
use crate::buffers::{compute, empty, entries, fits, padded, shader, storage, uniform, workgroups};
use crate::hierarchy::Hierarchy;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use std::ops::Range;
use wgpu::{BindGroupDescriptor, Buffer, BufferUsages, CommandEncoder, ComputePassDescriptor, ComputePipeline, Device};

/// The shaders, whole.
pub(super) const RAYS: &str =
    concat!(include_str!("../hierarchy/extent.wgsl"), include_str!("../hierarchy/node.wgsl"), include_str!("rays.wgsl"));
pub(super) const GATHER: &str = include_str!("gather.wgsl");

/// `Rays` of rays.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct RaysUniform {
    asked: u32,
    points: u32,
    directions: u32,
    first: u32,
    nodes: u32,
    row: u32,
    padding: [u32; 2],
}

/// `Sums` of gather.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct SumsUniform {
    points: u32,
    count: u32,
    row: u32,
    padding: u32,
}

/// Points: a `vec4` each for position and unit normal, the normal zero where a point sees nothing.
pub(crate) struct Asked<'a> {
    pub points: u32,
    pub positions: &'a Buffer,
    pub normals: &'a Buffer,
}

/// Directions, and a bit for each of them and each point: bit `j % 32` of word `j / 32 * points + point`.
pub(crate) struct Query {
    pub count: u32,
    pub directions: Buffer,
    pub bits: Buffer,
}

impl Query {
    /// Bytes of the bits.
    pub fn bytes(points: u32, directions: usize) -> u64 {
        4 * directions.div_ceil(WORD as usize) as u64 * u64::from(points)
    }

    /// `spare` is the bits of a former query, used again where they fit.
    ///
    /// # Errors
    /// More than the device's buffers hold.
    pub fn new(device: &Device, points: u32, directions: &[Vec3], spare: Option<Buffer>) -> Result<Self, GpuError> {
        let bytes = Self::bytes(points, directions.len());
        fits(
            device,
            "the bits of the visibility matrix",
            bytes,
            "ask for fewer directions, or for a part of the vertices at a time",
        )?;
        let contents = padded(directions);
        fits(device, "the directions", 16 * contents.len() as u64, "ask for fewer at a time")?;
        let usage = BufferUsages::STORAGE | BufferUsages::COPY_SRC | BufferUsages::COPY_DST;
        let bits = match spare {
            Some(bits) if bits.size() == bytes.max(16) => bits,
            _ => empty(device, "visibility_bits", bytes, usage),
        };
        let directions = storage(device, "light_directions", bytemuck::cast_slice(&contents));
        Ok(Self { count: contents.len() as u32, directions, bits })
    }

    /// Words of a point.
    pub fn words(&self) -> u32 {
        self.count.div_ceil(WORD)
    }
}

/// Radiance as gather.wgsl takes it: weight times radiance over pi, and the weight.
pub(crate) fn quantities(weights: &[f32], radiance: &[Vec3]) -> Vec<[f32; 4]> {
    let share = |(&w, &l): (&f32, &Vec3)| (l * (w * std::f32::consts::FRAC_1_PI)).extend(w).to_array();
    weights.iter().zip(radiance).map(share).collect()
}

pub(crate) struct QueryPipelines {
    rays: ComputePipeline,
    gather: ComputePipeline,
}

impl QueryPipelines {
    pub fn new(device: &Device) -> Self {
        let of = |label, wgsl| compute(device, &shader(device, label, wgsl), "main");
        Self { rays: of("visibility_rays", RAYS), gather: of("visibility_gather", GATHER) }
    }

    /// Records rays of the `order.1` points that the buffer `order.0` names, for some words of the matrix.
    pub fn encode_rays(
        &self,
        device: &Device,
        encoder: &mut CommandEncoder,
        asked: &Asked<'_>,
        (order, ask): (&Buffer, u32),
        hierarchy: &Hierarchy,
        (query, words): (&Query, Range<u32>),
    ) {
        let [x, y] = workgroups(ask);
        let constants = RaysUniform {
            asked: ask,
            points: asked.points,
            directions: query.count,
            first: words.start,
            nodes: hierarchy.node_count,
            row: x,
            padding: [0; 2],
        };
        let constants = uniform(device, bytemuck::bytes_of(&constants));
        let Hierarchy { extent, nodes, corners, .. } = hierarchy;
        let bound = [&constants, extent, &query.directions, asked.positions, asked.normals, order, nodes, corners, &query.bits];
        encode(device, encoder, &self.rays, &bound, [x, y, words.len() as u32]);
    }

    /// Records the sums of a radiance over the matrix: `light` as gather.wgsl has it, and what would be seen if nothing occluded.
    pub fn encode_gather(
        &self,
        device: &Device,
        encoder: &mut CommandEncoder,
        asked: &Asked<'_>,
        query: &Query,
        quantities: &Buffer,
        [light, open]: [&Buffer; 2],
    ) {
        let [x, y] = workgroups(asked.points);
        let constants = SumsUniform { points: asked.points, count: query.count, row: x, padding: 0 };
        let constants = uniform(device, bytemuck::bytes_of(&constants));
        let bound = [&constants, &query.directions, asked.normals, &query.bits, quantities, light, open];
        encode(device, encoder, &self.gather, &bound, [x, y, 1]);
    }
}

/// Records one dispatch in a pass of its own.
pub(crate) fn encode(
    device: &Device,
    encoder: &mut CommandEncoder,
    pipeline: &ComputePipeline,
    bound: &[&Buffer],
    [x, y, z]: [u32; 3],
) {
    let layout = pipeline.get_bind_group_layout(0);
    let descriptor = BindGroupDescriptor { label: Some("visibility"), layout: &layout, entries: &entries(bound) };
    let group = device.create_bind_group(&descriptor);
    let mut pass = encoder.begin_compute_pass(&ComputePassDescriptor::default());
    pass.set_pipeline(pipeline);
    pass.set_bind_group(0, &group, &[]);
    pass.dispatch_workgroups(x, y, z);
}
