//! Sound at its place: what a visitor hears at two ears, on a device or off line, bit for bit the same.
//!
//! | module | what it does |
//! | --- | --- |
//! | [`mixer`] | renders blocks of two channels: sources, rooms, ambience, the limiter; never locks or allocates |
//! | [`control`] | what the visit tells it, checked, through a bounded queue |
//! | [`head`] | delay, level and shadow at both ears: the formulas |
//! | [`filter`] | air, what stands in the way |
//! | [`room`] | rooms with their echo |
//! | [`limiter`] | the end, which never clips |
//! | [`clip`], [`file`](mod@file), [`stream`] | sounds in memory, in files, from disk as they are heard |
//! | [`feed`](mod@feed) | sound from outside as it comes, such as a film's, and which of its time is heard |
//! | [`clock`] | which moment is heard |
//! | [`output`] | a device on a thread of its own; silence where there is none |
//! | [`offline`] | no device: for tests and films |
//! | [`generate`](mod@generate) | sounds that are made: a chisel, a fire, wind, a crowd |
//! | [`resample`](mod@resample) | from any rate to [`RATE_HZ`] |
//!
//! Spaces: right-handed, metres, **+Y up**, +X east, -Z north; a head looks along its -Z. Everything runs at [`RATE_HZ`]; levels are
//! amplitudes, 1 is full scale. Trigonometry is [`libm`]'s, and sums have one order: the same orders make the same samples on every machine.
//!
//! **How late.** Whatever sounds is heard [`LATENCY_FRAMES`] after its frame, 1.4 milliseconds: half the kernel that reads between
//! samples, and as far as the limiter looks ahead. Then its way through the air ([`Travel`]), and what the device holds.
//!
//! **What glides.** Places, levels and filters follow what they are told by two low-passes of [`mixer::GLIDE_S`] each; ways that change by
//! 1.5 metres at once are faded over in 21 milliseconds; beginnings rise in 1.3, ends fall in 10. Nothing clicks: `tests/all/smooth.rs`.
//!
//! # Example
//!
//! ```
//! use glam::{Quat, Vec3};
//! use heliodon_sound::generate::{GenerateParams, SoundKind, generate};
//! use heliodon_sound::offline::OffLine;
//! use heliodon_sound::room::{Room, Walls};
//! use heliodon_sound::{Content, MixerSettings, SourceSettings};
//! use std::sync::Arc;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let mut visit = OffLine::new(&MixerSettings::default());
//! let cella = Room::with_walls("cella", Vec3::new(-10.0, 0.0, -15.0), Vec3::new(10.0, 12.0, 15.0), Walls::Stone);
//! visit.control.rooms(&[cella])?;
//! visit.control.listener(Vec3::new(0.0, 1.7, 10.0), Quat::IDENTITY)?;
//! let chisel = Arc::new(generate(&GenerateParams::new(SoundKind::Chisel))?);
//! let mason = SourceSettings { place: Vec3::new(-4.0, 1.0, 0.0), reference_m: 2.0, ..SourceSettings::default() };
//! visit.control.add(Content::Clip(chisel), &mason)?;
//! visit.advance(2.0);
//! let loudest = |ear| visit.ear(ear).iter().fold(0.0_f32, |peak, sample| peak.max(sample.abs()));
//! assert!(loudest(0) > loudest(1) && loudest(1) > 0.01, "he works on the left");
//! # Ok(())
//! # }
//! ```

pub mod clip;
pub mod clock;
pub mod control;
pub mod feed;
pub mod file;
pub mod filter;
pub mod generate;
pub mod head;
mod kernel;
pub mod limiter;
pub mod mixer;
pub mod offline;
pub mod output;
pub mod resample;
pub mod room;
pub mod stream;

pub use clip::Clip;
pub use clock::Clock;
pub use control::{BedId, Control, ControlError, SourceId};
pub use mixer::{Content, DayCurve, Mixer, MixerSettings, SourceSettings, Travel};

/// The rate at which everything is mixed, hertz.
pub const RATE_HZ: u32 = 48_000;

/// Frames that are worked out at once: 1.3 milliseconds.
pub const SLICE: usize = 64;

/// By so many frames everything is late: half of the interpolation's kernel and the limiter's look ahead.
pub const LATENCY_FRAMES: u64 = (limiter::LIMITER_LATENCY + kernel::AHEAD) as u64;
