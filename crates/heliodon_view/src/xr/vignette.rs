//! Comfort: the edge of the view is dark while one is carried, which keeps most people from getting sick.
//!
//! Ajoy S. Fernandes, Steven K. Feiner: "Combating VR sickness through subtle dynamic field-of-view modification", IEEE 3DUI 2016. It comes and goes
//! slowly enough not to be noticed as such. A pass of its own over each eye's picture; while nobody is carried there is none.

use super::HeadsetSettings;
use super::turn::Carried;
use crate::fullscreen::{self, Fullscreen, FullscreenPipelines};
use bevy::core_pipeline::schedule::{Core3d, Core3dSystems};
use bevy::prelude::*;
use bevy::render::extract_component::{ExtractComponent, ExtractComponentPlugin};
use bevy::render::render_resource::binding_types::uniform_buffer_sized;
use bevy::render::render_resource::*;
use bevy::render::renderer::{RenderContext, RenderDevice, RenderQueue, ViewQuery};
use bevy::render::view::{ExtractedView, Msaa, ViewTarget};
use bevy::render::{Render, RenderApp, RenderSystems};
use bytemuck::{Pod, Zeroable};
use std::num::NonZeroU64;

const VIGNETTE_WGSL: &str = include_str!("vignette.wgsl");

const PASS: Fullscreen = Fullscreen {
    uuid: 0x9d41_c0b6_53fe_4a02_8b7e_2d15_64ac_f390,
    name: "vignette",
    wgsl: VIGNETTE_WGSL,
    blend: Some(BlendState {
        color: BlendState::ALPHA_BLENDING.color,
        // The runtime lays the picture over nothing by it.
        alpha: BlendComponent { src_factor: BlendFactor::Zero, dst_factor: BlendFactor::One, operation: BlendOperation::Add },
    }),
};

/// What is left bright at full strength, and where the darkness is full: half angles of 25 and 45 degrees.
const BRIGHT_TAN: f32 = 0.466;
const DARK_TAN: f32 = 1.0;

/// It is at its strongest from so fast a motion on.
const FULL_SPEED_M_S: f32 = 1.0;
const FULL_TURN_RAD_S: f32 = 0.5;

/// How quickly it comes and goes, per second.
const COMES: f32 = 6.0;
const GOES: f32 = 2.0;

/// Less is nothing.
const LEAST: f32 = 1.0 / 255.0;

/// How far the edge of a camera's view is darkened, 0 to 1.
#[derive(Component, Clone, Copy, Debug, Default, PartialEq, ExtractComponent)]
#[extract_component_sync_target((Self, Darkening))]
pub struct Vignette(pub f32);

/// `Vignette` of vignette.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
struct VignetteUniform {
    tangent_from_clip: [f32; 4],
    edge: [f32; 4],
}

const VIGNETTE_BYTES: usize = 32;
const _: () = assert!(size_of::<VignetteUniform>() == VIGNETTE_BYTES);

impl VignetteUniform {
    fn new(clip_from_view: &Mat4, strength: f32) -> Self {
        let scale = Vec2::new(1.0 / clip_from_view.x_axis.x, 1.0 / clip_from_view.y_axis.y);
        let offset = Vec2::new(clip_from_view.z_axis.x, clip_from_view.z_axis.y) * scale;
        Self { tangent_from_clip: [scale.x, scale.y, offset.x, offset.y], edge: [BRIGHT_TAN, DARK_TAN, strength, 0.0] }
    }
}

/// A camera's pass, in the render world.
#[derive(Component)]
pub struct Darkening {
    pipeline: CachedRenderPipelineId,
    buffer: Buffer,
    group: BindGroup,
    is_on: bool,
}

#[derive(Resource)]
struct VignettePipelines(FullscreenPipelines);

impl Default for VignettePipelines {
    fn default() -> Self {
        let entries = (uniform_buffer_sized(false, NonZeroU64::new(VIGNETTE_BYTES as u64)),);
        let layout = BindGroupLayoutDescriptor::new(
            "vignette",
            &BindGroupLayoutEntries::sequential(ShaderStages::VERTEX_FRAGMENT, entries),
        );
        Self(FullscreenPipelines::new(PASS, layout))
    }
}

/// Darkens the view of whoever is carried.
#[derive(Default)]
pub(super) struct VignettePlugin;

impl Plugin for VignettePlugin {
    fn build(&self, app: &mut App) {
        app.add_plugins(ExtractComponentPlugin::<Vignette>::default()).add_systems(PostUpdate, follow);
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else { return };
        render_app
            .init_resource::<VignettePipelines>()
            .add_systems(Render, prepare.in_set(RenderSystems::PrepareBindGroups))
            .add_systems(Core3d, darken.in_set(Core3dSystems::PostProcess));
    }
}

/// How strong it is `seconds` after it was `before`, of at most `most`.
fn followed(before: f32, carried: &Carried, most: f32, seconds: f32) -> f32 {
    let motion = (carried.speed_m_s / FULL_SPEED_M_S).max(carried.turn_rad_s / FULL_TURN_RAD_S);
    let wanted = motion.clamp(0.0, 1.0) * most;
    let rate = if wanted > before { COMES } else { GOES };
    let now = wanted + (before - wanted) * (-rate * seconds).exp();
    if now < LEAST && wanted == 0.0 { 0.0 } else { now }
}

fn follow(time: Res<Time>, carried: Res<Carried>, settings: Res<HeadsetSettings>, mut eyes: Query<&mut Vignette>) {
    for mut vignette in &mut eyes {
        let now = followed(vignette.0, &carried, settings.comfort.vignette as f32, time.delta_secs());
        vignette.set_if_neq(Vignette(now));
    }
}

/// An eye and its pass.
type DarkenedView = (Entity, &'static Vignette, &'static ExtractedView, &'static Msaa, Option<&'static mut Darkening>);

fn prepare(
    mut commands: Commands,
    mut views: Query<DarkenedView>,
    mut pipelines: ResMut<VignettePipelines>,
    mut cache: ResMut<PipelineCache>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
) {
    for (entity, vignette, view, msaa, darkening) in &mut views {
        let is_on = vignette.0 >= LEAST;
        let pipeline = pipelines.0.pipeline(&mut cache, view.target_format, msaa.samples());
        let uniform = VignetteUniform::new(&view.clip_from_view, vignette.0);
        match darkening {
            Some(mut darkening) => {
                (darkening.is_on, darkening.pipeline) = (is_on, pipeline);
                if is_on {
                    queue.write_buffer(&darkening.buffer, 0, bytemuck::bytes_of(&uniform));
                }
            }
            None => {
                let buffer = device.create_buffer_with_data(&BufferInitDescriptor {
                    label: Some("vignette"),
                    contents: bytemuck::bytes_of(&uniform),
                    usage: BufferUsages::UNIFORM | BufferUsages::COPY_DST,
                });
                let layout = cache.get_bind_group_layout(&pipelines.0.layout);
                let group =
                    device.create_bind_group("vignette", &layout, &BindGroupEntries::single(buffer.as_entire_buffer_binding()));
                commands.entity(entity).insert(Darkening { pipeline, buffer, group, is_on });
            }
        }
    }
}

fn darken(view: ViewQuery<(&ViewTarget, &Darkening)>, cache: Res<PipelineCache>, mut context: RenderContext) {
    let (target, darkening) = view.into_inner();
    let Some(pipeline) = cache.get_render_pipeline(darkening.pipeline).filter(|_| darkening.is_on) else { return };
    fullscreen::draw(&mut context, target, "vignette", pipeline, &darkening.group);
}

#[cfg(test)]
mod tests {
    use super::*;
    use bevy::camera::CameraProjection;

    #[test]
    fn it_comes_and_goes_smoothly() {
        let carried = Carried { speed_m_s: 2.0, turn_rad_s: 0.0 };
        let rest = Carried::default();
        let mut strength = 0.0;
        for _ in 0..100 {
            let next = followed(strength, &carried, 0.7, 0.02);
            assert!(next > strength && next - strength < 0.1 && next <= 0.7);
            strength = next;
        }
        assert!(strength > 0.69);
        let mut frames = 0;
        while strength > 0.0 {
            let next = followed(strength, &rest, 0.7, 0.02);
            assert!(strength - next < 0.05);
            (strength, frames) = (next, frames + 1);
        }
        assert!((50..200).contains(&frames), "{frames}");
        assert_eq!(followed(0.0, &carried, 0.0, 1.0), 0.0, "switched off");
    }

    #[test]
    fn tangents_are_those_of_the_view() {
        // Of an eye that sees farther outwards and down.
        let fov = bevy_mod_xr::camera::Fov { angle_left: -0.9, angle_right: 0.7, angle_down: -0.8, angle_up: 0.6 };
        let clip_from_view = bevy_mod_xr::camera::calculate_projection(0.05, fov);
        let [x, y, dx, dy] = VignetteUniform::new(&clip_from_view, 1.0).tangent_from_clip;
        for (clip, angle) in [(-1.0, -0.9_f32), (1.0, 0.7)] {
            assert!((clip * x + dx - angle.tan()).abs() < 1e-5);
        }
        for (clip, angle) in [(-1.0, -0.8_f32), (1.0, 0.6)] {
            assert!((clip * y + dy - angle.tan()).abs() < 1e-5);
        }
        let plain = PerspectiveProjection::default().get_clip_from_view();
        assert_eq!(VignetteUniform::new(&plain, 1.0).tangent_from_clip[2..], [0.0, 0.0]);
    }

    #[test]
    fn the_shader_is_valid() {
        let module = naga::front::wgsl::parse_str(VIGNETTE_WGSL)
            .unwrap_or_else(|error| panic!("{}", error.emit_to_string(VIGNETTE_WGSL)));
        naga::valid::Validator::new(naga::valid::ValidationFlags::all(), naga::valid::Capabilities::empty())
            .validate(&module)
            .unwrap_or_else(|error| panic!("{}", error.emit_to_string(VIGNETTE_WGSL)));
        let size = module.types.iter().find_map(|(_, ty)| match (&ty.inner, ty.name.as_deref()) {
            (naga::TypeInner::Struct { span, .. }, Some("Vignette")) => Some(*span as usize),
            _ => None,
        });
        assert_eq!(size, Some(VIGNETTE_BYTES));
    }
}
