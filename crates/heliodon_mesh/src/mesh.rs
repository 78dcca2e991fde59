//! The mesh that importers make and the bake reads.

use super::{Vec2, Vec3};
use heliodon_image::{SrgbImage, TextureWrap};
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
    /// How it goes on outside of [0, 1] along u and v.
    pub wrap: [TextureWrap; 2],
}

/// A mesh whose arrays contradict one another.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MeshError {
    /// An array is neither empty nor as long as what it belongs to.
    #[error("{array} has {length} entries where 0 or {expected} belong")]
    Length {
        /// The array's name.
        array: &'static str,
        /// Its length.
        length: usize,
        /// The length of what it belongs to.
        expected: usize,
    },
    /// A triangle names a vertex that does not exist.
    #[error("triangle {triangle} names vertex {vertex} of {vertices}")]
    Vertex {
        /// The triangle.
        triangle: usize,
        /// What it names.
        vertex: u32,
        /// How many there are.
        vertices: usize,
    },
    /// A triangle names a material that does not exist.
    #[error("triangle {triangle} names material {material} of {materials}")]
    Material {
        /// The triangle.
        triangle: usize,
        /// What it names.
        material: u16,
        /// How many there are.
        materials: usize,
    },
    /// A number is not finite, or not what its array promises.
    #[error("{array}[{index}] is {value}, which is not {promise}")]
    Value {
        /// The array's name.
        array: &'static str,
        /// Which entry.
        index: usize,
        /// The entry.
        value: String,
        /// What the array holds by contract.
        promise: &'static str,
    },
    /// More of something than an index counts.
    #[error("more {0} than an index can count; simplify the mesh or bake it in several parts")]
    TooMany(&'static str),
    /// A texture's size and pixels disagree.
    #[error("the texture {0} has not as many pixels as its size says")]
    Texture(String),
}

/// How far the length of a stored normal may be from 1: three components rounded to 2^-24 each and a square root of as many
/// roundings stay below 4e-7; files write as few as three decimals, which importers make unit again.
const UNIT_TOLERANCE: f32 = 1.0e-5;

impl Mesh {
    /// Checks every promise that the fields' documentation makes.
    ///
    /// # Errors
    /// The first promise that is broken.
    pub fn validate(&self) -> Result<(), MeshError> {
        let vertices = self.positions.len();
        for (array, length) in
            [("normals", self.normals.len()), ("uvs", self.uvs.len()), ("colors_linear", self.colors_linear.len())]
        {
            if length != 0 && length != vertices {
                return Err(MeshError::Length { array, length, expected: vertices });
            }
        }
        let length = self.triangle_material.len();
        if length != 0 && length != self.triangles.len() {
            return Err(MeshError::Length { array: "triangle_material", length, expected: self.triangles.len() });
        }
        if let Some((triangle, corners)) =
            self.triangles.iter().enumerate().find(|(_, corners)| corners.iter().any(|&i| i as usize >= vertices))
        {
            let vertex = corners.iter().copied().max().unwrap_or(0);
            return Err(MeshError::Vertex { triangle, vertex, vertices });
        }
        let materials = self.materials.len();
        if let Some((triangle, &material)) =
            self.triangle_material.iter().enumerate().find(|(_, m)| usize::from(**m) >= materials.max(1))
        {
            return Err(MeshError::Material { triangle, material, materials });
        }
        check("positions", &self.positions, |p| p.is_finite(), "finite")?;
        check("normals", &self.normals, |n| (n.length() - 1.0).abs() < UNIT_TOLERANCE, "of length 1")?;
        check("uvs", &self.uvs, |uv| uv.is_finite(), "finite")?;
        check("colors_linear", &self.colors_linear, is_albedo, "in [0, 1]")?;
        for material in &self.materials {
            check("base_color_linear", &[material.base_color_linear], is_albedo, "in [0, 1]")?;
            if let Some(texture) = &material.texture {
                let size = u64::from(texture.image.width) * u64::from(texture.image.height);
                if size == 0 || size != texture.image.pixels.len() as u64 {
                    return Err(MeshError::Texture(texture.source.clone()));
                }
            }
        }
        Ok(())
    }

    /// The smallest box around all vertices as (least, greatest) corner; none without vertices.
    #[must_use]
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        let &first = self.positions.first()?;
        Some(self.positions.iter().fold((first, first), |(low, high), &p| (low.min(p), high.max(p))))
    }

    /// Bytes that its arrays and textures hold in memory; a texture that several materials share counts once.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        let vec = |capacity: usize, size: usize| capacity * size;
        self.texture_bytes()
            + vec(self.positions.capacity(), size_of::<Vec3>())
            + vec(self.normals.capacity(), size_of::<Vec3>())
            + vec(self.uvs.capacity(), size_of::<Vec2>())
            + vec(self.colors_linear.capacity(), size_of::<Vec3>())
            + vec(self.triangles.capacity(), size_of::<[u32; 3]>())
            + vec(self.triangle_material.capacity(), size_of::<u16>())
    }

    /// Bytes that its textures hold in memory, as they were read; one that several materials share counts once.
    #[must_use]
    pub fn texture_bytes(&self) -> usize {
        let mut seen: Vec<*const Texture> = Vec::new();
        let mut bytes = 0;
        for texture in self.materials.iter().filter_map(|m| m.texture.as_ref()) {
            if !seen.contains(&Arc::as_ptr(texture)) {
                seen.push(Arc::as_ptr(texture));
                bytes += texture.image.pixels.capacity() * size_of::<[u8; 4]>();
            }
        }
        bytes
    }

    /// The triangle's corners.
    ///
    /// # Panics
    /// Where there is no such triangle, or it names no such vertex.
    #[must_use]
    #[inline]
    pub fn corners(&self, triangle: usize) -> [Vec3; 3] {
        self.triangles[triangle].map(|i| self.positions[i as usize])
    }
}

fn is_albedo(color: Vec3) -> bool {
    color.cmpge(Vec3::ZERO).all() && color.cmple(Vec3::ONE).all()
}

fn check<T: Copy + std::fmt::Debug>(
    array: &'static str,
    values: &[T],
    good: impl Fn(T) -> bool,
    promise: &'static str,
) -> Result<(), MeshError> {
    match values.iter().position(|&value| !good(value)) {
        None => Ok(()),
        Some(index) => Err(MeshError::Value { array, index, value: format!("{:?}", values[index]), promise }),
    }
}
