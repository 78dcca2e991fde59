//! Sound.
pub mod clip;
pub mod clock;
pub mod control;
pub mod feed;
pub mod filter;
pub mod head;
mod kernel;
pub mod limiter;
pub mod mixer;
pub mod resample;
pub mod room;

/// The rate.
pub const RATE_HZ: u32 = 48_000;
/// Slice.
pub const SLICE: usize = 64;
/// Late.
pub const LATENCY_FRAMES: u64 = (limiter::LIMITER_LATENCY + kernel::AHEAD) as u64;
pub use control::Control;
