//! The cameras of a room: one for each eye and screen.

use super::place::WorldFromRoom;
use super::projection::ScreenProjection;
use super::{Room, Side};
use crate::daylight::DaylightCamera;
use crate::navigation::Visitor;
use bevy::prelude::*;
use heliodon_math::screen::eyes;

/// A camera that sees through a screen of the [`Room`].
#[derive(Component, Clone, Copy, Debug, PartialEq, Eq)]
#[require(DaylightCamera)]
pub struct RoomEye {
    /// The screen's number.
    pub screen: usize,
    /// Whose eye it is.
    pub side: Side,
}

/// Sets every camera where its eye is.
pub(super) fn aim(room: Res<Room>, visitors: Query<&Visitor>, mut cameras: Query<(&RoomEye, &mut Transform, &mut Projection)>) {
    let Some(visitor) = visitors.iter().next() else { return };
    let display = room.display();
    let world_from_room = WorldFromRoom::new(display, visitor);
    let separation = display.display.eye_separation_m as f32;
    let [left, right] = eyes(room.head.position, room.head.orientation, separation);
    for (eye, mut transform, mut projection) in &mut cameras {
        let Some(screen) = room.screens.get(eye.screen) else { continue };
        let at = match eye.side {
            Side::Middle => room.head.position,
            Side::Left => left,
            Side::Right => right,
        };
        let view = screen.view(at.as_dvec3());
        transform.set_if_neq(Transform {
            translation: world_from_room.point(view.eye),
            rotation: world_from_room.rotation * view.room_from_view,
            ..default()
        });
        let scale = world_from_room.scale;
        let wanted = ScreenProjection {
            view,
            near_m: display.display.near_m as f32 * scale,
            far_m: display.display.far_m.map(|far| far as f32 * scale),
        };
        let current = match &*projection {
            Projection::Custom(custom) => custom.get::<ScreenProjection>(),
            _ => None,
        };
        // What rests is not marked as changed.
        if current != Some(&wanted) {
            *projection = Projection::custom(wanted);
        }
    }
}
