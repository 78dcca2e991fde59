//! What happens: the host tells it, scripts hear of it.

use crate::action::Hand;
use crate::value::Value;
use serde::{Deserialize, Serialize};

/// Something that has happened on the site. Hours, timers and messages between scripts are found by the runtime itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "event", rename_all = "kebab-case")]
#[expect(missing_docs, reason = "fields are the names of what it happened to")]
pub enum Event {
    /// The visitor has entered a region.
    Entered { region: String },
    /// The visitor has left it.
    Left { region: String },
    /// The visitor's eyes have come to rest on a thing, part or actor.
    LookedAt { thing: String },
    /// They have left it.
    LookedAway { thing: String },
    /// A hand has touched it.
    Touched { thing: String, hand: Hand },
    /// A hand has taken it.
    Grabbed { thing: String, hand: Hand },
    /// A hand has let it go, there.
    Released { thing: String, hand: Hand, place: [f32; 3] },
    /// A tool has struck a thing or part, so fast (metres a second), there.
    Struck { target: String, tool: String, speed: f32, place: [f32; 3] },
    /// A thing that nobody holds has hit another or an actor, or the ground or a wall (an empty name), so fast (metres a second), there.
    Hit { thing: String, on: String, speed: f32, place: [f32; 3] },
    /// A material was brought onto a thing or part by a tool or by hand.
    Applied { target: String, material: String, tool: String },
    /// A movement or walk has come to its end.
    Arrived { what: String },
    /// A film, sound or animation has come to its end.
    Ended { what: String },
    /// Something outside says something: an exhibition's own control, a button on a wall.
    Message { to: String, name: String, data: Value },
}
