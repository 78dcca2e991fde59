//! The pipelines of the visibility matrix.

use super::atlas::DEPTH_FORMAT;
use wgpu::{
    CompareFunction, ComputePipeline, ComputePipelineDescriptor, DepthBiasState, DepthStencilState, Device, MultisampleState,
    PrimitiveState, RenderPipeline, RenderPipelineDescriptor, ShaderModuleDescriptor, ShaderSource, StencilState,
    VertexBufferLayout, VertexState, VertexStepMode, vertex_attr_array,
};

/// The shaders, whole.
pub(super) const SHADERS: [(&str, &str); 3] = [
    ("visibility_depth", concat!(include_str!("light_space.wgsl"), include_str!("depth.wgsl"))),
    ("visibility_test", concat!(include_str!("light_space.wgsl"), include_str!("test.wgsl"))),
    ("visibility_gather", include_str!("gather.wgsl")),
];

pub(super) struct Pipelines {
    pub depth: RenderPipeline,
    pub test: ComputePipeline,
    pub gather: ComputePipeline,
}

impl Pipelines {
    pub fn new(device: &Device) -> Self {
        let [depth, test, gather] = SHADERS.map(|(label, source)| {
            device
                .create_shader_module(ShaderModuleDescriptor { label: Some(label), source: ShaderSource::Wgsl(source.into()) })
        });
        let compute = |module, label| {
            device.create_compute_pipeline(&ComputePipelineDescriptor {
                label: Some(label),
                layout: None,
                module,
                entry_point: None,
                compilation_options: Default::default(),
                cache: None,
            })
        };
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
            test: compute(&test, "visibility_test"),
            gather: compute(&gather, "visibility_gather"),
        }
    }
}
