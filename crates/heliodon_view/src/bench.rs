//! How long a frame takes: the measure of `heliodon bench` and of `examples/frame_time.rs`.

pub mod walk;

use crate::HeliodonPlugins;
use crate::actors::{Actors, ActorsOptions, Told};
use crate::daylight::{DaylightCamera, OnePassPairs, StereoPair, StereoPasses};
use crate::film::{FilmOptions, FilmTold, Films};
use crate::headless::fault::DeviceFault;
use crate::headless::without_a_window;
use crate::impostor::{ImpostorOptions, Impostors};
use crate::navigation::pose::{Pose, fov_deg};
use crate::particles::{Particles, ParticlesBy, ParticlesOptions, ParticlesTold};
use crate::stage::frame::StageFrame;
use crate::stage::{Stage, StageStatus};
use crate::time_lapse::TimeLapse;
use bevy::app::ScheduleRunnerPlugin;
use bevy::camera::RenderTarget;
use bevy::prelude::*;
use bevy::render::render_resource::TextureFormat;
use bevy::render::renderer::RenderAdapterInfo;
use heliodon_bundle::ReadError;
use heliodon_bundle::display::Passes;
use heliodon_bundle::memory::resident_bytes;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};
use thiserror::Error;

/// What is measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameBench {
    /// Columns of the picture.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Samples a pixel: 1, 2, 4 or 8.
    pub samples: u32,
    /// Whether the day passes, so that every frame has its own light; otherwise it is noon.
    pub playing: bool,
    /// Whether the eye moves in every frame, to and fro: an eye at rest is spared what it does not see.
    pub swaying: bool,
    /// In how many passes each frame's two pictures are drawn, of eyes [`EYES_APART_M`] apart; `None` for one picture.
    pub stereo: Option<Passes>,
    /// Frames that are not counted, after everything was loaded.
    pub warm_up: u32,
    /// Frames that are.
    pub frames: u32,
    /// The eye; `None` for the bundle's beginning.
    pub pose: Option<Pose>,
    /// How actors are lit.
    pub actors: ActorsOptions,
    /// How impostors are shown.
    pub impostors: ImpostorOptions,
    /// Whether details are switched off.
    pub without_details: bool,
    /// Whether the bundle's films are left out.
    pub without_films: bool,
    /// Who simulates sources of very many particles.
    pub particles: ParticlesBy,
    /// Particles of a frame at most, where the processor does.
    pub most_particles: usize,
}

impl Default for FrameBench {
    fn default() -> Self {
        Self {
            width: 1024,
            height: 768,
            samples: 1,
            playing: true,
            swaying: false,
            stereo: None,
            warm_up: 60,
            frames: 100,
            pose: None,
            actors: ActorsOptions::default(),
            impostors: ImpostorOptions::default(),
            without_details: false,
            without_films: false,
            particles: ParticlesBy::Auto,
            most_particles: ParticlesOptions::default().most,
        }
    }
}

/// How far a swaying eye goes.
const SWAY_M: f32 = 0.01;

/// Between the pupils of a visitor: the mean of adults is 63 to 64 mm (N. A. Dodgson, "Variation and extrema of human interpupillary distance",
/// Proc. SPIE 5291, 2004).
pub const EYES_APART_M: f32 = 0.063;

/// Why there is no measurement.
#[derive(Debug, Error)]
pub enum BenchError {
    /// The bundle cannot be opened.
    #[error(transparent)]
    Bundle(#[from] ReadError),
    /// The bundle could not be read to its end.
    #[error("{0}")]
    Loading(String),
    /// The GPU failed.
    #[error("the GPU failed: {0}")]
    Device(String),
    /// Something else ended the program before all frames were drawn.
    #[error("the frames ended before they were counted: {0:?}")]
    Ended(AppExit),
}

impl BenchError {
    /// What has gone wrong so far, if anything.
    fn of(stage: &Stage, fault: &DeviceFault) -> Option<Self> {
        match stage.status() {
            StageStatus::Failed(what) => Some(Self::Loading(what.clone())),
            _ => fault.first().map(Self::Device),
        }
    }
}

/// What an app has found that ended: the last frame is drawn beside the program and may fail after it was counted.
fn ended<T>(found: Option<Result<T, BenchError>>, fault: &DeviceFault, exit: AppExit) -> Result<T, BenchError> {
    match (found, fault.first()) {
        (Some(Ok(_)), Some(what)) => Err(BenchError::Device(what)),
        (Some(found), _) => found,
        (None, _) => Err(BenchError::Ended(exit)),
    }
}

/// What was found.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameTimes {
    /// Mean time of a frame.
    pub mean_ms: f64,
    /// Mean processor time of a frame over all threads: on a busy machine it says more than the clock. `None` where the system
    /// does not tell.
    pub processor_ms: Option<f64>,
    /// The device that drew it.
    pub device: String,
    /// Memory of the process at the end, bytes; `None` where the system does not tell.
    pub resident_bytes: Option<u64>,
    /// In how many passes two pictures were drawn.
    pub stereo_passes: Option<u32>,
    /// What the actors of the last frame took.
    pub actors: Told,
    /// What the particles of the last frame took.
    pub particles: ParticlesTold,
    /// What films took: pictures of the frames that count, and milliseconds of the last one.
    pub films: FilmTold,
}

/// Processor time of this process so far, in milliseconds.
fn processor_ms() -> Option<f64> {
    /// Ticks of /proc's times, 100 a second on every Linux.
    const TICK_MS: f64 = 10.0;
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    // After the name, which may hold spaces and ends with the last parenthesis, come the fields from the third on.
    let mut fields = stat.rsplit_once(')')?.1.split_whitespace().skip(11);
    let (user, system): (f64, f64) = (fields.next()?.parse().ok()?, fields.next()?.parse().ok()?);
    Some((user + system) * TICK_MS)
}

#[derive(Default)]
struct Counted {
    frames: u32,
    begun: Option<(Instant, Option<f64>, FilmTold)>,
    found: Option<Result<FrameTimes, BenchError>>,
}

#[derive(Resource, Clone, Default)]
struct Clock(Arc<Mutex<Counted>>);

/// Draws the bundle in `folder`, off screen, as often as `bench` says, with Bevy's pipelined rendering as in the window.
/// Without a folder, an empty scene, for comparison.
///
/// # Errors
/// If it is no bundle or cannot be read to its end, or the GPU fails: a frame that was not drawn is no measurement.
///
/// # Panics
/// Without any GPU driver, as Bevy does.
pub fn frame_times(folder: Option<&Path>, bench: FrameBench) -> Result<FrameTimes, BenchError> {
    let mut app = App::new();
    app.add_plugins(without_a_window()).add_plugins((HeliodonPlugins, ScheduleRunnerPlugin::run_loop(Duration::ZERO)));
    app.world_mut().resource_mut::<TimeLapse>().playing = bench.playing;
    app.world_mut().resource_mut::<Actors>().options = bench.actors;
    app.world_mut().resource_mut::<Impostors>().options = bench.impostors;
    app.world_mut().resource_mut::<StageFrame>().without_details = bench.without_details;
    app.world_mut().resource_mut::<FilmOptions>().without = bench.without_films;
    let sides: &[f32] = if bench.stereo.is_some() { &[-0.5, 0.5] } else { &[0.0] };
    app.insert_resource(StereoPasses(bench.stereo.unwrap_or_default()));
    let cameras: Vec<(Entity, f32)> = sides
        .iter()
        .map(|side| {
            let target = Image::new_target_texture(bench.width, bench.height, TextureFormat::Rgba8UnormSrgb, None);
            let target = app.world_mut().resource_mut::<Assets<Image>>().add(target);
            let camera =
                app.world_mut().spawn((DaylightCamera, Msaa::from_samples(bench.samples), RenderTarget::from(target))).id();
            if bench.stereo.is_some() {
                app.world_mut().entity_mut(camera).insert(StereoPair::default());
            }
            (camera, side * EYES_APART_M)
        })
        .collect();
    if let Some(folder) = folder {
        let mut stage = app.world_mut().resource_mut::<Stage>();
        stage.open(folder)?;
        let bundle = stage.bundle().cloned();
        bench.particles.prepare(&mut app, bundle.as_ref().map_or(&[], |bundle| &bundle.living().particles));
        app.world_mut().resource_mut::<Particles>().options.most = bench.most_particles;
        let stage = app.world().resource::<Stage>();
        if let Some(manifest) = stage.manifest() {
            let pose = bench.pose.unwrap_or_else(|| Pose::home(manifest));
            let fov = fov_deg(manifest).to_radians();
            let projection = Projection::Perspective(PerspectiveProjection { fov, near: 0.05, ..default() });
            for (camera, side_m) in cameras {
                let mut transform = pose.transform();
                transform.translation += transform.right() * side_m;
                app.world_mut().entity_mut(camera).insert((transform, projection.clone()));
            }
        }
    }
    let clock = Clock::default();
    let fault = DeviceFault::start(&mut app);
    app.insert_resource(clock.clone()).insert_resource(fault.clone()).add_systems(
        Update,
        move |stage: Res<Stage>,
              (actors, impostors, films, particles): (Res<Actors>, Res<Impostors>, Res<Films>, Res<Particles>),
              clock: Res<Clock>,
              fault: Res<DeviceFault>,
              adapter: Option<Res<RenderAdapterInfo>>,
              one_pass: Res<OnePassPairs>,
              mut cameras: Query<&mut Transform, With<DaylightCamera>>,
              mut lapse: ResMut<TimeLapse>,
              mut exit: MessageWriter<AppExit>| {
            let mut clock = clock.0.lock().unwrap_or_else(PoisonError::into_inner);
            if let Some(error) = BenchError::of(&stage, &fault) {
                clock.found = Some(Err(error));
                exit.write(AppExit::error());
                return;
            }
            let complete = stage.is_complete() && actors.is_complete() && impostors.is_complete() && films.is_complete();
            if !(complete || *stage.status() == StageStatus::Empty) {
                return;
            }
            let (first, last) = lapse.span_s();
            if !bench.playing && clock.frames == 0 && last > first {
                lapse.scrub((first + last) * 0.5);
            }
            if bench.swaying {
                let side = if clock.frames.is_multiple_of(2) { SWAY_M } else { -SWAY_M };
                cameras.iter_mut().for_each(|mut camera| camera.translation.x += side);
            }
            clock.frames += 1;
            if clock.frames == bench.warm_up.max(1) {
                clock.begun = Some((Instant::now(), processor_ms(), films.told()));
            }
            if clock.frames >= bench.warm_up.max(1) + bench.frames.max(1) {
                let frames = f64::from(bench.frames.max(1));
                if let Some((start, before, films_before)) = clock.begun {
                    clock.found = Some(Ok(FrameTimes {
                        mean_ms: start.elapsed().as_secs_f64() * 1e3 / frames,
                        processor_ms: before.zip(processor_ms()).map(|(before, after)| (after - before) / frames),
                        device: adapter.map_or_else(String::new, |info| info.name.clone()),
                        resident_bytes: resident_bytes(),
                        stereo_passes: bench.stereo.map(|_| if one_pass.count() > 0 { 1 } else { 2 }),
                        actors: actors.told(),
                        particles: particles.told(),
                        films: films.told().since(&films_before),
                    }));
                }
                exit.write(AppExit::Success);
            }
        },
    );
    let exit = app.run();
    let found = clock.0.lock().unwrap_or_else(PoisonError::into_inner).found.take();
    ended(found, &fault, exit)
}
