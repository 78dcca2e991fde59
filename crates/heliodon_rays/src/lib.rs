//! The CPU ray engine: a bounding volume hierarchy over triangles, asked in batches.

mod beam;
mod build;
mod hierarchy;
mod layout;
mod morton;
mod nearest;
mod occlude;
mod order;
mod plane;
mod scene;
mod shear;
mod simd;
mod single;
mod triangle;
mod types;
mod view;

pub use build::{BuildError, BuildParams, MAX_COORDINATE, MAX_TRIANGLES, Quality};
pub use morton::morton_order;
pub use order::beam_order;
pub use scene::TriangleScene;
pub use simd::Instructions;
pub use types::{Hit, NO_HIT, Ray};
