//! Meshes compressed by Google's own Draco encoder, and what they are of.
//!
//! `make.py` beside this file makes the streams anew, of a shape of our own: a wavy square of the unit length, looked at from above, `z`.

use glam::{Vec2, Vec3};
use heliodon_math::frame::unit_or;

/// A compressed wavy square.
#[derive(Clone, Copy, Debug)]
pub struct Compressed {
    /// How it is coded.
    pub name: &'static str,
    /// The Draco stream.
    pub stream: &'static [u8],
    /// Vertices.
    pub points: usize,
    /// Triangles.
    pub triangles: usize,
    /// Bits of a coordinate.
    pub position_bits: u32,
    /// Whether it has colours, rather than normals and texture coordinates.
    pub is_colored: bool,
}

/// By edgebreaker with a seam of the texture, by edgebreaker with valences, and one triangle after another with colours.
#[must_use]
pub fn all() -> [Compressed; 3] {
    let seams = Compressed {
        name: "seams",
        stream: include_bytes!("seams.drc"),
        points: 90,
        triangles: 128,
        position_bits: 14,
        is_colored: false,
    };
    let valence = Compressed {
        name: "valence",
        stream: include_bytes!("valence.drc"),
        points: 650,
        triangles: 1152,
        position_bits: 12,
        ..seams
    };
    let colors = Compressed { name: "colors", stream: include_bytes!("colors.drc"), points: 81, is_colored: true, ..seams };
    [seams, valence, colors]
}

/// The surface over a place of the unit square.
#[must_use]
pub fn height(x: f32, y: f32) -> f32 {
    0.1 * libm::sinf(3.0 * x) * libm::cosf(2.0 * y)
}

/// Its normal there.
#[must_use]
pub fn normal(x: f32, y: f32) -> Vec3 {
    let across = -0.3 * libm::cosf(3.0 * x) * libm::cosf(2.0 * y);
    let along = 0.2 * libm::sinf(3.0 * x) * libm::sinf(2.0 * y);
    unit_or(Vec3::new(across, along, 1.0), Vec3::Z)
}

/// The texture coordinates of a corner of a triangle in the left half, or in the right one, where they lie one tile further.
#[must_use]
pub fn uv(x: f32, y: f32, is_right: bool) -> Vec2 {
    Vec2::new(x + f32::from(u8::from(is_right)), y)
}

impl Compressed {
    /// A glTF document with the stream as its binary chunk.
    #[must_use]
    pub fn json(&self) -> String {
        let (points, corners, bytes) = (self.points, self.triangles * 3, self.stream.len());
        let (names, of_points) = if self.is_colored {
            (
                r#""POSITION":0,"COLOR_0":1"#,
                format!(r#"{{"componentType":5121,"normalized":true,"count":{points},"type":"VEC4"}}"#),
            )
        } else {
            let float = |kind: &str| format!(r#"{{"componentType":5126,"count":{points},"type":"{kind}"}}"#);
            (r#""POSITION":0,"TEXCOORD_0":1,"NORMAL":2"#, format!("{},{}", float("VEC2"), float("VEC3")))
        };
        let indices = if self.is_colored { 2 } else { 3 };
        format!(
            r#"{{"asset":{{"version":"2.0"}},"extensionsUsed":["KHR_draco_mesh_compression"],"extensionsRequired":["KHR_draco_mesh_compression"],
"meshes":[{{"primitives":[{{"attributes":{{{names}}},"indices":{indices},
"extensions":{{"KHR_draco_mesh_compression":{{"bufferView":0,"attributes":{{{names}}}}}}}}}]}}],"nodes":[{{"mesh":0}}],
"accessors":[{{"componentType":5126,"count":{points},"type":"VEC3"}},{of_points},{{"componentType":5123,"count":{corners},"type":"SCALAR"}}],
"bufferViews":[{{"buffer":0,"byteLength":{bytes}}}],"buffers":[{{"byteLength":{bytes}}}]}}"#
        )
    }
}
