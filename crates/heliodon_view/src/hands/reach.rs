//! What a ray or a hand meets: things and somebody by their triangles, the stone by its parts.

use super::pose::Scheme;
use super::{BOTH, Hands, REACH_M, Site};
use crate::actors::Actors;
use crate::actors::solid::enters;
use crate::impostor::Impostors;
use crate::stage::Stage;
use bevy::prelude::*;
use heliodon_bundle::site::Actor;

/// A hand touches what is so near to the middle of its grip, metres: half a fist, and what trackers are off by.
pub(super) const TOUCH_M: f32 = 0.07;

/// What something met is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum What {
    /// An actor that can be touched and perhaps taken.
    Thing,
    /// Somebody.
    Actor,
    /// A part of the stone.
    Part,
}

/// What was met, and where.
#[derive(Clone, Debug, PartialEq)]
pub struct Met {
    /// Its name, as scripts know it.
    pub name: String,
    /// What it is.
    pub what: What,
    /// How far away, metres.
    pub distance: f32,
    /// Where, in the world.
    pub place: Vec3,
    /// Unit normal there, to whoever comes.
    pub normal: Vec3,
    /// Whether a hand touches it rather than points at it.
    pub touched: bool,
}

/// What can be met.
#[derive(Clone, Copy)]
pub struct Scene<'a> {
    /// The stone.
    pub stage: &'a Stage,
    /// Things and models.
    pub actors: &'a Actors,
    /// Crowds.
    pub impostors: &'a Impostors,
}

impl<'a> Scene<'a> {
    /// The actor of a name.
    #[must_use]
    pub fn actor(self, name: &str) -> Option<&'a Actor> {
        self.stage.bundle()?.actors().iter().find(|actor| actor.display_name() == name)
    }

    /// Everybody who is shown and not left out, with the box around them.
    fn shown(self, without: &'a [String]) -> impl Iterator<Item = (&'a Actor, (Vec3, Vec3))> {
        let actors = self.stage.bundle().map_or(&[][..], |bundle| bundle.actors());
        actors.iter().filter_map(move |actor| {
            let name = actor.display_name();
            let hidden = self.actors.directions.get(name).is_some_and(|direction| direction.hidden);
            if hidden || without.iter().any(|other| other == name) {
                return None;
            }
            // a crowd is long to look through: only who is in one is looked for there
            let stands = match actor.is_impostor() {
                true => self.impostors.whereabouts(name, self.actors),
                false => self.actors.whereabouts(name),
            };
            stands.map(|(_, bounds)| (actor, bounds))
        })
    }

    /// The first that a ray with a unit direction meets within `reach`, but for some.
    #[must_use]
    pub fn cast(self, origin: Vec3, direction: Vec3, reach: f32, without: &[String]) -> Option<Met> {
        let place = |distance: f32| origin + direction * distance;
        let mut met = self.stage.ground().cast(origin, direction, reach).map(|touch| Met {
            name: self.part(touch.chunk),
            what: What::Part,
            distance: touch.distance,
            place: place(touch.distance),
            normal: touch.normal,
            touched: false,
        });
        // where there is no triangle, as of an impostor, the box counts
        for (actor, bounds) in Scene::shown(self, without) {
            let reach = met.as_ref().map_or(reach, |met| met.distance);
            let Some(box_met) = enters(origin, direction, bounds).filter(|(far, _)| *far < reach) else { continue };
            let hit = match self.actors.solid(actor.display_name()) {
                Some(solid) => solid.cast(origin, direction, reach),
                None => Some(box_met),
            };
            if let Some((distance, normal)) = hit {
                let (name, what) = (actor.display_name().to_owned(), what(actor));
                met = Some(Met { name, what, distance, place: place(distance), normal, touched: false });
            }
        }
        met.filter(|met| !met.name.is_empty())
    }

    /// What is nearest to a place, within `reach`, but for some.
    #[must_use]
    pub fn nearest(self, from: Vec3, reach: f32, without: &[String]) -> Option<Met> {
        let part = self.stage.ground().nearest(from, reach).map(|touch| Met {
            name: self.part(touch.chunk),
            what: What::Part,
            distance: touch.distance,
            place: from - touch.normal * touch.distance,
            normal: touch.normal,
            touched: true,
        });
        let nearer = part.as_ref().map_or(reach, |part| part.distance);
        self.nearest_actor(from, nearer, without).or(part).filter(|met| !met.name.is_empty())
    }

    /// Who or which thing is nearest to a place, within `reach`, but for some.
    fn nearest_actor(self, from: Vec3, reach: f32, without: &[String]) -> Option<Met> {
        let mut met: Option<Met> = None;
        for (actor, (low, high)) in Scene::shown(self, without) {
            let reach = met.as_ref().map_or(reach, |met| met.distance);
            let on_box = from.clamp(low, high);
            let far = from.distance(on_box);
            if far >= reach {
                continue;
            }
            let hit = match self.actors.solid(actor.display_name()) {
                Some(solid) => solid.nearest(from, reach),
                None => Some((far, on_box)),
            };
            if let Some((distance, place)) = hit {
                let (name, what) = (actor.display_name().to_owned(), what(actor));
                let normal = (from - place).try_normalize().unwrap_or(Vec3::Y);
                met = Some(Met { name, what, distance, place, normal, touched: true });
            }
        }
        met
    }

    /// The name of the part that a chunk is of.
    fn part(self, chunk: usize) -> String {
        let name = self.stage.bundle().filter(|bundle| chunk < bundle.chunk_count()).and_then(|bundle| {
            let part = usize::from(bundle.chunk_info(chunk).part);
            bundle.manifest().parts.get(part).map(|part| part.name.clone())
        });
        name.unwrap_or_default()
    }
}

fn what(actor: &Actor) -> What {
    if actor.thing.is_some() { What::Thing } else { What::Actor }
}

/// Finds out what hands touch or point at.
pub(super) fn look_for(site: Site, mut hands: ResMut<Hands>) {
    if !hands.alive {
        return;
    }
    let without = hands.in_hand();
    let scene = site.scene();
    for hand in BOTH {
        let one = &mut hands.of[hand as usize];
        one.met = one.pose.as_ref().and_then(|pose| {
            let at = Vec3::from(pose.world_from_hand.translation);
            // what lies on a table is meant, not the table
            let touch = || scene.nearest_actor(at, TOUCH_M, &without).or_else(|| scene.nearest(at, TOUCH_M, &without));
            let touched = (pose.scheme == Scheme::Tracked).then(touch).flatten();
            touched.or_else(|| scene.cast(pose.aim.0, pose.aim.1, REACH_M, &without))
        });
    }
}
