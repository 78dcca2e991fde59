//! Controllers set off the same actions as keys: their sticks are those of a game controller, their buttons those of the wand.
//!
//! So what a `display.toml` binds holds for them, too. What the left stick says is turned first: forward is where the head looks.

use super::hands::{Follows, SeeHands, XrHands};
use super::play::{PlaySpace, heading_rad};
use super::profiles::{Asked, PROFILES};
use crate::input::{Input, InputSet, WandInput};
use bevy::input::gamepad::{Gamepad, GamepadAxis};
use bevy::prelude::*;
use bevy_mod_openxr::action_set_attaching::OxrAttachActionSet;
use bevy_mod_openxr::action_set_syncing::{OxrActionSetSyncSet, OxrSyncActionSet};
use bevy_mod_openxr::openxr_session_running;
use bevy_mod_openxr::resources::OxrInstance;
use bevy_mod_openxr::session::OxrSession;
use bevy_mod_xr::session::{XrSessionCreated, XrState};
use openxr::{Action, ActionSet, Binding, Path, Posef, Vector2f};

/// The wand's button that is the trigger.
pub(super) const TRIGGER: u32 = 1;

/// What controllers say in this frame.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq)]
pub struct Controllers {
    /// The left stick: right and forward, -1 to 1.
    pub left_stick: Vec2,
    /// The right stick.
    pub right_stick: Vec2,
    /// The wand's buttons: trigger, A, B, menu, and what the right and the left hand close on. Bit n is button n + 1.
    pub buttons: u32,
}

/// The actions that the runtime knows.
#[derive(Resource)]
pub(super) struct Bound {
    set: ActionSet,
    poses: [Action<Posef>; 3],
    sticks: [Action<Vector2f>; 2],
    buttons: [Action<bool>; 6],
}

impl Bound {
    pub(super) fn new(instance: &openxr::Instance) -> openxr::Result<Self> {
        let set = instance.create_action_set("visit", "Visit", 0)?;
        fn action<T: openxr::ActionTy>(set: &ActionSet, asked: Asked) -> openxr::Result<Action<T>> {
            let (name, shown) = asked.names();
            set.create_action(name, shown, &[])
        }
        let pose = |asked| action(&set, asked);
        let poses = [pose(Asked::GripLeft)?, pose(Asked::GripRight)?, pose(Asked::AimRight)?];
        let sticks = [action(&set, Asked::Move)?, action(&set, Asked::Turn)?];
        let [trigger, first, second, menu, right, left] = Asked::BUTTONS;
        let buttons = [
            action(&set, trigger)?,
            action(&set, first)?,
            action(&set, second)?,
            action(&set, menu)?,
            action(&set, right)?,
            action(&set, left)?,
        ];
        Ok(Self { set, poses, sticks, buttons })
    }

    /// What tells where hands are.
    pub(super) fn poses(&self) -> impl Iterator<Item = (Follows, &Action<Posef>)> {
        [Follows::Left, Follows::Right, Follows::RightAim].into_iter().zip(&self.poses)
    }

    /// All of them are of this set.
    pub(super) fn set(&self) -> &ActionSet {
        &self.set
    }

    /// Where the left and the right hand grip.
    pub(super) fn grips(&self) -> [&Action<Posef>; 2] {
        [&self.poses[0], &self.poses[1]]
    }

    /// Tells the runtime what each kind of controller calls them. A runtime passes over kinds that it does not know.
    pub(super) fn suggest(&self, instance: &openxr::Instance) -> openxr::Result<()> {
        for profile in PROFILES {
            let bindings: Vec<(Asked, Path)> = profile
                .bindings()
                .map(|(asked, path)| Ok((asked, instance.string_to_path(&path)?)))
                .collect::<openxr::Result<_>>()?;
            let bindings: Vec<Binding<'_>> = bindings.iter().map(|(asked, path)| self.binding(*asked, *path)).collect();
            match instance.suggest_interaction_profile_bindings(instance.string_to_path(profile.path)?, &bindings) {
                Ok(()) | Err(openxr::sys::Result::ERROR_PATH_UNSUPPORTED) => {}
                Err(why) => return Err(why),
            }
        }
        Ok(())
    }

    /// Actions of the same set for trackers that go by these roles, in their order.
    pub(super) fn roles<'a>(
        &self,
        instance: &openxr::Instance,
        roles: impl Iterator<Item = &'a String>,
    ) -> openxr::Result<Vec<Action<Posef>>> {
        let (mut actions, mut paths) = (Vec::new(), Vec::new());
        for (number, role) in roles.enumerate() {
            actions.push(self.set.create_action::<Posef>(&format!("role_{number}"), role, &[])?);
            paths.push(instance.string_to_path(&format!("{role}/input/grip/pose"))?);
        }
        if !actions.is_empty() {
            let bindings: Vec<Binding<'_>> =
                actions.iter().zip(&paths).map(|(action, path)| Binding::new(action, *path)).collect();
            let profile = instance.string_to_path("/interaction_profiles/htc/vive_tracker_htcx")?;
            instance.suggest_interaction_profile_bindings(profile, &bindings)?;
        }
        Ok(actions)
    }

    fn binding(&self, asked: Asked, path: Path) -> Binding<'_> {
        match asked {
            Asked::GripLeft => Binding::new(&self.poses[0], path),
            Asked::GripRight => Binding::new(&self.poses[1], path),
            Asked::AimRight => Binding::new(&self.poses[2], path),
            Asked::Move => Binding::new(&self.sticks[0], path),
            Asked::Turn => Binding::new(&self.sticks[1], path),
            Asked::Trigger => Binding::new(&self.buttons[0], path),
            Asked::First => Binding::new(&self.buttons[1], path),
            Asked::Second => Binding::new(&self.buttons[2], path),
            Asked::Menu => Binding::new(&self.buttons[3], path),
            Asked::SqueezeRight => Binding::new(&self.buttons[4], path),
            Asked::SqueezeLeft => Binding::new(&self.buttons[5], path),
        }
    }

    /// What a session's controllers say; of those that are not there, nothing.
    pub(super) fn read<G>(&self, session: &openxr::Session<G>) -> Controllers {
        let stick = |action: &Action<Vector2f>| {
            let state = action.state(session, Path::NULL).ok().filter(|state| state.is_active);
            let way = state.map_or(Vec2::ZERO, |state| Vec2::new(state.current_state.x, state.current_state.y));
            if way.is_finite() { way.clamp(Vec2::NEG_ONE, Vec2::ONE) } else { Vec2::ZERO }
        };
        let is_down =
            |action: &Action<bool>| action.state(session, Path::NULL).is_ok_and(|state| state.is_active && state.current_state);
        let bits = self.buttons.iter().enumerate().map(|(number, action)| u32::from(is_down(action)) << number);
        Controllers { left_stick: stick(&self.sticks[0]), right_stick: stick(&self.sticks[1]), buttons: bits.sum() }
    }
}

/// The game controller that the sticks are.
#[derive(Component)]
struct Sticks;

/// When [`Controllers`] are read, in `PreUpdate`, and when they are handed on.
#[derive(SystemSet, Clone, Debug, PartialEq, Eq, Hash)]
pub(super) enum ControllerSet {
    Read,
    HandOn,
}

/// Binds and reads controllers.
#[derive(Default)]
pub(super) struct ControllersPlugin;

impl Plugin for ControllersPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<Controllers>()
            .configure_sets(PreUpdate, (SeeHands, ControllerSet::Read, ControllerSet::HandOn, InputSet).chain())
            .add_systems(Startup, |mut commands: Commands| {
                commands.spawn((Sticks, Gamepad::default(), Name::new("headset's controllers")));
            })
            .add_systems(XrSessionCreated, bind)
            .add_systems(
                PreUpdate,
                (
                    sync.before(OxrActionSetSyncSet).run_if(openxr_session_running),
                    read.in_set(ControllerSet::Read),
                    hand_on.in_set(ControllerSet::HandOn),
                ),
            );
    }
}

/// Makes the actions and asks for them to be attached.
pub(super) fn bind(instance: Res<OxrInstance>, mut attach: MessageWriter<OxrAttachActionSet>, mut commands: Commands) {
    match Bound::new(&instance).and_then(|bound| bound.suggest(&instance).map(|()| bound)) {
        Ok(bound) => {
            attach.write(OxrAttachActionSet(bound.set.clone()));
            commands.insert_resource(bound);
        }
        Err(why) => error!("the headset's controllers cannot be used: {why}"),
    }
}

fn sync(bound: Option<Res<Bound>>, mut sync: MessageWriter<OxrSyncActionSet>) {
    if let Some(bound) = bound {
        sync.write(OxrSyncActionSet(bound.set.clone()));
    }
}

fn read(
    state: Option<Res<XrState>>,
    bound: Option<Res<Bound>>,
    session: Option<Res<OxrSession>>,
    mut controllers: ResMut<Controllers>,
) {
    // The set is attached at the end of the session's first frame, long before it runs.
    let is_running = state.is_some_and(|state| *state == XrState::Running);
    let said = bound.zip(session).filter(|_| is_running).map(|(bound, session)| bound.read(&session));
    controllers.set_if_neq(said.unwrap_or_default());
}

/// What a stick must say for `Input`'s dead zone, which is cut out of each axis, to leave what it means, turned by `by_rad` clockwise.
fn turned(stick: Vec2, by_rad: f32, dead_zone: f32) -> Vec2 {
    let length = stick.length();
    let Some(direction) = stick.try_normalize().filter(|_| length > dead_zone) else { return Vec2::ZERO };
    let meant = ((length - dead_zone) / (1.0 - dead_zone)).min(1.0);
    let (sin, cos) = (libm::sinf(by_rad), libm::cosf(by_rad));
    let way = Vec2::new(direction.x * cos + direction.y * sin, direction.y * cos - direction.x * sin) * meant;
    way.map(|v| if v == 0.0 { 0.0 } else { v.signum() * (dead_zone + v.abs() * (1.0 - dead_zone)) })
}

fn hand_on(
    controllers: Res<Controllers>,
    hands: Res<XrHands>,
    play: Res<PlaySpace>,
    input: Res<Input>,
    mut pads: Query<&mut Gamepad, With<Sticks>>,
    mut wand: ResMut<WandInput>,
) {
    let heading = hands.head.map_or(0.0, |head| heading_rad((play.platform_from_play * head).orientation));
    let left = turned(controllers.left_stick, heading, input.settings.dead_zone as f32);
    let right = controllers.right_stick;
    for mut pad in &mut pads {
        use GamepadAxis::{LeftStickX, LeftStickY, RightStickX, RightStickY};
        for (axis, way) in [(LeftStickX, left.x), (LeftStickY, left.y), (RightStickX, right.x), (RightStickY, right.y)] {
            pad.analog_mut().set(axis, way);
        }
    }
    wand.set_if_neq(WandInput { buttons: controllers.buttons, present: hands.right.is_some(), ..WandInput::default() });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::{Action as Does, Actions};
    use heliodon_track::pose::Pose;
    use std::f32::consts::FRAC_PI_2;

    /// An app with hands on actions and no runtime.
    fn app() -> App {
        let mut app = crate::input::tests::app();
        app.init_resource::<Controllers>()
            .init_resource::<XrHands>()
            .init_resource::<PlaySpace>()
            .add_systems(PreUpdate, hand_on.before(InputSet));
        app.world_mut().spawn((Sticks, Gamepad::default()));
        app
    }

    fn said(app: &mut App, controllers: Controllers) -> Actions {
        app.insert_resource(controllers);
        app.update();
        app.world().resource::<Actions>().clone()
    }

    #[test]
    fn forward_is_where_the_head_looks() {
        let mut app = app();
        let forward = Controllers { left_stick: Vec2::Y, ..Controllers::default() };
        let actions = said(&mut app, forward);
        assert!((actions.value(Does::Forward) - 1.0).abs() < 1e-5 && actions.value(Does::Right) == 0.0);
        // Looking to the right, forward is the platform's right.
        let head = Pose { position: Vec3::Y, orientation: Quat::from_rotation_y(-FRAC_PI_2) };
        app.insert_resource(XrHands { head: Some(head), ..XrHands::default() });
        let actions = said(&mut app, forward);
        assert!((actions.value(Does::Right) - 1.0).abs() < 1e-5 && actions.value(Does::Forward) < 1e-5);
        // Recentred, ahead is there.
        app.world_mut().resource_mut::<PlaySpace>().recentre(&head);
        assert!((said(&mut app, forward).value(Does::Forward) - 1.0).abs() < 1e-5);
    }

    #[test]
    fn half_way_is_half_way_in_every_direction_and_the_dead_zone_is_dead() {
        let dead_zone = 0.2;
        let beyond = |way: f32| ((way.abs() - dead_zone) / (1.0 - dead_zone)).clamp(0.0, 1.0) * way.signum();
        for by in [0.0_f32, 0.7, -2.0, 3.0] {
            let meant = turned(Vec2::new(0.36, 0.48), by, dead_zone).map(beyond);
            assert!((meant.length() - 0.5).abs() < 1e-4, "{meant} by {by}");
            assert_eq!(turned(Vec2::new(0.1, 0.1), by, dead_zone), Vec2::ZERO);
        }
        assert!(turned(Vec2::ONE, 0.3, dead_zone).length() <= 2.0_f32.sqrt());
    }

    #[test]
    fn buttons_are_the_wands_and_the_right_stick_turns() {
        let mut app = app();
        let actions =
            said(&mut app, Controllers { buttons: 0b1001, right_stick: Vec2::new(1.0, 0.0), ..Controllers::default() });
        assert!(actions.begins(Does::Play) && actions.begins(Does::Recentre) && !actions.begins(Does::Gait));
        assert!((actions.value(Does::TurnRight) - 1.0).abs() < 1e-5 && actions.value(Does::TurnLeft) == 0.0);
        let actions = said(&mut app, Controllers::default());
        assert!(!actions.begins(Does::Play) && actions.value(Does::TurnRight) == 0.0);
    }
}
