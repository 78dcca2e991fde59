//! The light of texels against what is known of it.

#![expect(clippy::unwrap_used, reason = "a test that panics has failed")]

mod backs;
mod bench;
mod encoded;
mod leaks;
mod models;
mod seams;
mod truth;
