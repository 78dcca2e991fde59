//! The viewer's own window.

use crate::HeliodonPlugins;
use crate::actors::{Actors, ActorsOptions};
use crate::hud::HudPlugin;
use crate::navigation::{NavigationPlugin, Visitor};
use crate::stage::Stage;
use crate::time_lapse::{Blend, TimeLapse};
use bevy::log::{Level, LogPlugin};
use bevy::prelude::*;
use bevy::render::view::Msaa;
use bevy::window::WindowResolution;
use heliodon_bundle::{BundleReader, ReadError};
use std::path::Path;
use thiserror::Error;

/// What the window begins with.
#[derive(Clone, Debug, PartialEq)]
pub struct WindowOptions {
    /// Size in logical pixels; `None` for what the site was prepared for.
    pub size: Option<(u32, u32)>,
    /// Seconds of the whole day.
    pub day_seconds: f32,
    /// Local time in seconds after midnight at which to begin, paused; `None` to let the day pass from its beginning.
    pub clock_s: Option<f64>,
    /// How the steps are joined.
    pub blend: Blend,
    /// Samples a pixel: 1, or 4 where a GPU has the time.
    pub samples: u32,
    /// How actors are lit.
    pub actors: ActorsOptions,
}

impl Default for WindowOptions {
    fn default() -> Self {
        Self {
            size: None,
            day_seconds: crate::time_lapse::DEFAULT_DAY_SECONDS,
            clock_s: None,
            blend: Blend::Smooth,
            samples: 1,
            actors: ActorsOptions::default(),
        }
    }
}

/// Why there is no window, or no more.
#[derive(Debug, Error)]
pub enum WindowError {
    /// The bundle cannot be shown.
    #[error(transparent)]
    Bundle(#[from] ReadError),
    /// Samples a pixel that no device has.
    #[error("{0} samples a pixel: 1, 2, 4 or 8 are possible")]
    Samples(u32),
    /// The program ended with an error.
    #[error("the viewer ended with error {0}; set RUST_LOG=info to see what came before")]
    Ended(u8),
}

/// Shows the bundle in `folder` until its window is closed.
///
/// # Errors
/// If it is no bundle, or the window ended with an error.
///
/// # Panics
/// Without a display or without any Vulkan, Metal or DirectX driver, as Bevy does.
pub fn run_window(folder: impl AsRef<Path>, options: &WindowOptions) -> Result<(), WindowError> {
    if !matches!(options.samples, 1 | 2 | 4 | 8) {
        return Err(WindowError::Samples(options.samples));
    }
    // Before any window opens, so that a bad bundle ends in a message and not in a black window.
    let bundle = BundleReader::open(folder.as_ref())?;
    let display = &bundle.manifest().display;
    let (width, height) = options.size.unwrap_or((display.width_px, display.height_px));
    let window = Window {
        title: format!("{} - Heliodon", bundle.manifest().site.name),
        name: Some("heliodon".to_owned()),
        resolution: WindowResolution::new(width.max(160), height.max(120)),
        ..default()
    };
    drop(bundle);
    let mut app = App::new();
    app.add_plugins(
        DefaultPlugins
            .set(WindowPlugin { primary_window: Some(window), ..default() })
            // Other people's remarks are for those who ask for them.
            .set(LogPlugin { level: Level::ERROR, filter: String::new(), ..default() }),
    )
    .add_plugins((HeliodonPlugins, NavigationPlugin, HudPlugin));
    let mut lapse = app.world_mut().resource_mut::<TimeLapse>();
    (lapse.day_seconds, lapse.blend) = (options.day_seconds, options.blend);
    app.world_mut().resource_mut::<Actors>().options = options.actors;
    app.world_mut().resource_mut::<Stage>().open(folder)?;
    app.world_mut().spawn((Visitor::default(), Msaa::from_samples(options.samples)));
    if let Some(clock_s) = options.clock_s {
        // Once the day is there.
        app.add_systems(First, move |stage: Res<Stage>, mut lapse: ResMut<TimeLapse>, mut done: Local<bool>| {
            if !*done && stage.serial() > 0 && lapse.span_s().1 > 0.0 {
                lapse.playing = false;
                lapse.scrub(clock_s);
                *done = true;
            }
        });
    }
    match app.run() {
        AppExit::Success => Ok(()),
        AppExit::Error(code) => Err(WindowError::Ended(code.get())),
    }
}
