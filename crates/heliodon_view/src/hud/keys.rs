//! The keys of the day and of the window.

use super::HudVisibility;
use crate::culling::Culling;
use crate::navigation::MouseLook;
use crate::stage::frame::StageFrame;
use crate::time_lapse::exposure::Exposure;
use crate::time_lapse::{Blend, TimeLapse};
use bevy::input::keyboard::{Key, KeyboardInput};
use bevy::prelude::*;
use bevy::render::view::screenshot::{Screenshot, save_to_disk};
use bevy::window::{PrimaryWindow, WindowMode};

/// All keys, as the help lists them.
pub(super) const HELP: [(&str, &str); 24] = [
    ("Space", "let the day pass, or pause it"),
    ("Left  Right", "one step of the day back or on"),
    ("[  ]", "slower, faster"),
    ("L", "begin the day again at its end, or stop"),
    ("B", "smooth light, or the steps as they are"),
    ("+  -", "exposure, a quarter of a stop"),
    ("E", "exposure follows the day, or is held"),
    ("T", "tone curve: clamped or filmic"),
    ("G", "the grain of near surfaces, or none"),
    ("Click", "look around with the mouse"),
    ("W A S D", "move; Shift hurries"),
    ("Page Up  Down", "rise and sink in flight"),
    ("Wheel", "pace"),
    ("F", "fly or walk"),
    ("R", "inside the room's box, or free"),
    ("Home", "back to the beginning"),
    ("O", "cull what occluders hide, or not"),
    ("C", "cull what is small, or not"),
    (",  .", "how small, in pixels: less, more"),
    ("H  F1", "this help"),
    ("Tab", "hide or show text and timeline"),
    ("F11", "all of the screen, or a window"),
    ("F12", "save a picture beside you"),
    ("Esc", "give the mouse back; quit"),
];

/// The least and the greatest threshold of contribution culling, pixels.
const THRESHOLD_RANGE_PX: (f32, f32) = (0.25, 64.0);

/// The slowest and the fastest day.
const SPEED_RANGE: (f32, f32) = (1.0 / 64.0, 16.0);

pub(super) fn day_keys(
    keys: Res<ButtonInput<KeyCode>>,
    mut typed: MessageReader<KeyboardInput>,
    mut lapse: ResMut<TimeLapse>,
    mut exposure: ResMut<Exposure>,
    mut frame: ResMut<StageFrame>,
    mut culling: ResMut<Culling>,
) {
    for key in keys.get_just_pressed() {
        match key {
            KeyCode::Space => lapse.toggle_playing(),
            KeyCode::ArrowLeft => lapse.step(-1),
            KeyCode::ArrowRight => lapse.step(1),
            KeyCode::KeyL => lapse.looping = !lapse.looping,
            KeyCode::KeyB => {
                lapse.blend = match lapse.blend {
                    Blend::Smooth => Blend::Hard,
                    Blend::Hard => Blend::Smooth,
                }
            }
            KeyCode::KeyE => exposure.held = !exposure.held,
            KeyCode::KeyG => frame.without_details = !frame.without_details,
            KeyCode::KeyT => frame.curve = frame.curve.toggled(),
            KeyCode::KeyO => culling.shadow = !culling.shadow,
            KeyCode::KeyC => culling.contribution = !culling.contribution,
            _ => {}
        }
    }
    // Signs by what is written on the key, wherever a keyboard has them. Not by `ButtonInput<Key>`: if Shift is let go before
    // the key, that takes the sign for held ever after.
    for key in typed.read().filter(|key| key.state.is_pressed() && !key.repeat) {
        let Key::Character(sign) = &key.logical_key else { continue };
        match sign.as_str() {
            "[" => lapse.speed = (lapse.speed * 0.5).max(SPEED_RANGE.0),
            "]" => lapse.speed = (lapse.speed * 2.0).min(SPEED_RANGE.1),
            // The one shares its key with the plus on many keyboards.
            "+" | "=" => exposure.manual_stops += 0.25,
            "-" => exposure.manual_stops -= 0.25,
            "," => culling.threshold_px = (culling.threshold_px * 0.5).max(THRESHOLD_RANGE_PX.0),
            "." => culling.threshold_px = (culling.threshold_px * 2.0).min(THRESHOLD_RANGE_PX.1),
            _ => {}
        }
    }
}

pub(super) fn window_keys(
    keys: Res<ButtonInput<KeyCode>>,
    lapse: Res<TimeLapse>,
    mut visibility: ResMut<HudVisibility>,
    mut mouse: ResMut<MouseLook>,
    mut windows: Query<&mut Window, With<PrimaryWindow>>,
    mut commands: Commands,
    mut exit: MessageWriter<AppExit>,
) {
    if keys.any_just_pressed([KeyCode::KeyH, KeyCode::F1]) {
        visibility.help = !visibility.help;
    }
    if keys.just_pressed(KeyCode::Tab) {
        visibility.shown = !visibility.shown;
    }
    if keys.just_pressed(KeyCode::F11) {
        windows.iter_mut().for_each(|mut window| {
            window.mode = match window.mode {
                WindowMode::Windowed => WindowMode::BorderlessFullscreen(MonitorSelection::Current),
                _ => WindowMode::Windowed,
            };
        });
    }
    if keys.just_pressed(KeyCode::F12) {
        let path = picture_name(&super::clock_text(lapse.clock_s), |name| std::path::Path::new(name).exists());
        commands.spawn(Screenshot::primary_window()).observe(save_to_disk(path));
    }
    if keys.just_pressed(KeyCode::Escape) {
        if visibility.help {
            visibility.help = false;
        } else if mouse.captured {
            mouse.captured = false;
        } else {
            exit.write(AppExit::Success);
        }
    }
}

/// A file name that is not taken.
fn picture_name(clock: &str, taken: impl Fn(&str) -> bool) -> String {
    let clock = clock.replace(':', "");
    let names = (1..).map(|n| if n == 1 { format!("heliodon-{clock}.png") } else { format!("heliodon-{clock}-{n}.png") });
    names.take(10_000).find(|name| !taken(name)).unwrap_or_else(|| format!("heliodon-{clock}.png"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use bevy::input::ButtonState;

    #[test]
    fn signs_are_found_wherever_a_keyboard_has_them() {
        let mut app = App::new();
        app.init_resource::<ButtonInput<KeyCode>>()
            .init_resource::<TimeLapse>()
            .init_resource::<Exposure>()
            .init_resource::<StageFrame>()
            .init_resource::<Culling>()
            .add_message::<KeyboardInput>()
            .add_systems(Update, day_keys);
        let mut press = |sign: &str, key_code: KeyCode, state: ButtonState, repeat: bool| {
            app.world_mut().write_message(KeyboardInput {
                key_code,
                logical_key: Key::Character(sign.into()),
                state,
                text: None,
                repeat,
                window: Entity::PLACEHOLDER,
            });
            app.update();
            (app.world().resource::<TimeLapse>().speed, app.world().resource::<Exposure>().manual_stops)
        };
        // A German keyboard has its plus where the American has a bracket.
        assert_eq!(press("+", KeyCode::BracketRight, ButtonState::Pressed, false), (1.0, 0.25));
        assert_eq!(press("+", KeyCode::BracketRight, ButtonState::Pressed, true), (1.0, 0.25));
        assert_eq!(press("]", KeyCode::Digit9, ButtonState::Pressed, false), (2.0, 0.25));
        assert_eq!(press("[", KeyCode::Digit8, ButtonState::Pressed, false), (1.0, 0.25));
        assert_eq!(press("-", KeyCode::Slash, ButtonState::Pressed, false), (1.0, 0.0));
        // Shift was let go first, so that the key that comes up is another sign.
        assert_eq!(press("=", KeyCode::Equal, ButtonState::Released, false), (1.0, 0.0));
        assert_eq!(press("+", KeyCode::Equal, ButtonState::Pressed, false), (1.0, 0.25));
        press(".", KeyCode::Period, ButtonState::Pressed, false);
        press(".", KeyCode::Period, ButtonState::Pressed, false);
        press(",", KeyCode::Comma, ButtonState::Pressed, false);
        assert_eq!(app.world().resource::<Culling>().threshold_px, 2.0);
        app.world_mut().resource_mut::<ButtonInput<KeyCode>>().press(KeyCode::KeyO);
        app.update();
        let culling = *app.world().resource::<Culling>();
        assert!(!culling.shadow && culling.contribution);
    }

    #[test]
    fn pictures_never_overwrite_others() {
        assert_eq!(picture_name("06:57", |_| false), "heliodon-0657.png");
        assert_eq!(picture_name("06:57", |name| !name.contains("-3")), "heliodon-0657-3.png");
    }
}
