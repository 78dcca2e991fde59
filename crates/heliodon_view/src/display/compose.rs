//! The way from both eyes' pictures to what a monitor, a projector or an image shows.
//!
//! Each eye's picture is drawn whole, into a texture of its own: on processors that is the quick way of drawing (docs/decisions/008-drawing-stone.md),
//! and it lets every kind of stereo, blending and correction be one small pass. That pass costs 3 ms for 1024x768 pixels on llvmpipe.

use crate::fullscreen::{self, Fullscreen, FullscreenPipelines};
use bevy::core_pipeline::core_3d::main_opaque_pass_3d;
use bevy::core_pipeline::schedule::{Core3d, Core3dSystems};
use bevy::prelude::*;
use bevy::render::extract_component::{ExtractComponent, ExtractComponentPlugin};
use bevy::render::render_asset::RenderAssets;
use bevy::render::render_resource::binding_types::{sampler, texture_2d, uniform_buffer_sized};
use bevy::render::render_resource::*;
use bevy::render::renderer::{RenderContext, RenderDevice, ViewQuery};
use bevy::render::texture::{FallbackImage, GpuImage};
use bevy::render::view::{ExtractedView, ViewTarget};
use bevy::render::{Render, RenderApp, RenderSystems};
use bytemuck::{Pod, Zeroable};
use heliodon_bundle::display::{ScreenEntry, Stereo};
use std::num::NonZeroU64;

/// The pass's shader.
pub(crate) const COMPOSE_WGSL: &str = include_str!("compose.wgsl");

const PASS: Fullscreen =
    Fullscreen { uuid: 0x2f6b_0d55_91c8_4e17_a3d4_77e0_5b1c_9a68, name: "compose", wgsl: COMPOSE_WGSL, blend: None };

/// `Compose` of compose.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct ComposeUniform {
    how: [u32; 4],
    blend: [f32; 4],
    gain: [f32; 4],
    power: [f32; 4],
    black: [f32; 4],
}

/// Size of `Compose` in compose.wgsl, which a test compares with what the shader's compiler says.
pub(crate) const COMPOSE_BYTES: usize = 80;
const _: () = assert!(size_of::<ComposeUniform>() == COMPOSE_BYTES);

fn mode(stereo: Stereo) -> u32 {
    match stereo {
        // A pair has an output for each eye, each of which shows one picture.
        Stereo::Mono | Stereo::Pair | Stereo::Left | Stereo::Right => 0,
        Stereo::SideBySide => 1,
        Stereo::TopBottom => 2,
        Stereo::Rows => 3,
        Stereo::Columns => 4,
        Stereo::Checkerboard => 5,
        Stereo::Anaglyph => 6,
    }
}

impl ComposeUniform {
    fn new(screen: &ScreenEntry, has_overlay: bool) -> Self {
        let four = |[r, g, b]: [f64; 3], a: f64| [r, g, b, a].map(|v| v as f32);
        let (blend, colour) = (&screen.blend, &screen.colour);
        Self {
            how: [mode(screen.stereo), u32::from(has_overlay), 0, 0],
            blend: [blend.left, blend.right, blend.top, blend.bottom].map(|v| v as f32),
            gain: four(colour.gain, blend.gamma),
            power: four(colour.gamma, 1.0),
            black: four(colour.black, 0.0),
        }
    }
}

/// A camera that draws nothing but a screen's pictures, brought to its output.
#[derive(Component, Clone, Debug, ExtractComponent)]
#[extract_component_sync_target((Self, Composition))]
pub struct Composer {
    /// The pictures of the left and the right eye; of the first alone where the output shows one.
    pub eyes: [Handle<Image>; 2],
    /// Text and timeline, transparent around them.
    pub overlay: Option<Handle<Image>>,
    uniform: ComposeUniform,
}

impl Composer {
    /// Of a screen's pictures.
    #[must_use]
    pub fn new(screen: &ScreenEntry, eyes: [Handle<Image>; 2], overlay: Option<Handle<Image>>) -> Self {
        Self { eyes, uniform: ComposeUniform::new(screen, overlay.is_some()), overlay }
    }
}

/// The pass's pipelines.
#[derive(Resource)]
struct ComposePipelines(FullscreenPipelines);

impl Default for ComposePipelines {
    fn default() -> Self {
        let image = || texture_2d(TextureSampleType::Float { filterable: true });
        let entries = (
            uniform_buffer_sized(false, NonZeroU64::new(COMPOSE_BYTES as u64)),
            image(),
            image(),
            image(),
            sampler(SamplerBindingType::Filtering),
        );
        let layout =
            BindGroupLayoutDescriptor::new("compose", &BindGroupLayoutEntries::sequential(ShaderStages::FRAGMENT, entries));
        Self(FullscreenPipelines::new(PASS, layout))
    }
}

/// What a composer's pass needs, in the render world.
#[derive(Component)]
pub struct Composition {
    pipeline: CachedRenderPipelineId,
    group: BindGroup,
    /// What the group is of.
    of: ([TextureViewId; 3], ComposeUniform),
}

/// Draws [`Composer`]s.
#[derive(Default)]
pub(super) struct ComposePlugin;

impl Plugin for ComposePlugin {
    fn build(&self, app: &mut App) {
        app.add_plugins(ExtractComponentPlugin::<Composer>::default());
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else { return };
        render_app
            .init_resource::<ComposePipelines>()
            .add_systems(Render, prepare.in_set(RenderSystems::PrepareBindGroups))
            .add_systems(Core3d, compose.in_set(Core3dSystems::MainPass).before(main_opaque_pass_3d));
    }
}

fn prepare(
    mut commands: Commands,
    composers: Query<(Entity, &Composer, &ExtractedView, Option<&Composition>)>,
    mut pipelines: ResMut<ComposePipelines>,
    mut cache: ResMut<PipelineCache>,
    images: Res<RenderAssets<GpuImage>>,
    fallback: Res<FallbackImage>,
    device: Res<RenderDevice>,
) {
    for (entity, composer, view, before) in &composers {
        let picture = |handle: &Handle<Image>| images.get(handle).map(|image| &image.texture_view);
        let [Some(left), Some(right)] = composer.eyes.each_ref().map(picture) else { continue };
        let overlay = composer.overlay.as_ref().and_then(picture).unwrap_or(&fallback.d2.texture_view);
        let of = ([left, right, overlay].map(|view| view.id()), composer.uniform);
        let pipeline = pipelines.0.pipeline(&mut cache, view.target_format, 1);
        if before.is_some_and(|before| before.of == of && before.pipeline == pipeline) {
            continue;
        }
        let sampler = pipelines.0.sampler(&device);
        let buffer = device.create_buffer_with_data(&BufferInitDescriptor {
            label: Some("compose"),
            contents: bytemuck::bytes_of(&composer.uniform),
            usage: BufferUsages::UNIFORM,
        });
        let layout = cache.get_bind_group_layout(&pipelines.0.layout);
        let entries = BindGroupEntries::sequential((buffer.as_entire_buffer_binding(), left, right, overlay, &sampler));
        let group = device.create_bind_group("compose", &layout, &entries);
        commands.entity(entity).insert(Composition { pipeline, group, of });
    }
}

fn compose(view: ViewQuery<(&ViewTarget, &Composition)>, cache: Res<PipelineCache>, mut context: RenderContext) {
    let (target, composition) = view.into_inner();
    let Some(pipeline) = cache.get_render_pipeline(composition.pipeline) else { return };
    fullscreen::draw(&mut context, target, "compose", pipeline, &composition.group);
}
