//! The dome: the bundle's sky maps, cross-faded, and a sharp sun where they leave it out.
//!
//! At most three maps are resident: the two between which the moment lies, and the one that comes next. They are loaded in the
//! background; while one is missing, its neighbour stands in.

pub(crate) mod pack;
mod residency;

use crate::daylight::view::{Eye, ViewUniform};
use crate::stage::frame::{SkyFrame, StageFrame};
use crate::time_lapse::SettleMoment;
use bevy::asset::AssetEventSystems;
use bevy::prelude::*;
use bevy::render::RenderApp;
use bevy::render::render_asset::RenderAssets;
use bevy::render::render_resource::{
    AddressMode, BindGroup, BindGroupEntries, BindGroupLayout, FilterMode, Sampler, SamplerDescriptor, TextureViewId,
};
use bevy::render::renderer::RenderDevice;
use bevy::render::texture::{FallbackImage, GpuImage};
use heliodon_math::sphere::cone_solid_angle;
pub use residency::SkyMaps;

/// The dome's shader without what goes before it.
pub(crate) const SKY_WGSL: &str = include_str!("sky.wgsl");

/// Angular radius of the sun from Earth, mean over the year (IAU 2015 nominal solar radius over an astronomical unit).
pub const SUN_RADIUS_RAD: f32 = 0.004_652_5;

/// Solid angle of the sun's disc.
pub(crate) fn sun_solid_angle() -> f32 {
    cone_solid_angle(SUN_RADIUS_RAD)
}

/// A camera's uniform; `pixel_rad` is the angle that a pixel at the picture's centre spans.
pub(crate) fn view_uniform(
    frame: &StageFrame,
    clip_from_world: Mat4,
    direction_from_clip: Mat4,
    pixel_rad: f32,
    eye: Eye,
) -> ViewUniform {
    let exposure = frame.exposure_stops.exp2();
    let [a, b] = frame.sky.maps.map(|(_, weight)| weight * exposure);
    // The edge is soft over one pixel. Angles this small are chords.
    let outer = SUN_RADIUS_RAD + pixel_rad * 0.5;
    ViewUniform {
        clip_from_world,
        direction_from_clip,
        sun_direction: frame.sky.sun_direction.extend(outer),
        sun_disc: (frame.sky.disc_radiance * exposure).extend(1.0 / pixel_rad),
        sky_weights: Vec4::new(a, b, f32::from(u8::from(frame.shows_guessed)), f32::from(u8::from(!frame.without_details))),
        eye: eye.uniform(),
    }
}

/// Render world: what the dome's bind groups need.
#[derive(Resource, Default)]
pub(crate) struct SkyResources {
    sampler: Option<Sampler>,
    /// The last bind group, and the views that it binds.
    bound: Option<([TextureViewId; 2], BindGroup)>,
}

impl SkyResources {
    /// Binds the frame's two maps, anew where they are others; `None` while there is none. A map without weight is bound but not read.
    pub(crate) fn bind_group(
        &mut self,
        sky: &SkyFrame,
        images: &RenderAssets<GpuImage>,
        fallback: &FallbackImage,
        device: &RenderDevice,
        layout: &BindGroupLayout,
    ) -> Option<BindGroup> {
        let [a, b] = sky.maps.map(|(map, weight)| map.filter(|_| weight > 0.0).and_then(|map| images.get(map)));
        if a.is_none() && b.is_none() {
            return None;
        }
        let [a, b] = [a, b].map(|map| map.map_or(&fallback.d2.texture_view, |map| &map.texture_view));
        let views = [a.id(), b.id()];
        if let Some((bound, group)) = &self.bound
            && *bound == views
        {
            return Some(group.clone());
        }
        let sampler = self.sampler.get_or_insert_with(|| {
            device.create_sampler(&SamplerDescriptor {
                label: Some("sky"),
                address_mode_u: AddressMode::Repeat,
                address_mode_v: AddressMode::ClampToEdge,
                mag_filter: FilterMode::Linear,
                min_filter: FilterMode::Linear,
                ..Default::default()
            })
        });
        let group = device.create_bind_group("sky_maps", layout, &BindGroupEntries::sequential((a, b, &*sampler)));
        self.bound = Some((views, group.clone()));
        Some(group)
    }
}

/// Keeps the dome's maps at hand.
#[derive(Default)]
pub struct SkyPlugin;

impl Plugin for SkyPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<SkyMaps>().add_systems(PostUpdate, residency::follow.after(SettleMoment).before(AssetEventSystems));
        if let Some(render_app) = app.get_sub_app_mut(RenderApp) {
            render_app.init_resource::<SkyResources>();
        }
    }
}
