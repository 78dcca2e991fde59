//! What visitors ask of the day and of the window.

use super::HudVisibility;
use crate::culling::Culling;
use crate::input::{Action, Actions};
use crate::navigation::MouseLook;
use crate::stage::frame::StageFrame;
use crate::time_lapse::exposure::Exposure;
use crate::time_lapse::{Blend, TimeLapse};
use bevy::prelude::*;
use bevy::render::view::screenshot::{Screenshot, save_to_disk};
use bevy::window::{PrimaryWindow, WindowMode};

/// The least and the greatest threshold of contribution culling, pixels.
const THRESHOLD_RANGE_PX: (f32, f32) = (0.25, 64.0);

/// The slowest and the fastest day.
const SPEED_RANGE: (f32, f32) = (1.0 / 64.0, 16.0);

/// Stops of exposure at a time.
const EXPOSURE_STEP: f32 = 0.25;

pub(super) fn day_actions(
    actions: Res<Actions>,
    mut lapse: ResMut<TimeLapse>,
    mut exposure: ResMut<Exposure>,
    mut frame: ResMut<StageFrame>,
    mut culling: ResMut<Culling>,
) {
    // Nothing that rests may be taken for changed.
    let steps = actions.count(Action::StepOn) - actions.count(Action::StepBack);
    if steps != 0.0 {
        lapse.step(steps as i64);
    }
    let speed = actions.count(Action::Faster) - actions.count(Action::Slower);
    if speed != 0.0 {
        lapse.speed = (lapse.speed * speed.exp2()).clamp(SPEED_RANGE.0, SPEED_RANGE.1);
    }
    if actions.begins(Action::Play) {
        lapse.toggle_playing();
    }
    if actions.begins(Action::Loop) {
        lapse.looping = !lapse.looping;
    }
    if actions.begins(Action::Blend) {
        lapse.blend = match lapse.blend {
            Blend::Smooth => Blend::Hard,
            Blend::Hard => Blend::Smooth,
        };
    }
    let brighter = actions.count(Action::Brighter) - actions.count(Action::Darker);
    if brighter != 0.0 {
        exposure.manual_stops += EXPOSURE_STEP * brighter;
    }
    if actions.begins(Action::HoldExposure) {
        exposure.held = !exposure.held;
    }
    if actions.begins(Action::Grain) {
        frame.without_details = !frame.without_details;
    }
    if actions.begins(Action::Guessed) {
        frame.shows_guessed = !frame.shows_guessed;
    }
    if actions.begins(Action::ToneCurve) {
        frame.curve = frame.curve.toggled();
    }
    if actions.begins(Action::CullHidden) {
        culling.shadow = !culling.shadow;
    }
    if actions.begins(Action::CullSmall) {
        culling.contribution = !culling.contribution;
    }
    let larger = actions.count(Action::CullMore) - actions.count(Action::CullLess);
    if larger != 0.0 {
        culling.threshold_px = (culling.threshold_px * larger.exp2()).clamp(THRESHOLD_RANGE_PX.0, THRESHOLD_RANGE_PX.1);
    }
}

#[expect(clippy::too_many_arguments, reason = "a system's arguments are its resources")]
pub(super) fn window_actions(
    actions: Res<Actions>,
    lapse: Res<TimeLapse>,
    kiosk: Option<Res<crate::kiosk::Kiosk>>,
    mut visibility: ResMut<HudVisibility>,
    mut mouse: ResMut<MouseLook>,
    mut windows: Query<&mut Window, With<PrimaryWindow>>,
    mut commands: Commands,
    mut exit: MessageWriter<AppExit>,
) {
    let may_leave = kiosk.is_none_or(|kiosk| kiosk.may_quit());
    if actions.begins(Action::Help) {
        visibility.help = !visibility.help;
    }
    if actions.begins(Action::Hud) {
        visibility.shown = !visibility.shown;
    }
    if actions.begins(Action::Costs) {
        visibility.costs = !visibility.costs;
    }
    if actions.begins(Action::FullScreen) && may_leave {
        windows.iter_mut().for_each(|mut window| {
            window.mode = match window.mode {
                WindowMode::Windowed => WindowMode::BorderlessFullscreen(MonitorSelection::Current),
                _ => WindowMode::Windowed,
            };
        });
    }
    if actions.begins(Action::Picture) && may_leave {
        let path = picture_name(&super::clock_text(lapse.clock_s), |name| std::path::Path::new(name).exists());
        commands.spawn(Screenshot::primary_window()).observe(save_to_disk(path));
    }
    if actions.begins(Action::Leave) {
        if visibility.help {
            visibility.help = false;
        } else if mouse.captured {
            mouse.captured = false;
        } else if may_leave {
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
    fn what_is_asked_for_is_done_and_what_is_not_rests() {
        let mut app = App::new();
        app.init_resource::<Actions>()
            .init_resource::<TimeLapse>()
            .init_resource::<Exposure>()
            .init_resource::<StageFrame>()
            .init_resource::<Culling>()
            .add_systems(Update, day_actions);
        let mut ask = |actions: &[Action]| {
            app.insert_resource(Actions::default());
            actions.iter().for_each(|&action| app.world_mut().resource_mut::<Actions>().set_off(action));
            app.world_mut().clear_trackers();
            app.update();
            (
                app.world().resource::<TimeLapse>().speed,
                app.world().resource::<Exposure>().manual_stops,
                *app.world().resource::<Culling>(),
            )
        };
        assert_eq!(ask(&[Action::Brighter]).1, 0.25);
        assert_eq!(ask(&[Action::Faster]).0, 2.0);
        assert_eq!(ask(&[Action::Slower, Action::Darker]).0, 1.0);
        ask(&[Action::CullMore, Action::CullMore]);
        assert_eq!(ask(&[Action::CullLess]).2.threshold_px, 2.0);
        let culling = ask(&[Action::CullHidden]).2;
        assert!(!culling.shadow && culling.contribution);
        ask(&[]);
        assert!(!app.world().is_resource_changed::<Exposure>() && !app.world().is_resource_changed::<StageFrame>());
    }

    #[test]
    fn pictures_never_overwrite_others() {
        assert_eq!(picture_name("06:57", |_| false), "heliodon-0657.png");
        assert_eq!(picture_name("06:57", |name| !name.contains("-3")), "heliodon-0657-3.png");
    }
}
