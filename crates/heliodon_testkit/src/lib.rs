//! Analytic scenes, the hostile corpus, compressed meshes, image difference, glTF files taken apart and what a process takes, for Heliodon's tests and examples.

pub mod draco;
pub mod flip;
pub mod gltf;
pub mod hostile;
pub mod process;
pub mod scenes;
