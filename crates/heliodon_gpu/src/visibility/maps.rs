//! The question by depth maps.

use super::WORD;
use super::atlas::{Atlas, DEPTH_FORMAT};
use super::query::{Asked, Query};
use crate::buffers::{compute, entries, shader, uniform, workgroups};
use bytemuck::{Pod, Zeroable};
use wgpu::{
    BindGroup, BindGroupDescriptor, BindGroupLayout, Buffer, CommandEncoder, CompareFunction, ComputePassDescriptor,
    ComputePipeline, DepthBiasState, DepthStencilState, Device, IndexFormat, LoadOp, MultisampleState, Operations,
    PrimitiveState, RenderPassDepthStencilAttachment, RenderPassDescriptor, RenderPipeline, RenderPipelineDescriptor,
    StencilState, StoreOp, VertexBufferLayout, VertexState, VertexStepMode, vertex_attr_array,
};

/// The shaders, whole.
pub(super) const DEPTH: &str =
    concat!(include_str!("../hierarchy/extent.wgsl"), include_str!("light_space.wgsl"), include_str!("depth.wgsl"));
pub(super) const TEST: &str =
    concat!(include_str!("../hierarchy/extent.wgsl"), include_str!("light_space.wgsl"), include_str!("test.wgsl"));

/// What the shaders know of a batch; `Maps` of light_space.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct MapsUniform {
    tile_px: f32,
    atlas_px: f32,
    across: u32,
    first: u32,
    count: u32,
    points: u32,
    bias: f32,
    row: u32,
}

pub(crate) struct MapsPipelines {
    depth: RenderPipeline,
    test: ComputePipeline,
}

/// What a depth map is drawn of.
pub(crate) struct Drawn<'a> {
    pub atlas: &'a Atlas,
    pub indices: &'a Buffer,
    pub index_count: u32,
    /// `Extent` with the bounding sphere.
    pub extent: &'a Buffer,
    pub bias: f32,
}

impl MapsPipelines {
    pub fn new(device: &Device) -> Self {
        let [depth, test] =
            [("visibility_depth", DEPTH), ("visibility_test", TEST)].map(|(label, wgsl)| shader(device, label, wgsl));
        Self {
            depth: device.create_render_pipeline(&RenderPipelineDescriptor {
                label: Some("visibility_depth"),
                layout: None,
                vertex: VertexState {
                    module: &depth,
                    entry_point: None,
                    compilation_options: Default::default(),
                    buffers: &[VertexBufferLayout {
                        array_stride: 16,
                        step_mode: VertexStepMode::Vertex,
                        attributes: &vertex_attr_array![0 => Float32x4],
                    }],
                },
                // Open meshes occlude from both sides.
                primitive: PrimitiveState::default(),
                depth_stencil: Some(DepthStencilState {
                    format: DEPTH_FORMAT,
                    depth_write_enabled: Some(true),
                    depth_compare: Some(CompareFunction::Less),
                    stencil: StencilState::default(),
                    bias: DepthBiasState::default(),
                }),
                multisample: MultisampleState::default(),
                fragment: None,
                multiview_mask: None,
                cache: None,
            }),
            test: compute(device, &test, "main"),
        }
    }

    /// Records one batch of directions, from `first` on: their depths, and what these say of the points.
    pub fn encode(
        &self,
        device: &Device,
        encoder: &mut CommandEncoder,
        asked: &Asked<'_>,
        drawn: &Drawn<'_>,
        query: &Query,
        first: u32,
    ) {
        let Drawn { atlas, .. } = drawn;
        let [x, y] = workgroups(asked.points);
        let constants = MapsUniform {
            tile_px: atlas.tile_px as f32,
            atlas_px: atlas.size_px as f32,
            across: atlas.across,
            first,
            count: atlas.batch.min(query.count - first),
            points: asked.points,
            bias: drawn.bias,
            row: x,
        };
        let uniform = uniform(device, bytemuck::bytes_of(&constants));
        let group = |layout: BindGroupLayout, entries: &[wgpu::BindGroupEntry<'_>]| -> BindGroup {
            device.create_bind_group(&BindGroupDescriptor { label: Some("visibility"), layout: &layout, entries })
        };
        let shared = [&uniform, drawn.extent, &query.directions];
        let depth_ops = Operations { load: LoadOp::Clear(1.0), store: StoreOp::Store };
        let mut pass = encoder.begin_render_pass(&RenderPassDescriptor {
            label: Some("visibility_depth"),
            depth_stencil_attachment: Some(RenderPassDepthStencilAttachment {
                view: &atlas.view,
                depth_ops: Some(depth_ops),
                stencil_ops: None,
            }),
            ..RenderPassDescriptor::default()
        });
        pass.set_pipeline(&self.depth);
        pass.set_bind_group(0, &group(self.depth.get_bind_group_layout(0), &entries(&shared)), &[]);
        pass.set_vertex_buffer(0, asked.positions.slice(..));
        pass.set_index_buffer(drawn.indices.slice(..), IndexFormat::Uint32);
        pass.draw_indexed(0..drawn.index_count, 0, 0..constants.count);
        drop(pass);

        let mut bound = entries(&shared);
        bound.push(wgpu::BindGroupEntry { binding: 3, resource: asked.positions.as_entire_binding() });
        bound.push(wgpu::BindGroupEntry { binding: 4, resource: asked.normals.as_entire_binding() });
        bound.push(wgpu::BindGroupEntry { binding: 5, resource: wgpu::BindingResource::TextureView(&atlas.view) });
        bound.push(wgpu::BindGroupEntry { binding: 6, resource: query.bits.as_entire_binding() });
        let descriptor = ComputePassDescriptor { label: Some("visibility_test"), timestamp_writes: None };
        let mut pass = encoder.begin_compute_pass(&descriptor);
        pass.set_pipeline(&self.test);
        pass.set_bind_group(0, &group(self.test.get_bind_group_layout(0), &bound), &[]);
        pass.dispatch_workgroups(x, y, constants.count.div_ceil(WORD));
    }
}
