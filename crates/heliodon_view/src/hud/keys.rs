//! The keys of the day and of the window.

use super::HudVisibility;
use crate::navigation::MouseLook;
use crate::stage::frame::StageFrame;
use crate::time_lapse::exposure::Exposure;
use crate::time_lapse::{Blend, TimeLapse};
use bevy::prelude::*;
use bevy::render::view::screenshot::{Screenshot, save_to_disk};
use bevy::window::{PrimaryWindow, WindowMode};

/// All keys, as the help lists them.
pub(super) const HELP: [(&str, &str); 20] = [
    ("Space", "let the day pass, or pause it"),
    ("Left  Right", "one step of the day back or on"),
    ("[  ]", "slower, faster"),
    ("L", "begin the day again at its end, or stop"),
    ("B", "smooth light, or the steps as they are"),
    ("+  -", "exposure, a quarter of a stop"),
    ("E", "exposure follows the day, or is held"),
    ("T", "tone curve: clamped or filmic"),
    ("Click", "look around with the mouse"),
    ("W A S D", "move; Shift hurries"),
    ("Page Up  Down", "rise and sink in flight"),
    ("Wheel", "pace"),
    ("F", "fly or walk"),
    ("R", "inside the room's box, or free"),
    ("Home", "back to the beginning"),
    ("H  F1", "this help"),
    ("Tab", "hide or show text and timeline"),
    ("F11", "all of the screen, or a window"),
    ("F12", "save a picture beside you"),
    ("Esc", "give the mouse back; quit"),
];

/// The slowest and the fastest day.
const SPEED_RANGE: (f32, f32) = (1.0 / 64.0, 16.0);

pub(super) fn day_keys(
    keys: Res<ButtonInput<KeyCode>>,
    mut lapse: ResMut<TimeLapse>,
    mut exposure: ResMut<Exposure>,
    mut frame: ResMut<StageFrame>,
) {
    for key in keys.get_just_pressed() {
        match key {
            KeyCode::Space => lapse.playing = !lapse.playing,
            KeyCode::ArrowLeft => lapse.step(-1),
            KeyCode::ArrowRight => lapse.step(1),
            KeyCode::BracketLeft => lapse.speed = (lapse.speed * 0.5).max(SPEED_RANGE.0),
            KeyCode::BracketRight => lapse.speed = (lapse.speed * 2.0).min(SPEED_RANGE.1),
            KeyCode::KeyL => lapse.looping = !lapse.looping,
            KeyCode::KeyB => {
                lapse.blend = match lapse.blend {
                    Blend::Smooth => Blend::Hard,
                    Blend::Hard => Blend::Smooth,
                }
            }
            KeyCode::Equal | KeyCode::NumpadAdd => exposure.manual_stops += 0.25,
            KeyCode::Minus | KeyCode::NumpadSubtract => exposure.manual_stops -= 0.25,
            KeyCode::KeyE => exposure.held = !exposure.held,
            KeyCode::KeyT => frame.curve = frame.curve.toggled(),
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

    #[test]
    fn pictures_never_overwrite_others() {
        assert_eq!(picture_name("06:57", |_| false), "heliodon-0657.png");
        assert_eq!(picture_name("06:57", |name| !name.contains("-3")), "heliodon-0657-3.png");
    }
}
