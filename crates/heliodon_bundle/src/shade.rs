//! The light of a vertex at a moment: the one reference for shading, which shaders mirror.
//!
//! ```text
//! light = (w0 bit_t0 + w1 bit_t1) max(n.l, 0) E / pi  +  max(0, sum_i T_i S_i)  +  E max(0, sum_r b_r f_r)
//! ```
//!
//! with `S` and `E` of [`crate::moment::Shading`]. Light is irradiance / pi; the radiance that leaves a surface is `albedo * light`, what is shown of it
//! `albedo * light * 2^exposure_stops`.

use crate::chunk::{LitChunk, VertexLight};
use crate::moment::Moment;
use glam::Vec3;
use std::f32::consts::FRAC_1_PI;

/// The light of a vertex by where it comes from; each linear RGB, irradiance / pi, not negative.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Light {
    /// Straight from the sun.
    pub sun: Vec3,
    /// From the sky, straight and bounced.
    pub sky: Vec3,
    /// From the sun, bounced.
    pub bounce: Vec3,
}

impl Light {
    /// All of it.
    #[must_use]
    pub fn total(&self) -> Vec3 {
        self.sun + self.sky + self.bounce
    }
}

/// The light of a vertex with unit normal `normal`.
///
/// # Panics
/// If the light has no such vertex, or not the mask bits that the moment names.
#[must_use]
pub fn vertex_light(moment: &Moment, light: &VertexLight, vertex: usize, normal: Vec3) -> Light {
    let layout = light.layout();
    let reached = sun_reached(moment, light, vertex);
    let sun = moment.shading.sun_irradiance * (reached * normal.dot(moment.sun_direction).max(0.0) * FRAC_1_PI);

    let channels = layout.channels as usize;
    let own = |count: usize| vertex * count..(vertex + 1) * count;
    let transfer = &light.sky_transfer[own(layout.transfer_floats())];
    let sky = weighted(transfer, channels, moment.shading.sky.iter().copied()).max(Vec3::ZERO);
    let functions = &light.sun_bounce[own(layout.bounce_floats())];
    let bounced = weighted(functions, channels, moment.bounce.iter().map(|&f| Vec3::splat(f))).max(Vec3::ZERO);
    Light { sun, sky, bounce: moment.shading.sun_irradiance * bounced }
}

/// The part of the sun that reaches a vertex, 0 to 1: `w0 bit_t0 + w1 bit_t1`.
///
/// # Panics
/// As [`vertex_light`].
#[must_use]
pub fn sun_reached(moment: &Moment, light: &VertexLight, vertex: usize) -> f32 {
    let [b0, b1] = moment.mask_bits.map(|bit| f32::from(u8::from(light.sun_reaches(vertex, bit))));
    moment.mask_weights[0] * b0 + moment.mask_weights[1] * b1
}

/// `sum_i values_i * weights_i`, per channel; grey values count for all three.
pub(crate) fn weighted(values: &[f32], channels: usize, weights: impl Iterator<Item = Vec3>) -> Vec3 {
    let mut sum = Vec3::ZERO;
    for (value, weight) in values.chunks_exact(channels).zip(weights) {
        sum += weight * if channels == 3 { Vec3::new(value[0], value[1], value[2]) } else { Vec3::splat(value[0]) };
    }
    sum
}

/// The light of all vertices of a chunk.
#[must_use]
pub fn chunk_light(moment: &Moment, chunk: &LitChunk) -> Vec<Vec3> {
    let normals = chunk.normals.iter().enumerate();
    normals.map(|(vertex, &normal)| vertex_light(moment, &chunk.light, vertex, normal).total()).collect()
}
