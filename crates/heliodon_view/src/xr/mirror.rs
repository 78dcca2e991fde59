//! A window on the desk that shows what the left eye sees, for those who stand beside.
//!
//! The eye's picture is shown, not drawn anew: a pass of a few megapixels in place of a third view of the stage.

use crate::display::NOTHING;
use crate::fullscreen::{self, Fullscreen, FullscreenPipelines};
use bevy::camera::visibility::RenderLayers;
use bevy::core_pipeline::core_3d::main_opaque_pass_3d;
use bevy::core_pipeline::schedule::{Core3d, Core3dSystems};
use bevy::core_pipeline::tonemapping::Tonemapping;
use bevy::prelude::*;
use bevy::render::RenderApp;
use bevy::render::extract_component::{ExtractComponent, ExtractComponentPlugin};
use bevy::render::render_resource::binding_types::{sampler, texture_2d};
use bevy::render::render_resource::*;
use bevy::render::renderer::{RenderContext, RenderDevice, ViewQuery};
use bevy::render::view::{ExtractedView, Msaa, ViewTarget};
use bevy::render::{Render, RenderSystems};
use bevy_mod_xr::camera::XrCamera;

const MIRROR_WGSL: &str = include_str!("mirror.wgsl");

const PASS: Fullscreen =
    Fullscreen { uuid: 0x3e8a_71d4_0c95_4b6f_a2d3_58e1_907c_b64d, name: "mirror", wgsl: MIRROR_WGSL, blend: None };

/// After both eyes.
const ORDER: isize = 1000;

/// A camera that shows what the left eye sees.
#[derive(Component, Clone, Copy, Debug, Default, ExtractComponent)]
#[extract_component_sync_target((Self, Mirrored))]
pub struct Mirror;

#[derive(Resource)]
struct MirrorPipelines(FullscreenPipelines);

impl Default for MirrorPipelines {
    fn default() -> Self {
        let entries = (texture_2d(TextureSampleType::Float { filterable: true }), sampler(SamplerBindingType::Filtering));
        let layout =
            BindGroupLayoutDescriptor::new("mirror", &BindGroupLayoutEntries::sequential(ShaderStages::FRAGMENT, entries));
        Self(FullscreenPipelines::new(PASS, layout))
    }
}

/// A mirror's pass, in the render world.
#[derive(Component)]
pub struct Mirrored {
    pipeline: CachedRenderPipelineId,
    sampler: Sampler,
}

/// Shows what the left eye sees.
#[derive(Default)]
pub(super) struct MirrorPlugin;

impl Plugin for MirrorPlugin {
    fn build(&self, app: &mut App) {
        app.add_plugins(ExtractComponentPlugin::<Mirror>::default());
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else { return };
        render_app
            .init_resource::<MirrorPipelines>()
            .add_systems(Render, prepare.in_set(RenderSystems::PrepareResources))
            .add_systems(Core3d, show.in_set(Core3dSystems::MainPass).before(main_opaque_pass_3d));
    }
}

/// Spawns the mirror's camera for the program's own window; text lies over it.
pub(super) fn spawn(world: &mut World) {
    let camera = Camera { order: ORDER, clear_color: ClearColorConfig::Custom(Color::BLACK), ..default() };
    world.spawn((
        Mirror,
        Camera3d::default(),
        Tonemapping::None,
        Msaa::Off,
        camera,
        RenderLayers::layer(NOTHING),
        IsDefaultUiCamera,
    ));
}

fn prepare(
    mut commands: Commands,
    mirrors: Query<(Entity, &ExtractedView), With<Mirror>>,
    mut pipelines: ResMut<MirrorPipelines>,
    mut cache: ResMut<PipelineCache>,
    device: Res<RenderDevice>,
) {
    for (entity, view) in &mirrors {
        let pipeline = pipelines.0.pipeline(&mut cache, view.target_format, 1);
        let sampler = pipelines.0.sampler(&device);
        commands.entity(entity).insert(Mirrored { pipeline, sampler });
    }
}

fn show(
    view: ViewQuery<(&ViewTarget, &Mirrored)>,
    eyes: Query<(&ViewTarget, &XrCamera)>,
    pipelines: Res<MirrorPipelines>,
    cache: Res<PipelineCache>,
    device: Res<RenderDevice>,
    mut context: RenderContext,
) {
    let (target, mirrored) = view.into_inner();
    let eye = eyes.iter().find(|(_, camera)| camera.0 == 0).map(|(eye, _)| eye.main_texture_view());
    // Before the first frame of a session there is nothing to show.
    let Some((pipeline, eye)) = cache.get_render_pipeline(mirrored.pipeline).zip(eye) else { return };
    let layout = cache.get_bind_group_layout(&pipelines.0.layout);
    let group = device.create_bind_group("mirror", &layout, &BindGroupEntries::sequential((eye, &mirrored.sampler)));
    fullscreen::draw(&mut context, target, "mirror", pipeline, &group);
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_shader_is_valid() {
        let source = super::MIRROR_WGSL;
        let module = naga::front::wgsl::parse_str(source).unwrap_or_else(|error| panic!("{}", error.emit_to_string(source)));
        naga::valid::Validator::new(naga::valid::ValidationFlags::all(), naga::valid::Capabilities::empty())
            .validate(&module)
            .unwrap_or_else(|error| panic!("{}", error.emit_to_string(source)));
    }
}
