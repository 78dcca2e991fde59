//! Pictures without a display: the window's own passes, into memory.
//!
//! A [`Renderer`] is a Bevy app that is stepped by hand, with time standing still: a picture depends on its [`Shot`] and on
//! nothing that was drawn before. Pictures are drawn larger and averaged down: most of the stone's triangles are smaller than
//! a pixel, so multisampling, which shades once a pixel, would leave their light noisy.

pub(crate) mod app;
pub(crate) mod downsample;
pub(crate) mod fault;
pub(crate) mod readback;
pub mod room;

use crate::culling::CullingTold;
use crate::daylight::prepare::StageView;
use crate::daylight::{DaylightCamera, ExactAtRest};
use crate::navigation::pose::{Pose, fov_deg};
use crate::stage::Stage;
use crate::stage::frame::StageFrame;
use crate::time_lapse::Blend;
use crate::tonemap::ToneCurve;
use app::Stepped;
pub(crate) use app::without_a_window;
use bevy::camera::RenderTarget;
use bevy::prelude::*;
use bevy::render::RenderApp;
use bevy::render::render_resource::{TextureFormat, TextureUsages};
use heliodon_bundle::ReadError;
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

/// Draws pictures of one bundle.
pub struct Renderer {
    stepped: Stepped,
    camera: Entity,
    /// Targets with display values and with linear light.
    targets: [Handle<Image>; 2],
    size: UVec2,
    samples: u32,
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
        Self::with(folder, [width, height], options, |_| {})
    }

    /// The same with what `more` adds to the app while plugins can be added to it.
    ///
    /// # Errors
    /// As [`Self::new`].
    ///
    /// # Panics
    /// As [`Self::new`].
    pub fn with(
        folder: impl AsRef<Path>,
        [width, height]: [u32; 2],
        options: RenderOptions,
        more: impl FnOnce(&mut App),
    ) -> Result<Self, HeadlessError> {
        let samples = options.samples.clamp(1, 4);
        let mut stepped = Stepped::new(folder.as_ref(), samples, more)?;
        stepped.check_size([width, height], samples)?;
        let size = UVec2::new(width, height);
        let drawn = size * samples;
        let mut images = stepped.app.world_mut().resource_mut::<Assets<Image>>();
        let targets = [TextureFormat::Rgba8UnormSrgb, TextureFormat::Rgba16Float].map(|format| {
            let mut image = Image::new_target_texture(drawn.x, drawn.y, format, None);
            image.texture_descriptor.usage |= TextureUsages::COPY_SRC;
            images.add(image)
        });
        let camera = stepped.app.world_mut().spawn((DaylightCamera, ExactAtRest, RenderTarget::from(targets[0].clone()))).id();
        stepped.load(folder.as_ref(), &[camera])?;
        Ok(Self { stepped, camera, targets, size, samples })
    }

    /// Waits until it is known what can be culled of the bundle. Pictures are the same before; what they cost is not, nor what contribution culling would
    /// leave out of them if it were switched on.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn wait_for_culling(&mut self) -> Result<(), HeadlessError> {
        // Without a picture: what is drawn of a moving eye may depend on what was drawn before.
        self.stepped.set_active(&[self.camera], false);
        while !self.stepped.app.world().resource::<CullingTold>().is_ready() {
            self.stepped.step()?;
            std::thread::sleep(Duration::from_millis(1));
        }
        self.stepped.set_active(&[self.camera], true);
        Ok(())
    }

    /// The stage with the bundle.
    #[must_use]
    pub fn stage(&self) -> &Stage {
        self.stepped.app.world().resource::<Stage>()
    }

    /// The app, to put guests on the stage: what is added is in the next picture.
    pub fn app_mut(&mut self) -> &mut App {
        &mut self.stepped.app
    }

    /// Triangles of the stone that the last picture drew; fewer once the eye rests where a processor draws, since it then draws
    /// what is seen.
    pub fn triangles_drawn(&mut self) -> u64 {
        let world = self.stepped.app.sub_app_mut(RenderApp).world_mut();
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
        let bytes = self.stepped.wait(pending)?;
        Ok(downsample::srgb(&bytes, self.size, self.samples))
    }

    /// The picture's radiance: linear, not exposed, not clamped but for half floats' range around the lapse's exposure.
    ///
    /// # Errors
    /// As of [`Renderer::render`].
    pub fn render_linear(&mut self, shot: &Shot) -> Result<HdrImage, HeadlessError> {
        let pending = self.draw(shot, ToneCurve::Linear)?;
        let stops = self.stepped.app.world().resource::<StageFrame>().exposure_stops;
        let bytes = self.stepped.wait(pending)?;
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
                && taker.send(self.stepped.wait(pending)?).is_err()
            {
                return Ok(());
            }
        }
        if let Some(pending) = before {
            // Whoever does not take it has said why.
            taker.send(self.stepped.wait(pending)?).ok();
        }
        Ok(())
    }

    fn draw(&mut self, shot: &Shot, curve: ToneCurve) -> Result<Pending, HeadlessError> {
        let target = self.targets[usize::from(curve == ToneCurve::Linear)].clone();
        self.stepped.set_moment(shot, curve);
        let projection = PerspectiveProjection { fov: shot.fov_deg.to_radians(), near: 0.05, ..default() };
        self.stepped.app.world_mut().entity_mut(self.camera).insert((
            RenderTarget::from(target.clone()),
            Projection::Perspective(projection),
            shot.pose.transform(),
        ));
        self.stepped.draw()?;
        Ok(begin_readback(&self.stepped.app, &target)?)
    }
}
