//! From scene light to the display: exposure, tone curve, display gamma.
//!
//! The stone and the sky write what the display shows straight into Bevy's main texture, so no intermediate HDR target and
//! no tone mapping pass are needed: on software Vulkan such a pass over 1024x768 pixels costs several milliseconds.

pub mod codes;

use bevy::render::render_resource::TextureFormat;
use glam::Vec3;

/// WGSL of [`display`]; wants `const CURVE: u32`, `const ENCODE: bool` and `const DITHER: bool` before it.
pub(crate) const DISPLAY_WGSL: &str = include_str!("display.wgsl");

/// How exposed light becomes a displayed value in [0, 1].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum ToneCurve {
    /// Clamped to [0, 1], as in the paper (section 4).
    #[default]
    Clamp,
    /// John Hable, "Filmic Tonemapping Operators", 2010, with its published constants: shoulders for the sun-lit marble,
    /// at the price of contrast in the middle.
    Filmic,
    /// Scene light as it is, exposed and not clamped: for linear pictures (EXR). Only useful with a float target.
    Linear,
}

impl ToneCurve {
    /// The curve as the shaders' `CURVE` names it.
    pub(crate) fn code(self) -> u32 {
        match self {
            Self::Clamp => 0,
            Self::Filmic => 1,
            Self::Linear => 2,
        }
    }

    /// The other one of the two curves that people choose between.
    #[must_use]
    pub fn toggled(self) -> Self {
        match self {
            Self::Filmic => Self::Clamp,
            Self::Clamp | Self::Linear => Self::Filmic,
        }
    }
}

/// What the shaders that write colour are specialised for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct DisplayKey {
    pub curve: ToneCurve,
    pub format: TextureFormat,
}

impl DisplayKey {
    /// Whether the shader must apply the sRGB transfer function itself: an 8-bit target that does not do it on writing.
    fn encodes(self) -> bool {
        matches!(self.format, TextureFormat::Rgba8Unorm | TextureFormat::Bgra8Unorm)
    }

    /// Whether the target rounds to 8-bit codes.
    fn dithers(self) -> bool {
        self.encodes() || matches!(self.format, TextureFormat::Rgba8UnormSrgb | TextureFormat::Bgra8UnormSrgb)
    }

    /// The WGSL that goes before a shader that calls `display`.
    pub(crate) fn wgsl(self) -> String {
        let (curve, encodes, dithers) = (self.curve.code(), self.encodes(), self.dithers());
        format!(
            "const CURVE: u32 = {curve}u;\nconst ENCODE: bool = {encodes};\nconst DITHER: bool = {dithers};\n{DISPLAY_WGSL}\n"
        )
    }
}

fn hable(x: f32) -> f32 {
    (x * (0.15 * x + 0.05) + 0.004) / (x * (0.15 * x + 0.5) + 0.06) - 0.02 / 0.3
}

/// The displayed value, linear, of linear scene radiance at an exposure of `stops`: what the shaders compute, before display
/// gamma. In [0, 1] for all but [`ToneCurve::Linear`].
#[must_use]
pub fn display(radiance: Vec3, stops: f32, curve: ToneCurve) -> Vec3 {
    let exposed = radiance * libm::exp2f(stops);
    match curve {
        ToneCurve::Clamp => exposed.clamp(Vec3::ZERO, Vec3::ONE),
        ToneCurve::Filmic => {
            let white = hable(11.2);
            (2.0 * exposed.max(Vec3::ZERO)).map(|x| hable(x) / white).clamp(Vec3::ZERO, Vec3::ONE)
        }
        ToneCurve::Linear => exposed,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_are_monotonic_and_reach_black_and_white() {
        for curve in [ToneCurve::Clamp, ToneCurve::Filmic] {
            assert!(display(Vec3::ZERO, 0.0, curve).max_element() < 1e-6);
            assert_eq!(display(Vec3::splat(1000.0), 0.0, curve), Vec3::ONE);
            let shown: Vec<f32> = (0..100).map(|i| display(Vec3::splat(i as f32 / 50.0), 0.0, curve).x).collect();
            assert!(shown.windows(2).all(|pair| pair[0] <= pair[1]));
        }
    }

    #[test]
    fn a_stop_doubles() {
        assert_eq!(display(Vec3::splat(0.1), 2.0, ToneCurve::Clamp), Vec3::splat(0.4));
    }
}
