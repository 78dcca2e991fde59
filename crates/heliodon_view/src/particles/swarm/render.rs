//! Swarms in the render world: what they are told of their light, and where they are drawn.
//!
//! bevy_hanabi draws into the transparent phase of a view, with a pipeline for that view's target and the depth that its camera wrote. A camera's target holds display values, to which light cannot be added. So each
//! camera has a twin: a view with the same projection whose target is the air's picture of light. Nothing but swarms is queued for it, and we draw its phase ourselves, before the air's quads.

use super::SwarmShown;
use crate::daylight::DaylightCamera;
use crate::particles::render::{AirFrame, AirGpu};
use crate::particles::sun_map::SunMap;
use bevy::asset::AssetId;
use bevy::camera::{MainPassResolutionOverride, Viewport};
use bevy::core_pipeline::core_3d::Transparent3d;
use bevy::core_pipeline::schedule::{Core3d, Core3dSystems};
use bevy::prelude::*;
use bevy::render::camera::ExtractedCamera;
use bevy::render::render_asset::RenderAssets;
use bevy::render::render_phase::{CachedRenderPipelinePhaseItem, PhaseItem, SortedRenderPhase, ViewSortedRenderPhases};
use bevy::render::render_resource::*;
use bevy::render::renderer::{RenderContext, RenderDevice, RenderQueue, ViewQuery};
use bevy::render::sync_world::MainEntity;
use bevy::render::texture::GpuImage;
use bevy::render::view::{
    ExtractedView, Msaa, RenderVisibleEntities, RenderVisibleEntitiesClass, RetainedViewEntity, ViewDepthTexture,
};
use bevy::render::{Render, RenderSystems};
use bevy_hanabi::EffectVisibilityClass;
use std::any::TypeId;
use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::Ordering;

/// Adds what draws swarms.
pub fn build(render_app: &mut SubApp) {
    render_app
        .init_resource::<SwarmGpu>()
        .add_systems(
            Render,
            (
                open_twins.in_set(RenderSystems::PrepareViews),
                prepare.in_set(RenderSystems::PrepareBindGroups),
                tell_drawable.in_set(RenderSystems::Cleanup),
            ),
        )
        .add_systems(Core3d, draw.in_set(Core3dSystems::EarlyPostProcess).before(crate::particles::render::draw));
}

/// Render world: swarms.
#[derive(Resource, Default)]
pub struct SwarmGpu {
    /// Of cameras, each one's.
    twins: HashMap<Entity, Entity>,
    /// The maps of the sun that textures hold.
    maps: HashMap<AssetId<Image>, Arc<SunMap>>,
    /// Pictures of cameras with several samples a pixel.
    fine: HashMap<Entity, Texture>,
}

/// The twin of a camera's view.
fn twin_of(main: MainEntity) -> RetainedViewEntity {
    RetainedViewEntity::new(main, Some(main), 0)
}

/// What a twin is made like.
type TwinCamera = (Entity, &'static MainEntity, &'static ExtractedView, &'static Msaa);

/// Gives each camera that may see swarms its twin, and takes it away. What is not there yet is queued for it, too, for its pipelines are made for those who see it.
fn open_twins(
    mut commands: Commands,
    frame: Res<AirFrame>,
    mut gpu: ResMut<SwarmGpu>,
    mut phases: ResMut<ViewSortedRenderPhases<Transparent3d>>,
    cameras: Query<TwinCamera, (With<DaylightCamera>, With<ExtractedCamera>)>,
) {
    let any = !(frame.swarms.is_empty() && frame.unready.is_empty());
    gpu.twins.retain(|camera, twin| {
        let kept = any && cameras.contains(*camera);
        if !kept {
            commands.entity(*twin).despawn();
        }
        kept
    });
    if !any {
        return;
    }
    let all = frame.swarms.iter().map(|swarm| swarm.entity).chain(frame.unready.iter().map(|swarm| swarm.entity));
    let seen: Vec<(Entity, MainEntity)> = all.map(|entity| (Entity::PLACEHOLDER, MainEntity::from(entity))).collect();
    for (camera, main, view, msaa) in &cameras {
        let retained_view_entity = twin_of(*main);
        phases.insert(retained_view_entity, default());
        let mut visible = RenderVisibleEntities::default();
        let class = RenderVisibleEntitiesClass { entities_cpu_culling: seen.clone(), ..default() };
        visible.classes.insert(TypeId::of::<EffectVisibilityClass>(), class);
        let twin = ExtractedView {
            retained_view_entity,
            clip_from_view: view.clip_from_view,
            world_from_view: view.world_from_view,
            clip_from_world: view.clip_from_world,
            target_format: TextureFormat::Rgba16Float,
            viewport: view.viewport,
            color_grading: view.color_grading.clone(),
            invert_culling: view.invert_culling,
        };
        let entity = *gpu.twins.entry(camera).or_insert_with(|| commands.spawn_empty().id());
        commands.entity(entity).insert((twin, visible, *msaa));
    }
}

/// Tells which swarms every camera could draw now: the device takes none over that would then be seen by nobody while a pipeline is compiled.
fn tell_drawable(
    frame: Res<AirFrame>,
    gpu: Res<SwarmGpu>,
    phases: Res<ViewSortedRenderPhases<Transparent3d>>,
    cache: Res<PipelineCache>,
    cameras: Query<&MainEntity>,
) {
    let seen_by = || gpu.twins.keys().map(|camera| cameras.get(*camera).ok().and_then(|main| phases.get(&twin_of(*main))));
    for unready in frame.unready.iter() {
        let is_it = |item: &&Transparent3d| item.main_entity() == MainEntity::from(unready.entity);
        let has_pipeline = |item: &Transparent3d| cache.get_render_pipeline(item.cached_pipeline()).is_some();
        let draws = |phase: Option<&SortedRenderPhase<Transparent3d>>| {
            phase.is_some_and(|phase| phase.items.values().find(is_it).is_some_and(has_pipeline))
        };
        unready.drawable.store(!gpu.twins.is_empty() && seen_by().all(draws), Ordering::Relaxed);
    }
}

/// Writes what swarms know of their light.
fn prepare(
    frame: Res<AirFrame>,
    (mut gpu, air): (ResMut<SwarmGpu>, Res<AirGpu>),
    images: Res<RenderAssets<GpuImage>>,
    (device, queue): (Res<RenderDevice>, Res<RenderQueue>),
    cameras: Query<(Entity, &Msaa), With<DaylightCamera>>,
) {
    let gpu = &mut *gpu;
    gpu.maps.retain(|known, _| frame.swarms.iter().any(|swarm| swarm.light == *known));
    gpu.fine.retain(|camera, _| !frame.swarms.is_empty() && cameras.contains(*camera));
    for SwarmShown { light, numbers, map, .. } in frame.swarms.iter() {
        let Some(image) = images.get(*light) else { continue };
        write(&queue, &image.texture, 0, bytemuck::cast_slice(numbers), UVec2::new(4 * numbers.len() as u32, 1));
        let Some(map) = map else { continue };
        if gpu.maps.get(light).is_none_or(|known| !Arc::ptr_eq(known, map)) {
            write(&queue, &image.texture, 1, bytemuck::cast_slice(map.depths()), map.size());
            gpu.maps.insert(*light, Arc::clone(map));
        }
    }
    for (camera, msaa) in &cameras {
        let Some(whole) = air.swarm_layer(camera).filter(|_| msaa.samples() > 1).map(|layer| layer.size()) else {
            gpu.fine.remove(&camera);
            continue;
        };
        if gpu.fine.get(&camera).is_none_or(|fine| fine.size() != whole || fine.sample_count() != msaa.samples()) {
            let fine = device.create_texture(&TextureDescriptor {
                label: Some("swarms"),
                size: whole,
                mip_level_count: 1,
                sample_count: msaa.samples(),
                dimension: TextureDimension::D2,
                format: TextureFormat::Rgba16Float,
                usage: TextureUsages::RENDER_ATTACHMENT,
                view_formats: &[],
            });
            gpu.fine.insert(camera, fine);
        }
    }
}

/// Writes numbers into a texture, from a row on.
fn write(queue: &RenderQueue, texture: &Texture, row: u32, bytes: &[u8], size: UVec2) {
    queue.write_texture(
        TexelCopyTextureInfo { origin: Origin3d { x: 0, y: row, z: 0 }, ..texture.as_image_copy() },
        bytes,
        TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(size.x * 4), rows_per_image: None },
        Extent3d { width: size.x, height: size.y, depth_or_array_layers: 1 },
    );
}

/// What drawing needs of a camera.
type SwarmCamera =
    (&'static ExtractedCamera, &'static MainEntity, &'static ViewDepthTexture, Option<&'static MainPassResolutionOverride>);

/// Draws what the current camera's twin sees into the air's picture, which begins with it.
fn draw(
    world: &World,
    view: ViewQuery<SwarmCamera>,
    (air, gpu): (Res<AirGpu>, Res<SwarmGpu>),
    phases: Res<ViewSortedRenderPhases<Transparent3d>>,
    mut context: RenderContext,
) {
    let entity = view.entity();
    let (camera, main, depth, resolution) = view.into_inner();
    let Some(layer) = air.swarm_layer(entity) else { return };
    let layer = layer.create_view(&TextureViewDescriptor::default());
    let fine = gpu.fine.get(&entity).map(|fine| fine.create_view(&TextureViewDescriptor::default()));
    let (view, resolve_target) = fine.as_ref().map_or((&layer, None), |fine| (fine, Some(&*layer)));
    let mut pass = context.begin_tracked_render_pass(RenderPassDescriptor {
        label: Some("swarms"),
        color_attachments: &[Some(RenderPassColorAttachment {
            view,
            depth_slice: None,
            resolve_target,
            ops: Operations { load: LoadOp::Clear(wgpu::Color::TRANSPARENT), store: StoreOp::Store },
        })],
        depth_stencil_attachment: Some(depth.get_attachment(StoreOp::Store)),
        ..default()
    });
    if let Some(viewport) = Viewport::from_viewport_and_override(camera.viewport.as_ref(), resolution) {
        pass.set_camera_viewport(&viewport);
    }
    let Some(phase) = phases.get(&twin_of(*main)) else { return };
    if let Err(why) = phase.render(&mut pass, world, entity) {
        error_once!("swarms cannot be drawn: {why}");
    }
}
