//! What is the same for all probes of one size: each pixel's solid angle and direction.

use super::{Geometry, Mapping, cross, disc};
use crate::error::SkyError;
use crate::project::basis9_f64;
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use std::f64::consts::{PI, TAU};

/// A geometry with the solid angle and the middle's direction of every pixel. Made once for a series of probes.
#[derive(Clone, Debug)]
pub struct ProbeGrid {
    geometry: Geometry,
    solid_angles: Vec<f32>,
    directions: Vec<Vec3>,
    rim: Vec<RimPixel>,
    /// Whether a pixel is in `rim`; empty for mappings without a disc.
    is_rim: Vec<bool>,
}

/// A pixel that the rim of a disc cuts.
#[derive(Clone, Debug)]
pub(crate) struct RimPixel {
    /// The pixel whose colour holds here.
    pub owner: u32,
    /// Integrals of the nine basis functions over the part in the disc.
    pub all: [f64; 9],
    /// The same over its part above the horizon.
    pub above: [f64; 9],
}

impl ProbeGrid {
    /// Tabulates a geometry.
    ///
    /// # Errors
    /// As [`Geometry::new`].
    pub fn new(mapping: Mapping, width: u32, height: u32, turn_rad: f64) -> Result<Self, SkyError> {
        let geometry = Geometry::new(mapping, width, height, turn_rad)?;
        let mut solid_angles: Vec<f64> = (0..height).into_par_iter().flat_map_iter(|y| row_solid_angles(geometry, y)).collect();
        let (mut rim, mut is_rim) = (Vec::new(), Vec::new());
        if !matches!(mapping, Mapping::LatLong | Mapping::CubeCross) {
            is_rim = vec![false; solid_angles.len()];
            rim = draw_rim_inward(geometry, &mut solid_angles, &mut is_rim);
        }
        let directions = (0..height)
            .into_par_iter()
            .flat_map_iter(|y| {
                (0..width).map(move |x| {
                    let d = geometry.direction(f64::from(x) + 0.5, f64::from(y) + 0.5);
                    d.map_or(Vec3::ZERO, |d| d.as_vec3())
                })
            })
            .collect();
        Ok(Self { geometry, solid_angles: solid_angles.into_iter().map(|s| s as f32).collect(), directions, rim, is_rim })
    }

    /// The geometry.
    #[must_use]
    pub fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    /// Solid angles in sr, row-major: 0 for a pixel whose middle lies outside of the disc or the cross. They sum to the solid
    /// angle that the probe covers: `4 pi`, or `2 pi` for a fisheye of 180 degrees.
    #[must_use]
    pub fn solid_angles(&self) -> &[f32] {
        &self.solid_angles
    }

    /// Pixels that the rim of a disc cuts, with integrals of their own.
    pub(crate) fn rim(&self) -> &[RimPixel] {
        &self.rim
    }

    /// Whether a pixel is among [`ProbeGrid::rim`].
    pub(crate) fn is_rim(&self, index: usize) -> bool {
        self.is_rim.get(index).copied().unwrap_or(false)
    }

    /// Directions of the pixels' middles, row-major; zero outside.
    #[must_use]
    pub fn directions(&self) -> &[Vec3] {
        &self.directions
    }
}

fn row_solid_angles(geometry: Geometry, y: u32) -> Vec<f64> {
    let (w, h) = (f64::from(geometry.width), f64::from(geometry.height));
    match geometry.mapping {
        Mapping::LatLong => {
            // cos(a) - cos(b) = 2 sin((a + b) / 2) sin((b - a) / 2)
            let middle = PI * (f64::from(y) + 0.5) / h;
            let band = 2.0 * libm::sin(middle) * libm::sin(0.5 * PI / h);
            vec![band * TAU / w; geometry.width as usize]
        }
        Mapping::CubeCross => (0..geometry.width).map(|x| cross::pixel_solid_angle(w, h, x, y)).collect(),
        mapping => (0..geometry.width)
            .map(|x| {
                let (left, top) = disc::from_pixel(w, h, f64::from(x), f64::from(y));
                let (right, bottom) = disc::from_pixel(w, h, f64::from(x + 1), f64::from(y + 1));
                disc::pixel_solid_angle(mapping, left, right, bottom, top)
            })
            .collect(),
    }
}

/// Gives the slivers of pixels whose middle lies outside of the disc to the pixels that the rim cuts beside them: what such a pixel
/// shows is mostly not the sky. Returns the cut pixels with integrals over what they really cover, because towards the rim of a mirror ball
/// a pixel spans many degrees.
fn draw_rim_inward(geometry: Geometry, solid_angles: &mut [f64], is_rim: &mut [bool]) -> Vec<RimPixel> {
    let (w, h) = (f64::from(geometry.width), f64::from(geometry.height));
    let radius_px = 0.5 * w.min(h);
    let own = solid_angles.to_vec();
    let mut rim = Vec::new();
    for y in 0..geometry.height {
        for x in 0..geometry.width {
            let index = (y * geometry.width + x) as usize;
            let (a, b) = disc::from_pixel(w, h, f64::from(x) + 0.5, f64::from(y) + 0.5);
            let r = libm::hypot(a, b);
            // half a pixel's diagonal is 0.7071 pixels: the pixels that are cut, and the owners of their slivers
            if own[index] == 0.0 || r * radius_px < radius_px - 1.5 {
                continue;
            }
            is_rim[index] = true;
            let mut owner = index as u32;
            let (all, above) = rim_integrals(geometry, x, y, own[index]);
            if r > 1.0 {
                let sliver = own[index];
                solid_angles[index] -= sliver;
                // a pixel holds every point within half a pixel of its middle; 0.71 pixels inside the rim its middle is inside, too
                let scale = (1.0 - 0.71 / radius_px).max(0.0) / r;
                let (px, py) = disc::to_pixel(w, h, a * scale, b * scale);
                owner = (py as u32).min(geometry.height - 1) * geometry.width + (px as u32).min(geometry.width - 1);
                solid_angles[owner as usize] += sliver;
            }
            rim.push(RimPixel { owner, all, above });
        }
    }
    rim
}

/// Integrals of the basis over the part of a pixel in the disc, by many looks that share its exact solid angle.
fn rim_integrals(geometry: Geometry, x: u32, y: u32, solid_angle: f64) -> ([f64; 9], [f64; 9]) {
    const LOOKS: u32 = 24;
    let mut looks: Vec<(DVec3, f64)> = (0..LOOKS * LOOKS)
        .filter_map(|k| {
            let at = |k: u32| (f64::from(k) + 0.5) / f64::from(LOOKS);
            let (px, py) = (f64::from(x) + at(k % LOOKS), f64::from(y) + at(k / LOOKS));
            geometry.direction(px, py).map(|direction| (direction, geometry.density(px, py)))
        })
        .collect();
    if looks.iter().map(|l| l.1).sum::<f64>() <= 0.0 {
        // a sliver that every look missed: the point of the rim next to the pixel
        looks = vec![(geometry.direction_drawn_in(f64::from(x) + 0.5, f64::from(y) + 0.5), 1.0)];
    }
    let (mut all, mut above, mut weights) = ([0.0; 9], [0.0; 9], 0.0);
    for (direction, weight) in looks {
        weights += weight;
        for (i, value) in basis9_f64(direction).into_iter().enumerate() {
            all[i] += value * weight;
            above[i] += if direction.y >= 0.0 { value * weight } else { 0.0 };
        }
    }
    let scale = solid_angle / weights;
    (all.map(|v| v * scale), above.map(|v| v * scale))
}
