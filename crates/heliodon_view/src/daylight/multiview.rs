//! Both eyes of a head in one traversal: stone, actors and sky are drawn once, into two layers, and the device sets each vertex for either eye (multiview).
//!
//! Bevy's own passes have one view each, and what they draw (guests, the head-up display) comes afterwards, eye by eye. So the layers are ours, and
//! each eye is handed its own, colour and depth, sample by sample. Where a pair cannot be drawn so, each eye has its pass.

use super::StereoPair;
use super::pipelines::{PipelineKey, resolved};
use super::view::{VIEW_BYTES, ViewUniform};
use crate::covering::uniform::COVERS_BYTES;
use bevy::camera::{ClearColorConfig, MainPassResolutionOverride};
use bevy::core_pipeline::core_3d::CORE_3D_DEPTH_FORMAT;
use bevy::ecs::entity::Entity;
use bevy::prelude::{Color, Msaa, Resource, UVec2};
use bevy::render::camera::ExtractedCamera;
use bevy::render::extract_resource::ExtractResource;
use bevy::render::render_resource::binding_types::{
    texture_2d, texture_2d_multisampled, texture_depth_2d, texture_depth_2d_multisampled, uniform_buffer_sized,
};
use bevy::render::render_resource::*;
use bevy::render::renderer::{RenderDevice, RenderQueue};
use bevy::render::view::{ExtractedView, ViewDepthTexture};
use bevy::tasks::futures::check_ready;
use bevy::tasks::{AsyncComputeTaskPool, Task};
use heliodon_bundle::display::Passes;
use std::collections::HashMap;
use std::num::{NonZeroU32, NonZeroU64};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Both layers.
pub const BOTH: NonZeroU32 = NonZeroU32::new(0b11).unwrap();

/// In how many passes the two cameras of a [`StereoPair`] are drawn.
#[derive(Resource, ExtractResource, Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StereoPasses(pub Passes);

impl StereoPasses {
    /// Whether it is one on this device, which is a processor if it is `software`, with so many samples a pixel.
    #[must_use]
    pub fn is_one(self, device: &RenderDevice, software: bool, samples: u32) -> bool {
        let several = if samples > 1 { WgpuFeatures::MULTISAMPLE_ARRAY } else { WgpuFeatures::empty() };
        let can =
            device.features().contains(WgpuFeatures::MULTIVIEW | several) && device.limits().max_multiview_view_count >= 2;
        can && match self.0 {
            Passes::Auto => !software,
            Passes::One => true,
            Passes::Two => false,
        }
    }
}

/// How many pairs were drawn in one pass in the last frame.
#[derive(Resource, Clone, Debug, Default)]
pub struct OnePassPairs(Arc<AtomicUsize>);

impl OnePassPairs {
    /// Their number.
    #[must_use]
    pub fn count(&self) -> usize {
        self.0.load(Ordering::Relaxed)
    }

    pub(super) fn tell(&self, count: usize) {
        self.0.store(count, Ordering::Relaxed);
    }
}

/// The shader that hands an eye its layer.
#[must_use]
pub fn layer_wgsl(several_samples: bool) -> String {
    resolved(include_str!("layer.wgsl"), &[("SAMPLES", several_samples), ("ONE_SAMPLE", !several_samples)])
}

/// What both cameras of a pair must have in common to be drawn in one pass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EyeCanvas {
    size: UVec2,
    format: TextureFormat,
    samples: u32,
    /// The camera's own colour where there is nothing.
    clear: Option<Color>,
}

impl EyeCanvas {
    /// A camera's; `None` for one that draws on a part of its picture, or on what others drew.
    #[must_use]
    pub fn new(
        camera: &ExtractedCamera,
        view: &ExtractedView,
        msaa: Msaa,
        resolution: Option<&MainPassResolutionOverride>,
    ) -> Option<Self> {
        let clear = match camera.clear_color {
            ClearColorConfig::Default => None,
            ClearColorConfig::Custom(color) => Some(color),
            ClearColorConfig::None => return None,
        };
        let whole = camera.viewport.is_none() && resolution.is_none();
        let size = camera.physical_target_size.filter(|_| whole)?;
        Some(Self { size, format: view.target_format, samples: msaa.samples(), clear })
    }

    /// Samples a pixel.
    #[must_use]
    pub fn samples(&self) -> u32 {
        self.samples
    }
}

/// Two layers, and how each is read.
struct Layers {
    array: TextureView,
    each: [TextureView; 2],
}

impl Layers {
    fn new(device: &RenderDevice, label: &str, canvas: &EyeCanvas, format: TextureFormat) -> Self {
        let texture = device.wgpu_device().create_texture(&TextureDescriptor {
            label: Some(label),
            size: Extent3d { width: canvas.size.x, height: canvas.size.y, depth_or_array_layers: 2 },
            mip_level_count: 1,
            sample_count: canvas.samples,
            dimension: TextureDimension::D2,
            format,
            usage: TextureUsages::RENDER_ATTACHMENT | TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        });
        let view = |dimension, base_array_layer, layers| {
            let descriptor = TextureViewDescriptor {
                dimension: Some(dimension),
                base_array_layer,
                array_layer_count: Some(layers),
                ..TextureViewDescriptor::default()
            };
            TextureView::from(texture.create_view(&descriptor))
        };
        Self {
            array: view(TextureViewDimension::D2Array, 0, 2),
            each: [0, 1].map(|layer| view(TextureViewDimension::D2, layer, 1)),
        }
    }
}

/// A pair that is drawn in one pass.
pub struct BothEyes {
    cameras: [Entity; 2],
    canvas: EyeCanvas,
    color: Layers,
    depth: Layers,
    views: Buffer,
    view_group: BindGroup,
    layer_groups: [BindGroup; 2],
    /// What hands an eye its layer.
    pub layer_pipeline: CachedRenderPipelineId,
    /// Whether the layers are this frame's.
    pub drawn: bool,
}

impl BothEyes {
    fn new(
        device: &RenderDevice,
        cache: &PipelineCache,
        pipelines: &BothEyesPipelines,
        (cameras, canvas): ([Entity; 2], EyeCanvas),
        covers: &Buffer,
        layer_pipeline: CachedRenderPipelineId,
    ) -> Self {
        let color = Layers::new(device, "both_eyes_color", &canvas, canvas.format);
        let depth = Layers::new(device, "both_eyes_depth", &canvas, CORE_3D_DEPTH_FORMAT);
        let views = device.create_buffer(&BufferDescriptor {
            label: Some("both_eyes_views"),
            size: 2 * VIEW_BYTES as u64,
            usage: BufferUsages::UNIFORM | BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let entries = BindGroupEntries::sequential((views.as_entire_buffer_binding(), covers.as_entire_buffer_binding()));
        let view_group =
            device.create_bind_group("both_eyes_views", &cache.get_bind_group_layout(&pipelines.views_layout), &entries);
        let layout = cache.get_bind_group_layout(pipelines.layer_layout(canvas.samples));
        let layer_groups = [0, 1].map(|eye: usize| {
            let entries = BindGroupEntries::sequential((&color.each[eye], &depth.each[eye]));
            device.create_bind_group("eye_layer", &layout, &entries)
        });
        Self { cameras, canvas, color, depth, views, view_group, layer_groups, layer_pipeline, drawn: false }
    }

    /// The camera whose draws are both cameras'.
    #[must_use]
    pub fn first(&self) -> Entity {
        self.cameras[0]
    }

    /// Both cameras' uniforms.
    #[must_use]
    pub fn view_group(&self) -> &BindGroup {
        &self.view_group
    }

    /// What a pass draws to; the first of a frame begins with a colour where there is nothing.
    #[must_use]
    pub fn attachments(
        &self,
        begin: Option<wgpu::Color>,
    ) -> (RenderPassColorAttachment<'_>, RenderPassDepthStencilAttachment<'_>) {
        let load = begin.map_or(LoadOp::Load, LoadOp::Clear);
        let color = RenderPassColorAttachment {
            view: &self.color.array,
            depth_slice: None,
            resolve_target: None,
            ops: Operations { load, store: StoreOp::Store },
        };
        let depth_ops = Operations { load: begin.map_or(LoadOp::Load, |_| LoadOp::Clear(0.0)), store: StoreOp::Store };
        let depth = RenderPassDepthStencilAttachment { view: &self.depth.array, depth_ops: Some(depth_ops), stencil_ops: None };
        (color, depth)
    }

    /// Hands an eye its layer, once the pipeline for that is there.
    pub fn hand_out(
        &self,
        encoder: &mut CommandEncoder,
        layer: usize,
        pipeline: Option<&RenderPipeline>,
        color: RenderPassColorAttachment<'_>,
        depth: &ViewDepthTexture,
    ) {
        let mut pass = encoder.begin_render_pass(&RenderPassDescriptor {
            label: Some("eye_layer"),
            color_attachments: &[Some(color)],
            depth_stencil_attachment: Some(depth.get_attachment(StoreOp::Store)),
            timestamp_writes: None,
            occlusion_query_set: None,
            multiview_mask: None,
        });
        if let Some(pipeline) = pipeline {
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, &*self.layer_groups[layer], &[]);
            pass.draw(0..3, 0..1);
        }
    }
}

/// The pairs that are drawn in one pass.
#[derive(Default)]
pub struct Multiview {
    pairs: HashMap<StereoPair, BothEyes>,
    layers: HashMap<Entity, (StereoPair, usize)>,
}

impl Multiview {
    /// A frame begins with these cameras of pairs, which `can` be drawn in one pass if they agree; `layer` makes the pipeline that hands out a layer.
    pub fn begin(
        &mut self,
        device: &RenderDevice,
        (cache, pipelines): (&mut PipelineCache, &mut super::pipelines::StagePipelines),
        covers: &Buffer,
        cameras: impl Iterator<Item = (StereoPair, Entity, Option<EyeCanvas>)>,
        can: impl Fn(u32) -> bool,
    ) {
        let mut found: HashMap<StereoPair, Vec<(Entity, Option<EyeCanvas>)>> = HashMap::new();
        for (pair, camera, canvas) in cameras {
            found.entry(pair).or_default().push((camera, canvas));
        }
        self.layers.clear();
        let mut before = std::mem::take(&mut self.pairs);
        for (pair, cameras) in found {
            let [(left, Some(canvas)), (right, other)] = cameras[..] else { continue };
            if other != Some(canvas) || !can(canvas.samples) {
                continue;
            }
            let wanted = ([left, right], canvas);
            let mut eyes = before.remove(&pair).filter(|eyes| (eyes.cameras, eyes.canvas) == wanted).unwrap_or_else(|| {
                let layer = pipelines.layer(cache, canvas.format, canvas.samples);
                BothEyes::new(device, cache, &pipelines.both_eyes, wanted, covers, layer)
            });
            eyes.drawn = false;
            self.layers.extend([(left, (pair, 0)), (right, (pair, 1))]);
            self.pairs.insert(pair, eyes);
        }
    }

    /// How many pairs were drawn since the frame began.
    #[must_use]
    pub fn drawn(&self) -> usize {
        self.pairs.values().filter(|eyes| eyes.drawn).count()
    }

    /// Which layer of its pair a camera has: `None` for one that is drawn alone.
    #[must_use]
    pub fn layer(&self, camera: Entity) -> Option<usize> {
        self.layers.get(&camera).map(|&(_, layer)| layer)
    }

    /// A camera's pair, and its layer.
    #[must_use]
    pub fn of(&self, camera: Entity) -> Option<(&BothEyes, usize)> {
        let &(pair, layer) = self.layers.get(&camera)?;
        Some((self.pairs.get(&pair)?, layer))
    }

    /// The layers of a camera's pair are this frame's.
    pub fn was_drawn(&mut self, camera: Entity) {
        if let Some(eyes) = self.layers.get(&camera).and_then(|(pair, _)| self.pairs.get_mut(pair)) {
            eyes.drawn = true;
        }
    }

    /// Sets a camera's uniform; false for one that is drawn alone.
    pub fn write(&self, queue: &RenderQueue, camera: Entity, uniform: &ViewUniform) -> bool {
        let Some((pair, layer)) = self.layers.get(&camera) else { return false };
        if let Some(eyes) = self.pairs.get(pair) {
            queue.write_buffer(&eyes.views, (layer * VIEW_BYTES) as u64, bytemuck::bytes_of(uniform));
        }
        true
    }
}

/// Colour pipelines for both eyes at once. Bevy's cache makes none such.
pub struct BothEyesPipelines {
    /// Both cameras' uniforms, and what is worn.
    pub views_layout: BindGroupLayoutDescriptor,
    /// A layer's colour and depth, of one sample a pixel and of several.
    layer_layouts: [BindGroupLayoutDescriptor; 2],
    made: HashMap<PipelineKey, Made>,
    /// Made when they are asked for, for pictures that must show all there is, and not in the background.
    pub at_once: bool,
}

/// A pipeline, or its making.
enum Made {
    There(RenderPipeline),
    Making(Task<RenderPipeline>),
}

impl Default for BothEyesPipelines {
    fn default() -> Self {
        let views = uniform_buffer_sized(false, NonZeroU64::new(2 * VIEW_BYTES as u64));
        let covers = uniform_buffer_sized(false, NonZeroU64::new(COVERS_BYTES as u64));
        let exact = TextureSampleType::Float { filterable: false };
        let several = texture_depth_2d_multisampled();
        Self {
            views_layout: BindGroupLayoutDescriptor::new(
                "both_eyes_views",
                &BindGroupLayoutEntries::sequential(ShaderStages::VERTEX_FRAGMENT, (views, covers)),
            ),
            layer_layouts: [
                BindGroupLayoutDescriptor::new(
                    "eye_layer",
                    &BindGroupLayoutEntries::sequential(ShaderStages::FRAGMENT, (texture_2d(exact), texture_depth_2d())),
                ),
                BindGroupLayoutDescriptor::new(
                    "eye_layer_of_samples",
                    &BindGroupLayoutEntries::sequential(ShaderStages::FRAGMENT, (texture_2d_multisampled(exact), several)),
                ),
            ],
            made: HashMap::new(),
            at_once: false,
        }
    }
}

impl BothEyesPipelines {
    /// The layout of what hands out a layer.
    #[must_use]
    pub fn layer_layout(&self, samples: u32) -> &BindGroupLayoutDescriptor {
        &self.layer_layouts[usize::from(samples > 1)]
    }

    /// Whether a pipeline is there or being made; takes what has been made.
    pub fn has(&mut self, key: PipelineKey) -> bool {
        let Some(made) = self.made.get_mut(&key) else { return false };
        if let Made::Making(task) = made
            && let Some(pipeline) = check_ready(task)
        {
            *made = Made::There(pipeline);
        }
        true
    }

    /// A pipeline that is there.
    #[must_use]
    pub fn get(&self, key: PipelineKey) -> Option<&RenderPipeline> {
        match self.made.get(&key)? {
            Made::There(pipeline) => Some(pipeline),
            Made::Making(_) => None,
        }
    }

    /// Makes a pipeline. `descriptor` is all of it but the shader, which is the key's.
    pub fn make(
        &mut self,
        cache: &PipelineCache,
        device: &RenderDevice,
        key: PipelineKey,
        descriptor: RenderPipelineDescriptor,
    ) {
        let groups: Vec<BindGroupLayout> = descriptor.layout.iter().map(|group| cache.get_bind_group_layout(group)).collect();
        let made = if self.at_once {
            Made::There(create(device, key, &groups, &descriptor))
        } else {
            let device = device.clone();
            Made::Making(AsyncComputeTaskPool::get().spawn(async move { create(&device, key, &groups, &descriptor) }))
        };
        self.made.insert(key, made);
    }
}

/// The pipeline of a key.
fn create(
    device: &RenderDevice,
    key: PipelineKey,
    groups: &[BindGroupLayout],
    descriptor: &RenderPipelineDescriptor,
) -> RenderPipeline {
    let module = device.create_and_validate_shader_module(ShaderModuleDescriptor {
        label: Some("both_eyes"),
        source: ShaderSource::Wgsl(key.wgsl().into()),
    });
    let layout = device.create_pipeline_layout(&PipelineLayoutDescriptor {
        label: Some("both_eyes"),
        bind_group_layouts: &groups.iter().map(|group| Some(&**group)).collect::<Vec<_>>(),
        ..PipelineLayoutDescriptor::default()
    });
    let buffers: Vec<RawVertexBufferLayout<'_>> = descriptor
        .vertex
        .buffers
        .iter()
        .map(|buffer| RawVertexBufferLayout {
            array_stride: buffer.array_stride,
            step_mode: buffer.step_mode,
            attributes: &buffer.attributes,
        })
        .collect();
    device.create_render_pipeline(&RawRenderPipelineDescriptor {
        label: descriptor.label.as_deref(),
        layout: Some(&layout),
        vertex: RawVertexState {
            module: &module,
            entry_point: descriptor.vertex.entry_point.as_deref(),
            compilation_options: PipelineCompilationOptions::default(),
            buffers: &buffers,
        },
        primitive: descriptor.primitive,
        depth_stencil: descriptor.depth_stencil.clone(),
        multisample: descriptor.multisample,
        fragment: descriptor.fragment.as_ref().map(|fragment| RawFragmentState {
            module: &module,
            entry_point: fragment.entry_point.as_deref(),
            compilation_options: PipelineCompilationOptions::default(),
            targets: &fragment.targets,
        }),
        multiview_mask: Some(BOTH),
        cache: None,
    })
}
