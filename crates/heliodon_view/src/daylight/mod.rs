//! The stone in its light: our own passes beside Bevy's.
//!
//! Michael Callieri, Paul Debevec, Jarrell Pair, Roberto Scopigno: "A realtime immersive application with realistic lighting:
//! The Parthenon", Computers & Graphics 30, 2006, section 4. A vertex's light is worked out by a compute shader once for each
//! moment, and only where it is seen; drawing then reads position, light and albedo, 24 bytes a vertex, and the
//! fragment multiplies light by albedo. Why this split, and what it costs, is in docs/decisions/008-drawing-stone.md.

pub(crate) mod allocator;
pub mod chunk;
pub mod closed;
pub mod cluster;
pub(crate) mod depth_map;
mod encoded;
mod flat;
pub mod key;
pub mod layout;
mod lit;
pub mod moment;
mod multiview;
mod occlusion;
pub mod pages;
pub mod parts;
pub(crate) mod pass;
pub(crate) mod pipelines;
mod pixels;
pub(crate) mod prepare;
mod raster;
mod relight;
mod scan;
pub(crate) mod seen;
#[cfg(test)]
pub(crate) mod shader_tests;
pub mod sight;
mod slot;
pub(crate) mod texels;
pub mod view;

pub use multiview::{OnePassPairs, StereoPasses};

use crate::costs::FrameTold;
use crate::stage::frame::StageFrame;
use bevy::camera::{Camera3d, CameraMainTextureUsages};
use bevy::core_pipeline::core_3d::main_opaque_pass_3d;
use bevy::core_pipeline::schedule::{Core3d, Core3dSystems, camera_driver};
use bevy::core_pipeline::tonemapping::{DebandDither, Tonemapping};
use bevy::light::cluster::GlobalClusterSettings;
use bevy::prelude::*;
use bevy::render::extract_component::{ExtractComponent, ExtractComponentPlugin};
use bevy::render::extract_resource::ExtractResourcePlugin;
use bevy::render::renderer::{RenderAdapterInfo, RenderGraph};
use bevy::render::view::Msaa;
use bevy::render::{Render, RenderApp, RenderSystems};
use wgpu::{DeviceType, TextureUsages};

/// A camera that sees the stage. It writes display values itself, so Bevy's tone mapping and dithering are off; multisampling
/// is off unless you ask for it.
#[derive(Component, Clone, Copy, Debug, Default, ExtractComponent)]
#[extract_component_sync_target((Self, prepare::StageView))]
#[require(
    Camera3d,
    Tonemapping = Tonemapping::None,
    DebandDither = DebandDither::Disabled,
    Msaa = Msaa::Off,
    bevy::camera::Exposure
)]
pub struct DaylightCamera;

/// For a [`DaylightCamera`] whose pictures must be the same to the bit whatever it saw before, as stills and films are: where a processor
/// draws, an eye at rest is otherwise lit pixel by pixel, which is up to a code of 255 off. One of them is to be there before a bundle is opened whose scan itself it is to see.
#[derive(Component, Clone, Copy, Debug, Default, ExtractComponent)]
pub struct ExactAtRest;

/// For the two [`DaylightCamera`]s that are the eyes of one head, under one number: what is left out for being small is the same for both, nothing is left
/// out that one of them sees, and details fade at the same places. Else an object on the verge would be in one eye's picture and not in
/// the other's, which shimmers. What both draw is found once, and drawn in one pass where [`StereoPasses`] says so.
#[derive(Component, Clone, Copy, Debug, Default, PartialEq, Eq, Hash, ExtractComponent)]
pub struct StereoPair(pub u32);

/// Lights and draws the stone, and draws the sky behind it.
#[derive(Default)]
pub struct DaylightPlugin;

impl Plugin for DaylightPlugin {
    fn build(&self, app: &mut App) {
        let (told, one_pass) = (FrameTold::in_app(app), OnePassPairs::default());
        app.init_resource::<StageFrame>().init_resource::<StereoPasses>().insert_resource(one_pass.clone()).add_plugins((
            ExtractResourcePlugin::<StageFrame>::default(),
            ExtractResourcePlugin::<StereoPasses>::default(),
            ExtractComponentPlugin::<DaylightCamera>::default(),
            ExtractComponentPlugin::<ExactAtRest>::default(),
            ExtractComponentPlugin::<StereoPair>::default(),
        ));
        app.add_systems(PostUpdate, let_textures_be_copied);
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else { return };
        render_app
            .init_resource::<prepare::StageGpu>()
            .insert_resource(one_pass)
            .init_resource::<pipelines::StagePipelines>()
            .add_systems(
                Render,
                (
                    told.of("stone", prepare::receive),
                    told.of("culling", prepare::prepare_views),
                    told.of("stone", prepare::prepare_light),
                )
                    .chain()
                    .in_set(RenderSystems::PrepareResources),
            )
            .add_systems(RenderGraph, pass::light_stage.before(camera_driver))
            .add_systems(Core3d, pass::draw_stage.in_set(Core3dSystems::MainPass).before(main_opaque_pass_3d));
    }

    fn finish(&self, app: &mut App) {
        // Bevy 0.19 sorts its own lights on the GPU, also where there are none, and keeps a handle of a buffer for every camera of every frame
        // (bevy_pbr's `metadata_staging_pending_buffers`, which nothing ever empties): an installation would grow by 6 MB an hour. Guests' few lights cost the processor nothing.
        if let Some(mut clusters) = app.world_mut().get_resource_mut::<GlobalClusterSettings>() {
            clusters.gpu_clustering = None;
        }
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else { return };
        let software =
            render_app.world().get_resource::<RenderAdapterInfo>().is_some_and(|info| info.device_type == DeviceType::Cpu);
        if software {
            render_app.world_mut().resource_mut::<prepare::StageGpu>().software = true;
        }
    }
}

/// The depth of a camera that finds out what is hidden is copied (occlusion.rs), and into its picture what was drawn in codes (encoded.rs).
fn let_textures_be_copied(
    info: Option<Res<RenderAdapterInfo>>,
    mut cameras: Query<(&mut Camera3d, &mut CameraMainTextureUsages), Added<DaylightCamera>>,
) {
    if info.is_some_and(|info| info.device_type == DeviceType::Cpu) {
        for (mut camera, mut usages) in &mut cameras {
            camera.depth_texture_usages.0 |= TextureUsages::COPY_SRC.bits();
            usages.0 |= TextureUsages::COPY_DST;
        }
    }
}
