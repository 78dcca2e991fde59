//! Hosek and Wilkie's dome, by the crate `hw-skymodel`, which gives the fit's numbers; the formula is evaluated here with `libm`.

use super::ModelParams;
use glam::Vec3;
use heliodon_image::HdrImage;
use heliodon_math::color::luminance;
use hw_skymodel::rgb::{SkyParams, SkyState};
use std::f32::consts::PI;

/// The heights between which the dome fades into the atmosphere model's.
const FADE_DEG: (f32, f32) = (0.0, 3.0);

/// The map, `physical()` being the atmosphere model's for the same sun. The ground is always that of the atmosphere model.
pub(super) fn map(params: &ModelParams, sun: Vec3, width: u32, height: u32, physical: impl FnOnce() -> HdrImage) -> HdrImage {
    let mut image = physical();
    let elevation = libm::asinf(sun.y.clamp(-1.0, 1.0));
    let share = ((elevation.to_degrees() - FADE_DEG.0) / (FADE_DEG.1 - FADE_DEG.0)).clamp(0.0, 1.0);
    let share = share * share * (3.0 - 2.0 * share);
    let sky = SkyParams {
        elevation: elevation.clamp(0.0, 0.5 * PI),
        turbidity: params.turbidity,
        albedo: params.ground_albedo.clamp(Vec3::ZERO, Vec3::ONE).to_array(),
    };
    let Ok(state) = SkyState::new(&sky) else { return image };
    if share == 0.0 {
        return image;
    }
    let (coefficients, radiances) = state.raw();
    let upper = (height / 2) as usize * width as usize;
    let dome: Vec<Vec3> = (0..upper)
        .map(|i| {
            let (x, y) = (i as u32 % width, i as u32 / width);
            let (theta, azimuth) = ((y as f32 + 0.5) / height as f32 * PI, ((x as f32 + 0.5) / width as f32 * 2.0 - 1.0) * PI);
            let ((s, c), (sa, ca)) = (libm::sincosf(theta), libm::sincosf(azimuth));
            let cosine = Vec3::new(s * sa, c, -s * ca).dot(sun).clamp(-1.0, 1.0);
            Vec3::from_array(std::array::from_fn(|channel| {
                radiance(&coefficients[9 * channel..9 * channel + 9], radiances[channel], c, cosine)
            }))
            .max(Vec3::ZERO)
        })
        .collect();
    // The fit's RGB has a scale of its own: the dome is given the atmosphere model's illuminance on level ground, so that
    // it keeps in step with the sun and with twilight.
    let level = |pixels: &[Vec3]| -> f64 {
        (0..upper)
            .map(|i| {
                let theta = ((i as u32 / width) as f32 + 0.5) / height as f32 * PI;
                f64::from(luminance(pixels[i]) * libm::cosf(theta) * libm::sinf(theta))
            })
            .sum()
    };
    let scale = (level(&image.pixels) / level(&dome).max(1e-30)) as f32;
    for (pixel, fitted) in image.pixels.iter_mut().zip(dome) {
        *pixel = pixel.lerp(fitted * scale, share);
    }
    image
}

/// Equation 8 of the paper, times the mean radiance of the channel.
fn radiance(p: &[f32], mean: f32, cos_theta: f32, cos_gamma: f32) -> f32 {
    let gamma = libm::acosf(cos_gamma);
    let mie = (1.0 + cos_gamma * cos_gamma) / libm::powf(1.0 + p[8] * p[8] - 2.0 * p[8] * cos_gamma, 1.5);
    let zenith = cos_theta.max(0.0);
    let left = 1.0 + p[0] * libm::expf(p[1] / (zenith + 0.01));
    let right = p[2] + p[3] * libm::expf(p[4] * gamma) + p[5] * cos_gamma * cos_gamma + p[6] * mie + p[7] * zenith.sqrt();
    mean * left * right
}
