//! From photographs: cameras, models of few polygons, their textures, and stone's own colour.
//!
//! Photographs whose cameras are known are the witness: shapes of architecture are fitted to what was marked in them ([`model`]), and textured with what they saw
//! ([`texture`]); where the light of their hours is known, what is left of their colours is the stone's own ([`albedo`]).

pub mod albedo;
pub mod camera;
pub mod model;
pub mod texture;
