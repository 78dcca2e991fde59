//! What is in the air on the GPU: a buffer of quads for all, their order for each head, and three passes a camera.
//!
//! The stone's shaders write what the display shows, so quads cannot be blended with it as light. They are drawn into pictures of their own, as light, and one pass lays those over the
//! camera's picture where there is any, taking display values back to light and again to display values. It is as exact as eight bits are, for any tone curve, and
//! leaves out what no quad may touch. Haze is nowhere sharp but where it meets the stone: it has a coarse picture, out of which that pass takes for every pixel what was seen before a like depth
//! (J. Kopf et al., "Joint Bilateral Upsampling", SIGGRAPH 2007).

use super::quad::{FORWARD, LEAST_PX, QUAD_BYTES, Quad};
use super::sun_map::{OPEN, SunMap};
use super::swarm::{SwarmShown, SwarmUnready};
use crate::daylight::pipelines::{StagePipelines, resolved};
use crate::daylight::prepare::StageGpu;
use crate::lamps::LAMPS_SHARED_WGSL;
use crate::lamps::maps::LampsGpu;
use crate::lamps::uniform::LAMPS_BYTES;
use crate::over_stone::{CAMERA_BYTES, CAMERA_WGSL, Grown, Seen, SeenCamera};
use crate::stage::frame::StageFrame;
use crate::tonemap::DisplayKey;
use bevy::camera::MainPassResolutionOverride;
use bevy::prelude::*;
use bevy::render::extract_resource::ExtractResource;
use bevy::render::render_resource::binding_types::{
    sampler, storage_buffer_read_only_sized, texture_2d, texture_depth_2d, texture_depth_2d_multisampled, uniform_buffer_sized,
};
use bevy::render::render_resource::*;
use bevy::render::renderer::{RenderContext, RenderDevice, RenderQueue, ViewQuery};
use bevy::render::view::ViewTarget;
use bytemuck::{Pod, Zeroable};
use std::collections::HashMap;
use std::num::NonZeroU64;
use std::ops::Range;
use std::sync::Arc;

const AIR_WGSL: &str = include_str!("air.wgsl");
const LAMPS_WGSL: &str = include_str!("lamps.wgsl");
const COMPOSE_WGSL: &str = include_str!("compose.wgsl");

/// Pixels of the picture in one of the air's along each side, where a processor draws and the eye moves.
const COARSE: u32 = 3;
/// The same of the haze's, where a processor draws and where a GPU does.
const HAZE_COARSE: [u32; 2] = [3, 2];

/// The shader that draws quads, for depths with one sample a pixel or with several, and where lamps light any of them.
#[must_use]
pub fn air_wgsl(samples: u32, lamps: bool) -> String {
    let of_lamps = if lamps { [LAMPS_SHARED_WGSL, LAMPS_WGSL].concat() } else { String::new() };
    let constants = format!("const LEAST_PX: f32 = {LEAST_PX:?};\nconst FORWARD: f32 = {FORWARD:?};\n");
    let defined = [("ONE_SAMPLE", samples == 1), ("MANY_SAMPLES", samples > 1), ("LAMPS", lamps)];
    resolved(&format!("{CAMERA_WGSL}{of_lamps}{constants}{AIR_WGSL}"), &defined)
}

/// The shader that lays them over the picture, for depths with one sample a pixel or with several.
#[must_use]
pub fn compose_wgsl(display: DisplayKey, samples: u32) -> String {
    let defined = [("ONE_SAMPLE", samples == 1), ("MANY_SAMPLES", samples > 1)];
    format!("{}{}", display.wgsl(), resolved(&format!("{CAMERA_WGSL}{COMPOSE_WGSL}"), &defined))
}

/// What the render world is told of a frame's air.
#[derive(Resource, Clone, Default, ExtractResource)]
pub struct AirFrame {
    /// All quads.
    pub quads: Arc<Vec<Quad>>,
    /// Boxes around them, by source.
    pub boxes: Arc<Vec<(Vec3, Vec3)>>,
    /// What each head sees.
    pub heads: Arc<Vec<AirHead>>,
    /// Where the sun shines.
    pub maps: Vec<Arc<SunMap>>,
    /// Direction to the sun.
    pub sun_direction: Vec3,
    /// Whether pictures are to be as fine as they can be.
    pub fine: bool,
    /// Swarms in sight.
    pub swarms: Arc<Vec<SwarmShown>>,
    /// Swarms, in sight or not, that are not shown yet.
    pub unready: Arc<Vec<SwarmUnready>>,
}

/// What a head sees.
#[derive(Clone, Debug, Default)]
pub struct AirHead {
    /// Its eyes.
    pub cameras: Vec<Entity>,
    /// Numbers of quads: those of haze, then others from the farthest on.
    pub order: Vec<u32>,
    /// How many are of haze.
    pub haze: u32,
}

/// `Map` of air.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
struct MapUniform {
    rows: [Vec4; 3],
    size: [u32; 4],
}

/// Size of `Map`.
pub const MAP_BYTES: usize = size_of::<MapUniform>();

/// Render world: the air.
#[derive(Resource, Default)]
pub struct AirGpu {
    layouts: Option<Layouts>,
    buffers: [Option<Grown>; 3],
    /// The maps that `buffers` hold.
    maps: Vec<Arc<SunMap>>,
    heads: Vec<HeadGpu>,
    cameras: HashMap<Entity, CameraGpu>,
    /// By samples of a pixel, and whether there are lamps.
    quads: HashMap<(u32, bool), CachedRenderPipelineId>,
    /// What is bound of the lamps, and its number among what [`LampsGpu`] had so far.
    lamps: Option<(u64, BindGroup)>,
    /// Whether they light any of it in this frame.
    under_lamps: bool,
    compose: HashMap<(DisplayKey, u32), CachedRenderPipelineId>,
    sampler: Option<Sampler>,
    /// Whether this frame has swarms, which are drawn before the quads.
    swarms: bool,
}

impl AirGpu {
    /// The picture of light into which swarms are drawn before a camera's quads; its depth is of the same size.
    #[must_use]
    pub fn swarm_layer(&self, camera: Entity) -> Option<&Texture> {
        let own = self.cameras.get(&camera).filter(|own| self.swarms && own.drawn.is_some())?;
        let [_, rest] = &own.layers;
        Some(&rest.light)
    }

    /// Whether a camera sees any of it in this frame.
    #[must_use]
    pub fn has_any(&self, camera: Entity) -> bool {
        self.cameras.get(&camera).is_some_and(|own| own.drawn.is_some())
    }
}

struct Layouts {
    /// A camera of a target with one sample a pixel, and with several.
    camera: [BindGroupLayoutDescriptor; 2],
    quads: BindGroupLayoutDescriptor,
    lamps: BindGroupLayoutDescriptor,
    compose: BindGroupLayoutDescriptor,
}

struct HeadGpu {
    order: Grown,
    group: BindGroup,
    /// Of the order, what is of haze and what is not: see [`Layer`].
    ranges: [Range<u32>; 2],
}

struct CameraGpu {
    uniform: Buffer,
    /// The haze's picture, and that of all else.
    layers: [Layer; 2],
    /// The camera's picture as it was.
    before: Texture,
    compose: BindGroup,
    drawn: Option<Drawn>,
}

/// A picture of some of the air.
struct Layer {
    light: Texture,
    /// Of the shader's `scale`.
    scale: Buffer,
    /// The camera and its depth.
    group: BindGroup,
}

/// What is drawn of a camera in this frame.
#[derive(Clone, Copy)]
struct Drawn {
    head: usize,
    pipelines: [CachedRenderPipelineId; 2],
    /// The part of the main texture that quads may touch, its corner and size, and of each layer's picture.
    part: (UVec2, UVec2),
    layer_parts: [(UVec2, UVec2); 2],
    /// The viewport in each layer's picture.
    viewports: [(Vec2, Vec2); 2],
}

impl Default for Layouts {
    fn default() -> Self {
        let uniform = |bytes: usize| uniform_buffer_sized(false, NonZeroU64::new(bytes as u64));
        let storage = |bytes: usize| storage_buffer_read_only_sized(false, NonZeroU64::new(bytes as u64));
        let both = ShaderStages::VERTEX_FRAGMENT;
        let camera = |depth: BindGroupLayoutEntryBuilder| {
            let entries = BindGroupLayoutEntries::sequential(both, (uniform(CAMERA_BYTES), depth, uniform(16)));
            BindGroupLayoutDescriptor::new("air_camera", &entries)
        };
        Self {
            camera: [camera(texture_depth_2d()), camera(texture_depth_2d_multisampled())],
            quads: BindGroupLayoutDescriptor::new(
                "air_quads",
                &BindGroupLayoutEntries::sequential(both, (storage(QUAD_BYTES), storage(4), storage(MAP_BYTES), storage(4))),
            ),
            lamps: BindGroupLayoutDescriptor::new(
                "air_lamps",
                &BindGroupLayoutEntries::sequential(both, (uniform(LAMPS_BYTES), texture_depth_2d(), texture_depth_2d())),
            ),
            compose: BindGroupLayoutDescriptor::new(
                "air_compose",
                &BindGroupLayoutEntries::sequential(
                    ShaderStages::FRAGMENT,
                    (
                        texture_2d(TextureSampleType::Float { filterable: false }),
                        texture_2d(TextureSampleType::Float { filterable: true }),
                        texture_2d(TextureSampleType::Float { filterable: true }),
                        sampler(SamplerBindingType::Filtering),
                        uniform(16),
                    ),
                ),
            ),
        }
    }
}

/// What of a camera counts beside what all look at that is laid over the stone.
type AirCamera =
    (SeenCamera, &'static ViewTarget, Option<&'static MainPassResolutionOverride>, Has<crate::daylight::ExactAtRest>);

/// Takes the frame's air to the GPU.
pub fn prepare(
    frame: Res<AirFrame>,
    (stage, stone): (Res<StageFrame>, Res<StageGpu>),
    (mut gpu, lamps): (ResMut<AirGpu>, Option<ResMut<LampsGpu>>),
    mut pipelines: ResMut<StagePipelines>,
    mut cache: ResMut<PipelineCache>,
    (device, queue): (Res<RenderDevice>, Res<RenderQueue>),
    cameras: Query<AirCamera>,
) {
    let gpu = &mut *gpu;
    gpu.cameras.values_mut().for_each(|camera| camera.drawn = None);
    gpu.swarms = !frame.swarms.is_empty();
    if (frame.quads.is_empty() && !gpu.swarms) || frame.heads.is_empty() {
        return;
    }
    let both = (&*device, &*queue);
    gpu.write(&frame, both, &cache);
    gpu.bind_lamps(lamps.filter(|_| frame.quads.iter().any(Quad::is_under_lamps)), &device, &cache);
    let under_lamps = gpu.under_lamps;
    gpu.cameras.retain(|entity, _| cameras.contains(*entity));
    for (camera, target, smaller, exact) in &cameras {
        let copied = target.main_texture().usage().contains(TextureUsages::COPY_SRC) && smaller.is_none();
        let Some(seen) = Seen::new(camera, stage.curve).filter(|_| copied) else { continue };
        let ((entity, main), samples, display) = (seen.entities, seen.samples, seen.display);
        let Some(head) = frame.heads.iter().position(|head| head.cameras.contains(&main)) else { continue };
        let Some(part) = touched(&frame.boxes, seen.clip_from_world, seen.corner, seen.size) else { continue };
        let of_rest = if stone.software && !exact && !frame.fine && !gpu.swarms { COARSE } else { 1 };
        let scales = [HAZE_COARSE[usize::from(!stone.software)], of_rest];
        let layouts = gpu.layouts.get_or_insert_with(Layouts::default);
        let found = [
            *gpu.quads
                .entry((samples, under_lamps))
                .or_insert_with(|| queue_quads(&mut cache, &mut pipelines, layouts, (samples, under_lamps))),
            *gpu.compose
                .entry((display, samples))
                .or_insert_with(|| queue_compose(&mut cache, &mut pipelines, layouts, (display, samples))),
        ];
        let uniform = seen.uniform.under(frame.sun_direction, Vec3::ZERO, Vec3::Y);
        let whole = target.main_texture().size();
        let sizes = scales.map(|scale| UVec2::new(whole.width.div_ceil(scale), whole.height.div_ceil(scale)));
        let fits = |camera: &CameraGpu| {
            camera.before.size() == whole
                && camera.before.format() == target.main_texture().format()
                && camera.layers.iter().zip(sizes).all(|(layer, size)| layer.size() == size)
        };
        let sampler = gpu.sampler.get_or_insert_with(|| {
            let (mag_filter, min_filter) = (FilterMode::Linear, FilterMode::Linear);
            device.create_sampler(&SamplerDescriptor { label: Some("air"), mag_filter, min_filter, ..default() })
        });
        let bind = |camera: &Buffer, scale: &Buffer| depth_group(&device, &cache, layouts, &seen, [camera, scale]);
        let mut own = match gpu.cameras.remove(&entity).filter(fits) {
            Some(mut own) => {
                // the depth may be another frame's texture
                own.layers.iter_mut().for_each(|layer| layer.group = bind(&own.uniform, &layer.scale));
                own
            }
            None => CameraGpu::new((&device, &cache), layouts, target.main_texture(), sizes, sampler, bind),
        };
        queue.write_buffer(&own.uniform, 0, bytemuck::bytes_of(&uniform));
        for (layer, scale) in own.layers.iter().zip(scales) {
            let [width, height] = layer.size().as_vec2().to_array();
            let scale = Vec4::new(scale as f32, 1.0 / width, 1.0 / height, 0.0);
            queue.write_buffer(&layer.scale, 0, bytemuck::bytes_of(&scale));
        }
        let layer_parts = std::array::from_fn(|k| {
            // and a pixel more, for between them is interpolated
            let (scale, most) = (scales[k], sizes[k]);
            let (low, high) = (part.0.saturating_sub(UVec2::splat(scale)) / scale, ((part.0 + part.1) / scale + 2).min(most));
            (low, high - low)
        });
        let viewports = scales.map(|scale| (seen.corner.as_vec2() / scale as f32, seen.size.as_vec2() / scale as f32));
        own.drawn = Some(Drawn { head, pipelines: found, part, layer_parts, viewports });
        gpu.cameras.insert(entity, own);
    }
}

impl AirGpu {
    /// The lamps' light and shadows, where any of the air is in it.
    fn bind_lamps(&mut self, lamps: Option<ResMut<LampsGpu>>, device: &RenderDevice, cache: &PipelineCache) {
        self.under_lamps = lamps.is_some();
        let Some(mut lamps) = lamps else { return };
        let (serial, uniform, [stone, actors]) = lamps.bindings(device);
        if self.lamps.as_ref().is_none_or(|(known, _)| *known != serial) {
            let layout = cache.get_bind_group_layout(&self.layouts.get_or_insert_with(Layouts::default).lamps);
            let entries = BindGroupEntries::sequential((uniform.as_entire_binding(), stone, actors));
            self.lamps = Some((serial, device.create_bind_group("air_lamps", &layout, &entries)));
        }
    }

    /// Quads, maps, and what each head sees.
    fn write(&mut self, frame: &AirFrame, gpu: (&RenderDevice, &RenderQueue), cache: &PipelineCache) {
        let layouts = self.layouts.get_or_insert_with(Layouts::default);
        let [quads, maps, texels] = &mut self.buffers;
        let written = Grown::write(quads.take(), gpu.0, gpu.1, "air_quads", bytemuck::cast_slice(&frame.quads));
        let same = |a: &[Arc<SunMap>], b: &[Arc<SunMap>]| a.len() == b.len() && a.iter().zip(b).all(|(a, b)| Arc::ptr_eq(a, b));
        if maps.is_none() || !same(&self.maps, &frame.maps) {
            let (mut rows, mut depths) = (Vec::new(), Vec::new());
            for map in &frame.maps {
                let size = map.size();
                rows.push(MapUniform { rows: map.texels_from_world(), size: [size.x, size.y, depths.len() as u32, 0] });
                depths.extend_from_slice(map.depths());
            }
            if rows.is_empty() {
                rows.push(MapUniform::zeroed());
                depths.push(OPEN);
            }
            *maps = Some(Grown::write(maps.take(), gpu.0, gpu.1, "air_maps", bytemuck::cast_slice(&rows)));
            *texels = Some(Grown::write(texels.take(), gpu.0, gpu.1, "air_texels", bytemuck::cast_slice(&depths)));
            self.maps.clone_from(&frame.maps);
        }
        let layout = cache.get_bind_group_layout(&layouts.quads);
        let (Some(maps), Some(texels)) = (maps, texels) else { return };
        let mut before = std::mem::take(&mut self.heads).into_iter();
        self.heads = frame
            .heads
            .iter()
            .map(|AirHead { order, haze, .. }| {
                let kept = before.next().map(|head| head.order);
                let grown = Grown::write(kept, gpu.0, gpu.1, "air_order", bytemuck::cast_slice(order));
                let entries = BindGroupEntries::sequential((
                    written.buffer.as_entire_binding(),
                    grown.buffer.as_entire_binding(),
                    maps.buffer.as_entire_binding(),
                    texels.buffer.as_entire_binding(),
                ));
                let group = gpu.0.create_bind_group("air_quads", &layout, &entries);
                HeadGpu { order: grown, group, ranges: [0..*haze, *haze..order.len() as u32] }
            })
            .collect();
        *quads = Some(written);
    }
}

impl Layer {
    fn size(&self) -> UVec2 {
        UVec2::new(self.light.width(), self.light.height())
    }
}

impl CameraGpu {
    fn new(
        (device, cache): (&RenderDevice, &PipelineCache),
        layouts: &Layouts,
        main: &Texture,
        sizes: [UVec2; 2],
        sampler: &Sampler,
        bind: impl Fn(&Buffer, &Buffer) -> BindGroup,
    ) -> Self {
        let uniform = |label, bytes: usize| {
            let usage = BufferUsages::UNIFORM | BufferUsages::COPY_DST;
            device.create_buffer(&BufferDescriptor { label: Some(label), size: bytes as u64, usage, mapped_at_creation: false })
        };
        let texture = |label, size: Extent3d, format, usage| {
            device.create_texture(&TextureDescriptor {
                label: Some(label),
                size,
                mip_level_count: 1,
                sample_count: 1,
                dimension: TextureDimension::D2,
                format,
                usage: usage | TextureUsages::TEXTURE_BINDING,
                view_formats: &[],
            })
        };
        let camera = uniform("air_camera", CAMERA_BYTES);
        let layers = sizes.map(|size| {
            let size = Extent3d { width: size.x, height: size.y, depth_or_array_layers: 1 };
            let scale = uniform("air_scale", 16);
            let light = texture("air", size, TextureFormat::Rgba16Float, TextureUsages::RENDER_ATTACHMENT);
            Layer { group: bind(&camera, &scale), light, scale }
        });
        let before = texture("before_air", main.size(), main.format(), TextureUsages::COPY_DST);
        let layout = cache.get_bind_group_layout(&layouts.compose);
        let [haze, rest] = &layers;
        let [of_before, of_rest, of_haze] =
            [&before, &rest.light, &haze.light].map(|texture| texture.create_view(&TextureViewDescriptor::default()));
        let scale = haze.scale.as_entire_binding();
        let entries = BindGroupEntries::sequential((&of_before, &of_rest, &of_haze, sampler, scale));
        let compose = device.create_bind_group("air_compose", &layout, &entries);
        Self { uniform: camera, layers, before, compose, drawn: None }
    }
}

/// A camera, its depth, and a layer's scale.
fn depth_group(
    device: &RenderDevice,
    cache: &PipelineCache,
    layouts: &Layouts,
    seen: &Seen<'_>,
    [camera, scale]: [&Buffer; 2],
) -> BindGroup {
    let layout = cache.get_bind_group_layout(&layouts.camera[usize::from(seen.samples > 1)]);
    let entries = BindGroupEntries::sequential((camera.as_entire_binding(), seen.depth.view(), scale.as_entire_binding()));
    device.create_bind_group("air_camera", &layout, &entries)
}

/// The part of a picture that may show anything of these boxes, its corner and size in pixels; none where it is empty.
fn touched(boxes: &[(Vec3, Vec3)], clip_from_world: Mat4, corner: UVec2, size: UVec2) -> Option<(UVec2, UVec2)> {
    let (mut least, mut most) = (Vec2::INFINITY, Vec2::NEG_INFINITY);
    for (low, high) in boxes {
        let clips = [0, 1, 2, 3, 4, 5, 6, 7].map(|bits: u32| {
            let side = UVec3::new(bits & 1, bits >> 1 & 1, bits >> 2).as_vec3();
            clip_from_world * (*low + (*high - *low) * side).extend(1.0)
        });
        if clips.iter().all(|clip| clip.w <= 0.0) {
            continue;
        }
        for clip in clips {
            // what reaches behind the eye may be anywhere
            let at = if clip.w > 1e-3 { clip.truncate().truncate() / clip.w } else { Vec2::NAN };
            if at.is_nan() {
                (least, most) = (Vec2::NEG_ONE, Vec2::ONE);
            } else {
                (least, most) = (least.min(at), most.max(at));
            }
        }
    }
    let to_pixels = |ndc: Vec2| (ndc * Vec2::new(0.5, -0.5) + 0.5) * size.as_vec2();
    let low = to_pixels(Vec2::new(least.x, most.y)).floor().max(Vec2::ZERO);
    let high = to_pixels(Vec2::new(most.x, least.y)).ceil().min(size.as_vec2());
    (low.x < high.x && low.y < high.y).then(|| (corner + low.as_uvec2(), (high - low).as_uvec2()))
}

fn queue_quads(
    cache: &mut PipelineCache,
    pipelines: &mut StagePipelines,
    layouts: &Layouts,
    (samples, lamps): (u32, bool),
) -> CachedRenderPipelineId {
    let shader = pipelines.shader(cache, air_wgsl(samples, lamps), "air");
    let mut layout = vec![layouts.camera[usize::from(samples > 1)].clone(), layouts.quads.clone()];
    layout.extend(lamps.then(|| layouts.lamps.clone()));
    let over =
        |src_factor| BlendComponent { src_factor, dst_factor: BlendFactor::OneMinusSrcAlpha, operation: BlendOperation::Add };
    let blend = BlendState { color: over(BlendFactor::One), alpha: over(BlendFactor::One) };
    cache.queue_render_pipeline(RenderPipelineDescriptor {
        label: Some("air".into()),
        layout,
        vertex: VertexState { shader: shader.clone(), entry_point: Some("vertex".into()), ..default() },
        primitive: PrimitiveState { topology: PrimitiveTopology::TriangleStrip, ..default() },
        fragment: Some(FragmentState {
            shader,
            entry_point: Some("fragment".into()),
            targets: vec![Some(ColorTargetState {
                format: TextureFormat::Rgba16Float,
                blend: Some(blend),
                write_mask: ColorWrites::ALL,
            })],
            ..default()
        }),
        ..default()
    })
}

fn queue_compose(
    cache: &mut PipelineCache,
    pipelines: &mut StagePipelines,
    layouts: &Layouts,
    (display, samples): (DisplayKey, u32),
) -> CachedRenderPipelineId {
    let shader = pipelines.shader(cache, compose_wgsl(display, samples), "air_compose");
    cache.queue_render_pipeline(RenderPipelineDescriptor {
        label: Some("air_compose".into()),
        layout: vec![layouts.camera[usize::from(samples > 1)].clone(), layouts.compose.clone()],
        vertex: VertexState { shader: shader.clone(), entry_point: Some("vertex".into()), ..default() },
        fragment: Some(FragmentState {
            shader,
            entry_point: Some("fragment".into()),
            targets: vec![Some(ColorTargetState { format: display.format, blend: None, write_mask: ColorWrites::ALL })],
            ..default()
        }),
        ..default()
    })
}

/// Draws the air of the current camera.
pub fn draw(view: ViewQuery<&ViewTarget>, gpu: Res<AirGpu>, cache: Res<PipelineCache>, mut context: RenderContext) {
    let entity = view.entity();
    let target = view.into_inner();
    let Some(own) = gpu.cameras.get(&entity) else { return };
    let Some(Drawn { head, pipelines, part, layer_parts, viewports }) = own.drawn else { return };
    let [Some(quads), Some(compose)] = pipelines.map(|id| cache.get_render_pipeline(id)) else { return };
    let Some(head) = gpu.heads.get(head) else { return };
    let encoder = context.command_encoder();
    let [of_haze, of_rest] = [false, gpu.swarms].map(|begun| match begun {
        true => LoadOp::Load,
        false => LoadOp::Clear(wgpu::Color::TRANSPARENT),
    });
    let layers = own.layers.iter().zip([of_haze, of_rest]).zip(&head.ranges);
    for ((((layer, load), range), (at, size)), viewport) in layers.zip(layer_parts).zip(viewports) {
        let view = layer.light.create_view(&TextureViewDescriptor::default());
        let mut pass = encoder.begin_render_pass(&RenderPassDescriptor {
            label: Some("air"),
            color_attachments: &[Some(RenderPassColorAttachment {
                view: &view,
                depth_slice: None,
                resolve_target: None,
                ops: Operations { load, store: StoreOp::Store },
            })],
            ..default()
        });
        pass.set_viewport(viewport.0.x, viewport.0.y, viewport.1.x, viewport.1.y, 0.0, 1.0);
        pass.set_scissor_rect(at.x, at.y, size.x, size.y);
        pass.set_pipeline(quads);
        pass.set_bind_group(0, &*layer.group, &[]);
        pass.set_bind_group(1, &*head.group, &[]);
        if let Some((_, lamps)) = gpu.lamps.as_ref().filter(|_| gpu.under_lamps) {
            pass.set_bind_group(2, &**lamps, &[]);
        }
        pass.draw(0..4, range.clone());
    }
    let (at, size) = part;
    let origin = Origin3d { x: at.x, y: at.y, z: 0 };
    let main = target.main_texture();
    encoder.copy_texture_to_texture(
        TexelCopyTextureInfo { origin, ..main.as_image_copy() },
        TexelCopyTextureInfo { origin, ..own.before.as_image_copy() },
        Extent3d { width: size.x, height: size.y, depth_or_array_layers: 1 },
    );
    let mut pass = encoder.begin_render_pass(&RenderPassDescriptor {
        label: Some("air_compose"),
        color_attachments: &[Some(RenderPassColorAttachment {
            view: target.main_texture_view(),
            depth_slice: None,
            resolve_target: None,
            ops: Operations { load: LoadOp::Load, store: StoreOp::Store },
        })],
        ..default()
    });
    pass.set_scissor_rect(at.x, at.y, size.x, size.y);
    pass.set_pipeline(compose);
    let [_, rest] = &own.layers;
    pass.set_bind_group(0, &*rest.group, &[]);
    pass.set_bind_group(1, &*own.compose, &[]);
    pass.draw(0..3, 0..1);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_quads_may_touch_is_composed() {
        let clip = Mat4::perspective_infinite_reverse_rh(1.0, 1.0, 0.1);
        let size = UVec2::splat(100);
        let at = |middle: Vec3| [(middle - 0.5, middle + 0.5)];
        assert_eq!(touched(&[], clip, UVec2::ZERO, size), None);
        assert_eq!(touched(&at(Vec3::new(0.0, 0.0, 9.0)), clip, UVec2::ZERO, size), None, "behind");
        assert_eq!(touched(&at(Vec3::new(99.0, 0.0, -9.0)), clip, UVec2::ZERO, size), None, "beside");
        assert_eq!(touched(&at(Vec3::ZERO), clip, UVec2::ZERO, size), Some((UVec2::ZERO, size)), "about the eye");
        let (corner, part) = touched(&at(Vec3::new(0.0, 0.0, -10.0)), clip, UVec2::splat(7), size).unwrap();
        assert!(part.x < 14 && part.x > 6, "{part}");
        let middle = (corner + part / 2).as_ivec2();
        assert!((middle - 57).abs().max_element() <= 1, "{corner}");
    }
}
