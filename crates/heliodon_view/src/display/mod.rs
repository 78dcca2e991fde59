//! The room: screens that stand anywhere in it, seen through by a tracked head.
//!
//! The file `display.toml` (`heliodon_bundle::display`) says where the screens stand; [`Room`] holds them and the head; each eye of each
//! screen is a [`DaylightCamera`](crate::DaylightCamera) with an off-axis projection, drawn into a picture of its own; a [`Composer`]
//! brings the pictures of a screen to its monitor, window or image. The room itself stands in the site where its
//! [`Visitor`] is. In the papers: FlatWorld's virtual windows (Callieri et al. 2006, section 3), the CAVE of
//! Papaioannou et al. 2003, section 6.

mod compose;
mod eyes;
mod outputs;
pub mod place;
pub mod preview;
pub mod projection;

pub use compose::Composer;
#[cfg(test)]
pub(crate) use compose::{COMPOSE_BYTES, COMPOSE_WGSL};
pub use eyes::RoomEye;
#[cfg(feature = "xr")]
pub(crate) use outputs::NOTHING;
pub use outputs::{ScreenWindow, Showing, first_window};
pub(crate) use outputs::{eye_size, open, picture, spawn_composer, spawn_eye};

use crate::navigation::{Beginning, Visitor};
use bevy::prelude::*;
use glam::{Quat, Vec3};
use heliodon_bundle::ConfigError;
use heliodon_bundle::display::{Display, Navigation, Stereo};
use heliodon_math::screen::Screen;
use heliodon_track::pose::Pose as TrackedPose;
use std::sync::Arc;

/// Whose eye a picture is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Side {
    /// Both eyes', from between them.
    Middle,
    /// The left eye's.
    Left,
    /// The right eye's.
    Right,
}

impl Side {
    /// The eyes whose pictures a kind of stereo takes.
    #[must_use]
    pub fn of(stereo: Stereo) -> &'static [Self] {
        match stereo {
            Stereo::Mono => &[Self::Middle],
            Stereo::Left => &[Self::Left],
            Stereo::Right => &[Self::Right],
            _ => &[Self::Left, Self::Right],
        }
    }

    /// As files are called by it: nothing where there is one picture.
    #[must_use]
    pub fn suffix(self) -> &'static str {
        match self {
            Self::Middle => "",
            Self::Left => "-left",
            Self::Right => "-right",
        }
    }
}

/// A room with screens, and who is in it.
#[derive(Resource, Clone, Debug)]
pub struct Room {
    display: Arc<Display>,
    screens: Vec<Screen>,
    /// The middle between the eyes, in the room.
    pub head: TrackedPose,
    /// The wand or the right hand.
    pub wand: Option<TrackedPose>,
    /// The left hand.
    pub left_hand: Option<TrackedPose>,
}

impl Room {
    /// The room of a display. One without screens is no room: its viewer is an ordinary window.
    ///
    /// # Errors
    /// If a screen's corners are none of a rectangle, which reading the display has ruled out.
    pub fn new(display: Arc<Display>) -> Result<Self, ConfigError> {
        let screens: Result<Vec<Screen>, ConfigError> = display
            .screens
            .iter()
            .enumerate()
            .map(|(number, entry)| {
                entry.screen().map_err(|why| {
                    display.error_at(
                        &["screen", &number.to_string(), "corners"],
                        why.to_string(),
                        "give the corners of a rectangle",
                    )
                })
            })
            .collect();
        let head = TrackedPose { position: place::rest(&display), orientation: Quat::IDENTITY };
        Ok(Self { screens: screens?, display, head, wand: None, left_hand: None })
    }

    /// What its file says.
    #[must_use]
    pub fn display(&self) -> &Display {
        &self.display
    }

    /// Its screens, in the order of the file.
    #[must_use]
    pub fn screens(&self) -> &[Screen] {
        &self.screens
    }

    /// Where the head rests while nobody is tracked.
    #[must_use]
    pub fn rest(&self) -> TrackedPose {
        TrackedPose { position: place::rest(&self.display), orientation: Quat::IDENTITY }
    }

    /// The visitor that moves the room through the site.
    #[must_use]
    pub fn visitor(&self) -> Visitor {
        let place = &self.display.place;
        let yaw_rad = place.heading_deg.map(|degrees| degrees.to_radians() as f32);
        let eye = place.at.map(|at| {
            let turned = Quat::from_rotation_y(-yaw_rad.unwrap_or(0.0)) * self.rest().position;
            Vec3::from(at.map(|v| v as f32)) + turned * place.scale as f32
        });
        Visitor {
            gait: self.display.display.navigation,
            tilts: false,
            eye_height_m: self.rest().position.y * place.scale as f32,
            pace_m_s: self.display.input.pace_m_s as f32,
            begin: Beginning { room: place.room.clone(), eye, yaw_rad: yaw_rad.or(eye.map(|_| 0.0)) },
            in_room: self.display.display.navigation == Navigation::Window,
            ..Visitor::default()
        }
    }
}

/// When the cameras of a room are set where the eyes are, in `PostUpdate`.
#[derive(SystemSet, Clone, Debug, PartialEq, Eq, Hash)]
pub struct AimEyes;

/// Draws a [`Room`], once there is one.
#[derive(Default)]
pub struct DisplayPlugin;

impl Plugin for DisplayPlugin {
    fn build(&self, app: &mut App) {
        app.add_plugins(compose::ComposePlugin)
            .add_observer(outputs::keep_windows)
            .add_systems(PreUpdate, outputs::follow_monitors.run_if(resource_exists::<Room>))
            .add_systems(Update, (preview::orbit, preview::follow).run_if(resource_exists::<Room>))
            .add_systems(
                PostUpdate,
                (eyes::aim, preview::aim)
                    .in_set(AimEyes)
                    .run_if(resource_exists::<Room>)
                    .before(bevy::transform::TransformSystems::Propagate)
                    .before(bevy::camera::visibility::VisibilitySystems::UpdateFrusta)
                    .before(bevy::camera::CameraUpdateSystems),
            );
    }
}
