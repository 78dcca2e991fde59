//! Stone's own colour from photographs: the light of each photograph's hour, given to the solver of [`heliodon_photo::albedo`].
//!
//! The light of an hour is that of its sun and sky, as the model lets them reach it, and what the model throws onto itself: this needs the albedo that is looked
//! for, so the solver asks for it again until both agree. The sun is looked for from every texel, for its shadows are sharp; light of the sky and bounced
//! light, which change slowly, are traced at some texels and read between them.
//!
//! Units: the light's are the sky's (klx over pi for a model). A photograph's pixels are in no unit at all, so albedo is known up to a factor for each colour
//! unless something of known albedo is seen in a photograph; see [`heliodon_photo::albedo::AlbedoParams`].

mod hours;
mod light;
mod project;

pub use hours::{HourSky, ProbeLook};
pub use light::{HourLightParams, HourLights};
pub use project::{PhotoLightError, ProjectLight, known_albedo, surroundings};
