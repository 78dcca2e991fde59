//! What every visit begins with, be it in a window, on the walls of a room or in a headset.

use crate::actors::{Actors, ActorsOptions};
use crate::control::Control;
use crate::daylight::StereoPasses;
use crate::hud::HudVisibility;
use crate::input::Input;
use crate::kiosk::{Kiosk, frame_watch};
use crate::particles::ParticlesBy;
use crate::stage::Stage;
use crate::story::StoryPlaces;
use crate::time_lapse::{Blend, TimeLapse};
use bevy::prelude::*;
use bevy::render::RenderPlugin;
use bevy::render::settings::{Backends, MemoryHints, WgpuSettings};
use heliodon_bundle::ReadError;
use heliodon_bundle::display::{Display, Preset};
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

/// Our own warnings are told, other people's errors.
pub(crate) const LOG_FILTER: &str = "error,heliodon_view=warn";

/// Bytes of a block of device memory, from which what is smaller is taken. Bundles are brought to the device through buffers of megabytes, once: of the larger
/// blocks that even [`MemoryHints::MemoryUsage`] comes to, one or two of 32 MiB would stay with hardly anything in them.
const DEVICE_BLOCK_BYTES: u64 = 8 << 20;

/// Bevy's renderer on Vulkan, Metal or DirectX: OpenGL, which crates beside us switch on, has not what is needed. Memory is taken in small blocks.
pub(crate) fn graphics() -> RenderPlugin {
    let backends = Some(Backends::from_env().unwrap_or(Backends::PRIMARY));
    let block_bytes = DEVICE_BLOCK_BYTES..DEVICE_BLOCK_BYTES;
    let memory_hints = MemoryHints::Manual { suballocated_device_memory_block_size: block_bytes };
    let settings = WgpuSettings { backends, memory_hints, ..default() };
    RenderPlugin { render_creation: settings.into(), ..default() }
}

/// What a frame of an installation counts for at most.
const LONGEST_FRAME: Duration = Duration::from_secs(10);

/// What a visit begins with.
#[derive(Clone, Debug)]
pub struct VisitOptions {
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
    /// Screens, trackers, keys, comfort, where the visit begins; `None` for what is usual.
    pub display: Option<Arc<Display>>,
    /// Where its story comes from and goes to.
    pub story: StoryPlaces,
    /// Who simulates sources of very many particles.
    pub particles: ParticlesBy,
}

impl Default for VisitOptions {
    fn default() -> Self {
        Self {
            day_seconds: crate::time_lapse::DEFAULT_DAY_SECONDS,
            clock_s: None,
            blend: Blend::Smooth,
            samples: 1,
            actors: ActorsOptions::default(),
            display: None,
            story: StoryPlaces::default(),
            particles: ParticlesBy::Auto,
        }
    }
}

impl VisitOptions {
    /// Whether any device has so many samples.
    pub(crate) fn has_samples(&self) -> bool {
        matches!(self.samples, 1 | 2 | 4 | 8)
    }

    /// The display, or the usual one.
    pub(crate) fn display(&self) -> Arc<Display> {
        self.display.clone().unwrap_or_else(|| Arc::new(Display::preset(Preset::Desktop)))
    }

    /// Opens the bundle in `folder`, and sets what the options and the display say; what cannot be is told, and the show goes on.
    pub(crate) fn begin(&self, app: &mut App, folder: &Path, display: &Display) -> Result<(), ReadError> {
        let world = app.world_mut();
        let mut lapse = world.resource_mut::<TimeLapse>();
        (lapse.day_seconds, lapse.blend) = (self.day_seconds, self.blend);
        world.resource_mut::<Actors>().options = self.actors;
        world.insert_resource(self.story.clone());
        world.insert_resource(StereoPasses(display.display.passes));
        world.resource_mut::<Stage>().open(folder)?;
        let bundle = world.resource::<Stage>().bundle().cloned();
        self.particles.prepare(app, bundle.as_ref().map_or(&[], |bundle| &bundle.living().particles));
        let world = app.world_mut();
        let (input, faults) = Input::new(&display.input);
        for fault in faults {
            let told = display.error_at(&["input", "bind", &fault.action], fault.message, fault.remedy);
            error!("{told}");
        }
        world.insert_resource(input);
        if let Some(settings) = &display.control {
            match Control::new(display, settings) {
                Ok(control) => world.insert_resource(control),
                Err(why) => error!("no orders can be taken: {why}"),
            }
        }
        if let Some(settings) = &display.kiosk {
            let log = settings.log.as_ref().map(|log| display.resolve(log));
            world.insert_resource(frame_watch(settings, log));
            world.insert_resource(Kiosk::new(settings.clone(), self.day_seconds));
            // An installation's day keeps to the clock, however long a frame takes.
            world.resource_mut::<Time<Virtual>>().set_max_delta(LONGEST_FRAME);
        }
        if display.display.hud.as_deref() == Some("none") {
            world.resource_mut::<HudVisibility>().shown = false;
        }
        if let Some(clock_s) = self.clock_s {
            // Once the day is there.
            app.add_systems(First, move |stage: Res<Stage>, mut lapse: ResMut<TimeLapse>, mut done: Local<bool>| {
                if !*done && stage.serial() > 0 && lapse.span_s().1 > 0.0 {
                    lapse.playing = false;
                    lapse.scrub(clock_s);
                    *done = true;
                }
            });
        }
        Ok(())
    }
}
