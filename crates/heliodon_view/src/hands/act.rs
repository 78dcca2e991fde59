//! What visitors do with their hands, and what it comes to.

use super::carry::{Swing, grab, put_down};
use super::pose::Scheme;
use super::reach::{Met, What};
use super::{BOTH, Hand, Hands, Site};
use crate::input::{Action, Actions, WandInput};
use crate::navigation::MouseLook;
use crate::story::Story;
use bevy::prelude::*;
use heliodon_bundle::site::Thing;
use heliodon_script::event::Event;

/// How fast a blow is that a key sets off, metres a second: a mason's, from the elbow.
pub(super) const BLOW_M_S: f32 = 3.0;
/// What scripts are told in place of a tool that is none.
const BY_HAND: &str = "hand";
/// The wand's buttons that are the hand's while there is something for it.
const WAND_USES: u32 = 0b01;
const WAND_TAKES: u32 = 0b10;

/// What a press is for depends on what is before the hand: a click while the mouse looks around, and the wand's first button while it touches or points at something, use;
/// its second takes. Devices with few buttons need no others for that.
pub(super) fn divert(
    hands: Res<Hands>,
    story: Res<Story>,
    mouse: Option<Res<MouseLook>>,
    wand: Res<WandInput>,
    mut before: Local<u32>,
    mut actions: ResMut<Actions>,
) {
    let pressed = wand.buttons & !std::mem::replace(&mut *before, wand.buttons);
    if !hands.alive {
        return;
    }
    if mouse.is_some_and(|mouse| mouse.captured) {
        actions.divert(Action::TakeMouse, Action::Use);
    }
    let right = &hands.of[Hand::Right as usize];
    let tracked = right.pose.as_ref().is_some_and(|pose| pose.scheme == Scheme::Tracked);
    let held = right.held.as_ref().map(|held| (held.name.as_str(), &held.thing));
    let is_for = |met: &Met| met.what != What::Part || !offers(&story, met, held, None).is_empty();
    if tracked && (held.is_some() || right.met.as_ref().is_some_and(is_for)) {
        if pressed & WAND_USES != 0 {
            actions.divert(Action::Play, Action::Use);
        }
        if pressed & WAND_TAKES != 0 {
            actions.divert(Action::Gait, Action::Take);
        }
    }
}

/// What can be done with what is before a hand, and what that is called. `taken` is what it is as a thing, where it is one.
pub(super) fn offers(story: &Story, met: &Met, held: Option<(&str, &Thing)>, taken: Option<&Thing>) -> Vec<(Action, String)> {
    let mut offers = Vec::new();
    if taken.is_some_and(|thing| thing.carried) {
        offers.push((Action::Take, "takes it".to_owned()));
    }
    let (target, hand) = (met.name.clone(), Hand::Right);
    match held {
        Some((name, thing)) if thing.tool || thing.brings.is_some() => {
            let struck =
                Event::Struck { target: target.clone(), tool: name.to_owned(), speed: BLOW_M_S, place: met.place.to_array() };
            if thing.tool && story.waits_for(&struck) {
                offers.push((Action::Use, format!("strikes it with the {}", story.called(name))));
            }
            if let Some(material) = thing.brings.clone() {
                let by = by(name, thing);
                if story.waits_for(&Event::Applied { target, material: material.clone(), tool: by }) {
                    offers.push((Action::Use, format!("puts {} on it", story.called(&material))));
                }
            }
        }
        _ if story.waits_for(&Event::Touched { thing: target, hand }) => {
            offers.push((Action::Touch, "touches it".to_owned()));
        }
        _ => {}
    }
    offers
}

/// What brings a material: the tool, or the hand that holds what is none.
fn by(name: &str, thing: &Thing) -> String {
    if thing.tool { name.to_owned() } else { BY_HAND.to_owned() }
}

/// Does what visitors ask for.
pub(super) fn act(actions: Res<Actions>, mut site: Site, mut hands: ResMut<Hands>) {
    if !hands.alive {
        return;
    }
    let hands = &mut *hands;
    for hand in BOTH {
        let takes = if hand == Hand::Left { Action::TakeLeft } else { Action::Take };
        if actions.begins(takes) {
            take(hands, &mut site, hand);
        }
    }
    if actions.begins(Action::Use) {
        use_held(hands, &mut site, Hand::Right);
    }
    if actions.begins(Action::Touch) {
        touch(hands, &mut site, Hand::Right);
    }
}

/// Takes what is before the hand; else puts down what it holds; else touches.
fn take(hands: &mut Hands, site: &mut Site<'_>, hand: Hand) {
    let met = hands.met(hand).cloned();
    let carried = met.as_ref().filter(|met| site.thing(&met.name).is_some_and(|thing| thing.carried));
    if let Some(met) = carried {
        if grab(hands, site, hand, &met.name) {
            site.tell(Event::Grabbed { thing: met.name.clone(), hand });
        }
    } else if hands.held(hand).is_some() {
        put_down(hands, site, hand, met.as_ref());
    } else {
        touch(hands, site, hand);
    }
}

/// Strikes, or puts on what is brought; with anything else in hand, or nothing, touches.
fn use_held(hands: &mut Hands, site: &mut Site<'_>, hand: Hand) {
    let one = &mut hands.of[hand as usize];
    let works = one.held.as_ref().filter(|held| held.thing.tool || held.thing.brings.is_some());
    let tracked = one.pose.as_ref().is_some_and(|pose| pose.scheme == Scheme::Tracked);
    match (works, tracked) {
        (Some(_), false) => drop(one.swing.get_or_insert_with(Swing::default)),
        (Some(held), true) if held.thing.brings.is_some() => {
            // what a tracked hand holds strikes where it is swung
            let applied = one.met.as_ref().and_then(|met| applied(&held.name, &held.thing, met));
            applied.into_iter().for_each(|event| site.tell(event));
        }
        _ => touch(hands, site, hand),
    }
}

fn touch(hands: &mut Hands, site: &mut Site<'_>, hand: Hand) {
    if let Some(met) = hands.met(hand) {
        site.tell(Event::Touched { thing: met.name.clone(), hand });
    }
}

/// What comes of a blow that a key has set off.
pub(super) fn land(site: &mut Site<'_>, (name, thing): (&str, &Thing), met: &Met) {
    if thing.tool {
        site.tell(struck(name, met, BLOW_M_S));
    }
    applied(name, thing, met).into_iter().for_each(|event| site.tell(event));
}

/// A tool has struck something.
pub(super) fn struck(tool: &str, met: &Met, speed: f32) -> Event {
    Event::Struck { target: met.name.clone(), tool: tool.to_owned(), speed, place: met.place.to_array() }
}

/// What a thing brings was brought onto something, where it brings anything.
pub(super) fn applied(name: &str, thing: &Thing, met: &Met) -> Option<Event> {
    let material = thing.brings.clone()?;
    Some(Event::Applied { target: met.name.clone(), material, tool: by(name, thing) })
}
