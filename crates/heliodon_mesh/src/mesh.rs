//! The mesh that importers make and the bake reads.

use super::{Vec2, Vec3};
use heliodon_image::SrgbImage;
use std::sync::Arc;

/// Triangles over shared vertices, in one space, with what is known of their look.
///
/// `normals`, `uvs` and `colors_linear` are either empty or as long as `positions`; `triangle_material` is either empty (all
/// triangles use material 0, or none) or as long as `triangles`.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Vertex positions in metres.
    pub positions: Vec<Vec3>,
    /// Unit vertex normals.
    pub normals: Vec<Vec3>,
    /// Texture coordinates, origin at the image's top left (as glTF).
    pub uvs: Vec<Vec2>,
    /// Vertex colours, linear Rec. 709 albedo in [0, 1]; multiplied with the material.
    pub colors_linear: Vec<Vec3>,
    /// Vertex indices, counter-clockwise seen from the front.
    pub triangles: Vec<[u32; 3]>,
    /// Index into `materials` per triangle.
    pub triangle_material: Vec<u16>,
    /// Materials that the triangles name.
    pub materials: Vec<Material>,
}

/// The diffuse look of a surface.
#[derive(Clone, Debug)]
pub struct Material {
    /// The name in the file, or empty.
    pub name: String,
    /// Linear Rec. 709 factor in [0, 1]; multiplies texture and vertex colour.
    pub base_color_linear: Vec3,
    /// The base colour image.
    pub texture: Option<Arc<Texture>>,
}

/// A base colour image, kept decoded.
#[derive(Clone, Debug)]
pub struct Texture {
    /// Where it came from, for messages.
    pub source: String,
    /// sRGB pixels.
    pub image: SrgbImage,
}
