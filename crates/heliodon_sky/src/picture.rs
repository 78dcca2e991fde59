//! A picture of what was found in a sky.

use crate::lapse::LapseStep;
use crate::mapping::{Geometry, Mapping};
use glam::{DVec3, Vec3};
use heliodon_image::{HdrImage, SheetLayout, SrgbImage, contact_sheet};
use heliodon_math::color::{luminance, srgb8_from_linear};
use heliodon_math::sh::radiance;

/// The ring about the sun: its half-angle, and half its line's width.
const RING_DEG: f64 = 4.0;
const LINE_DEG: f64 = 0.45;

/// The step's map as it is drawn, the sun marked with a ring (yellow; red where it was clipped), and below it the sky rebuilt from the
/// step's coefficients, both at one exposure. `map` is lat-long; the picture is `width` pixels wide but for its margins.
#[must_use]
pub fn found_picture(map: &HdrImage, step: &LapseStep, width: u32) -> SrgbImage {
    let width = width.max(2);
    let height = width / 2;
    let seen = map.resized_lat_long(width, height);
    let coefficients: Vec<Vec3> = step.sky.iter().map(|&s| Vec3::from_array(s)).collect();
    let Ok(geometry) = Geometry::new(Mapping::LatLong, width, height, 0.0) else { return SrgbImage::filled(0, 0, [0; 4]) };
    let direction = |x: u32, y: u32| geometry.direction(f64::from(x) + 0.5, f64::from(y) + 0.5).unwrap_or(DVec3::Y);
    // the sky's mean, without the sun, comes to a middle grey, so that night and noon both show
    let mean = coefficients.first().map_or(0.0, |&s| luminance(s) * 0.282_094_8);
    let scale = if mean > 0.0 { 0.5 / mean } else { 1.0 };
    let mut above = toned(&seen, scale);
    if let Some(sun) = step.sun {
        let sun_direction = Vec3::from_array(sun.direction).as_dvec3();
        let color: [u8; 3] = if sun.clipped { [255, 60, 40] } else { [255, 225, 60] };
        for y in 0..height {
            for x in 0..width {
                let angle_deg = direction(x, y).dot(sun_direction).clamp(-1.0, 1.0).acos().to_degrees();
                let off = (angle_deg - RING_DEG).abs();
                let line = (2.0 - off / LINE_DEG).clamp(0.0, 1.0) as f32;
                // a dark rim keeps the ring visible before a white sky
                let rim = (3.5 - off / LINE_DEG).clamp(0.0, 1.0) as f32 * 0.6;
                let pixel = &mut above.pixels[(y * width + x) as usize];
                for (value, ring) in pixel.iter_mut().zip(color) {
                    let darkened = f32::from(*value) * (1.0 - rim);
                    *value = (darkened + (f32::from(ring) - darkened) * line).round() as u8;
                }
            }
        }
    }
    let rebuilt = HdrImage::from_fn(width, height, |x, y| radiance(&coefficients, direction(x, y).as_vec3()).max(Vec3::ZERO));
    contact_sheet(&[above, toned(&rebuilt, scale)], &SheetLayout { columns: 1, ..SheetLayout::default() })
}

/// `1 - e^(-scale L)`, sRGB.
fn toned(image: &HdrImage, scale: f32) -> SrgbImage {
    let code = |v: f32| srgb8_from_linear(1.0 - libm::expf(-v * scale));
    let pixels = image.pixels.iter().map(|c| [code(c.x), code(c.y), code(c.z), 255]).collect();
    SrgbImage { width: image.width, height: image.height, pixels }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lapse::Sun;

    #[test]
    fn the_ring_stands_about_the_sun_and_the_rebuilt_sky_below() {
        let map = HdrImage::filled(128, 64, Vec3::ONE);
        let mut sky = vec![[0.0; 3]; 4];
        sky[0] = [(4.0 * std::f32::consts::PI).sqrt(); 3];
        let direction = [0.0, 0.5, -(0.75_f32.sqrt())];
        let step = LapseStep {
            time: "12:00".into(),
            sun: Some(Sun { direction, irradiance: [1.0; 3], clipped: false }),
            sky,
            fitted: None,
            exposure_stops: 0.0,
            sky_map: String::new(),
            mask_bit: 0,
            sun_in_map: true,
        };
        let picture = found_picture(&map, &step, 256);
        assert_eq!((picture.width, picture.height), (272, 280));
        // north, 30 degrees up, is a third down the upper half of the picture
        let sun_at = (8 + 128, 8 + 128 / 3);
        let ring_at = picture.pixel(sun_at.0 + 3, sun_at.1);
        assert!(ring_at[0] > 200 && ring_at[2] < 150, "{ring_at:?}");
        assert_eq!(picture.pixel(sun_at.0, sun_at.1), picture.pixel(20, 20), "nothing is drawn over the sun itself");
        assert_eq!(picture.pixel(20, 20), picture.pixel(20, 160), "the rebuilt sky agrees");
    }
}
