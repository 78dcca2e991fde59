//! The cameras of both eyes.

use super::{DaylightCamera, HeadsetSettings, StereoPair, Vignette};
use bevy::core_pipeline::tonemapping::{DebandDither, Tonemapping};
use bevy::prelude::*;
use bevy::render::view::Msaa;
use bevy_mod_xr::camera::{XrCamera, XrProjection};

/// Which eye a camera is, of those that the runtime wants pictures for.
#[derive(Component, Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Eye {
    Left,
    Right,
}

impl Eye {
    /// What its picture is called.
    pub(super) fn file(self) -> &'static str {
        match self {
            Self::Left => "left.png",
            Self::Right => "right.png",
        }
    }
}

/// All headsets of the app: there is one.
const PAIR: StereoPair = StereoPair(0);

/// Lets the cameras that bevy_mod_openxr spawns see the stage.
#[derive(Default)]
pub(super) struct EyesPlugin;

impl Plugin for EyesPlugin {
    fn build(&self, app: &mut App) {
        app.add_observer(open_eye);
    }
}

fn open_eye(added: On<Add, XrCamera>, cameras: Query<&XrCamera>, settings: Res<HeadsetSettings>, mut commands: Commands) {
    let Ok(camera) = cameras.get(added.entity) else { return };
    let eye = if camera.0 == 0 { Eye::Left } else { Eye::Right };
    // What the stage's cameras require, said aloud: `XrCamera` has brought Bevy's own tone mapping along.
    let stage = (DaylightCamera, Tonemapping::None, DebandDither::Disabled, Msaa::from_samples(settings.samples));
    let projection = Projection::custom(XrProjection { near: settings.near_m, ..default() });
    commands.entity(added.entity).insert((eye, PAIR, stage, projection, Vignette::default()));
}

#[cfg(test)]
mod tests {
    use super::*;
    use heliodon_bundle::display::DisplayFile;

    #[test]
    fn both_eyes_see_the_stage_as_a_pair_and_write_display_values() {
        let mut app = App::new();
        app.add_plugins((MinimalPlugins, EyesPlugin)).insert_resource(HeadsetSettings::new(&DisplayFile::default(), 1));
        for index in 0..2 {
            let entity = app.world_mut().spawn((XrCamera(index), Projection::custom(XrProjection::default()))).id();
            app.update();
            let eye = app.world().entity(entity);
            assert_eq!(eye.get::<Eye>(), Some(&[Eye::Left, Eye::Right][index as usize]));
            assert!(eye.contains::<DaylightCamera>() && eye.contains::<Vignette>());
            assert_eq!((eye.get(), eye.get()), (Some(&PAIR), Some(&Tonemapping::None)));
            let Some(Projection::Custom(custom)) = eye.get::<Projection>() else { panic!("it is the runtime's") };
            assert_eq!(custom.get::<XrProjection>().map(|of| of.near), Some(0.05));
        }
    }
}
