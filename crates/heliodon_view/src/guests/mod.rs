//! Light for guests: entities with Bevy's own materials agree with the hour.
//!
//! One directional light follows the sun, the ambient light is the sky's mean over all orientations, and the cameras' exposure
//! is the stage's. A guest of albedo a in the open then shows `a E max(n.l, 0) / pi + a * mean sky`, as the stone beside it
//! does but for the sky's direction; it throws no shadow on the stone, whose light is baked.

use crate::daylight::DaylightCamera;
use crate::daylight::moment::mean_sky_light;
use crate::stage::frame::StageFrame;
use crate::time_lapse::{Now, SettleMoment};
use bevy::camera::Exposure as CameraExposure;
use bevy::light::GlobalAmbientLight;
use bevy::prelude::*;
use heliodon_math::color::luminance;

/// The light of the sun on guests.
#[derive(Component, Clone, Copy, Debug, Default)]
#[require(DirectionalLight)]
pub struct GuestSun;

/// Lights guests.
#[derive(Default)]
pub struct GuestsPlugin;

impl Plugin for GuestsPlugin {
    fn build(&self, app: &mut App) {
        app.add_systems(Startup, |mut commands: Commands| {
            commands.spawn(GuestSun);
        })
        .add_systems(PostUpdate, light_guests.after(SettleMoment).before(bevy::transform::TransformSystems::Propagate));
    }
}

/// Bevy's exposure is 2^-ev100 / 1.2 (bevy_camera's `Exposure::exposure`).
fn ev100_from_stops(stops: f32) -> f32 {
    -stops - 1.2f32.log2()
}

/// A colour of luminance 1 and the luminance.
fn split(light: Vec3) -> (Color, f32) {
    let brightness = luminance(light);
    if brightness > 0.0 {
        let tint = light / brightness;
        (Color::linear_rgb(tint.x, tint.y, tint.z), brightness)
    } else {
        (Color::WHITE, 0.0)
    }
}

fn light_guests(
    now: Res<Now>,
    frame: Res<StageFrame>,
    mut ambient: ResMut<GlobalAmbientLight>,
    mut suns: Query<(&mut DirectionalLight, &mut Transform), With<GuestSun>>,
    mut cameras: Query<Option<&mut CameraExposure>, With<DaylightCamera>>,
) {
    let Some(moment) = &now.moment else { return };
    (ambient.color, ambient.brightness) = split(mean_sky_light(moment));
    for (mut light, mut transform) in &mut suns {
        (light.color, light.illuminance) = split(moment.sun_irradiance);
        *transform = Transform::default().looking_to(-moment.sun_direction, Vec3::Y);
    }
    for exposure in cameras.iter_mut().flatten() {
        exposure.into_inner().ev100 = ev100_from_stops(frame.exposure_stops);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bevys_exposure_is_ours() {
        for stops in [-12.0, 0.0, 3.5] {
            let exposure = CameraExposure { ev100: ev100_from_stops(stops) }.exposure();
            assert!((exposure - stops.exp2()).abs() <= 1e-5 * stops.exp2());
        }
    }

    #[test]
    fn colour_and_luminance_make_the_light_again() {
        let light = Vec3::new(3.0, 2.0, 0.5);
        let (color, brightness) = split(light);
        let back = color.to_linear();
        assert!((Vec3::new(back.red, back.green, back.blue) * brightness - light).abs().max_element() < 1e-5);
    }
}
