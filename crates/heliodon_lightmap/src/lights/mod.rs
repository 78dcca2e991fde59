//! The lights of a texel light map: points, spots, measured luminaires, suns, and surfaces that shine.
//!
//! The renderer of Papaioannou, Gaitatzes and Christopoulos ("Enhancing Virtual Reality Walkthroughs of Archaeological Sites", VAST 2003,
//! sections 2.1 and 4) traces "incident irradiance from the sampled light sources", "a wide range" of them; here they are.

pub mod ies;

pub use ies::{IesError, IesProfile};
