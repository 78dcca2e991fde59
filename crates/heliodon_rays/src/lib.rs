//! The CPU ray engine: a bounding volume hierarchy over triangles, asked in batches.
//!
//! A [`TriangleScene`] answers two questions, whether anything is in the way and what is met first, for single rays in
//! any direction and for many rays of one direction. The latter is what a bake asks (one sun, or one direction of
//! the sky, from a million vertices), and is walked in beams of neighbours; give it origins in [`beam_order`].
//!
//! ```
//! use glam::Vec3;
//! use heliodon_rays::{BuildParams, TriangleScene};
//!
//! let roof = [Vec3::new(-1.0, 1.0, -1.0), Vec3::new(-1.0, 1.0, 1.0), Vec3::new(1.0, 1.0, -1.0)];
//! let scene = TriangleScene::build(&roof, &[[0, 1, 2]], &BuildParams::default())?;
//! let origins = [Vec3::new(-0.5, 0.0, -0.5), Vec3::new(0.5, 0.0, 0.5)];
//! let mut shaded = [0];
//! scene.occluded_parallel(&origins, Vec3::Y, &[0b11], &mut shaded);
//! assert_eq!(shaded, [0b01]);
//! # Ok::<(), heliodon_rays::BuildError>(())
//! ```
//!
//! # What holds
//!
//! - A ray's answer is a function of the ray and the triangles alone, to the bit: not of the hierarchy, of the rays that
//!   it is asked with, of the threads or of the processor's vectors.
//! - No ray slips through the edge or vertex that triangles share, if they share it in position.
//! - Both sides of a triangle count. Triangles that are seen exactly edge-on do not, nor do those that lie wholly behind
//!   the origin on any axis.
//! - Rays that are not finite, start beyond [`MAX_COORDINATE`] or have no direction meet nothing.

mod beam;
pub mod bench;
mod build;
mod fan;
mod filter;
mod hierarchy;
mod layout;
mod line;
mod morton;
mod nearest;
mod occlude;
mod offset;
mod order;
mod plan;
mod refit;
mod scene;
mod shear;
mod simd;
mod single;
mod stored;
mod tiles;
mod triangle;
mod types;
mod view;
mod visibility;

pub use build::{BuildError, BuildParams, MAX_COORDINATE, MAX_TRIANGLES, Quality};
pub use filter::{EyeView, VertexFilter};
pub use morton::morton_order;
pub use order::beam_order;
pub use scene::TriangleScene;
pub use simd::Instructions;
pub use stored::KeptTiles;
pub use types::{Hit, NO_HIT, Ray};
pub use visibility::{VisibilityCpu, VisibilityCpuError, facing, set_bits};
