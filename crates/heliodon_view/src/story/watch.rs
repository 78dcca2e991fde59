//! What the visitor enters and looks at, and where everybody is.

use super::Story;
use crate::actors::Actors;
use crate::hands::pose::Poses;
use crate::hands::reach::Scene;
use crate::impostor::Impostors;
use crate::navigation::Visitor;
use crate::stage::Stage;
use bevy::prelude::*;
use heliodon_script::event::Event;
use std::collections::HashSet;

/// How long eyes rest on something before they look at it, seconds.
const REST_S: f32 = 0.4;
/// How far off something can be looked at, metres.
const SEEN_FROM_M: f32 = 30.0;

/// What the visitor is amid.
#[derive(Debug, Default)]
pub struct Seen {
    inside: HashSet<String>,
    /// What the eyes are on, and since when.
    on: Option<(String, f32)>,
    looked_at: Option<String>,
}

/// Looks where everybody is, and tells what is new.
pub fn watch(
    time: Res<Time>,
    stage: Res<Stage>,
    mut story: ResMut<Story>,
    (actors, impostors): (Res<Actors>, Res<Impostors>),
    visitors: Query<&Visitor>,
    poses: Poses,
) {
    let story = &mut *story;
    let (Some(play), Some(visitor), Some((eye, look))) = (&mut story.play, visitors.iter().next(), poses.view()) else {
        return;
    };
    // on the ground beneath the eyes, however tall a tracked visitor stands there
    let feet = Vec3::new(eye.x, visitor.pose.eye.y - visitor.eye_height_m, eye.z);
    play.world.set_visitor(feet.to_array());
    for region in &play.living.regions {
        let [low, high] = [region.min, region.max].map(|corner| Vec3::from(corner.map(|v| v as f32)));
        let holds = |point: Vec3| point.cmpge(low).all() && point.cmple(high).all();
        let (inside, was) = (holds(eye) || holds(feet), play.seen.inside.contains(&region.name));
        if inside == was {
            continue;
        }
        play.world.set_inside(&region.name, inside);
        let region = region.name.clone();
        if inside {
            play.seen.inside.insert(region.clone());
            story.pending.push(Event::Entered { region });
        } else {
            play.seen.inside.remove(&region);
            story.pending.push(Event::Left { region });
        }
    }
    for actor in play.bundle.actors() {
        let name = actor.display_name();
        if let Some((stands, _)) = actors.whereabouts(name).or_else(|| impostors.whereabouts(name, &actors)) {
            play.world.set_place(name, stands.translation.to_array());
        }
    }
    // what stands before something hides it
    let scene = Scene { stage: &stage, actors: &actors, impostors: &impostors };
    let seen_now = scene.cast(eye, look * Vec3::NEG_Z, SEEN_FROM_M, &[]).map(|met| met.name);
    let seen = &mut play.seen;
    seen.on = match (seen_now, seen.on.take()) {
        (None, _) => None,
        (Some(name), Some((known, since_s))) if known == name => Some((known, since_s + time.delta_secs())),
        (Some(name), _) => Some((name, 0.0)),
    };
    let rests_on = seen.on.as_ref().filter(|(_, since_s)| *since_s >= REST_S).map(|(name, _)| name.clone());
    // eyes that wander for a moment have not left it
    if rests_on == seen.looked_at || (rests_on.is_none() && seen.on.is_some()) {
        return;
    }
    story.pending.extend(seen.looked_at.take().map(|thing| Event::LookedAway { thing }));
    story.pending.extend(rests_on.clone().map(|thing| Event::LookedAt { thing }));
    seen.looked_at = rests_on;
}
