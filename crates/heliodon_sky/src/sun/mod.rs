//! The sun in a probe, from its brightest pixels.
//!
//! Everything is done on directions, not in the image's plane, so that edges, poles and seams need no special care:
//!
//! 1. the brightest pixel near or above the horizon, and all pixels within a few degrees of it;
//! 2. the core: pixels above half the peak; the aperture: all pixels that the core's disc touches, at least the sun's own half
//!    a degree;
//! 3. the sky behind it: per colour, the logarithm of radiance in a ring about the aperture fitted by a straight line over the
//!    angle from the sun, which is carried on inward (the aureole grows towards the sun, so a ring's mean would be too dark);
//! 4. direction: the centroid of solid angle times (radiance - sky behind); irradiance: its sum. This repeats.
//! 5. a sharp disc of the sun's size is fitted to the aperture's pixels, which finds its middle within a pixel that is larger than it. Where a pixel
//!    holds all of the disc, the middle of the places that it may have. A mirror ball 768 pixels wide has pixels longer than 0.73 degrees within 48 degrees of
//!    the point behind it; there a direction may err by more than 0.1 degree.
//!
//! It is a sun where the core is small, stands far out of the ring, and nothing else in the image is as bright: not a window, a lamp
//! among lamps, or a cloud.

mod aperture;
mod clipped;

pub(crate) use aperture::Patch;

use crate::lapse::Sun;
use crate::probe::Probe;
use glam::{DVec3, Vec3};
use heliodon_math::color::luminance;

/// Half the sun's mean apparent diameter of 0.53 degrees.
pub const SUN_RADIUS_DEG: f64 = 0.265;

/// When a bright spot is a sun.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SunParams {
    /// How many times brighter than the sky in the ring around it the sun's middle must be. Less takes thinly veiled suns and
    /// bright clouds; more only suns in a clear sky.
    pub min_contrast: f32,
    /// The largest half-angle, in degrees, of what is brighter than half its peak: photographs spread the sun by lens and resampling.
    pub max_radius_deg: f64,
    /// How bright, as a part of the peak, something more than 10 degrees away may be. Lamps and windows come in numbers, suns do not.
    pub max_rival: f32,
    /// The least irradiance, as a part of what all the rest of the image gives a surface on average. Below it a spot changes nothing,
    /// unless it is clipped.
    pub min_share: f64,
    /// The least elevation in degrees of a sun's middle: it is looked for from a little below the horizon.
    pub min_elevation_deg: f64,
}

impl Default for SunParams {
    fn default() -> Self {
        Self { min_contrast: 12.0, max_radius_deg: 3.0, max_rival: 0.5, min_share: 0.02, min_elevation_deg: -2.0 }
    }
}

/// A sun that was found.
#[derive(Clone, Debug, PartialEq)]
pub struct FoundSun {
    /// Its direction, irradiance, and whether it was clipped.
    pub sun: Sun,
    /// The half-angle in degrees of the disc from which it was taken.
    pub radius_deg: f64,
    /// Peak over the sky around it.
    pub contrast: f32,
    /// Irradiance, as a part of what all the rest of the image gives a surface on average. At most [`SunParams::min_share`] only where the spot
    /// is clipped: the sun that it may be was stronger, how much is not in the image.
    pub share: f64,
    /// The pixels that hold it (row-major index), with the sky that takes their place.
    pub replaced: Vec<(u32, Vec3)>,
}

/// Finds the sun of a probe; `None` where there is none.
#[must_use]
pub fn find_sun(probe: &Probe, params: &SunParams) -> Option<FoundSun> {
    let lowest = libm::sin(params.min_elevation_deg.to_radians()) as f32;
    let grid = probe.grid();
    let mut peak = (0.0_f32, None);
    for ((&color, &direction), &solid_angle) in probe.image().pixels.iter().zip(grid.directions()).zip(grid.solid_angles()) {
        let value = luminance(color);
        if solid_angle > 0.0 && direction.y >= lowest && value > peak.0 {
            peak = (value, Some(direction));
        }
    }
    let (peak, peak_direction) = (peak.0, peak.1?);
    let patch = Patch::gather(probe, peak_direction.as_dvec3(), f64::from(peak));
    let measured = patch.measure(probe.geometry(), params.max_radius_deg)?;
    let contrast = (f64::from(peak) / measured.ring.max(1e-9 * f64::from(peak))) as f32;
    if contrast < params.min_contrast || has_rival(probe, measured.direction, params.max_rival * peak) {
        return None;
    }
    let flux: f64 = probe.image().pixels.iter().zip(grid.solid_angles()).map(|(&c, &s)| f64::from(luminance(c) * s)).sum();
    let irradiance = f64::from(luminance(measured.irradiance.as_vec3()));
    // a surface of any orientation receives a quarter of the sphere's flux on average
    let share = irradiance / (0.25 * (flux - irradiance)).max(f64::MIN_POSITIVE);
    let mut clipped = clipped::is_clipped(&patch, &measured);
    if share <= params.min_share {
        // what is left of a clipped sun says nothing of its strength
        clipped |= clipped::has_flat_top(&patch);
        if !clipped {
            return None;
        }
    }
    let direction = measured.direction.as_vec3();
    Some(FoundSun {
        sun: Sun { direction: direction.to_array(), irradiance: measured.irradiance.as_vec3().to_array(), clipped },
        radius_deg: measured.radius.to_degrees(),
        contrast,
        share,
        replaced: measured.replaced,
    })
}

/// Whether something far from the sun, and above the horizon, is brighter than `limit`.
fn has_rival(probe: &Probe, sun: DVec3, limit: f32) -> bool {
    let sun = sun.as_vec3();
    let near = libm::cosf(10.0_f32.to_radians());
    let grid = probe.grid();
    probe
        .image()
        .pixels
        .iter()
        .zip(grid.directions())
        .zip(grid.solid_angles())
        .any(|((&color, direction), &s)| s > 0.0 && direction.y > 0.0 && direction.dot(sun) < near && luminance(color) > limit)
}
