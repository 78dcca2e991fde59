//! Analytic scenes, the hostile corpus and image difference for Heliodon's tests.

pub mod flip;
pub mod hostile;
pub mod scenes;
