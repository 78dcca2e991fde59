//! Lights against what is known of them: closed forms, conserved energy, and files of all kinds.

#![expect(clippy::unwrap_used, reason = "a test that panics has failed")]

mod energy;
mod ies;
mod sampling;
mod scenes;
mod specs;
mod surfaces;
