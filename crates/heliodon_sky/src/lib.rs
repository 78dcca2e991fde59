//! Skies: probe mappings, sun detection, solar position, sky models, the day lapse.
//!
//! Directions: +Y up, +X east, -Z north, from the surface to the light. Radiance is linear Rec. 709 in any consistent unit; the
//! models give it in kcd/m2 (so that irradiance is in klx).

pub mod civil;
pub mod day;
pub mod environment;
pub mod error;
pub mod fit;
pub mod lapse;
pub mod mapping;
pub mod model;
pub mod picture;
pub mod probe;
pub mod project;
pub mod solar;
pub mod sun;

pub use error::SkyError;
