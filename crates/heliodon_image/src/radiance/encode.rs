//! Writing a Radiance picture.

use crate::HdrImage;
use glam::Vec3;

/// The shortest run that is worth its two bytes (Radiance, `color.c`: MINRUN).
const MIN_RUN: usize = 4;

/// The bytes of a file in the new run-length form, or flat where the width does not allow it.
pub(crate) fn encode(image: &HdrImage) -> Vec<u8> {
    let mut out = format!("#?RADIANCE\nSOFTWARE=heliodon\nFORMAT=32-bit_rle_rgbe\n\n-Y {} +X {}\n", image.height, image.width)
        .into_bytes();
    let width = image.width as usize;
    if width == 0 {
        return out;
    }
    let mut scanline = vec![[0_u8; 4]; width];
    let mut component = vec![0_u8; width];
    for row in image.pixels.chunks_exact(width) {
        for (rgbe, &color) in scanline.iter_mut().zip(row) {
            *rgbe = rgbe_from_radiance(color);
        }
        if (8..=0x7fff).contains(&width) {
            out.extend([2, 2, (width >> 8) as u8, width as u8]);
            for c in 0..4 {
                component.iter_mut().zip(&scanline).for_each(|(byte, rgbe)| *byte = rgbe[c]);
                push_runs(&component, &mut out);
            }
        } else {
            out.extend(scanline.iter().flatten());
        }
    }
    out
}

/// The nearest pixel; the mantissa of the largest component lies in 128..=255.
fn rgbe_from_radiance(color: Vec3) -> [u8; 4] {
    let color = color.max(Vec3::ZERO); // also takes NaN to 0
    let largest = color.max_element().min(f32::MAX);
    if largest < 1e-32 {
        return [0; 4];
    }
    let (_, mut exponent) = libm::frexp(f64::from(largest));
    let mantissa = |c: f32, exponent: i32| libm::round(libm::ldexp(f64::from(c), 8 - exponent));
    if mantissa(largest, exponent) > 255.0 {
        exponent += 1; // rounding carried over
    }
    if exponent + 128 > 255 {
        return [255, 255, 255, 255];
    }
    let byte = |c: f32| mantissa(c, exponent).min(255.0) as u8;
    [byte(color.x), byte(color.y), byte(color.z), (exponent + 128) as u8]
}

fn push_runs(component: &[u8], out: &mut Vec<u8>) {
    let mut x = 0;
    while x < component.len() {
        // literals up to the next run
        let mut run_at = x;
        let mut run = 0;
        while run_at < component.len() {
            run = component[run_at..].iter().take(127).take_while(|&&b| b == component[run_at]).count();
            if run >= MIN_RUN {
                break;
            }
            run_at += run;
        }
        for literals in component[x..run_at].chunks(128) {
            out.push(literals.len() as u8);
            out.extend(literals);
        }
        x = run_at;
        if x < component.len() {
            out.extend([128 + run as u8, component[x]]);
            x += run;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn components_are_the_nearest_of_a_shared_exponent() {
        assert_eq!(rgbe_from_radiance(Vec3::ONE), [128, 128, 128, 129]);
        assert_eq!(rgbe_from_radiance(Vec3::new(0.999, 0.0, 0.5)), [128, 0, 64, 129]);
        assert_eq!(rgbe_from_radiance(Vec3::ZERO), [0; 4]);
        assert_eq!(rgbe_from_radiance(Vec3::new(f32::NAN, -1.0, 1e-40)), [0; 4]);
        assert_eq!(rgbe_from_radiance(Vec3::splat(f32::INFINITY)), [255; 4]);
    }
}
