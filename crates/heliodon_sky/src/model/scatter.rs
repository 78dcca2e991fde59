//! Light that the air scatters, once along a ray and many times everywhere.
//!
//! Hillaire, "A Scalable and Production Ready Sky and Atmosphere Rendering Technique", Computer Graphics Forum 39(4), 2020: single scattering is
//! marched; scattering of higher orders is taken to be even in all directions, and summed as a geometric series at each height and sun height
//! (section 5.5). The second order in it is marched too, so the twilight arch lights the air around it.

use super::air::{Air, GROUND_KM, TOP_KM};
use super::spectrum::{COUNT, Spectrum};
use glam::Vec3;
use heliodon_math::sphere::fibonacci_sphere;
use rayon::prelude::*;
use std::f32::consts::PI;

const SUNS: usize = 192;
const HEIGHTS: usize = 18;
const DIRECTIONS: u32 = 64;

/// What is collected along a ray, before phase functions.
#[derive(Clone, Copy)]
pub(crate) struct Along {
    pub rayleigh: Spectrum,
    /// By fine and by coarse aerosols.
    pub fine: Spectrum,
    pub coarse: Spectrum,
    /// Higher orders, which have none.
    pub many: Spectrum,
    /// How much comes through from the ray's end.
    pub through: Spectrum,
    /// The radius and the sun's cosine where the ray ends on the ground.
    pub ground: Option<f32>,
}

/// Scattering of all higher orders.
#[derive(Clone, Debug)]
pub(crate) struct Many {
    table: Vec<Spectrum>,
}

/// The distance to a sphere of radius `to` from radius `r` along cosine `mu`; the near crossing where `near`.
fn distance_to(r: f32, mu: f32, to: f32, near: bool) -> Option<f32> {
    // (to - r)(to + r) keeps the digits that r^2 - to^2 loses in f32
    let (r, mu, to) = (f64::from(r), f64::from(mu), f64::from(to));
    let discriminant = r * r * (mu * mu - 1.0) + to * to;
    if discriminant < 0.0 {
        return None;
    }
    let root = discriminant.sqrt();
    let t = if near { -r * mu - root } else { -r * mu + root };
    (t > 0.0).then_some(t as f32)
}

/// Marches a ray from radius `r` in `direction`; +Y is up at its start. `many` adds the higher orders.
pub(crate) fn march(air: &Air, many: Option<&Many>, r: f32, direction: Vec3, sun: Vec3, steps: u32) -> Along {
    let mu = direction.y;
    let ground = if mu < 0.0 { distance_to(r, mu, GROUND_KM, true) } else { None };
    let length = ground.or_else(|| distance_to(r, mu, TOP_KM, false)).unwrap_or(0.0);
    let mut along = Along {
        rayleigh: [0.0; COUNT],
        fine: [0.0; COUNT],
        coarse: [0.0; COUNT],
        many: [0.0; COUNT],
        through: [1.0; COUNT],
        ground: None,
    };
    let mut before = 0.0_f32;
    let start = Vec3::Y * r;
    for i in 0..steps {
        let s = (i + 1) as f32 / steps as f32;
        let after = length * s * s;
        let (middle, step) = (0.5 * (before + after), after - before);
        before = after;
        let at = start + direction * middle;
        let radius = at.length();
        let local = air.at(radius - GROUND_KM);
        let mu_sun = at.dot(sun) / radius;
        let lit = air.through(radius, mu_sun);
        let higher = many.map_or([0.0; COUNT], |m| m.at(radius, mu_sun));
        for k in 0..COUNT {
            let passed = libm::expf(-local.extinction[k] * step);
            // the integral of transmittance over the step
            let weight = along.through[k] * (1.0 - passed) / local.extinction[k].max(1e-12);
            along.rayleigh[k] += weight * local.rayleigh[k] * lit[k];
            along.fine[k] += weight * local.fine[k] * lit[k];
            along.coarse[k] += weight * local.coarse[k] * lit[k];
            along.many[k] += weight * local.even_scattering(k) * higher[k];
            along.through[k] *= passed;
        }
    }
    if ground.is_some() {
        let at = start + direction * length;
        along.ground = Some(at.dot(sun) / at.length());
    }
    along
}

impl Many {
    pub(crate) fn new(air: &Air, ground_albedo: &Spectrum) -> Self {
        let air = &air.even();
        let directions = fibonacci_sphere(DIRECTIONS);
        let radius = |row: usize| {
            let u = row as f32 / (HEIGHTS - 1) as f32;
            GROUND_KM + (TOP_KM - GROUND_KM) * (u * u * 0.999 + 1e-4)
        };
        let series: Vec<Spectrum> =
            (0..HEIGHTS).into_par_iter().map(|row| Self::series(air, ground_albedo, &directions, radius(row))).collect();
        let table = (0..SUNS * HEIGHTS)
            .into_par_iter()
            .map(|i| {
                let (row, column) = (i / SUNS, i % SUNS);
                let v = 2.0 * column as f32 / (SUNS - 1) as f32 - 1.0;
                let second = Self::second_order(air, ground_albedo, &directions, radius(row), v * v.abs());
                std::array::from_fn(|k| second[k] * series[row][k])
            })
            .collect();
        Self { table }
    }

    /// Light of the second order, evenly in all directions (equations 5 and 6).
    fn second_order(air: &Air, ground_albedo: &Spectrum, directions: &[Vec3], r: f32, mu_sun: f32) -> Spectrum {
        let sun = Vec3::new((1.0 - mu_sun * mu_sun).max(0.0).sqrt(), mu_sun, 0.0);
        let mut second = [0.0_f32; COUNT];
        for &direction in directions {
            let along = march(air, None, r, direction, sun, 24);
            let ground = along.ground.map(|mu| (mu, air.through(GROUND_KM, mu)));
            for k in 0..COUNT {
                // all of it is even: 1 / (4 pi)
                second[k] += (along.rayleigh[k] + along.fine[k] + along.coarse[k]) / (4.0 * PI);
                if let Some((mu, lit)) = &ground {
                    second[k] += along.through[k] * ground_albedo[k] / PI * lit[k] * mu.max(0.0);
                }
            }
        }
        second.map(|s| s / directions.len() as f32)
    }

    /// `1 / (1 - f)`: what all further orders make of the second (equations 7 to 9). Does not depend on the sun.
    fn series(air: &Air, ground_albedo: &Spectrum, directions: &[Vec3], r: f32) -> Spectrum {
        let mut transfer = [0.0_f32; COUNT];
        for &direction in directions {
            let (scattered, ground) = even_light(air, r, direction);
            for k in 0..COUNT {
                transfer[k] += scattered[k] + ground_albedo[k] * ground[k];
            }
        }
        transfer.map(|t| 1.0 / (1.0 - (t / directions.len() as f32).min(0.98)))
    }

    /// Radiance of the higher orders at a radius, for the sun's cosine to the vertical there.
    fn at(&self, r: f32, mu_sun: f32) -> Spectrum {
        let row = ((r - GROUND_KM) / (TOP_KM - GROUND_KM)).clamp(0.0, 1.0).sqrt() * (HEIGHTS - 1) as f32;
        let column = (0.5 + 0.5 * mu_sun.abs().min(1.0).sqrt().copysign(mu_sun)) * (SUNS - 1) as f32;
        let (i, j) = ((row as usize).min(HEIGHTS - 2), (column as usize).min(SUNS - 2));
        let (fy, fx) = (row - i as f32, column - j as f32);
        let base = i * SUNS + j;
        let (a, b, c, d) = (&self.table[base], &self.table[base + 1], &self.table[base + SUNS], &self.table[base + SUNS + 1]);
        std::array::from_fn(|k| {
            let low = a[k] + (b[k] - a[k]) * fx;
            let high = c[k] + (d[k] - c[k]) * fx;
            low + (high - low) * fy
        })
    }
}

/// What a ray collects where every point of the air is lit by 1 from everywhere (equation 8, over the phase), and how much of the ground it sees.
fn even_light(air: &Air, r: f32, direction: Vec3) -> (Spectrum, Spectrum) {
    const STEPS: u32 = 24;
    let ground = if direction.y < 0.0 { distance_to(r, direction.y, GROUND_KM, true) } else { None };
    let length = ground.or_else(|| distance_to(r, direction.y, TOP_KM, false)).unwrap_or(0.0);
    let (mut sum, mut through) = ([0.0; COUNT], [1.0_f32; COUNT]);
    let mut before = 0.0_f32;
    for i in 0..STEPS {
        let s = (i + 1) as f32 / STEPS as f32;
        let after = length * s * s;
        let (middle, step) = (0.5 * (before + after), after - before);
        before = after;
        let local = air.at((Vec3::Y * r + direction * middle).length() - GROUND_KM);
        for k in 0..COUNT {
            let passed = libm::expf(-local.extinction[k] * step);
            sum[k] += through[k] * (1.0 - passed) / local.extinction[k].max(1e-12) * local.scattering(k);
            through[k] *= passed;
        }
    }
    (sum, if ground.is_some() { through } else { [0.0; COUNT] })
}
