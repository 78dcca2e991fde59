//! Where head and hands are in the play space.

use super::controllers::Bound;
use crate::input::InputSet;
use bevy::prelude::*;
use bevy_mod_openxr::action_set_syncing::OxrActionSetSyncSet;
use bevy_mod_openxr::session::OxrSession;
use bevy_mod_openxr::spaces::OxrSpaceLocationFlags;
use bevy_mod_xr::session::{XrPreDestroySession, XrSessionCreated, XrState};
use bevy_mod_xr::spaces::XrSpaceSyncSet;
use heliodon_track::pose::Pose;
use openxr::ReferenceSpaceType;

/// Where head and hands are in the play space; none of which the runtime knows nothing.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq)]
pub struct XrHands {
    /// The middle between the eyes.
    pub head: Option<Pose>,
    /// The left hand, as it grips: -Z along the thumb's side of what it holds, +X out of the palm.
    pub left: Option<Pose>,
    /// The right hand, as it grips: -Z as of the left, +X into the palm.
    pub right: Option<Pose>,
    /// Where the right hand points, along -Z.
    pub right_aim: Option<Pose>,
}

/// What a space of the runtime follows.
#[derive(Component, Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Follows {
    Head,
    Left,
    Right,
    RightAim,
}

impl XrHands {
    fn slot(&mut self, of: Follows) -> &mut Option<Pose> {
        match of {
            Follows::Head => &mut self.head,
            Follows::Left => &mut self.left,
            Follows::Right => &mut self.right,
            Follows::RightAim => &mut self.right_aim,
        }
    }
}

/// When [`XrHands`] are known, in `PreUpdate`.
#[derive(SystemSet, Clone, Debug, PartialEq, Eq, Hash)]
pub(super) struct SeeHands;

/// Follows [`XrHands`].
#[derive(Default)]
pub(super) struct HandsPlugin;

impl Plugin for HandsPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<XrHands>()
            .configure_sets(PreUpdate, SeeHands.after(XrSpaceSyncSet).after(OxrActionSetSyncSet).before(InputSet))
            .add_systems(XrSessionCreated, follow.after(super::controllers::bind))
            .add_systems(XrPreDestroySession, forget)
            .add_systems(PreUpdate, see.in_set(SeeHands));
    }
}

fn follow(session: Res<OxrSession>, bound: Option<Res<Bound>>, mut commands: Commands) {
    let poses = bound.iter().flat_map(|bound| bound.poses());
    let hands = poses.map(|(of, action)| (of, session.create_action_space(action, openxr::Path::NULL, Isometry3d::IDENTITY)));
    let head = session.create_reference_space(ReferenceSpaceType::VIEW, Isometry3d::IDENTITY).map(|space| space.0);
    for (of, space) in hands.chain([(Follows::Head, head)]) {
        match space {
            // They go with the session.
            Ok(space) => drop(commands.spawn((of, space))),
            Err(why) => error!("the headset's runtime cannot tell where things are ({of:?}): {why}"),
        }
    }
}

fn forget(spaces: Query<Entity, With<Follows>>, mut hands: ResMut<XrHands>, mut commands: Commands) {
    spaces.iter().for_each(|space| commands.entity(space).despawn());
    *hands = XrHands::default();
}

fn see(state: Option<Res<XrState>>, spaces: Query<(&Follows, &Transform, &OxrSpaceLocationFlags)>, mut hands: ResMut<XrHands>) {
    let mut seen = XrHands::default();
    if state.is_some_and(|state| *state == XrState::Running) {
        for (of, transform, flags) in &spaces {
            let is_seen = flags.pos_valid() && flags.rot_valid();
            *seen.slot(*of) = is_seen.then(|| Pose::new(transform.translation, transform.rotation)).flatten();
        }
    }
    hands.set_if_neq(seen);
}

#[cfg(test)]
mod tests {
    use super::*;
    use openxr::SpaceLocationFlags;

    #[test]
    fn what_is_not_seen_or_not_finite_is_nowhere() {
        let mut app = App::new();
        app.add_plugins(MinimalPlugins).init_resource::<XrHands>().insert_resource(XrState::Running).add_systems(Update, see);
        let all = SpaceLocationFlags::POSITION_VALID | SpaceLocationFlags::ORIENTATION_VALID;
        let at = Transform::from_xyz(0.2, 1.1, -0.3);
        app.world_mut().spawn((Follows::Left, at, OxrSpaceLocationFlags(all)));
        app.world_mut().spawn((Follows::Right, at, OxrSpaceLocationFlags(SpaceLocationFlags::ORIENTATION_VALID)));
        app.world_mut().spawn((Follows::Head, Transform::from_xyz(f32::NAN, 0.0, 0.0), OxrSpaceLocationFlags(all)));
        app.update();
        let seen = *app.world().resource::<XrHands>();
        assert_eq!(seen, XrHands { left: Pose::new(at.translation, at.rotation), ..XrHands::default() });
        app.insert_resource(XrState::Idle);
        app.update();
        assert_eq!(*app.world().resource::<XrHands>(), XrHands::default());
    }
}
