//! Walking and flying with mouse and keyboard, inside a room's box or freely.
//!
//! W A S D move, page up and down rise and sink in flight, shift hurries, the wheel sets the pace. A click takes the mouse for
//! looking around, Escape gives it back. F changes between flight and feet, R leaves the room's box or returns to it, Home
//! goes back to the beginning.

pub mod pose;
pub mod walk;

use crate::stage::Stage;
use crate::stage::ground::Ground;
use bevy::input::mouse::{AccumulatedMouseMotion, AccumulatedMouseScroll, MouseScrollUnit};
use bevy::prelude::*;
use bevy::window::{CursorGrabMode, CursorOptions, PrimaryWindow, WindowFocused};
use heliodon_bundle::Manifest;
use pose::{MAX_PITCH_RAD, Pose};
use walk::Fall;

/// Radians a pixel of mouse motion.
const LOOK_RAD_PER_PX: f32 = 0.002_2;
/// What shift multiplies the pace by.
const HURRY: f32 = 4.0;
/// What a notch of the wheel multiplies the pace by.
const PACE_PER_NOTCH: f32 = 1.2;

/// The camera that a visitor moves.
#[derive(Component, Clone, Debug)]
#[require(crate::DaylightCamera)]
pub struct Visitor {
    /// Eye and look.
    pub pose: Pose,
    /// On foot rather than in flight.
    pub walking: bool,
    /// Kept inside the first room's box, where the site has rooms.
    pub in_room: bool,
    /// Metres a second.
    pub pace_m_s: f32,
    fall: Fall,
    at_home_on: u64,
}

impl Default for Visitor {
    fn default() -> Self {
        Self {
            pose: Pose { eye: Vec3::ZERO, yaw_rad: 0.0, pitch_rad: 0.0 },
            walking: false,
            in_room: true,
            pace_m_s: 2.0,
            fall: Fall::default(),
            at_home_on: 0,
        }
    }
}

/// Whether the mouse turns the head, and whether something else (the timeline) has it.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MouseLook {
    /// The mouse turns the head.
    pub captured: bool,
    /// The pointer is over something that takes clicks.
    pub over_controls: bool,
}

/// The system that takes the mouse at a click, unless the click is for something on the screen: what takes clicks runs before.
#[derive(SystemSet, Clone, Debug, PartialEq, Eq, Hash)]
pub struct CaptureMouse;

/// Moves [`Visitor`]s.
#[derive(Default)]
pub struct NavigationPlugin;

impl Plugin for NavigationPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<MouseLook>()
            .add_message::<WindowFocused>()
            .add_systems(Update, (go_home, let_go, capture_mouse.in_set(CaptureMouse), look, travel).chain());
    }
}

/// The first room's box.
fn room_box(manifest: &Manifest) -> Option<(Vec3, Vec3)> {
    manifest.rooms.first().map(|room| {
        let corner = |at: [f64; 3]| Vec3::from(at.map(|v| v as f32));
        (corner(room.min), corner(room.max))
    })
}

/// Puts visitors at the beginning of a new bundle, and back there on Home.
fn go_home(
    stage: Res<Stage>,
    keys: Res<ButtonInput<KeyCode>>,
    mut visitors: Query<(&mut Visitor, &mut Transform, &mut Projection)>,
) {
    let Some(manifest) = stage.manifest() else { return };
    for (mut visitor, mut transform, mut projection) in &mut visitors {
        if visitor.at_home_on == stage.serial() && !keys.just_pressed(KeyCode::Home) {
            continue;
        }
        visitor.at_home_on = stage.serial();
        visitor.pose = Pose::home(manifest);
        visitor.in_room = room_box(manifest).is_some();
        visitor.fall = Fall::default();
        *transform = visitor.pose.transform();
        if let Projection::Perspective(perspective) = &mut *projection {
            perspective.fov = pose::fov_deg(manifest).to_radians();
            perspective.near = 0.05;
        }
    }
}

/// Whoever goes to another window takes the mouse along. The buttons count as let go, too: nobody tells when they come up.
fn let_go(
    mut focus: MessageReader<WindowFocused>,
    mut mouse: ResMut<MouseLook>,
    mut buttons: ResMut<ButtonInput<MouseButton>>,
) {
    if focus.read().filter(|message| !message.focused).count() > 0 {
        mouse.captured = false;
        buttons.release_all();
    }
}

fn capture_mouse(
    buttons: Res<ButtonInput<MouseButton>>,
    mut mouse: ResMut<MouseLook>,
    mut windows: Query<&mut CursorOptions, With<PrimaryWindow>>,
) {
    if buttons.just_pressed(MouseButton::Left) && !mouse.over_controls && !mouse.captured {
        mouse.captured = true;
    }
    if mouse.is_changed()
        && let Ok(mut cursor) = windows.single_mut()
    {
        cursor.visible = !mouse.captured;
        cursor.grab_mode = if mouse.captured { CursorGrabMode::Locked } else { CursorGrabMode::None };
    }
}

fn look(mouse: Res<MouseLook>, motion: Res<AccumulatedMouseMotion>, mut visitors: Query<&mut Visitor>) {
    if !mouse.captured || motion.delta == Vec2::ZERO {
        return;
    }
    for mut visitor in &mut visitors {
        let turn = motion.delta * LOOK_RAD_PER_PX;
        visitor.pose.yaw_rad = (visitor.pose.yaw_rad + turn.x) % std::f32::consts::TAU;
        visitor.pose.pitch_rad = (visitor.pose.pitch_rad - turn.y).clamp(-MAX_PITCH_RAD, MAX_PITCH_RAD);
    }
}

/// Notches of a wheel, or what they are on a touchpad.
fn notches(scroll: &AccumulatedMouseScroll) -> f32 {
    match scroll.unit {
        MouseScrollUnit::Line => scroll.delta.y,
        MouseScrollUnit::Pixel => scroll.delta.y / MouseScrollUnit::SCROLL_UNIT_CONVERSION_FACTOR,
    }
}

fn travel(
    time: Res<Time>,
    stage: Res<Stage>,
    keys: Res<ButtonInput<KeyCode>>,
    scroll: Res<AccumulatedMouseScroll>,
    mut visitors: Query<(&mut Visitor, &mut Transform)>,
) {
    let axis = |plus: KeyCode, minus: KeyCode| f32::from(keys.pressed(plus)) - f32::from(keys.pressed(minus));
    let wish = Vec3::new(
        axis(KeyCode::KeyD, KeyCode::KeyA),
        axis(KeyCode::PageUp, KeyCode::PageDown),
        axis(KeyCode::KeyS, KeyCode::KeyW),
    )
    .clamp_length_max(1.0);
    let unknown = Ground::default();
    let ground = stage.footing().unwrap_or(&unknown);
    let hurry = if keys.any_pressed([KeyCode::ShiftLeft, KeyCode::ShiftRight]) { HURRY } else { 1.0 };
    // A frame that took long must not carry anyone through a wall.
    let seconds = time.delta_secs().min(0.1);
    for (mut visitor, mut transform) in &mut visitors {
        if keys.just_pressed(KeyCode::KeyF) {
            visitor.walking = !visitor.walking;
            visitor.fall = Fall::default();
        }
        if keys.just_pressed(KeyCode::KeyR) {
            visitor.in_room = !visitor.in_room;
        }
        let notches = notches(&scroll);
        if notches != 0.0 {
            visitor.pace_m_s = (visitor.pace_m_s * PACE_PER_NOTCH.powf(notches.clamp(-10.0, 10.0))).clamp(0.1, 200.0);
        }
        let stride = wish * visitor.pace_m_s * hurry * seconds;
        let heading = Quat::from_rotation_y(-visitor.pose.yaw_rad);
        let Visitor { pose, fall, walking, .. } = &mut *visitor;
        if *walking {
            pose.eye = walk::walk(ground, pose.eye, heading * stride, seconds, fall);
        } else {
            pose.eye += pose.rotation() * Vec3::new(stride.x, 0.0, stride.z) + Vec3::Y * stride.y;
        }
        if visitor.in_room
            && let Some((low, high)) = stage.manifest().and_then(room_box)
        {
            visitor.pose.eye = visitor.pose.eye.clamp(low, high);
        }
        transform.set_if_neq(visitor.pose.transform());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bevy::time::TimeUpdateStrategy;
    use std::time::Duration;

    fn app() -> (App, Entity) {
        let mut app = App::new();
        app.add_plugins((MinimalPlugins, NavigationPlugin))
            .init_resource::<Stage>()
            .init_resource::<ButtonInput<KeyCode>>()
            .init_resource::<ButtonInput<MouseButton>>()
            .init_resource::<AccumulatedMouseMotion>()
            .init_resource::<AccumulatedMouseScroll>()
            .insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_millis(50)));
        let visitor = app.world_mut().spawn((Visitor::default(), Transform::default(), Projection::default())).id();
        app.update();
        (app, visitor)
    }

    #[test]
    fn diagonals_are_no_faster() {
        for keys in [&[KeyCode::KeyW][..], &[KeyCode::KeyW, KeyCode::KeyD], &[KeyCode::KeyW, KeyCode::KeyD, KeyCode::PageUp]] {
            let (mut app, visitor) = app();
            keys.iter().for_each(|&key| app.world_mut().resource_mut::<ButtonInput<KeyCode>>().press(key));
            app.update();
            let gone = app.world().get::<Transform>(visitor).unwrap().translation.length();
            assert!((gone - 2.0 * 0.05).abs() < 1e-5, "{gone} m with {keys:?}");
        }
    }

    #[test]
    fn a_flick_of_a_touchpad_is_no_more_than_a_turn_of_the_wheel() {
        for (unit, y) in [(MouseScrollUnit::Line, 2.0), (MouseScrollUnit::Pixel, 200.0)] {
            let (mut app, visitor) = app();
            app.insert_resource(AccumulatedMouseScroll { unit, delta: Vec2::new(0.0, y) });
            app.update();
            let pace = app.world().get::<Visitor>(visitor).unwrap().pace_m_s;
            assert!((pace - 2.0 * 1.44).abs() < 1e-4, "{pace} m/s");
        }
    }

    #[test]
    fn the_mouse_goes_with_the_focus() {
        let (mut app, _) = app();
        app.world_mut().resource_mut::<ButtonInput<MouseButton>>().press(MouseButton::Left);
        app.update();
        assert!(app.world().resource::<MouseLook>().captured);
        app.world_mut().resource_mut::<ButtonInput<MouseButton>>().clear();
        app.world_mut().write_message(WindowFocused { window: Entity::PLACEHOLDER, focused: false });
        app.update();
        assert!(!app.world().resource::<MouseLook>().captured);
        assert!(!app.world().resource::<ButtonInput<MouseButton>>().pressed(MouseButton::Left));
    }
}
