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
use bevy_mod_xr::camera::XrCamera;
use bevy_mod_xr::session::{XrFirst, XrHandleEvents, XrPreDestroySession, XrSessionCreated};
use bevy_mod_xr::spaces::{XrPrimaryReferenceSpace, XrReferenceSpace};
use openxr::ReferenceSpaceType;
use std::time::{Duration, Instant};

/// How high eyes are above the floor where the runtime does not know the floor, metres.
const EYES_M: f32 = 1.6;

/// How long a turn of the loop takes at the least while no frame is wanted: the headset lies on the table.
const IDLE_TURN: Duration = Duration::from_millis(10);

/// The runtime gave poses another origin, or was asked to: what was recentred before counts no more.
#[derive(Message, Clone, Copy, Debug, Default)]
pub(super) struct SpaceChanged;

/// Waits for frames and makes the reference space.
pub(super) struct SessionPlugin;

impl Plugin for SessionPlugin {
    fn build(&self, app: &mut App) {
        app.add_message::<SpaceChanged>()
            .add_plugins(ExtractResourcePlugin::<XrPrimaryReferenceSpace>::default())
            .add_systems(XrSessionCreated, make_space)
            .add_systems(XrPreDestroySession, (forget_space, |mut started: ResMut<OxrSessionStarted>| started.0 = false))
            .init_resource::<SpaceWillChange>()
            .add_systems(
                XrFirst,
                (wait_frame.run_if(should_run_frame_loop).in_set(OxrWaitFrameSystem), rest.run_if(not(should_run_frame_loop)))
                    .in_set(XrHandleEvents::FrameLoop),
            )
            .add_systems(PreUpdate, change_space)
            .add_oxr_event_handler(hear);
        app.sub_app_mut(RenderApp).add_systems(XrPreDestroySession, forget_space);
    }
}

/// When poses will have another origin.
#[derive(Resource, Default)]
struct SpaceWillChange(Option<openxr::Time>);

/// A space that poses are not in changes when somebody recentres by the headset's own button: they mean this one.
fn hear(event: OxrEventIn, mut will: ResMut<SpaceWillChange>, tally: Res<Tally>) {
    match *event {
        openxr::Event::ReferenceSpaceChangePending(change) => will.0 = Some(change.change_time()),
        openxr::Event::InstanceLossPending(_) => tally.fail("it is going".to_owned()),
        openxr::Event::SessionStateChanged(change) if change.state() == openxr::SessionState::LOSS_PENDING => {
            tally.fail("it lost the headset".to_owned());
        }
        _ => {}
    }
}

/// Tells of the other origin once frames are of a time when it holds.
fn change_space(
    frame: Option<Res<OxrFrameState>>,
    mut will: ResMut<SpaceWillChange>,
    mut changed: MessageWriter<SpaceChanged>,
) {
    let now = frame.map(|frame| frame.predicted_display_time);
    if let Some(time) = will.0
        && now.is_some_and(|now| now.as_nanos() >= time.as_nanos())
    {
        changed.write_default();
        will.0 = None;
    }
}

/// Between a session's frames there are no images to draw to.
fn rest(mut cameras: Query<&mut Camera, With<XrCamera>>) {
    cameras.iter_mut().filter(|camera| camera.is_active).for_each(|mut camera| camera.is_active = false);
    std::thread::sleep(IDLE_TURN);
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
