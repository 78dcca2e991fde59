//! Where eyes and hands are: in the middle of a window, before the screens of a room, in a headset.

use super::{BOTH, Hand, Hands};
use crate::display::Room;
use crate::display::place::WorldFromRoom;
use crate::navigation::Visitor;
#[cfg(feature = "xr")]
use crate::xr::{XrHands, play::PlaySpace};
use bevy::ecs::system::SystemParam;
use bevy::prelude::*;
use glam::Affine3A;
use heliodon_track::pose::Pose;

/// Where a hand is that nobody tracks, in the view's space: at its side, lower than the eyes, before the body, metres.
const SIDE_M: Vec3 = Vec3::new(0.25, -0.28, -0.45);
/// A hand's speed is that of so many last seconds: trackers tremble.
const SPEED_OVER_S: f32 = 0.06;
/// Faster than this no hand goes, metres a second: a tracker has slipped, or somebody was carried away.
pub(super) const FASTEST_M_S: f32 = 25.0;

/// Who says where a hand is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Scheme {
    /// The eyes: it points at the middle of the view, and swings when it is told to.
    #[default]
    View,
    /// A tracker: it is where it is.
    Tracked,
}

/// Where a hand is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HandPose {
    /// From the hand's own space, whose -Z is along what it holds and +Y up, to the world; lengths stay.
    pub world_from_hand: Affine3A,
    /// Where it points from, and the unit direction.
    pub aim: (Vec3, Vec3),
    /// How the view is turned, for what is held before it.
    pub view: (Vec3, Quat),
    /// How fast it goes by itself, without what carries the visitor, metres a second of the world.
    pub velocity_m_s: Vec3,
    /// How fast it turns by itself, radians a second.
    pub spin_rad_s: Vec3,
    /// Who says so.
    pub scheme: Scheme,
    /// Whether the middle of the view is that of a window.
    pub in_window: bool,
    /// The room or play space that carries it, now: from it to the world.
    pub(super) world_from_base: Affine3A,
    /// The hand in that space, now and in the frame before; the same where there was none.
    pub(super) base_from_hand: [Affine3A; 2],
}

/// Who knows where eyes and hands are.
#[derive(SystemParam)]
pub struct Poses<'w, 's> {
    visitors: Query<'w, 's, &'static Visitor>,
    room: Option<Res<'w, Room>>,
    #[cfg(feature = "xr")]
    headset: Option<Res<'w, XrHands>>,
    #[cfg(feature = "xr")]
    play: Option<Res<'w, PlaySpace>>,
}

/// Eyes and hands in the space that carries them.
struct Seen {
    world_from_base: Affine3A,
    head: Pose,
    /// Grip and aim, by hand.
    hands: [Option<(Pose, Pose)>; 2],
    in_window: bool,
}

impl Poses<'_, '_> {
    /// The middle between the visitor's eyes, and how they look: along -Z.
    #[must_use]
    pub fn view(&self) -> Option<(Vec3, Quat)> {
        self.seen().map(|seen| view(&seen))
    }

    fn seen(&self) -> Option<Seen> {
        let visitor = self.visitors.iter().next()?;
        #[cfg(feature = "xr")]
        if let (Some(headset), Some(play)) = (&self.headset, &self.play)
            && let Some(head) = headset.head
        {
            let right = headset.right.map(|grip| (grip, headset.right_aim.unwrap_or(grip)));
            let hands = [right, headset.left.map(|grip| (grip, grip))];
            return Some(Seen { world_from_base: affine(&play.world_from_play(visitor)), head, hands, in_window: false });
        }
        if let Some(room) = &self.room {
            let place = WorldFromRoom::new(room.display(), visitor);
            let scale = Vec3::splat(place.scale);
            let world_from_base = Affine3A::from_scale_rotation_translation(scale, place.rotation, place.origin);
            let hands = [room.wand, room.left_hand].map(|hand| hand.map(|pose| (pose, pose)));
            return Some(Seen { world_from_base, head: room.head, hands, in_window: false });
        }
        let head = Pose { position: visitor.pose.eye, orientation: visitor.pose.rotation() };
        Some(Seen { world_from_base: Affine3A::IDENTITY, head, hands: [None; 2], in_window: true })
    }
}

fn affine(pose: &Pose) -> Affine3A {
    Affine3A::from_rotation_translation(pose.orientation, pose.position)
}

fn view(seen: &Seen) -> (Vec3, Quat) {
    let (_, turn, _) = seen.world_from_base.to_scale_rotation_translation();
    (seen.world_from_base.transform_point3(seen.head.position), turn * seen.head.orientation)
}

/// A place in the world without the scale of what carries it: a giant's hands hold things as they are.
pub(super) fn rigid(world_from_hand: Affine3A) -> Affine3A {
    let (_, turn, place) = world_from_hand.to_scale_rotation_translation();
    Affine3A::from_rotation_translation(turn, place)
}

/// Finds out where hands are.
pub(super) fn place(time: Res<Time>, poses: Poses, mut hands: ResMut<Hands>) {
    let seen = poses.seen();
    let seconds = time.delta_secs();
    for hand in BOTH {
        let one = &mut hands.of[hand as usize];
        let before = one.pose.take();
        one.pose = seen.as_ref().map(|seen| found(seen, hand, before.as_ref(), seconds));
    }
}

fn found(seen: &Seen, hand: Hand, before: Option<&HandPose>, seconds: f32) -> HandPose {
    let (eye, look) = view(seen);
    let Some((grip, aim)) = seen.hands[hand as usize] else {
        let side = SIDE_M * if hand == Hand::Left { Vec3::new(-1.0, 1.0, 1.0) } else { Vec3::ONE };
        let world_from_hand = Affine3A::from_rotation_translation(look, eye + look * side);
        return HandPose {
            world_from_hand,
            aim: (eye, look * Vec3::NEG_Z),
            view: (eye, look),
            velocity_m_s: Vec3::ZERO,
            spin_rad_s: Vec3::ZERO,
            scheme: Scheme::View,
            in_window: seen.in_window,
            world_from_base: Affine3A::IDENTITY,
            base_from_hand: [world_from_hand; 2],
        };
    };
    let world_from_base = seen.world_from_base;
    let (scale, turn, _) = world_from_base.to_scale_rotation_translation();
    let now = affine(&grip);
    let before = before.filter(|before| before.scheme == Scheme::Tracked);
    let last = before.map_or(now, |before| before.base_from_hand[0]);
    let (mut velocity, mut spin) = before.map_or_else(Default::default, |before| (before.velocity_m_s, before.spin_rad_s));
    if seconds > 0.0 {
        let step = turn * (Vec3::from(now.translation - last.translation) * scale) / seconds;
        let (_, from, _) = last.to_scale_rotation_translation();
        let turned = turn * ((grip.orientation * from.inverse()).to_scaled_axis() / seconds);
        let newer = (seconds / SPEED_OVER_S).min(1.0);
        if step.length() < FASTEST_M_S {
            velocity = velocity.lerp(step, newer);
            spin = spin.lerp(turned, newer);
        }
    }
    HandPose {
        world_from_hand: rigid(world_from_base * now),
        aim: (world_from_base.transform_point3(aim.position), turn * (aim.orientation * Vec3::NEG_Z)),
        view: (eye, look),
        velocity_m_s: velocity,
        spin_rad_s: spin,
        scheme: Scheme::Tracked,
        in_window: false,
        world_from_base,
        base_from_hand: [now, last],
    }
}
