//! The frame loop's beginning and the space that poses are in.

use super::watch::Tally;
use bevy::prelude::*;
use bevy::render::RenderApp;
use bevy::render::extract_resource::ExtractResourcePlugin;
use bevy_mod_openxr::exts::OxrEnabledExtensions;
use bevy_mod_openxr::init::should_run_frame_loop;
use bevy_mod_openxr::poll_events::{OxrEventHandlerExt, OxrEventIn};
use bevy_mod_openxr::render::OxrWaitFrameSystem;
use bevy_mod_openxr::resources::{OxrFrameState, OxrFrameWaiter, OxrSessionStarted};
use bevy_mod_openxr::session::OxrSession;
use bevy_mod_xr::session::{XrFirst, XrHandleEvents, XrPreDestroySession, XrSessionCreated};
use bevy_mod_xr::spaces::{XrPrimaryReferenceSpace, XrReferenceSpace};
use openxr::ReferenceSpaceType;
use std::time::Instant;

/// How high eyes are above the floor where the runtime does not know the floor, metres.
const EYES_M: f32 = 1.6;

/// The runtime gave poses another origin: what was recentred before counts no more.
#[derive(Message, Clone, Copy, Debug, Default)]
pub(super) struct SpaceChanged;

/// Waits for frames and makes the reference space.
pub(super) struct SessionPlugin;

impl Plugin for SessionPlugin {
    fn build(&self, app: &mut App) {
        app.add_message::<SpaceChanged>()
            .add_plugins(ExtractResourcePlugin::<XrPrimaryReferenceSpace>::default())
            .add_systems(XrSessionCreated, make_space)
            .add_systems(XrPreDestroySession, forget_space)
            .add_systems(
                XrFirst,
                wait_frame.run_if(should_run_frame_loop).in_set(OxrWaitFrameSystem).in_set(XrHandleEvents::FrameLoop),
            )
            .add_oxr_event_handler(|event: OxrEventIn, mut changed: MessageWriter<SpaceChanged>| {
                if let openxr::Event::ReferenceSpaceChangePending(_) = *event {
                    changed.write_default();
                }
            });
        app.sub_app_mut(RenderApp).add_systems(XrPreDestroySession, forget_space);
    }
}

/// Waits until the runtime wants the next frame. A runtime that is gone ends the loop, where bevy_mod_openxr's own system panics.
fn wait_frame(
    mut waiter: ResMut<OxrFrameWaiter>,
    mut started: ResMut<OxrSessionStarted>,
    tally: Res<Tally>,
    mut exit: MessageWriter<AppExit>,
    mut commands: Commands,
) {
    let begun = Instant::now();
    let waited = waiter.wait();
    tally.waited(begun.elapsed());
    match waited {
        Ok(state) => commands.insert_resource(OxrFrameState(state)),
        Err(why) => {
            started.0 = false;
            tally.fail(format!("it does not wait for frames any more: {why}"));
            exit.write(AppExit::error());
        }
    }
}

/// The first of these spaces that a session has: the floor of the play area, the floor below where the visitor sat down, and that place itself.
fn choose(available: &[ReferenceSpaceType], has_local_floor: bool) -> (ReferenceSpaceType, f32) {
    if available.contains(&ReferenceSpaceType::STAGE) {
        (ReferenceSpaceType::STAGE, 0.0)
    } else if has_local_floor && available.contains(&ReferenceSpaceType::LOCAL_FLOOR) {
        (ReferenceSpaceType::LOCAL_FLOOR, 0.0)
    } else {
        // Every runtime has it.
        (ReferenceSpaceType::LOCAL, -EYES_M)
    }
}

fn make_space(
    session: Res<OxrSession>,
    extensions: Res<OxrEnabledExtensions>,
    tally: Res<Tally>,
    mut exit: MessageWriter<AppExit>,
    mut commands: Commands,
) {
    let available = session.enumerate_reference_spaces().unwrap_or_default();
    let (kind, floor_m) = choose(&available, extensions.raw().ext_local_floor);
    match session.create_reference_space(kind, Isometry3d::from_translation(Vec3::Y * floor_m)) {
        Ok(space) => commands.insert_resource(XrPrimaryReferenceSpace(space)),
        Err(why) => {
            tally.fail(format!("it has no space for poses: {why}"));
            exit.write(AppExit::error());
        }
    }
}

fn forget_space(spaces: Query<Entity, With<XrReferenceSpace>>, mut commands: Commands) {
    commands.remove_resource::<XrPrimaryReferenceSpace>();
    for entity in &spaces {
        commands.entity(entity).remove::<XrReferenceSpace>();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_floor_is_taken_where_it_is_known() {
        use ReferenceSpaceType as Kind;
        assert_eq!(choose(&[Kind::VIEW, Kind::LOCAL, Kind::STAGE], true), (Kind::STAGE, 0.0));
        assert_eq!(choose(&[Kind::VIEW, Kind::LOCAL, Kind::LOCAL_FLOOR], true), (Kind::LOCAL_FLOOR, 0.0));
        assert_eq!(choose(&[Kind::VIEW, Kind::LOCAL, Kind::LOCAL_FLOOR], false), (Kind::LOCAL, -EYES_M));
        assert_eq!(choose(&[], false), (Kind::LOCAL, -EYES_M));
    }
}
