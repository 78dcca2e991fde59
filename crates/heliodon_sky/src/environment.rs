//! Light from all around, as a few directions see it.
//!
//! M. Sattler, R. Sarlette, G. Zachmann, R. Klein: "Hardware-accelerated ambient occlusion computation", VMV 2004, section 5: the
//! environment is blurred, and each light direction looks its radiance up. The paper blurs the pixels of a latitude-longitude map;
//! here the blur is on the sphere, by a von Mises-Fisher kernel `exp((cos - 1) / sigma^2)`, which is what a Gaussian of standard deviation
//! sigma (in radians) is on a sphere, and which knows no poles.

use crate::mapping::BelowHorizon;
use crate::probe::Probe;
use glam::{DVec3, Quat, Vec3};
use heliodon_image::HdrImage;
use rayon::prelude::*;
use std::f64::consts::{PI, TAU};

/// Beyond this many standard deviations the kernel is left out: there it is e^-8 of its peak.
const REACH: f64 = 4.0;

/// Columns of the map for each standard deviation.
const COLUMNS_PER_SIGMA: f64 = 5.0;

/// The widest map that is looked at.
const WIDEST: u32 = 4096;

/// An environment: radiance from all directions.
#[derive(Clone, Debug)]
pub struct Environment {
    /// Latitude and longitude, north in the middle.
    map: HdrImage,
    /// Radiance summed over the sphere.
    flux: DVec3,
}

/// The standard deviation, in radians, that goes with `count` directions: half of their mean distance, so that nothing between them
/// is overlooked and little is smeared over to the next.
#[must_use]
pub fn blur_rad(count: usize) -> f64 {
    0.5 * (4.0 * PI / count.max(1) as f64).sqrt()
}

impl Environment {
    /// From a latitude-longitude map, north in the middle.
    #[must_use]
    pub fn from_lat_long(map: HdrImage) -> Self {
        let bands = Band::all(map.height);
        let flux = |(band, row): (&Band, &[Vec3])| {
            row.iter().map(|p| p.as_dvec3()).sum::<DVec3>() * (band.steradians * TAU / row.len() as f64)
        };
        let flux = bands.iter().zip(map.pixels.chunks_exact(map.width.max(1) as usize)).map(flux).sum();
        Self { map, flux }
    }

    /// From a probe; what it does not show is black.
    #[must_use]
    pub fn from_probe(probe: &Probe) -> Self {
        let geometry = probe.geometry();
        let width = geometry.width().max(geometry.height()).clamp(2, WIDEST);
        Self::from_lat_long(probe.to_lat_long(width, width / 2, BelowHorizon::Keep, probe))
    }

    /// The radiance that each of the unit `directions` stands for, with `weights` (solid angles): blurred by `sigma_rad`, and in all as much
    /// light as the environment has. `environment_from_object` turns directions of the object into the environment's, so that either
    /// may turn without new visibility.
    ///
    /// # Panics
    /// If there are not as many weights as directions.
    #[must_use]
    pub fn radiance(&self, directions: &[Vec3], weights: &[f32], sigma_rad: f64, environment_from_object: Quat) -> Vec<Vec3> {
        assert_eq!(directions.len(), weights.len(), "one weight for each direction");
        if self.map.pixels.is_empty() {
            return vec![Vec3::ZERO; directions.len()];
        }
        let sigma = if sigma_rad.is_finite() { sigma_rad.clamp(1e-4, PI) } else { PI };
        let columns = (TAU / sigma * COLUMNS_PER_SIGMA).ceil().min(f64::from(WIDEST)) as u32;
        let width = columns.next_multiple_of(2).min(self.map.width);
        let map = self.map.resized_lat_long(width, (width / 2).max(1).min(self.map.height));
        let bands = Band::all(map.height);
        let columns: Vec<(f64, f64)> = (0..map.width)
            .map(|x| {
                let azimuth = TAU * ((f64::from(x) + 0.5) / f64::from(map.width) - 0.5);
                (libm::sin(azimuth), -libm::cos(azimuth))
            })
            .collect();
        let seen: Vec<DVec3> = directions
            .par_iter()
            .map(|&direction| blurred(&map, &bands, &columns, (environment_from_object * direction).as_dvec3(), sigma))
            .collect();
        let sum: DVec3 = seen.iter().zip(weights).map(|(&l, &w)| l * f64::from(w)).sum();
        let scale = DVec3::from_array(std::array::from_fn(|c| if sum[c] > 0.0 { self.flux[c] / sum[c] } else { 0.0 }));
        seen.into_iter().map(|l| (l * scale).as_vec3()).collect()
    }
}

/// A row of a map.
struct Band {
    /// Sine and cosine of its middle's elevation.
    sin: f64,
    cos: f64,
    /// Its solid angle over 2 pi.
    steradians: f64,
}

impl Band {
    fn all(height: u32) -> Vec<Self> {
        let edge = |y: u32| libm::cos(PI * f64::from(y) / f64::from(height));
        let band = |y: u32| {
            let (sin, cos) = libm::sincos(PI * (0.5 - (f64::from(y) + 0.5) / f64::from(height)));
            Self { sin, cos, steradians: edge(y) - edge(y + 1) }
        };
        (0..height).map(band).collect()
    }
}

/// The mean radiance around a unit direction.
fn blurred(map: &HdrImage, bands: &[Band], columns: &[(f64, f64)], d: DVec3, sigma: f64) -> DVec3 {
    let width = columns.len();
    let horizontal = libm::hypot(d.x, d.z);
    // Cosine of the farthest direction that counts.
    let least = libm::cos((REACH * sigma).min(PI));
    let middle = (libm::atan2(d.x, -d.z) / TAU + 0.5) * width as f64;
    let (mut sum, mut weights) = (DVec3::ZERO, 0.0);
    for (band, row) in bands.iter().zip(map.pixels.chunks_exact(width)) {
        // sin e sin e' + cos e cos e' cos(azimuth's difference) >= least
        let (straight, around) = (band.sin * d.y, band.cos * horizontal);
        let half = if straight - around >= least {
            width as f64 * 0.5
        } else if straight + around <= least {
            continue;
        } else {
            libm::acos(((least - straight) / around).clamp(-1.0, 1.0)) / TAU * width as f64
        };
        let count = ((2.0 * half).ceil() as usize + 1).min(width);
        let first = (middle - half - 0.5).ceil() as i64;
        for x in (0..count as i64).map(|k| (first + k).rem_euclid(width as i64) as usize) {
            let (east, south) = columns[x];
            let cos = straight + band.cos * (east * d.x + south * d.z);
            let weight = band.steradians * libm::exp((cos - 1.0) / (sigma * sigma));
            sum += row[x].as_dvec3() * weight;
            weights += weight;
        }
    }
    // A kernel between the middles of pixels meets none: then it is the pixel that shows.
    if weights > 0.0 {
        return sum / weights;
    }
    let y = ((0.5 - libm::asin(d.y.clamp(-1.0, 1.0)) / PI) * bands.len() as f64) as usize;
    map.pixel((middle as usize).min(width - 1) as u32, y.min(bands.len() - 1) as u32).as_dvec3()
}
