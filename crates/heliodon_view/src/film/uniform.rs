//! What film.wgsl reads, as the processor writes it.

use bevy::math::{Vec3, Vec4};
use bytemuck::{Pod, Zeroable};

/// `Film` of film.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct FilmUniform {
    pub place: Vec4,
    pub right: Vec4,
    pub up: Vec4,
    pub feet: Vec4,
    pub head: Vec4,
    pub sky: Vec4,
    pub sun: Vec4,
    pub size: Vec4,
}

/// Size of `Film` in film.wgsl, which a test compares with what the shader's compiler says.
pub const FILM_BYTES: usize = size_of::<FilmUniform>();

/// A corner of a part that shows a film.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct SurfaceVertex {
    pub position: Vec3,
    pub uv: [f32; 2],
    pub light: Vec3,
}

/// Bytes of a [`SurfaceVertex`].
pub const SURFACE_VERTEX_BYTES: usize = size_of::<SurfaceVertex>();
