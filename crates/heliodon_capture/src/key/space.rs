//! Codes, the space that edges were mixed in, and back.

use super::{Blending, Mixing};
use heliodon_math::color::{linear_from_srgb, linear_from_srgb8_table, srgb8_from_linear};
use std::sync::LazyLock;

/// A colour of three components.
pub(super) type Rgb = [f32; 3];

/// Steps of the table from linear light to codes: 20 of them in the narrowest code, at black.
const CODE_STEPS: usize = 1 << 16;
/// Steps of the table from encoded values to linear light, between which it is interpolated: within 1e-7.
const LINEAR_STEPS: usize = 1 << 12;

static LINEAR_FROM_CODE: LazyLock<[f32; 256]> = LazyLock::new(linear_from_srgb8_table);
static ENCODED_FROM_CODE: LazyLock<[f32; 256]> = LazyLock::new(|| std::array::from_fn(|code| code as f32 / 255.0));
static CODE_FROM_LINEAR: LazyLock<Vec<u8>> =
    LazyLock::new(|| (0..=CODE_STEPS).map(|step| srgb8_from_linear(step as f32 / CODE_STEPS as f32)).collect());
static LINEAR_FROM_ENCODED: LazyLock<Vec<f32>> =
    LazyLock::new(|| (0..=LINEAR_STEPS + 1).map(|step| linear_from_srgb(step as f32 / LINEAR_STEPS as f32)).collect());

/// The linear value of a code.
pub(super) fn linear_from_code(code: u8) -> f32 {
    LINEAR_FROM_CODE[usize::from(code)]
}

/// The nearest code of a linear value, clamped.
pub(super) fn code_from_linear(linear: f32) -> u8 {
    CODE_FROM_LINEAR[(linear.clamp(0.0, 1.0) * CODE_STEPS as f32 + 0.5) as usize]
}

/// The linear value of an encoded one in [0, 1].
pub(super) fn linear_from_encoded(encoded: f32) -> f32 {
    let at = encoded.clamp(0.0, 1.0) * LINEAR_STEPS as f32;
    let step = at as usize;
    let table = &*LINEAR_FROM_ENCODED;
    table[step] + (table[step + 1] - table[step]) * (at - step as f32)
}

/// The space in which foreground and screen add up.
#[derive(Clone, Copy, Debug)]
pub(super) struct Space {
    pub linear: bool,
    table: &'static [f32; 256],
}

impl Space {
    pub fn new(mixing: Mixing) -> Self {
        let linear = mixing != Mixing::Encoded;
        Self { linear, table: if linear { &LINEAR_FROM_CODE } else { &ENCODED_FROM_CODE } }
    }

    /// A pixel's colour in this space, in [0, 1].
    #[inline]
    pub fn of(&self, pixel: [u8; 4]) -> Rgb {
        [self.table[usize::from(pixel[0])], self.table[usize::from(pixel[1])], self.table[usize::from(pixel[2])]]
    }

    /// The nearest sRGB codes of a colour of this space.
    pub fn codes(&self, color: Rgb) -> [u8; 3] {
        color.map(|x| if self.linear { code_from_linear(x) } else { (x.clamp(0.0, 1.0) * 255.0 + 0.5) as u8 })
    }

    /// The stored codes of a premultiplied colour of this space.
    #[inline]
    pub fn store(&self, premultiplied: Rgb, alpha: f32, blending: Blending) -> [u8; 3] {
        match (self.linear, blending) {
            (true, Blending::Linear) => premultiplied.map(code_from_linear),
            (false, Blending::Encoded) => premultiplied.map(|x| (x.clamp(0.0, 1.0) * 255.0 + 0.5) as u8),
            // the foreground itself is converted, then premultiplied again
            (false, Blending::Linear) => {
                premultiplied.map(|x| code_from_linear(alpha * linear_from_encoded(x / alpha.max(1e-6))))
            }
            (true, Blending::Encoded) => {
                premultiplied.map(|x| (alpha * f32::from(code_from_linear(x / alpha.max(1e-6))) + 0.5) as u8)
            }
        }
    }
}

#[inline]
pub(super) fn dot(a: Rgb, b: Rgb) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline]
pub(super) fn lerp(a: Rgb, b: Rgb, t: f32) -> Rgb {
    std::array::from_fn(|i| a[i] + (b[i] - a[i]) * t)
}

#[inline]
pub(super) fn smoothstep(low: f32, high: f32, x: f32) -> f32 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// The wedge of colours around a screen's hue: Vlahos's colour difference, turned onto it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wedge {
    /// Unit vector of the screen's colour in the plane of colours without brightness.
    along: Rgb,
    /// Perpendicular to it in that plane.
    across: Rgb,
    /// The cotangent of half the wedge.
    slope: f32,
}

impl Wedge {
    /// Around the hue of a colour; `None` of a grey.
    pub fn around(screen: Rgb, half_deg: f32) -> Option<Self> {
        let mean = (screen[0] + screen[1] + screen[2]) / 3.0;
        let chroma = screen.map(|x| x - mean);
        let length = dot(chroma, chroma).sqrt();
        if length.is_nan() || length < 1e-4 {
            return None;
        }
        let along = chroma.map(|x| x / length);
        // (1, 1, 1) / sqrt(3) x along
        let third = 1.0 / libm::sqrtf(3.0);
        let across = [(along[2] - along[1]) * third, (along[0] - along[2]) * third, (along[1] - along[0]) * third];
        let half = half_deg.to_radians();
        Some(Self { along, across, slope: libm::cosf(half) / libm::sinf(half) })
    }

    /// How much of the screen's colour is in a colour: positive inside of the wedge.
    #[inline]
    pub fn difference(&self, color: Rgb) -> f32 {
        dot(color, self.along) - self.slope * dot(color, self.across).abs()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wedge_of_sixty_degrees_is_vlahos() {
        let wedge = Wedge::around([0.0, 1.0, 0.0], 60.0).unwrap();
        let scale = 1.5_f32.sqrt();
        for color in [[0.2, 0.7, 0.4], [0.9, 0.1, 0.3], [0.5, 0.5, 0.5], [0.3, 0.8, 0.1], [0.0, 0.2, 0.9]] {
            let [r, g, b]: Rgb = color;
            assert!((scale * wedge.difference(color) - (g - r.max(b))).abs() < 1e-5, "{color:?}");
        }
        assert!(Wedge::around([0.3; 3], 60.0).is_none() && Wedge::around([f32::NAN; 3], 60.0).is_none());
    }

    #[test]
    fn codes_survive_and_premultiplied_colours_are_right() {
        for mixing in [Mixing::Linear, Mixing::Encoded] {
            let space = Space::new(mixing);
            for code in 0..=255 {
                let pixel = [code, 255 - code, code / 2, 255];
                assert_eq!(space.codes(space.of(pixel)), [code, 255 - code, code / 2]);
                assert_eq!(space.store(space.of(pixel), 1.0, Blending::Linear), [code, 255 - code, code / 2]);
                assert_eq!(space.store(space.of(pixel), 1.0, Blending::Encoded), [code, 255 - code, code / 2]);
            }
        }
        // half of a white: 188 in linear light, 128 in codes
        assert_eq!(Space::new(Mixing::Encoded).store([0.5; 3], 0.5, Blending::Linear), [188; 3]);
        assert_eq!(Space::new(Mixing::Linear).store([0.5; 3], 0.5, Blending::Encoded), [128; 3]);
        assert!((linear_from_encoded(0.5) - linear_from_srgb(0.5)).abs() < 1e-6 && linear_from_encoded(1.0) == 1.0);
    }
}
