//! The GPU's work of a frame: light where it is stale, then stone and sky in one pass, before Bevy's opaque pass.
//!
//! The pass writes Bevy's main texture and Bevy's depth, so whatever else the camera sees (guests, the head-up display) is
//! drawn by Bevy over it, occluded as it should be. A frame that asks what is seen (sight.rs) takes a pass more.

use super::pipelines::Subject;
use super::prepare::{StageGpu, StageView};
use super::view::Draw;
use bevy::camera::{MainPassResolutionOverride, Viewport};
use bevy::prelude::*;
use bevy::render::camera::ExtractedCamera;
use bevy::render::render_resource::{
    CommandEncoder, ComputePassDescriptor, IndexFormat, PipelineCache, RenderPassDescriptor, RenderPipeline, StoreOp,
};
use bevy::render::renderer::{RenderContext, ViewQuery};
use bevy::render::view::{ViewDepthTexture, ViewTarget};
use wgpu::{QuerySet, RenderPass};

/// Lights the visible vertices, if the moment is a new one for them.
pub fn light_stage(gpu: Res<StageGpu>, cache: Res<PipelineCache>, mut context: RenderContext) {
    let (Some(id), Some(moment)) = (gpu.light_pipeline, gpu.moment_bind_group()) else { return };
    let Some(pipeline) = cache.get_compute_pipeline(id) else { return };
    if gpu.lit_pages().next().is_none() {
        return;
    }
    let mut pass = context
        .command_encoder()
        .begin_compute_pass(&ComputePassDescriptor { label: Some("stone_light"), timestamp_writes: None });
    pass.set_pipeline(pipeline);
    pass.set_bind_group(0, &**moment, &[]);
    for (page, blocks) in gpu.lit_pages() {
        pass.set_bind_group(1, &*page.light_bind_group, &[]);
        pass.dispatch_workgroups(blocks, 1, 1);
    }
}

/// Draws stone and sky for the current camera.
pub fn draw_stage(
    view: ViewQuery<(&ExtractedCamera, &ViewTarget, &ViewDepthTexture, &StageView, Option<&MainPassResolutionOverride>)>,
    gpu: Res<StageGpu>,
    cache: Res<PipelineCache>,
    mut context: RenderContext,
) {
    let (camera, target, depth, stage_view, resolution) = view.into_inner();
    let (Some(ids), Some(view_group)) = (stage_view.pipelines, stage_view.bind_group()) else { return };
    let [stone @ .., sky] = ids.map(|id| cache.get_render_pipeline(id));
    let viewport = Viewport::from_viewport_and_override(camera.viewport.as_ref(), resolution);
    let encoder = context.command_encoder();
    let begin = |encoder: &mut CommandEncoder, queries: Option<&QuerySet>| {
        let mut pass = encoder
            .begin_render_pass(&RenderPassDescriptor {
                label: Some("stone_and_sky"),
                color_attachments: &[Some(target.get_color_attachment())],
                depth_stencil_attachment: Some(depth.get_attachment(StoreOp::Store)),
                timestamp_writes: None,
                occlusion_query_set: queries,
                multiview_mask: None,
            })
            .forget_lifetime();
        if let Some(viewport) = &viewport {
            let (at, size) = (viewport.physical_position, viewport.physical_size);
            let [x, y, width, height] = [at.x, at.y, size.x, size.y].map(|v| v as f32);
            pass.set_viewport(x, y, width, height, viewport.depth.start, viewport.depth.end);
        }
        pass.set_bind_group(0, &**view_group, &[]);
        pass
    };

    if let Some(question) = stage_view.sight.question() {
        for (queries, range) in question.passes() {
            let mut pass = begin(encoder, Some(queries));
            let mut bound = Bound::default();
            for (query, draw) in stage_view.draws[range].iter().enumerate() {
                pass.begin_occlusion_query(query as u32);
                bound.draw(&mut pass, &gpu, &stone, draw);
                pass.end_occlusion_query();
            }
        }
        question.resolve(encoder);
    }
    let mut pass = begin(encoder, None);
    if stage_view.sight.question().is_none() {
        let mut bound = Bound::default();
        for draw in &stage_view.draws {
            bound.draw(&mut pass, &gpu, &stone, draw);
        }
    }
    if let (Some(pipeline), Some(maps)) = (sky, &stage_view.sky) {
        pass.set_pipeline(pipeline);
        pass.set_bind_group(1, &**maps, &[]);
        pass.draw(0..3, 0..1);
    }
}

/// What a pass has bound already.
#[derive(Default)]
struct Bound {
    subject: Option<usize>,
    page: Option<usize>,
    texture: Option<u32>,
}

impl Bound {
    /// Records a draw of stone; nothing, while its pipeline or texture is not there.
    fn draw(&mut self, pass: &mut RenderPass<'_>, gpu: &StageGpu, pipelines: &[Option<&RenderPipeline>], draw: &Draw) {
        let subject = Subject::stone_index(draw.texture.is_some(), draw.closed);
        let Some(pipeline) = pipelines[subject] else { return };
        if let Some(texture) = draw.texture
            && self.texture != Some(texture)
        {
            let Some(texture_group) = gpu.textures.get(texture as usize) else { return };
            pass.set_bind_group(1, &*texture_group.bind_group, &[]);
            self.texture = Some(texture);
        }
        if self.subject != Some(subject) {
            pass.set_pipeline(pipeline);
            self.subject = Some(subject);
        }
        if self.page != Some(draw.page) {
            let page = &gpu.pages[draw.page];
            pass.set_vertex_buffer(0, *page.positions.slice(..));
            pass.set_vertex_buffer(1, *page.light.slice(..));
            pass.set_vertex_buffer(2, *page.albedo.slice(..));
            if let Some(uvs) = &page.uvs {
                pass.set_vertex_buffer(3, *uvs.slice(..));
            }
            pass.set_index_buffer(*page.indices.slice(..), IndexFormat::Uint16);
            self.page = Some(draw.page);
        }
        pass.draw_indexed(draw.indices.clone(), draw.base_vertex as i32, 0..1);
    }
}
