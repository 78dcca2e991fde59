//! Linear colour in four bytes with a common exponent, in an 8-bit picture: for devices that know no textures of floats.
//!
//! G. Ward: "Real Pixels", Graphics Gems II, 1991. A shader multiplies: `rgb * 256 * exp2(255 * a - 136)` of components from 0 to 1. Filter after that, not
//! before: exponents have no means.

use crate::{HdrImage, SrgbImage};
use glam::Vec3;

/// The image with the common exponent, plus 128, in the fourth component. Errors are at most 1/256 of the largest component, and each component is a multiple of
/// [`rgbe8_step`]. Not a picture to look at, and not sRGB.
#[must_use]
pub fn rgbe8(image: &HdrImage) -> SrgbImage {
    SrgbImage { width: image.width, height: image.height, pixels: image.pixels.iter().map(|&color| encode(color)).collect() }
}

/// The image that [`rgbe8`] was made from.
#[must_use]
pub fn from_rgbe8(image: &SrgbImage) -> HdrImage {
    HdrImage { width: image.width, height: image.height, pixels: image.pixels.iter().map(|&pixel| decode(pixel)).collect() }
}

/// What lies between two values of a component, beside the others of a colour; `None` where it becomes black. With it a colour has components of at most 255 steps.
#[must_use]
pub fn rgbe8_step(color: Vec3) -> Option<f32> {
    Some(libm::ldexpf(1.0, common_exponent(color)? - 8))
}

fn common_exponent(color: Vec3) -> Option<i32> {
    let largest = if color.is_finite() { color.max_element() } else { 0.0 };
    if largest < 1.0e-32 {
        return None;
    }
    let (_, exponent) = libm::frexpf(largest);
    // a component that rounds up to 256 takes the next exponent
    let rounds_up = (libm::ldexpf(largest, 8 - exponent) + 0.5) as u32 > 255;
    Some(if rounds_up { exponent + 1 } else { exponent })
}

fn encode(color: Vec3) -> [u8; 4] {
    let Some(exponent) = common_exponent(color) else { return [0; 4] };
    let component = |x: f32| (libm::ldexpf(x.max(0.0), 8 - exponent) + 0.5).min(255.0) as u8;
    [component(color.x), component(color.y), component(color.z), (exponent + 128).clamp(0, 255) as u8]
}

fn decode([r, g, b, exponent]: [u8; 4]) -> Vec3 {
    if exponent == 0 {
        return Vec3::ZERO;
    }
    Vec3::new(f32::from(r), f32::from(g), f32::from(b)) * libm::ldexpf(1.0, i32::from(exponent) - 136)
}

#[cfg(test)]
mod tests {
    use super::*;
    use heliodon_math::random::Pcg32;

    #[test]
    fn colours_come_back_to_a_256th_of_their_largest_component() {
        let mut rng = Pcg32::new(8, 1);
        let color = |_, _| Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32()) * libm::exp2f(rng.range_f32(-20.0, 20.0));
        let image = HdrImage::from_fn(50, 50, color);
        let back = from_rgbe8(&rgbe8(&image));
        for (a, b) in image.pixels.iter().zip(&back.pixels) {
            assert!((*a - *b).abs().max_element() <= a.max_element() / 255.0, "{a} became {b}");
            let steps = *b / rgbe8_step(*a).unwrap();
            assert!(steps.fract() == Vec3::ZERO && steps.max_element() <= 255.0, "{a}: {steps}");
        }
        let odd = HdrImage { width: 3, height: 1, pixels: vec![Vec3::NAN, Vec3::ZERO, Vec3::new(-1.0, 0.999_999, 0.0)] };
        assert_eq!(from_rgbe8(&rgbe8(&odd)).pixels, [Vec3::ZERO, Vec3::ZERO, Vec3::new(0.0, 1.0, 0.0)]);
    }
}
