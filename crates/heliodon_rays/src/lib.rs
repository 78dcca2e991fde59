//! The CPU ray engine: a bounding volume hierarchy over triangles, asked in batches.

mod build;
mod hierarchy;
mod layout;
mod morton;
mod scene;
mod shear;
mod single;
mod types;

pub use build::{BuildError, BuildParams, MAX_COORDINATE, MAX_TRIANGLES, Quality};
pub use morton::morton_order;
pub use scene::TriangleScene;
pub use types::{Hit, NO_HIT, Ray};
