//! Before the GPU's work of a frame: what was loaded goes up, each camera's draws are found, the stale light is listed.

use super::encoded::{Encoded, codes_format};
use super::layout::{BLOCK, GROUP};
use super::moment::MomentUniform;
use super::multiview::{EyeCanvas, Multiview, OnePassPairs, StereoPasses};
use super::occlusion::{DepthReadback, LEAST_TRIANGLES};
use super::pages::{GpuChunk, GpuTexture, Page, PageNormals, Remaining, upload};
use super::pipelines::{KINDS, Near, PipelineKey, STONES, SUBJECTS, StagePipelines};
use super::pixels::{Pixels, Wanted};
use super::raster::{Lens, Raster};
use super::scan::{Scan, ScanSight};
use super::seen::{LightGroup, Run, Seen};
use super::sight::{Change, Sight, SightKey};
use super::slot::write_uniform;
use super::texels::{TexelMoment, TexelsGpu};
use super::view::{ClusterRef, Eye, Look, ViewUniform, cull};
use super::{DaylightCamera, ExactAtRest, StereoPair, allocator};
use crate::actors::render::ActorsGpu;
use crate::covering::gpu::CoversGpu;
use crate::culling::pair::Pairs;
use crate::culling::{Culler, Culling, CullingScene, CullingTold, Saved, ViewCulling};
use crate::detail::DetailsGpu;
use crate::lamps::maps::LampsGpu;
use crate::sky::SkyResources;
use crate::stage::feed::{Delivery, OfScan};
use crate::stage::frame::StageFrame;
use crate::stage::texture::{self, LevelledTexture};
use bevy::camera::{Camera3d, CameraMainTextureUsages, MainPassResolutionOverride};
use bevy::core_pipeline::prepass::{DeferredPrepass, DepthPrepass, MotionVectorPrepass, NormalPrepass};
use bevy::prelude::*;
use bevy::render::camera::ExtractedCamera;
use bevy::render::render_asset::RenderAssets;
use bevy::render::render_resource::*;
use bevy::render::renderer::{RenderDevice, RenderQueue};
use bevy::render::texture::{FallbackImage, GpuImage};
use bevy::render::view::ExtractedView;
use heliodon_bundle::memory::give_back_freed_memory;
use heliodon_image::TextureWrap;
use std::collections::HashMap;
use std::sync::{Arc, OnceLock};

/// Bytes of chunks and textures that go up in one frame: loading must not stop the pictures.
const UPLOAD_BYTES_A_FRAME: usize = 24 << 20;

/// All of the stone on the GPU.
#[derive(Resource, Default)]
pub struct StageGpu {
    serial: u64,
    /// The light pipeline of the bundle.
    pub light_pipeline: Option<CachedComputePipelineId>,
    /// Pages of buffers.
    pub pages: Vec<Page>,
    /// Chunks in them.
    pub chunks: Vec<GpuChunk>,
    /// Base colour images.
    pub textures: Vec<GpuTexture>,
    samplers: HashMap<[TextureWrap; 2], Sampler>,
    /// Chunks that are there, by their [`KINDS`].
    uploaded: [Remaining; KINDS.len()],
    /// Chunks of the scan that are.
    uploaded_scan: Remaining,
    /// Light in texels,
    pub texels: TexelsGpu,
    /// and that of a panorama.
    pub panorama: TexelsGpu,
    /// Details of parts.
    pub details: DetailsGpu,
    /// What lights texels: of the sky, and of the bounced sun.
    pub texel_pipelines: Option<[CachedComputePipelineId; 2]>,
    moment: Option<MomentUniform>,
    moment_serial: u64,
    moment_buffer: Option<(Buffer, BindGroup)>,
    /// The light that some camera needs.
    needed: Vec<LightGroup>,
    /// Whether a processor draws: then it is found what cameras see, and textures are read with fewer samples.
    pub software: bool,
    /// How many of the chunks are drawn, once they are there and it is known which are closed; after them come those of the scan.
    drawn_chunks: Option<usize>,
    /// The scan where it stays in main memory, which others see once it is whole.
    scan: Option<Arc<Scan>>,
    /// Whether nothing of the scan goes to the GPU.
    scan_stays_off: bool,
    /// How many eyes of each pair had found their pictures of it in the last frame.
    scans_found: HashMap<StereoPair, usize>,
    /// Whether all that is to be seen is there.
    is_whole: bool,
    /// What culling knows of the bundle, once all of it is there.
    culling: Option<Arc<CullingScene>>,
    /// What pairs of cameras leave out.
    pairs: Pairs,
    /// Pairs that are drawn in one pass.
    pub multiview: Multiview,
    /// Frames since less was needed than before: since the last of the bundle was taken, or a camera came to know what it sees.
    settled_frames: u32,
    /// Groups of vertices to be lit, per page.
    work: Vec<Vec<u32>>,
    /// The pipeline that makes normals, and the pages that have none yet, with their workgroups.
    normals: Option<(CachedComputePipelineId, Vec<(usize, u32)>)>,
}

impl StageGpu {
    /// The moment's bind group.
    #[must_use]
    pub fn moment_bind_group(&self) -> Option<&BindGroup> {
        self.moment_buffer.as_ref().map(|(_, group)| group)
    }

    /// Pages that have vertices to be lit this frame, and how many workgroups do it.
    pub fn lit_pages(&self) -> impl Iterator<Item = (&Page, u32)> {
        self.pages
            .iter()
            .zip(&self.work)
            .map(|(page, work)| (page, work.len() as u32 * GROUP / BLOCK))
            .filter(|&(_, workgroups)| workgroups > 0)
    }

    /// Lets normals be made where there are none; all chunks are there.
    pub fn want_normals(&mut self, device: &RenderDevice, pipeline: CachedComputePipelineId, layout: &BindGroupLayout) {
        let (_, without) = self.normals.get_or_insert((pipeline, Vec::new()));
        let pages = self.pages.iter_mut().enumerate().filter(|(_, page)| page.normals.is_none());
        without.extend(pages.map(|(number, page)| (number, page.want_normals(device, layout))));
    }

    /// The pages whose normals are to be made, how many workgroups do it, and the pipeline that does.
    pub fn without_normals(&self) -> Option<(CachedComputePipelineId, impl Iterator<Item = (&PageNormals, u32)>)> {
        let (pipeline, pages) = self.normals.as_ref().filter(|(_, pages)| !pages.is_empty())?;
        let page = |&(number, workgroups): &(usize, u32)| Some((self.pages.get(number)?.normals.as_ref()?, workgroups));
        Some((*pipeline, pages.iter().filter_map(page)))
    }

    /// Normals were made wherever they were wanted.
    pub fn made_normals(&mut self) {
        if let Some((_, pages)) = &mut self.normals {
            pages.clear();
        }
    }

    /// Whether stone can be drawn with normals.
    #[must_use]
    pub fn has_normals(&self) -> bool {
        self.normals.as_ref().is_some_and(|(_, pages)| pages.is_empty()) && self.pages.iter().all(|page| page.normals.is_some())
    }

    /// Lists those of `groups` that have not the moment's light, for [`Self::lit_pages`]: none before there is a moment.
    pub fn list_stale(&mut self, groups: &[LightGroup], queue: &RenderQueue) {
        self.work.iter_mut().for_each(Vec::clear);
        self.work.resize_with(self.pages.len(), Vec::new);
        if self.moment.is_none() {
            return;
        }
        for &LightGroup { chunk, group } in groups {
            let chunk = &mut self.chunks[chunk as usize];
            let lit_at = &mut chunk.lit_at[usize::from(group)];
            if *lit_at != self.moment_serial {
                *lit_at = self.moment_serial;
                self.work[chunk.page].push(chunk.base_vertex / GROUP + u32::from(group));
            }
        }
        for (page, work) in self.pages.iter().zip(&mut self.work) {
            if !work.is_empty() {
                // Whole workgroups; light.wgsl passes over what is added.
                work.resize(work.len().next_multiple_of((BLOCK / GROUP) as usize), u32::MAX);
                queue.write_buffer(&page.lit.work, 0, bytemuck::cast_slice(work));
            }
        }
    }

    /// The chunks that are drawn while an eye moves.
    #[must_use]
    pub fn drawn(&self) -> &[GpuChunk] {
        &self.chunks[..self.drawn_chunks.unwrap_or(self.chunks.len())]
    }

    /// The clusters that a camera at rest meets where the scan is on the GPU: all of that, and what is drawn of parts that are not in it.
    fn at_rest(chunks: &[GpuChunk], drawn: usize, of_scan: &OfScan, looks: &[Look]) -> Vec<ClusterRef> {
        let is_in_scan = |chunk: &GpuChunk| of_scan.parts.get(usize::from(chunk.part)).is_some_and(|&is_in| is_in);
        let mut clusters = cull(chunks, looks);
        clusters.retain(|one| one.chunk as usize >= drawn || !is_in_scan(&chunks[one.chunk as usize]));
        clusters
    }

    /// Triangles of clusters.
    fn triangles(&self, clusters: &[ClusterRef]) -> u64 {
        let indices = |one: &ClusterRef| self.chunks[one.chunk as usize].kept.clusters[one.cluster as usize].indices.len();
        clusters.iter().map(|one| indices(one) as u64 / 3).sum()
    }
}

/// A camera's share of a frame.
#[derive(Component, Default)]
pub struct StageView {
    buffer: Option<(Buffer, BindGroup)>,
    /// What is known of what is seen.
    pub sight: Sight,
    /// What is left out although it is in view.
    pub culling: ViewCulling,
    /// The camera.
    pub clip_from_world: Mat4,
    /// What is drawn, near chunks first; first, where something is [`Self::undecided`].
    pub drawn: Drawn,
    /// What a moving eye may see: drawing decides what of it shows.
    pub undecided: Option<Vec<ClusterRef>>,
    /// The depth of what is drawn first.
    pub depth: Option<DepthReadback>,
    /// The format of the codes in which it is drawn, if it is.
    pub codes: Option<TextureFormat>,
    /// Its picture in codes.
    pub encoded: Option<Encoded>,
    /// The bundle that it sees.
    stage: u64,
    /// What is known of its pixels, where stone is lit pixel by pixel.
    pub pixels: Option<Pixels>,
    /// The scan in main memory, as it sees it at rest.
    pub scan: ScanSight,
    /// Where it was, and for how many frames it has been there.
    still: (Mat4, u32),
    /// The pipeline for that.
    pub relight_pipeline: Option<CachedRenderPipelineId>,
    /// What all subjects are drawn by.
    pub keys: Option<[PipelineKey; SUBJECTS.len()]>,
    /// What stone is near to, while it is to anything.
    pub near: Option<Near>,
    /// Whether details are shown.
    pub details: bool,
    /// Whether their patterns are, and not what photographs saw alone.
    pub patterns: bool,
    /// Whether what is worn can be drawn.
    pub covers: bool,
    /// Pipelines that find out what is seen, for surfaces and for closed bodies.
    pub sight_pipelines: Option<[CachedRenderPipelineId; 2]>,
    /// The dome's maps, when there are any.
    pub sky: Option<BindGroup>,
}

impl StageView {
    /// Triangles of the stone that were drawn, or that are seen.
    #[must_use]
    pub fn triangle_count(&self) -> u64 {
        match (&self.scan.shown, &self.pixels) {
            (Some(scan), _) => scan.triangle_count(),
            (None, Some(pixels)) => pixels.raster.triangle_count(),
            (None, None) => self.drawn.seen.triangle_count(),
        }
    }

    /// What it draws in a frame. `may_ask` is the size of its picture if it may ask what that shows; what is hidden from a moving eye is found if it `may_occlude`; `find`
    /// says what of the stone it meets.
    fn look(
        &mut self,
        gpu: &mut StageGpu,
        device: &RenderDevice,
        key: SightKey,
        (may_ask, may_occlude): (Option<UVec2>, bool),
        find: impl FnOnce(&mut ViewCulling, &[GpuChunk]) -> Vec<ClusterRef>,
    ) {
        // A frame that was not drawn has decided nothing.
        let undecided = self.undecided.is_some();
        match self.sight.next(device, key, may_ask.filter(|_| !undecided)) {
            Change::None if !undecided => {}
            Change::None | Change::Moved => {
                let clusters = find(&mut self.culling, &gpu.chunks);
                let occludes = may_occlude && gpu.triangles(&clusters) >= LEAST_TRIANGLES;
                // What was seen a frame ago, or everything.
                if !(occludes && self.stage == gpu.serial && self.drawn.seen.single.is_some()) {
                    self.drawn = Drawn::new(device, &gpu.chunks, Seen::clusters(&gpu.chunks, &clusters, &self.culling.removed));
                }
                self.undecided = occludes.then_some(clusters);
                self.stage = gpu.serial;
            }
            Change::Shown(shown) => {
                self.depth = None;
                gpu.settled_frames = 0;
                allocator::keep_freed_memory(false);
                let seen = self.drawn.seen.only(&gpu.chunks, &shown);
                self.drawn = Drawn::new(device, &gpu.chunks, seen);
            }
        }
    }

    /// Frees what was known of what is seen.
    fn forget_sight(&mut self) {
        (self.sight, self.undecided, self.depth, self.drawn) = default();
    }

    /// The camera's bind group.
    #[must_use]
    pub fn bind_group(&self) -> Option<&BindGroup> {
        self.buffer.as_ref().map(|(_, group)| group)
    }
}

/// What is drawn, with its indices where it has its own.
#[derive(Default)]
pub struct Drawn {
    /// What is drawn.
    pub seen: Seen,
    /// [`Seen::indices`].
    pub indices: Option<Buffer>,
    runs: OnceLock<Vec<Vec<Run>>>,
}

impl Drawn {
    /// Puts the indices on the GPU.
    pub fn new(device: &RenderDevice, chunks: &[GpuChunk], seen: Seen) -> Self {
        let mut indices = seen.indices(chunks);
        // Buffers are made in multiples of four bytes.
        indices.resize(indices.len().next_multiple_of(2), 0);
        let descriptor = BufferInitDescriptor {
            label: Some("stone_seen"),
            contents: bytemuck::cast_slice(&indices),
            usage: BufferUsages::INDEX,
        };
        let indices = (!indices.is_empty()).then(|| device.create_buffer_with_data(&descriptor));
        Self { indices, seen, runs: OnceLock::new() }
    }

    /// [`Seen::runs`].
    pub fn runs(&self, chunks: &[GpuChunk]) -> &[Vec<Run>] {
        self.runs.get_or_init(|| self.seen.runs(chunks))
    }
}

/// Takes what the loading thread has ready.
pub fn receive(
    frame: Res<StageFrame>,
    mut gpu: ResMut<StageGpu>,
    mut pipelines: ResMut<StagePipelines>,
    mut cache: ResMut<PipelineCache>,
    (device, queue): (Res<RenderDevice>, Res<RenderQueue>),
    covers: Res<CoversGpu>,
    exact: Query<(), With<ExactAtRest>>,
) {
    let gpu = &mut *gpu;
    let Some(feed) = &frame.feed else {
        if gpu.serial != 0 {
            *gpu = StageGpu { software: gpu.software, ..default() };
        }
        return;
    };
    if gpu.serial != feed.serial {
        *gpu = StageGpu { serial: feed.serial, moment_serial: gpu.moment_serial, software: gpu.software, ..default() };
        gpu.light_pipeline = Some(pipelines.light(&mut cache, feed.layout));
        if gpu.software {
            // What the bundle before has had, and what loading this one frees, is not kept.
            allocator::keep_freed_memory(false);
        }
    }
    let light_layout = cache.get_bind_group_layout(&pipelines.light_layout);
    let mut bytes = 0;
    while bytes < UPLOAD_BYTES_A_FRAME {
        match feed.next() {
            None => break,
            Some(Delivery::Texture(level)) => {
                bytes += level.image.pixels.len() * 4;
                if gpu.textures.len() == level.texture
                    && let Some(texture) = LevelledTexture::new(&device, &level.image)
                {
                    let sampler =
                        gpu.samplers.entry(level.wrap).or_insert_with(|| texture::sampler(&device, !gpu.software, level.wrap));
                    let layout = cache.get_bind_group_layout(&pipelines.texture_layout);
                    let view = texture.view();
                    let entries = BindGroupEntries::sequential((&view, &*sampler));
                    let bind_group = device.create_bind_group("stone_texture", &layout, &entries);
                    gpu.textures.push(GpuTexture { bind_group, texture, sampler: sampler.clone() });
                }
                // Levels that are too large for the device are passed over.
                if let Some(to) = gpu.textures.get_mut(level.texture) {
                    to.texture.write(&queue, &level.image);
                }
            }
            Some(Delivery::Texels(piece)) => {
                bytes += piece.bytes.len();
                gpu.texels.write(&device, &queue, &piece);
            }
            Some(Delivery::Panorama(piece)) => {
                bytes += piece.bytes.len();
                gpu.panorama.write(&device, &queue, &piece);
            }
            Some(Delivery::TexelsDone(info)) => {
                let images: Vec<_> = gpu.textures.iter().map(|image| (image.texture.view(), image.sampler.clone())).collect();
                gpu.texels.finish((&device, &queue), (&cache, &pipelines), &images);
                if let Some(info) = info {
                    gpu.panorama.see_from(&info);
                    gpu.panorama.finish((&device, &queue), (&cache, &pipelines), &images);
                }
                gpu.texel_pipelines = Some(pipelines.texel_relight(&mut cache));
            }
            Some(Delivery::Detail(detail)) => {
                bytes += detail.bytes();
                let layout = cache.get_bind_group_layout(&pipelines.detail_layout);
                gpu.details.push(&device, &queue, &layout, &detail);
            }
            Some(Delivery::Closed(closed)) => {
                gpu.drawn_chunks = Some(gpu.chunks.len());
                gpu.chunks.iter_mut().zip(closed).for_each(|(chunk, closed)| chunk.closed = closed);
                // where a processor draws other than stills, main memory is the place for what few frames ask for
                gpu.scan_stays_off = gpu.software && exact.is_empty();
                if gpu.scan_stays_off {
                    // pixels of what is not in the scan are nothing that the processor draws
                    feed.scan_stays_off(feed.of_scan.is_whole);
                }
            }
            Some(Delivery::Scan(chunk)) if gpu.scan_stays_off => {
                if feed.of_scan.is_whole {
                    let scan = gpu.scan.get_or_insert_with(|| Arc::new(Scan::new(feed.layout)));
                    if let Some(scan) = Arc::get_mut(scan) {
                        scan.push(*chunk);
                    }
                }
            }
            Some(Delivery::Scan(chunk)) => {
                bytes += chunk.bytes();
                let remaining = feed.of_scan.total.after(gpu.uploaded_scan);
                gpu.uploaded_scan.add(chunk.kept.positions.len() as u64, chunk.kept.indices.len() as u64 / 3);
                let placed = upload(&device, &queue, feed.layout, &light_layout, &mut gpu.pages, &chunk, remaining);
                gpu.chunks.push(placed);
            }
            Some(Delivery::Whole) => {
                gpu.is_whole = true;
                feed.end();
            }
            Some(Delivery::Culling(scene)) => {
                gpu.culling = Some(scene);
                // finding it takes seconds of a large bundle, and leaves much that was freed
                gpu.settled_frames = 0;
            }
            Some(Delivery::Chunk(chunk)) => {
                bytes += chunk.bytes();
                let kind = chunk.kind as usize;
                let remaining = feed.total[kind].after(gpu.uploaded[kind]);
                gpu.uploaded[kind].add(chunk.kept.positions.len() as u64, chunk.kept.indices.len() as u64 / 3);
                let placed = upload(&device, &queue, feed.layout, &light_layout, &mut gpu.pages, &chunk, remaining);
                gpu.chunks.push(placed);
            }
        }
    }
    if (!gpu.details.is_empty() || covers.any()) && feed.has_pages() {
        let pipeline = pipelines.normals(&mut cache, feed.layout);
        let layout = cache.get_bind_group_layout(&pipelines.normals_layout);
        gpu.want_normals(&device, pipeline, &layout);
    }
    if feed.is_uploaded() {
        gpu.settled_frames = gpu.settled_frames.saturating_add(1);
        if gpu.settled_frames == SETTLED_FRAMES {
            give_back_freed_memory();
        }
        if gpu.software && gpu.settled_frames == 2 * SETTLED_FRAMES {
            allocator::keep_freed_memory(true);
        }
    }
}

/// Frames after which what is not needed any more is free; and as many more in which it is given back.
const SETTLED_FRAMES: u32 = 4;

/// Frames after which an eye that has not moved rests.
const STILL_FRAMES: u32 = 3;

/// Larger pictures do not ask what they show: each pixel takes eight bytes for it.
const MAX_ASKED_PIXELS: u32 = 16 << 20;

/// What is needed of a camera.
type SeenCamera = (
    Entity,
    &'static ExtractedCamera,
    &'static Camera3d,
    &'static CameraMainTextureUsages,
    &'static ExtractedView,
    &'static Msaa,
    Option<&'static MainPassResolutionOverride>,
    Option<&'static StereoPair>,
    Option<&'static mut StageView>,
);

/// What a camera's picture is seen by.
fn look(view: &ExtractedView) -> Look {
    // The last row of a perspective is (0, 0, -1, 0), that of a parallel projection (0, 0, 0, 1).
    let parallel = view.clip_from_view.w_axis.w == 1.0;
    let forward = view.world_from_view.rotation() * Vec3::NEG_Z;
    let eye = if parallel { Eye::Along(forward) } else { Eye::At(view.world_from_view.translation()) };
    let view_from_world = view.world_from_view.to_matrix().inverse();
    let clip_from_world = view.clip_from_world.unwrap_or_else(|| view.clip_from_view * view_from_world);
    Look { clip_from_world, eye, size: UVec2::new(view.viewport.z, view.viewport.w).as_vec2() }
}

/// A camera for which Bevy draws guests' depth before the stone.
type WithPrepass = Or<(With<DepthPrepass>, With<NormalPrepass>, With<MotionVectorPrepass>, With<DeferredPrepass>)>;

/// Finds what each camera draws.
#[expect(clippy::too_many_arguments, reason = "a system's arguments are its resources")]
pub fn prepare_views(
    mut commands: Commands,
    frame: Res<StageFrame>,
    mut gpu: ResMut<StageGpu>,
    mut pipelines: ResMut<StagePipelines>,
    mut cache: ResMut<PipelineCache>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
    images: Res<RenderAssets<GpuImage>>,
    fallback: Res<FallbackImage>,
    mut sky: ResMut<SkyResources>,
    (actors, lamps): (Res<ActorsGpu>, Res<LampsGpu>),
    (culling, told, covers): (Res<Culling>, Res<CullingTold>, Res<CoversGpu>),
    (passes, one_pass): (Res<StereoPasses>, Res<OnePassPairs>),
    prepassed: Query<(), WithPrepass>,
    exact: Query<(), With<ExactAtRest>>,
    mut views: Query<SeenCamera, With<DaylightCamera>>,
) {
    gpu.needed.clear();
    let Some(covers_buffer) = covers.buffer() else { return };
    let (faded, worn_by) = (covers.faded(gpu.drawn()), covers.subjects(&gpu.chunks));
    let drawn_chunks = gpu.drawn().len();
    let scan_on_gpu = gpu.is_whole && drawn_chunks < gpu.chunks.len();
    let scan = gpu.scan.clone().filter(|_| gpu.is_whole);
    let scene = gpu.culling.clone();
    let mut saved = Saved::default();
    let mut pairs = std::mem::take(&mut gpu.pairs);
    pairs.begin(views.iter().filter_map(|(_, _, _, _, view, _, _, pair, _)| Some((*pair?, look(view)))));
    // both eyes of a pair change in one frame: the one after that in which the later picture was found
    let found_before = std::mem::take(&mut gpu.scans_found);
    let mut multiview = std::mem::take(&mut gpu.multiview);
    let canvases = views.iter().filter_map(|(entity, camera, _, _, view, msaa, resolution, pair, stage_view)| {
        // A camera that is new has no share yet.
        stage_view?;
        let in_perspective = matches!(look(view).eye, Eye::At(_));
        Some((*pair?, entity, EyeCanvas::new(camera, view, *msaa, resolution).filter(|_| in_perspective)))
    });
    // The frame before knows which were drawn.
    one_pass.tell(multiview.drawn());
    multiview.begin(&device, (&mut cache, &mut pipelines), covers_buffer, canvases, |samples| {
        passes.is_one(&device, gpu.software, samples)
    });
    for (entity, camera, camera_3d, usages, view, msaa, resolution, pair, stage_view) in &mut views {
        let Some(mut stage_view) = stage_view else {
            // From the next frame on; the commands are applied before it.
            commands.entity(entity).insert(StageView::default());
            continue;
        };
        let own = look(view);
        let Look { clip_from_world, eye, .. } = own;
        let looks = pairs.looks(pair.copied(), own);
        let layer = multiview.layer(entity);
        stage_view.codes = (gpu.software && msaa.samples() == 1 && resolution.is_none() && layer.is_none())
            .then(|| codes_format(view.target_format, usages.0, camera))
            .flatten();
        let format = stage_view.codes.unwrap_or(view.target_format);
        let keys = SUBJECTS.map(|subject| {
            let key = PipelineKey::new(subject, frame.curve, format, msaa.samples());
            if layer.is_some() { key.both_eyes() } else { key }
        });
        stage_view.keys = Some(keys);
        stage_view.relight_pipeline = stage_view.codes.map(|format| pipelines.relight(&mut cache, frame.curve, format));
        stage_view.near = actors.shade().map(|_| if lamps.any() && gpu.has_normals() { Near::Lamps } else { Near::Actors });
        // Details take part of their place from normals, which are there once all chunks are.
        stage_view.patterns = !frame.without_details;
        let shows_details = gpu.details.shows_any(stage_view.patterns);
        stage_view.details = shows_details && gpu.has_normals();
        for key in keys {
            let near = stage_view.near.map(|near| key.near(near));
            for key in [Some(key), near].into_iter().flatten() {
                pipelines.want(&mut cache, &device, key);
                if stage_view.details {
                    pipelines.want(&mut cache, &device, key.detailed());
                }
            }
        }
        stage_view.covers = covers.any() && gpu.has_normals();
        for (&key, _) in keys.iter().zip(worn_by).filter(|(_, worn)| *worn && stage_view.covers) {
            for key in [Some(key), stage_view.near.map(|near| key.near(near))].into_iter().flatten() {
                pipelines.want(&mut cache, &device, key.covered());
                if stage_view.details {
                    pipelines.want(&mut cache, &device, key.covered().detailed());
                }
            }
        }
        if stage_view.covers {
            pipelines.want(&mut cache, &device, keys[0].outlined());
        }
        let still = &mut stage_view.still;
        *still = if still.0 == clip_from_world { (clip_from_world, still.1.saturating_add(1)) } else { (clip_from_world, 0) };
        // heads are never still, but in pictures
        let shows_scan = scan_on_gpu && (exact.contains(entity) || (pair.is_none() && still.1 >= STILL_FRAMES));
        let key = SightKey {
            scan: shows_scan,
            clip_from_world,
            beside: looks.iter().map(|look| look.clip_from_world).find(|other| *other != clip_from_world),
            viewport: view.viewport,
            samples: msaa.samples(),
            stage: (
                gpu.serial,
                gpu.chunks.len() + usize::from(gpu.drawn_chunks.is_some()) + usize::from(gpu.culling.is_some()),
            ),
            culling: *culling,
            covers: covers.serial(),
        };
        let numbering = (gpu.software && layer.is_none() && device.features().contains(WgpuFeatures::PRIMITIVE_INDEX))
            .then(|| pipelines.sight(&mut cache));
        stage_view.sight_pipelines = numbering;
        // A frame without its pipelines would find that nothing is seen, and one whose depth begins with guests would find that
        // what they hide is not: they may move while the eye rests.
        let has_all = keys[..STONES].iter().all(|&key| pipelines.get(&cache, key).is_some())
            && numbering.iter().flatten().all(|&id| cache.get_render_pipeline(id).is_some());
        let may_ask = (numbering.is_some() && msaa.samples() == 1 && !prepassed.contains(entity))
            .then_some(camera.physical_target_size)
            .flatten()
            .filter(|size| size.element_product() <= MAX_ASKED_PIXELS)
            .filter(|_| has_all && !covers.any_faded());
        // Likewise what guests hide is not hidden from an eye that comes to rest.
        let may_occlude = gpu.software
            && !covers.any_faded()
            && layer.is_none()
            && msaa.samples() == 1
            && !prepassed.contains(entity)
            && resolution.is_none()
            && camera.viewport.as_ref().is_none_or(|viewport| viewport.depth == (0.0..1.0))
            && TextureUsages::from(camera_3d.depth_texture_usages).contains(TextureUsages::COPY_SRC);
        let stage_view = &mut *stage_view;
        stage_view.clip_from_world = clip_from_world;
        // Stone that nothing else lights or shades, and that shows no detail, is lit pixel by pixel.
        let by_pixel = may_ask
            .filter(|&size| Raster::can_be(size) && !exact.contains(entity) && actors.shade().is_none() && !shows_details)
            .filter(|_| covers.is_settled() && !shows_scan);
        let wanted = by_pixel
            .filter(|_| stage_view.relight_pipeline.is_some_and(|id| cache.get_render_pipeline(id).is_some()))
            .and_then(|size| Some(Wanted { key, size, lens: Lens::new(&clip_from_world)?, worn: covers.parts() }));
        let culler = Culler { scene: scene.as_ref(), settings: *culling, remembers: !exact.contains(entity), faded: &faded };
        let relight_layout = cache.get_bind_group_layout(&pipelines.relight_layout);
        let light_layout = cache.get_bind_group_layout(&pipelines.light_layout);
        let may_show = pair.is_none_or(|pair| found_before.get(pair).is_some_and(|&eyes| eyes >= looks.len()));
        stage_view.scan.next(
            scan.as_ref(),
            own,
            (wanted.as_ref(), may_show),
            (&device, &queue),
            (&light_layout, &relight_layout),
        );
        if let Some(pair) = pair.filter(|_| stage_view.scan.is_found()) {
            *gpu.scans_found.entry(*pair).or_default() += 1;
        }
        let before = stage_view.pixels.take();
        stage_view.pixels = match wanted {
            Some(wanted) if stage_view.scan.shown.is_none() => {
                let find = |chunks: &[GpuChunk]| {
                    covers.there(chunks, pairs.clusters(pair.copied(), &mut stage_view.culling, &culler, chunks, &looks))
                };
                Pixels::next(before, &wanted, (&gpu.pages, gpu.drawn()), (&device, &queue), &relight_layout, find)
            }
            // for when it moves again
            Some(_) => before,
            None => None,
        };
        if stage_view.scan.shown.is_some() {
            stage_view.forget_sight();
        } else if let Some(pixels) = &stage_view.pixels {
            gpu.needed.extend_from_slice(&pixels.raster.groups);
            stage_view.forget_sight();
        } else if layer == Some(1) {
            // The first eye's draws are both eyes'.
            stage_view.forget_sight();
        } else {
            stage_view.look(&mut gpu, &device, key, (may_ask, may_occlude), |own, chunks| {
                let clusters = match frame.feed.as_ref().filter(|_| shows_scan) {
                    Some(feed) => {
                        own.nothing();
                        StageGpu::at_rest(chunks, drawn_chunks, &feed.of_scan, &looks)
                    }
                    None => pairs.clusters(pair.copied(), own, &culler, &chunks[..drawn_chunks], &looks),
                };
                covers.there(chunks, clusters)
            });
            gpu.needed.extend_from_slice(&stage_view.drawn.seen.groups);
        }
        saved.add(&stage_view.culling.saved);

        let height = camera.physical_viewport_size.map_or(1, |size| size.y.max(1));
        let world_from_view = Mat4::from_quat(view.world_from_view.rotation());
        let pixel_rad = 2.0 / (view.clip_from_view.y_axis.y.abs().max(1e-6) * height as f32);
        let direction_from_clip = match eye {
            Eye::Along(forward) => Mat4::from_cols(Vec4::ZERO, Vec4::ZERO, forward.extend(0.0), Vec4::ZERO),
            Eye::At(_) => world_from_view * view.clip_from_view.inverse(),
        };
        // Details fade at the same places in both eyes' pictures.
        let uniform =
            crate::sky::view_uniform(&frame, clip_from_world, direction_from_clip, pixel_rad, Look::middle(&looks, eye));
        if !multiview.write(&queue, entity, &uniform) {
            let layout = cache.get_bind_group_layout(&pipelines.view_layout);
            let bytes = bytemuck::bytes_of::<ViewUniform>(&uniform);
            write_uniform(&mut stage_view.buffer, (&device, &queue), &layout, bytes, Some(covers_buffer), "stone_view");
        }
        stage_view.sky =
            sky.bind_group(&frame.sky, &images, &fallback, &device, &cache.get_bind_group_layout(&pipelines.sky_layout));
    }
    (gpu.pairs, gpu.multiview) = (pairs, multiview);
    told.tell(saved, gpu.culling.is_some());
}

/// Lists the visible vertices whose light is not the moment's.
pub fn prepare_light(
    frame: Res<StageFrame>,
    mut gpu: ResMut<StageGpu>,
    pipelines: Res<StagePipelines>,
    cache: Res<PipelineCache>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
    mut views: Query<&mut StageView>,
) {
    let gpu = &mut *gpu;
    gpu.work.clear();
    let (Some(feed), Some(moment)) = (&frame.feed, &frame.moment) else { return };
    // Until the pipeline is there nothing would be lit, and chunks must not be taken for lit.
    if gpu.light_pipeline.is_none_or(|id| cache.get_compute_pipeline(id).is_none()) {
        return;
    }
    let uniform = MomentUniform::new(feed.layout, moment, frame.exposure_stops.exp2());
    if gpu.moment != Some(uniform) {
        gpu.moment = Some(uniform);
        gpu.moment_serial += 1;
        let layout = cache.get_bind_group_layout(&pipelines.moment_layout);
        let bytes = bytemuck::bytes_of(&uniform);
        write_uniform(&mut gpu.moment_buffer, (&device, &queue), &layout, bytes, None, "stone_moment");
    }
    let moment = TexelMoment::new(feed.layout, moment, frame.exposure_stops.exp2());
    gpu.texels.light_at(&queue, moment);
    gpu.panorama.light_at(&queue, moment);
    for shown in views.iter_mut().filter_map(|view| view.into_inner().scan.shown.as_mut()) {
        shown.light_at(gpu.moment_serial);
    }
    let needed = std::mem::take(&mut gpu.needed);
    gpu.list_stale(&needed, &queue);
    gpu.needed = needed;
}
