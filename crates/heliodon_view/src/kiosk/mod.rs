//! An installation that runs by itself: the cursor is hidden, nobody quits it by accident, after a while without a hand on anything
//! all is as at the beginning, and frames that took long are written down with what was going on.

mod watch;

use crate::culling::Culling;
use crate::input::Actions;
use crate::navigation::{MouseLook, Travel, Visitor};
use crate::stage::frame::StageFrame;
use crate::time_lapse::TimeLapse;
use crate::time_lapse::exposure::Exposure;
use bevy::prelude::*;
use bevy::window::{CursorOptions, PrimaryWindow, WindowCloseRequested};
use heliodon_bundle::display::Kiosk as KioskSettings;
use heliodon_bundle::memory::give_back_freed_memory;
use std::path::PathBuf;
pub use watch::{FrameWatch, Slowness};

/// What an installation asks for.
#[derive(Resource, Clone, Debug)]
pub struct Kiosk {
    settings: KioskSettings,
    idle_s: f64,
    /// How often it began anew.
    restarts: u64,
    /// What the day was like at the beginning.
    day_seconds: f32,
}

impl Kiosk {
    /// As a display asks for it.
    #[must_use]
    pub fn new(settings: KioskSettings, day_seconds: f32) -> Self {
        Self { settings, idle_s: 0.0, restarts: 0, day_seconds }
    }

    /// Whether a visitor may end it.
    #[must_use]
    pub fn may_quit(&self) -> bool {
        self.settings.may_quit
    }

    /// How often it began anew since nobody touched anything.
    #[must_use]
    pub fn restarts(&self) -> u64 {
        self.restarts
    }
}

/// Runs a [`Kiosk`], once there is one.
#[derive(Default)]
pub struct KioskPlugin;

impl Plugin for KioskPlugin {
    fn build(&self, app: &mut App) {
        app.add_systems(
            Update,
            (begin_anew.after(Travel), tidy, hide_cursors, refuse_to_close).run_if(resource_exists::<Kiosk>),
        )
        .add_systems(Last, watch::watch.run_if(resource_exists::<FrameWatch>));
    }
}

/// The watch of an installation's frames, whose log is at `log`.
#[must_use]
pub fn frame_watch(settings: &KioskSettings, log: Option<PathBuf>) -> FrameWatch {
    FrameWatch::new(settings.slow_ms, log)
}

#[expect(clippy::too_many_arguments, reason = "a system's arguments are its resources")]
fn begin_anew(
    time: Res<Time<Real>>,
    actions: Res<Actions>,
    mut kiosk: ResMut<Kiosk>,
    mut lapse: ResMut<TimeLapse>,
    mut exposure: ResMut<Exposure>,
    mut frame: ResMut<StageFrame>,
    mut culling: ResMut<Culling>,
    mut mouse: ResMut<MouseLook>,
    mut visitors: Query<&mut Visitor>,
) {
    // The time without a hand is kept quietly.
    let quiet = kiosk.bypass_change_detection();
    quiet.idle_s = if actions.is_touched() { 0.0 } else { quiet.idle_s + time.delta_secs_f64() };
    if quiet.idle_s < quiet.settings.idle_s {
        return;
    }
    kiosk.idle_s = 0.0;
    kiosk.restarts += 1;
    let first = lapse.span_s().0;
    (lapse.playing, lapse.looping, lapse.speed, lapse.day_seconds) = (true, true, 1.0, kiosk.day_seconds);
    lapse.scrub(first);
    *exposure = Exposure::default();
    (frame.curve, frame.without_details, frame.shows_guessed) = Default::default();
    *culling = Culling::default();
    mouse.captured = false;
    visitors.iter_mut().for_each(|mut visitor| visitor.go_home());
}

/// With a new day, where the picture jumps anyway, what the day before needed for a moment is given back: weeks of days must not add up.
fn tidy(lapse: Res<TimeLapse>, mut before_s: Local<f64>) {
    if lapse.clock_s < *before_s {
        give_back_freed_memory();
    }
    *before_s = lapse.clock_s;
}

fn hide_cursors(mut cursors: Query<&mut CursorOptions, With<Window>>) {
    cursors.iter_mut().filter(|cursor| cursor.visible).for_each(|mut cursor| cursor.visible = false);
}

/// Bevy closes a window that is asked to close: in an installation another takes its place.
fn refuse_to_close(
    kiosk: Res<Kiosk>,
    mut requests: MessageReader<WindowCloseRequested>,
    primary: Query<Entity, With<PrimaryWindow>>,
    mut exit: MessageWriter<AppExit>,
) {
    let asked = requests.read().filter(|request| primary.contains(request.window)).count();
    if asked > 0 && kiosk.may_quit() {
        exit.write(AppExit::Success);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bevy::time::TimeUpdateStrategy;
    use std::time::Duration;

    #[test]
    fn what_nobody_touches_begins_anew() {
        let mut app = App::new();
        app.add_plugins((MinimalPlugins, KioskPlugin))
            .init_resource::<Actions>()
            .init_resource::<TimeLapse>()
            .init_resource::<Exposure>()
            .init_resource::<StageFrame>()
            .init_resource::<Culling>()
            .init_resource::<MouseLook>()
            .add_message::<WindowCloseRequested>()
            .insert_resource(Kiosk::new(KioskSettings { idle_s: 1.0, ..KioskSettings::default() }, 30.0))
            .insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_millis(100)));
        let visitor = app.world_mut().spawn(Visitor::default()).id();
        app.update();
        app.world_mut().resource_mut::<Exposure>().manual_stops = 2.0;
        app.world_mut().get_mut::<Visitor>(visitor).unwrap().pace_m_s = 50.0;
        let restarts = |app: &App| app.world().resource::<Kiosk>().restarts();
        for _ in 0..30 {
            // Somebody plays with it.
            app.world_mut().resource_mut::<Actions>().set_off(crate::input::Action::Brighter);
            app.update();
        }
        assert_eq!(restarts(&app), 0);
        app.insert_resource(Actions::default());
        for _ in 0..11 {
            app.update();
        }
        assert_eq!((restarts(&app), app.world().resource::<Exposure>().manual_stops), (1, 0.0));
    }
}
