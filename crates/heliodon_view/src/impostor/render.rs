//! Impostors on the GPU: a texture and a uniform for each kind, two buffers for all people and for what a head sees of them, and one pass a camera.

use super::uniform::{KIND_BYTES, KindUniform, PERSON_BYTES, SEEN_BYTES};
use super::{Head, IMPOSTOR_WGSL, ImpostorsFrame, Kind};
use crate::covering::MARK;
use crate::daylight::pipelines::{StagePipelines, resolved};
use crate::daylight::prepare::StageGpu;
use crate::film::FilmsGpu;
use crate::over_stone::{
    BOX_STRIP, BoundCamera, CAMERA_WGSL, CameraLayouts, DrawnView, Grown, QUAD_CORNERS, Seen, SeenCamera, begin, begin_solid,
};
use crate::particles::render::AirGpu;
use crate::stage::frame::StageFrame;
use crate::tonemap::DisplayKey;
use bevy::core_pipeline::core_3d::Transparent3d;
use bevy::ecs::system::SystemParam;
use bevy::prelude::*;
use bevy::render::render_phase::ViewSortedRenderPhases;
use bevy::render::render_resource::binding_types::{
    sampler, storage_buffer_read_only_sized, texture_2d_array, uniform_buffer_sized,
};
use bevy::render::render_resource::*;
use bevy::render::renderer::{RenderContext, RenderDevice, RenderQueue, ViewQuery};
use bevy::render::view::ExtractedView;
use heliodon_image::decode_bc7;
use std::collections::HashMap;
use std::num::NonZeroU64;
use std::ops::Range;

/// What a pipeline is made for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ImpostorKey {
    /// What its target shows.
    pub display: DisplayKey,
    /// Whether its target has several samples a pixel.
    pub samples: u32,
    /// How many times views are looked for by their depths.
    pub steps: u32,
    /// What it draws.
    pub draws: Draws,
}

/// What of people is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Draws {
    /// What they cast.
    Shadows,
    /// What they look like.
    Looks,
    /// Where they are, for what is drawn later.
    Solids,
}

impl ImpostorKey {
    /// The shader's whole text.
    #[must_use]
    pub fn wgsl(self) -> String {
        let defined = [("ONE_SAMPLE", self.samples == 1), ("MANY_SAMPLES", self.samples > 1)];
        let [red, green, blue] = MARK.to_array();
        format!(
            "{}const STEPS: u32 = {}u;\nconst MARK: vec3<f32> = vec3<f32>({red:?}, {green:?}, {blue:?});\n{}",
            self.display.wgsl(),
            self.steps,
            resolved(&format!("{CAMERA_WGSL}{IMPOSTOR_WGSL}"), &defined)
        )
    }
}

/// Render world: the impostors.
#[derive(Resource, Default)]
pub struct ImpostorsGpu {
    serial: u64,
    kinds: Vec<BindGroup>,
    people: Option<Grown>,
    heads: Vec<HeadGpu>,
    cameras: HashMap<Entity, CameraGpu>,
    layouts: Option<Layouts>,
    made: HashMap<ImpostorKey, CachedRenderPipelineId>,
    casters: u32,
    /// The strip around a shadow's volume.
    strip: Option<Buffer>,
}

struct Layouts {
    camera: CameraLayouts,
    people: BindGroupLayoutDescriptor,
    kind: BindGroupLayoutDescriptor,
}

struct HeadGpu {
    order: Grown,
    group: BindGroup,
    runs: Vec<(usize, Range<u32>)>,
}

struct CameraGpu {
    head: usize,
    /// Of shadows, of people, and of where they are.
    pipelines: [CachedRenderPipelineId; 3],
    bound: BoundCamera,
}

impl Default for Layouts {
    fn default() -> Self {
        let uniform = |bytes: usize| uniform_buffer_sized(false, NonZeroU64::new(bytes as u64));
        let storage = |bytes: usize| storage_buffer_read_only_sized(false, NonZeroU64::new(bytes as u64));
        let both = ShaderStages::VERTEX_FRAGMENT;
        Self {
            camera: CameraLayouts::default(),
            people: BindGroupLayoutDescriptor::new(
                "impostor_people",
                &BindGroupLayoutEntries::sequential(ShaderStages::VERTEX, (storage(PERSON_BYTES), storage(SEEN_BYTES))),
            ),
            kind: BindGroupLayoutDescriptor::new(
                "impostor_kind",
                &BindGroupLayoutEntries::sequential(
                    both,
                    (
                        uniform(KIND_BYTES),
                        texture_2d_array(TextureSampleType::Float { filterable: true }),
                        sampler(SamplerBindingType::Filtering),
                    ),
                ),
            ),
        }
    }
}

/// Takes the frame's impostors to the GPU.
#[expect(clippy::too_many_arguments, reason = "a system's arguments are its resources")]
pub fn prepare(
    frame: Res<ImpostorsFrame>,
    (stage, stone): (Res<StageFrame>, Res<StageGpu>),
    mut gpu: ResMut<ImpostorsGpu>,
    mut pipelines: ResMut<StagePipelines>,
    mut cache: ResMut<PipelineCache>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
    cameras: Query<SeenCamera>,
) {
    let gpu = &mut *gpu;
    if gpu.serial != frame.serial {
        *gpu = ImpostorsGpu {
            serial: frame.serial,
            made: std::mem::take(&mut gpu.made),
            layouts: gpu.layouts.take(),
            ..default()
        };
    }
    if frame.people.is_empty() || frame.heads.is_empty() {
        gpu.heads.clear();
        return;
    }
    let layouts = gpu.layouts.get_or_insert_with(Layouts::default);
    if gpu.kinds.len() != frame.kinds.len() {
        let layout = cache.get_bind_group_layout(&layouts.kind);
        gpu.kinds = frame.kinds.iter().map(|kind| upload((&device, &queue), &layout, kind, stone.software)).collect();
    }
    let people = Grown::write(gpu.people.take(), &device, &queue, "impostor_people", bytemuck::cast_slice(&frame.people));
    let layout = cache.get_bind_group_layout(&layouts.people);
    let mut before = std::mem::take(&mut gpu.heads).into_iter();
    gpu.heads = frame
        .heads
        .iter()
        .map(|Head { order, runs, .. }| {
            let kept = before.next().map(|head| head.order);
            let order = Grown::write(kept, &device, &queue, "impostor_order", bytemuck::cast_slice(order));
            let (people, seen) = (people.buffer.as_entire_binding(), order.buffer.as_entire_binding());
            let group = device.create_bind_group("impostor_people", &layout, &BindGroupEntries::sequential((people, seen)));
            HeadGpu { order, group, runs: runs.clone() }
        })
        .collect();
    gpu.people = Some(people);
    gpu.strip.get_or_insert_with(|| {
        let contents = bytemuck::cast_slice(&BOX_STRIP);
        let usage = BufferUsages::INDEX;
        device.create_buffer_with_data(&BufferInitDescriptor { label: Some("impostor_shadows"), contents, usage })
    });
    gpu.casters = frame.options.casters;
    let mut before = std::mem::take(&mut gpu.cameras);
    for camera in &cameras {
        let Some(seen) = Seen::new(camera, stage.curve) else { continue };
        let (entity, main) = seen.entities;
        let Some(head) = frame.heads.iter().position(|head| head.cameras.contains(&main)) else { continue };
        let found = [Draws::Shadows, Draws::Looks, Draws::Solids].map(|draws| {
            let key = ImpostorKey { display: seen.display, samples: seen.samples, steps: frame.options.steps.min(3), draws };
            *gpu.made.entry(key).or_insert_with(|| queue_pipeline(&mut cache, &mut pipelines, layouts, key))
        });
        let uniform = seen.uniform.under(frame.sun.0, frame.sun.1, frame.shadow);
        let before = before.remove(&entity).map(|camera| camera.bound);
        let bound = BoundCamera::write(before, (&device, &queue), &cache, &layouts.camera, (&seen, &uniform));
        gpu.cameras.insert(entity, CameraGpu { head, pipelines: found, bound });
    }
}

fn queue_pipeline(
    cache: &mut PipelineCache,
    pipelines: &mut StagePipelines,
    layouts: &Layouts,
    key: ImpostorKey,
) -> CachedRenderPipelineId {
    let shader = pipelines.shader(cache, key.wgsl(), "impostor");
    let camera = match key.draws {
        Draws::Solids => layouts.camera.solid.clone(),
        _ => layouts.camera.over[usize::from(key.samples > 1)].clone(),
    };
    let multiplied =
        BlendComponent { src_factor: BlendFactor::Dst, dst_factor: BlendFactor::Zero, operation: BlendOperation::Add };
    let (entries, blend) = match key.draws {
        Draws::Shadows => (["shadow_vertex", "shadow_fragment"], Some(BlendState { color: multiplied, alpha: multiplied })),
        Draws::Looks => (["vertex", "fragment"], Some(BlendState::ALPHA_BLENDING)),
        Draws::Solids => (["solid_vertex", "solid_fragment"], None),
    };
    let target = |blend| ColorTargetState {
        format: key.display.format,
        blend: Some(blend),
        // what is opaque below stays it
        write_mask: ColorWrites::COLOR,
    };
    let shadows = key.draws == Draws::Shadows;
    cache.queue_render_pipeline(RenderPipelineDescriptor {
        label: Some("impostors".into()),
        layout: vec![camera, layouts.people.clone(), layouts.kind.clone()],
        vertex: VertexState { shader: shader.clone(), entry_point: Some(entries[0].into()), ..default() },
        primitive: PrimitiveState {
            topology: PrimitiveTopology::TriangleStrip,
            strip_index_format: shadows.then_some(IndexFormat::Uint16),
            // of the shadow's box the far side, which is there also for who stands within
            cull_mode: shadows.then_some(Face::Front),
            ..default()
        },
        depth_stencil: Some(DepthStencilState {
            format: bevy::core_pipeline::core_3d::CORE_3D_DEPTH_FORMAT,
            depth_write_enabled: Some(key.draws == Draws::Solids),
            depth_compare: Some(if shadows { CompareFunction::LessEqual } else { CompareFunction::GreaterEqual }),
            stencil: StencilState::default(),
            bias: DepthBiasState::default(),
        }),
        multisample: MultisampleState { count: key.samples, ..default() },
        fragment: Some(FragmentState {
            shader,
            entry_point: Some(entries[1].into()),
            targets: blend.into_iter().map(|blend| Some(target(blend))).collect(),
            ..default()
        }),
        ..default()
    })
}

/// An impostor's texture and uniform: blocks as they are, or unpacked for devices that take none and for those that read them slowly.
fn upload((device, queue): (&RenderDevice, &RenderQueue), layout: &BindGroupLayout, kind: &Kind, software: bool) -> BindGroup {
    let (info, texture) = (&kind.impostor.info, &kind.impostor.texture);
    let packed = device.features().contains(WgpuFeatures::TEXTURE_COMPRESSION_BC) && !software;
    let format = if packed { TextureFormat::Bc7RgbaUnorm } else { TextureFormat::Rgba8Unorm };
    let levels = texture.levels.len() as u32;
    let on_gpu = device.create_texture(&TextureDescriptor {
        label: Some("impostor"),
        size: Extent3d { width: texture.width, height: texture.height, depth_or_array_layers: texture.layers },
        mip_level_count: levels,
        sample_count: 1,
        dimension: TextureDimension::D2,
        format,
        usage: TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_DST,
        view_formats: &[],
    });
    for (level, blocks) in texture.levels.iter().enumerate() {
        let [width, height] = [texture.width >> level, texture.height >> level];
        let layer_bytes = blocks.len() / texture.layers as usize;
        for (layer, blocks) in blocks.chunks_exact(layer_bytes).enumerate() {
            let unpacked = if packed { Vec::new() } else { decode_bc7(blocks, width, height) };
            let (bytes, row): (&[u8], u32) =
                if packed { (blocks, width.div_ceil(4) * 16) } else { (bytemuck::cast_slice(&unpacked), width * 4) };
            queue.write_texture(
                TexelCopyTextureInfo {
                    texture: &on_gpu,
                    mip_level: level as u32,
                    origin: Origin3d { x: 0, y: 0, z: layer as u32 },
                    aspect: TextureAspect::All,
                },
                bytes,
                TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row), rows_per_image: None },
                Extent3d { width, height, depth_or_array_layers: 1 },
            );
        }
    }
    let view = on_gpu.create_view(&TextureViewDescriptor { dimension: Some(TextureViewDimension::D2Array), ..default() });
    let sampler = device.create_sampler(&SamplerDescriptor {
        label: Some("impostor"),
        mag_filter: FilterMode::Linear,
        min_filter: FilterMode::Linear,
        // between two levels a processor takes twice as long
        mipmap_filter: if software { MipmapFilterMode::Nearest } else { MipmapFilterMode::Linear },
        ..default()
    });
    let uniform = KindUniform::new(info, levels);
    let contents = bytemuck::bytes_of(&uniform);
    let descriptor = BufferInitDescriptor { label: Some("impostor_kind"), contents, usage: BufferUsages::UNIFORM };
    let uniform = device.create_buffer_with_data(&descriptor);
    let entries = BindGroupEntries::sequential((uniform.as_entire_binding(), &view, &sampler));
    device.create_bind_group("impostor_kind", layout, &entries)
}

/// What is drawn after people and asks for depth: films, the air, and whatever else is transparent.
#[derive(SystemParam)]
pub struct DrawnLater<'w> {
    films: Option<Res<'w, FilmsGpu>>,
    air: Option<Res<'w, AirGpu>>,
    transparent: Option<Res<'w, ViewSortedRenderPhases<Transparent3d>>>,
}

impl DrawnLater<'_> {
    /// Whether a camera sees any of it.
    fn is_there(&self, entity: Entity, view: &ExtractedView) -> bool {
        let transparent = || self.transparent.as_ref()?.get(&view.retained_view_entity).map(|phase| !phase.items.is_empty());
        self.films.as_ref().is_some_and(|films| films.has_any(entity))
            || self.air.as_ref().is_some_and(|air| air.has_any(entity))
            || transparent().unwrap_or(false)
    }
}

/// Draws what the current camera sees of them; into its depth too, where that is asked for later: on software Vulkan that costs as much as a tenth of the frame.
pub fn draw(
    view: ViewQuery<(DrawnView, &ExtractedView)>,
    gpu: Res<ImpostorsGpu>,
    later: DrawnLater,
    cache: Res<PipelineCache>,
    mut context: RenderContext,
) {
    let entity = view.entity();
    let (seen, extracted) = view.into_inner();
    let Some(own) = gpu.cameras.get(&entity) else { return };
    let [Some(shadows), Some(people), Some(solids)] = own.pipelines.map(|id| cache.get_render_pipeline(id)) else { return };
    let Some(head) = gpu.heads.get(own.head) else { return };
    // the nearest come last
    let nearest = |pass: &mut wgpu::RenderPass, pipeline: &RenderPipeline, strip: Option<&Buffer>, most: u32| {
        let first = head.runs.last().map_or(0, |(_, run)| run.end.saturating_sub(most));
        pass.set_pipeline(pipeline);
        if let Some(strip) = strip {
            pass.set_index_buffer(*strip.slice(..), IndexFormat::Uint16);
        }
        for (kind, run) in head.runs.iter().filter(|(_, run)| run.end > first) {
            let Some(kind) = gpu.kinds.get(*kind) else { continue };
            pass.set_bind_group(2, &**kind, &[]);
            let run = run.start.max(first)..run.end;
            match strip {
                Some(_) => pass.draw_indexed(0..BOX_STRIP.len() as u32, 0, run),
                None => pass.draw(0..QUAD_CORNERS, run),
            }
        }
    };
    let (camera, _, depth, resolution) = seen;
    {
        let mut pass = begin(&mut context, "impostors", seen);
        pass.set_bind_group(0, &*own.bound.over, &[]);
        pass.set_bind_group(1, &*head.group, &[]);
        if gpu.strip.is_some() {
            nearest(&mut pass, shadows, gpu.strip.as_ref(), gpu.casters);
        }
        nearest(&mut pass, people, None, u32::MAX);
    }
    if !later.is_there(entity, extracted) {
        return;
    }
    let mut pass = begin_solid(&mut context, "impostor_solids", (camera, depth, resolution));
    pass.set_bind_group(0, &*own.bound.solid, &[]);
    pass.set_bind_group(1, &*head.group, &[]);
    nearest(&mut pass, solids, None, u32::MAX);
}
