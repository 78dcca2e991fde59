//! Input: keyboard, mouse, game controllers, a mouse in the air and a tracked wand set off [`Action`]s, by bindings that a
//! `display.toml` can change.
//!
//! What moves and what shows asks [`Actions`] and knows of no key. Whoever has another device sets [`WandInput`], or adds to
//! [`Actions`] in [`InputSet`].

mod action;
mod bindings;
mod trigger;

pub use action::Action;
pub use bindings::{BindingFault, Bindings};
pub use trigger::{NOTATION, Trigger};

use action::ACTIONS;
use bevy::input::InputSystems;
use bevy::input::gamepad::Gamepad;
use bevy::input::keyboard::{Key, KeyboardInput};
use bevy::input::mouse::{AccumulatedMouseMotion, AccumulatedMouseScroll, MouseScrollUnit};
use bevy::prelude::*;
use heliodon_bundle::display::InputSettings;
use heliodon_track::gesture::{Flick, FlickDetector, FlickSettings};

/// Notches that one frame's turn of a wheel counts for at most.
const MOST_NOTCHES: f32 = 10.0;

/// How far a stick is pushed before it counts as pressed.
const PRESSED: f32 = 0.5;

/// What is asked for in this frame.
#[derive(Resource, Clone, Debug)]
pub struct Actions {
    values: [f32; ACTIONS],
    begun: [f32; ACTIONS],
    held: [bool; ACTIONS],
    /// Whether anything was touched, bound or not.
    touched: bool,
}

impl Default for Actions {
    fn default() -> Self {
        Self { values: [0.0; ACTIONS], begun: [0.0; ACTIONS], held: [false; ACTIONS], touched: false }
    }
}

impl Actions {
    /// How far an action is asked for, 0 to 1: a stick may be pushed half way.
    #[must_use]
    pub fn value(&self, action: Action) -> f32 {
        self.values[action as usize]
    }

    /// `plus` less `minus`, -1 to 1.
    #[must_use]
    pub fn axis(&self, plus: Action, minus: Action) -> f32 {
        self.value(plus) - self.value(minus)
    }

    /// Whether an action is asked for.
    #[must_use]
    pub fn is_held(&self, action: Action) -> bool {
        self.value(action) > 0.0
    }

    /// How often an action begins in this frame: once for a key that goes down, as often as a wheel has notches.
    #[must_use]
    pub fn count(&self, action: Action) -> f32 {
        self.begun[action as usize]
    }

    /// Whether an action begins in this frame.
    #[must_use]
    pub fn begins(&self, action: Action) -> bool {
        self.count(action) > 0.0
    }

    /// Whether a visitor touched anything.
    #[must_use]
    pub fn is_touched(&self) -> bool {
        self.touched
    }

    /// Somebody is there.
    pub fn touch(&mut self) {
        self.touched = true;
    }

    /// Sets an action off from elsewhere, once.
    pub fn set_off(&mut self, action: Action) {
        self.begun[action as usize] += 1.0;
        self.touched = true;
    }

    /// What begins as one action counts as another.
    pub(crate) fn divert(&mut self, from: Action, to: Action) {
        self.begun[to as usize] += std::mem::take(&mut self.begun[from as usize]);
    }

    /// A frame begins.
    fn clear(&mut self) {
        (self.values, self.begun, self.touched) = ([0.0; ACTIONS], [0.0; ACTIONS], false);
    }

    fn hold(&mut self, action: Action, value: f32) {
        let slot = &mut self.values[action as usize];
        *slot = slot.max(value);
    }
}

/// What the tracked wand's buttons and stick say: bit n is button n + 1. Trackers and headsets set it.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq)]
pub struct WandInput {
    /// Buttons that are down.
    pub buttons: u32,
    /// The stick, -1 to 1 each.
    pub stick: Vec2,
    /// A flick that ended in this frame.
    pub flick: Option<Flick>,
    /// Whether there is a wand.
    pub present: bool,
}

/// The bindings in force and the settings of sticks and gestures.
#[derive(Resource, Clone, Debug, Default)]
pub struct Input {
    /// Which trigger sets off which action.
    pub bindings: Bindings,
    /// Dead zone, pace, gestures.
    pub settings: InputSettings,
    /// Whether a game controller is there.
    pub has_pad: bool,
}

impl Input {
    /// As a display says; what is wrong with its bindings is left out and told.
    #[must_use]
    pub fn new(settings: &InputSettings) -> (Self, Vec<BindingFault>) {
        let (bindings, faults) = Bindings::new(settings);
        (Self { bindings, settings: settings.clone(), has_pad: false }, faults)
    }
}

/// When [`Actions`] are found out, in `PreUpdate`.
#[derive(SystemSet, Clone, Debug, PartialEq, Eq, Hash)]
pub struct InputSet;

/// Finds out what is asked for.
#[derive(Default)]
pub struct InputPlugin;

impl Plugin for InputPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<Actions>()
            .init_resource::<Input>()
            .init_resource::<WandInput>()
            .add_message::<KeyboardInput>()
            .add_systems(PreUpdate, find_out.in_set(InputSet).after(InputSystems));
    }
}

/// Notches of a wheel, or what they are on a touchpad.
pub(crate) fn notches(scroll: &AccumulatedMouseScroll) -> f32 {
    let notches = match scroll.unit {
        MouseScrollUnit::Line => scroll.delta.y,
        MouseScrollUnit::Pixel => scroll.delta.y / MouseScrollUnit::SCROLL_UNIT_CONVERSION_FACTOR,
    };
    notches.clamp(-MOST_NOTCHES, MOST_NOTCHES)
}

/// What is left of a stick's way outside its dead zone, 0 to 1 towards one side.
fn beyond(dead_zone: f32, way: f32) -> f32 {
    ((way - dead_zone) / (1.0 - dead_zone)).clamp(0.0, 1.0)
}

/// The devices on a desk.
type Desk<'w> = (
    Res<'w, ButtonInput<KeyCode>>,
    Res<'w, ButtonInput<MouseButton>>,
    Res<'w, AccumulatedMouseMotion>,
    Res<'w, AccumulatedMouseScroll>,
);

#[expect(clippy::too_many_arguments, reason = "a system's arguments are its resources")]
fn find_out(
    time: Res<Time<Real>>,
    (keys, buttons, motion, scroll): Desk,
    mut typed: MessageReader<KeyboardInput>,
    pads: Query<&Gamepad>,
    wand: Res<WandInput>,
    mut input: ResMut<Input>,
    mut air: Local<Option<FlickDetector>>,
    mut actions: ResMut<Actions>,
) {
    let signs: Vec<String> = typed
        .read()
        .filter(|key| key.state.is_pressed() && !key.repeat)
        .filter_map(|key| match &key.logical_key {
            // Not by `ButtonInput<Key>`: if Shift is let go before the key, that takes the sign for held ever after.
            Key::Character(sign) => Some(sign.to_string()),
            _ => None,
        })
        .collect();
    let flick = input.settings.air_mouse.then(|| {
        let least_speed = input.settings.flick_px_s as f32;
        let detector = air.get_or_insert_with(|| FlickDetector::new(FlickSettings { least_speed, ..FlickSettings::default() }));
        detector.motion(motion.delta.x, motion.delta.y, time.elapsed_secs_f64())
    });
    let flick = flick.flatten();
    let has_pad = !pads.is_empty();
    if input.has_pad != has_pad {
        input.has_pad = has_pad;
    }
    let dead_zone = (input.settings.dead_zone as f32).clamp(0.0, 0.9);
    let notches = notches(&scroll);

    actions.clear();
    let mut held = [false; ACTIONS];
    for (action, trigger) in input.bindings.iter() {
        // How far it is held, and how often it happened.
        let (value, times) = match trigger {
            Trigger::Key(key) => (f32::from(keys.pressed(*key)), f32::from(keys.just_pressed(*key))),
            Trigger::Mouse(button) => (f32::from(buttons.pressed(*button)), f32::from(buttons.just_pressed(*button))),
            Trigger::Sign(sign) => (0.0, signs.iter().filter(|typed| *typed == sign).count() as f32),
            Trigger::Wheel(up) => (0.0, if *up { notches.max(0.0) } else { (-notches).max(0.0) }),
            Trigger::Flick(wanted) => (0.0, f32::from(flick == Some(*wanted))),
            Trigger::WandFlick(wanted) => (0.0, f32::from(wand.flick == Some(*wanted))),
            Trigger::Pad(button) => (f32::from(pads.iter().any(|pad| pad.pressed(*button))), 0.0),
            Trigger::Stick(axis, positive) => {
                let way = pads.iter().filter_map(|pad| pad.get(*axis)).map(|way| if *positive { way } else { -way });
                (beyond(dead_zone, way.fold(0.0, f32::max)), 0.0)
            }
            Trigger::Wand(number) => (f32::from(wand.buttons >> (number - 1) & 1 == 1), 0.0),
            Trigger::WandStick(axis, positive) => {
                let way = wand.stick[usize::from(*axis)];
                (beyond(dead_zone, if *positive { way } else { -way }), 0.0)
            }
        };
        actions.hold(action, value);
        actions.begun[action as usize] += times;
        held[action as usize] |= value > PRESSED;
    }
    let Actions { begun, held: before, .. } = &mut *actions;
    for ((begun, before), now) in begun.iter_mut().zip(before.iter()).zip(&held) {
        // Keys and buttons tell themselves that they went down; of what only tells how it is, it is seen here.
        if *now && !before && *begun == 0.0 {
            *begun = 1.0;
        }
    }
    actions.held = held;
    let any = actions.values.iter().chain(&actions.begun).any(|&value| value > 0.0);
    let mouse = motion.delta != Vec2::ZERO && !input.settings.air_mouse;
    actions.touched = any || mouse || keys.get_just_pressed().len() > 0 || buttons.get_pressed().len() > 0;
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use bevy::input::ButtonState;

    /// An app in which keys and mice can be moved by hand.
    pub fn app() -> App {
        let mut app = App::new();
        app.add_plugins((MinimalPlugins, InputPlugin))
            .init_resource::<ButtonInput<KeyCode>>()
            .init_resource::<ButtonInput<MouseButton>>()
            .init_resource::<AccumulatedMouseMotion>()
            .init_resource::<AccumulatedMouseScroll>();
        app
    }

    fn actions(app: &App) -> &Actions {
        app.world().resource::<Actions>()
    }

    fn type_sign(app: &mut App, sign: &str, state: ButtonState, repeat: bool) {
        app.world_mut().write_message(KeyboardInput {
            key_code: KeyCode::Abort,
            logical_key: Key::Character(sign.into()),
            state,
            text: None,
            repeat,
            window: Entity::PLACEHOLDER,
        });
        app.update();
    }

    #[test]
    fn keys_are_held_and_begin_once() {
        let mut app = app();
        app.world_mut().resource_mut::<ButtonInput<KeyCode>>().press(KeyCode::KeyW);
        app.update();
        assert!(actions(&app).begins(Action::Forward) && actions(&app).value(Action::Forward) == 1.0);
        app.world_mut().resource_mut::<ButtonInput<KeyCode>>().clear();
        app.update();
        assert!(!actions(&app).begins(Action::Forward) && actions(&app).is_held(Action::Forward) && actions(&app).is_touched());
        app.world_mut().resource_mut::<ButtonInput<KeyCode>>().release_all();
        app.update();
        app.update();
        assert!(!actions(&app).is_held(Action::Forward));
    }

    #[test]
    fn signs_are_found_wherever_a_keyboard_has_them() {
        let mut app = app();
        type_sign(&mut app, "+", ButtonState::Pressed, false);
        assert_eq!(actions(&app).count(Action::Brighter), 1.0);
        type_sign(&mut app, "+", ButtonState::Pressed, true);
        assert_eq!(actions(&app).count(Action::Brighter), 0.0, "repeated by the keyboard");
        // Shift was let go first, so that the key that comes up is another sign.
        type_sign(&mut app, "=", ButtonState::Released, false);
        assert_eq!(actions(&app).count(Action::Brighter), 0.0);
        type_sign(&mut app, "]", ButtonState::Pressed, false);
        assert_eq!(actions(&app).count(Action::Faster), 1.0);
    }

    #[test]
    fn a_wheel_counts_its_notches_and_a_touchpad_no_more() {
        let mut app = app();
        for (unit, y, wanted) in
            [(MouseScrollUnit::Line, 2.0, 2.0), (MouseScrollUnit::Pixel, 200.0, 2.0), (MouseScrollUnit::Line, 1e6, 10.0)]
        {
            app.insert_resource(AccumulatedMouseScroll { unit, delta: Vec2::new(0.0, y) });
            app.update();
            assert_eq!((actions(&app).count(Action::PaceUp), actions(&app).count(Action::PaceDown)), (wanted, 0.0));
        }
    }

    #[test]
    fn a_sticks_dead_zone_is_dead_and_its_end_is_one() {
        assert_eq!(beyond(0.15, 0.1), 0.0);
        assert_eq!(beyond(0.15, -1.0), 0.0);
        assert_eq!(beyond(0.15, 1.0), 1.0);
        assert!((beyond(0.2, 0.6) - 0.5).abs() < 1e-6);
    }

    #[test]
    fn the_wands_buttons_begin_once_and_its_stick_moves() {
        let mut app = app();
        app.insert_resource(WandInput { buttons: 0b1, stick: Vec2::new(0.0, 1.0), flick: Some(Flick::Up), present: true });
        app.update();
        let seen = actions(&app);
        assert!(seen.begins(Action::Play) && seen.value(Action::Forward) == 1.0 && seen.count(Action::Brighter) == 1.0);
        app.world_mut().resource_mut::<WandInput>().flick = None;
        app.update();
        assert!(!actions(&app).begins(Action::Play) && actions(&app).is_held(Action::Play));
    }
}
