//! Actors on the GPU: buffers that are written in every frame, the map of their depth from the sun, and their draws in the stone's own pass.

use super::figure::Model;
use super::shade::{ACTORS, Caster, SHADE_BYTES, ShadeUniform, TILE_PX, TILES_ACROSS, TILES_DOWN, may_shade};
use super::sun_field::SunField;
use crate::covering::gpu::Worn;
use crate::covering::uniform::OWN_BITS;
use crate::daylight::depth_map::{begin, depth_map};
use crate::daylight::pipelines::StagePipelines;
use crate::daylight::prepare::StageGpu;
use crate::lamps::maps::LampsGpu;
use crate::lamps::uniform::LAMPS_BYTES;
use crate::stage::frame::StageFrame;
use crate::stage::texture::{self, LevelledTexture};
use bevy::prelude::*;
use bevy::render::extract_resource::ExtractResource;
use bevy::render::render_resource::binding_types::{texture_depth_2d, uniform_buffer_sized};
use bevy::render::render_resource::*;
use bevy::render::renderer::{RenderContext, RenderDevice, RenderQueue};
use glam::Affine3A;
use heliodon_gpu::moving::MovingSun;
use heliodon_gpu::{GpuError, Method, MovingFrame, MovingGpu, MovingPipelines};
use heliodon_image::{SrgbImage, TextureWrap};
use heliodon_mesh::motion::Palette;
use std::num::NonZeroU64;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// What of an actor stays.
#[derive(Default)]
pub struct Look {
    /// [`crate::daylight::layout::albedo_roots`] of each vertex.
    pub albedo: Vec<u32>,
    /// Texture coordinates, one for each vertex.
    pub uvs: Vec<Vec2>,
    /// Triangles' corners.
    pub indices: Vec<u32>,
    /// Ranges of indices, and the texture of each.
    pub draws: Vec<(Range<u32>, Option<usize>)>,
    /// Base colour images, each with its smaller levels.
    pub textures: Vec<(Vec<SrgbImage>, [TextureWrap; 2])>,
    /// What a GPU poses and lights; none where only a processor can.
    pub model: Option<Arc<Model>>,
    /// Set where the GPU could not take it: then the processor lights it.
    pub refused: AtomicBool,
}

/// A frame that a GPU poses and lights.
#[derive(Clone, Debug)]
pub struct OnGpu {
    /// The pose, and a number that changes with it.
    pub pose: (u64, Arc<Palette>),
    /// Where the mesh stands.
    pub world_from_mesh: Affine3A,
    /// Directions in its own space, their solid angles, and the exposed radiance from each.
    pub directions: Vec<Vec3>,
    /// Steradians.
    pub weights: Vec<f32>,
    /// Exposed.
    pub radiance: Vec<Vec3>,
    /// Direction to the sun in the mesh's own space, and its exposed irradiance at normal incidence.
    pub sun: Option<(Vec3, Vec3)>,
    /// How much of it the monument lets through.
    pub sun_field: Option<SunField>,
    /// [`heliodon_gpu::moving::follow`].
    pub follow: f32,
}

/// What of an actor changes.
#[derive(Clone, Debug, Default)]
pub struct Shown {
    /// Positions in the world.
    pub positions: Vec<Vec3>,
    /// Unit normals on the octahedron ([`crate::daylight::layout::octahedral`]); none without lamps.
    pub normals: Vec<u32>,
    /// Exposed light, half floats.
    pub light: Vec<[u16; 4]>,
    /// Where a GPU poses and lights it: then there are neither normals nor light here.
    pub on_gpu: Option<OnGpu>,
    /// How it shades the stone.
    pub caster: Caster,
    /// What it wears.
    pub worn: Worn,
}

/// The actors of a frame.
#[derive(Resource, Clone, Default, ExtractResource)]
pub struct ActorsFrame {
    /// Changes with the actors.
    pub serial: u64,
    /// What of them stays.
    pub looks: Arc<[Arc<Look>]>,
    /// What of them changes, one for each look.
    pub shown: Arc<Vec<Shown>>,
}

/// An actor's buffers.
pub struct ActorGpu {
    positions: Buffer,
    normals: Buffer,
    light: Buffer,
    albedo: Buffer,
    uvs: Buffer,
    indices: Buffer,
    index_count: u32,
    draws: Vec<(Range<u32>, Option<usize>)>,
    textures: Vec<Option<BindGroup>>,
    /// The matrix of its tile.
    clip: (Buffer, BindGroup),
    moving: Option<Moving>,
    /// Where this frame's positions and light are.
    shown: Source,
    /// What it wears in this frame.
    worn: Worn,
}

/// Where an actor's positions and light are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Source {
    /// Nowhere yet.
    #[default]
    Nowhere,
    /// In buffers that the processor has written.
    Written,
    /// In those of [`Moving`].
    Moving,
}

/// A mesh that the GPU poses, and the number of its last pose.
struct Moving {
    mesh: MovingGpu,
    posed: Option<u64>,
}

/// The map of depths from the sun, and who reads it.
struct ShadowMap {
    view: TextureView,
    uniform: Buffer,
    /// With the lamps' maps of this number.
    bind_group: Option<(u64, BindGroup)>,
    pipeline: CachedRenderPipelineId,
}

/// Render world: the actors.
#[derive(Resource, Default)]
pub struct ActorsGpu {
    serial: u64,
    actors: Vec<ActorGpu>,
    map: Option<ShadowMap>,
    casting: usize,
    /// Whether there are actors that cast, or lamps.
    near: bool,
    shared: SharedPipelines,
    frame: ActorsFrame,
    casters: Vec<Caster>,
    /// Spheres around all actors, radius in w.
    bounds: Vec<Vec4>,
    sun_direction: Vec3,
}

/// The layout of what stone near actors and lamps binds.
pub fn shade_layout() -> BindGroupLayoutDescriptor {
    let uniform = |bytes: usize| uniform_buffer_sized(false, NonZeroU64::new(bytes as u64));
    BindGroupLayoutDescriptor::new(
        "actors_shade",
        &BindGroupLayoutEntries::sequential(
            ShaderStages::FRAGMENT,
            (uniform(SHADE_BYTES), texture_depth_2d(), uniform(LAMPS_BYTES), texture_depth_2d(), texture_depth_2d()),
        ),
    )
}

impl ShadowMap {
    fn new(device: &RenderDevice, pipeline: CachedRenderPipelineId) -> Self {
        let view = depth_map(device, "actors_sun_depth", TILE_PX * TILES_ACROSS, TILE_PX * TILES_DOWN);
        let uniform = device.create_buffer(&BufferDescriptor {
            label: Some("actors_shade"),
            size: SHADE_BYTES as u64,
            usage: BufferUsages::UNIFORM | BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        Self { view, uniform, bind_group: None, pipeline }
    }

    /// Binds the lamps as they are.
    fn bind(&mut self, device: &RenderDevice, cache: &PipelineCache, lamps: &mut LampsGpu) {
        let (serial, uniform, [stone, actors]) = lamps.bindings(device);
        if self.bind_group.as_ref().is_none_or(|(bound, _)| *bound != serial) {
            let layout = cache.get_bind_group_layout(&shade_layout());
            let (shade, lamps) = (self.uniform.as_entire_binding(), uniform.as_entire_binding());
            let entries = BindGroupEntries::sequential((shade, &self.view, lamps, stone, actors));
            self.bind_group = Some((serial, device.create_bind_group("actors_shade", &layout, &entries)));
        }
    }
}

impl ActorGpu {
    fn new(
        look: &Look,
        device: &RenderDevice,
        queue: &RenderQueue,
        cache: &PipelineCache,
        pipelines: &StagePipelines,
        software: bool,
    ) -> Self {
        let vertices = look.albedo.len().max(1) as u64;
        let empty = |label, size: u64, usage| {
            device.create_buffer(&BufferDescriptor {
                label: Some(label),
                size,
                usage: usage | BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        };
        let filled = |label, contents: &[u8], usage| {
            // A buffer of nothing is none.
            let contents = if contents.is_empty() { &[0; 4] } else { contents };
            device.create_buffer_with_data(&BufferInitDescriptor { label: Some(label), contents, usage })
        };
        let texture_layout = cache.get_bind_group_layout(&pipelines.texture_layout);
        let textures = look.textures.iter().map(|(levels, wrap)| {
            let mut texture = LevelledTexture::new(device, levels.first()?)?;
            levels.iter().for_each(|level| texture.write(queue, level));
            let (view, sampler) = (texture.view(), texture::sampler(device, !software, *wrap));
            let entries = BindGroupEntries::sequential((&view, &sampler));
            Some(device.create_bind_group("actor_texture", &texture_layout, &entries))
        });
        let clip = empty("actor_caster", size_of::<Mat4>() as u64, BufferUsages::UNIFORM);
        let layout = cache.get_bind_group_layout(&pipelines.caster_layout);
        let clip_group = device.create_bind_group("actor_caster", &layout, &BindGroupEntries::single(clip.as_entire_binding()));
        Self {
            normals: empty("actor_normals", 4 * vertices, BufferUsages::VERTEX),
            positions: empty("actor_positions", 12 * vertices, BufferUsages::VERTEX),
            light: empty("actor_light", 8 * vertices, BufferUsages::VERTEX),
            albedo: filled("actor_albedo", bytemuck::cast_slice(&look.albedo), BufferUsages::VERTEX),
            uvs: filled("actor_uvs", bytemuck::cast_slice(&look.uvs), BufferUsages::VERTEX),
            indices: filled("actor_indices", bytemuck::cast_slice(&look.indices), BufferUsages::INDEX),
            index_count: look.indices.len() as u32,
            draws: look.draws.clone(),
            textures: textures.collect(),
            clip: (clip, clip_group),
            moving: None,
            shown: Source::Nowhere,
            worn: Worn::NOTHING,
        }
    }
}

impl ActorGpu {
    /// Positions, light and normals, where there are any.
    fn vertices(&self) -> Option<[wgpu::BufferSlice<'_>; 3]> {
        match (self.shown, &self.moving) {
            (Source::Written, _) => Some([&self.positions, &self.light, &self.normals].map(|buffer| *buffer.slice(..))),
            (Source::Moving, Some(Moving { mesh, .. })) => {
                Some([mesh.world_positions(), mesh.light().slice(..), mesh.world_normals()])
            }
            _ => None,
        }
    }

    /// Takes a frame to the GPU.
    fn take(&mut self, shown: &Shown, look: &Look, device: &RenderDevice, queue: &RenderQueue, shared: &mut SharedPipelines) {
        self.worn = shown.worn;
        if shown.on_gpu.is_none() {
            queue.write_buffer(&self.positions, 0, bytemuck::cast_slice(&shown.positions));
            queue.write_buffer(&self.light, 0, bytemuck::cast_slice(&shown.light));
            queue.write_buffer(&self.normals, 0, bytemuck::cast_slice(&shown.normals));
            // Who is hidden has none, and the buffers still hold what was there before.
            self.shown = if shown.positions.is_empty() { Source::Nowhere } else { Source::Written };
            return;
        }
        self.shown = Source::Nowhere;
        if let (None, Some(model)) = (&self.moving, &look.model) {
            let device = device.wgpu_device();
            let pipelines = shared.get_or_insert_with(|| Arc::new(MovingPipelines::new(device)));
            match MovingGpu::new(device, pipelines, model.moving(), &model.gpu_corners(), Method::Auto) {
                Ok(mesh) => self.moving = Some(Moving { mesh, posed: None }),
                Err(error) => refuse(look, &error),
            }
        }
    }

    /// Records how it is posed and lit, where the GPU does that.
    fn record(&mut self, encoder: &mut CommandEncoder, shown: &Shown, look: &Look) {
        let (Some(frame), Some(moving)) = (&shown.on_gpu, &mut self.moving) else { return };
        let (serial, palette) = &frame.pose;
        let lattice = frame.sun_field.as_ref().map(SunField::lattice);
        let sun = frame.sun.map(|(direction, irradiance)| MovingSun { direction, irradiance, lattice });
        let recorded = moving.mesh.record(
            encoder,
            &MovingFrame {
                palette: (moving.posed != Some(*serial)).then_some(&**palette),
                world_from_mesh: frame.world_from_mesh,
                directions: &frame.directions,
                weights: &frame.weights,
                radiance: &frame.radiance,
                sun,
                follow: frame.follow,
            },
        );
        match recorded {
            Ok(()) => (moving.posed, self.shown) = (Some(*serial), Source::Moving),
            Err(error) => refuse(look, &error),
        }
    }

    /// Draws its depth.
    pub fn draw_depth(&self, pass: &mut wgpu::RenderPass<'_>) {
        let Some([positions, ..]) = self.vertices() else { return };
        pass.set_vertex_buffer(0, positions);
        pass.set_index_buffer(*self.indices.slice(..), IndexFormat::Uint32);
        pass.draw_indexed(0..self.index_count, 0, 0..1);
    }
}

/// What actors are drawn by: each without and with a texture.
pub struct ActorPipelines<'a> {
    /// Those that wear nothing, alone,
    pub plain: [Option<&'a RenderPipeline>; 2],
    /// and where others shade them and lamps light them.
    pub shaded: Option<[Option<&'a RenderPipeline>; 2]>,
    /// Those that wear something, alone and so.
    pub covered: Option<[[Option<&'a RenderPipeline>; 2]; 2]>,
    /// Outlines of any.
    pub outline: Option<&'a RenderPipeline>,
}

/// What all actors that a GPU poses share, once there is one.
type SharedPipelines = Option<Arc<MovingPipelines>>;

/// Leaves an actor to the processor.
fn refuse(look: &Look, error: &GpuError) {
    if !look.refused.swap(true, Ordering::Relaxed) {
        warn!("an actor is lit by the processor: {error}");
    }
}

impl ActorsGpu {
    /// Draws the actors as closed stone, and the outlines of those that are marked.
    pub fn draw(&self, pass: &mut wgpu::RenderPass<'_>, by: &ActorPipelines<'_>, lamps: Option<&LampsGpu>) {
        for (number, actor) in self.actors.iter().enumerate() {
            let Some([positions, light, normals]) = actor.vertices() else { continue };
            pass.set_vertex_buffer(0, positions);
            pass.set_vertex_buffer(1, light);
            pass.set_vertex_buffer(2, *actor.albedo.slice(..));
            pass.set_index_buffer(*actor.indices.slice(..), IndexFormat::Uint32);
            let shaded = by.shaded.zip(self.shade()).filter(|_| self.is_shaded(number, lamps));
            // A texture is the group after what shades.
            let (pipelines, texture_group) = match shaded {
                Some((pipelines, shade)) => {
                    pass.set_bind_group(1, &**shade, &[]);
                    (pipelines, 2)
                }
                None => (by.plain, 1),
            };
            let covered = by.covered.filter(|_| actor.worn.slot > 0).map(|covered| covered[usize::from(shaded.is_some())]);
            // Until all of its pipelines are there it is drawn as if it wore nothing.
            let is_there = |pipelines: &[Option<&RenderPipeline>; 2]| {
                actor.draws.iter().all(|(_, texture)| pipelines[usize::from(texture.is_some())].is_some())
            };
            let covered = covered.filter(is_there);
            let pipelines = covered.unwrap_or(pipelines);
            let normals = (shaded.and(lamps).is_some() || covered.is_some()).then_some(normals);
            for (slot, buffer) in (3..).zip(normals.into_iter().chain([*actor.uvs.slice(..)])) {
                pass.set_vertex_buffer(slot, buffer);
            }
            // By its instance an actor that casts is known from the others.
            let own = if number < self.casting { number as u32 + 1 } else { 0 };
            let instance = if covered.is_some() { own | actor.worn.slot << OWN_BITS } else { own };
            for (indices, texture) in &actor.draws {
                let texture = texture.and_then(|texture| actor.textures[texture].as_ref());
                let Some(pipeline) = pipelines[usize::from(texture.is_some())] else { continue };
                pass.set_pipeline(pipeline);
                if let Some(texture) = texture {
                    pass.set_bind_group(texture_group, &**texture, &[]);
                }
                pass.draw_indexed(indices.clone(), 0, instance..instance + 1);
            }
            if let Some(outline) = by.outline.filter(|_| covered.is_some() && actor.worn.marked && actor.worn.sight.casts()) {
                pass.set_pipeline(outline);
                // a bright line, and a dark one around it
                let first = actor.worn.slot << OWN_BITS;
                [first, first | 1].into_iter().for_each(|line| pass.draw_indexed(0..actor.index_count, 0, line..line + 1));
            }
        }
    }

    /// Whether others may shade an actor, or lamps light it.
    fn is_shaded(&self, number: usize, lamps: Option<&LampsGpu>) -> bool {
        let Some(bounds) = self.bounds.get(number) else { return false };
        let (center, half) = (bounds.truncate(), Vec3::splat(bounds.w));
        let bounds = (center - half, center + half);
        let mut others = self.casters.iter().enumerate().filter(|&(other, _)| other != number);
        lamps.is_some_and(|lamps| lamps.light(bounds))
            || others.any(|(_, caster)| may_shade(caster, self.sun_direction, bounds))
    }

    /// The actors that cast shadows there, between planes with inward unit normals.
    pub fn in_view<'a>(&'a self, planes: &[Vec4]) -> impl Iterator<Item = &'a ActorGpu> + use<'a> {
        let within = |ball: &Vec4| planes.iter().all(|plane| plane.truncate().dot(ball.truncate()) + plane.w >= -ball.w);
        let within: Vec<bool> = self.bounds.iter().map(within).collect();
        self.actors.iter().zip(within).filter_map(|(actor, within)| (within && actor.worn.sight.casts()).then_some(actor))
    }

    /// Whether anybody may shade what lies in a box of the world.
    #[must_use]
    pub fn shades(&self, bounds: (Vec3, Vec3)) -> bool {
        self.casters.iter().any(|caster| may_shade(caster, self.sun_direction, bounds))
    }

    /// What stone near actors and lamps binds, where there are any.
    #[must_use]
    pub fn shade(&self) -> Option<&BindGroup> {
        self.map.as_ref().filter(|_| self.near).and_then(|map| map.bind_group.as_ref()).map(|(_, group)| group)
    }
}

/// Takes the frame's actors to the GPU.
#[expect(clippy::too_many_arguments, reason = "a system's arguments are its resources")]
pub fn prepare_actors(
    frame: Res<ActorsFrame>,
    stage: Res<StageFrame>,
    stone: Res<StageGpu>,
    mut gpu: ResMut<ActorsGpu>,
    mut lamps: ResMut<LampsGpu>,
    mut pipelines: ResMut<StagePipelines>,
    mut cache: ResMut<PipelineCache>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
) {
    let gpu = &mut *gpu;
    if gpu.serial != frame.serial {
        let made = frame.looks.iter().map(|look| ActorGpu::new(look, &device, &queue, &cache, &pipelines, stone.software));
        gpu.actors = made.collect();
        gpu.serial = frame.serial;
    }
    (gpu.casting, gpu.near) = (0, false);
    (gpu.casters, gpu.bounds) = (Vec::new(), Vec::new());
    gpu.frame = frame.clone();
    // Who was added in this frame is not lit yet.
    let shown = if frame.shown.len() == gpu.actors.len() { &frame.shown[..] } else { &[] };
    let Some(moment) = stage.moment.as_ref().filter(|_| !shown.is_empty() || lamps.any()) else { return };
    for ((actor, shown), look) in gpu.actors.iter_mut().zip(shown).zip(frame.looks.iter()) {
        actor.take(shown, look, &device, &queue, &mut gpu.shared);
    }
    let map = gpu.map.get_or_insert_with(|| ShadowMap::new(&device, pipelines.caster(&mut cache)));
    map.bind(&device, &cache, &mut lamps);
    let casters: Vec<Caster> = shown.iter().take(ACTORS).map(|shown| shown.caster.clone()).collect();
    let irradiance = moment.shading.sun_irradiance * stage.exposure_stops.exp2();
    let (uniform, clips) = ShadeUniform::new(&casters, moment.sun_direction, irradiance);
    queue.write_buffer(&map.uniform, 0, bytemuck::bytes_of(&uniform));
    for (actor, clip) in gpu.actors.iter().zip(&clips) {
        queue.write_buffer(&actor.clip.0, 0, bytemuck::bytes_of(clip));
    }
    // Until its pipeline is there the map would hold nothing that anybody wrote.
    if cache.get_render_pipeline(map.pipeline).is_some() {
        gpu.casting = clips.len();
        gpu.near = true;
    }
    gpu.bounds = shown.iter().map(|shown| shown.caster.bounds).collect();
    (gpu.casters, gpu.sun_direction) = (casters, moment.sun_direction);
}

/// Poses and lights the actors that the GPU does that for, and draws the depth of all from the sun.
pub fn cast_shadows(mut gpu: ResMut<ActorsGpu>, cache: Res<PipelineCache>, mut context: RenderContext) {
    let ActorsGpu { actors, frame, .. } = &mut *gpu;
    for ((actor, shown), look) in actors.iter_mut().zip(frame.shown.iter()).zip(frame.looks.iter()) {
        actor.record(context.command_encoder(), shown, look);
    }
    let Some(map) = gpu.map.as_ref().filter(|_| gpu.casting > 0) else { return };
    let Some(pipeline) = cache.get_render_pipeline(map.pipeline) else { return };
    let mut pass = begin(context.command_encoder(), "actors_sun_depth", &map.view, true);
    pass.set_pipeline(pipeline);
    for (i, actor) in gpu.actors.iter().take(gpu.casting).enumerate() {
        let [x, y] = [i as u32 % TILES_ACROSS, i as u32 / TILES_ACROSS].map(|tile| (tile * TILE_PX) as f32);
        pass.set_viewport(x, y, TILE_PX as f32, TILE_PX as f32, 0.0, 1.0);
        pass.set_bind_group(0, &*actor.clip.1, &[]);
        actor.draw_depth(&mut pass);
    }
}
