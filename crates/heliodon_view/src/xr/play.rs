//! The play space: where a headset's poses are, and how it stands on the visitor's platform.

use super::hands::XrHands;
use super::session::SpaceChanged;
use crate::input::{Action, Actions};
use crate::navigation::{Travel, Visitor};
use bevy::prelude::*;
use bevy_mod_openxr::resources::OxrFrameState;
use bevy_mod_xr::session::XrTrackingRoot;
use heliodon_track::pose::Pose;

/// How the play space stands on the platform: recentred, so that somebody's head was at the platform's middle and looked ahead.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq)]
pub struct PlaySpace {
    /// Turned about the vertical and moved along the floor, whose height stays.
    pub platform_from_play: Pose,
    /// Whether it was recentred, by somebody or as the headset was put on.
    pub is_centred: bool,
}

/// Where something looks, clockwise from above, 0 along -Z. Straight up or down it is where the top of it points, or the bottom.
#[must_use]
pub fn heading_rad(orientation: Quat) -> f32 {
    let (ahead, up) = (orientation * Vec3::NEG_Z, orientation * Vec3::Y);
    // Beyond 60 degrees the top says more of it.
    let towards = if ahead.y.abs() < 0.866 { ahead } else { up * -ahead.y.signum() };
    libm::atan2f(towards.x, -towards.z)
}

impl PlaySpace {
    /// Turns and moves the play space so that `head` is at the platform's middle and looks ahead.
    pub fn recentre(&mut self, head: &Pose) {
        let orientation = Quat::from_rotation_y(heading_rad(head.orientation));
        let on_floor = Vec3::new(head.position.x, 0.0, head.position.z);
        self.platform_from_play = Pose { position: orientation * -on_floor, orientation };
        self.is_centred = true;
    }

    /// Where the play space is in the site.
    #[must_use]
    pub fn world_from_play(&self, visitor: &Visitor) -> Pose {
        world_from_platform(visitor) * self.platform_from_play
    }
}

/// The platform: its floor is where the visitor's feet are, and it never tilts.
#[must_use]
pub fn world_from_platform(visitor: &Visitor) -> Pose {
    let pose = &visitor.pose;
    Pose { position: pose.eye - Vec3::Y * visitor.eye_height_m, orientation: Quat::from_rotation_y(-pose.yaw_rad) }
}

/// When the play space is placed, in `PostUpdate`.
#[derive(SystemSet, Clone, Debug, PartialEq, Eq, Hash)]
pub(super) struct PlacePlaySpace;

/// Recentres and places the play space.
#[derive(Default)]
pub(super) struct PlaySpacePlugin;

impl Plugin for PlaySpacePlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<PlaySpace>()
            .add_message::<SpaceChanged>()
            .add_systems(Update, recentre.before(Travel))
            .add_systems(PostUpdate, place.in_set(PlacePlaySpace).before(bevy::transform::TransformSystems::Propagate));
    }
}

/// Recentres when somebody asks for it, here or by the headset's own button, and when somebody puts the headset on: before, it lay somewhere. A headset that is worn is
/// a visitor's hand, too: an installation does not begin anew.
fn recentre(
    mut actions: ResMut<Actions>,
    hands: Res<XrHands>,
    frame: Option<Res<OxrFrameState>>,
    mut changed: MessageReader<SpaceChanged>,
    mut was_worn: Local<bool>,
    mut play: ResMut<PlaySpace>,
) {
    let is_worn = hands.head.is_some() && frame.is_none_or(|frame| frame.should_render);
    if changed.read().count() > 0 || (is_worn && !*was_worn) {
        play.is_centred = false;
    }
    *was_worn = is_worn;
    if is_worn {
        actions.touch();
    }
    if let Some(head) = &hands.head
        && (actions.begins(Action::Recentre) || (is_worn && !play.is_centred))
    {
        play.recentre(head);
    }
}

fn place(visitors: Query<&Visitor>, play: Res<PlaySpace>, mut roots: Query<&mut Transform, With<XrTrackingRoot>>) {
    let (Some(visitor), Ok(mut root)) = (visitors.iter().next(), roots.single_mut()) else { return };
    let world_from_play = play.world_from_play(visitor);
    root.set_if_neq(Transform {
        translation: world_from_play.position,
        rotation: world_from_play.orientation,
        scale: Vec3::ONE,
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::navigation::pose::Pose as VisitorPose;

    fn head() -> Pose {
        let turned = Quat::from_rotation_y(-2.0) * Quat::from_rotation_x(0.4) * Quat::from_rotation_z(0.2);
        Pose { position: Vec3::new(1.0, 1.7, -0.5), orientation: turned }
    }

    #[test]
    fn headings_are_clockwise_and_known_when_looking_up_or_down() {
        for (yaw, pitch) in [(0.0, 0.0), (1.2, 0.7), (-2.5, -0.9), (0.4, 1.5), (0.4, -1.5)] {
            let found = heading_rad(Quat::from_rotation_y(-yaw) * Quat::from_rotation_x(pitch));
            assert!((found - yaw).abs() < 1e-4, "{found} for {yaw} {pitch}");
        }
    }

    #[test]
    fn a_recentred_head_is_above_the_middle_and_looks_ahead() {
        let mut play = PlaySpace::default();
        play.recentre(&head());
        let on_platform = play.platform_from_play * head();
        assert!(on_platform.position.distance(Vec3::Y * 1.7) < 1e-5, "{on_platform:?}");
        assert!(heading_rad(on_platform.orientation).abs() < 1e-5);
        assert!(play.platform_from_play.position.y == 0.0, "the floor stays");
    }

    #[test]
    fn the_play_space_stands_where_the_visitor_stands() {
        let visitor = Visitor {
            pose: VisitorPose { eye: Vec3::new(10.0, 5.65, -7.0), yaw_rad: 0.5, pitch_rad: 0.3 },
            eye_height_m: 1.65,
            ..Visitor::default()
        };
        let mut play = PlaySpace::default();
        play.recentre(&head());
        let seen = play.world_from_play(&visitor) * head();
        assert!(seen.position.distance(Vec3::new(10.0, 5.7, -7.0)) < 1e-5, "{seen:?}");
        assert!((heading_rad(seen.orientation) - 0.5).abs() < 1e-5);
        let up = play.world_from_play(&visitor).orientation * Vec3::Y;
        assert!(up.distance(Vec3::Y) < 1e-6, "upright");
    }

    #[test]
    fn the_first_head_is_taken_for_the_middle_and_others_on_request() {
        let mut app = App::new();
        app.add_plugins((MinimalPlugins, PlaySpacePlugin)).init_resource::<Actions>().init_resource::<XrHands>();
        app.update();
        assert!(!app.world().resource::<PlaySpace>().is_centred);
        app.insert_resource(XrHands { head: Some(head()), ..XrHands::default() });
        app.update();
        let first = *app.world().resource::<PlaySpace>();
        assert!(first.is_centred && first.platform_from_play != Pose::IDENTITY);
        let other = Pose { position: Vec3::new(0.0, 1.6, 2.0), orientation: Quat::IDENTITY };
        app.insert_resource(XrHands { head: Some(other), ..XrHands::default() });
        app.update();
        assert_eq!(*app.world().resource::<PlaySpace>(), first);
        app.world_mut().resource_mut::<Actions>().set_off(Action::Recentre);
        app.update();
        assert_eq!(app.world().resource::<PlaySpace>().platform_from_play.position, Vec3::new(0.0, 0.0, -2.0));
        // The runtime gives poses another origin: the same head is centred anew.
        let moved = Pose { position: Vec3::new(1.0, 1.6, 0.0), ..other };
        app.insert_resource(XrHands { head: Some(moved), ..XrHands::default() });
        app.insert_resource(Actions::default()).update();
        assert_eq!(app.world().resource::<PlaySpace>().platform_from_play.position, Vec3::new(0.0, 0.0, -2.0));
        app.world_mut().write_message(SpaceChanged);
        app.update();
        assert_eq!(app.world().resource::<PlaySpace>().platform_from_play.position, Vec3::new(-1.0, 0.0, 0.0));
        assert!(app.world().resource::<Actions>().is_touched(), "a headset that is worn is a visitor");
        // Laid aside, and put on by somebody who stands elsewhere.
        app.insert_resource(XrHands::default()).update();
        app.insert_resource(XrHands { head: Some(other), ..XrHands::default() }).update();
        assert_eq!(app.world().resource::<PlaySpace>().platform_from_play.position, Vec3::new(0.0, 0.0, -2.0));
    }
}
