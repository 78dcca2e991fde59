//! The CPU ray engine: a bounding volume hierarchy over triangles; batched, packet and beam queries.

use glam::Vec3;

mod types;
pub use types::{Hit, Ray, NO_HIT};
