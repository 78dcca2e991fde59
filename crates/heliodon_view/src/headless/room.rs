//! The pictures of a room's screens without a display: each eye's of each screen, each output's, and the room seen from outside.

use super::app::Stepped;
use super::readback::begin_readback;
use super::{HeadlessError, RenderOptions, Shot, downsample};
use crate::VisitPlugins;
use crate::daylight::{ExactAtRest, StereoPasses};
use crate::display::preview;
use crate::display::{Composer, Room, RoomEye, Showing, Side, eye_size, picture, spawn_composer, spawn_eye};
use crate::navigation::Visitor;
use crate::tracking::Trackers;
use bevy::prelude::*;
use heliodon_bundle::ConfigError;
use heliodon_bundle::display::Display;
use heliodon_image::SrgbImage;
use std::path::Path;
use std::sync::Arc;
use thiserror::Error;

/// Why there are no pictures of a room.
#[derive(Debug, Error)]
pub enum RoomError {
    /// The display's file says something that cannot be.
    #[error(transparent)]
    Display(#[from] ConfigError),
    /// The display is a desktop.
    #[error("{0} has no [[screen]]: its picture is that of an ordinary window")]
    NoScreens(String),
    /// A tracker cannot be followed.
    #[error("{0}")]
    Tracker(String),
    /// A picture cannot be drawn.
    #[error(transparent)]
    Headless(#[from] HeadlessError),
}

/// What pictures are made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RoomPictures {
    /// Each eye's picture of each screen.
    Eyes,
    /// Each output's: both eyes' pictures as they are shown, edges blended, colours corrected.
    Outputs,
}

/// Draws the pictures of a room.
pub struct RoomRenderer {
    stepped: Stepped,
    /// Name, picture and its size.
    pictures: Vec<(String, Handle<Image>, UVec2)>,
    samples: u32,
}

impl RoomRenderer {
    /// Opens the bundle in `folder` and loads all of it, for pictures of a display's screens, and of the room from outside if it has a
    /// size. Trackers that are recordings are played; others say nothing.
    ///
    /// # Errors
    /// If it cannot be read, the display is none of a room, or the GPU has no room for it.
    ///
    /// # Panics
    /// Without any Vulkan, Metal or DirectX driver, as Bevy does; a software one will do.
    pub fn new(
        folder: impl AsRef<Path>,
        display: &Arc<Display>,
        of: RoomPictures,
        outside: Option<(u32, u32)>,
        options: RenderOptions,
    ) -> Result<Self, RoomError> {
        if display.screens.is_empty() {
            return Err(RoomError::NoScreens(display.path().display().to_string()));
        }
        let room = Room::new(Arc::clone(display))?;
        let trackers = Trackers::recordings(display)?;
        if let Some(fault) = trackers.faults().first() {
            return Err(RoomError::Tracker(fault.clone()));
        }
        let samples = options.samples.clamp(1, 4);
        let mut stepped = Stepped::new(folder.as_ref(), samples, |app| {
            app.add_plugins(VisitPlugins);
        })?;
        let world = stepped.app.world_mut();
        world.insert_resource(StereoPasses(display.display.passes));
        world.spawn(room.visitor());
        let (mut cameras, mut pictures) = (Vec::new(), Vec::new());
        for (number, entry) in display.screens.iter().enumerate() {
            let size = eye_size(entry.stereo, entry.output.size_px());
            let mut eyes = Vec::new();
            for &side in Side::of(entry.stereo) {
                let (camera, image) = spawn_eye(world, RoomEye { screen: number, side }, size * samples, 1);
                world.entity_mut(camera).insert(ExactAtRest);
                cameras.push(camera);
                eyes.push((side, image));
            }
            let [Some(first), Some(last)] = [eyes.first(), eyes.last()].map(|eye| eye.map(|(_, image)| image.clone())) else {
                continue;
            };
            if of == RoomPictures::Eyes || entry.output_right.is_some() {
                let named = |(side, image): (Side, Handle<Image>)| (format!("{}{}", entry.name, side.suffix()), image, size);
                pictures.extend(eyes.into_iter().map(named));
            } else {
                let size = UVec2::from(entry.output.size_px());
                let image = world.resource_mut::<Assets<Image>>().add(picture(size * samples));
                spawn_composer(world, Composer::new(entry, [first, last], None), &Showing::Image(image.clone()));
                pictures.push((entry.name.clone(), image, size));
            }
        }
        if let Some((width, height)) = outside {
            let size = UVec2::new(width, height);
            let image = world.resource_mut::<Assets<Image>>().add(picture(size * samples));
            let eyes = preview::spawn(world, &room, &Showing::Image(image.clone()), 1);
            cameras.extend(eyes.into_iter().map(|(camera, _)| camera));
            pictures.push(("preview".to_owned(), image, size));
        }
        for (_, _, size) in &pictures {
            stepped.check_size(size.to_array(), samples)?;
        }
        stepped.app.insert_resource(room).insert_resource(trackers);
        stepped.load(folder.as_ref(), &cameras)?;
        Ok(Self { stepped, pictures, samples })
    }

    /// Names and sizes of the pictures, in their order.
    pub fn pictures(&self) -> impl Iterator<Item = (&str, UVec2)> {
        self.pictures.iter().map(|(name, _, size)| (name.as_str(), *size))
    }

    /// The app, to put guests on the stage.
    pub fn app_mut(&mut self) -> &mut App {
        &mut self.stepped.app
    }

    /// The first and the last local time of the bundle's day.
    #[must_use]
    pub fn day_s(&self) -> (f64, f64) {
        self.stepped.app.world().resource::<crate::TimeLapse>().span_s()
    }

    /// All pictures at a moment, with the trackers' recordings `seconds` after their beginning. Of the shot, the pose and the opening angle
    /// are the room's.
    ///
    /// # Errors
    /// If the sky cannot be read, or the GPU fails or does not give a picture back.
    pub fn render(&mut self, shot: &Shot, seconds: f64) -> Result<Vec<SrgbImage>, HeadlessError> {
        self.stepped.set_moment(shot, shot.curve);
        self.stepped.app.world_mut().resource_mut::<Trackers>().set_clock(seconds);
        self.stepped.draw()?;
        let mut made = Vec::with_capacity(self.pictures.len());
        for (_, image, size) in &self.pictures {
            let pending = begin_readback(&self.stepped.app, image).map_err(HeadlessError::from)?;
            made.push(downsample::srgb(&self.stepped.wait(pending)?, *size, self.samples));
        }
        Ok(made)
    }

    /// Where the visitor's platform is.
    pub fn visitor(&mut self) -> Option<Visitor> {
        let world = self.stepped.app.world_mut();
        world.query::<&Visitor>().iter(world).next().cloned()
    }
}
