//! The visit in a headset, from the first frame to the last.

use super::runtime::Runtime;
use super::session::SessionPlugin;
use super::watch::{Tally, Told, WatchPlugin};
use super::{HeadsetPlugins, HeadsetSettings, mirror};
use crate::daylight::allocator::spare_memory;
use crate::display::Room;
use crate::hud::clock_text;
use crate::visit::{LOG_FILTER, VisitOptions};
use crate::{HeliodonPlugins, VisitPlugins};
use bevy::app::{PluginGroupBuilder, ScheduleRunnerPlugin};
use bevy::log::{Level, LogPlugin};
use bevy::prelude::*;
use bevy::render::RenderPlugin;
use bevy::render::pipelined_rendering::PipelinedRenderingPlugin;
use bevy::render::settings::RenderCreation;
use bevy::window::{ExitCondition, PresentMode, WindowResolution};
use bevy::winit::{UpdateMode, WinitPlugin, WinitSettings};
use bevy_mod_openxr::action_set_attaching::OxrActionAttachingPlugin;
use bevy_mod_openxr::action_set_syncing::OxrActionSyncingPlugin;
use bevy_mod_openxr::poll_events::OxrEventsPlugin;
use bevy_mod_openxr::render::OxrRenderPlugin;
use bevy_mod_openxr::spaces::{OxrSpacePatchingPlugin, OxrSpatialPlugin};
use bevy_mod_xr::camera::XrCameraPlugin;
use bevy_mod_xr::session::XrSessionPlugin;
use heliodon_bundle::display::Navigation;
use heliodon_bundle::{BundleReader, ConfigError, ReadError};
use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;
use thiserror::Error;

/// Without a window a frame before the session begins, which the runtime does not wait for, takes at least so long.
const IDLE_FRAME: Duration = Duration::from_millis(2);

/// For trials: how long a visit lasts, and what is kept of it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct XrOptions {
    /// Ends so long after the first frame was submitted; none: when somebody leaves.
    pub seconds: Option<f32>,
    /// Where both eyes' pictures of the end are written to, `left.png` and `right.png`; only with `seconds`.
    pub capture: Option<PathBuf>,
}

/// What a visit in a headset begins with.
#[derive(Clone, Debug)]
pub struct HeadsetOptions {
    /// The visit: comfort, keys and where it begins are the display's; without one it is on foot.
    pub visit: VisitOptions,
    /// Show on the desk what the left eye sees. Without it, no window is opened, and no display is needed.
    pub mirror: bool,
    /// For trials.
    pub trial: XrOptions,
}

impl Default for HeadsetOptions {
    fn default() -> Self {
        Self { visit: VisitOptions::default(), mirror: true, trial: XrOptions::default() }
    }
}

/// What a visit came to.
#[derive(Clone, Debug, PartialEq)]
pub struct HeadsetReport {
    /// Frames that were submitted with pictures.
    pub frames: u64,
    /// From the first of them to the last.
    pub seconds: f64,
    /// Of these, how long the runtime was waited for: the rest is work.
    pub waited_s: f64,
    /// The runtime's name and version.
    pub runtime: String,
    /// The headset's name.
    pub headset: String,
    /// Size of an eye's picture.
    pub resolution: [u32; 2],
    /// In how many passes both eyes' pictures were drawn, mostly.
    pub passes: u32,
    /// Where the visitor's platform was at the end, and how far it had turned clockwise, degrees.
    pub eye: [f32; 3],
    /// See [`Self::eye`].
    pub heading_deg: f32,
    /// Local time at the end, seconds after midnight.
    pub clock_s: f64,
    /// Whether the day was passing.
    pub playing: bool,
    /// Pictures that were written.
    pub pictures: Vec<PathBuf>,
}

impl HeadsetReport {
    fn new(told: &Told, runtime: String, headset: String) -> Self {
        let seconds = told.first.zip(told.last).map_or(0.0, |(first, last)| (last - first).as_secs_f64());
        let mut pictures = told.pictures.clone();
        pictures.sort();
        Self {
            frames: told.frames,
            seconds,
            waited_s: told.waited.as_secs_f64(),
            runtime,
            headset,
            resolution: told.resolution,
            passes: if told.one_pass_frames * 2 > told.frames { 1 } else { 2 },
            eye: told.eye.to_array(),
            heading_deg: told.yaw_rad.to_degrees(),
            clock_s: told.clock_s,
            playing: told.playing,
            pictures,
        }
    }

    /// The mean time from one frame to the next, milliseconds.
    #[must_use]
    pub fn frame_ms(&self) -> f64 {
        if self.frames > 1 { self.seconds * 1e3 / (self.frames - 1) as f64 } else { 0.0 }
    }

    /// The mean time of a frame's own work, without waiting for the runtime.
    #[must_use]
    pub fn work_ms(&self) -> f64 {
        if self.frames > 1 { (self.seconds - self.waited_s).max(0.0) * 1e3 / (self.frames - 1) as f64 } else { 0.0 }
    }

    /// One line of JSON.
    #[must_use]
    pub fn json(&self) -> String {
        let pictures: Vec<String> = self.pictures.iter().map(|path| json_string(&path.display().to_string())).collect();
        let ([width, height], [x, y, z]) = (self.resolution, self.eye);
        let fields = [
            format!("\"frames\": {}", self.frames),
            format!("\"seconds\": {:.3}", self.seconds),
            format!("\"frame_ms\": {:.2}", self.frame_ms()),
            format!("\"work_ms\": {:.2}", self.work_ms()),
            format!("\"runtime\": {}", json_string(&self.runtime)),
            format!("\"headset\": {}", json_string(&self.headset)),
            format!("\"resolution\": [{width}, {height}]"),
            format!("\"passes\": {}", self.passes),
            format!("\"eye\": [{x:.3}, {y:.3}, {z:.3}]"),
            format!("\"heading_deg\": {:.2}", self.heading_deg),
            format!("\"clock\": {}", json_string(&clock_text(self.clock_s))),
            format!("\"playing\": {}", self.playing),
            format!("\"pictures\": [{}]", pictures.join(", ")),
        ];
        format!("{{{}}}", fields.join(", "))
    }
}

/// A text as JSON writes it.
fn json_string(text: &str) -> String {
    let escaped = text.chars().map(|c| match c {
        '"' | '\\' => format!("\\{c}"),
        c if c.is_control() => format!("\\u{:04x}", c as u32),
        c => c.to_string(),
    });
    format!("\"{}\"", escaped.collect::<String>())
}

/// Why there is no visit in a headset, or no more.
#[derive(Debug, Error)]
pub enum HeadsetError {
    /// The bundle cannot be shown.
    #[error(transparent)]
    Bundle(#[from] ReadError),
    /// The display's file says something that cannot be.
    #[error(transparent)]
    Display(#[from] ConfigError),
    /// Samples a pixel that no device has.
    #[error("{0} samples a pixel: 1, 2, 4 or 8 are possible")]
    Samples(u32),
    /// There is no OpenXR loader.
    #[error(
        "the OpenXR loader is not on this machine ({0}); install it (Debian and Ubuntu: libopenxr-loader1) or the headset's own software"
    )]
    NoLoader(String),
    /// There is no runtime, or it does not answer.
    #[error(
        "no OpenXR runtime answers ({0}); start the headset's software (SteamVR, Monado, ...), or name its manifest in XR_RUNTIME_JSON"
    )]
    NoRuntime(String),
    /// The runtime has no headset.
    #[error("{runtime} has no headset ({why}); connect it and switch it on")]
    NoHeadset {
        /// The runtime.
        runtime: String,
        /// What it says.
        why: String,
    },
    /// The runtime and the graphics driver do not go together.
    #[error(
        "{runtime} cannot take pictures from this graphics driver ({why}); it wants Vulkan on the device that the headset is connected to"
    )]
    Graphics {
        /// The runtime.
        runtime: String,
        /// What fails.
        why: String,
    },
    /// The visit broke off.
    #[error("{runtime} ended the visit after {frames} frames: {why}")]
    Broken {
        /// The runtime.
        runtime: String,
        /// Frames that were submitted.
        frames: u64,
        /// What failed.
        why: String,
    },
    /// The program ended with an error.
    #[error("the viewer ended with error {0}; set RUST_LOG=info to see what came before")]
    Ended(u8),
}

/// Bevy's plugins with a renderer that is there already, and a window if there is to be a mirror.
fn bevys_plugins(render_creation: RenderCreation, mirror: Option<Window>) -> PluginGroupBuilder {
    let exit_condition = if mirror.is_some() { ExitCondition::OnPrimaryClosed } else { ExitCondition::DontExit };
    let has_window = mirror.is_some();
    let plugins = DefaultPlugins
        .build()
        .add_before::<RenderPlugin>(XrSessionPlugin { auto_handle: true })
        .set(RenderPlugin { render_creation, ..default() })
        .set(WindowPlugin { primary_window: mirror, exit_condition, ..default() })
        // Other people's remarks are for those who ask for them.
        .set(LogPlugin { level: Level::WARN, filter: LOG_FILTER.to_owned(), ..default() })
        // Hands and hour are drawn in the frame in which they are read.
        .disable::<PipelinedRenderingPlugin>();
    if has_window { plugins } else { plugins.disable::<WinitPlugin>() }
}

/// Shows the bundle in `folder` in a headset until its visitor leaves, or as long as a trial lasts.
///
/// # Errors
/// If it is no bundle, if there is no OpenXR loader, runtime or headset, or if the visit broke off.
///
/// # Panics
/// With a mirror and without a display, as Bevy does.
pub fn run_headset(folder: impl AsRef<Path>, options: &HeadsetOptions) -> Result<HeadsetReport, HeadsetError> {
    if !options.visit.has_samples() {
        return Err(HeadsetError::Samples(options.visit.samples));
    }
    // Before anything opens, so that a bad bundle or a missing runtime ends in a message.
    let bundle = BundleReader::open(folder.as_ref())?;
    let title = format!("{} - Heliodon", bundle.manifest().site.name);
    drop(bundle);
    let display = options.visit.display();
    if display.kiosk.is_some() {
        spare_memory();
    }
    let mut visitor = Room::new(Arc::clone(&display))?.visitor();
    if options.visit.display.is_none() {
        visitor.gait = Navigation::Walk;
    }
    let (runtime, render_creation) = Runtime::open()?;
    let (name, headset) = (runtime.name.clone(), runtime.system.clone());
    let tally = Tally::default();

    let mut app = App::new();
    let mirror = options.mirror.then(|| Window {
        title,
        name: Some("heliodon".to_owned()),
        resolution: WindowResolution::new(960, 720),
        // The desk's monitor must not hold back the headset's pictures.
        present_mode: PresentMode::AutoNoVsync,
        ..default()
    });
    let has_mirror = mirror.is_some();
    app.add_plugins(bevys_plugins(render_creation, mirror));
    if has_mirror {
        app.insert_resource(WinitSettings { focused_mode: UpdateMode::Continuous, unfocused_mode: UpdateMode::Continuous });
    } else {
        app.add_plugins(ScheduleRunnerPlugin::run_loop(IDLE_FRAME));
    }
    runtime.install(&mut app);
    app.insert_resource(HeadsetSettings::new(&display, options.visit.samples))
        .add_plugins((
            OxrEventsPlugin,
            OxrRenderPlugin { spawn_cameras: true, default_wait_frame: false },
            XrCameraPlugin,
            OxrActionAttachingPlugin,
            OxrActionSyncingPlugin,
            OxrSpatialPlugin,
            OxrSpacePatchingPlugin,
        ))
        .add_plugins((WatchPlugin { options: options.trial.clone(), tally: tally.clone() }, SessionPlugin))
        .add_plugins((HeliodonPlugins, VisitPlugins, HeadsetPlugins));
    options.visit.begin(&mut app, folder.as_ref(), &display)?;
    app.world_mut().spawn(visitor);
    if has_mirror {
        mirror::spawn(app.world_mut());
    }

    let exit = run(&mut app);
    let told = tally.told().clone();
    let broken = |why: String| HeadsetError::Broken { runtime: name.clone(), frames: told.frames, why };
    match (told.fault.clone(), exit) {
        (Some(why), _) | (None, Err(why)) => Err(broken(why)),
        (None, Ok(AppExit::Error(code))) => Err(HeadsetError::Ended(code.get())),
        (None, Ok(AppExit::Success)) => Ok(HeadsetReport::new(&told, name, headset)),
    }
}

/// Runs the app. A runtime that breaks down in the middle of a frame lets bevy_mod_openxr 0.6 panic, where it begins frames and takes and gives back images: that
/// is told like any other end of a visit. Other panics go on.
fn run(app: &mut App) -> Result<AppExit, String> {
    catch_unwind(AssertUnwindSafe(|| app.run())).or_else(|panic| match lost(&*panic) {
        Some(why) => Err(why),
        None => resume_unwind(panic),
    })
}

/// What of a panic is a result of the runtime's that ends a session.
fn lost(panic: &(dyn Any + Send)) -> Option<String> {
    let said = panic.downcast_ref::<String>().map(String::as_str).or_else(|| panic.downcast_ref::<&str>().copied())?;
    const ENDS: [&str; 3] = ["ERROR_INSTANCE_LOST", "ERROR_SESSION_LOST", "ERROR_RUNTIME_FAILURE"];
    ENDS.iter().any(|end| said.contains(end)).then(|| format!("it broke down in the middle of a frame: {said}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Instant;

    #[test]
    fn reports_are_lines_of_json() {
        let first = Instant::now();
        let told = Told {
            frames: 101,
            first: Some(first),
            last: Some(first + Duration::from_secs(5)),
            waited: Duration::from_secs(1),
            resolution: [320, 240],
            one_pass_frames: 100,
            pictures: vec!["b\\right.png".into(), "a\"left.png".into()],
            eye: Vec3::new(1.0, 1.65, -2.0),
            yaw_rad: std::f32::consts::FRAC_PI_2,
            clock_s: 9.5 * 3600.0,
            playing: true,
            fault: None,
        };
        let report = HeadsetReport::new(&told, "Monado\n25".to_owned(), String::new());
        assert_eq!(
            report.json(),
            "{\"frames\": 101, \"seconds\": 5.000, \"frame_ms\": 50.00, \"work_ms\": 40.00, \"runtime\": \"Monado\\u000a25\", \"headset\": \"\", \
             \"resolution\": [320, 240], \"passes\": 1, \"eye\": [1.000, 1.650, -2.000], \"heading_deg\": 90.00, \"clock\": \"09:30\", \"playing\": true, \
             \"pictures\": [\"a\\\"left.png\", \"b\\\\right.png\"]}"
        );
        assert_eq!(HeadsetReport::new(&Told::default(), String::new(), String::new()).frame_ms(), 0.0);
    }

    #[test]
    fn only_what_a_runtime_breaks_off_is_taken_for_its_end() {
        let panics = |with: String| catch_unwind(|| std::panic::panic_any(with)).unwrap_err();
        let result = openxr::sys::Result::ERROR_INSTANCE_LOST;
        assert!(
            lost(&*panics(format!("Failed to begin frame: {:?}", openxr::sys::Result::ERROR_SESSION_LOST)))
                .is_some_and(|why| why.contains("begin frame"))
        );
        assert!(lost(&*panics(format!("called `Result::unwrap()` on an `Err` value: OpenXrError({result:?})"))).is_some());
        assert_eq!(lost(&*panics("index out of bounds".to_owned())), None);
        assert_eq!(lost(&7_u32), None);
    }

    #[test]
    fn bad_bundles_and_samples_are_told_before_any_runtime_is_asked() {
        let missing = run_headset("/nowhere", &HeadsetOptions::default());
        assert!(matches!(missing, Err(HeadsetError::Bundle(_))));
        let samples = run_headset(
            "/nowhere",
            &HeadsetOptions { visit: VisitOptions { samples: 3, ..VisitOptions::default() }, ..HeadsetOptions::default() },
        );
        assert!(matches!(samples, Err(HeadsetError::Samples(3))));
    }
}
