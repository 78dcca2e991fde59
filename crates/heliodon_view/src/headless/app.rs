//! An app that is stepped by hand, with time standing still.

use super::fault::DeviceFault;
use super::readback::{Pending, longest_side};
use super::{HeadlessError, RenderOptions, Shot, ShotExposure};
use crate::HeliodonPlugins;
use crate::actors::Actors;
use crate::actors::levels::Directions;
use crate::culling::Culling;
use crate::daylight::pipelines::StagePipelines;
use crate::film::Films;
use crate::impostor::Impostors;
use crate::sky::SkyMaps;
use crate::stage::frame::StageFrame;
use crate::stage::{Stage, StageStatus};
use crate::time_lapse::TimeLapse;
use crate::time_lapse::exposure::Exposure;
use crate::tonemap::ToneCurve;
use crate::visit::graphics;
use bevy::app::PluginGroupBuilder;
use bevy::log::LogPlugin;
use bevy::prelude::*;
use bevy::render::pipelined_rendering::PipelinedRenderingPlugin;
use bevy::render::{RenderApp, RenderPlugin};
use bevy::time::TimeUpdateStrategy;
use bevy::window::ExitCondition;
use bevy::winit::WinitPlugin;
use heliodon_bundle::BundleReader;
use std::path::Path;
use std::time::Duration;

/// Levels of the light sphere for actors in films and in stills: 66 and 1,026 directions.
const FILM_LEVEL: u32 = 2;
const STILL_LEVEL: u32 = 4;

/// Bevy's plugins for pictures that no window shows; all pipelines are there when the first is drawn.
pub(crate) fn without_a_window() -> PluginGroupBuilder {
    DefaultPlugins
        .set(WindowPlugin { primary_window: None, exit_condition: ExitCondition::DontExit, ..default() })
        .set(RenderPlugin { synchronous_pipeline_compilation: true, ..graphics() })
        .disable::<WinitPlugin>()
        .disable::<LogPlugin>()
}

/// The app and what its GPU has told.
pub(crate) struct Stepped {
    pub(crate) app: App,
    fault: DeviceFault,
}

impl Stepped {
    /// An app for pictures of the bundle in `folder`, which is not opened yet but known to be one; `more` adds what else it needs.
    pub(crate) fn new(folder: &Path, samples: u32, more: impl FnOnce(&mut App)) -> Result<Self, HeadlessError> {
        // Before the GPU is asked for: a bad bundle fails at once.
        drop(BundleReader::open(folder)?);
        let mut app = App::new();
        app.add_plugins(without_a_window().disable::<PipelinedRenderingPlugin>())
            .add_plugins(HeliodonPlugins)
            .insert_resource(TimeUpdateStrategy::ManualDuration(Duration::ZERO));
        more(&mut app);
        if let Some(render_app) = app.get_sub_app_mut(RenderApp) {
            render_app.world_mut().resource_mut::<StagePipelines>().both_eyes.at_once = true;
        }
        let fault = DeviceFault::start(&mut app);
        app.world_mut().resource_mut::<SkyMaps>().wait = true;
        app.world_mut().resource_mut::<Films>().wait = true;
        // A picture shows all there is.
        app.insert_resource(Culling::exact());
        app.world_mut().resource_mut::<TimeLapse>().playing = false;
        // A picture does not depend on how fast the machine is.
        let level = if samples > RenderOptions::film().samples { STILL_LEVEL } else { FILM_LEVEL };
        app.world_mut().resource_mut::<Actors>().options.directions = Directions::Fixed(level);
        Ok(Self { app, fault })
    }

    /// Refuses sizes that the device cannot draw.
    pub(crate) fn check_size(&self, [width, height]: [u32; 2], samples: u32) -> Result<(), HeadlessError> {
        let most = longest_side(&self.app) / samples;
        match (1..=most).contains(&width) && (1..=most).contains(&height) {
            true => Ok(()),
            false => Err(HeadlessError::Size { width, height, samples, most }),
        }
    }

    /// Opens the bundle and steps until everything is on the GPU.
    pub(crate) fn load(&mut self, folder: &Path, cameras: &[Entity]) -> Result<(), HeadlessError> {
        self.app.world_mut().resource_mut::<Stage>().open(folder)?;
        self.set_active(cameras, false);
        loop {
            self.step()?;
            let stage = self.app.world().resource::<Stage>();
            match stage.status() {
                StageStatus::Failed(what) => return Err(HeadlessError::Loading(what.clone())),
                _ if stage.is_complete() && self.people_are_complete() => break,
                _ => std::thread::sleep(Duration::from_millis(1)),
            }
        }
        self.set_active(cameras, true);
        // A frame in which the cameras get their share of the render world.
        self.step()
    }

    fn people_are_complete(&self) -> bool {
        let world = self.app.world();
        world.resource::<Actors>().is_complete()
            && world.resource::<Impostors>().is_complete()
            && world.resource::<Films>().is_complete()
    }

    /// A frame.
    pub(crate) fn step(&mut self) -> Result<(), HeadlessError> {
        self.app.update();
        self.check_device()
    }

    fn check_device(&self) -> Result<(), HeadlessError> {
        self.fault.first().map_or(Ok(()), |what| Err(HeadlessError::Device(what)))
    }

    pub(crate) fn set_active(&mut self, cameras: &[Entity], active: bool) {
        for &camera in cameras {
            if let Some(mut camera) = self.app.world_mut().get_mut::<Camera>(camera) {
                camera.is_active = active;
            }
        }
    }

    /// Sets the hour, the exposure and the actors of a shot.
    pub(crate) fn set_moment(&mut self, shot: &Shot, curve: ToneCurve) {
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
        world.resource_mut::<Films>().at_s = Some(shot.actors_s);
        world.resource_mut::<StageFrame>().curve = curve;
    }

    /// Draws a frame whose sky has to be there.
    pub(crate) fn draw(&mut self) -> Result<(), HeadlessError> {
        self.step()?;
        match self.app.world().resource::<SkyMaps>().missing() {
            Some(why) => Err(HeadlessError::Sky(why.to_owned())),
            None => Ok(()),
        }
    }

    /// A picture, once it is here.
    pub(crate) fn wait(&self, pending: Pending) -> Result<Vec<u8>, HeadlessError> {
        let bytes = pending.wait(&self.app)?;
        // What failed in the meantime may have failed in this picture.
        self.check_device()?;
        Ok(bytes)
    }
}
