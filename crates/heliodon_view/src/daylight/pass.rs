//! The GPU's work of a frame: light where it is stale, then stone and sky in one pass, before Bevy's opaque pass.
//!
//! The pass writes Bevy's main texture and Bevy's depth, so whatever else the camera sees (guests, the head-up display) is
//! drawn by Bevy over it, occluded as it should be. A frame that asks what is seen (sight.rs) takes a pass more, and one of a moving
//! eye is submitted in two parts (occlusion.rs).

use super::encoded::Encoded;
use super::lit::LitVertices;
use super::multiview::{BOTH, BothEyes};
use super::occlusion::{DepthReadback, may_show};
use super::pages::GpuChunk;
use super::pipelines::{Near, PipelineKey, STONES, SUBJECTS, StagePipelines, StoneKind, Subject};
use super::prepare::{Drawn, StageGpu, StageView};
use super::scan::ScanPixels;
use super::seen::{Draw, Seen, split};
use crate::actors::render::{ActorPipelines, ActorsGpu};
use crate::covering::gpu::{CoversGpu, Worn};
use crate::covering::uniform::OWN_BITS;
use crate::lamps::maps::LampsGpu;
use bevy::camera::{MainPassResolutionOverride, Viewport};
use bevy::prelude::*;
use bevy::render::camera::ExtractedCamera;
use bevy::render::render_resource::{
    BindGroup, Buffer, CommandEncoder, CommandEncoderDescriptor, ComputePassDescriptor, IndexFormat, LoadOp, Operations,
    PipelineCache, RenderPassColorAttachment, RenderPassDepthStencilAttachment, RenderPassDescriptor, RenderPipeline, StoreOp,
};
use bevy::render::renderer::{PendingCommandBuffers, RenderContext, RenderDevice, RenderQueue, ViewQuery};
use bevy::render::view::{ExtractedView, ViewDepthTexture, ViewTarget};
use std::cell::Cell;
use std::num::NonZeroU32;
use wgpu::{RenderPass, TextureView};

/// The most triangles of a pass where a processor draws. Such a driver (llvmpipe) keeps some 300 bytes of each triangle until the
/// pass is done, in scenes that it keeps for the next frame. docs/decisions/008-drawing-stone.md has the figures.
pub const PASS_TRIANGLES: u64 = 200_000;

/// Lights the visible vertices, if the moment is a new one for them.
pub fn light_stage(gpu: Res<StageGpu>, cache: Res<PipelineCache>, views: Query<&StageView>, mut context: RenderContext) {
    encode_texels(&gpu, &cache, &mut context);
    let of_scan = views.iter().filter_map(|view| view.scan.shown.as_ref()).flat_map(ScanPixels::stale);
    encode_light(&gpu, &cache, of_scan, &mut context);
}

/// Lights the groups that are listed, and these vertices besides, with how many workgroups do it.
fn encode_light<'a>(
    gpu: &'a StageGpu,
    cache: &PipelineCache,
    besides: impl Iterator<Item = (&'a LitVertices, u32)>,
    context: &mut RenderContext,
) {
    let (Some(id), Some(moment)) = (gpu.light_pipeline, gpu.moment_bind_group()) else { return };
    let Some(pipeline) = cache.get_compute_pipeline(id) else { return };
    let of_pages = gpu.lit_pages().map(|(page, workgroups)| (&page.lit, workgroups));
    let mut all = of_pages.chain(besides).peekable();
    if all.peek().is_none() {
        return;
    }
    let mut pass = context
        .command_encoder()
        .begin_compute_pass(&ComputePassDescriptor { label: Some("stone_light"), timestamp_writes: None });
    pass.set_pipeline(pipeline);
    pass.set_bind_group(0, &**moment, &[]);
    for (lit, workgroups) in all {
        pass.set_bind_group(1, &*lit.bind_group, &[]);
        pass.dispatch_workgroups(workgroups, 1, 1);
    }
}

/// Lights the texels of sky and bounce, if the moment is a new one for them.
fn encode_texels(gpu: &StageGpu, cache: &PipelineCache, context: &mut RenderContext) {
    let all = [&gpu.texels, &gpu.panorama];
    let is_stale = all.iter().any(|texels| texels.is_stale());
    if let Some([Some(sky), Some(bounce)]) =
        gpu.texel_pipelines.filter(|_| is_stale).map(|ids| ids.map(|id| cache.get_compute_pipeline(id)))
    {
        let descriptor = ComputePassDescriptor { label: Some("texel_relight"), timestamp_writes: None };
        let mut pass = context.command_encoder().begin_compute_pass(&descriptor);
        all.iter().filter(|texels| texels.is_stale()).for_each(|texels| texels.encode(&mut pass, [sky, bounce]));
    }
}

/// What drawing needs of a camera.
type DrawnView = (
    &'static ExtractedCamera,
    &'static ExtractedView,
    &'static ViewTarget,
    &'static ViewDepthTexture,
    Option<&'static MainPassResolutionOverride>,
);

/// Draws stone, actors and sky for the current camera.
#[expect(clippy::too_many_arguments, reason = "a system's arguments are its resources")]
pub fn draw_stage(
    view: ViewQuery<DrawnView, With<StageView>>,
    mut stage_views: Query<&mut StageView>,
    mut gpu: ResMut<StageGpu>,
    mut pending: ResMut<PendingCommandBuffers>,
    (actors, lamps, covers): (Res<ActorsGpu>, Res<LampsGpu>, Res<CoversGpu>),
    (cache, pipelines): (Res<PipelineCache>, Res<StagePipelines>),
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
    mut context: RenderContext,
) {
    let entity = view.entity();
    let (camera, extracted, target, depth, resolution) = view.into_inner();
    let find = |stage_view: &StageView| Pipelines::find(stage_view, (&*pipelines, &*cache), (&*actors, &*lamps), &covers);
    if let Some((eyes, layer)) = gpu.multiview.of(entity) {
        let Ok(first) = stage_views.get(eyes.first()) else { return };
        let Some(pipelines) = find(first) else { return };
        let color = target.get_color_attachment();
        let encoder = context.command_encoder();
        if !eyes.drawn {
            // A camera whose colour something else began keeps it below the sky.
            let clear = match color.ops.load {
                LoadOp::Clear(color) => color,
                _ => wgpu::Color::BLACK,
            };
            let onto = Onto::Both(eyes, clear);
            let canvas = Canvas { onto, begun: Cell::new(false), viewport: None, view_group: eyes.view_group(), pipelines };
            let most = if gpu.software { PASS_TRIANGLES } else { u64::MAX };
            let mut pass = canvas.stone(encoder, &gpu, &first.drawn, most);
            canvas.actors_and_sky(&mut pass, &actors, first.sky.as_ref());
        }
        eyes.hand_out(encoder, layer, cache.get_render_pipeline(eyes.layer_pipeline), color, depth);
        gpu.multiview.was_drawn(entity);
        return;
    }
    let Ok(mut stage_view) = stage_views.get_mut(entity) else { return };
    let stage_view = &mut *stage_view;
    let (Some(pipelines), Some(view_group)) = (find(stage_view), stage_view.bind_group().cloned()) else { return };
    let viewport = Viewport::from_viewport_and_override(camera.viewport.as_ref(), resolution);
    let size = UVec2::new(depth.texture.width(), depth.texture.height());
    let encoded = stage_view.codes.map(|format| match stage_view.encoded.take() {
        Some(encoded) if encoded.is(size, format) => encoded,
        _ => Encoded::new(&device, size, format),
    });
    let onto = Onto::Eye { target, encoded: encoded.as_ref(), depth };
    let canvas = Canvas { onto, begun: Cell::new(false), viewport, view_group: &view_group, pipelines };

    let moving = stage_view.undecided.is_some() || stage_view.drawn.seen.single.is_none();
    // A day that passes before an eye at rest is what must be quick: that is one pass.
    let most = if gpu.software && moving { PASS_TRIANGLES } else { u64::MAX };

    // What a moving eye saw a frame ago is drawn at once, and then what that does not hide.
    let mut later = None;
    if let Some(clusters) = stage_view.undecided.take() {
        let mut encoder = device.create_command_encoder(&CommandEncoderDescriptor { label: Some("stone_seen_before") });
        drop(canvas.stone(&mut encoder, &gpu, &stage_view.drawn, most));
        let readback = match stage_view.depth.take() {
            Some(readback) if readback.size() == size => readback,
            _ => DepthReadback::new(&device, size),
        };
        readback.copy(&mut encoder, &depth.texture);
        queue.submit(pending.take().into_iter().chain([encoder.finish()]));
        let before = &stage_view.drawn.seen;
        let known = before.single.is_some().then(|| before.sets(gpu.chunks.len()));
        let found = readback.read(&device, extracted.viewport, |picture| {
            may_show(&gpu.chunks, &clusters, known.as_deref(), picture, &stage_view.clip_from_world)
        });
        let (shown, new) = found
            .unwrap_or_else(|| [(); 2].map(|()| Seen::clusters(&gpu.chunks, &clusters, &stage_view.culling.removed)).into());
        gpu.list_stale(&new.groups, &queue);
        encode_light(&gpu, &cache, std::iter::empty(), &mut context);
        stage_view.depth = Some(readback);
        stage_view.drawn = Drawn::new(&device, &gpu.chunks, shown);
        later = Some(Drawn::new(&device, &gpu.chunks, new));
    }

    let encoder = context.command_encoder();
    let relight_pipeline = stage_view.relight_pipeline.and_then(|id| cache.get_render_pipeline(id));
    if let Some(question) = stage_view.sight.question() {
        let pipelines = stage_view.sight_pipelines.map_or([None; 2], |ids| ids.map(|id| cache.get_render_pipeline(id)));
        canvas.numbers(encoder, &gpu, &stage_view.drawn, (&question.view, depth), pipelines);
        question.read(encoder);
    }
    let by_pixel = match (&stage_view.scan.shown, &stage_view.pixels) {
        (Some(scan), _) => {
            scan.light(encoder);
            Some(&scan.bind_group)
        }
        (None, Some(pixels)) => {
            pixels.light(encoder, &gpu.pages);
            Some(&pixels.bind_group)
        }
        (None, None) => None,
    };
    let mut pass = match by_pixel.zip(relight_pipeline) {
        Some((bind_group, pipeline)) => {
            let mut pass = canvas.stone_pass(encoder);
            pass.set_pipeline(pipeline);
            pass.set_bind_group(1, &**bind_group, &[]);
            pass.draw(0..3, 0..1);
            pass
        }
        None => canvas.stone(encoder, &gpu, later.as_ref().unwrap_or(&stage_view.drawn), most),
    };
    canvas.actors_and_sky(&mut pass, &actors, stage_view.sky.as_ref());
    drop(pass);
    if let Some(encoded) = &encoded {
        encoded.end(encoder, target);
    }
    stage_view.encoded = encoded;
}

/// The pipelines of closed stone, without and with a texture.
fn closed_stone(stone: [Option<&RenderPipeline>; STONES]) -> [Option<&RenderPipeline>; 2] {
    [StoneKind::Plain, StoneKind::Textured].map(|kind| stone[Subject::stone_index(kind, true)])
}

/// What a camera's passes draw by.
struct Pipelines<'a> {
    stone: [Option<&'a RenderPipeline>; STONES],
    sky: Option<&'a RenderPipeline>,
    /// Stone near actors and lamps; without its pipelines it is drawn as if there were none.
    shaded: Option<Shaded<'a>>,
    /// Stone with details.
    detailed: Option<Detailed<'a>>,
    /// What wears anything.
    covered: Option<Covered<'a>>,
}

impl<'a> Pipelines<'a> {
    /// Those of a camera; `None` before it knows what it draws by.
    fn find(
        stage_view: &StageView,
        (pipelines, cache): (&'a StagePipelines, &'a PipelineCache),
        (actors, lamps): (&'a ActorsGpu, &'a LampsGpu),
        covers: &'a CoversGpu,
    ) -> Option<Self> {
        let keys = stage_view.keys?;
        let find = |keys: [PipelineKey; SUBJECTS.len()]| keys.map(|key| pipelines.get(cache, key));
        let stone_of = |keys| {
            let [stone @ .., _] = find(keys);
            stone
        };
        let near_keys = |near| keys.map(|key| key.near(near));
        let shaded = stage_view.near.zip(actors.shade()).and_then(|(near, shade)| {
            let (stone, lamps) = (stone_of(near_keys(near)), (near == Near::Lamps).then_some(lamps));
            stone.iter().all(Option::is_some).then_some(Shaded { stone, shade, actors, lamps })
        });
        let detailed = stage_view.details.then(|| Detailed {
            alone: stone_of(keys.map(PipelineKey::detailed)),
            near: stage_view.near.map_or([None; STONES], |near| stone_of(near_keys(near).map(PipelineKey::detailed))),
            patterns: stage_view.patterns,
        });
        let covered = stage_view.covers.then(|| {
            let of = |near: Option<Near>, detailed: bool| {
                let near = near.map_or(keys, near_keys).map(PipelineKey::covered);
                stone_of(if detailed { near.map(PipelineKey::detailed) } else { near })
            };
            let of_near =
                |near: Option<Near>| [of(near, false), if stage_view.details { of(near, true) } else { [None; STONES] }];
            let near = stage_view.near.map_or([[None; STONES]; 2], |near| of_near(Some(near)));
            Covered { covers, stone: [of_near(None), near], outline: pipelines.get(cache, keys[0].outlined()) }
        });
        let [stone @ .., sky] = find(keys);
        Some(Self { stone, sky, shaded, detailed, covered })
    }
}

/// What a camera's passes draw on.
enum Onto<'a> {
    /// Its own picture.
    Eye {
        target: &'a ViewTarget,
        /// What is drawn to in place of the target.
        encoded: Option<&'a Encoded>,
        depth: &'a ViewDepthTexture,
    },
    /// Both eyes' layers, and what colour they begin with.
    Both(&'a BothEyes, wgpu::Color),
}

/// Where a camera's passes draw, and by which pipelines.
struct Canvas<'a> {
    onto: Onto<'a>,
    /// Whether anything was drawn to it.
    begun: Cell<bool>,
    viewport: Option<Viewport>,
    view_group: &'a BindGroup,
    pipelines: Pipelines<'a>,
}

/// How stone with a detail is drawn, which is the group after its texture.
struct Detailed<'a> {
    alone: [Option<&'a RenderPipeline>; STONES],
    near: [Option<&'a RenderPipeline>; STONES],
    /// Whether those are drawn so that have no photographs' views.
    patterns: bool,
}

/// How what wears anything is drawn: not near and near to actors and lamps, each without and with a detail; and its outlines.
struct Covered<'a> {
    covers: &'a CoversGpu,
    stone: [[[Option<&'a RenderPipeline>; STONES]; 2]; 2],
    outline: Option<&'a RenderPipeline>,
}

/// How stone is drawn near actors and lamps: what they cast is group 1, and the texture group 2.
struct Shaded<'a> {
    stone: [Option<&'a RenderPipeline>; STONES],
    shade: &'a BindGroup,
    actors: &'a ActorsGpu,
    lamps: Option<&'a LampsGpu>,
}

impl Shaded<'_> {
    /// Whether anything in a box of the world is to be drawn so.
    fn concerns(&self, bounds: (Vec3, Vec3)) -> bool {
        self.actors.shades(bounds) || self.lamps.is_some_and(|lamps| lamps.light(bounds))
    }
}

impl Canvas<'_> {
    /// A pass for stone and sky.
    fn stone_pass(&self, encoder: &mut CommandEncoder) -> RenderPass<'static> {
        let begun = self.begun.replace(true);
        let (color, depth, multiview_mask) = match self.onto {
            Onto::Eye { target, encoded, depth } => {
                let color = match encoded {
                    None => target.get_color_attachment(),
                    Some(encoded) if begun => encoded.attachment(LoadOp::Load),
                    Some(encoded) => encoded.attachment(encoded.begin(encoder, target)),
                };
                (color, depth.get_attachment(StoreOp::Store), None)
            }
            Onto::Both(eyes, clear) => {
                let (color, depth) = eyes.attachments((!begun).then_some(clear));
                (color, depth, Some(BOTH))
            }
        };
        self.begin(encoder, "stone_and_sky", (color, depth), multiview_mask)
    }

    fn begin(
        &self,
        encoder: &mut CommandEncoder,
        label: &str,
        (color, depth): (RenderPassColorAttachment<'_>, RenderPassDepthStencilAttachment<'_>),
        multiview_mask: Option<NonZeroU32>,
    ) -> RenderPass<'static> {
        let mut pass = encoder
            .begin_render_pass(&RenderPassDescriptor {
                label: Some(label),
                color_attachments: &[Some(color)],
                depth_stencil_attachment: Some(depth),
                timestamp_writes: None,
                occlusion_query_set: None,
                multiview_mask,
            })
            .forget_lifetime();
        if let Some(viewport) = &self.viewport {
            let (at, size) = (viewport.physical_position, viewport.physical_size);
            let [x, y, width, height] = [at.x, at.y, size.x, size.y].map(|v| v as f32);
            pass.set_viewport(x, y, width, height, viewport.depth.start, viewport.depth.end);
        }
        pass.set_bind_group(0, &**self.view_group, &[]);
        pass
    }

    /// Draws actors, and the sky where nothing is.
    fn actors_and_sky(&self, pass: &mut RenderPass<'_>, actors: &ActorsGpu, sky: Option<&BindGroup>) {
        let shaded = self.pipelines.shaded.as_ref();
        let lamps = shaded.and_then(|shaded| shaded.lamps);
        let covered = self.pipelines.covered.as_ref();
        let by = ActorPipelines {
            plain: closed_stone(self.pipelines.stone),
            shaded: shaded.map(|shaded| closed_stone(shaded.stone)),
            covered: covered.map(|covered| covered.stone.map(|[alone, _]| closed_stone(alone))),
            outline: covered.and_then(|covered| covered.outline),
        };
        actors.draw(pass, &by, lamps);
        if let (Some(pipeline), Some(maps)) = (self.pipelines.sky, sky) {
            pass.set_pipeline(pipeline);
            pass.set_bind_group(1, &**maps, &[]);
            pass.draw(0..3, 0..1);
        }
    }

    /// Draws stone, in passes of `most` triangles; the last is left open.
    fn stone(&self, encoder: &mut CommandEncoder, gpu: &StageGpu, drawn: &Drawn, most: u64) -> RenderPass<'static> {
        let runs = self.pipelines.shaded.as_ref().map(|shaded| (shaded, drawn.runs(&gpu.chunks)));
        let mut pass = self.stone_pass(encoder);
        let mut number = 0;
        for (part, draws) in drawn.seen.parts(most).enumerate() {
            if part > 0 {
                drop(pass);
                pass = self.stone_pass(encoder);
            }
            let mut bound = Bound::default();
            for draw in draws {
                match runs {
                    None => self.draw(&mut pass, gpu, drawn, &mut bound, draw, None),
                    Some((shaded, runs)) => {
                        for (indices, is_shaded) in split(&runs[number], |bounds| shaded.concerns(bounds)) {
                            let draw = Draw { indices, ..*draw };
                            self.draw(&mut pass, gpu, drawn, &mut bound, &draw, is_shaded.then_some(shaded));
                        }
                    }
                }
                number += 1;
            }
        }
        self.outlines(&mut pass, gpu);
        pass
    }

    /// Draws the outlines of marked stone: of all its triangles, for its backs are not among those that are seen.
    fn outlines(&self, pass: &mut RenderPass<'_>, gpu: &StageGpu) {
        let Some(Covered { covers, outline: Some(pipeline), .. }) = &self.pipelines.covered else { return };
        if !covers.any_marked() {
            return;
        }
        let mut bound = Bound::default();
        bound.normals(true);
        pass.set_pipeline(pipeline);
        for (number, chunk) in (0..).zip(gpu.drawn()) {
            let worn = covers.part(chunk.part);
            if worn.marked && worn.sight.casts() {
                let draw = Draw { chunk: number, indices: 0..chunk.kept.indices.len() as u32 };
                // a bright line, and a dark one around it
                [0, 1].into_iter().for_each(|wide| bound.draw(pass, gpu, None, &draw, worn.slot << OWN_BITS | wide));
            }
        }
    }

    /// Draws a part of a chunk.
    fn draw(
        &self,
        pass: &mut RenderPass<'_>,
        gpu: &StageGpu,
        drawn: &Drawn,
        bound: &mut Bound,
        draw: &Draw,
        shaded: Option<&Shaded<'_>>,
    ) {
        let chunk = &gpu.chunks[draw.chunk as usize];
        let subject = Subject::stone_index(chunk.kind, chunk.closed);
        bound.shade(pass, shaded.map(|shaded| shaded.shade));
        let (pipelines, group) = match shaded {
            Some(shaded) => (&shaded.stone, 2),
            None => (&self.pipelines.stone, 1),
        };
        let detailed = self.pipelines.detailed.as_ref().zip(chunk.detail).and_then(|(detailed, number)| {
            let pipelines = if shaded.is_some() { &detailed.near } else { &detailed.alone };
            Some((pipelines[subject]?, gpu.details.bind_group(number, detailed.patterns)?, number))
        });
        let worn = self.pipelines.covered.as_ref().map_or(Worn::NOTHING, |covered| covered.covers.part(chunk.part));
        let covered = self.pipelines.covered.as_ref().filter(|_| worn.slot > 0).and_then(|covered| {
            let stone = &covered.stone[usize::from(shaded.is_some())];
            // without the pipeline for its detail it is drawn as if it had none
            let of_detail = detailed.and_then(|(_, detail, number)| Some((stone[1][subject]?, Some((detail, number)))));
            of_detail.or_else(|| Some((stone[0][subject]?, None)))
        });
        let of_lamps = shaded.is_some_and(|shaded| shaded.lamps.is_some());
        bound.normals(of_lamps || detailed.is_some() || covered.is_some());
        let bare =
            || Some((detailed.map_or(pipelines[subject], |(pipeline, ..)| Some(pipeline))?, detailed.map(|(_, a, b)| (a, b))));
        let variant = usize::from(shaded.is_some()) + 4 * usize::from(covered.is_some());
        // Until its pipeline and texture are there, nothing is drawn of a chunk; without its detail's it is drawn as if it had none.
        if let Some((pipeline, detail)) = covered.or_else(bare)
            && bound.texture(pass, gpu, chunk, group)
        {
            if let Some((detail, number)) = detail {
                let after = if chunk.kind == StoneKind::Plain { group } else { group + 1 };
                bound.group(pass, after, Held::Detail(number), detail);
            }
            let variant = variant + 2 * usize::from(detail.is_some());
            bound.pipeline(pass, subject + variant * STONES, pipeline);
            let instance = if covered.is_some() { worn.slot << OWN_BITS } else { 0 };
            bound.draw(pass, gpu, drawn.indices.as_ref(), draw, instance);
        }
    }

    /// Draws the triangles' numbers.
    fn numbers(
        &self,
        encoder: &mut CommandEncoder,
        gpu: &StageGpu,
        drawn: &Drawn,
        (numbers, depth): (&TextureView, &ViewDepthTexture),
        pipelines: [Option<&RenderPipeline>; 2],
    ) {
        let load = LoadOp::Clear(wgpu::Color::TRANSPARENT);
        let ops = Operations { load, store: StoreOp::Store };
        let color = RenderPassColorAttachment { view: numbers, depth_slice: None, resolve_target: None, ops };
        let mut pass = self.begin(encoder, "stone_sight", (color, depth.get_attachment(StoreOp::Store)), None);
        let mut bound = Bound::default();
        let mut first = 0;
        for draw in &drawn.seen.draws {
            let closed = usize::from(gpu.chunks[draw.chunk as usize].closed);
            if let Some(pipeline) = pipelines[closed] {
                bound.pipeline(&mut pass, closed, pipeline);
                bound.draw(&mut pass, gpu, drawn.indices.as_ref(), draw, first);
            }
            first += draw.indices.len() as u32 / 3;
        }
    }
}

/// What is in a bind group after the camera's and that of what casts shade.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Held {
    /// What stone of this kind with this texture binds.
    Texture(StoneKind, Option<u32>),
    /// The detail of this number.
    Detail(u32),
}

/// What a pass has bound already.
#[derive(Default)]
pub struct Bound {
    pipeline: Option<usize>,
    page: Option<usize>,
    groups: [Option<Held>; 4],
    shaded: bool,
    /// Whether normals come before texture coordinates.
    normals: bool,
}

impl Bound {
    /// Sets the pipeline, of this number in its pass.
    fn pipeline(&mut self, pass: &mut RenderPass<'_>, number: usize, pipeline: &RenderPipeline) {
        if self.pipeline != Some(number) {
            pass.set_pipeline(pipeline);
            self.pipeline = Some(number);
        }
    }

    /// Goes over to stone that is shaded, or is not: their groups have other numbers.
    fn shade(&mut self, pass: &mut RenderPass<'_>, shade: Option<&BindGroup>) {
        if self.shaded != shade.is_some() {
            (self.shaded, self.groups) = (shade.is_some(), [None; 4]);
            if let Some(shade) = shade {
                pass.set_bind_group(1, &**shade, &[]);
            }
        }
    }

    /// Goes over to stone with normals among its buffers, or without.
    fn normals(&mut self, normals: bool) {
        if self.normals != normals {
            (self.normals, self.page) = (normals, None);
        }
    }

    /// Sets a group, unless it is that already.
    fn group(&mut self, pass: &mut RenderPass<'_>, number: usize, held: Held, group: &BindGroup) {
        if self.groups[number] != Some(held) {
            pass.set_bind_group(number as u32, &**group, &[]);
            self.groups[number] = Some(held);
        }
    }

    /// Sets the texture, if there is to be one; false if it is not there.
    fn texture(&mut self, pass: &mut RenderPass<'_>, gpu: &StageGpu, chunk: &GpuChunk, group: usize) -> bool {
        let wanted = Held::Texture(chunk.kind, chunk.texture);
        if chunk.kind == StoneKind::Plain || self.groups[group] == Some(wanted) {
            return true;
        }
        let found = match chunk.kind {
            StoneKind::Texels => gpu.texels.bind_group(chunk.texture),
            StoneKind::Panorama => gpu.panorama.bind_group(chunk.texture),
            _ => chunk.texture.and_then(|texture| gpu.textures.get(texture as usize)).map(|image| &image.bind_group),
        };
        if let Some(found) = found {
            self.group(pass, group, wanted, found);
        }
        found.is_some()
    }

    /// Records a draw of stone, with indices of `own` where there are any.
    pub fn draw(&mut self, pass: &mut RenderPass<'_>, gpu: &StageGpu, own: Option<&Buffer>, draw: &Draw, instance: u32) {
        let chunk = &gpu.chunks[draw.chunk as usize];
        if self.page != Some(chunk.page) {
            let page = &gpu.pages[chunk.page];
            pass.set_vertex_buffer(0, *page.positions.slice(..));
            pass.set_vertex_buffer(1, *page.lit.light.slice(..));
            pass.set_vertex_buffer(2, *page.albedo.slice(..));
            let texels = page.texels.as_ref();
            let for_lamps = page.normals.as_ref().filter(|_| self.normals).map(|normals| &normals.buffer);
            let normals = texels.map(|texels| &texels.normals).or(for_lamps);
            let places = texels.map(|texels| &texels.uvs);
            for (slot, buffer) in (3..).zip(normals.into_iter().chain(&page.uvs).chain(places)) {
                pass.set_vertex_buffer(slot, *buffer.slice(..));
            }
            pass.set_index_buffer(*own.unwrap_or(&page.indices).slice(..), IndexFormat::Uint16);
            self.page = Some(chunk.page);
        }
        let first = if own.is_some() { 0 } else { chunk.first_index };
        let indices = first + draw.indices.start..first + draw.indices.end;
        pass.draw_indexed(indices, chunk.base_vertex as i32, instance..instance + 1);
    }
}
