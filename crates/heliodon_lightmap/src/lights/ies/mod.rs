//! Measured luminaires: IES LM-63 photometric files.
//!
//! IESNA LM-63-1986, -1991, -1995, -2002 ("Standard File Format for the Electronic Transfer of Photometric Data"), and LM-63-2019 as far as it
//! is the same; type C photometry. See [`IesProfile`].

mod error;
mod numbers;
mod parse;
mod profile;

pub use error::{IesError, IesProblem};
pub use parse::{MAX_ANGLES, MAX_BYTES};
pub use profile::{IesProfile, IesStandard};
