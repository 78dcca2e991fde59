//! How light reaches the vertices of a monument: sun masks, the transfer of sky light, bounced sunlight; and the reference path
//! tracer that says how well.
//!
//! Light is **irradiance / pi**, so that outgoing radiance = albedo * light. At sun step t, with the sky's coefficients `S`:
//!
//! ```text
//! light = bit_t * max(n.l_t, 0) * E_sun / pi  +  max(0, sum_i T_i S_i)  +  E_sun * max(0, sum_r b_r f_r(t))
//! ```
//!
//! The way of a bake, in pieces that can be saved between ([`bake`] does all of it at once):
//!
//! 1. [`Layout::new`]: the points to solve (vertices, and centres of the cells of large triangles) in spatial order;
//! 2. [`BouncedSun::new`]: where the suns shine, and the functions of the day;
//! 3. [`gather`] for ranges of points: what each sees in a fixed set of directions;
//! 4. [`Layout::add_back_sides`], and its new points gathered, until it adds none;
//! 5. [`bake_sun_masks`] for ranges of [`Layout::points`];
//! 6. [`solve`]: validity and bounces; and [`vertex_masks`].
//!
//! Everything is the same bit for bit for any number of threads and any division into ranges. Rayon's current pool is used.

mod block_bytes;
mod bounce;
mod bounced_sun;
mod cells;
mod directions;
mod error;
mod follow;
mod gather;
mod inside;
mod look;
mod masks;
mod params;
mod patches;
mod points;
pub mod reference;
mod refine;
mod solve;
mod sun_basis;
mod surfaces;
mod validity;

pub use bounced_sun::BouncedSun;
pub use cells::{Layout, default_cell_size_m};
pub use directions::gather_directions;
pub use error::LightError;
pub use follow::Followed;
pub use gather::{GatherBlock, UnitHits, gather};
pub use inside::BACK_LIMIT;
pub use masks::{MaskParams, SunMasks, bake_sun_masks};
pub use params::{Channels, LightParams, MAX_SUN_STEPS};
pub use points::PointSet;
pub use solve::{Baked, SunBounce, VertexLight, bake, solve, vertex_masks};
pub use sun_basis::{DayFunctions, day_functions};
pub use surfaces::{ConstantAlbedo, SurfaceAlbedo, Surfaces, default_offset_m, median_edge_m};
pub use validity::Validity;
