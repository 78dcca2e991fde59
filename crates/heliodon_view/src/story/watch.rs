//! What the visitor enters and looks at, and where everybody is.

use super::Story;
use crate::actors::Actors;
use crate::impostor::Impostors;
use crate::navigation::Visitor;
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
    mut story: ResMut<Story>,
    actors: Res<Actors>,
    impostors: Res<Impostors>,
    visitors: Query<&Visitor>,
) {
    let story = &mut *story;
    let (Some(play), Some(visitor)) = (&mut story.play, visitors.iter().next()) else { return };
    let eye = visitor.pose.eye;
    let feet = eye - Vec3::Y * visitor.eye_height_m;
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
    let (forward, mut nearest) = (visitor.pose.rotation() * Vec3::NEG_Z, (SEEN_FROM_M, None));
    for actor in play.bundle.actors() {
        let name = actor.display_name();
        let Some((stands, bounds)) = actors.whereabouts(name).or_else(|| impostors.whereabouts(name, &actors)) else {
            continue;
        };
        play.world.set_place(name, stands.translation.to_array());
        let hidden = actors.directions.get(name).is_some_and(|direction| direction.hidden);
        if let Some(far) = meets(eye, forward, bounds).filter(|far| !hidden && *far < nearest.0) {
            nearest = (far, Some(name));
        }
    }
    let seen = &mut play.seen;
    seen.on = match (nearest.1, seen.on.take()) {
        (None, _) => None,
        (Some(name), Some((known, since_s))) if known == name => Some((known, since_s + time.delta_secs())),
        (Some(name), _) => Some((name.to_owned(), 0.0)),
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

/// How far along a unit direction a box is met.
fn meets(from: Vec3, along: Vec3, (low, high): (Vec3, Vec3)) -> Option<f32> {
    let inverse = along.recip();
    let (a, b) = ((low - from) * inverse, (high - from) * inverse);
    let (near, far) = (a.min(b).max_element().max(0.0), a.max(b).min_element());
    (near <= far).then_some(near)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_is_met_where_it_begins() {
        let unit = (Vec3::ZERO, Vec3::ONE);
        assert_eq!(meets(Vec3::new(0.5, 0.5, 3.0), Vec3::NEG_Z, unit), Some(2.0));
        assert_eq!(meets(Vec3::splat(0.5), Vec3::NEG_Z, unit), Some(0.0));
        assert_eq!(meets(Vec3::new(0.5, 0.5, 3.0), Vec3::Z, unit), None);
        assert_eq!(meets(Vec3::new(1.5, 0.5, 3.0), Vec3::NEG_Z, unit), None);
    }
}
