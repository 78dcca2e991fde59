//! The uniform of the light shader: one moment of the day, as [`heliodon_bundle::moment`] works it out.

use super::layout::VertexLayout;
use bytemuck::{Pod, Zeroable};
use glam::{Vec3, Vec4};
use heliodon_bundle::chunk::MAX_SUN_BOUNCE_FUNCTIONS;
use heliodon_bundle::moment::Moment;

/// One more than the most coefficients: the odd half of a last word reads it.
const SKY_SLOTS: usize = 10;
const BOUNCE_SLOTS: usize = MAX_SUN_BOUNCE_FUNCTIONS as usize + 1;

/// Irradiance / pi from the sky at a vertex in the open, averaged over all its orientations: what an even light around a guest
/// must be. T_0 of an open surface is y_0 whatever its normal, and the other bands cancel over all normals.
#[must_use]
pub fn mean_sky_light(moment: &Moment) -> Vec3 {
    moment.sky.first().map_or(Vec3::ZERO, |&s| (s * 0.282_094_8).max(Vec3::ZERO))
}

/// What the numbers of layers of four give to red, green and blue, where each of `values` weighs as many numbers as there are channels: one number that is
/// weighed by all three colours of its value, or three of which each is by its own.
pub(super) fn layer_weights(channels: usize, values: impl Iterator<Item = Vec3>, layers: &mut [[Vec4; 3]]) {
    for (i, value) in values.enumerate() {
        for color in 0..3 {
            let number = i * channels + color % channels;
            if let Some(layer) = layers.get_mut(number / 4) {
                layer[color][number % 4] = value[color];
            }
        }
    }
}

/// `Moment` of light.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct MomentUniform {
    sun_direction: Vec4,
    sun_over_pi: Vec4,
    sun: Vec4,
    mask_weights: Vec4,
    mask: [u32; 4],
    sky: [Vec4; SKY_SLOTS],
    bounce: [Vec4; BOUNCE_SLOTS],
}

/// Size of `Moment` in light.wgsl, which a test compares with what the shader's compiler says.
pub const MOMENT_BYTES: usize = 16 * (5 + SKY_SLOTS + BOUNCE_SLOTS);
const _: () = assert!(size_of::<MomentUniform>() == MOMENT_BYTES);

impl MomentUniform {
    /// The uniform for `moment` with all light multiplied by `exposure`, so that it fits into half floats at every hour.
    #[must_use]
    pub fn new(layout: VertexLayout, moment: &Moment, exposure: f32) -> Self {
        let mut uniform = Self::zeroed();
        let sun = moment.shading.sun_irradiance * exposure;
        uniform.sun_direction = moment.sun_direction.extend(0.0);
        uniform.sun_over_pi = (sun * std::f32::consts::FRAC_1_PI).extend(0.0);
        uniform.sun = sun.extend(0.0);
        uniform.mask_weights = Vec4::new(moment.mask_weights[0], moment.mask_weights[1], 0.0, 0.0);
        let [a, b] = moment.mask_bits.map(|bit| bit.min(layout.0.sun_steps - 1));
        uniform.mask = [a / 32, a % 32, b / 32, b % 32];
        let sky = moment.shading.sky.iter().take(layout.0.coefficients as usize);
        for (slot, &coefficient) in uniform.sky.iter_mut().zip(sky) {
            *slot = (coefficient * exposure).extend(0.0);
        }
        for (slot, &value) in uniform.bounce.iter_mut().zip(&moment.bounce) {
            slot.x = value;
        }
        uniform
    }
}
