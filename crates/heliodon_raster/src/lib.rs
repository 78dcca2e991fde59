//! Item buffers: pictures whose pixels say which triangle is seen there, drawn on the processor.
//!
//! ```
//! use glam::Vec3;
//! use heliodon_raster::{Group, ItemBuffer, Perspective};
//!
//! // an eye at the origin that looks along -Z, 90 degrees wide and high
//! let eye = Perspective { eye: Vec3::ZERO, axes: [Vec3::X, Vec3::Y, Vec3::NEG_Z], near_m: 0.1 };
//! let mut picture = ItemBuffer::new(64, 64);
//! let points: [&[f32]; 3] = [&[-1.0, 1.0, 0.0], &[-1.0, -1.0, 1.0], &[-2.0, -2.0, -2.0]];
//! let group = Group { points, triangles: &[[0, 1, 2]] };
//! picture.draw(&eye, group, |_| 7, |_| false);
//! assert_eq!(picture.rows().nth(32).unwrap()[32], 7);
//! ```
//!
//! Corners are rounded to 1/256 of a pixel before anything is drawn, and a pixel is inside by integers, edges included: no pixel falls
//! through between triangles that share an edge (as GPUs do it: J. Pineda, "A Parallel Algorithm for Polygon Rasterization", SIGGRAPH 1988).
//! Groups of triangles that lie behind all pixels of the tiles that they reach can be passed over (N. Greene, M. Kass, G. Miller,
//! "Hierarchical Z-Buffer Visibility", SIGGRAPH 1993, with one level); they are found the better, the nearer groups came before.

mod corners;
mod item_buffer;
mod lanes;
mod perspective;
mod weights;

pub use item_buffer::{Extent, Group, ItemBuffer, MAX_SIDE, NOTHING, TILE_PX};
pub use perspective::{Perspective, Place};
pub use weights::Weights;
