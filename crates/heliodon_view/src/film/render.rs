//! Films on the GPU: two textures for each, of which one is shown while the other takes the next picture, a buffer for each head, and one pass a camera.

use super::surface::Surface;
use super::uniform::{FILM_BYTES, FilmUniform, SURFACE_VERTEX_BYTES, SurfaceVertex};
use super::{Drawn, FILM_WGSL, FilmsFrame, Passes};
use crate::daylight::pipelines::{StagePipelines, resolved};
use crate::over_stone::{
    BOX_CORNERS, BoundCamera, CAMERA_WGSL, CameraLayouts, DrawnView, Grown, QUAD_CORNERS, Seen, SeenCamera, begin, begin_solid,
};
use crate::stage::frame::StageFrame;
use crate::tonemap::DisplayKey;
use bevy::mesh::VertexBufferLayout;
use bevy::prelude::*;
use bevy::render::render_resource::binding_types::{sampler, storage_buffer_read_only_sized, texture_2d};
use bevy::render::render_resource::*;
use bevy::render::renderer::{RenderContext, RenderDevice, RenderQueue, ViewQuery};
use heliodon_film::Frame;
use std::collections::HashMap;
use std::num::NonZeroU64;
use std::sync::Arc;

/// What a pipeline is made for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct FilmKey {
    /// What its target shows.
    pub display: DisplayKey,
    /// Whether its target has several samples a pixel.
    pub samples: u32,
    /// Whether the film is on a part, and not on a quad.
    pub surface: bool,
    /// Whether its colours are still to be multiplied by their alpha.
    pub straight: bool,
    /// What it does with what is there.
    pub step: Step,
}

/// What a pass does with what is there.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Step {
    /// Covers it, as far as the film covers anything.
    Over,
    /// Multiplies it by the inverted mask.
    Mask,
    /// Adds the image to it.
    Add,
    /// Leaves of it what light is left in the film's shadow.
    Shadow,
    /// Tells what is drawn later where the film is.
    Solid,
}

impl FilmKey {
    /// The shader's whole text.
    #[must_use]
    pub fn wgsl(self) -> String {
        let defined = [
            ("ONE_SAMPLE", self.samples == 1),
            ("MANY_SAMPLES", self.samples > 1),
            ("STRAIGHT", self.straight),
            ("READY", !self.straight),
        ];
        format!("{}{}", self.display.wgsl(), resolved(&format!("{CAMERA_WGSL}{FILM_WGSL}"), &defined))
    }

    /// Names of the shader's stages.
    fn entries(self) -> [&'static str; 2] {
        match (self.surface, self.step) {
            (_, Step::Shadow) => ["shadow_vertex", "shadow_fragment"],
            (_, Step::Solid) => ["solid_vertex", "solid_fragment"],
            (false, Step::Mask) => ["vertex", "mask_fragment"],
            (false, _) => ["vertex", "fragment"],
            (true, Step::Mask) => ["surface_vertex", "surface_mask_fragment"],
            (true, _) => ["surface_vertex", "surface_fragment"],
        }
    }

    /// None where no colour is written.
    fn blend(self) -> Option<BlendState> {
        let (src_factor, dst_factor) = match self.step {
            Step::Over => (BlendFactor::One, BlendFactor::OneMinusSrcAlpha),
            Step::Mask | Step::Shadow => (BlendFactor::Dst, BlendFactor::Zero),
            Step::Add => (BlendFactor::One, BlendFactor::One),
            Step::Solid => return None,
        };
        let one = BlendComponent { src_factor, dst_factor, operation: BlendOperation::Add };
        Some(BlendState { color: one, alpha: one })
    }
}

/// Render world: the films.
#[derive(Resource, Default)]
pub struct FilmsGpu {
    serial: u64,
    layouts: Option<Layouts>,
    made: HashMap<FilmKey, CachedRenderPipelineId>,
    pictures: HashMap<usize, PictureGpu>,
    surfaces: HashMap<usize, SurfaceGpu>,
    heads: Vec<HeadGpu>,
    cameras: HashMap<Entity, CameraGpu>,
}

impl FilmsGpu {
    /// Whether a camera sees any of it in this frame.
    #[must_use]
    pub fn has_any(&self, camera: Entity) -> bool {
        self.cameras.contains_key(&camera)
    }
}

struct Layouts {
    camera: CameraLayouts,
    films: BindGroupLayoutDescriptor,
    picture: BindGroupLayoutDescriptor,
}

/// A film's pictures.
struct PictureGpu {
    size: (u32, u32),
    textures: [Texture; 2],
    groups: [BindGroup; 2],
    /// Which of them is shown.
    shown: usize,
    frame: Option<Arc<Frame>>,
}

/// A part that shows a film.
struct SurfaceGpu {
    surface: Arc<Surface>,
    vertices: Buffer,
    indices: Buffer,
    count: u32,
    light: Option<Arc<[Vec3]>>,
}

struct HeadGpu {
    films: Grown,
    group: BindGroup,
    order: Vec<Drawn>,
}

struct CameraGpu {
    head: usize,
    shadows: CachedRenderPipelineId,
    solids: CachedRenderPipelineId,
    /// Of quads and of parts, each of ready and of straight colours, in the order of their passes.
    pipelines: [[Vec<CachedRenderPipelineId>; 2]; 2],
    bound: BoundCamera,
}

impl Default for Layouts {
    fn default() -> Self {
        let both = ShaderStages::VERTEX_FRAGMENT;
        let films = storage_buffer_read_only_sized(false, NonZeroU64::new(FILM_BYTES as u64));
        let texels = texture_2d(TextureSampleType::Float { filterable: true });
        Self {
            camera: CameraLayouts::default(),
            films: BindGroupLayoutDescriptor::new("films", &BindGroupLayoutEntries::single(both, films)),
            picture: BindGroupLayoutDescriptor::new(
                "film_picture",
                &BindGroupLayoutEntries::sequential(ShaderStages::FRAGMENT, (texels, sampler(SamplerBindingType::Filtering))),
            ),
        }
    }
}

impl PictureGpu {
    fn new(device: &RenderDevice, layout: &BindGroupLayout, size: (u32, u32), repeats: bool) -> Self {
        let address_mode = if repeats { AddressMode::Repeat } else { AddressMode::ClampToEdge };
        let sampler = device.create_sampler(&SamplerDescriptor {
            label: Some("film"),
            address_mode_u: address_mode,
            address_mode_v: address_mode,
            mag_filter: FilterMode::Linear,
            min_filter: FilterMode::Linear,
            ..default()
        });
        let textures = [0, 1].map(|_| {
            device.create_texture(&TextureDescriptor {
                label: Some("film"),
                size: Extent3d { width: size.0, height: size.1, depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: TextureDimension::D2,
                format: TextureFormat::Rgba8UnormSrgb,
                usage: TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_DST,
                view_formats: &[],
            })
        });
        let groups = [0, 1].map(|i: usize| {
            let view = textures[i].create_view(&TextureViewDescriptor::default());
            device.create_bind_group("film_picture", layout, &BindGroupEntries::sequential((&view, &sampler)))
        });
        Self { size, textures, groups, shown: 0, frame: None }
    }

    /// Takes a picture that it does not show yet to the texture that no frame under way reads.
    fn show(&mut self, queue: &RenderQueue, frame: &Arc<Frame>) {
        if self.frame.as_ref().is_some_and(|shown| Arc::ptr_eq(shown, frame)) {
            return;
        }
        self.shown = 1 - self.shown;
        let (width, height) = self.size;
        queue.write_texture(
            self.textures[self.shown].as_image_copy(),
            bytemuck::cast_slice(&frame.pixels),
            TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(width * 4), rows_per_image: None },
            Extent3d { width, height, depth_or_array_layers: 1 },
        );
        self.frame = Some(Arc::clone(frame));
    }
}

impl SurfaceGpu {
    fn new(device: &RenderDevice, surface: &Arc<Surface>) -> Self {
        let indices = surface.indices();
        let size = (surface.positions().count() * SURFACE_VERTEX_BYTES) as u64;
        let usage = BufferUsages::VERTEX | BufferUsages::COPY_DST;
        let vertices =
            device.create_buffer(&BufferDescriptor { label: Some("film_surface"), size, usage, mapped_at_creation: false });
        let contents = bytemuck::cast_slice(&indices);
        let filled = BufferInitDescriptor { label: Some("film_surface"), contents, usage: BufferUsages::INDEX };
        let index_buffer = device.create_buffer_with_data(&filled);
        Self { surface: Arc::clone(surface), vertices, indices: index_buffer, count: indices.len() as u32, light: None }
    }

    /// Lights it, where its light is another than before.
    fn lit(&mut self, queue: &RenderQueue, light: &Arc<[Vec3]>) {
        if self.light.as_ref().is_some_and(|before| Arc::ptr_eq(before, light)) {
            return;
        }
        let places = self.surface.positions().zip(self.surface.uvs()).zip(light.iter());
        let vertices: Vec<SurfaceVertex> =
            places.map(|((position, uv), &light)| SurfaceVertex { position, uv: uv.to_array(), light }).collect();
        queue.write_buffer(&self.vertices, 0, bytemuck::cast_slice(&vertices));
        self.light = Some(Arc::clone(light));
    }
}

/// Takes the frame's films to the GPU.
#[expect(clippy::too_many_arguments, reason = "a system's arguments are its resources")]
pub fn prepare(
    frame: Res<FilmsFrame>,
    stage: Res<StageFrame>,
    mut gpu: ResMut<FilmsGpu>,
    mut pipelines: ResMut<StagePipelines>,
    mut cache: ResMut<PipelineCache>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
    cameras: Query<SeenCamera>,
) {
    let gpu = &mut *gpu;
    if gpu.serial != frame.serial {
        let (made, layouts) = (std::mem::take(&mut gpu.made), gpu.layouts.take());
        *gpu = FilmsGpu { serial: frame.serial, made, layouts, ..default() };
    }
    if frame.pictures.is_empty() || frame.heads.is_empty() {
        gpu.heads.clear();
        gpu.cameras.clear();
        return;
    }
    let layouts = gpu.layouts.get_or_insert_with(Layouts::default);
    let layout = cache.get_bind_group_layout(&layouts.picture);
    for picture in frame.pictures.iter() {
        let size = (picture.frame.width, picture.frame.height);
        let on_part = picture.surface.as_ref();
        let own =
            gpu.pictures.entry(picture.slot).or_insert_with(|| PictureGpu::new(&device, &layout, size, on_part.is_some()));
        own.show(&queue, &picture.frame);
        if let Some((surface, light)) = on_part {
            let own = gpu.surfaces.entry(picture.slot).or_insert_with(|| SurfaceGpu::new(&device, surface));
            own.lit(&queue, light);
        }
    }
    let layout = cache.get_bind_group_layout(&layouts.films);
    let mut before = std::mem::take(&mut gpu.heads).into_iter();
    gpu.heads = frame
        .heads
        .iter()
        .map(|head| {
            let kept = before.next().map(|head| head.films);
            let films = Grown::write(kept, &device, &queue, "films", bytemuck::cast_slice::<FilmUniform, u8>(&head.films));
            let group = device.create_bind_group("films", &layout, &BindGroupEntries::single(films.buffer.as_entire_binding()));
            HeadGpu { films, group, order: head.order.clone() }
        })
        .collect();
    let mut before = std::mem::take(&mut gpu.cameras);
    for camera in &cameras {
        let Some(seen) = Seen::new(camera, stage.curve) else { continue };
        let ((entity, main), samples, display) = (seen.entities, seen.samples, seen.display);
        let Some(head) = frame.heads.iter().position(|head| head.cameras.contains(&main)) else { continue };
        let steps: &[Step] = match frame.passes {
            Passes::Single => &[Step::Over],
            Passes::Two => &[Step::Mask, Step::Add],
        };
        let mut pipeline = |surface, straight, step| {
            let key = FilmKey { display, samples, surface, straight, step };
            *gpu.made.entry(key).or_insert_with(|| queue_pipeline(&mut cache, &mut pipelines, layouts, key))
        };
        let [shadows, solids] = [Step::Shadow, Step::Solid].map(|step| pipeline(false, false, step));
        let found = [false, true]
            .map(|surface| [false, true].map(|straight| steps.iter().map(|&step| pipeline(surface, straight, step)).collect()));
        let uniform = seen.uniform.under(frame.shadow, Vec3::ZERO, frame.shadow);
        let before = before.remove(&entity).map(|camera| camera.bound);
        let bound = BoundCamera::write(before, (&device, &queue), &cache, &layouts.camera, (&seen, &uniform));
        gpu.cameras.insert(entity, CameraGpu { head, shadows, solids, pipelines: found, bound });
    }
}

fn queue_pipeline(
    cache: &mut PipelineCache,
    pipelines: &mut StagePipelines,
    layouts: &Layouts,
    key: FilmKey,
) -> CachedRenderPipelineId {
    let shader = pipelines.shader(cache, key.wgsl(), "film");
    let solid = key.step == Step::Solid;
    let camera = if solid { layouts.camera.solid.clone() } else { layouts.camera.over[usize::from(key.samples > 1)].clone() };
    let [vertex, fragment] = key.entries();
    let shadow = key.step == Step::Shadow;
    let vertices = VertexBufferLayout {
        array_stride: SURFACE_VERTEX_BYTES as u64,
        step_mode: VertexStepMode::Vertex,
        attributes: vec![
            VertexAttribute { format: VertexFormat::Float32x3, offset: 0, shader_location: 0 },
            VertexAttribute { format: VertexFormat::Float32x2, offset: 12, shader_location: 1 },
            VertexAttribute { format: VertexFormat::Float32x3, offset: 20, shader_location: 2 },
        ],
    };
    let target = |blend| ColorTargetState {
        format: key.display.format,
        blend: Some(blend),
        // what is opaque below stays it
        write_mask: ColorWrites::COLOR,
    };
    cache.queue_render_pipeline(RenderPipelineDescriptor {
        label: Some("films".into()),
        layout: vec![camera, layouts.films.clone(), layouts.picture.clone()],
        vertex: VertexState {
            shader: shader.clone(),
            entry_point: Some(vertex.into()),
            buffers: if key.surface { vec![vertices] } else { Vec::new() },
            ..default()
        },
        primitive: PrimitiveState {
            topology: if key.surface { PrimitiveTopology::TriangleList } else { PrimitiveTopology::TriangleStrip },
            cull_mode: match (shadow, key.surface) {
                // of the shadow's box the far side, which is there also for who stands within
                (true, _) => Some(Face::Front),
                (false, true) => Some(Face::Back),
                // a film that stands is seen from behind, too
                (false, false) => None,
            },
            ..default()
        },
        depth_stencil: Some(DepthStencilState {
            format: bevy::core_pipeline::core_3d::CORE_3D_DEPTH_FORMAT,
            depth_write_enabled: Some(solid),
            depth_compare: Some(if shadow { CompareFunction::LessEqual } else { CompareFunction::GreaterEqual }),
            stencil: StencilState::default(),
            bias: DepthBiasState::default(),
        }),
        multisample: MultisampleState { count: key.samples, ..default() },
        fragment: Some(FragmentState {
            shader,
            entry_point: Some(fragment.into()),
            targets: key.blend().into_iter().map(|blend| Some(target(blend))).collect(),
            ..default()
        }),
        ..default()
    })
}

/// Draws what the current camera sees of them.
pub fn draw(view: ViewQuery<DrawnView>, gpu: Res<FilmsGpu>, cache: Res<PipelineCache>, mut context: RenderContext) {
    let entity = view.entity();
    let seen = view.into_inner();
    let Some(own) = gpu.cameras.get(&entity) else { return };
    let Some(head) = gpu.heads.get(own.head) else { return };
    // shadows first, for they fall on what has depth: they would darken films that stand before
    let on_quads = |pass: &mut wgpu::RenderPass, pipeline, corners: u32, is_in: fn(&Drawn) -> bool| {
        let Some(pipeline) = cache.get_render_pipeline(pipeline) else { return };
        pass.set_pipeline(pipeline);
        for (drawn, number) in head.order.iter().zip(0..).filter(|(drawn, _)| is_in(drawn)) {
            let Some(picture) = gpu.pictures.get(&drawn.slot) else { continue };
            pass.set_bind_group(2, &*picture.groups[picture.shown], &[]);
            pass.draw(0..corners, number..number + 1);
        }
    };
    let (camera, _, depth, resolution) = seen;
    {
        let mut pass = begin(&mut context, "films", seen);
        pass.set_bind_group(0, &*own.bound.over, &[]);
        pass.set_bind_group(1, &*head.group, &[]);
        on_quads(&mut pass, own.shadows, BOX_CORNERS, |drawn| drawn.casts);
        for (drawn, number) in head.order.iter().zip(0..) {
            let Some(picture) = gpu.pictures.get(&drawn.slot) else { continue };
            pass.set_bind_group(2, &*picture.groups[picture.shown], &[]);
            for &pipeline in &own.pipelines[usize::from(drawn.on_part)][usize::from(drawn.straight)] {
                let Some(pipeline) = cache.get_render_pipeline(pipeline) else { continue };
                pass.set_pipeline(pipeline);
                match gpu.surfaces.get(&drawn.slot).filter(|_| drawn.on_part) {
                    Some(surface) => {
                        pass.set_vertex_buffer(0, *surface.vertices.slice(..));
                        pass.set_index_buffer(*surface.indices.slice(..), IndexFormat::Uint32);
                        pass.draw_indexed(0..surface.count, 0, number..number + 1);
                    }
                    None => pass.draw(0..QUAD_CORNERS, number..number + 1),
                }
            }
        }
    }
    let mut pass = begin_solid(&mut context, "film_solids", (camera, depth, resolution));
    pass.set_bind_group(0, &*own.bound.solid, &[]);
    pass.set_bind_group(1, &*head.group, &[]);
    // a part's own depth is there already
    on_quads(&mut pass, own.solids, QUAD_CORNERS, |drawn| !drawn.on_part);
}
