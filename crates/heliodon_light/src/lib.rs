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
//! 2. [`bake_sun_masks`] for ranges of [`Layout::points`];
//! 3. [`BouncedSun`]: where the suns shine, and the functions of the day; in parts [`light_patches`] for ranges of a [`PatchPlan`], and
//!    [`SunOnSurfaces::curves`] for ranges of runs;
//! 4. [`gather`] for ranges of points: what each sees in a fixed set of directions;
//! 5. [`Layout::add_back_sides`], and its new points gathered, until it adds none;
//! 6. [`solve`]: validity and bounces; and [`vertex_masks`].
//!
//! Where figures move, before 6: [`Layout::add_free_points`] adds points in space, which are gathered as well, and [`solve_all`] answers
//! with their light too, from which [`LatticeLight`] makes that of a lattice. What such a point sees does not depend on how many points
//! come before it, so it may be gathered before the back sides are known ([`GatherBlock::moved_to`]).
//!
//! Texels and whatever else lies on the surfaces without lighting others are [`Receivers`]: they take their light from the solved cells, after 6, and nothing
//! that their rays meet is kept.
//!
//! Everything is the same bit for bit for any number of threads and any division into ranges. Rayon's current pool is used.

mod block_bytes;
mod bounce;
mod bounced_sun;
mod cells;
mod change;
mod directions;
mod error;
mod follow;
mod free;
mod from_cells;
mod gather;
mod inside;
mod kept_bounces;
mod lattice;
mod look;
mod masks;
mod params;
mod patches;
mod points;
mod receive;
pub mod reference;
mod refine;
mod solve;
mod sun_basis;
mod surfaces;
mod traces;
mod validity;

pub use bounce::CellLight;
pub use bounced_sun::{BouncedSun, CurveRuns, SunOnSurfaces};
pub use cells::{Layout, default_cell_size_m};
pub use change::{Before, Bounds, Change, KnownTraces};
pub use directions::gather_directions;
pub use error::LightError;
pub use follow::{Followed, MAX_FOLLOWED};
pub use free::FreeLight;
pub use gather::{GatherBlock, UnitHits, gather, gather_knowing};
pub use inside::BACK_LIMIT;
pub use kept_bounces::KeptBounces;
pub use lattice::{AXES, LatticeLight, lattice_places};
pub use masks::{MaskParams, MasksBefore, SunMasks, bake_sun_masks, bake_sun_masks_knowing};
pub use params::{Channels, LightParams, MAX_SUN_STEPS};
pub use patches::{PatchPlan, PatchesBefore, SunlitPatches, light_patches, light_patches_knowing};
pub use points::PointSet;
pub use receive::{RayPlace, RayVertices, Received, Receivers, Receiving, SurfacePlace};
pub use solve::{Baked, SunBounce, VertexLight, bake, solve, solve_all, vertex_masks};
pub use sun_basis::{DayFunctions, day_functions};
pub use surfaces::{ConstantAlbedo, Detail, SurfaceAlbedo, Surfaces, default_offset_m, median_edge_m};
pub use traces::Traces;
pub use validity::Validity;
