//! The lamps on the GPU: what the shaders know of them, and their maps of the depth of stone and actors.

use super::uniform::{LAMPS_BYTES, LampsUniform, TILE_PX, TILES_ACROSS, Tile, lit, may_light, tiles};
use super::{Lamp, Lamps};
use crate::actors::render::ActorsGpu;
use crate::covering::gpu::CoversGpu;
use crate::daylight::depth_map::{begin, depth_map};
use crate::daylight::pages::GpuChunk;
use crate::daylight::pass::{Bound, PASS_TRIANGLES};
use crate::daylight::pipelines::StagePipelines;
use crate::daylight::prepare::StageGpu;
use crate::daylight::seen::Seen;
use crate::daylight::view::{ClusterRef, frustum_planes};
use crate::stage::frame::StageFrame;
use bevy::prelude::*;
use bevy::render::render_resource::{
    BindGroup, BindGroupEntries, Buffer, BufferDescriptor, BufferInitDescriptor, BufferUsages, CachedRenderPipelineId,
    CommandEncoder, ComputePassDescriptor, PipelineCache, TextureView,
};
use bevy::render::renderer::{RenderContext, RenderDevice, RenderQueue};
use wgpu::RenderPass;

/// Render world: the lamps.
#[derive(Resource, Default)]
pub struct LampsGpu {
    /// Those that are lit.
    lamps: Vec<Lamp>,
    tiles: Vec<TileGpu>,
    /// The bundle whose stone is in the map.
    stone_of: u64,
    /// What was hidden or faded when it was drawn ([`CoversGpu::serial`]).
    covers: u64,
    /// Whether the map of the stone is that of the lamps as they are.
    stone_is_drawn: bool,
    /// Whether there is anything in the map of the actors.
    actors_are_drawn: bool,
    maps: Option<Maps>,
    uniform: Option<Buffer>,
    pipeline: Option<CachedRenderPipelineId>,
    serial: u64,
}

struct TileGpu {
    tile: Tile,
    group: BindGroup,
}

/// Depth from the lamps.
struct Maps {
    rows: u32,
    stone: TextureView,
    actors: TextureView,
}

impl LampsGpu {
    /// Whether any lamp may light what lies in a box of the world.
    #[must_use]
    pub fn light(&self, bounds: (Vec3, Vec3)) -> bool {
        may_light(&self.lamps, bounds)
    }

    /// Whether any lamp is lit.
    #[must_use]
    pub fn any(&self) -> bool {
        !self.lamps.is_empty()
    }

    /// What the shaders bind: the uniform, and the maps of stone and actors; and a number that changes with them. Without lamps it is as much, with nothing
    /// in it.
    pub fn bindings(&mut self, device: &RenderDevice) -> (u64, &Buffer, [&TextureView; 2]) {
        let uniform = self.uniform.get_or_insert_with(|| {
            device.create_buffer(&BufferDescriptor {
                label: Some("lamps"),
                size: LAMPS_BYTES as u64,
                usage: BufferUsages::UNIFORM | BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        });
        let maps = self.maps.get_or_insert_with(|| {
            self.serial += 1;
            Maps::new(device, 0)
        });
        (self.serial, uniform, [&maps.stone, &maps.actors])
    }
}

impl Maps {
    /// Maps with so many rows of tiles; without any, of a single texel.
    fn new(device: &RenderDevice, rows: u32) -> Self {
        let [width, height] = [TILES_ACROSS * rows.min(1), rows].map(|tiles| (tiles * TILE_PX).max(1));
        let map = |label| depth_map(device, label, width, height);
        Self { rows, stone: map("lamps_stone_depth"), actors: map("lamps_actors_depth") }
    }
}

/// Takes the frame's lamps to the GPU.
#[expect(clippy::too_many_arguments, reason = "a system's arguments are its resources")]
pub fn prepare_lamps(
    lamps: Option<Res<Lamps>>,
    stage: Res<StageFrame>,
    mut stone: ResMut<StageGpu>,
    mut gpu: ResMut<LampsGpu>,
    mut pipelines: ResMut<StagePipelines>,
    mut cache: ResMut<PipelineCache>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
) {
    let gpu = &mut *gpu;
    let lit = lamps.map_or(Vec::new(), |lamps| lit(lamps.all()));
    let wanted = tiles(&lit);
    // how bright a lamp is does not change its shadows
    gpu.lamps = lit;
    if gpu.tiles.iter().map(|tile| tile.tile).ne(wanted.iter().copied()) {
        let layout = cache.get_bind_group_layout(&pipelines.caster_layout);
        let made = wanted.into_iter().map(|tile| {
            let bytes = bytemuck::bytes_of(&tile.clip_from_world);
            let matrix = device.create_buffer_with_data(&BufferInitDescriptor {
                label: Some("lamp_tile"),
                contents: bytes,
                usage: BufferUsages::UNIFORM,
            });
            let group = device.create_bind_group("lamp_tile", &layout, &BindGroupEntries::single(matrix.as_entire_binding()));
            TileGpu { tile, group }
        });
        gpu.tiles = made.collect();
        let rows = gpu.tiles.len().div_ceil(TILES_ACROSS as usize) as u32;
        if gpu.maps.as_ref().is_none_or(|maps| maps.rows != rows) {
            gpu.maps = Some(Maps::new(&device, rows));
            gpu.serial += 1;
        }
        (gpu.stone_is_drawn, gpu.actors_are_drawn) = (false, true);
    }
    let Some(feed) = &stage.feed else { return };
    if gpu.stone_of != feed.serial {
        (gpu.stone_of, gpu.stone_is_drawn) = (feed.serial, false);
    }
    if gpu.lamps.is_empty() {
        return;
    }
    gpu.pipeline = Some(pipelines.caster(&mut cache));
    let tiles: Vec<Tile> = gpu.tiles.iter().map(|tile| tile.tile).collect();
    let uniform = LampsUniform::new(&gpu.lamps, &tiles, stage.exposure_stops.exp2());
    let (_, buffer, _) = gpu.bindings(&device);
    queue.write_buffer(buffer, 0, bytemuck::bytes_of(&uniform));
    if feed.has_pages() {
        let pipeline = pipelines.normals(&mut cache, feed.layout);
        let layout = cache.get_bind_group_layout(&pipelines.normals_layout);
        stone.want_normals(&device, pipeline, &layout);
    }
}

/// Draws the depth of stone and actors from the lamps.
pub fn cast_shadows(
    mut gpu: ResMut<LampsGpu>,
    mut stone: ResMut<StageGpu>,
    stage: Res<StageFrame>,
    (actors, covers): (Res<ActorsGpu>, Res<CoversGpu>),
    cache: Res<PipelineCache>,
    mut context: RenderContext,
) {
    let gpu = &mut *gpu;
    let encoder = context.command_encoder();
    if make_normals(encoder, &stone, &cache) {
        stone.made_normals();
    }
    let (Some(maps), Some(id)) = (&gpu.maps, gpu.pipeline) else { return };
    let Some(pipeline) = cache.get_render_pipeline(id).filter(|_| !gpu.tiles.is_empty()) else { return };
    // The stone when all of it is there; until then it casts no shadows.
    let there = stage.feed.as_ref().is_some_and(|feed| feed.has_pages());
    if there && (!gpu.stone_is_drawn || gpu.covers != covers.serial()) {
        (gpu.stone_is_drawn, gpu.covers) = (true, covers.serial());
        let mut clear = true;
        for (number, tile) in gpu.tiles.iter().enumerate() {
            let seen = Seen::clusters(&stone.chunks, &clusters_in(&stone, &covers, &tile.tile.clip_from_world), &[]);
            for draws in seen.parts(PASS_TRIANGLES) {
                let mut pass = begin(encoder, "lamps_stone_depth", &maps.stone, clear);
                clear = false;
                aim(&mut pass, pipeline, number, tile);
                let mut bound = Bound::default();
                draws.iter().for_each(|draw| bound.draw(&mut pass, &stone, None, draw, 0));
            }
        }
    }
    let near = |tile: &Tile| actors.in_view(&frustum_planes(&tile.clip_from_world));
    let any = gpu.tiles.iter().any(|tile| near(&tile.tile).next().is_some());
    // What stood in it in the last frame is cleared away.
    if any || gpu.actors_are_drawn {
        let mut pass = begin(encoder, "lamps_actors_depth", &maps.actors, true);
        for (number, tile) in gpu.tiles.iter().enumerate() {
            aim(&mut pass, pipeline, number, tile);
            near(&tile.tile).for_each(|actor| actor.draw_depth(&mut pass));
        }
        gpu.actors_are_drawn = any;
    }
}

/// Makes the normals that are wanted, if their pipeline is there.
fn make_normals(encoder: &mut CommandEncoder, stone: &StageGpu, cache: &PipelineCache) -> bool {
    let Some((id, pages)) = stone.without_normals() else { return false };
    let Some(pipeline) = cache.get_compute_pipeline(id) else { return false };
    let mut pass = encoder.begin_compute_pass(&ComputePassDescriptor { label: Some("stone_normals"), timestamp_writes: None });
    pass.set_pipeline(pipeline);
    for (page, workgroups) in pages {
        pass.set_bind_group(0, &*page.bind_group, &[]);
        pass.dispatch_workgroups(workgroups, 1, 1);
    }
    true
}

/// Clusters of what casts shadows: of what is drawn, which the scan itself beside it would shade wherever it is not the same.
fn clusters_in(stone: &StageGpu, covers: &CoversGpu, clip_from_world: &Mat4) -> Vec<ClusterRef> {
    let planes = frustum_planes(clip_from_world);
    let of_chunk = |(chunk, gpu): (usize, &GpuChunk)| {
        let meets = gpu.kept.clusters.iter().enumerate().filter(|(_, cluster)| cluster.meets(&planes));
        meets.map(|(cluster, _)| ClusterRef { chunk: chunk as u32, cluster: cluster as u32 }).collect::<Vec<_>>()
    };
    let casts = |(_, gpu): &(usize, &GpuChunk)| covers.part(gpu.part).sight.casts();
    stone.drawn().iter().enumerate().filter(casts).flat_map(of_chunk).collect()
}

/// Lets what follows be drawn into a tile.
fn aim(pass: &mut RenderPass<'_>, pipeline: &wgpu::RenderPipeline, number: usize, tile: &TileGpu) {
    let [x, y] = [number as u32 % TILES_ACROSS, number as u32 / TILES_ACROSS].map(|at| (at * TILE_PX) as f32);
    pass.set_pipeline(pipeline);
    pass.set_viewport(x, y, TILE_PX as f32, TILE_PX as f32, 0.0, 1.0);
    pass.set_bind_group(0, &*tile.group, &[]);
}
