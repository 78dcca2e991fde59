//! Headsets, by OpenXR: both eyes on the stage, hands on the actions, the day on a wrist or on the floor.
//!
//! `bevy_mod_openxr` speaks to the runtime and owns frame loop, swapchain and cameras; here is what makes of them a visit. The
//! [`Visitor`](crate::navigation::Visitor) is the platform that moves through the site, as it is for a room with screens, and the play space stands on it
//! ([`play::PlaySpace`]): its floor where the visitor's feet are, its ahead where the visitor looks. Both eyes are [`DaylightCamera`]s of one
//! [`StereoPair`]; controllers set off the same [actions](crate::input) as keys do: their buttons are the wand's, their sticks those of a game controller.
//!
//! Why the start-up of `bevy_mod_openxr` is not taken as it is: it goes on without a headset where there is none, and tells why in a line of its log. Here
//! (runtime.rs) the runtime is asked before there is an app, and what is missing ends in one message.

mod controllers;
mod digits;
mod eyes;
mod hands;
mod mirror;
mod models;
pub mod play;
mod profiles;
mod reach;
mod run;
mod runtime;
mod session;
mod timeline;
pub(crate) mod tracker;
pub mod turn;
mod vignette;
mod watch;

pub use controllers::Controllers;
pub use hands::XrHands;
pub use run::{HeadsetError, HeadsetOptions, HeadsetReport, XrOptions, run_headset};
pub use vignette::Vignette;

use crate::daylight::{DaylightCamera, StereoPair};
use bevy::prelude::*;
use heliodon_bundle::display::{DisplayFile, Headset};

/// What a display's file says of headsets.
#[derive(Resource, Clone, Copy, Debug, PartialEq)]
pub struct HeadsetSettings {
    /// Comfort, and where the time line is.
    pub comfort: Headset,
    /// Nothing nearer to an eye than this is drawn, metres.
    pub near_m: f32,
    /// Samples a pixel.
    pub samples: u32,
}

impl HeadsetSettings {
    /// As a display says.
    #[must_use]
    pub fn new(display: &DisplayFile, samples: u32) -> Self {
        Self { comfort: display.headset, near_m: display.display.near_m as f32, samples }
    }
}

bevy::app::plugin_group! {
    /// What makes a visit of an OpenXR session. Add it after [`VisitPlugins`](crate::VisitPlugins) in an app whose renderer a runtime has made
    /// (see [`run_headset`]) and that has [`HeadsetSettings`].
    pub struct HeadsetPlugins {
        eyes:::EyesPlugin,
        play:::PlaySpacePlugin,
        hands:::HandsPlugin,
        controllers:::ControllersPlugin,
        turn:::TurnPlugin,
        timeline:::TimelinePlugin,
        models:::ModelsPlugin,
        vignette:::VignettePlugin,
        mirror:::MirrorPlugin,
    }
}
