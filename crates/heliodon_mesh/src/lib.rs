//! Meshes: import, export, normals, placement, the procedural monuments.

use glam::{Vec2, Vec3};

pub mod import;
mod mesh;
pub mod normals;
pub mod place;
pub mod temple;
pub mod weld;

pub use mesh::{Material, Mesh, Texture, Wrap};
