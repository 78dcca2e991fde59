//! The lights of a texel light map: points, spots, measured luminaires, suns, and surfaces that shine.
//!
//! The renderer of Papaioannou, Gaitatzes and Christopoulos ("Enhancing Virtual Reality Walkthroughs of Archaeological Sites", VAST 2003,
//! sections 2.1 and 4) traces "incident irradiance from the sampled light sources", "a wide range" of them; here they are.
//!
//! [`LightSpec`] is what a site file says, [`Light::new`] makes the light, and a solver asks it, for a point:
//!
//! - [`Light::sample`]: a direction, a distance for the shadow ray, and the light of one estimate of **irradiance over pi**;
//! - [`Light::closed_form`]: all of its light where nothing lies between, without noise;
//! - [`Light::radiance_towards`], [`Light::pdf_sr`] and their like from afar: what a bounced ray that meets it counts, and with which weight;
//! - [`Light::upper_bound`], [`Light::power`], [`Light::bounds`], [`pick_light`]: which of many lights matters here.
//!
//! Numbers are in f64 inside and come from `libm` alone, so the same question has the same answer everywhere.

mod directional;
mod disc;
mod error;
pub mod ies;
mod light;
mod local;
mod make;
mod mesh;
mod polygon;
mod rectangle;
mod sample;
mod select;
mod spec;
mod triangle;
mod units;
mod vector;

pub use error::LightSpecError;
pub use ies::{IesError, IesProfile};
pub use light::Light;
pub use make::{LightFiles, NoFiles};
pub use mesh::EmissiveTriangles;
pub use sample::{EmitterHit, LightBounds, LightSample, balance};
pub use select::{PickedLight, pick_light};
pub use spec::{DirectionalSpec, DiscSpec, IesSpec, LightSpec, MeshSpec, PointSpec, RectangleSpec, SpotSpec};
pub use units::{Amount, Photometry};
