//! Keyboard and mouse in place of a tracked head: it moves in the room while the room stands still.

use super::{Source, Trackers};
use crate::display::Room;
use crate::display::place::WorldFromRoom;
use crate::display::preview::PreviewCamera;
use crate::input::{Action, Actions};
use crate::navigation::{LOOK_RAD_PER_PX, MouseLook, Visitor, first_room};
use crate::stage::Stage;
use bevy::input::mouse::AccumulatedMouseMotion;
use bevy::prelude::*;
use heliodon_bundle::display::{BodyKind, Navigation};
use heliodon_track::pose::Pose;

/// How fast a head moves in a room, metres a second: at most, and a tenth of the visitor's pace.
const HEAD_M_S: f32 = 1.0;

/// The farthest that a head goes from where it rests, where the site has no room that says more, metres.
const REACH_M: f32 = 3.0;

/// How a head that keys move is turned.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Head {
    yaw_rad: f32,
    pitch_rad: f32,
}

#[expect(clippy::too_many_arguments, reason = "a system's arguments are its resources")]
pub(super) fn simulate(
    time: Res<Time>,
    actions: Res<Actions>,
    mouse: Res<MouseLook>,
    motion: Res<AccumulatedMouseMotion>,
    stage: Res<Stage>,
    visitors: Query<&Visitor>,
    previews: Query<(), With<PreviewCamera>>,
    mut trackers: ResMut<Trackers>,
    mut room: ResMut<Room>,
) {
    let Some(visitor) = visitors.iter().next().filter(|visitor| visitor.gait == Navigation::Window) else { return };
    for tracker in &mut trackers.trackers {
        let Source::Simulated(turned) = &mut tracker.source else { continue };
        if !tracker.bodies.contains(&BodyKind::Head) {
            continue;
        }
        if actions.begins(Action::Home) || actions.begins(Action::Recentre) {
            *turned = Head::default();
            room.head = room.rest();
            continue;
        }
        // In the preview the mouse goes round the room.
        if mouse.captured && previews.is_empty() {
            turned.yaw_rad -= motion.delta.x * LOOK_RAD_PER_PX;
            turned.pitch_rad = (turned.pitch_rad - motion.delta.y * LOOK_RAD_PER_PX).clamp(-1.5, 1.5);
        }
        let wish = Vec3::new(
            actions.axis(Action::Right, Action::Left),
            actions.axis(Action::Rise, Action::Sink),
            actions.axis(Action::Back, Action::Forward),
        );
        let step = wish.clamp_length_max(1.0) * HEAD_M_S * time.delta_secs().min(0.1);
        let heading = Quat::from_rotation_y(turned.yaw_rad);
        let world_from_room = WorldFromRoom::new(room.display(), visitor);
        let moved = room.head.position + heading * step;
        let rest = room.rest().position;
        let position = match stage.manifest().and_then(first_room).filter(|_| visitor.in_room) {
            Some((low, high)) => world_from_room.to_room(world_from_room.point(moved).clamp(low, high)),
            None => moved.clamp(rest - REACH_M, rest + REACH_M),
        };
        let head = Pose { position, orientation: heading * Quat::from_rotation_x(turned.pitch_rad) };
        if head != room.head {
            room.head = head;
        }
    }
}
