//! A visit that is played by a script of inputs, without a display, on any kind of device: to see that a story can be told to its end, and to film it.
//!
//! The same plugins as in the window are stepped by hand, a thirtieth of a second at a time. A [`script`] says what somebody does; how far the mouse goes for that is worked out from
//! where the visitor is, as a hand does it, and comes in as the device's own messages ([`devices`]). Without pictures nothing is drawn, so that minutes take seconds.

pub mod devices;
pub mod script;

use crate::VisitPlugins;
use crate::actors::Actors;
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
use crate::stage::Stage;
use crate::story::{Story, StoryPlaces};
use crate::tracking::Trackers;
use bevy::camera::RenderTarget;
use bevy::prelude::*;
use bevy::render::render_resource::{TextureFormat, TextureUsages};
use bevy::time::TimeUpdateStrategy;
use devices::{Devices, Scheme, Steer};
use heliodon_bundle::ConfigError;
use heliodon_bundle::display::{Display, Navigation};
use heliodon_image::SrgbImage;
use heliodon_script::action::Action;
use heliodon_script::value::Value;
use script::{Doing, Expected, Goal, Line};
use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;
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
    /// The pictures' size; none draws nothing.
    pub size: Option<(u32, u32)>,
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

/// How a visit went.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Played {
    /// Seconds of the visit.
    pub seconds: f64,
    /// The keys of the tasks that stood, with the second in which each was set.
    pub tasks: Vec<(String, f64)>,
    /// Lines of the script that were done.
    pub lines: usize,
}

/// Somebody who plays.
pub struct Player {
    stepped: Stepped,
    target: Option<(Handle<Image>, UVec2)>,
    camera: Entity,
    devices: Devices,
    scheme: Scheme,
    frame_s: f32,
    dead_zone: f32,
    /// What a tracked hand points at.
    aim: Option<Vec3>,
    task: Option<String>,
    materials: HashMap<String, String>,
    told: Played,
}

impl Player {
    /// Opens the bundle in `folder`, and loads all of it.
    ///
    /// # Errors
    /// If it cannot be shown, or the devices cannot be had.
    pub fn new(folder: impl AsRef<Path>, options: &PlayOptions) -> Result<Self, PlayError> {
        let mut stepped = Stepped::new(folder.as_ref(), 1, |app| {
            app.add_plugins(VisitPlugins).insert_resource(options.story.clone());
        })?;
        let app = &mut stepped.app;
        let room = match options.scheme {
            Scheme::Hand => {
                let display: Arc<Display> = devices::wand_display()?.into();
                let trackers = Trackers::new(&display)?;
                app.insert_resource(trackers);
                Some(Room::new(display)?)
            }
            Scheme::Keyboard | Scheme::Pad => None,
        };
        let target = options.size.map(|(width, height)| {
            let mut image = Image::new_target_texture(width, height, TextureFormat::Rgba8UnormSrgb, None);
            image.texture_descriptor.usage |= TextureUsages::COPY_SRC;
            (app.world_mut().resource_mut::<Assets<Image>>().add(image), UVec2::new(width, height))
        });
        if let Some((_, size)) = &target {
            stepped.check_size(size.to_array(), 1)?;
        }
        let app = &mut stepped.app;
        let visitor = room.as_ref().map_or_else(|| Visitor { gait: Navigation::Walk, ..Visitor::default() }, Room::visitor);
        let camera = app.world_mut().spawn((visitor, DaylightCamera, IsDefaultUiCamera)).id();
        if let Some((target, _)) = &target {
            app.world_mut().entity_mut(camera).insert(RenderTarget::from(target.clone()));
        }
        let address = app.world().get_resource::<Trackers>().and_then(|trackers| trackers.addresses().next());
        if let Some(room) = room {
            app.insert_resource(room);
        }
        stepped.load(folder.as_ref(), &[camera])?;
        let mut player = {
            let app = &mut stepped.app;
            let dead_zone = app.world().resource::<Input>().settings.dead_zone as f32;
            app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_secs_f64(1.0 / options.fps)));
            let devices = Devices::connect(app, options.scheme, address)?;
            let frame_s = (1.0 / options.fps) as f32;
            Self {
                target,
                camera,
                devices,
                scheme: options.scheme,
                frame_s,
                dead_zone,
                aim: None,
                task: None,
                materials: HashMap::new(),
                told: Played::default(),
                stepped,
            }
        };
        let draws = player.target.is_some();
        player.stepped.set_active(&[player.camera], draws);
        // the first second belongs to whoever looks around
        for _ in 0..(1.0 / player.frame_s) as usize {
            player.step(&Steer::default())?;
        }
        Ok(player)
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
                if let Some(picture) = self.picture()? {
                    take(Some(name), picture)?;
                }
                Ok(Ok(()))
            }
        }
    }

    /// A frame, and its picture.
    fn frame<E: From<PlayError>>(
        &mut self,
        steer: &Steer,
        take: &mut impl FnMut(Option<&str>, SrgbImage) -> Result<(), E>,
    ) -> Result<(), E> {
        self.step(steer)?;
        match self.picture()? {
            Some(picture) => take(None, picture),
            None => Ok(()),
        }
    }

    /// What the target shows.
    fn picture(&mut self) -> Result<Option<SrgbImage>, PlayError> {
        let Some((target, size)) = &self.target else { return Ok(None) };
        let bytes = self.stepped.wait(begin_readback(&self.stepped.app, target)?)?;
        Ok(Some(downsample::srgb(&bytes, *size, 1)))
    }

    fn step(&mut self, steer: &Steer) -> Result<(), PlayError> {
        self.devices.steer(&mut self.stepped.app, steer, self.dead_zone);
        if self.scheme == Scheme::Hand {
            // a datagram to this machine is there at once, but not sooner
            std::thread::sleep(Duration::from_micros(500));
        }
        self.stepped.step()?;
        self.told.seconds += f64::from(self.frame_s);
        for action in self.stepped.app.world_mut().resource_mut::<Story>().take_asked() {
            match action {
                Action::Task { text, .. } => {
                    self.told.tasks.push((text.clone(), self.told.seconds));
                    self.task = Some(text);
                }
                Action::NoTask => self.task = None,
                Action::Material { target, material, .. } => drop(self.materials.insert(target, material)),
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
        let places = regions.map(|region| 0.5 * (vec(region.min) + vec(region.max))).chain(views.map(|view| vec(view.place)));
        places.into_iter().next().ok_or_else(|| format!("there is no actor, region or view `{name}`"))
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
            let turn_rad = self.off(place);
            let near = if self.scheme == Scheme::Hand { FACES_RAD } else { ON_RAD };
            let there = turn_rad.length() < near;
            self.aim = Some(place);
            let turn_rad = if there { Vec2::ZERO } else { turn_rad };
            self.frame(&Steer { turn_rad, aim: Some(place), ..Steer::default() }, take)?;
            if there {
                // a tracked hand is there with the next report
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
        let Some(known) = Asked::named(action) else {
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
