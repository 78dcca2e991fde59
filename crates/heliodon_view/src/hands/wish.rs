//! What scripts ask for: things that they put into hands, take out of them, let fall. They are not told of what they did themselves.

use super::carry::{drop_held, empty, grab};
use super::{BOTH, Hands, Site};
use crate::story::Wishes;
use bevy::prelude::*;
use heliodon_script::action::Action;

/// Does what scripts ask for, once everything is there; and what they have hidden is in no hand any more.
pub(super) fn obey(mut wishes: ResMut<Wishes>, mut site: Site, mut hands: ResMut<Hands>) {
    let hands = &mut *hands;
    for hand in BOTH {
        if let Some(name) = hands.held(hand).filter(|name| site.is_hidden(name)).map(str::to_owned) {
            empty(hands, &mut site, hand);
            put_back(hands, &mut site, &name);
        }
    }
    // a thing that is still being read can be in no hand yet
    if wishes.hands.is_empty() || !site.actors.is_complete() || !site.impostors.is_complete() {
        return;
    }
    for wish in std::mem::take(&mut wishes.hands) {
        match wish {
            Action::Give { thing, hand } => {
                if !grab(hands, &mut site, hand, &thing) {
                    warn_once!("nothing called {thing} can be put into a hand");
                    continue;
                }
                if let Some(direction) = site.actors.directions.get_mut(&thing) {
                    direction.hidden = false;
                }
                site.story.set_shown(&thing, true);
            }
            Action::Take { thing } => {
                hands.holder(&thing).map(|hand| empty(hands, &mut site, hand));
                put_back(hands, &mut site, &thing);
            }
            Action::Drop { thing } => {
                if let Some(hand) = hands.holder(&thing) {
                    drop_held(hands, &mut site, hand, false);
                }
            }
            other => warn_once!("hands cannot do this: {other:?}"),
        }
    }
}

/// Puts a thing back where it belongs.
fn put_back(hands: &mut Hands, site: &mut Site<'_>, name: &str) {
    site.story.stop_moving(name);
    if let Some(direction) = site.actors.directions.get_mut(name) {
        direction.world_from_model = None;
    }
    hands.take_up(name);
}
