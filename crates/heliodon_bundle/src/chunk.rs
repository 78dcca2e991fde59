//! A piece of lit geometry, as the bake makes it and viewers draw it.

use glam::{Vec2, Vec3};
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// The most triangles of a chunk.
pub const MAX_CHUNK_TRIANGLES: usize = 20_000;
/// The most vertices of a chunk: three for each triangle, so that 16-bit indices always do.
pub const MAX_CHUNK_VERTICES: usize = 3 * MAX_CHUNK_TRIANGLES;

/// Shape of the light that is stored for each vertex; the same for all chunks of a bundle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LightLayout {
    /// T, sun steps of the day, 1 to 1,024.
    pub sun_steps: u32,
    /// C, spherical harmonics coefficients per channel: 4 or 9.
    pub coefficients: u32,
    /// Channels of sky transfer and sun bounce: 1 or 3.
    pub channels: u32,
    /// R, functions over the day by which the sun's bounced light is stored; 0 where none was baked.
    pub sun_bounce_functions: u32,
}

/// The most functions of the sun's bounced light.
pub const MAX_SUN_BOUNCE_FUNCTIONS: u32 = 64;

impl LightLayout {
    /// Words of sun mask per vertex, W = ceil(T / 32).
    #[must_use]
    pub fn mask_words(&self) -> usize {
        self.sun_steps.div_ceil(32) as usize
    }

    /// Floats of sky transfer per vertex.
    #[must_use]
    pub fn transfer_floats(&self) -> usize {
        (self.coefficients * self.channels) as usize
    }

    /// Floats of sun bounce per vertex.
    #[must_use]
    pub fn bounce_floats(&self) -> usize {
        (self.sun_bounce_functions * self.channels) as usize
    }

    /// Whether the format holds such a layout.
    ///
    /// # Errors
    /// What is out of range.
    pub fn validate(&self) -> Result<(), ChunkFault> {
        let wrong = |what, value: u32, range| Err(ChunkFault::Layout { what, value, range });
        if !(1..=crate::site::MAX_SUN_STEPS).contains(&self.sun_steps) {
            return wrong("sun_steps", self.sun_steps, "1 to 1,024");
        }
        if !matches!(self.coefficients, 4 | 9) {
            return wrong("coefficients", self.coefficients, "4 or 9");
        }
        if !matches!(self.channels, 1 | 3) {
            return wrong("channels", self.channels, "1 or 3");
        }
        if self.sun_bounce_functions > MAX_SUN_BOUNCE_FUNCTIONS {
            return wrong("sun_bounce_functions", self.sun_bounce_functions, "0 to 64");
        }
        Ok(())
    }
}

/// Light of a chunk's N vertices.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct VertexLight {
    /// T, sun steps.
    pub sun_steps: u32,
    /// C, coefficients per channel: 4 or 9.
    pub coefficients: u32,
    /// Channels: 1 or 3.
    pub channels: u32,
    /// R, functions of the sun bounce, 0 for none.
    pub sun_bounce_functions: u32,
    /// N x W words, W = ceil(T / 32): bit t is 1 where the sun of step t reaches the vertex; bit t in word t/32, unused bits 0.
    pub sun_mask: Vec<u32>,
    /// N x C x channels: coefficient-major, then channel. Irradiance / pi.
    pub sky_transfer: Vec<f32>,
    /// N x R x channels: function-major, then channel. Irradiance / pi for a sun of unit irradiance at normal incidence.
    pub sun_bounce: Vec<f32>,
}

impl VertexLight {
    /// Light of the given shape, all zero.
    #[must_use]
    pub fn zeros(layout: LightLayout, vertices: usize) -> Self {
        Self {
            sun_steps: layout.sun_steps,
            coefficients: layout.coefficients,
            channels: layout.channels,
            sun_bounce_functions: layout.sun_bounce_functions,
            sun_mask: vec![0; vertices * layout.mask_words()],
            sky_transfer: vec![0.0; vertices * layout.transfer_floats()],
            sun_bounce: vec![0.0; vertices * layout.bounce_floats()],
        }
    }

    /// The shape of the light.
    #[must_use]
    pub fn layout(&self) -> LightLayout {
        LightLayout {
            sun_steps: self.sun_steps,
            coefficients: self.coefficients,
            channels: self.channels,
            sun_bounce_functions: self.sun_bounce_functions,
        }
    }

    /// Whether the sun of `step` reaches `vertex`.
    ///
    /// # Panics
    /// If there is no such vertex or step.
    #[must_use]
    pub fn sun_reaches(&self, vertex: usize, step: u32) -> bool {
        assert!(step < self.sun_steps, "sun step {step} of {}", self.sun_steps);
        self.sun_mask[vertex * self.layout().mask_words() + step as usize / 32] >> (step % 32) & 1 == 1
    }
}

/// A primitive of at most [`MAX_CHUNK_TRIANGLES`] triangles with vertices of its own.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LitChunk {
    /// Index of the part that it belongs to.
    pub part: u16,
    /// Index of its base colour image; multiplies `albedo`.
    pub texture: Option<u32>,
    /// Index of its detail among those that its part has for some materials ([`crate::manifest::PartInfo::material_details`]).
    pub detail: Option<u32>,
    /// N positions, metres.
    pub positions: Vec<Vec3>,
    /// N unit normals.
    pub normals: Vec<Vec3>,
    /// N texture coordinates, origin at the image's top left; empty where there is no texture.
    pub uvs: Vec<Vec2>,
    /// N places in the atlas of [`crate::texels`], from its first texel's outer corner on; empty where the vertices' light is shown.
    pub texel_uvs: Vec<Vec2>,
    /// N linear albedos in [0, 1]; with a texture, factors for its colour.
    pub albedo: Vec<Vec3>,
    /// Vertex indices, counter-clockwise seen from the front.
    pub triangles: Vec<[u32; 3]>,
    /// N flags: 0 where the vertex lies inside something and borrowed its light, else 1.
    pub valid: Vec<u8>,
    /// The light of the vertices.
    pub light: VertexLight,
}

/// What is wrong with a chunk.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum ChunkFault {
    /// A number of the light's layout is out of range.
    #[error("{what} is {value}, the format holds {range}")]
    Layout {
        /// The number.
        what: &'static str,
        /// Its value.
        value: u32,
        /// What it may be.
        range: &'static str,
    },
    /// An array does not have as many elements as it must.
    #[error("{what} has {found} elements, not {expected}")]
    Length {
        /// The array.
        what: &'static str,
        /// Its length.
        found: usize,
        /// The length it must have.
        expected: usize,
    },
    /// There is nothing, or too much, in the chunk.
    #[error("{triangles} triangles over {vertices} vertices; a chunk holds 1 to 20,000 over 3 to 60,000")]
    Size {
        /// Triangles.
        triangles: usize,
        /// Vertices.
        vertices: usize,
    },
    /// A triangle names a vertex that is not there.
    #[error("triangle {triangle} names vertex {vertex} of {vertices}")]
    Index {
        /// The triangle.
        triangle: usize,
        /// The vertex.
        vertex: u32,
        /// How many there are.
        vertices: usize,
    },
    /// A value is not finite or out of range.
    #[error("{what} of vertex {vertex} {rule}")]
    Value {
        /// The array.
        what: &'static str,
        /// The vertex.
        vertex: usize,
        /// The rule that it breaks.
        rule: &'static str,
    },
}

/// How far a normal's length may be from 1: f32 normals that were rounded a few times keep well within.
const UNIT_TOLERANCE: f32 = 1e-3;

impl LitChunk {
    /// N, the number of vertices.
    #[must_use]
    pub fn vertex_count(&self) -> usize {
        self.positions.len()
    }

    /// Whether all arrays fit together and all values are in range.
    ///
    /// # Errors
    /// The first fault.
    pub fn validate(&self) -> Result<(), ChunkFault> {
        let (n, triangles) = (self.positions.len(), self.triangles.len());
        if !(1..=MAX_CHUNK_TRIANGLES).contains(&triangles) || !(3..=MAX_CHUNK_VERTICES).contains(&n) {
            return Err(ChunkFault::Size { triangles, vertices: n });
        }
        let layout = self.light.layout();
        layout.validate()?;
        let lengths = [
            ("normals", self.normals.len(), n),
            ("albedo", self.albedo.len(), n),
            ("valid", self.valid.len(), n),
            ("uvs", self.uvs.len(), if self.texture.is_some() { n } else { 0 }),
            ("texel_uvs", self.texel_uvs.len(), if self.texel_uvs.is_empty() { 0 } else { n }),
            ("sun_mask", self.light.sun_mask.len(), n * layout.mask_words()),
            ("sky_transfer", self.light.sky_transfer.len(), n * layout.transfer_floats()),
            ("sun_bounce", self.light.sun_bounce.len(), n * layout.bounce_floats()),
        ];
        for (what, found, expected) in lengths {
            if found != expected {
                return Err(ChunkFault::Length { what, found, expected });
            }
        }
        for (triangle, corners) in self.triangles.iter().enumerate() {
            if let Some(&vertex) = corners.iter().find(|&&v| v as usize >= n) {
                return Err(ChunkFault::Index { triangle, vertex, vertices: n });
            }
        }
        let rule = |what, rule, broken: Option<usize>, per_vertex: usize| match broken {
            Some(i) => Err(ChunkFault::Value { what, vertex: i / per_vertex, rule }),
            None => Ok(()),
        };
        let finite = "is not finite";
        rule("position", finite, self.positions.iter().position(|p| !p.is_finite()), 1)?;
        // a NaN is in no range
        let not_unit = |v: &Vec3| !(1.0 - UNIT_TOLERANCE..=1.0 + UNIT_TOLERANCE).contains(&v.length());
        rule("normal", "is not of unit length", self.normals.iter().position(not_unit), 1)?;
        rule("texture coordinate", finite, self.uvs.iter().position(|uv| !uv.is_finite()), 1)?;
        let not_in_atlas = |uv: &Vec2| !(uv.cmpge(Vec2::ZERO).all() && uv.cmple(Vec2::ONE).all());
        rule("place in the atlas", "is not in [0, 1]", self.texel_uvs.iter().position(not_in_atlas), 1)?;
        let not_albedo = |a: &Vec3| !(a.cmpge(Vec3::ZERO).all() && a.cmple(Vec3::ONE).all());
        rule("albedo", "is not in [0, 1]", self.albedo.iter().position(not_albedo), 1)?;
        rule("valid", "is neither 0 nor 1", self.valid.iter().position(|&v| v > 1), 1)?;
        let not_finite = |f: &f32| !f.is_finite();
        rule("sky transfer", finite, self.light.sky_transfer.iter().position(not_finite), layout.transfer_floats())?;
        rule("sun bounce", finite, self.light.sun_bounce.iter().position(not_finite), layout.bounce_floats().max(1))?;
        let words = layout.mask_words();
        let unused = if layout.sun_steps.is_multiple_of(32) { 0 } else { u32::MAX << (layout.sun_steps % 32) };
        let stray = self.light.sun_mask.iter().skip(words - 1).step_by(words).position(|w| w & unused != 0);
        rule("sun mask", "has bits beyond the last step", stray, 1)
    }
}
