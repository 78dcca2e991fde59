//! Heliodon's pipeline: from a site to a bundle, resumable.
//!
//! [`plan::Plan`] finds, hashes and checks everything that a site names. [`bake::bake`] then goes, data to data, through
//!
//! 1. [`scene`]: every part read, placed and given its albedo, all in one mesh, for all geometry occludes;
//! 2. [`sky`]: the day lapse and its sky maps, from probes or a model;
//! 3. [`light`]: sun masks, sky transfer ([`stages`]), bounces, in [`blocks`] that are kept in a [`cache`] as soon as they are done;
//!    with the vertices that of the points in space that [`grid`] lays through rooms and along the paths of [`actors`], of which [`ground`] tells what they stand on;
//! 4. [`weathering`], where the site wants it: what the weather has left on the surfaces;
//! 5. [`chunks`]: spatially tight primitives with their light, streamed into the bundle, and into that of the [`scan`] itself where the site wants it.
//!
//! A bake that is killed goes on where it stopped, and ends with the same bytes: every block depends on nothing but what the
//! cache's key holds. So many machines can share one ([`merge`]): each does the blocks of its [`shard`], as the [`division`] has
//! them. Same input, same bundle, bit for bit, for any number of threads and shards. [`estimate`] tells beforehand what a bake
//! costs. Nothing here prints; whoever wants to know gives a [`report::Reporter`].

pub mod actors;
pub mod albedo;
pub mod bake;
pub mod blocks;
mod budget;
pub mod cache;
pub mod check;
pub mod chunks;
pub mod codec;
mod darkness;
mod details;
pub mod division;
pub mod earlier;
mod error;
pub mod estimate;
mod evidence;
pub mod grid;
pub mod ground;
mod inputs;
mod kept_bounces;
mod kept_light;
mod kept_rays;
mod key;
pub mod lamps;
pub mod light;
pub mod merge;
pub mod names;
pub mod panorama;
pub mod photo;
pub mod plan;
pub mod prepare;
mod referenced;
pub mod report;
mod rooms;
pub mod scan;
pub mod scene;
pub mod shard;
pub mod sky;
pub mod stages;
mod stand_in;
mod texels;
pub mod weathering;

pub use error::BakeError;
pub use key::TOOL;
pub use referenced::referenced_files;
pub use texels::texels_first;

/// The hidden folder beside a bundle that keeps what an interrupted bake has computed.
pub const CACHE_FOLDER: &str = ".heliodon";
