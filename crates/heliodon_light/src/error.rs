//! What can be wrong with what the solver is given.

use thiserror::Error;

/// Why light cannot be solved as asked.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum LightError {
    /// Normals and positions are not in step.
    #[error("{normals} normals for {positions} positions: there must be one normal for each vertex")]
    Normals {
        /// Positions given.
        positions: usize,
        /// Normals given.
        normals: usize,
    },
    /// A triangle names a vertex that is not there.
    #[error("triangle {triangle} names vertex {vertex}, but there are {vertices} vertices")]
    VertexIndex {
        /// The triangle.
        triangle: usize,
        /// The vertex that it names.
        vertex: u32,
        /// How many vertices there are.
        vertices: usize,
    },
    /// More vertices, triangles or cells than 31-bit numbers count.
    #[error("{what}: {count}, more than 2^31 - 1; split the site into smaller ones")]
    TooMany {
        /// What there are too many of.
        what: &'static str,
        /// How many.
        count: usize,
    },
    /// A parameter outside its range.
    #[error("{name} is {value}, but must be {allowed}")]
    Parameter {
        /// The parameter's name.
        name: &'static str,
        /// Its value.
        value: String,
        /// What is allowed.
        allowed: &'static str,
    },
    /// The parts of a solve do not belong together.
    #[error("{0}")]
    Mismatch(String),
    /// A saved block cannot be read.
    #[error("saved block of light: {0}; delete it, so that it is computed again")]
    Block(&'static str),
}
