//! Lamps: point and spot lights on stone and actors, beside sun and sky, with the shadows of both.
//!
//! M. Sattler, R. Sarlette, G. Zachmann, R. Klein: "Hardware-accelerated ambient occlusion computation", VMV 2004, section 7 lights what the visibility matrix
//! lights by local lights too. A lamp's light is computed in the fragment: irradiance that falls with the square of the distance, faded out at
//! the lamp's reach, and two shadow maps for each of its faces. One holds the stone and is drawn when lamp or stone are new; the other holds the
//! actors and is drawn in every frame in which one of them is near. Stone that no lamp reaches is drawn as if there were none.

pub mod maps;
pub(crate) mod reaching;
pub mod uniform;

use crate::actors::render::prepare_actors;
use crate::daylight::prepare::{prepare_views, receive};
use crate::stage::Stage;
use bevy::core_pipeline::schedule::camera_driver;
use bevy::prelude::*;
use bevy::render::extract_resource::{ExtractResource, ExtractResourcePlugin};
use bevy::render::renderer::RenderGraph;
use bevy::render::{Render, RenderApp, RenderSystems};
use glam::DVec3;
use maps::LampsGpu;

/// WGSL of what shaders know of lamps; `lamps` is to be bound.
pub(crate) const LAMPS_SHARED_WGSL: &str = include_str!("shared.wgsl");

/// WGSL of the lamps' light on surfaces.
pub(crate) const LAMPS_WGSL: &str = concat!(include_str!("shared.wgsl"), include_str!("lamps.wgsl"));

/// WGSL that takes the stone's normals out of what is baked.
pub(crate) const NORMALS_WGSL: &str = include_str!("normals.wgsl");

/// The lamps of the stage: the bundle's own, which a program may change, move and add to in any frame. The first [`uniform::MOST_LAMPS`] that give light are lit.
#[derive(Resource, Clone, Debug, Default, ExtractResource)]
pub struct Lamps {
    /// The lamps.
    pub lamps: Vec<Lamp>,
    /// The light of fires, after those, anew in every frame before [`SettleLamps`].
    pub(crate) fires: Vec<Lamp>,
    stage: u64,
}

impl Lamps {
    /// All of them, fires last.
    pub fn all(&self) -> impl Iterator<Item = &Lamp> {
        self.lamps.iter().chain(&self.fires)
    }
}

/// Lamps are as they are in this frame.
#[derive(SystemSet, Clone, Debug, PartialEq, Eq, Hash)]
pub struct SettleLamps;

/// A lamp.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lamp {
    /// Where it is, in the bundle's space, metres.
    pub place: Vec3,
    /// Linear RGB irradiance at normal incidence one metre away, in the sky's radiance unit times steradians.
    pub intensity: Vec3,
    /// What a spot light's light is kept within.
    pub cone: Option<Cone>,
    /// Where its light has faded out, metres.
    pub reach_m: f32,
    /// Whether stone and actors cast shadows in its light.
    pub shadows: bool,
}

/// A spot light's cone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cone {
    /// Unit direction of its axis, away from the lamp.
    pub direction: Vec3,
    /// Half of its opening, radians, up to 85 degrees.
    pub half_angle_rad: f32,
    /// The part of the half angle in which the light fades towards the edge, 0 to 1.
    pub edge: f32,
}

impl From<&heliodon_bundle::site::Lamp> for Lamp {
    fn from(lamp: &heliodon_bundle::site::Lamp) -> Self {
        let cone =
            |direction| Cone { direction, half_angle_rad: (0.5 * lamp.angle_deg as f32).to_radians(), edge: lamp.edge as f32 };
        Self {
            place: DVec3::from(lamp.place).as_vec3(),
            intensity: DVec3::from(lamp.intensity).as_vec3(),
            cone: lamp.direction().map(cone),
            reach_m: lamp.reach_m as f32,
            shadows: lamp.shadows,
        }
    }
}

/// Lights by lamps.
#[derive(Default)]
pub struct LampsPlugin;

impl Plugin for LampsPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<Lamps>().add_plugins(ExtractResourcePlugin::<Lamps>::default()).add_systems(Update, follow_stage);
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else { return };
        render_app
            .init_resource::<LampsGpu>()
            .add_systems(
                Render,
                maps::prepare_lamps
                    .in_set(RenderSystems::PrepareResources)
                    .after(receive)
                    .before(prepare_actors)
                    .before(prepare_views),
            )
            .add_systems(RenderGraph, maps::cast_shadows.after(crate::actors::render::cast_shadows).before(camera_driver));
    }
}

/// Takes the lamps of another bundle.
fn follow_stage(stage: Res<Stage>, mut lamps: ResMut<Lamps>) {
    if lamps.stage != stage.serial() {
        lamps.stage = stage.serial();
        lamps.fires.clear();
        lamps.lamps = stage.bundle().map_or(Vec::new(), |bundle| bundle.lamps().iter().map(Lamp::from).collect());
    }
}
