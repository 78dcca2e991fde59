//! What a player's hands do to the devices: keys and mouse, a game controller, a tracked wand that reports over the network as a tracker does.
//!
//! Nothing here knows what a device sets off: messages go in where those of the system's drivers do.

use crate::display::{Room, place::WorldFromRoom};
use crate::input::Trigger;
use crate::navigation::{LOOK_RAD_PER_PX, MouseLook, Visitor};
use bevy::input::ButtonState;
use bevy::input::gamepad::{
    GamepadAxis, GamepadConnection, GamepadConnectionEvent, RawGamepadAxisChangedEvent, RawGamepadButtonChangedEvent,
    RawGamepadEvent,
};
use bevy::input::keyboard::{Key, KeyboardInput, NativeKey};
use bevy::input::mouse::{MouseButtonInput, MouseMotion};
use bevy::prelude::*;
use heliodon_bundle::ConfigError;
use heliodon_bundle::display::{Display, DisplayFile, Preset};
use heliodon_track::osc;
use heliodon_track::pose::Pose as TrackedPose;
use std::io;
use std::net::{SocketAddr, UdpSocket};

/// With what a visit is played.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Scheme {
    /// Keys and mouse.
    #[default]
    Keyboard,
    /// A game controller.
    Pad,
    /// A tracked wand before screens.
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

/// What a player wants of a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Steer {
    /// How far the view is to turn: to the right and up, radians.
    pub turn_rad: Vec2,
    /// How much of a step ahead, 0 to 1.
    pub ahead: f32,
    /// What a tracked hand points at.
    pub aim: Option<Vec3>,
    /// How far the hand has gone there, 0 to 1.
    pub reach: f32,
}

/// The devices of a scheme.
pub(super) struct Devices {
    scheme: Scheme,
    pad: Option<Entity>,
    wand: Option<(UdpSocket, SocketAddr)>,
    walks: bool,
}

/// The display of a wand before two walls, whose tracker is this program itself.
pub(super) fn wand_display() -> Result<Display, ConfigError> {
    let mut file: DisplayFile = Preset::Flatworld.file();
    file.trackers.clear();
    file.display.navigation = heliodon_bundle::display::Navigation::Walk;
    let tracker = "\n[[tracker]]\nname = \"player\"\nprotocol = \"osc\"\nlisten = \"127.0.0.1:0\"\nprediction_ms = 0.0\nsmoothing_hz = 0.0\n\
        [[tracker.body]]\nis = \"wand\"\naddress = \"/wand\"\n";
    let text = file.to_toml_string() + tracker;
    Display::parse(&text, "the player's display")
}

impl Devices {
    /// Connects what the scheme has; `tracker` is where the wand's reports go.
    pub(super) fn connect(app: &mut App, scheme: Scheme, tracker: Option<SocketAddr>) -> io::Result<Self> {
        let mut devices = Self { scheme, pad: None, wand: None, walks: false };
        match scheme {
            Scheme::Keyboard => {
                // a click takes the mouse
                devices.mouse(app, MouseButton::Left, true);
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
                let tracker = tracker.ok_or_else(|| io::Error::other("nothing listens to the wand"))?;
                devices.wand = Some((UdpSocket::bind("127.0.0.1:0")?, tracker));
            }
        }
        Ok(devices)
    }

    /// Whether a trigger is one of this scheme's buttons.
    pub(super) fn has(&self, trigger: &Trigger) -> bool {
        match self.scheme {
            Scheme::Keyboard => matches!(trigger, Trigger::Key(_) | Trigger::Mouse(_)),
            Scheme::Pad => matches!(trigger, Trigger::Pad(_)),
            Scheme::Hand => matches!(trigger, Trigger::Wand(_)),
        }
    }

    /// Presses or lets go of a button.
    pub(super) fn button(&self, app: &mut App, trigger: &Trigger, down: bool) {
        match trigger {
            Trigger::Key(key) => self.key(app, *key, down),
            Trigger::Mouse(button) => self.mouse(app, *button, down),
            Trigger::Pad(button) => {
                if let Some(gamepad) = self.pad {
                    let value = f32::from(u8::from(down));
                    let event = RawGamepadEvent::Button(RawGamepadButtonChangedEvent { gamepad, button: *button, value });
                    app.world_mut().write_message(event);
                }
            }
            Trigger::Wand(number) => self.report(&osc::button_packet("/wand", u32::from(*number) - 1, down)),
            _ => {}
        }
    }

    fn key(&self, app: &mut App, key_code: KeyCode, down: bool) {
        app.world_mut().write_message(KeyboardInput {
            key_code,
            logical_key: Key::Unidentified(NativeKey::Unidentified),
            state: if down { ButtonState::Pressed } else { ButtonState::Released },
            text: None,
            repeat: false,
            window: Entity::PLACEHOLDER,
        });
    }

    fn mouse(&self, app: &mut App, button: MouseButton, down: bool) {
        let state = if down { ButtonState::Pressed } else { ButtonState::Released };
        app.world_mut().write_message(MouseButtonInput { button, state, window: Entity::PLACEHOLDER });
    }

    fn axis(&self, app: &mut App, axis: GamepadAxis, value: f32) {
        if let Some(gamepad) = self.pad {
            app.world_mut().write_message(RawGamepadEvent::Axis(RawGamepadAxisChangedEvent { gamepad, axis, value }));
        }
    }

    /// What is lost on the way is sent again with the next frame.
    fn report(&self, packet: &[u8]) {
        if let Some((socket, to)) = &self.wand {
            socket.send_to(packet, to).ok();
        }
    }

    /// Moves mouse, sticks and wand.
    pub(super) fn steer(&mut self, app: &mut App, steer: &Steer, dead_zone: f32) {
        let push = |off_rad: f32| {
            let part = (off_rad / FULL_RAD).clamp(-1.0, 1.0);
            if part.abs() < 0.01 { 0.0 } else { part.signum() * (dead_zone + (1.0 - dead_zone) * part.abs().max(LEAST_PUSH)) }
        };
        match self.scheme {
            Scheme::Keyboard => {
                if app.world().resource::<MouseLook>().captured {
                    let delta = Vec2::new(steer.turn_rad.x, -steer.turn_rad.y) / LOOK_RAD_PER_PX;
                    let delta = delta.clamp(Vec2::splat(-MOST_PX), Vec2::splat(MOST_PX)).round();
                    if delta != Vec2::ZERO {
                        app.world_mut().write_message(MouseMotion { delta });
                    }
                    // the click that took it is over
                    self.mouse(app, MouseButton::Left, false);
                }
                let walks = steer.ahead > 0.5;
                if walks != self.walks {
                    self.walks = walks;
                    self.key(app, KeyCode::KeyW, walks);
                }
            }
            Scheme::Pad => {
                self.axis(app, GamepadAxis::RightStickX, push(steer.turn_rad.x));
                self.axis(app, GamepadAxis::RightStickY, push(steer.turn_rad.y));
                self.axis(app, GamepadAxis::LeftStickY, steer.ahead);
            }
            Scheme::Hand => {
                self.report(&osc::axis_packet("/wand", 0, push(steer.turn_rad.x)));
                self.report(&osc::axis_packet("/wand", 1, steer.ahead));
                let world = app.world_mut();
                let visitor = world.query::<&Visitor>().iter(world).next().cloned();
                if let (Some(visitor), Some(room)) = (visitor, world.get_resource::<Room>()) {
                    let place = WorldFromRoom::new(room.display(), &visitor);
                    let towards = steer.aim.map_or(Vec3::NEG_Z, |aim| place.to_room(aim) - WAND_M);
                    let along = heliodon_math::frame::unit_or(towards, Vec3::NEG_Z);
                    let level = Quat::from_rotation_y(-libm::atan2f(along.x, -along.z));
                    let orientation = level * Quat::from_rotation_x(libm::asinf(along.y.clamp(-1.0, 1.0)));
                    let position = WAND_M + towards * steer.reach.clamp(0.0, 1.0);
                    self.report(&osc::pose_packet("/wand", &TrackedPose { position, orientation }));
                }
            }
        }
    }
}
