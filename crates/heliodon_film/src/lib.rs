//! Films: what is in them, their pictures and sound in step with time, and writing them.
//!
//! | module | what it does |
//! | --- | --- |
//! | `probe` ([`Film`]) | size, rate, length, alpha and sound of a file |
//! | `frames` ([`FrameReader`]) | pictures in order, at a constant rate: frame n is at n / rate seconds |
//! | `sound` ([`SoundReader`]) | sound as interleaved `f32` at a wished rate, from the same zero of time |
//! | `player` ([`Player`]) | decodes ahead on a thread of its own, so that a viewer asks for a time and never waits |
//! | `writer` ([`FilmWriter`]) | pictures in, H.264 in MP4, VP9 in WebM or PNG files out, sound taken along |
//!
//! Decoding and encoding are done by the programs `ffmpeg` and `ffprobe`, as child processes over pipes, and not by a library within: a decoder
//! that crashes over a broken film takes nothing with it, licences of codecs stay outside, and distributions keep it
//! patched. A pipe costs a copy of each picture: 3.3 MB at 640x1280, 0.1 GB a second, which `docs/decisions/032-films.md` weighs.
//!
//! Pictures are RGBA, 8 bits, sRGB-encoded, row-major from the top left, straight (not premultiplied) where the film itself carries alpha, and
//! opaque where it does not. Films are turned upright as their header says, and pixels that are not square become so.
//!
//! Nothing here prints. Names of files never become options or protocols of `ffmpeg`: they are passed as arguments, without a shell, as
//! `file:NAME`; only containers of films are opened ([`FORMATS`](process::FORMATS)), never playlists or scripts that name other files.

mod error;
mod frames;
mod player;
mod probe;
pub mod process;
mod rate;
mod sound;
mod writer;

pub use error::FilmError;
pub use frames::{Conversion, Frame, FrameReader, ReadParams, Source, Stopper};
pub use player::{Player, PlayerParams, Shown};
pub use probe::{Film, Sound};
pub use rate::Rate;
pub use sound::SoundReader;
pub use writer::{FilmFormat, FilmWriter, SoundSource, WriteParams};

/// The longest side of a film, in pixels: 16,384, as of the largest texture that every GPU has.
pub const MAX_SIDE: u32 = 16_384;
