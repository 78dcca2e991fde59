//! Walking, flying and being guided, inside a room's box or freely.
//!
//! A [`Visitor`] is moved by what [`Actions`] ask for. Where a visitor stands in a room with screens or wears a headset, it is the
//! room that moves through the site, and its resting eye is the visitor's.

mod guided;
pub mod pose;
pub mod walk;

use crate::bodies::Bodies;
use crate::costs::FrameTold;
use crate::input::{Action, Actions, Input, InputSet};
use crate::stage::Stage;
use crate::stage::ground::Ground;
use bevy::input::mouse::AccumulatedMouseMotion;
use bevy::prelude::*;
use bevy::window::{CursorGrabMode, CursorOptions, PrimaryWindow, WindowFocused};
use guided::Tour;
use heliodon_bundle::Manifest;
use heliodon_bundle::display::Navigation;
use pose::{MAX_PITCH_RAD, Pose};
use walk::Fall;

/// Radians a pixel of mouse motion.
pub(crate) const LOOK_RAD_PER_PX: f32 = 0.002_2;
/// What shift multiplies the pace by.
const HURRY: f32 = 4.0;
/// What a frame counts for at most, seconds.
const LONGEST_FRAME_S: f32 = 0.1;
/// What a notch of the wheel multiplies the pace by.
const PACE_PER_NOTCH: f32 = 1.2;

/// Who moves through the site: a camera, where the same entity is one, or a whole room with its screens.
#[derive(Component, Clone, Debug)]
#[require(Transform)]
pub struct Visitor {
    /// Eye and look.
    pub pose: Pose,
    /// How it gets about.
    pub gait: Navigation,
    /// Above what feet stand on, metres.
    pub eye_height_m: f32,
    /// Whether it looks up and down: a room stays upright.
    pub tilts: bool,
    /// Where it begins in a bundle, and comes back to.
    pub begin: Beginning,
    /// Kept inside the first room's box, where the site has rooms.
    pub in_room: bool,
    /// Where the head is on the platform that a headset's wearer walks about on, from its middle, metres, -Z ahead; 0 for all others. Walls and rooms hold the head.
    pub head_m: Vec2,
    /// Metres a second.
    pub pace_m_s: f32,
    /// Where it is on its way.
    pub progress: Progress,
}

/// What a [`Visitor`] is amid: nothing at first.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Progress {
    fall: Fall,
    tour: Tour,
    at_home_on: u64,
}

/// Where a visitor begins.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Beginning {
    /// The site's room; the first one if there is none of this name.
    pub room: Option<String>,
    /// The eye, in place of the room's middle.
    pub eye: Option<Vec3>,
    /// The heading, in place of that towards what the room looks at.
    pub yaw_rad: Option<f32>,
}

impl Beginning {
    /// The pose in a bundle.
    #[must_use]
    pub fn pose(&self, manifest: &Manifest) -> Pose {
        let named = self.room.as_ref().and_then(|name| manifest.rooms.iter().find(|room| room.name == *name));
        let mut pose = named.map_or_else(|| Pose::home(manifest), |room| Pose::in_room(manifest, room));
        pose.eye = self.eye.unwrap_or(pose.eye);
        if let Some(yaw_rad) = self.yaw_rad {
            (pose.yaw_rad, pose.pitch_rad) = (yaw_rad, 0.0);
        }
        pose
    }
}

impl Default for Visitor {
    fn default() -> Self {
        Self {
            pose: Pose { eye: Vec3::ZERO, yaw_rad: 0.0, pitch_rad: 0.0 },
            gait: Navigation::Fly,
            eye_height_m: walk::EYE_HEIGHT_M,
            tilts: true,
            begin: Beginning::default(),
            in_room: true,
            head_m: Vec2::ZERO,
            pace_m_s: 2.0,
            progress: Progress::default(),
        }
    }
}

impl Visitor {
    /// Goes back to where it began, as it began, in the next frame.
    pub fn go_home(&mut self) {
        self.progress.at_home_on = 0;
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

/// When visitors are moved, in `Update`.
#[derive(SystemSet, Clone, Debug, PartialEq, Eq, Hash)]
pub struct Travel;

/// Moves [`Visitor`]s.
#[derive(Default)]
pub struct NavigationPlugin;

impl Plugin for NavigationPlugin {
    fn build(&self, app: &mut App) {
        let told = FrameTold::in_app(app);
        app.init_resource::<MouseLook>()
            .add_message::<WindowFocused>()
            .add_systems(PreUpdate, let_go.before(InputSet))
            .add_systems(
                Update,
                (go_home, capture_mouse.in_set(CaptureMouse), look, told.of("walking", travel)).chain().in_set(Travel),
            );
    }
}

/// The first room's box.
pub(crate) fn first_room(manifest: &Manifest) -> Option<(Vec3, Vec3)> {
    manifest.rooms.first().map(|room| {
        let corner = |at: [f64; 3]| Vec3::from(at.map(|v| v as f32));
        (corner(room.min), corner(room.max))
    })
}

/// Puts visitors at the beginning of a new bundle, and back there when they ask for it.
fn go_home(
    stage: Res<Stage>,
    actions: Res<Actions>,
    mut visitors: Query<(&mut Visitor, &mut Transform, Option<&mut Projection>)>,
) {
    let Some(manifest) = stage.manifest() else { return };
    for (mut visitor, mut transform, projection) in &mut visitors {
        if visitor.progress.at_home_on == stage.serial() && !actions.begins(Action::Home) {
            continue;
        }
        visitor.progress = Progress { at_home_on: stage.serial(), ..Progress::default() };
        visitor.pose = visitor.begin.pose(manifest);
        if !visitor.tilts {
            visitor.pose.pitch_rad = 0.0;
        }
        visitor.in_room = first_room(manifest).is_some();
        *transform = visitor.pose.transform();
        if let Some(mut projection) = projection
            && let Projection::Perspective(perspective) = &mut *projection
        {
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
    actions: Res<Actions>,
    input: Res<Input>,
    mut mouse: ResMut<MouseLook>,
    mut windows: Query<&mut CursorOptions, With<PrimaryWindow>>,
) {
    if actions.begins(Action::TakeMouse) && !mouse.over_controls && !mouse.captured && !input.settings.air_mouse {
        mouse.captured = true;
    }
    if mouse.is_changed()
        && let Ok(mut cursor) = windows.single_mut()
    {
        cursor.visible = !mouse.captured;
        cursor.grab_mode = if mouse.captured { CursorGrabMode::Locked } else { CursorGrabMode::None };
    }
}

fn look(
    time: Res<Time>,
    mouse: Res<MouseLook>,
    motion: Res<AccumulatedMouseMotion>,
    actions: Res<Actions>,
    input: Res<Input>,
    mut visitors: Query<&mut Visitor>,
) {
    let by_mouse = if mouse.captured { motion.delta * LOOK_RAD_PER_PX } else { Vec2::ZERO };
    let stick = Vec2::new(actions.axis(Action::TurnRight, Action::TurnLeft), actions.axis(Action::LookDown, Action::LookUp));
    let by_stick = stick * (input.settings.turn_deg_s as f32).to_radians() * time.delta_secs().min(LONGEST_FRAME_S);
    let turn = by_mouse + by_stick;
    if turn == Vec2::ZERO {
        return;
    }
    for mut visitor in visitors.iter_mut().filter(|visitor| visitor.gait != Navigation::Window) {
        visitor.pose.yaw_rad = (visitor.pose.yaw_rad + turn.x) % std::f32::consts::TAU;
        if visitor.tilts {
            visitor.pose.pitch_rad = (visitor.pose.pitch_rad - turn.y).clamp(-MAX_PITCH_RAD, MAX_PITCH_RAD);
        }
    }
}

/// What comes after a way of getting about.
fn next_gait(gait: Navigation, manifest: Option<&Manifest>) -> Navigation {
    match gait {
        Navigation::Window | Navigation::Guided => Navigation::Fly,
        Navigation::Fly => Navigation::Walk,
        Navigation::Walk if manifest.is_some_and(|manifest| manifest.rooms.len() > 1) => Navigation::Guided,
        Navigation::Walk => Navigation::Fly,
    }
}

fn travel(
    time: Res<Time>,
    stage: Res<Stage>,
    actions: Res<Actions>,
    mut bodies: Option<ResMut<Bodies>>,
    mut visitors: Query<(&mut Visitor, &mut Transform)>,
) {
    let wish = Vec3::new(
        actions.axis(Action::Right, Action::Left),
        actions.axis(Action::Rise, Action::Sink),
        actions.axis(Action::Back, Action::Forward),
    )
    .clamp_length_max(1.0);
    let unknown = Ground::default();
    let ground = stage.footing().unwrap_or(&unknown);
    let hurry = 1.0 + (HURRY - 1.0) * actions.value(Action::Hurry);
    // A frame that took long must not carry anyone through a wall.
    let seconds = time.delta_secs().min(LONGEST_FRAME_S);
    for (mut visitor, mut transform) in &mut visitors {
        if actions.begins(Action::Gait) {
            visitor.gait = next_gait(visitor.gait, stage.manifest());
            (visitor.progress.fall, visitor.progress.tour) = (Fall::default(), Tour::default());
        }
        if actions.begins(Action::KeepIn) {
            visitor.in_room = !visitor.in_room;
        }
        let quicker = actions.count(Action::PaceUp) - actions.count(Action::PaceDown);
        if quicker != 0.0 {
            visitor.pace_m_s = (visitor.pace_m_s * PACE_PER_NOTCH.powf(quicker)).clamp(0.1, 200.0);
        }
        let stride = wish * visitor.pace_m_s * hurry * seconds;
        let heading = Quat::from_rotation_y(-visitor.pose.yaw_rad);
        let head = heading * Vec3::new(visitor.head_m.x, 0.0, visitor.head_m.y);
        let Visitor { pose, progress: Progress { fall, tour, .. }, gait, eye_height_m, tilts, .. } = &mut *visitor;
        match gait {
            // The head moves, the room does not.
            Navigation::Window => {}
            Navigation::Walk => {
                let taller = Vec3::Y * (*eye_height_m - walk::EYE_HEIGHT_M);
                let to_feet = head - taller;
                let (from, step) = (pose.eye + to_feet, heading * stride);
                let held = bodies.as_mut().and_then(|bodies| bodies.walk((&*stage, ground), from, step, seconds, fall));
                pose.eye = held.unwrap_or_else(|| walk::walk(ground, from, step, seconds, fall)) - to_feet;
            }
            Navigation::Fly => pose.eye += pose.rotation() * Vec3::new(stride.x, 0.0, stride.z) + Vec3::Y * stride.y,
            Navigation::Guided => {
                if let Some(guided) = stage.manifest().and_then(|manifest| tour.step(manifest, *pose, seconds)) {
                    *pose = guided;
                    if !*tilts {
                        pose.pitch_rad = 0.0;
                    }
                }
            }
        }
        if visitor.in_room
            && matches!(visitor.gait, Navigation::Walk | Navigation::Fly)
            // Steps of one's own are not taken back: that would be felt.
            && (stride != Vec3::ZERO || head == Vec3::ZERO)
            && let Some((low, high)) = stage.manifest().and_then(first_room)
        {
            visitor.pose.eye = (visitor.pose.eye + head).clamp(low, high) - head;
        }
        transform.set_if_neq(visitor.pose.transform());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::tests::app as input_app;
    use bevy::time::TimeUpdateStrategy;
    use std::time::Duration;

    fn app() -> (App, Entity) {
        let mut app = input_app();
        app.add_plugins(NavigationPlugin)
            .init_resource::<Stage>()
            .insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_millis(50)));
        let visitor = app.world_mut().spawn(Visitor::default()).id();
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
    fn a_virtual_window_stands_still_and_a_room_stays_upright() {
        let (mut app, visitor) = app();
        let mut of = app.world_mut().get_mut::<Visitor>(visitor).unwrap();
        (of.gait, of.tilts) = (Navigation::Window, false);
        app.world_mut().resource_mut::<MouseLook>().captured = true;
        app.world_mut().resource_mut::<ButtonInput<KeyCode>>().press(KeyCode::KeyW);
        app.insert_resource(AccumulatedMouseMotion { delta: Vec2::new(100.0, 100.0) });
        app.update();
        assert_eq!(*app.world().get::<Transform>(visitor).unwrap(), Transform::IDENTITY);
        app.world_mut().get_mut::<Visitor>(visitor).unwrap().gait = Navigation::Fly;
        app.update();
        let moved = app.world().get::<Transform>(visitor).unwrap();
        assert!(moved.translation.length() > 0.0 && moved.translation.y == 0.0 && moved.rotation != Quat::IDENTITY);
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
