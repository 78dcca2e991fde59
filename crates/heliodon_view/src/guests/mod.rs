//! Light for guests: entities with Bevy's own materials agree with the hour.
//!
//! One directional light follows the sun, each stage camera's ambient light is the sky's mean over all orientations, and the cameras' exposure
//! is the stage's. A guest of albedo a in the open then shows `a E max(n.l, 0) / pi + a * mean sky`, as the stone beside it
//! does but for the sky's direction; it throws no shadow on the stone, whose light is baked.

use crate::daylight::DaylightCamera;
use crate::daylight::moment::mean_sky_light;
use crate::stage::frame::StageFrame;
use crate::time_lapse::{Now, SettleMoment};
use bevy::camera::Exposure as CameraExposure;
use bevy::prelude::*;
use heliodon_math::color::luminance;

/// The light of the sun on guests; dark until a bundle is open.
#[derive(Component, Clone, Copy, Debug, Default)]
#[require(DirectionalLight { illuminance: 0.0, ..default() })]
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

/// What is lit or exposed of a camera; other cameras of the app keep what they have.
type LitCamera = (Entity, Option<&'static mut CameraExposure>, Option<&'static mut AmbientLight>);

fn light_guests(
    now: Res<Now>,
    frame: Res<StageFrame>,
    mut suns: Query<(&mut DirectionalLight, &mut Transform), With<GuestSun>>,
    mut cameras: Query<LitCamera, With<DaylightCamera>>,
    mut commands: Commands,
) {
    let Some(moment) = &now.moment else { return };
    let (color, illuminance) = split(moment.sun_irradiance);
    for (mut light, mut transform) in &mut suns {
        if (light.color, light.illuminance) != (color, illuminance) {
            (light.color, light.illuminance) = (color, illuminance);
        }
        transform.set_if_neq(Transform::default().looking_to(-moment.sun_direction, Vec3::Y));
    }
    let (color, brightness) = split(mean_sky_light(moment));
    let ev100 = ev100_from_stops(frame.exposure_stops);
    for (camera, exposure, ambient) in &mut cameras {
        if let Some(mut exposure) = exposure
            && exposure.ev100 != ev100
        {
            exposure.ev100 = ev100;
        }
        match ambient {
            Some(mut ambient) if (ambient.color, ambient.brightness) != (color, brightness) => {
                (ambient.color, ambient.brightness) = (color, brightness);
            }
            Some(_) => {}
            None => {
                commands.entity(camera).insert(AmbientLight { color, brightness, ..default() });
            }
        }
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
    #[test]
    fn a_hosts_scene_keeps_its_light() {
        let mut app = App::new();
        app.add_plugins((MinimalPlugins, GuestsPlugin))
            .init_resource::<StageFrame>()
            .init_resource::<Now>()
            .insert_resource(bevy::light::GlobalAmbientLight { brightness: 7.0, ..default() });
        let [ours, other] = [app.world_mut().spawn(DaylightCamera).id(), app.world_mut().spawn(Camera3d::default()).id()];
        let sun = |app: &mut App| {
            let world = app.world_mut();
            world.query_filtered::<&DirectionalLight, With<GuestSun>>().single(world).unwrap().illuminance
        };
        app.update();
        assert_eq!(sun(&mut app), 0.0);
        assert!(app.world().get::<AmbientLight>(ours).is_none());
        let day = heliodon_sky::lapse::Lapse {
            steps: vec![heliodon_sky::lapse::LapseStep {
                time: "12:00".to_owned(),
                sun: Some(heliodon_sky::lapse::Sun { direction: [0.0, 1.0, 0.0], irradiance: [2.0; 3], clipped: false }),
                sky: vec![[1.0; 3]; 4],
                fitted: None,
                exposure_stops: 0.0,
                sky_map: String::new(),
                mask_bit: 0,
                sun_in_map: false,
            }],
            sun_bounce_basis: None,
        };
        let moment = heliodon_bundle::moment::Day::new(&day).at(0.0, crate::Blend::Smooth);
        app.insert_resource(Now { moment: Some(moment.into()), has_sun: true });
        app.update();
        app.update();
        assert!((sun(&mut app) - 2.0).abs() < 1e-5);
        assert!(app.world().get::<AmbientLight>(ours).is_some_and(|light| (light.brightness - 0.282_094_8).abs() < 1e-5));
        assert!(app.world().get::<AmbientLight>(other).is_none());
        assert_eq!(app.world().resource::<bevy::light::GlobalAmbientLight>().brightness, 7.0);
    }
}
