//! The viewer's own windows: one on a desk, or those of a room's screens.

use crate::actors::{Actors, ActorsOptions};
use crate::control::Control;
use crate::daylight::DaylightCamera;
use crate::display::{self, Room};
use crate::hud::HudVisibility;
use crate::input::Input;
use crate::kiosk::{Kiosk, frame_watch};
use crate::navigation::Visitor;
use crate::stage::Stage;
use crate::time_lapse::{Blend, TimeLapse};
use crate::tracking::Trackers;
use crate::{HeliodonPlugins, VisitPlugins};
use bevy::log::{Level, LogPlugin};
use bevy::prelude::*;
use bevy::render::view::Msaa;
use bevy::window::{ExitCondition, WindowMode, WindowResolution};
use heliodon_bundle::display::{Display, Preset};
use heliodon_bundle::{BundleReader, ConfigError, ReadError};
use std::path::Path;
use std::sync::Arc;
use thiserror::Error;

/// Our own warnings are told, other people's errors.
const LOG_FILTER: &str = "error,heliodon_view=warn";

/// What the window begins with.
#[derive(Clone, Debug)]
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
    /// Screens, trackers, keys; `None` for one window as it comes.
    pub display: Option<Arc<Display>>,
    /// Show the room itself with its screens and the visitor in it.
    pub preview: bool,
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
            display: None,
            preview: false,
        }
    }
}

/// Why there is no window, or no more.
#[derive(Debug, Error)]
pub enum WindowError {
    /// The bundle cannot be shown.
    #[error(transparent)]
    Bundle(#[from] ReadError),
    /// The display's file says something that cannot be.
    #[error(transparent)]
    Display(#[from] ConfigError),
    /// Samples a pixel that no device has.
    #[error("{0} samples a pixel: 1, 2, 4 or 8 are possible")]
    Samples(u32),
    /// The program ended with an error.
    #[error("the viewer ended with error {0}; set RUST_LOG=info to see what came before")]
    Ended(u8),
}

/// Shows the bundle in `folder` until its first window is closed.
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
    let title = format!("{} - Heliodon", bundle.manifest().site.name);
    let prepared_for = &bundle.manifest().display;
    let (width, height) = options.size.unwrap_or((prepared_for.width_px, prepared_for.height_px));
    drop(bundle);
    let display = options.display.clone().unwrap_or_else(|| Arc::new(Display::preset(Preset::Desktop)));
    let room = (!display.screens.is_empty()).then(|| Room::new(Arc::clone(&display))).transpose()?;
    let trackers = room.as_ref().map(|_| Trackers::new(&display)).transpose()?;
    let mut window = match &room {
        Some(_) if options.preview => None,
        Some(_) => display::first_window(&title, &display),
        None => None,
    }
    .unwrap_or_else(|| Window {
        title: title.clone(),
        name: Some("heliodon".to_owned()),
        resolution: WindowResolution::new(width.max(160), height.max(120)),
        ..default()
    });
    if display.kiosk.is_some() && room.is_none() {
        window.mode = WindowMode::BorderlessFullscreen(MonitorSelection::Primary);
    }
    // An installation's windows are not closed by whoever finds a button for it.
    let (close_when_requested, exit_condition) = match &display.kiosk {
        Some(kiosk) if !kiosk.may_quit => (false, ExitCondition::DontExit),
        _ => (true, ExitCondition::OnPrimaryClosed),
    };
    let mut app = App::new();
    app.add_plugins(
        DefaultPlugins
            .set(WindowPlugin { primary_window: Some(window), close_when_requested, exit_condition, ..default() })
            // Other people's remarks are for those who ask for them.
            .set(LogPlugin { level: Level::WARN, filter: LOG_FILTER.to_owned(), ..default() }),
    )
    .add_plugins((HeliodonPlugins, VisitPlugins));
    let mut lapse = app.world_mut().resource_mut::<TimeLapse>();
    (lapse.day_seconds, lapse.blend) = (options.day_seconds, options.blend);
    app.world_mut().resource_mut::<Actors>().options = options.actors;
    app.world_mut().resource_mut::<Stage>().open(folder)?;

    let (input, faults) = Input::new(&display.input);
    for fault in faults {
        let told = display.error_at(&["input", "bind", &fault.action], fault.message, fault.remedy);
        error!("{told}");
    }
    app.insert_resource(input);
    if let Some(trackers) = trackers {
        trackers.faults().iter().for_each(|fault| error!("{fault}"));
        app.insert_resource(trackers);
    }
    if let Some(settings) = &display.control {
        // The show goes on without orders.
        match Control::new(&display, settings) {
            Ok(control) => drop(app.insert_resource(control)),
            Err(why) => error!("no orders can be taken: {why}"),
        }
    }
    if let Some(settings) = &display.kiosk {
        let log = settings.log.as_ref().map(|log| display.resolve(log));
        app.insert_resource(frame_watch(settings, log)).insert_resource(Kiosk::new(settings.clone(), options.day_seconds));
    }
    if display.display.hud.as_deref() == Some("none") {
        app.world_mut().resource_mut::<HudVisibility>().shown = false;
    }
    match room {
        Some(room) => {
            app.world_mut().spawn(room.visitor());
            if options.preview {
                display::preview::open(app.world_mut(), &room, options.samples);
            } else {
                display::open(app.world_mut(), &room, &title, options.samples);
            }
            app.insert_resource(room);
        }
        None => {
            let visitor =
                Visitor { pace_m_s: display.input.pace_m_s as f32, gait: display.display.navigation, ..Visitor::default() };
            app.world_mut().spawn((visitor, DaylightCamera, Msaa::from_samples(options.samples)));
        }
    }
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
