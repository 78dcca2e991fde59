// Daylight in texels; heliodon_bundle::texels is its reference. `TexelMoment` is that of daylight/texels.rs.

struct TexelMoment {
    // xyz: unit direction to the sun.
    sun_direction: vec4<f32>,
    // rgb: irradiance at normal incidence times exposure; over pi, and as it is.
    sun_over_pi: vec4<f32>,
    sun: vec4<f32>,
    // x, y: weights of the two mask bits.
    mask_weights: vec4<f32>,
    // Word and bit of the one and of the other.
    mask: vec4<u32>,
    // x, y: layers of sky and bounce.
    layers: vec4<u32>,
    // For each layer what its four numbers give to red, green and blue; of the sky times exposure.
    sky: array<mat3x4<f32>, 7>,
    bounce: array<mat3x4<f32>, 48>,
    // Of a panorama: xyz: where it is seen from; w: the part of a face that is its quarter of the view, along a side.
    middle: vec4<f32>,
}
