//! Heliodon's viewer: Bevy plugins that draw a baked monument at any hour of the day.
//!
//! [`HeliodonPlugins`] puts a stage into any Bevy app: open a bundle with [`Stage::open`], give a camera a [`DaylightCamera`], and
//! set the hour with [`TimeLapse`]. Your own entities with Bevy's meshes and materials stand on the same stage; they share its
//! depth and its light. `examples/guest.rs` is such a program. [`window::run_window`] is the viewer's own window, and
//! [`headless::Renderer`] makes the same pictures without a display.
//!
//! One folder a feature, one plugin a folder: [`stage`] loads a bundle, [`daylight`] lights and draws the stone, [`detail`] adds what is fine to it, [`sky`] the
//! dome, [`culling`] leaves out what is hidden or too small, [`actors`] move and light what moves, [`covering`] covers, fades and marks what is there, [`lamps`] light both, [`time_lapse`] holds the hour, [`tonemap`] brings light to the display, [`guests`] lights what others add,
//! [`input`] binds keys, buttons and gestures to actions, [`navigation`] walks and flies, [`hud`] tells and takes the hour. [`display`] draws on the walls of a room,
//! [`tracking`] knows where heads and hands are, [`kiosk`] runs unattended, [`control`] takes orders from outside, [`play`] plays a visit by a script of inputs, [`costs`] tells what each of them takes, [`story`] lets a site's scripts run, [`hands`] are the visitor's, [`sound`] is what is heard.
//! [`particles`] are what is in the air, and [`guide_way`] shows a way on the ground.

pub mod actors;
pub mod bench;
pub mod bodies;
pub mod control;
pub mod costs;
pub mod covering;
pub mod culling;
pub mod daylight;
pub mod detail;
pub mod display;
pub mod easel;
pub mod film;
mod fullscreen;
pub mod guests;
pub mod guide_way;
pub mod hands;
pub mod headless;
pub mod hud;
pub mod impostor;
pub mod input;
pub mod kiosk;
pub mod lamps;
pub mod navigation;
mod over_stone;
pub mod particles;
pub mod play;
mod readback;
pub mod sky;
pub mod sound;
pub mod stage;
pub mod story;
pub mod time_lapse;
pub mod tonemap;
pub mod tracking;
pub mod visit;
pub mod window;
#[cfg(feature = "xr")]
pub mod xr;

pub use culling::Culling;
pub use daylight::{DaylightCamera, ExactAtRest, OnePassPairs, StereoPair, StereoPasses};
pub use navigation::pose::Pose;
pub use stage::{Stage, StageStatus};
pub use time_lapse::exposure::Exposure;
pub use time_lapse::{Blend, TimeLapse};
pub use tonemap::ToneCurve;

bevy::app::plugin_group! {
    /// Everything that a stage needs, without a window, a head-up display or a hand on the camera; add
    /// [`VisitPlugins`] for those. Add it after Bevy's `DefaultPlugins`.
    pub struct HeliodonPlugins {
        stage:::StagePlugin,
        culling:::CullingPlugin,
        daylight:::DaylightPlugin,
        sky:::SkyPlugin,
        time_lapse:::TimeLapsePlugin,
        covering:::CoveringPlugin,
        actors:::ActorsPlugin,
        impostor:::ImpostorPlugin,
        film:::FilmPlugin,
        lamps:::LampsPlugin,
        guests:::GuestsPlugin,
        guide_way:::GuideWayPlugin,
        particles:::ParticlesPlugin,
    }
}

bevy::app::plugin_group! {
    /// What a visitor has in hand: keys, buttons and gestures, a camera that they move, a head-up display; and a room with screens and trackers, an installation's
    /// watch and orders from outside, each once its resource is there. Add it after [`HeliodonPlugins`].
    pub struct VisitPlugins {
        input:::InputPlugin,
        navigation:::NavigationPlugin,
        hud:::HudPlugin,
        display:::DisplayPlugin,
        tracking:::TrackingPlugin,
        kiosk:::KioskPlugin,
        control:::ControlPlugin,
        story:::StoryPlugin,
        hands:::HandsPlugin,
        sound:::SoundPlugin,
        bodies:::BodiesPlugin,
    }
}
