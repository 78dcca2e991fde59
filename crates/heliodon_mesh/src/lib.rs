//! Meshes: import, export, normals, placement, the procedural monuments.

use glam::{Vec2, Vec3};

mod mesh;
pub use mesh::{Material, Mesh, Texture};
