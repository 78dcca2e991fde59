//! What a player's hands do to the devices: keys and mouse, a game controller, a tracked head and wand that report over the network as a tracker does.
//!
//! Nothing here knows what a device sets off: messages go in where those of the system's drivers do. Which key or stick that is the bindings say, so that a visit can be played with a
//! visitor's own.

use crate::display::{Room, place::WorldFromRoom};
use crate::input::{Action, Bindings, Input, Trigger};
use crate::navigation::{LOOK_RAD_PER_PX, MouseLook, Visitor};
use crate::tracking::Trackers;
use bevy::input::ButtonState;
use bevy::input::gamepad::{
    GamepadConnection, GamepadConnectionEvent, RawGamepadAxisChangedEvent, RawGamepadButtonChangedEvent, RawGamepadEvent,
};
use bevy::input::keyboard::{Key, KeyboardInput, NativeKey};
use bevy::input::mouse::{MouseButtonInput, MouseMotion};
use bevy::prelude::*;
use heliodon_bundle::ConfigError;
use heliodon_bundle::display::{Display, DisplayFile, InputSettings, Navigation, Preset};
use heliodon_math::frame::unit_or;
use heliodon_track::osc;
use heliodon_track::pose::Pose as TrackedPose;
use std::cell::Cell;
use std::io;
use std::net::{SocketAddr, UdpSocket};
use std::time::{Duration, Instant};

/// With what a visit is played.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Scheme {
    /// Keys and mouse.
    #[default]
    Keyboard,
    /// A game controller.
    Pad,
    /// A tracked head and wand before screens.
    Hand,
}

/// How far a mouse is moved in a frame at most, pixels.
const MOST_PX: f32 = 160.0;
/// A stick is pushed fully for what is farther off than this, radians.
const FULL_RAD: f32 = 0.35;
/// Where the wand is held in the room: before the right shoulder, metres.
const WAND_M: Vec3 = Vec3::new(0.25, 1.25, -0.35);
/// Sticks between their dead zone and this are pushed a little.
const LEAST_PUSH: f32 = 0.2;
/// How fast head and wand are turned, radians a second: below the half of a flick's speed at which one begins, so that who points flicks nothing.
const TURN_RAD_S: f32 = 1.8;
/// How long datagrams to this very machine are waited for, and how often it is looked whether they are there.
const ARRIVE: Duration = Duration::from_secs(1);
const LOOK_AGAIN: Duration = Duration::from_micros(50);

/// What a player wants of a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Steer {
    /// How far the view is to turn: to the right and up, radians.
    pub turn_rad: Vec2,
    /// How much of a step ahead, 0 to 1.
    pub ahead: f32,
    /// What a tracked head looks at and a tracked hand points at; none for straight ahead.
    pub aim: Option<Vec3>,
    /// How far the hand has gone there, 0 to 1.
    pub reach: f32,
}

/// What moves a visitor, as it is bound on the scheme's device.
#[derive(Clone, Debug, Default)]
struct Ways {
    ahead: Option<Trigger>,
    /// Right and left, up and down.
    turns: [[Option<Trigger>; 2]; 2],
    takes_mouse: Option<Trigger>,
}

/// A tracked head and wand, turned as they are in the room.
struct Tracked {
    socket: UdpSocket,
    to: SocketAddr,
    sent: Cell<u64>,
    head: Quat,
    wand: Quat,
}

/// The devices of a scheme.
pub(super) struct Devices {
    scheme: Scheme,
    ways: Ways,
    pad: Option<Entity>,
    tracked: Option<Tracked>,
    walks: bool,
    /// How far head and wand are still from what they are meant for, radians.
    off_rad: f32,
}

/// The display of a wand before two walls, whose tracker is this program itself.
pub(super) fn wand_display(input: &InputSettings) -> Result<Display, ConfigError> {
    let mut file: DisplayFile = Preset::Flatworld.file();
    file.trackers.clear();
    file.display.navigation = Navigation::Walk;
    file.input = input.clone();
    let tracker = "\n[[tracker]]\nname = \"player\"\nprotocol = \"osc\"\nlisten = \"127.0.0.1:0\"\nprediction_ms = 0.0\nsmoothing_hz = 0.0\n\
        [[tracker.body]]\nis = \"head\"\naddress = \"/head\"\n[[tracker.body]]\nis = \"wand\"\naddress = \"/wand\"\n";
    let text = file.to_toml_string() + tracker;
    Display::parse(&text, "the player's display")
}

impl Scheme {
    /// Whether a trigger is one of this scheme's buttons.
    fn presses(self, trigger: &Trigger) -> bool {
        match self {
            Self::Keyboard => matches!(trigger, Trigger::Key(_) | Trigger::Mouse(_)),
            Self::Pad => matches!(trigger, Trigger::Pad(_)),
            Self::Hand => matches!(trigger, Trigger::Wand(_)),
        }
    }

    /// Whether a trigger is something of this scheme that can be held.
    fn holds(self, trigger: &Trigger) -> bool {
        let stick = match self {
            Self::Keyboard => false,
            Self::Pad => matches!(trigger, Trigger::Stick(..)),
            Self::Hand => matches!(trigger, Trigger::WandStick(..)),
        };
        stick || self.presses(trigger)
    }
}

impl Ways {
    fn of(scheme: Scheme, bindings: &Bindings) -> Self {
        let held = |action| bindings.triggers(action).iter().find(|trigger| scheme.holds(trigger)).cloned();
        Self {
            ahead: held(Action::Forward),
            turns: [[Action::TurnRight, Action::TurnLeft], [Action::LookUp, Action::LookDown]].map(|pair| pair.map(held)),
            takes_mouse: bindings.triggers(Action::TakeMouse).iter().find(|trigger| scheme.presses(trigger)).cloned(),
        }
    }
}

impl Devices {
    /// Connects what the scheme has; `tracker` is where the reports of head and wand go.
    pub(super) fn connect(app: &mut App, scheme: Scheme, tracker: Option<SocketAddr>) -> io::Result<Self> {
        let ways = Ways::of(scheme, &app.world().resource::<Input>().bindings);
        let mut devices = Self { scheme, ways, pad: None, tracked: None, walks: false, off_rad: 0.0 };
        match scheme {
            Scheme::Keyboard => {
                let takes = devices.ways.takes_mouse.clone();
                let takes =
                    takes.ok_or_else(|| io::Error::other("neither a key nor a button takes the mouse: bind look.mouse"))?;
                devices.button(app, &takes, true);
            }
            Scheme::Pad => {
                let pad = app.world_mut().spawn_empty().id();
                let connection = GamepadConnection::Connected { name: "player".to_owned(), vendor_id: None, product_id: None };
                // a driver tells both
                let event = GamepadConnectionEvent { gamepad: pad, connection };
                app.world_mut().write_message(event.clone());
                app.world_mut().write_message(RawGamepadEvent::Connection(event));
                devices.pad = Some(pad);
            }
            Scheme::Hand => {
                let to = tracker.ok_or_else(|| io::Error::other("nothing listens to the wand"))?;
                let (socket, sent) = (UdpSocket::bind("127.0.0.1:0")?, Cell::new(0));
                devices.tracked = Some(Tracked { socket, to, sent, head: Quat::IDENTITY, wand: Quat::IDENTITY });
            }
        }
        Ok(devices)
    }

    /// Whether a trigger is one of this scheme's buttons.
    pub(super) fn has(&self, trigger: &Trigger) -> bool {
        self.scheme.presses(trigger)
    }

    /// Why nobody can walk with this device.
    pub(super) fn cannot_walk(&self) -> Option<String> {
        let turns = self.scheme == Scheme::Keyboard || self.ways.turns[0].iter().all(Option::is_some);
        let bound = [("move.forward", self.ways.ahead.is_some()), ("look.left and look.right", turns)];
        bound.into_iter().find(|(_, bound)| !bound).map(|(action, _)| format!("nothing on this device sets {action} off"))
    }

    /// Whether head and wand are where they are meant to be, to within an angle.
    pub(super) fn is_on(&self, within_rad: f32) -> bool {
        self.off_rad <= within_rad
    }

    /// Presses or lets go of a button.
    pub(super) fn button(&self, app: &mut App, trigger: &Trigger, down: bool) {
        self.push(app, trigger, f32::from(u8::from(down)));
    }

    /// Pushes what a trigger stands for, 0 to 1.
    fn push(&self, app: &mut App, trigger: &Trigger, value: f32) {
        let state = if value > 0.5 { ButtonState::Pressed } else { ButtonState::Released };
        let signed = |positive: bool| if positive { value } else { -value };
        let window = Entity::PLACEHOLDER;
        match trigger {
            Trigger::Key(key_code) => {
                let logical_key = Key::Unidentified(NativeKey::Unidentified);
                let key = KeyboardInput { key_code: *key_code, logical_key, state, text: None, repeat: false, window };
                app.world_mut().write_message(key);
            }
            Trigger::Mouse(button) => {
                app.world_mut().write_message(MouseButtonInput { button: *button, state, window });
            }
            Trigger::Pad(button) => {
                let Some(gamepad) = self.pad else { return };
                let event = RawGamepadButtonChangedEvent { gamepad, button: *button, value };
                app.world_mut().write_message(RawGamepadEvent::Button(event));
            }
            Trigger::Stick(axis, positive) => {
                let Some(gamepad) = self.pad else { return };
                let event = RawGamepadAxisChangedEvent { gamepad, axis: *axis, value: signed(*positive) };
                app.world_mut().write_message(RawGamepadEvent::Axis(event));
            }
            Trigger::Wand(number) => self.report(&osc::button_packet("/wand", u32::from(*number) - 1, value > 0.5)),
            Trigger::WandStick(axis, positive) => {
                self.report(&osc::axis_packet("/wand", usize::from(*axis), signed(*positive)));
            }
            // what happens and is not held is none of a script's
            Trigger::Sign(_) | Trigger::Wheel(_) | Trigger::Flick(_) | Trigger::WandFlick(_) => {}
        }
    }

    /// Pushes one of two that are each other's opposites, perhaps the sides of one stick.
    fn push_pair(&self, app: &mut App, pair: &[Option<Trigger>; 2], value: f32) {
        let [plus, minus] = pair;
        let (on, off) = if value < 0.0 { (minus, plus) } else { (plus, minus) };
        for (trigger, value) in [(off, 0.0), (on, value.abs())] {
            if let Some(trigger) = trigger {
                self.push(app, trigger, value);
            }
        }
    }

    /// Sends a datagram to the tracker.
    fn report(&self, packet: &[u8]) {
        if let Some(Tracked { socket, to, sent, .. }) = &self.tracked
            && socket.send_to(packet, to).is_ok()
        {
            sent.set(sent.get() + 1);
        }
    }

    /// Moves mouse, sticks, head and wand.
    pub(super) fn steer(&mut self, app: &mut App, steer: &Steer, dead_zone: f32, seconds: f32) {
        if self.scheme == Scheme::Keyboard {
            self.mouse(app, steer.turn_rad);
        } else {
            let part = (steer.turn_rad / FULL_RAD).clamp(Vec2::NEG_ONE, Vec2::ONE);
            let push = |part: f32| match part.abs() < 0.01 {
                true => 0.0,
                false => part.signum() * (dead_zone + (1.0 - dead_zone) * part.abs().max(LEAST_PUSH)),
            };
            let ways = self.ways.turns.clone();
            self.push_pair(app, &ways[0], push(part.x));
            self.push_pair(app, &ways[1], push(part.y));
        }
        // a key tells only that it goes down or comes up
        let walks = steer.ahead > 0.5;
        if let Some(ahead) = self.ways.ahead.clone().filter(|_| walks != self.walks) {
            self.push(app, &ahead, steer.ahead);
        }
        self.walks = walks;
        self.turn_body(app, steer, seconds);
    }

    /// Turns the view by the mouse, once it is taken.
    fn mouse(&self, app: &mut App, turn_rad: Vec2) {
        if !app.world().resource::<MouseLook>().captured {
            return;
        }
        let delta = Vec2::new(turn_rad.x, -turn_rad.y) / LOOK_RAD_PER_PX;
        let delta = delta.clamp(Vec2::splat(-MOST_PX), Vec2::splat(MOST_PX)).round();
        if delta != Vec2::ZERO {
            app.world_mut().write_message(MouseMotion { delta });
        }
    }

    /// Turns head and wand towards what they are meant for, no faster than somebody does, and tells where they are.
    fn turn_body(&mut self, app: &mut App, steer: &Steer, seconds: f32) {
        let Some(tracked) = &mut self.tracked else { return };
        let world = app.world_mut();
        let Some(visitor) = world.query::<&Visitor>().iter(world).next().cloned() else { return };
        let Some(room) = world.get_resource::<Room>() else { return };
        let place = WorldFromRoom::new(room.display(), &visitor);
        let head_m = room.rest().position;
        let towards = |from: Vec3| steer.aim.map_or(Vec3::NEG_Z, |aim| place.to_room(aim) - from);
        let turned = |now: Quat, to: Vec3| {
            let wanted = facing(to);
            let now = now.rotate_towards(wanted, TURN_RAD_S * seconds);
            (now, now.angle_between(wanted))
        };
        let (head, head_off) = turned(tracked.head, towards(head_m));
        let (wand, wand_off) = turned(tracked.wand, towards(WAND_M));
        (tracked.head, tracked.wand) = (head, wand);
        self.off_rad = head_off.max(wand_off);
        let hand_m = WAND_M + towards(WAND_M) * steer.reach.clamp(0.0, 1.0);
        self.report(&osc::pose_packet("/head", &TrackedPose { position: head_m, orientation: head }));
        self.report(&osc::pose_packet("/wand", &TrackedPose { position: hand_m, orientation: wand }));
    }

    /// Waits until everything that was sent has come: a visit must not depend on how fast this machine is.
    pub(super) fn arrive(&self, app: &App) -> io::Result<()> {
        let Some(tracked) = &self.tracked else { return Ok(()) };
        let until = Instant::now() + ARRIVE;
        while app.world().get_resource::<Trackers>().is_some_and(|trackers| trackers.received() < tracked.sent.get()) {
            if Instant::now() > until {
                return Err(io::Error::other("datagrams to this machine itself are lost"));
            }
            std::thread::sleep(LOOK_AGAIN);
        }
        Ok(())
    }

    /// Lets go of what took the mouse, once it is taken.
    pub(super) fn let_go(&self, app: &mut App) {
        if let Some(takes) = self.ways.takes_mouse.as_ref().filter(|_| self.scheme == Scheme::Keyboard) {
            self.button(app, takes, false);
        }
    }
}

/// Upright, along a direction.
fn facing(towards: Vec3) -> Quat {
    let along = unit_or(towards, Vec3::NEG_Z);
    let level = Quat::from_rotation_y(-libm::atan2f(along.x, -along.z));
    level * Quat::from_rotation_x(libm::asinf(along.y.clamp(-1.0, 1.0)))
}
