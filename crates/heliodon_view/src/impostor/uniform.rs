//! What impostor.wgsl reads, as the processor writes it.

use bevy::math::Vec4;
use bytemuck::{Pod, Zeroable};
use heliodon_bundle::impostor::{Choice, ImpostorInfo, MAX_VIEWS};

/// `Person` of impostor.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct PersonUniform {
    pub place: Vec4,
    pub turn: Vec4,
    pub light: [Vec4; 6],
    pub shadow: Vec4,
    pub worn: Vec4,
}

/// Size of `Person`.
pub const PERSON_BYTES: usize = size_of::<PersonUniform>();

/// An entry of `order`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
pub struct SeenUniform {
    person: u32,
    views: u32,
    weights: [u32; 2],
}

/// Size of an entry of `order`.
pub const SEEN_BYTES: usize = size_of::<SeenUniform>();

#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
struct ViewUniform {
    right: Vec4,
    up: Vec4,
    toward: Vec4,
    window: Vec4,
}

/// `Kind` of impostor.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct KindUniform {
    reach: Vec4,
    frame: Vec4,
    views: [ViewUniform; MAX_VIEWS as usize],
}

/// Size of `Kind`.
pub const KIND_BYTES: usize = size_of::<KindUniform>();

impl SeenUniform {
    /// A person in the views that were chosen.
    #[must_use]
    pub fn new(person: u32, choice: &Choice) -> Self {
        let views = choice.views.iter().zip(0..).fold(0, |all, (view, k)| all | (view & 255) << (8 * k));
        let code = |weight: f32| (weight.clamp(0.0, 1.0) * 65535.0 + 0.5) as u32;
        let [a, b, c, d] = choice.weights.map(code);
        Self { person, views, weights: [a | b << 16, c | d << 16] }
    }
}

impl KindUniform {
    /// What stays of an impostor whose texture has so many levels.
    #[must_use]
    pub fn new(info: &ImpostorInfo, levels: u32) -> Self {
        let mut uniform = Self::zeroed();
        let [low, high] = info.heights_m;
        uniform.reach = Vec4::new(info.radius_m, info.around_m, 0.5 * (high - low).max(1e-4), 0.0);
        let [columns, rows] = info.grid;
        let [left, bottom, right, top] = info.windows_m.first().copied().unwrap_or([0.0, 0.0, 1.0, 1.0]);
        // the denser of the two directions, so that neither is blurred
        let texels = (info.frame_px[0] as f32 / (right - left)).min(info.frame_px[1] as f32 / (top - bottom));
        uniform.frame = Vec4::new(1.0 / columns as f32, 1.0 / rows as f32, texels, levels.saturating_sub(1) as f32);
        for ((view, [right, up, toward]), window) in uniform.views.iter_mut().zip(info.view_axes()).zip(&info.windows_m) {
            *view = ViewUniform {
                right: right.extend(window[0]),
                up: up.extend(window[3]),
                toward: toward.extend(0.0),
                window: Vec4::new(1.0 / (window[2] - window[0]), 1.0 / (window[3] - window[1]), 0.0, 0.0),
            };
        }
        uniform
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn choices_are_packed_without_loss_that_shows() {
        let choice = Choice { views: [127, 3, 0, 64], weights: [0.6, 0.25, 0.1, 0.05] };
        let seen = SeenUniform::new(9, &choice);
        assert_eq!((seen.person, seen.views), (9, 127 | 3 << 8 | 64 << 24));
        let weight = |word: u32, shift: u32| (word >> shift & 0xffff) as f32 / 65535.0;
        let back =
            [weight(seen.weights[0], 0), weight(seen.weights[0], 16), weight(seen.weights[1], 0), weight(seen.weights[1], 16)];
        assert!(back.iter().zip(choice.weights).all(|(a, b)| (a - b).abs() < 1e-4));
    }
}
