//! The viewer's own windows: one on a desk, or those of a room's screens.

use crate::daylight::DaylightCamera;
use crate::daylight::allocator::spare_memory;
use crate::display::{self, Room};
use crate::navigation::Visitor;
use crate::tracking::Trackers;
use crate::visit::{LOG_FILTER, VisitOptions, graphics};
use crate::{HeliodonPlugins, VisitPlugins};
use bevy::log::{Level, LogPlugin};
use bevy::prelude::*;
use bevy::render::view::Msaa;
use bevy::window::{ExitCondition, WindowMode, WindowResolution};
use heliodon_bundle::{BundleReader, ConfigError, ReadError};
use std::path::Path;
use std::sync::Arc;
use thiserror::Error;

/// What the window begins with.
#[derive(Clone, Debug, Default)]
pub struct WindowOptions {
    /// Size in logical pixels; `None` for what the site was prepared for.
    pub size: Option<(u32, u32)>,
    /// The visit.
    pub visit: VisitOptions,
    /// Show the room itself with its screens and the visitor in it.
    pub preview: bool,
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
    let samples = options.visit.samples;
    if !options.visit.has_samples() {
        return Err(WindowError::Samples(samples));
    }
    // Before any window opens, so that a bad bundle ends in a message and not in a black window.
    let bundle = BundleReader::open(folder.as_ref())?;
    let title = format!("{} - Heliodon", bundle.manifest().site.name);
    let prepared_for = &bundle.manifest().display;
    let (width, height) = options.size.unwrap_or((prepared_for.width_px, prepared_for.height_px));
    drop(bundle);
    let display = options.visit.display();
    if display.kiosk.is_some() {
        spare_memory();
    }
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
            .set(graphics())
            .set(WindowPlugin { primary_window: Some(window), close_when_requested, exit_condition, ..default() })
            // Other people's remarks are for those who ask for them.
            .set(LogPlugin { level: Level::WARN, filter: LOG_FILTER.to_owned(), ..default() }),
    )
    .add_plugins((HeliodonPlugins, VisitPlugins));
    options.visit.begin(&mut app, folder.as_ref(), &display)?;
    if let Some(trackers) = trackers {
        trackers.faults().iter().for_each(|fault| error!("{fault}"));
        app.insert_resource(trackers);
    }
    match room {
        Some(room) => {
            app.world_mut().spawn(room.visitor());
            if options.preview {
                display::preview::open(app.world_mut(), &room, samples);
            } else {
                display::open(app.world_mut(), &room, &title, samples);
            }
            app.insert_resource(room);
        }
        None => {
            let visitor =
                Visitor { pace_m_s: display.input.pace_m_s as f32, gait: display.display.navigation, ..Visitor::default() };
            app.world_mut().spawn((visitor, DaylightCamera, Msaa::from_samples(samples)));
        }
    }
    match app.run() {
        AppExit::Success => Ok(()),
        AppExit::Error(code) => Err(WindowError::Ended(code.get())),
    }
}
