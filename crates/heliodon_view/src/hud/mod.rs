//! What the window tells and takes: the hour, the sun's height, the exposure and the frame time; a timeline to drag; help.

mod costs;
mod keys;
mod panel;
mod timeline;

use bevy::prelude::*;

/// Text, timeline, help and the keys of the day.
#[derive(Default)]
pub struct HudPlugin;

/// What of the head-up display is shown.
#[derive(Resource, Clone, Copy, Debug, PartialEq, Eq)]
pub struct HudVisibility {
    /// Text and timeline.
    pub shown: bool,
    /// The list of keys.
    pub help: bool,
    /// What each feature takes of the processor.
    pub costs: bool,
}

impl Default for HudVisibility {
    fn default() -> Self {
        Self { shown: true, help: false, costs: false }
    }
}

/// Dark enough behind white letters over a bright sky.
pub(crate) const PANEL: Color = Color::srgba(0.04, 0.045, 0.06, 0.66);
/// Letters.
pub(crate) const INK: Color = Color::srgb(0.96, 0.95, 0.92);
/// Letters of less weight.
pub(crate) const FAINT: Color = Color::srgba(0.96, 0.95, 0.92, 0.62);
/// The sun's colour on the timeline.
pub(crate) const SUN: Color = Color::srgb(1.0, 0.78, 0.36);

/// `HH:MM` of a local time in seconds.
pub(crate) fn clock_text(clock_s: f64) -> String {
    let minutes = (clock_s / 60.0).floor() as i64;
    format!("{:02}:{:02}", minutes.div_euclid(60).rem_euclid(24), minutes.rem_euclid(60))
}

impl Plugin for HudPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<HudVisibility>()
            .init_resource::<crate::navigation::MouseLook>()
            .add_message::<bevy::window::WindowFocused>()
            .add_systems(Startup, (panel::spawn, timeline::spawn))
            .add_systems(
                Update,
                (keys::day_actions, keys::window_actions, timeline::drag.before(crate::navigation::CaptureMouse)),
            )
            .add_systems(
                PostUpdate,
                (panel::tell, costs::tell, panel::list_help, timeline::show, panel::show_parts)
                    .before(bevy::ui::UiSystems::Prepare),
            );
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn hours_are_told_in_two_digits_and_pass_midnight() {
        assert_eq!(super::clock_text(6.0 * 3600.0 + 57.0 * 60.0 + 59.0), "06:57");
        assert_eq!(super::clock_text(24.5 * 3600.0), "00:30");
    }
}
