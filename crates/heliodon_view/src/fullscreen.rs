//! Passes over a whole picture: one triangle, one bind group.

use bevy::asset::uuid::Uuid;
use bevy::prelude::*;
use bevy::render::render_resource::*;
use bevy::render::renderer::{RenderContext, RenderDevice};
use bevy::render::view::ViewTarget;
use bevy::shader::Shader;
use std::collections::HashMap;

/// What a pass does: a shader with the entry points `vertex` and `fragment`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Fullscreen {
    /// The shader's name among the assets: a random number.
    pub uuid: u128,
    /// What it is called.
    pub name: &'static str,
    /// Its text.
    pub wgsl: &'static str,
    /// How it is laid over what is there; none: in place of it.
    pub blend: Option<BlendState>,
}

/// A pass's pipelines, one for each kind of target.
pub(crate) struct FullscreenPipelines {
    of: Fullscreen,
    /// What its group binds.
    pub layout: BindGroupLayoutDescriptor,
    sampler: Option<Sampler>,
    shader: Option<Handle<Shader>>,
    made: HashMap<(TextureFormat, u32), CachedRenderPipelineId>,
}

impl FullscreenPipelines {
    pub(crate) fn new(of: Fullscreen, layout: BindGroupLayoutDescriptor) -> Self {
        Self { of, layout, sampler: None, shader: None, made: HashMap::new() }
    }

    /// The pipeline for a target of this format and so many samples a pixel.
    pub(crate) fn pipeline(
        &mut self,
        cache: &mut PipelineCache,
        format: TextureFormat,
        samples: u32,
    ) -> CachedRenderPipelineId {
        let Fullscreen { uuid, name, wgsl, blend } = self.of;
        let shader = self.shader.get_or_insert_with(|| {
            let uuid = Uuid::from_u128(uuid);
            cache.set_shader(AssetId::Uuid { uuid }, Shader::from_wgsl(wgsl, format!("heliodon/{name}.wgsl")));
            Handle::Uuid(uuid, std::marker::PhantomData)
        });
        *self.made.entry((format, samples)).or_insert_with(|| {
            cache.queue_render_pipeline(RenderPipelineDescriptor {
                label: Some(name.into()),
                layout: vec![self.layout.clone()],
                vertex: VertexState { shader: shader.clone(), entry_point: Some("vertex".into()), ..default() },
                fragment: Some(FragmentState {
                    shader: shader.clone(),
                    entry_point: Some("fragment".into()),
                    targets: vec![Some(ColorTargetState { format, blend, write_mask: ColorWrites::ALL })],
                    ..default()
                }),
                multisample: MultisampleState { count: samples, ..default() },
                ..default()
            })
        })
    }

    /// A sampler that interpolates.
    pub(crate) fn sampler(&mut self, device: &RenderDevice) -> Sampler {
        let (mag_filter, min_filter) = (FilterMode::Linear, FilterMode::Linear);
        let descriptor = SamplerDescriptor { label: Some(self.of.name), mag_filter, min_filter, ..default() };
        self.sampler.get_or_insert_with(|| device.create_sampler(&descriptor)).clone()
    }
}

/// Draws a pass onto a camera's picture.
pub(crate) fn draw(
    context: &mut RenderContext,
    target: &ViewTarget,
    label: &str,
    pipeline: &RenderPipeline,
    group: &BindGroup,
) {
    let mut pass = context.command_encoder().begin_render_pass(&RenderPassDescriptor {
        label: Some(label),
        color_attachments: &[Some(target.get_color_attachment())],
        depth_stencil_attachment: None,
        timestamp_writes: None,
        occlusion_query_set: None,
        multiview_mask: None,
    });
    pass.set_pipeline(pipeline);
    pass.set_bind_group(0, &**group, &[]);
    pass.draw(0..3, 0..1);
}
