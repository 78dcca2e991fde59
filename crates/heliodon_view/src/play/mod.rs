//! A visit that is played by a script of inputs, without a display, on any kind of device: to see that a story can be told to its end, and to film it.
//!
//! The same plugins as in the window are stepped by hand, a thirtieth of a second at a time. A [`script`] says what somebody does; how far the mouse goes for that is worked out from
//! where the visitor is, as a hand does it, and comes in as the device's own messages ([`devices`]). Without pictures nothing is drawn, so that minutes take seconds.

pub mod devices;
mod eye;
pub mod script;
#[cfg(test)]
mod tests;
mod told;

pub use told::{FrameTimes, Played};

use crate::VisitPlugins;
use crate::actors::Actors;
use crate::costs::{Cost, FrameTold};
use crate::daylight::DaylightCamera;
use crate::display::Room;
use crate::film::Films;
use crate::hands::{Hand, Hands};
use crate::headless::app::Stepped;
use crate::headless::readback::{ReadbackError, begin_readback};
use crate::headless::{HeadlessError, downsample};
use crate::impostor::Impostors;
use crate::input::{Action as Asked, Input, Trigger};
use crate::navigation::Visitor;
use crate::navigation::pose::fov_deg;
use crate::stage::Stage;
use crate::story::{Story, StoryPlaces};
use crate::tracking::Trackers;
use bevy::camera::RenderTarget;
use bevy::prelude::*;
use bevy::render::render_resource::{TextureFormat, TextureUsages};
use bevy::time::TimeUpdateStrategy;
use devices::{Devices, Scheme, Steer};
use heliodon_bundle::display::{Display, InputSettings, Navigation};
use heliodon_bundle::{BundleReader, ConfigError};
use heliodon_image::SrgbImage;
use heliodon_script::action::Action;
use heliodon_script::value::Value;
use script::{Doing, Expected, Goal, Line};
use std::collections::HashMap;
use std::net::SocketAddr;
use std::num::NonZeroU32;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};
use thiserror::Error;

/// How long a walk may take, beside what its length takes at an easy pace, seconds.
const WALK_S: f32 = 10.0;
const EASY_M_S: f32 = 0.7;
/// How long a look may take, seconds.
const LOOK_S: f32 = 12.0;
/// Eyes are on what they look at within this, radians; a tracked hand need only face it.
const ON_RAD: f32 = 0.012;
const FACES_RAD: f32 = 0.25;
/// Who walks turns first, to within this, radians.
const AHEAD_RAD: f32 = 0.35;
/// How long a blow takes that a button has set off, seconds; and how fast a tracked hand strikes, metres a second.
const BLOW_S: f32 = 0.6;
const BLOW_M_S: f32 = 3.0;
/// Between what is done in two lines, seconds.
const PAUSE_S: f32 = 0.15;

/// How a visit is played.
#[derive(Clone, Debug)]
pub struct PlayOptions {
    /// On what.
    pub scheme: Scheme,
    /// Frames a second.
    pub fps: f64,
    /// The pictures' size.
    pub size: (u32, u32),
    /// Every so many frames make a picture of a film; none makes no film, and draws nothing but what a line or somebody asks for.
    pub films_every: Option<NonZeroU32>,
    /// What keys, sticks and buttons do, and how fast.
    pub input: InputSettings,
    /// Where the story is from, and what is kept.
    pub story: StoryPlaces,
}

/// Why a visit cannot be played.
#[derive(Debug, Error)]
pub enum PlayError {
    /// The bundle cannot be shown.
    #[error(transparent)]
    Headless(#[from] HeadlessError),
    /// A picture did not come back.
    #[error(transparent)]
    Readback(#[from] ReadbackError),
    /// The wand's display.
    #[error(transparent)]
    Display(#[from] ConfigError),
    /// The devices cannot be had.
    #[error("no device to play with: {0}")]
    Devices(#[from] std::io::Error),
    /// The visit does not go as the script says.
    #[error("line {line}, `{text}`, after {seconds:.1} s of the visit: {why}")]
    Line {
        /// Its number, from 1.
        line: usize,
        /// What it says.
        text: String,
        /// When.
        seconds: f64,
        /// What is wrong.
        why: String,
    },
}

/// What pictures are drawn into, by which camera.
struct Easel {
    target: Handle<Image>,
    size: UVec2,
    camera: Entity,
    /// Whether the camera draws.
    draws: bool,
    films_every: Option<NonZeroU32>,
}

/// Somebody who plays.
pub struct Player {
    stepped: Stepped,
    easel: Option<Easel>,
    devices: Devices,
    scheme: Scheme,
    frame_s: f32,
    dead_zone: f32,
    /// What a tracked head looks at and a tracked hand points at.
    aim: Option<Vec3>,
    task: Option<String>,
    materials: HashMap<String, String>,
    frames_ms: Vec<f32>,
    told: Played,
}

impl Player {
    /// Opens the bundle in `folder`, and loads all of it.
    ///
    /// # Errors
    /// If it cannot be shown, or the devices cannot be had.
    pub fn new(folder: impl AsRef<Path>, options: &PlayOptions) -> Result<Self, PlayError> {
        let (input, faults) = Input::new(&options.input);
        faults.iter().for_each(|fault| warn!("{}: {}; {}", fault.action, fault.message, fault.remedy));
        let mut stepped = Stepped::new(folder.as_ref(), 1, |app| {
            app.add_plugins(VisitPlugins)
                .insert_resource(options.story.clone())
                .insert_resource(input)
                .add_systems(PostUpdate, eye::follow.before(bevy::transform::TransformSystems::Propagate));
        })?;
        let size = UVec2::from(options.size);
        stepped.check_size(size.to_array(), 1)?;
        let app = &mut stepped.app;
        let mut image = Image::new_target_texture(size.x, size.y, TextureFormat::Rgba8UnormSrgb, None);
        image.texture_descriptor.usage |= TextureUsages::COPY_SRC;
        let target = app.world_mut().resource_mut::<Assets<Image>>().add(image);
        let tracker = Self::enter(app, options)?;
        let seen = (DaylightCamera, IsDefaultUiCamera, RenderTarget::from(target.clone()));
        let camera = match options.scheme {
            // the visitor there is the room; its head sees
            Scheme::Hand => app.world_mut().spawn((seen, eye::TrackedEye)).id(),
            Scheme::Keyboard | Scheme::Pad => {
                let world = app.world_mut();
                let visitor = world.query_filtered::<Entity, With<Visitor>>().iter(world).next();
                visitor.map_or(Entity::PLACEHOLDER, |visitor| world.entity_mut(visitor).insert(seen).id())
            }
        };
        stepped.load(folder.as_ref(), &[camera])?;
        let world = stepped.app.world_mut();
        if let Some(fov) = world.resource::<Stage>().manifest().map(|manifest| fov_deg(manifest).to_radians()) {
            let projection = PerspectiveProjection { fov, near: 0.05, ..default() };
            world.entity_mut(camera).insert(Projection::Perspective(projection));
        }
        let easel = Easel { target, size, camera, draws: true, films_every: options.films_every };
        Self::begin(stepped, Some(easel), tracker, options)
    }

    /// Brings a visitor into an app, with a room around them where they are tracked; where trackers listen.
    fn enter(app: &mut App, options: &PlayOptions) -> Result<Option<SocketAddr>, PlayError> {
        if options.scheme != Scheme::Hand {
            let pace_m_s = options.input.pace_m_s as f32;
            app.world_mut().spawn(Visitor { gait: Navigation::Walk, pace_m_s, ..Visitor::default() });
            return Ok(None);
        }
        let display: Arc<Display> = devices::wand_display(&options.input)?.into();
        let mut trackers = Trackers::new(&display)?;
        // a visit's time is its own, however fast this machine is
        trackers.set_clock(0.0);
        let address = trackers.addresses().next();
        let room = Room::new(display)?;
        app.world_mut().spawn(room.visitor());
        app.insert_resource(trackers).insert_resource(room);
        Ok(address)
    }

    /// Takes the devices in hand, in an app with a bundle and a visitor.
    fn begin(
        mut stepped: Stepped,
        easel: Option<Easel>,
        tracker: Option<SocketAddr>,
        options: &PlayOptions,
    ) -> Result<Self, PlayError> {
        let app = &mut stepped.app;
        let dead_zone = app.world().resource::<Input>().settings.dead_zone as f32;
        app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_secs_f64(1.0 / options.fps)));
        let devices = Devices::connect(app, options.scheme, tracker)?;
        let mut player = Self {
            easel,
            devices,
            scheme: options.scheme,
            frame_s: (1.0 / options.fps) as f32,
            dead_zone,
            aim: None,
            task: None,
            materials: HashMap::new(),
            frames_ms: Vec::new(),
            told: Played::default(),
            stepped,
        };
        player.draw(false);
        // the first second belongs to whoever looks around
        for _ in 0..(1.0 / player.frame_s) as usize {
            player.step(&Steer::default())?;
        }
        player.devices.let_go(&mut player.stepped.app);
        player.frames_ms.clear();
        if let Some(told) = player.stepped.app.world().get_resource::<FrameTold>() {
            told.begin();
        }
        Ok(player)
    }

    /// What frames took so far.
    #[must_use]
    pub fn frame_times(&self) -> FrameTimes {
        FrameTimes::of(&self.frames_ms)
    }

    /// What each feature took of the processor in them.
    #[must_use]
    pub fn costs(&self) -> Vec<(&'static str, Cost)> {
        self.stepped.app.world().get_resource::<FrameTold>().map_or_else(Vec::new, FrameTold::costs)
    }

    /// What was odd or missing since this was asked last, such as films that cannot be played.
    pub fn take_problems(&mut self) -> Vec<String> {
        self.stepped.app.world_mut().resource_mut::<Films>().take_problems()
    }

    /// Plays a script; `take` gets each picture, where pictures are made, and those of `shot` by their names.
    ///
    /// # Errors
    /// At the first line that does not go as it says, and whatever `take` says.
    pub fn play<E: From<PlayError>>(
        &mut self,
        lines: &[Line],
        take: &mut impl FnMut(Option<&str>, SrgbImage) -> Result<(), E>,
    ) -> Result<Played, E> {
        for line in lines {
            let done = self.line(line, take)?;
            done.map_err(|why| PlayError::Line {
                line: line.number,
                text: line.text.clone(),
                seconds: self.told.seconds,
                why,
            })?;
            self.told.lines += 1;
            self.wait(PAUSE_S, take)?;
        }
        Ok(self.told.clone())
    }

    /// Does a line; what goes wrong in words.
    fn line<E: From<PlayError>>(
        &mut self,
        line: &Line,
        take: &mut impl FnMut(Option<&str>, SrgbImage) -> Result<(), E>,
    ) -> Result<Result<(), String>, E> {
        match &line.doing {
            Doing::Walk { to, within_m } => self.walk(to, *within_m, take),
            Doing::Look(goal) => self.look(goal, take),
            Doing::Strike(goal) => self.strike(goal, take),
            Doing::Press { action, hold_s } => self.press(action, *hold_s, take),
            Doing::Wait(seconds) => self.wait(*seconds, take).map(Ok),
            Doing::Until { expected, within_s } => {
                let mut left_s = *within_s;
                while self.check(expected).is_err() && left_s > 0.0 {
                    self.frame(&self.rest(), take)?;
                    left_s -= self.frame_s;
                }
                Ok(self.check(expected))
            }
            Doing::Expect(expected) => Ok(self.check(expected)),
            Doing::Shot(name) => {
                if let Some(picture) = self.still()? {
                    take(Some(name), picture)?;
                }
                Ok(Ok(()))
            }
            // whoever reads the script says it
            Doing::Say(_) => Ok(Ok(())),
        }
    }

    /// A frame, and its picture where it is one of the film.
    fn frame<E: From<PlayError>>(
        &mut self,
        steer: &Steer,
        take: &mut impl FnMut(Option<&str>, SrgbImage) -> Result<(), E>,
    ) -> Result<(), E> {
        let every = self.easel.as_ref().and_then(|easel| easel.films_every);
        let films = every.is_some_and(|every| self.frames_ms.len().is_multiple_of(every.get() as usize));
        self.draw(films);
        self.step(steer)?;
        match films.then(|| self.picture()).transpose()?.flatten() {
            Some(picture) => take(None, picture),
            None => Ok(()),
        }
    }

    /// A picture of this moment; a frame passes in which nobody does anything. None where nothing can be drawn.
    ///
    /// # Errors
    /// If the GPU fails.
    pub fn still(&mut self) -> Result<Option<SrgbImage>, PlayError> {
        self.draw(true);
        self.step(&self.rest())?;
        self.picture()
    }

    /// Whether the next frame is drawn.
    fn draw(&mut self, draws: bool) {
        let Some(easel) = self.easel.as_mut().filter(|easel| easel.draws != draws) else { return };
        easel.draws = draws;
        self.stepped.set_active(&[easel.camera], draws);
    }

    /// What the easel shows.
    fn picture(&mut self) -> Result<Option<SrgbImage>, PlayError> {
        let Some(Easel { target, size, .. }) = &self.easel else { return Ok(None) };
        let bytes = self.stepped.wait(begin_readback(&self.stepped.app, target)?)?;
        Ok(Some(downsample::srgb(&bytes, *size, 1)))
    }

    fn step(&mut self, steer: &Steer) -> Result<(), PlayError> {
        let app = &mut self.stepped.app;
        self.devices.steer(app, steer, self.dead_zone, self.frame_s);
        self.told.seconds += f64::from(self.frame_s);
        self.devices.arrive(app)?;
        if let Some(mut trackers) = app.world_mut().get_resource_mut::<Trackers>() {
            trackers.set_clock(self.told.seconds);
        }
        let begun = Instant::now();
        self.stepped.step()?;
        self.frames_ms.push(begun.elapsed().as_secs_f32() * 1e3);
        for action in self.stepped.app.world_mut().resource_mut::<Story>().take_asked() {
            match action {
                Action::Task { text, .. } => {
                    self.told.tasks.push((text.clone(), self.told.seconds));
                    self.task = Some(text);
                }
                Action::NoTask => self.task = None,
                Action::Material { target, material, .. } => drop(self.materials.insert(target, material)),
                Action::Bare { target, .. } => drop(self.materials.remove(&target)),
                _ => {}
            }
        }
        Ok(())
    }

    fn visitor(&mut self) -> Visitor {
        let world = self.stepped.app.world_mut();
        world.query::<&Visitor>().iter(world).next().cloned().unwrap_or_default()
    }

    /// Where a goal is.
    fn place(&self, goal: &Goal) -> Result<Vec3, String> {
        let name = match goal {
            Goal::Place(place) => return Ok(Vec3::from(*place)),
            Goal::Named(name) => name,
        };
        let world = self.stepped.app.world();
        let (actors, impostors) = (world.resource::<Actors>(), world.resource::<Impostors>());
        if let Some((_, (low, high))) = actors.whereabouts(name).or_else(|| impostors.whereabouts(name, actors)) {
            return Ok(0.5 * (low + high));
        }
        let bundle = world.resource::<Stage>().bundle().ok_or("nothing is on the stage")?;
        let vec = |point: [f64; 3]| Vec3::from(point.map(|v| v as f32));
        let regions = bundle.living().regions.iter().filter(|region| region.name == *name);
        let views = bundle.living().views.iter().filter(|view| view.name == *name);
        let mut places =
            regions.map(|region| 0.5 * (vec(region.min) + vec(region.max))).chain(views.map(|view| vec(view.place)));
        let found = places.next().or_else(|| middle_of_part(bundle, name));
        found.ok_or_else(|| format!("there is no actor, region, view or part `{name}`"))
    }

    /// How far the view is from looking at a place.
    fn off(&mut self, place: Vec3) -> Vec2 {
        let visitor = self.visitor();
        let wanted = crate::Pose::looking(visitor.pose.eye, place);
        let round = |angle: f32| angle.rem_euclid(std::f32::consts::TAU);
        let yaw = round(wanted.yaw_rad - visitor.pose.yaw_rad + std::f32::consts::PI) - std::f32::consts::PI;
        let pitch = if visitor.tilts { wanted.pitch_rad - visitor.pose.pitch_rad } else { 0.0 };
        Vec2::new(yaw, pitch)
    }

    fn walk<E: From<PlayError>>(
        &mut self,
        to: &Goal,
        within_m: f32,
        take: &mut impl FnMut(Option<&str>, SrgbImage) -> Result<(), E>,
    ) -> Result<Result<(), String>, E> {
        let flat = |v: Vec3| Vec2::new(v.x, v.z);
        if let Some(why) = self.devices.cannot_walk() {
            return Ok(Err(why));
        }
        self.aim = None;
        let place = match self.place(to) {
            Ok(place) => place,
            Err(why) => return Ok(Err(why)),
        };
        let far = flat(place).distance(flat(self.visitor().pose.eye));
        let mut left_s = WALK_S + far / EASY_M_S;
        loop {
            let eye = self.visitor().pose.eye;
            let off_m = flat(place).distance(flat(eye));
            if off_m <= within_m {
                self.frame(&self.rest(), take)?;
                return Ok(Ok(()));
            }
            if left_s <= 0.0 {
                return Ok(Err(format!("the visitor stands at {:.2} {:.2}, still {off_m:.2} m away", eye.x, eye.z)));
            }
            let level = Vec3::new(place.x, eye.y, place.z);
            let turn_rad = self.off(level);
            let ahead = if turn_rad.x.abs() < AHEAD_RAD { 1.0 } else { 0.0 };
            self.frame(&Steer { turn_rad, ahead, ..Steer::default() }, take)?;
            left_s -= self.frame_s;
        }
    }

    fn look<E: From<PlayError>>(
        &mut self,
        goal: &Goal,
        take: &mut impl FnMut(Option<&str>, SrgbImage) -> Result<(), E>,
    ) -> Result<Result<(), String>, E> {
        let mut left_s = LOOK_S;
        loop {
            let place = match self.place(goal) {
                Ok(place) => place,
                Err(why) => return Ok(Err(why)),
            };
            let near = if self.scheme == Scheme::Hand { FACES_RAD } else { ON_RAD };
            self.aim = Some(place);
            let turn_rad = Some(self.off(place)).filter(|off| off.length() >= near).unwrap_or_default();
            self.frame(&Steer { turn_rad, aim: Some(place), ..Steer::default() }, take)?;
            if self.off(place).length() < near && self.devices.is_on(ON_RAD) {
                self.frame(&self.rest(), take)?;
                return Ok(Ok(()));
            }
            if left_s <= 0.0 {
                return Ok(Err(format!("the view is still {:.1} degrees off", self.off(place).length().to_degrees())));
            }
            left_s -= self.frame_s;
        }
    }

    /// A blow: by its action, or by a tracked hand that goes there and back.
    fn strike<E: From<PlayError>>(
        &mut self,
        goal: &Goal,
        take: &mut impl FnMut(Option<&str>, SrgbImage) -> Result<(), E>,
    ) -> Result<Result<(), String>, E> {
        if let Err(why) = self.look(goal, take)? {
            return Ok(Err(why));
        }
        if self.scheme != Scheme::Hand {
            let pressed = self.press(Asked::Use.name(), 0.0, take)?;
            self.wait(BLOW_S, take)?;
            return Ok(pressed);
        }
        let far_m = self.aim.map_or(0.0, |aim| aim.distance(self.visitor().pose.eye)).max(0.1);
        let step = BLOW_M_S * self.frame_s / far_m;
        let there = (1..).map(|k| k as f32 * step).take_while(|reach| *reach < 1.0);
        let back = (1..=10).rev().map(|k| k as f32 * 0.1);
        for reach in there.chain([1.0]).chain(back) {
            self.frame(&Steer { reach, ..self.rest() }, take)?;
        }
        self.wait(PAUSE_S, take)?;
        Ok(Ok(()))
    }

    fn press<E: From<PlayError>>(
        &mut self,
        action: &str,
        hold_s: f32,
        take: &mut impl FnMut(Option<&str>, SrgbImage) -> Result<(), E>,
    ) -> Result<Result<(), String>, E> {
        let Some(known) = named(action) else {
            return Ok(Err(format!("there is no action `{action}`; `heliodon display --actions` lists them")));
        };
        let bindings = &self.stepped.app.world().resource::<Input>().bindings;
        let mut of_scheme = bindings.triggers(known).iter().filter(|trigger| self.devices.has(trigger));
        // a key before the mouse, which may have something else to do; and the wand's first button uses what it holds, whatever else that is bound to
        let by_hand = (self.scheme == Scheme::Hand && known == Asked::Use).then_some(Trigger::Wand(1));
        let Some(trigger) = of_scheme.next().cloned().or(by_hand) else {
            return Ok(Err(format!("nothing on this device sets `{action}` off")));
        };
        self.hold(&trigger, true);
        let mut left_s = hold_s.max(2.0 * self.frame_s);
        while left_s > 0.0 {
            self.frame(&self.rest(), take)?;
            left_s -= self.frame_s;
        }
        self.hold(&trigger, false);
        self.frame(&self.rest(), take)?;
        Ok(Ok(()))
    }

    fn hold(&mut self, trigger: &Trigger, down: bool) {
        self.devices.button(&mut self.stepped.app, trigger, down);
    }

    fn wait<E: From<PlayError>>(
        &mut self,
        seconds: f32,
        take: &mut impl FnMut(Option<&str>, SrgbImage) -> Result<(), E>,
    ) -> Result<(), E> {
        let mut left_s = seconds;
        while left_s > 0.0 {
            self.frame(&self.rest(), take)?;
            left_s -= self.frame_s;
        }
        Ok(())
    }

    /// Nothing moves; a tracked hand goes on pointing at what it pointed at.
    fn rest(&self) -> Steer {
        Steer { aim: self.aim, ..Steer::default() }
    }

    /// Whether something is so; if not, what is.
    fn check(&mut self, expected: &Expected) -> Result<(), String> {
        let world = self.stepped.app.world_mut();
        let (wanted, is): (&str, Option<String>) = match expected {
            Expected::Task(key) => (key, self.task.clone()),
            Expected::Held(thing) => (thing, world.resource::<Hands>().held(Hand::Right).map(str::to_owned)),
            Expected::Material { target, material } => (material, self.materials.get(target).cloned()),
            Expected::Memory { key, value } => {
                let remembered = world.resource_mut::<Story>().remembered(key);
                let text = |value: &Value| serde_json::to_string(value).unwrap_or_default();
                (value, remembered.as_ref().map(text).map(|text| text.trim_matches('"').to_owned()))
            }
        };
        let is = is.unwrap_or_else(|| "none".to_owned());
        if is == wanted { Ok(()) } else { Err(format!("it is {is}")) }
    }
}

/// The action of a name, or the only one whose name ends so: `take` for `hand.take`.
fn named(name: &str) -> Option<Asked> {
    let mut ends = Asked::ALL.into_iter().filter(|action| action.name().split_once('.').is_some_and(|(_, end)| end == name));
    Asked::named(name).or_else(|| ends.next().filter(|_| ends.next().is_none()))
}

/// The middle of the box around all of a part.
fn middle_of_part(bundle: &BundleReader, name: &str) -> Option<Vec3> {
    let part = bundle.manifest().parts.iter().position(|part| part.name == name)?;
    let of_part = (0..bundle.chunk_count()).map(|chunk| bundle.chunk_info(chunk)).filter(|info| usize::from(info.part) == part);
    let bounds = of_part.map(|info| (Vec3::from(info.bounds.min), Vec3::from(info.bounds.max)));
    let (low, high) = bounds.reduce(|(low, high), (min, max)| (low.min(min), high.max(max)))?;
    Some(0.5 * (low + high))
}
