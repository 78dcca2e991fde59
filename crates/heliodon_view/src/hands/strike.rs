//! What tracked hands run into: what they touch, and what they strike or cover with what they hold.
//!
//! From frame to frame a hand goes farther than a wall is thick, so its way is followed by rays rather than its place asked. The way is the hand's own: whoever is carried
//! through the site, or turned on the spot, strikes nothing.

use super::act::{applied, struck};
use super::carry::Held;
use super::pose::{FASTEST_M_S, HandPose, Scheme, rigid};
use super::reach::{Met, Scene, TOUCH_M};
use super::{BOTH, Hands, Site};
use bevy::prelude::*;
use heliodon_script::event::Event;

/// Slower than this a tool touches rather than strikes, metres a second.
const STRIKES_FROM_M_S: f32 = 0.8;
/// What a tool struck is not struck again while the tool is so near to it, metres, and for so long, seconds: it goes through and comes back.
const RESTS_WITHIN_M: f32 = 0.04;
const RESTS_S: f32 = 0.25;
/// What brings a material is on what is so near to it, metres, and covers it after so many seconds.
const COVERS_WITHIN_M: f32 = 0.03;
const COVERS_IN_S: f32 = 0.3;
/// A touch ends farther away than it begins, so that a trembling hand does not touch again and again.
const LEAVES_M: f32 = 1.5 * TOUCH_M;

/// What a hand, or what it holds, is at.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Contact {
    /// What the bare hand touches.
    touches: Option<String>,
    /// What a tool struck last, and how long ago.
    struck: Option<(String, f32)>,
    /// What it is on, for how long, and whether that was covered.
    on: Option<(String, f32, bool)>,
}

/// Feels what tracked hands run into.
pub(super) fn feel(time: Res<Time>, mut site: Site, mut hands: ResMut<Hands>) {
    let seconds = time.delta_secs();
    if !hands.alive || seconds <= 0.0 {
        return;
    }
    let without = hands.in_hand();
    for hand in BOTH {
        let one = &mut hands.of[hand as usize];
        let Some(pose) = one.pose.as_ref().filter(|pose| pose.scheme == Scheme::Tracked) else {
            one.contact = Contact::default();
            continue;
        };
        let scene = site.scene();
        let mut told = Vec::new();
        match &one.held {
            Some(held) if held.arrived() => {
                one.contact.touches = None;
                told.extend(one.contact.with(held, pose, scene, &without, seconds));
            }
            Some(_) => one.contact.touches = None,
            None => {
                let touches = one.contact.bare(pose, scene, &without, one.met.as_ref(), seconds);
                told.extend(touches.map(|thing| Event::Touched { thing, hand }));
            }
        }
        told.into_iter().for_each(|event| site.tell(event));
    }
}

/// What is met on a straight way, and how long that is; nothing on one that no hand goes in so short a time.
fn on_the_way(scene: Scene<'_>, from: Vec3, to: Vec3, without: &[String], seconds: f32) -> Option<(Met, f32)> {
    let length = from.distance(to);
    let along = (to - from).try_normalize().filter(|_| length < FASTEST_M_S * seconds)?;
    scene.cast(from, along, length, without).map(|met| (met, length))
}

impl Contact {
    /// What a bare hand begins to touch: what it is at, or what it has gone through since the last frame.
    fn bare(
        &mut self,
        pose: &HandPose,
        scene: Scene<'_>,
        without: &[String],
        met: Option<&Met>,
        seconds: f32,
    ) -> Option<String> {
        let [now, before] = pose.base_from_hand.map(|hand| Vec3::from((pose.world_from_base * hand).translation));
        let through = || on_the_way(scene, before, now, without, seconds).map(|(met, _)| met.name);
        let at = met.filter(|met| met.touched).map(|met| met.name.clone()).or_else(through);
        if at.is_none() {
            let near = self.touches.is_some().then(|| scene.nearest(now, LEAVES_M, without)).flatten();
            self.touches.take_if(|touched| near.is_none_or(|near| near.name != *touched));
            return None;
        }
        let begins = at != self.touches;
        self.touches.clone_from(&at);
        at.filter(|_| begins)
    }

    /// What comes of what is held being where it is now.
    fn with(
        &mut self,
        held: &Held,
        pose: &HandPose,
        scene: Scene<'_>,
        without: &[String],
        seconds: f32,
    ) -> impl Iterator<Item = Event> + use<> {
        let [now, before] = pose.base_from_hand.map(|hand| rigid(pose.world_from_base * hand) * held.in_hand());
        let ways = held.shape.edges.iter().map(|&edge| (before.transform_point3(edge), now.transform_point3(edge)));
        let mut blow: Option<(Met, f32)> = None;
        for (from, to) in ways.filter(|(from, to)| held.thing.tool && from.distance(*to) >= STRIKES_FROM_M_S * seconds) {
            let met = on_the_way(scene, from, to, without, seconds);
            // the first that any point of it meets
            let sooner = |(met, length): &(Met, f32)| met.distance / length;
            blow = match (blow, met) {
                (Some(a), Some(b)) => Some(if sooner(&b) < sooner(&a) { b } else { a }),
                (a, b) => a.or(b),
            };
        }
        let near = |reach| {
            let met = |&edge: &Vec3| scene.nearest(now.transform_point3(edge), reach, without);
            held.shape.edges.iter().filter_map(met).min_by(|a, b| a.distance.total_cmp(&b.distance))
        };
        if let Some((name, since_s)) = &mut self.struck {
            *since_s += seconds;
            let rests = *since_s < RESTS_S || near(RESTS_WITHIN_M).is_some_and(|met| met.name == *name);
            self.struck.take_if(|_| !rests);
        }
        let blow = blow.filter(|(met, _)| self.struck.as_ref().is_none_or(|(name, _)| *name != met.name));
        let blow = blow.map(|(met, length)| {
            self.struck = Some((met.name.clone(), 0.0));
            struck(&held.name, &met, length / seconds)
        });
        let on = held.thing.brings.as_ref().and_then(|_| near(COVERS_WITHIN_M));
        let (since_s, covered) = match (&self.on, &on) {
            (Some((name, since_s, covered)), Some(met)) if *name == met.name => (since_s + seconds, *covered),
            _ => (0.0, false),
        };
        let covers = !covered && since_s >= COVERS_IN_S;
        let cover = on.as_ref().filter(|_| covers).and_then(|met| applied(&held.name, &held.thing, met));
        self.on = on.map(|met| (met.name, since_s, covered || covers));
        blow.into_iter().chain(cover)
    }
}
