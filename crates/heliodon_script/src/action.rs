//! What scripts ask for: the host carries it out in its own way, or leaves it.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// How a movement begins and ends.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Easing {
    /// Slowly at first and at last.
    #[default]
    Smooth,
    /// At one speed.
    Even,
    /// Slowly at first: what falls or is pushed.
    Start,
    /// Slowly at last: what comes to rest.
    End,
}

impl Easing {
    pub(crate) const WORDS: &'static [&'static str] = &["smooth", "even", "start", "end"];

    pub(crate) fn from_word(word: &str) -> Self {
        match word {
            "even" => Self::Even,
            "start" => Self::Start,
            "end" => Self::End,
            _ => Self::Smooth,
        }
    }

    /// How far along a movement is, from 0 to 1, when `t` of its time is over, from 0 to 1; what is beyond is held.
    #[must_use]
    pub fn at(self, t: f32) -> f32 {
        let t = t.clamp(0.0, 1.0);
        match self {
            Self::Even => t,
            Self::Start => t * t,
            Self::End => t * (2.0 - t),
            Self::Smooth => t * t * (3.0 - 2.0 * t),
        }
    }
}

/// A hand of the visitor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Hand {
    /// The right, or the only one.
    #[default]
    Right,
    /// The left.
    Left,
}

impl Hand {
    pub(crate) const WORDS: &'static [&'static str] = &["right", "left"];

    pub(crate) fn from_word(word: &str) -> Self {
        if word == "left" { Self::Left } else { Self::Right }
    }

    /// `right` or `left`.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::Right => "right",
            Self::Left => "left",
        }
    }
}

/// Values that are put into a text, by their names: `{n}` in "{n} blows are left".
pub type Filling = BTreeMap<String, String>;

/// One thing that a script asks for. Places are of the world, metres; seconds of 0 mean at once; names are as the site has them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "do", rename_all = "kebab-case")]
#[expect(missing_docs, reason = "fields are what their names say, units in them; each is told of in the manual")]
pub enum Action {
    /// Moves a thing or an actor; an [`Event::Arrived`](crate::event::Event::Arrived) is expected at the end.
    Move { what: String, to: [f32; 3], seconds: f32, easing: Easing },
    /// Turns it about the vertical, by so many degrees, to the left as seen from above.
    Turn { what: String, degrees: f32, seconds: f32, easing: Easing },
    /// Shows it.
    Show { what: String },
    /// Hides it; it can be neither seen nor touched.
    Hide { what: String },
    /// Makes it more or less transparent: 1 is solid, 0 not there.
    Fade { what: String, opacity: f32, seconds: f32 },
    /// Marks it as what is meant, or no longer.
    Highlight { what: String, on: bool },
    /// Plays an animation, once or until it is stopped.
    Animate { what: String, animation: String, repeat: bool },
    /// Stops its animation.
    StopAnimation { what: String },
    /// Lets an actor walk to a place; arrival is told.
    Walk { actor: String, to: [f32; 3] },
    /// Lets an actor walk along a path; arrival is told.
    Follow { actor: String, path: String },
    /// Plays a film from its beginning; its end is told.
    PlayFilm { film: String },
    /// Stops a film.
    StopFilm { film: String },
    /// Plays a sound, from a place or everywhere; its end is told.
    PlaySound { sound: String, at: Option<[f32; 3]>, volume: f32 },
    /// Stops a sound.
    StopSound { sound: String },
    /// Lights a fire, lets dust rise.
    StartParticles { particles: String },
    /// Lets it go out.
    StopParticles { particles: String },
    /// Changes a lamp: 1 is as the site has it, 0 out.
    Light { light: String, brightness: f32, seconds: f32 },
    /// Covers a part or a thing with a material.
    Material { target: String, material: String, seconds: f32 },
    /// Takes it off again.
    Bare { target: String, seconds: f32 },
    /// Puts a thing into a hand of the visitor.
    Give { thing: String, hand: Hand },
    /// Takes it out of the visitor's hand and puts it back where it belongs.
    Take { thing: String },
    /// Lets it fall out of the visitor's hand.
    Drop { thing: String },
    /// Sets the hour of the day, in seconds since midnight, at once or by a time lapse.
    SetHour { hour_s: f32, seconds: f32 },
    /// How many seconds of the day pass in one second: 0 stands still, 1 is as in life.
    Pace { factor: f32 },
    /// Makes the picture brighter or darker, in stops, beside what the sky asks for.
    Exposure { stops: f32, seconds: f32 },
    /// Says something, in the visitor's language.
    Subtitle { text: String, seconds: f32, values: Filling },
    /// What to do next; it stands until there is another.
    Task { text: String, values: Filling },
    /// There is nothing to do at the moment.
    NoTask,
    /// How to do it, for a while.
    Hint { text: String, seconds: f32, values: Filling },
    /// Shows the visitor a path on the ground.
    Guide { path: String },
    /// Shows none.
    NoGuide,
    /// Takes the visitor to a view.
    GoTo { view: String, seconds: f32 },
    /// Darkens the whole picture: 0 is clear, 1 black.
    FadeScreen { darkness: f32, seconds: f32 },
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn movements_begin_and_end_where_they_should() {
        for word in Easing::WORDS {
            let easing = Easing::from_word(word);
            assert_eq!((easing.at(-1.0), easing.at(0.0), easing.at(1.0), easing.at(9.0)), (0.0, 0.0, 1.0, 1.0), "{word}");
            assert!((0..100).all(|i| easing.at(i as f32 / 100.0) < easing.at((i + 1) as f32 / 100.0)), "{word} goes back");
        }
    }

    #[test]
    fn actions_are_written_for_other_programs() {
        let action = Action::Give { thing: "mallet".into(), hand: Hand::Left };
        let text = serde_json::to_string(&action).unwrap();
        assert_eq!(text, r#"{"do":"give","thing":"mallet","hand":"left"}"#);
        assert_eq!(serde_json::from_str::<Action>(&text).unwrap(), action);
    }
}
