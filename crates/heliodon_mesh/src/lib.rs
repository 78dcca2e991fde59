//! Meshes: import, export, normals, placement, the procedural monuments.

use glam::{Vec2, Vec3};

pub mod albedo;
pub mod chunk;
pub mod convert;
mod device_order;
pub mod export;
pub mod figures;
pub mod import;
mod measure;
mod mesh;
pub mod motion;
pub mod normals;
pub mod packing;
pub mod part;
pub mod place;
pub mod temple;
pub mod topology;
mod weld;
pub mod workshop;

pub use heliodon_image::TextureWrap;
pub use mesh::{Material, Mesh, MeshError, Texture};
