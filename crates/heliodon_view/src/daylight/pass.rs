//! The GPU's work of a frame: light where it is stale, then stone and sky in one pass, before Bevy's opaque pass.
//!
//! The pass writes Bevy's main texture and Bevy's depth, so whatever else the camera sees (guests, the head-up display) is
//! drawn by Bevy over it, occluded as it should be. A frame that asks what is seen (sight.rs) takes a pass more.

use super::pipelines::Subject;
use super::prepare::{StageGpu, StageView};
use super::seen::Draw;
use bevy::camera::{MainPassResolutionOverride, Viewport};
use bevy::prelude::*;
use bevy::render::camera::ExtractedCamera;
use bevy::render::render_resource::{
    Buffer, CommandEncoder, ComputePassDescriptor, IndexFormat, LoadOp, Operations, PipelineCache, RenderPassColorAttachment,
    RenderPassDescriptor, RenderPipeline, StoreOp,
};
use bevy::render::renderer::{RenderContext, ViewQuery};
use bevy::render::view::{ViewDepthTexture, ViewTarget};
use wgpu::RenderPass;

/// The most triangles of a pass where a processor draws. Such a driver (llvmpipe) keeps some 300 bytes of each triangle until the
/// pass is done, in scenes that it keeps for the next frame. docs/decisions/008-drawing-stone.md has the figures.
const PASS_TRIANGLES: u64 = 200_000;

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
    let begin = |encoder: &mut CommandEncoder, label, color| {
        let mut pass = encoder
            .begin_render_pass(&RenderPassDescriptor {
                label: Some(label),
                color_attachments: &[Some(color)],
                depth_stencil_attachment: Some(depth.get_attachment(StoreOp::Store)),
                timestamp_writes: None,
                occlusion_query_set: None,
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

    // A day that passes before an eye at rest is what must be quick: that is one pass.
    let split = gpu.software && stage_view.indices.is_none();
    let parts = || stage_view.seen.parts(if split { PASS_TRIANGLES } else { u64::MAX });

    if let Some(question) = stage_view.sight.question() {
        let numbering = stage_view.sight_pipelines.map(|ids| ids.map(|id| cache.get_render_pipeline(id)));
        let mut first = 0;
        for (part, draws) in parts().enumerate() {
            let load = if part == 0 { LoadOp::Clear(wgpu::Color::TRANSPARENT) } else { LoadOp::Load };
            let color = RenderPassColorAttachment {
                view: &question.view,
                depth_slice: None,
                resolve_target: None,
                ops: Operations { load, store: StoreOp::Store },
            };
            let mut pass = begin(encoder, "stone_sight", color);
            let mut bound = Bound::default();
            for draw in draws {
                let closed = usize::from(gpu.chunks[draw.chunk as usize].closed);
                if let Some(pipeline) = numbering.and_then(|pipelines| pipelines[closed]) {
                    bound.pipeline(&mut pass, closed, pipeline);
                    bound.draw(&mut pass, &gpu, None, draw, first);
                }
                first += draw.indices.len() as u32 / 3;
            }
        }
        question.read(encoder);
    }
    let mut last = None;
    for draws in parts() {
        drop(last.take());
        let pass = last.insert(begin(encoder, "stone_and_sky", target.get_color_attachment()));
        let mut bound = Bound::default();
        for draw in draws {
            let chunk = &gpu.chunks[draw.chunk as usize];
            let subject = Subject::stone_index(chunk.texture.is_some(), chunk.closed);
            // Until its pipeline and texture are there, nothing is drawn of a chunk.
            if let Some(pipeline) = stone[subject]
                && bound.texture(pass, &gpu, chunk.texture)
            {
                bound.pipeline(pass, subject, pipeline);
                bound.draw(pass, &gpu, stage_view.indices.as_ref(), draw, 0);
            }
        }
    }
    if let (Some(mut pass), Some(pipeline), Some(maps)) = (last, sky, &stage_view.sky) {
        pass.set_pipeline(pipeline);
        pass.set_bind_group(1, &**maps, &[]);
        pass.draw(0..3, 0..1);
    }
}

/// What a pass has bound already.
#[derive(Default)]
struct Bound {
    pipeline: Option<usize>,
    page: Option<usize>,
    texture: Option<u32>,
}

impl Bound {
    /// Sets the pipeline, of this number in its pass.
    fn pipeline(&mut self, pass: &mut RenderPass<'_>, number: usize, pipeline: &RenderPipeline) {
        if self.pipeline != Some(number) {
            pass.set_pipeline(pipeline);
            self.pipeline = Some(number);
        }
    }

    /// Sets the texture, if there is to be one; false if it is not there.
    fn texture(&mut self, pass: &mut RenderPass<'_>, gpu: &StageGpu, texture: Option<u32>) -> bool {
        if texture.is_some() && self.texture != texture {
            let Some(group) = texture.and_then(|texture| gpu.textures.get(texture as usize)) else { return false };
            pass.set_bind_group(1, &*group.bind_group, &[]);
            self.texture = texture;
        }
        true
    }

    /// Records a draw of stone, with indices of `own` where there are any.
    fn draw(&mut self, pass: &mut RenderPass<'_>, gpu: &StageGpu, own: Option<&Buffer>, draw: &Draw, instance: u32) {
        let chunk = &gpu.chunks[draw.chunk as usize];
        if self.page != Some(chunk.page) {
            let page = &gpu.pages[chunk.page];
            pass.set_vertex_buffer(0, *page.positions.slice(..));
            pass.set_vertex_buffer(1, *page.light.slice(..));
            pass.set_vertex_buffer(2, *page.albedo.slice(..));
            if let Some(uvs) = &page.uvs {
                pass.set_vertex_buffer(3, *uvs.slice(..));
            }
            pass.set_index_buffer(*own.unwrap_or(&page.indices).slice(..), IndexFormat::Uint16);
            self.page = Some(chunk.page);
        }
        let first = if own.is_some() { 0 } else { chunk.first_index };
        let indices = first + draw.indices.start..first + draw.indices.end;
        pass.draw_indexed(indices, chunk.base_vertex as i32, instance..instance + 1);
    }
}
