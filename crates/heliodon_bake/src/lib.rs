//! The pipeline from a site to a bundle.

pub mod blocks;
pub mod cache;
pub mod codec;
pub mod memory;
pub mod report;

/// The hidden folder beside a bundle that keeps what an interrupted bake has computed.
pub const CACHE_FOLDER: &str = ".heliodon";
