//! Pictures without a display: the window's own passes, into memory.
//!
//! A [`Renderer`] is a Bevy app that is stepped by hand, with time standing still: a picture depends on its [`Shot`] and on
//! nothing that was drawn before. Pictures are drawn larger and averaged down: most of the stone's triangles are smaller than
//! a pixel, so multisampling, which shades once a pixel, would leave their light noisy.

mod downsample;
pub(crate) mod fault;
mod readback;

use crate::HeliodonPlugins;
use crate::actors::Actors;
use crate::actors::levels::Directions;
use crate::culling::{Culling, CullingTold};
use crate::daylight::prepare::StageView;
use crate::daylight::{DaylightCamera, ExactAtRest};
use crate::navigation::pose::{Pose, fov_deg};
use crate::sky::SkyMaps;
use crate::stage::frame::StageFrame;
use crate::stage::{Stage, StageStatus};
use crate::time_lapse::exposure::Exposure;
use crate::time_lapse::{Blend, TimeLapse};
use crate::tonemap::ToneCurve;
use bevy::app::PluginGroupBuilder;
use bevy::camera::RenderTarget;
use bevy::log::LogPlugin;
use bevy::prelude::*;
use bevy::render::pipelined_rendering::PipelinedRenderingPlugin;
use bevy::render::render_resource::{TextureFormat, TextureUsages};
use bevy::render::{RenderApp, RenderPlugin};
use bevy::time::TimeUpdateStrategy;
use bevy::window::ExitCondition;
use bevy::winit::WinitPlugin;
use fault::DeviceFault;
use heliodon_bundle::{BundleReader, ReadError};
use heliodon_image::{HdrImage, SrgbImage};
use readback::{Pending, ReadbackError, begin_readback};
use std::path::Path;
use std::sync::mpsc::{SyncSender, sync_channel};
use std::time::Duration;
use thiserror::Error;

/// Why there is no picture.
#[derive(Debug, Error)]
pub enum HeadlessError {
    /// The bundle cannot be opened.
    #[error(transparent)]
    Bundle(#[from] ReadError),
    /// The bundle could not be read to its end.
    #[error("{0}")]
    Loading(String),
    /// A picture of a size that cannot be drawn.
    #[error(
        "a picture of {width} x {height} pixels with {samples} x {samples} samples a pixel: each side must be 1 to {most} pixels"
    )]
    Size {
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
        /// Samples along each side of a pixel.
        samples: u32,
        /// The longest side that the device draws with so many samples.
        most: u32,
    },
    /// The sky of the picture cannot be read.
    #[error("{0}")]
    Sky(String),
    /// The GPU failed: what it holds since then is no picture.
    #[error("the GPU failed: {0}")]
    Device(String),
    /// The GPU did not give the picture back.
    #[error(transparent)]
    Readback(#[from] ReadbackError),
}

/// How a [`Renderer`] draws.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RenderOptions {
    /// Samples along each side of a pixel, 1 to 4. Triangles are set up only once, so that on software Vulkan 2 takes 1.8
    /// times and 4 takes 4.5 times as long as 1 (720,000 triangles, 1024x768); edges then have 5 and 17 levels.
    pub samples: u32,
}

impl RenderOptions {
    /// For films: 2 x 2.
    #[must_use]
    pub fn film() -> Self {
        Self { samples: 2 }
    }

    /// For stills: 4 x 4.
    #[must_use]
    pub fn still() -> Self {
        Self { samples: 4 }
    }
}

impl Default for RenderOptions {
    fn default() -> Self {
        Self::film()
    }
}

/// How a picture is exposed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ShotExposure {
    /// As the lapse says, and so many stops more.
    Lapse(f32),
    /// So many stops.
    Stops(f32),
}

/// Levels of the light sphere for actors in films and in stills: 66 and 1,026 directions.
const FILM_LEVEL: u32 = 2;
const STILL_LEVEL: u32 = 4;

/// One picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shot {
    /// Local time in seconds after midnight; the lapse's nearest end for one outside it.
    pub clock_s: f64,
    /// The eye.
    pub pose: Pose,
    /// Vertical opening angle, degrees.
    pub fov_deg: f32,
    /// Exposure.
    pub exposure: ShotExposure,
    /// Tone curve of 8-bit pictures.
    pub curve: ToneCurve,
    /// How the steps are joined.
    pub blend: Blend,
    /// How long the actors have acted, in seconds. From one picture to the next of a film they go on smoothly.
    pub actors_s: f64,
}

/// Bevy's plugins for pictures that no window shows; all pipelines are there when the first is drawn.
pub(crate) fn without_a_window() -> PluginGroupBuilder {
    DefaultPlugins
        .set(WindowPlugin { primary_window: None, exit_condition: ExitCondition::DontExit, ..default() })
        .set(RenderPlugin { synchronous_pipeline_compilation: true, ..default() })
        .disable::<WinitPlugin>()
        .disable::<LogPlugin>()
}

/// Draws pictures of one bundle.
pub struct Renderer {
    app: App,
    camera: Entity,
    /// Targets with display values and with linear light.
    targets: [Handle<Image>; 2],
    size: UVec2,
    samples: u32,
    fault: DeviceFault,
}

impl Renderer {
    /// Opens the bundle in `folder` and loads all of it, for pictures of `width` by `height` pixels.
    ///
    /// # Errors
    /// If it cannot be read, the size cannot be drawn, or the GPU has no room for it.
    ///
    /// # Panics
    /// Without any Vulkan, Metal or DirectX driver, as Bevy does; a software one will do.
    pub fn new(folder: impl AsRef<Path>, width: u32, height: u32, options: RenderOptions) -> Result<Self, HeadlessError> {
        // Before the GPU is asked for: a bad bundle fails at once.
        drop(BundleReader::open(folder.as_ref())?);
        let samples = options.samples.clamp(1, 4);
        let mut app = App::new();
        app.add_plugins(without_a_window().disable::<PipelinedRenderingPlugin>())
            .add_plugins(HeliodonPlugins)
            .insert_resource(TimeUpdateStrategy::ManualDuration(Duration::ZERO));
        let fault = DeviceFault::start(&mut app);
        app.world_mut().resource_mut::<SkyMaps>().wait = true;
        // A picture shows all there is.
        app.insert_resource(Culling::exact());
        app.world_mut().resource_mut::<TimeLapse>().playing = false;
        // A picture does not depend on how fast the machine is.
        let level = if samples > RenderOptions::film().samples { STILL_LEVEL } else { FILM_LEVEL };
        app.world_mut().resource_mut::<Actors>().options.directions = Directions::Fixed(level);

        let most = readback::longest_side(&app) / samples;
        if !(1..=most).contains(&width) || !(1..=most).contains(&height) {
            return Err(HeadlessError::Size { width, height, samples, most });
        }
        let size = UVec2::new(width, height);
        let drawn = size * samples;
        let mut images = app.world_mut().resource_mut::<Assets<Image>>();
        let targets = [TextureFormat::Rgba8UnormSrgb, TextureFormat::Rgba16Float].map(|format| {
            let mut image = Image::new_target_texture(drawn.x, drawn.y, format, None);
            image.texture_descriptor.usage |= TextureUsages::COPY_SRC;
            images.add(image)
        });
        let camera = app.world_mut().spawn((DaylightCamera, ExactAtRest, RenderTarget::from(targets[0].clone()))).id();
        app.world_mut().resource_mut::<Stage>().open(folder)?;
        let mut renderer = Self { app, camera, targets, size, samples, fault };
        renderer.load()?;
        Ok(renderer)
    }

    /// Steps until everything is on the GPU.
    fn load(&mut self) -> Result<(), HeadlessError> {
        self.set_active(false);
        loop {
            self.step()?;
            match self.stage().status() {
                StageStatus::Failed(what) => return Err(HeadlessError::Loading(what.clone())),
                _ if self.stage().is_complete() && self.app.world().resource::<Actors>().is_complete() => break,
                _ => std::thread::sleep(Duration::from_millis(1)),
            }
        }
        self.set_active(true);
        // A frame in which the camera gets its share of the render world.
        self.step()
    }

    /// Waits until it is known what can be culled of the bundle. Pictures are the same before; what they cost is not, nor what contribution culling would
    /// leave out of them if it were switched on.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn wait_for_culling(&mut self) -> Result<(), HeadlessError> {
        // Without a picture: what is drawn of a moving eye may depend on what was drawn before.
        self.set_active(false);
        while !self.app.world().resource::<CullingTold>().is_ready() {
            self.step()?;
            std::thread::sleep(Duration::from_millis(1));
        }
        self.set_active(true);
        Ok(())
    }

    /// A frame.
    fn step(&mut self) -> Result<(), HeadlessError> {
        self.app.update();
        self.check_device()
    }

    fn check_device(&self) -> Result<(), HeadlessError> {
        self.fault.first().map_or(Ok(()), |what| Err(HeadlessError::Device(what)))
    }

    fn set_active(&mut self, active: bool) {
        if let Some(mut camera) = self.app.world_mut().get_mut::<Camera>(self.camera) {
            camera.is_active = active;
        }
    }

    /// The stage with the bundle.
    #[must_use]
    pub fn stage(&self) -> &Stage {
        self.app.world().resource::<Stage>()
    }

    /// The app, to put guests on the stage: what is added is in the next picture.
    pub fn app_mut(&mut self) -> &mut App {
        &mut self.app
    }

    /// Triangles of the stone that the last picture drew; fewer once the eye rests where a processor draws, since it then draws
    /// what is seen.
    pub fn triangles_drawn(&mut self) -> u64 {
        let world = self.app.sub_app_mut(RenderApp).world_mut();
        world.query::<&StageView>().iter(world).map(StageView::triangle_count).sum()
    }

    /// The shot of a visitor who just came, at a local time in seconds after midnight, as the lapse exposes it.
    #[must_use]
    pub fn home_shot(&self, clock_s: f64) -> Shot {
        let manifest = self.stage().manifest();
        Shot {
            clock_s,
            pose: manifest.map_or(Pose { eye: Vec3::ZERO, yaw_rad: 0.0, pitch_rad: 0.0 }, Pose::home),
            fov_deg: manifest.map_or(50.0, fov_deg),
            exposure: ShotExposure::Lapse(0.0),
            curve: ToneCurve::Clamp,
            blend: Blend::Smooth,
            actors_s: 0.0,
        }
    }

    /// The picture as the display shows it.
    ///
    /// # Errors
    /// If its sky cannot be read, or the GPU fails or does not give it back.
    pub fn render(&mut self, shot: &Shot) -> Result<SrgbImage, HeadlessError> {
        let pending = self.draw(shot, shot.curve)?;
        let bytes = self.wait(pending)?;
        Ok(downsample::srgb(&bytes, self.size, self.samples))
    }

    /// The picture's radiance: linear, not exposed, not clamped but for half floats' range around the lapse's exposure.
    ///
    /// # Errors
    /// As of [`Renderer::render`].
    pub fn render_linear(&mut self, shot: &Shot) -> Result<HdrImage, HeadlessError> {
        let pending = self.draw(shot, ToneCurve::Linear)?;
        let stops = self.app.world().resource::<StageFrame>().exposure_stops;
        let bytes = self.wait(pending)?;
        Ok(downsample::linear(&bytes, self.size, self.samples, (-stops).exp2()))
    }

    /// Draws one picture after the other and hands each to `take`, which has a thread of its own: while a picture is taken, the
    /// next ones are drawn.
    ///
    /// # Errors
    /// Why the first picture that cannot be made cannot, or what `take` says.
    pub fn render_all<E: From<HeadlessError> + Send>(
        &mut self,
        shots: impl IntoIterator<Item = Shot>,
        mut take: impl FnMut(usize, SrgbImage) -> Result<(), E> + Send,
    ) -> Result<(), E> {
        let (size, samples) = (self.size, self.samples);
        let (sender, drawn) = sync_channel::<Vec<u8>>(1);
        std::thread::scope(|scope| {
            let taker = scope.spawn(move || {
                drawn.iter().enumerate().try_for_each(|(index, bytes)| take(index, downsample::srgb(&bytes, size, samples)))
            });
            let made = self.draw_all(shots, sender);
            let taken = taker.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
            made.map_err(E::from).and(taken)
        })
    }

    /// Draws one picture after the other; while the GPU draws one, the one before is sent. Ends early if nobody takes them.
    fn draw_all(&mut self, shots: impl IntoIterator<Item = Shot>, taker: SyncSender<Vec<u8>>) -> Result<(), HeadlessError> {
        let mut before: Option<Pending> = None;
        for shot in shots {
            let drawn = self.draw(&shot, shot.curve)?;
            if let Some(pending) = before.replace(drawn)
                && taker.send(self.wait(pending)?).is_err()
            {
                return Ok(());
            }
        }
        if let Some(pending) = before {
            // Whoever does not take it has said why.
            taker.send(self.wait(pending)?).ok();
        }
        Ok(())
    }

    fn wait(&self, pending: Pending) -> Result<Vec<u8>, HeadlessError> {
        let bytes = pending.wait(&self.app)?;
        // What failed in the meantime may have failed in this picture.
        self.check_device()?;
        Ok(bytes)
    }

    fn draw(&mut self, shot: &Shot, curve: ToneCurve) -> Result<Pending, HeadlessError> {
        let target = self.targets[usize::from(curve == ToneCurve::Linear)].clone();
        let world = self.app.world_mut();
        let mut lapse = world.resource_mut::<TimeLapse>();
        lapse.playing = false;
        lapse.blend = shot.blend;
        lapse.scrub(shot.clock_s);
        let mut exposure = world.resource_mut::<Exposure>();
        *exposure = Exposure::default();
        match shot.exposure {
            ShotExposure::Lapse(more) => exposure.manual_stops = more,
            ShotExposure::Stops(stops) => exposure.fix(stops),
        }
        world.resource_mut::<Actors>().seconds = shot.actors_s;
        world.resource_mut::<StageFrame>().curve = curve;
        let projection = PerspectiveProjection { fov: shot.fov_deg.to_radians(), near: 0.05, ..default() };
        world.entity_mut(self.camera).insert((
            RenderTarget::from(target.clone()),
            Projection::Perspective(projection),
            shot.pose.transform(),
        ));
        self.step()?;
        if let Some(why) = self.app.world().resource::<SkyMaps>().missing() {
            return Err(HeadlessError::Sky(why.to_owned()));
        }
        Ok(begin_readback(&self.app, &target)?)
    }
}
