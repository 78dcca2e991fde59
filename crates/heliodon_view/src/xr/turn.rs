//! Turning: by the stick, at once by so many degrees or smoothly, about the head and not about the middle of the play space.

use super::HeadsetSettings;
use super::hands::XrHands;
use super::play::{PlaySpace, world_from_platform};
use crate::input::{Action, Actions};
use crate::navigation::{Travel, Visitor};
use bevy::prelude::*;
use heliodon_bundle::display::Navigation;
use heliodon_track::pose::Pose;
use std::f32::consts::{PI, TAU};

/// How far a stick is pushed to turn, and how far it must come back to turn again.
const PUSHED: f32 = 0.6;
const BACK: f32 = 0.3;

/// A stick that turns by steps.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SnapTurn {
    is_pushed: bool,
}

impl SnapTurn {
    /// How many steps to the right (1), to the left (-1) or none (0) a stick asks for that is pushed so far to the right.
    pub fn steps(&mut self, way: f32) -> f32 {
        if self.is_pushed {
            self.is_pushed = way.abs() > BACK;
            return 0.0;
        }
        self.is_pushed = way.abs() > PUSHED;
        if self.is_pushed { way.signum() } else { 0.0 }
    }
}

/// Turns a visitor by `by_rad` clockwise, so that a head on the platform stays where it is.
pub fn turn_about(visitor: &mut Visitor, head_on_platform: Vec3, by_rad: f32) {
    let before = world_from_platform(visitor).point(head_on_platform);
    visitor.pose.yaw_rad = (visitor.pose.yaw_rad + by_rad) % TAU;
    let after = world_from_platform(visitor).point(head_on_platform);
    visitor.pose.eye += (before - after) * Vec3::new(1.0, 0.0, 1.0);
}

/// How the platform carries whoever stands on it.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq)]
pub struct Carried {
    /// Metres a second, of the head.
    pub speed_m_s: f32,
    /// Radians a second.
    pub turn_rad_s: f32,
}

/// Farther in a frame nobody is moved, but put elsewhere.
const FARTHEST_M: f32 = 2.0;

/// Turns visitors, and tells how they are carried.
#[derive(Default)]
pub(super) struct TurnPlugin;

impl Plugin for TurnPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<Carried>()
            .init_resource::<Before>()
            .add_systems(Update, (remember.before(Travel), (turn, tell_carried).chain().after(Travel)));
    }
}

/// The platform as it was before this frame's [`Travel`].
#[derive(Resource, Clone, Copy, Debug, Default)]
struct Before {
    yaw_rad: f32,
    world_from_platform: Option<Pose>,
    /// Whether it was turned at once.
    snapped: bool,
}

fn remember(hands: Res<XrHands>, play: Res<PlaySpace>, mut visitors: Query<&mut Visitor>, mut before: ResMut<Before>) {
    for mut visitor in &mut visitors {
        visitor.head_m = hands.head.map_or(Vec2::ZERO, |head| (play.platform_from_play * head).position.xz());
    }
    let visitor = visitors.iter().next();
    let (yaw_rad, platform) = visitor.map_or((0.0, None), |visitor| (visitor.pose.yaw_rad, Some(world_from_platform(visitor))));
    *before = Before { yaw_rad, world_from_platform: platform, snapped: false };
}

fn turn(
    actions: Res<Actions>,
    settings: Res<HeadsetSettings>,
    hands: Res<XrHands>,
    play: Res<PlaySpace>,
    mut visitors: Query<&mut Visitor>,
    mut snap: Local<SnapTurn>,
    mut before: ResMut<Before>,
) {
    let way = actions.axis(Action::TurnRight, Action::TurnLeft);
    let step_rad = settings.comfort.snap_turn_deg.to_radians() as f32;
    let steps = if step_rad > 0.0 { snap.steps(way) } else { 0.0 };
    let Some(mut visitor) = visitors.iter_mut().next() else { return };
    // Those that go by themselves, or stand still, are turned by nobody; who is put elsewhere is turned there.
    let moved_m = before.world_from_platform.map_or(0.0, |was| was.position.distance(world_from_platform(&visitor).position));
    let is_elsewhere = actions.begins(Action::Home) || moved_m > FARTHEST_M;
    if is_elsewhere || matches!(visitor.gait, Navigation::Window | Navigation::Guided) {
        return;
    }
    // What `look` has turned smoothly, by the stick or by a mouse on the desk, is taken back and done here, about the head.
    let smooth_rad = visitor.pose.yaw_rad - before.yaw_rad;
    let by_rad = if step_rad > 0.0 && way != 0.0 { steps * step_rad } else { smooth_rad };
    if by_rad == 0.0 && smooth_rad == 0.0 {
        return;
    }
    visitor.pose.yaw_rad = before.yaw_rad;
    if by_rad != 0.0 {
        let head = hands.head.map_or(Vec3::ZERO, |head| (play.platform_from_play * head).position);
        turn_about(&mut visitor, head, by_rad);
        before.snapped = step_rad > 0.0 && way != 0.0;
    }
}

fn tell_carried(
    time: Res<Time>,
    hands: Res<XrHands>,
    play: Res<PlaySpace>,
    visitors: Query<&Visitor>,
    before: Res<Before>,
    mut carried: ResMut<Carried>,
) {
    let now = visitors.iter().next().map(|visitor| (visitor.pose.yaw_rad, world_from_platform(visitor)));
    let head = hands.head.map_or(Vec3::ZERO, |head| (play.platform_from_play * head).position);
    let found = match (before.world_from_platform, now) {
        (Some(was), Some((yaw_rad, is))) if !before.snapped => {
            let moved_m = was.point(head).distance(is.point(head));
            // The shorter way round.
            let turned_rad = ((yaw_rad - before.yaw_rad + PI).rem_euclid(TAU) - PI).abs();
            let seconds = time.delta_secs().max(1e-3);
            match moved_m < FARTHEST_M {
                true => Carried { speed_m_s: moved_m / seconds, turn_rad_s: turned_rad / seconds },
                false => Carried::default(),
            }
        }
        _ => Carried::default(),
    };
    carried.set_if_neq(found);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::{InputPlugin, WandInput};
    use crate::navigation::{MouseLook, NavigationPlugin};
    use crate::stage::Stage;
    use bevy::input::mouse::AccumulatedMouseMotion;
    use bevy::time::TimeUpdateStrategy;
    use heliodon_bundle::display::{DisplayFile, Headset};
    use std::time::Duration;

    #[test]
    fn a_stick_turns_once_until_it_has_come_back() {
        let mut snap = SnapTurn::default();
        let ways = [0.5, 0.7, 1.0, 0.5, 0.65, 0.2, -0.7, -1.0, 0.0, 0.61];
        assert_eq!(ways.map(|way| snap.steps(way)), [0.0, 1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 1.0]);
    }

    #[test]
    fn the_head_stays_where_it_is() {
        let mut visitor = Visitor { eye_height_m: 1.65, ..Visitor::default() };
        visitor.pose.eye = Vec3::new(3.0, 1.65, -2.0);
        let head = Vec3::new(0.8, 1.7, -0.4);
        let before = world_from_platform(&visitor).point(head);
        turn_about(&mut visitor, head, 0.9);
        assert!(world_from_platform(&visitor).point(head).distance(before) < 1e-5);
        assert!((visitor.pose.yaw_rad - 0.9).abs() < 1e-6 && visitor.pose.eye.y == 1.65);
    }

    fn app(snap_turn_deg: f64) -> (App, Entity) {
        let mut app = crate::input::tests::app();
        let comfort = Headset { snap_turn_deg, ..Headset::default() };
        let settings = HeadsetSettings { comfort, ..HeadsetSettings::new(&DisplayFile::default(), 1) };
        app.add_plugins((NavigationPlugin, TurnPlugin))
            .init_resource::<Stage>()
            .init_resource::<PlaySpace>()
            .insert_resource(settings)
            .insert_resource(XrHands {
                head: Some(Pose { position: Vec3::new(0.5, 1.7, 0.0), ..Pose::IDENTITY }),
                ..XrHands::default()
            })
            .insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_millis(50)));
        assert!(app.is_plugin_added::<InputPlugin>());
        let visitor = Visitor { tilts: false, gait: Navigation::Walk, in_room: false, ..Visitor::default() };
        let visitor = app.world_mut().spawn(visitor).id();
        app.update();
        (app, visitor)
    }

    fn push(app: &mut App, x: f32) {
        app.insert_resource(WandInput { stick: Vec2::new(x, 0.0), ..WandInput::default() });
        app.update();
    }

    #[test]
    fn a_push_is_one_snap_and_no_motion() {
        let (mut app, visitor) = app(30.0);
        let yaw_deg = |app: &App| app.world().get::<Visitor>(visitor).unwrap().pose.yaw_rad.to_degrees();
        for _ in 0..3 {
            push(&mut app, 1.0);
            assert!((yaw_deg(&app) - 30.0).abs() < 1e-3, "{}", yaw_deg(&app));
            assert_eq!(*app.world().resource::<Carried>(), Carried::default());
        }
        push(&mut app, 0.0);
        push(&mut app, -1.0);
        assert!(yaw_deg(&app).abs() < 1e-3);
        assert!(app.world().get::<Visitor>(visitor).unwrap().pose.eye.length() < 1e-5, "there and back");
    }

    #[test]
    fn a_mouse_on_the_desk_turns_about_the_head_too() {
        let (mut app, visitor) = app(30.0);
        app.world_mut().resource_mut::<MouseLook>().captured = true;
        app.insert_resource(AccumulatedMouseMotion { delta: Vec2::new(200.0, 0.0) });
        app.update();
        let turned = app.world().get::<Visitor>(visitor).unwrap().clone();
        assert!(turned.pose.yaw_rad > 0.3 && turned.pose.eye.length() > 0.1, "{:?}", turned.pose);
        assert!(app.world().resource::<Carried>().speed_m_s < 1e-3, "the head stays");
    }

    #[test]
    fn without_a_snap_it_turns_smoothly_about_the_head() {
        let (mut app, visitor) = app(0.0);
        push(&mut app, 1.0);
        let turned = app.world().get::<Visitor>(visitor).unwrap().clone();
        assert!(turned.pose.yaw_rad > 0.0 && turned.pose.eye.length() > 0.0);
        let carried = *app.world().resource::<Carried>();
        assert!(carried.turn_rad_s > 0.5 && carried.speed_m_s < 1e-3, "{carried:?}");
    }
}
