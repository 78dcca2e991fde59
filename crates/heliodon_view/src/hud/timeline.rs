//! The day as a bar at the bottom: drag it.

use super::panel::HudRoot;
use super::{FAINT, HudVisibility, PANEL, SUN, clock_text};
use crate::navigation::MouseLook;
use crate::time_lapse::TimeLapse;
use bevy::prelude::*;
use bevy::ui::RelativeCursorPosition;
use bevy::window::WindowFocused;

/// What takes the mouse: the whole length of the day, taller than it looks.
#[derive(Component)]
pub(super) struct Track;
/// Where the time is.
#[derive(Component)]
pub(super) struct Knob;
/// What of the day has the sun up.
#[derive(Component)]
pub(super) struct SunUp;
/// Hours below the bar: the first, sunrise, sunset, the last.
#[derive(Component, Clone, Copy, PartialEq, Eq)]
pub(super) enum Mark {
    First,
    Sunrise,
    Sunset,
    Last,
}

const KNOB_PX: f32 = 14.0;

pub(super) fn spawn(mut commands: Commands) {
    let line = |top: f32, height: f32| Node {
        position_type: PositionType::Absolute,
        top: px(top),
        height: px(height),
        width: percent(100),
        border_radius: BorderRadius::all(px(height * 0.5)),
        ..default()
    };
    commands
        .spawn((
            HudRoot,
            Node {
                position_type: PositionType::Absolute,
                bottom: px(12),
                left: px(14),
                right: px(14),
                height: px(44),
                padding: UiRect::axes(px(22), px(0)),
                border_radius: BorderRadius::all(px(6)),
                ..default()
            },
            BackgroundColor(PANEL),
        ))
        .with_children(|parent| {
            parent
                .spawn((
                    Track,
                    RelativeCursorPosition::default(),
                    Node { width: percent(100), height: percent(100), ..default() },
                ))
                .with_children(|track| {
                    track.spawn((line(13.0, 4.0), BackgroundColor(Color::srgba(1.0, 1.0, 1.0, 0.22))));
                    track.spawn((SunUp, line(13.0, 4.0), BackgroundColor(SUN.with_alpha(0.75))));
                    let knob = Node { width: px(KNOB_PX), ..line(15.0 - KNOB_PX * 0.5, KNOB_PX) };
                    track.spawn((Knob, knob, BackgroundColor(SUN)));
                    for mark in [Mark::First, Mark::Sunrise, Mark::Sunset, Mark::Last] {
                        track.spawn((
                            mark,
                            Node { position_type: PositionType::Absolute, top: px(24), ..default() },
                            Text::default(),
                            TextFont::from_font_size(12.0),
                            TextColor(FAINT),
                        ));
                    }
                });
        });
}

/// Where in the lapse a local time is, in percent.
fn percent_at(lapse: &TimeLapse, clock_s: f64) -> f32 {
    let (first, last) = lapse.span_s();
    if last > first { (100.0 * (clock_s - first) / (last - first)) as f32 } else { 0.0 }
}

/// What moves along the bar.
type Moving<'w, 's> = (
    Query<'w, 's, &'static mut Node, With<Knob>>,
    Query<'w, 's, &'static mut Node, With<SunUp>>,
    Query<'w, 's, (&'static Mark, &'static mut Node, &'static mut Text)>,
);

pub(super) fn show(lapse: Res<TimeLapse>, mut nodes: ParamSet<Moving>) {
    if !lapse.is_changed() {
        return;
    }
    let at = percent_at(&lapse, lapse.clock_s);
    for mut node in &mut nodes.p0() {
        node.left = percent(at);
        node.margin.left = px(-KNOB_PX * 0.5);
    }
    let (first, last) = lapse.span_s();
    let sun_up = lapse.sun_up_s();
    for mut node in &mut nodes.p1() {
        let (from, to) = sun_up.map_or((0.0, 0.0), |(a, b)| (percent_at(&lapse, a), percent_at(&lapse, b)));
        (node.left, node.width) = (percent(from), percent(to - from));
    }
    for (mark, mut node, mut text) in &mut nodes.p2() {
        let clock_s = match mark {
            Mark::First => Some(first),
            Mark::Last => Some(last),
            Mark::Sunrise => sun_up.map(|(rise, _)| rise),
            Mark::Sunset => sun_up.map(|(_, set)| set),
        };
        // Where two would stand on each other, only the ends are told.
        let end = matches!(mark, Mark::First | Mark::Last);
        let room = |clock_s: f64| end || (6.0..94.0).contains(&percent_at(&lapse, clock_s));
        let told = clock_s.filter(|&s| last > first && room(s));
        text.set_if_neq(Text(told.map_or_else(String::new, clock_text)));
        node.left = percent(told.map_or(0.0, |s| percent_at(&lapse, s)));
        // Centred: five letters of 12 px are about 36 px wide.
        node.margin.left = px(-18);
    }
}

pub(super) fn drag(
    mut focus: MessageReader<WindowFocused>,
    buttons: Res<ButtonInput<MouseButton>>,
    visibility: Res<HudVisibility>,
    tracks: Query<&RelativeCursorPosition, With<Track>>,
    mut mouse: ResMut<MouseLook>,
    mut lapse: ResMut<TimeLapse>,
    mut dragging: Local<bool>,
) {
    // Whoever goes to another window lets go, although no button is seen to come up.
    if focus.read().filter(|message| !message.focused).count() > 0 {
        *dragging = false;
    }
    let Ok(cursor) = tracks.single() else { return };
    let over = visibility.shown && !mouse.captured && cursor.cursor_over();
    let held = buttons.pressed(MouseButton::Left);
    if buttons.just_pressed(MouseButton::Left) && over {
        *dragging = true;
    } else if !held {
        *dragging = false;
    }
    let over_controls = over || *dragging;
    if mouse.over_controls != over_controls {
        mouse.over_controls = over_controls;
    }
    if *dragging && let Some(at) = cursor.normalized {
        let (first, last) = lapse.span_s();
        lapse.playing = false;
        lapse.scrub(first + (last - first) * f64::from((at.x + 0.5).clamp(0.0, 1.0)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_timeline_is_let_go_with_the_focus() {
        let mut app = App::new();
        app.init_resource::<ButtonInput<MouseButton>>()
            .init_resource::<HudVisibility>()
            .init_resource::<MouseLook>()
            .init_resource::<TimeLapse>()
            .add_message::<WindowFocused>()
            .add_systems(Update, drag);
        let cursor = RelativeCursorPosition { cursor_over: true, normalized: Some(Vec2::ZERO) };
        let track = app.world_mut().spawn((Track, cursor)).id();
        app.world_mut().resource_mut::<ButtonInput<MouseButton>>().press(MouseButton::Left);
        app.update();
        assert!(!app.world().resource::<TimeLapse>().playing, "held");
        app.world_mut().get_mut::<RelativeCursorPosition>(track).unwrap().cursor_over = false;
        app.world_mut().resource_mut::<ButtonInput<MouseButton>>().clear();
        app.world_mut().write_message(WindowFocused { window: Entity::PLACEHOLDER, focused: false });
        app.world_mut().resource_mut::<TimeLapse>().playing = true;
        app.update();
        app.update();
        assert!(app.world().resource::<TimeLapse>().playing && !app.world().resource::<MouseLook>().over_controls);
    }
}
