//! What the visitor's hands point at, touch, take, carry, strike with and put on.
//!
//! A tracked hand (a wand, a headset's controller) is where it is: it touches what is within some centimetres, strikes by being swung, and points farther. Without one
//! the hand goes with the eyes: it points at what is in the middle of the view, what it holds is at the lower side of the view, and it swings when it is told to. Both end in
//! the same events, so that a story knows of no device. [`pose`] says where hands are, [`reach`] what they meet, `shape` how a thing lies in a hand, `carry` where it is then,
//! `act` does what visitors ask for, `wish` what scripts ask for, `strike` feels what tracked hands run into, `reticle` and `marker` show what is in reach.
//!
//! Hands move nothing that they do not hold: what they let go is in [`Hands::let_go`] for one frame, and [`crate::bodies`] take it from there.

mod act;
mod carry;
mod marker;
pub mod pose;
pub mod reach;
mod reticle;
mod shape;
mod strike;
#[cfg(test)]
mod tests;
mod wish;

pub use heliodon_script::action::Hand;

use crate::actors::Actors;
use crate::costs::FrameTold;
use crate::covering::Covering;
use crate::impostor::Impostors;
use crate::input::InputSet;
use crate::navigation::Travel;
use crate::stage::Stage;
use crate::story::{Story, StorySet};
use bevy::ecs::system::SystemParam;
use bevy::prelude::*;
use carry::{Held, Swing};
use glam::Affine3A;
use heliodon_bundle::site::Thing;
use heliodon_script::event::Event;
use pose::HandPose;
use reach::{Met, Scene};
use strike::Contact;

/// How far a hand reaches that points, metres: an arm and a step, so that whoever stands before a table need not walk round it, and not so far that
/// what somebody else stands at is taken.
pub const REACH_M: f32 = 2.5;

/// Both hands, in the order of [`Hand`]'s numbers.
pub const BOTH: [Hand; 2] = [Hand::Right, Hand::Left];

/// What a hand has let go of: it falls, or rests where it was put.
#[derive(Clone, Debug, PartialEq)]
pub struct LetGo {
    /// The thing.
    pub name: String,
    /// Where it is.
    pub world_from_model: Affine3A,
    /// How fast it goes, metres a second.
    pub velocity_m_s: Vec3,
    /// How fast it turns, about this axis, radians a second.
    pub spin_rad_s: Vec3,
}

/// The visitor's hands.
#[derive(Resource, Default)]
pub struct Hands {
    /// What was let go of in this frame. It is emptied when the next one begins, taken or not.
    pub let_go: Vec<LetGo>,
    /// What nothing else may move any more, since this frame: it was taken into a hand, or put back where it belongs. Emptied as [`Self::let_go`] is.
    pub taken_up: Vec<String>,
    stage: u64,
    /// Whether there is anything for hands to do in the bundle.
    alive: bool,
    of: [OneHand; 2],
}

/// One hand.
#[derive(Default)]
struct OneHand {
    pose: Option<HandPose>,
    /// What it touches or points at.
    met: Option<Met>,
    held: Option<Held>,
    swing: Option<Swing>,
    contact: Contact,
}

impl Hands {
    /// Where a hand is; none before there is a visitor.
    #[must_use]
    pub fn pose(&self, hand: Hand) -> Option<&HandPose> {
        self.of[hand as usize].pose.as_ref()
    }

    /// What a hand touches or points at, within its reach.
    #[must_use]
    pub fn met(&self, hand: Hand) -> Option<&Met> {
        self.of[hand as usize].met.as_ref()
    }

    /// What a hand holds.
    #[must_use]
    pub fn held(&self, hand: Hand) -> Option<&str> {
        self.of[hand as usize].held.as_ref().map(|held| held.name.as_str())
    }

    /// Which hand holds a thing.
    #[must_use]
    pub fn holder(&self, thing: &str) -> Option<Hand> {
        BOTH.into_iter().find(|hand| self.held(*hand) == Some(thing))
    }

    /// The names of what is held.
    fn in_hand(&self) -> Vec<String> {
        BOTH.iter().filter_map(|hand| self.held(*hand)).map(str::to_owned).collect()
    }

    /// A thing leaves the care of whatever else moves it.
    fn take_up(&mut self, name: &str) {
        self.let_go.retain(|let_go| let_go.name != name);
        self.taken_up.push(name.to_owned());
    }

    /// A thing comes into the care of what lets it fall.
    fn release(&mut self, let_go: LetGo) {
        self.taken_up.retain(|name| *name != let_go.name);
        self.let_go.push(let_go);
    }
}

/// What hands have to do with.
#[derive(SystemParam)]
struct Site<'w> {
    stage: Res<'w, Stage>,
    actors: ResMut<'w, Actors>,
    impostors: Res<'w, Impostors>,
    story: ResMut<'w, Story>,
    covering: Option<ResMut<'w, Covering>>,
}

impl Site<'_> {
    /// What can be met.
    fn scene(&self) -> Scene<'_> {
        Scene { stage: &self.stage, actors: &self.actors, impostors: &self.impostors }
    }

    /// The thing of a name.
    fn thing(&self, name: &str) -> Option<Thing> {
        self.scene().actor(name)?.thing.clone()
    }

    fn is_hidden(&self, name: &str) -> bool {
        self.actors.directions.get(name).is_some_and(|direction| direction.hidden)
    }

    /// Puts a thing somewhere.
    fn put(&mut self, name: &str, world_from_model: Affine3A) {
        self.actors.directions.entry(name.to_owned()).or_default().world_from_model = Some(world_from_model);
    }

    /// Tells scripts of something that was done at a place: a material that comes of it spreads from there.
    fn tell_at(&mut self, event: Event, place: Vec3) {
        if let (Event::Applied { target, .. }, Some(covering)) = (&event, &mut self.covering) {
            covering.begin_at(target, place);
        }
        self.tell(event);
    }

    /// Tells scripts of something.
    fn tell(&mut self, event: Event) {
        self.story.tell(event);
    }
}

/// When hands do what they do, in `Update`: after scripts have said what they wish, before bodies fall.
#[derive(SystemSet, Clone, Debug, PartialEq, Eq, Hash)]
pub struct HandsSet;

/// Gives the visitor hands.
#[derive(Default)]
pub struct HandsPlugin;

impl Plugin for HandsPlugin {
    fn build(&self, app: &mut App) {
        let told = FrameTold::in_app(app);
        app.init_resource::<Hands>()
            .add_systems(Startup, (reticle::spawn, marker::spawn))
            .add_systems(PreUpdate, act::divert.after(InputSet))
            .add_systems(
                Update,
                (
                    begin,
                    told.of("hands", pose::place),
                    told.of("hands", wish::obey),
                    told.of("hands", reach::look_for),
                    told.of("hands", act::act),
                    told.of("hands", carry::carry),
                    told.of("hands", strike::feel),
                    (told.of("hands", reticle::show), told.of("hands", marker::show)),
                )
                    .chain()
                    .in_set(HandsSet)
                    .after(Travel)
                    .after(StorySet),
            );
    }
}

/// A frame begins, perhaps in another bundle.
fn begin(stage: Res<Stage>, mut hands: ResMut<Hands>) {
    let hands = &mut *hands;
    if hands.stage != stage.serial() {
        *hands = Hands { stage: stage.serial(), ..Hands::default() };
        let bundle = stage.bundle();
        hands.alive = bundle
            .is_some_and(|bundle| bundle.living().story.is_some() || bundle.actors().iter().any(|actor| actor.thing.is_some()));
    }
    hands.let_go.clear();
    hands.taken_up.clear();
}
