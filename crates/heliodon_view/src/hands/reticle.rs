//! What shows what is before the hand: a ring in the middle of the view, its name, and the keys that do something with it.

use super::act::offers;
use super::pose::Scheme;
use super::reach::What;
use super::{Hand, Hands, Site};
use crate::hud::{HudVisibility, INK, PANEL};
use crate::input::{Action, Input, Trigger};
use crate::story::Lettered;
use bevy::prelude::*;

/// The ring's diameter, pixels.
const RING_PX: f32 = 14.0;
/// How far below it the name stands.
const BELOW_PX: f32 = 26.0;

/// The ring.
#[derive(Component)]
pub(super) struct Ring;
/// What is said of it.
#[derive(Component)]
pub(super) struct Label;

pub(super) fn spawn(mut commands: Commands) {
    let middle = Node {
        position_type: PositionType::Absolute,
        width: percent(100),
        height: percent(100),
        align_items: AlignItems::Center,
        justify_content: JustifyContent::Center,
        ..default()
    };
    // over text that is as large as a small window
    let over = GlobalZIndex(1);
    commands.spawn((middle.clone(), over)).with_children(|parent| {
        let ring = Node {
            width: px(RING_PX),
            height: px(RING_PX),
            border: UiRect::all(px(2)),
            border_radius: BorderRadius::MAX,
            ..default()
        };
        // dark within, so that it is seen on what is bright
        parent.spawn((Ring, Visibility::Hidden, ring, BorderColor::all(INK), BackgroundColor(PANEL.with_alpha(0.35))));
    });
    commands.spawn((middle, over)).with_children(|parent| {
        let node = Node {
            top: px(BELOW_PX),
            padding: UiRect::axes(px(10), px(4)),
            border_radius: BorderRadius::all(px(6)),
            ..default()
        };
        let text = (Text::default(), TextFont::from_font_size(15.0), TextColor(INK), Lettered);
        parent.spawn((Label, Visibility::Hidden, node, BackgroundColor(PANEL), text));
    });
}

/// A text that is seen or not.
type Written = (&'static mut Text, &'static mut Visibility);

/// What sets an action off, as it is said on screen: a key, and the controller's button where there is one.
fn keys(input: &Input, action: Action) -> String {
    let triggers = || input.bindings.triggers(action).iter();
    let key = triggers().find(|trigger| trigger.is_of_desk());
    let button = triggers().find(|trigger| matches!(trigger, Trigger::Pad(_)) && input.has_pad);
    let labels: Vec<String> = key.into_iter().chain(button).map(Trigger::label).collect();
    labels.join(" or ")
}

/// Shows what is before the right hand, where that points with the eyes.
pub(super) fn show(
    site: Site,
    hands: Res<Hands>,
    input: Option<Res<Input>>,
    hud: Option<Res<HudVisibility>>,
    mut rings: Query<&mut Visibility, (With<Ring>, Without<Label>)>,
    mut labels: Query<Written, (With<Label>, Without<Ring>)>,
) {
    let said = input.filter(|_| hud.is_none_or(|hud| hud.shown)).and_then(|input| said(&site, &hands, &input));
    let seen = |is_seen: bool| if is_seen { Visibility::Inherited } else { Visibility::Hidden };
    rings.iter_mut().for_each(|mut ring| {
        ring.set_if_neq(seen(said.is_some()));
    });
    for (mut text, mut visibility) in &mut labels {
        visibility.set_if_neq(seen(said.is_some()));
        if let Some(said) = said.as_ref().filter(|said| text.0 != **said) {
            text.0.clone_from(said);
        }
    }
}

/// What there is to say of what is before the hand; nothing where nothing can be done.
fn said(site: &Site<'_>, hands: &Hands, input: &Input) -> Option<String> {
    let right = &hands.of[Hand::Right as usize];
    let met = right.met.as_ref()?;
    if !hands.alive || right.pose.as_ref().is_none_or(|pose| pose.scheme == Scheme::Tracked || !pose.in_window) {
        return None;
    }
    let held = right.held.as_ref().map(|held| (held.name.as_str(), &held.thing));
    let thing = site.thing(&met.name);
    let offers = offers(&site.story, met, held, thing.as_ref());
    let can = |(action, does): &(Action, String)| {
        let keys = keys(input, *action);
        (!keys.is_empty()).then(|| format!("{keys} {does}"))
    };
    let can: Vec<String> = offers.iter().filter_map(can).collect();
    match (can.is_empty(), met.what) {
        (false, _) => Some(format!("{}: {}", site.story.called(&met.name), can.join(", "))),
        (true, What::Thing) => Some(site.story.called(&met.name)),
        (true, _) => None,
    }
}
