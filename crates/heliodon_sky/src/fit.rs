//! Light that few coefficients can shade with: a fit to what surfaces receive, beside the projection of radiance.
//!
//! Four coefficients of a sky's radiance are exact sums, but a poor account of what stands in it. The glow round a low sun spreads over half of
//! the dome, and the step at the horizon leaks: light that belongs above it is rebuilt below, where ground hides it. With the sun 14 degrees
//! high, open level ground gets 47 % too much red and a wall that faces away from the sun half of what it should.
//!
//! So the same number of coefficients, and a directional part, the **glow**, are found anew by least squares over receivers: surfaces of all
//! orientations that see the whole sphere ([`Surroundings::Open`]), or that stand on ground which hides all below the horizon
//! ([`Surroundings::Ground`]). What is minimised is the error of their light, so energy is kept where it arrives; a level surface
//! keeps its light within a hundredth. The glow shines from the sun's direction and through its mask. It is never negative, at most half of the sun's own
//! light, so that it sets with the sun, and at most what the sky within 45 degrees of the sun is brighter than elsewhere. The coefficients lean towards
//! the projection where receivers leave them free.
//!
//! A sky that the coefficients hold (an even one) is left as it is: [`ReceiverFit::fit`] answers `None`. Figures: decision 012.

use crate::lapse::{Fitted, Sun};
use crate::mapping::BelowHorizon;
use crate::probe::Probe;
use crate::project::basis9_f64;
use glam::{DVec3, Vec3};
use heliodon_image::HdrImage;
use heliodon_math::color::luminance;
use heliodon_math::sphere::fibonacci_sphere;
use std::f64::consts::{FRAC_1_PI, PI};

/// What the surfaces see below the horizon.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Surroundings {
    /// The lower half of the sky map: nothing but the monument itself is in the scene.
    #[default]
    Open,
    /// Ground of the scene's own, whose light the bake reckons.
    Ground,
}

/// The map in which light is gathered: cells of 2.8 degrees, small beside the cosine lobes of receivers.
const WIDTH: u32 = 128;
const HEIGHT: u32 = 64;

/// Receivers, evenly over all orientations.
const RECEIVERS: u32 = 200;

/// What a level surface counts beside all others together.
const LEVEL_SHARE: f64 = 100.0;

/// How far the coefficients lean towards the projection, and the glow towards none, as a part of what receivers say.
const LEAN: f64 = 1e-3;

/// The brightest glow, as a part of the sun's irradiance (luminance).
const MOST_GLOW: f32 = 0.5;

/// Cosines of the angles from the sun between which the sky ceases to be the sun's: 39 and 46 degrees.
const NEAR_COSINES: (f64, f64) = (0.78, 0.69);

/// A projection whose receivers err by less than this part of their mean light is good.
const GOOD: f64 = 2e-3;

/// Unknowns: at most nine coefficients and the glow.
const MOST: usize = 10;

type Matrix = [[f64; MOST]; MOST];

/// The receivers, made ready for the skies of a day.
#[derive(Clone, Debug)]
pub struct ReceiverFit {
    coefficients: usize,
    receivers: Vec<Receiver>,
    /// Direction of the middle and solid angle of each cell, row by row; 0 where ground hides it.
    cells: Vec<(DVec3, f64)>,
    /// What every receiver makes of each cell's radiance: irradiance / pi.
    lobes: Vec<f32>,
    /// Sums of weight times transfer times transfer, leaning included.
    normal: Matrix,
}

#[derive(Clone, Debug)]
struct Receiver {
    normal: DVec3,
    weight: f64,
    transfer: [f64; 9],
}

impl ReceiverFit {
    /// Receivers for skies of 4 or 9 coefficients.
    #[must_use]
    pub fn new(coefficients: usize, surroundings: Surroundings) -> Self {
        let coefficients = coefficients.min(9);
        let cells = cells(surroundings);
        let mut normals: Vec<(DVec3, f64)> =
            fibonacci_sphere(RECEIVERS).iter().map(|n| (n.as_dvec3(), 1.0 / f64::from(RECEIVERS))).collect();
        normals.push((DVec3::Y, LEVEL_SHARE));
        let mut lobes = Vec::with_capacity(normals.len() * cells.len());
        let receivers: Vec<Receiver> = normals
            .into_iter()
            .map(|(normal, weight)| {
                let mut transfer = [0.0; 9];
                for &(direction, solid_angle) in &cells {
                    let lobe = normal.dot(direction).max(0.0) * solid_angle * FRAC_1_PI;
                    lobes.push(lobe as f32);
                    let basis = basis9_f64(direction);
                    transfer.iter_mut().zip(basis).for_each(|(sum, y)| *sum += lobe * y);
                }
                Receiver { normal, weight, transfer }
            })
            .collect();
        let mut normal = [[0.0; MOST]; MOST];
        for receiver in &receivers {
            for (row, a) in normal.iter_mut().zip(receiver.transfer).take(coefficients) {
                for (sum, b) in row.iter_mut().zip(receiver.transfer).take(coefficients) {
                    *sum += receiver.weight * a * b;
                }
            }
        }
        // the level surface's weight is no measure of what receivers say
        let lean = receivers
            .iter()
            .filter(|r| r.weight < 1.0)
            .map(|r| r.weight * r.transfer.iter().take(coefficients).map(|t| t * t).sum::<f64>());
        let lean = LEAN * lean.sum::<f64>() / coefficients.max(1) as f64;
        (0..coefficients).for_each(|i| normal[i][i] += lean);
        Self { coefficients, receivers, cells, lobes, normal }
    }

    /// Fits a sky without its sun. `projected` are its exact coefficients, `sun` is the sun that was taken out. `None` where the projection is good.
    #[must_use]
    pub fn fit(&self, sky: &Probe, below: BelowHorizon, projected: &[Vec3], sun: Option<&Sun>) -> Option<Fitted> {
        let map = sky.to_lat_long(WIDTH, HEIGHT, below, sky);
        let left = self.left_by(&map, projected)?;
        let direction = sun.map_or(DVec3::ZERO, |sun| Vec3::from_array(sun.direction).as_dvec3());
        let lit: Vec<f64> = self.receivers.iter().map(|r| r.normal.dot(direction).max(0.0) * FRAC_1_PI).collect();
        let most = sun.map_or(DVec3::ZERO, |sun| {
            let of_sun = f64::from(MOST_GLOW * luminance(Vec3::from_array(sun.irradiance)));
            self.excess(&map, direction).min(DVec3::splat(of_sun))
        });
        let mut fitted = Fitted { glow: [0.0; 3], sky: projected.iter().map(Vec3::to_array).collect() };
        for channel in 0..3 {
            let left: Vec<f64> = left.iter().map(|light| light[channel]).collect();
            let (change, glow) = self.solve(&left, &lit, most[channel]);
            fitted.glow[channel] = glow as f32;
            for (sky, change) in fitted.sky.iter_mut().zip(change) {
                sky[channel] = (f64::from(sky[channel]) + change) as f32;
            }
        }
        Some(fitted)
    }

    /// Irradiance, from the sky near the sun, of what is brighter than the sky elsewhere.
    fn excess(&self, map: &HdrImage, sun: DVec3) -> DVec3 {
        let (inner, outer) = NEAR_COSINES;
        let near = |cosine: f64| ((cosine - outer) / (inner - outer)).clamp(0.0, 1.0);
        let seen =
            || map.pixels.iter().zip(&self.cells).map(|(color, &(d, solid_angle))| (color.as_dvec3(), d.dot(sun), solid_angle));
        let far = |solid_angle: f64, cosine: f64| solid_angle * (1.0 - near(cosine));
        let elsewhere: DVec3 = seen().map(|(color, cosine, s)| color * far(s, cosine)).sum();
        let elsewhere = elsewhere / seen().map(|(_, cosine, s)| far(s, cosine)).sum::<f64>().max(f64::MIN_POSITIVE);
        seen().map(|(color, cosine, s)| (color - elsewhere).max(DVec3::ZERO) * (near(cosine) * cosine.max(0.0) * s)).sum()
    }

    /// What each receiver gets from the map beyond what the projection gives it; `None` where that is next to nothing.
    fn left_by(&self, map: &HdrImage, projected: &[Vec3]) -> Option<Vec<DVec3>> {
        let (mut total, mut squares) = (0.0, 0.0);
        let rows = self.lobes.chunks_exact((WIDTH * HEIGHT) as usize);
        let left: Vec<DVec3> = self
            .receivers
            .iter()
            .zip(rows)
            .map(|(receiver, row)| {
                let mut light = DVec3::ZERO;
                row.iter().zip(&map.pixels).for_each(|(&lobe, &color)| light += color.as_dvec3() * f64::from(lobe));
                let rebuilt: DVec3 = projected.iter().zip(receiver.transfer).map(|(s, t)| s.as_dvec3() * t).sum();
                let left = light - rebuilt;
                if receiver.weight < 1.0 {
                    total += light.max_element() * receiver.weight;
                    squares += left.length_squared() * receiver.weight;
                }
                left
            })
            .collect();
        (squares.sqrt() > GOOD * total).then_some(left)
    }

    /// The change of the coefficients, and the glow in `0..=most`.
    fn solve(&self, left: &[f64], lit: &[f64], most: f64) -> ([f64; MOST], f64) {
        let n = self.coefficients;
        let mut matrix = self.normal;
        let mut right = [0.0; MOST];
        let mut cross = [0.0; MOST];
        let mut own = 0.0;
        for ((receiver, &left), &lit) in self.receivers.iter().zip(left).zip(lit) {
            for (i, transfer) in receiver.transfer.iter().enumerate().take(n) {
                right[i] += receiver.weight * transfer * left;
                cross[i] += receiver.weight * transfer * lit;
            }
            own += receiver.weight * lit * lit;
            right[n] += receiver.weight * lit * left;
        }
        let with_glow = |glow: f64| {
            let known: [f64; MOST] = std::array::from_fn(|i| right[i] - glow * cross[i]);
            solve_positive(&self.normal, &known, n)
        };
        if most <= 0.0 {
            return (with_glow(0.0), 0.0);
        }
        matrix[n] = cross;
        (0..n).for_each(|i| matrix[i][n] = cross[i]);
        matrix[n][n] = own * (1.0 + LEAN);
        // the error is convex in the glow: outside of its range, the nearer end is best
        let glow = solve_positive(&matrix, &right, n + 1)[n].clamp(0.0, most);
        (with_glow(glow), glow)
    }
}

impl Fitted {
    /// The same light without a glow, for moments without a sun through whose mask it could shine.
    pub(crate) fn without_glow(mut self, direction: Vec3) -> Self {
        let basis = basis9_f64(direction.as_dvec3());
        for (sky, y) in self.sky.iter_mut().zip(basis) {
            sky.iter_mut().zip(self.glow).for_each(|(value, glow)| *value += glow * y as f32);
        }
        self.glow = [0.0; 3];
        self
    }
}

fn cells(surroundings: Surroundings) -> Vec<(DVec3, f64)> {
    let mut cells = Vec::with_capacity((WIDTH * HEIGHT) as usize);
    for y in 0..HEIGHT {
        let at = |k: f64| PI * (f64::from(y) + k) / f64::from(HEIGHT);
        let solid_angle = (libm::cos(at(0.0)) - libm::cos(at(1.0))) * 2.0 * PI / f64::from(WIDTH);
        let hidden = surroundings == Surroundings::Ground && y >= HEIGHT / 2;
        let solid_angle = if hidden { 0.0 } else { solid_angle };
        let (sine, cosine) = libm::sincos(at(0.5));
        for x in 0..WIDTH {
            let (east, north) = libm::sincos(2.0 * PI * ((f64::from(x) + 0.5) / f64::from(WIDTH) - 0.5));
            cells.push((DVec3::new(sine * east, cosine, -sine * north), solid_angle));
        }
    }
    cells
}

/// Solves `matrix x = right` for the first `n` unknowns, the matrix symmetric and positive definite, by Cholesky's method.
fn solve_positive(matrix: &Matrix, right: &[f64; MOST], n: usize) -> [f64; MOST] {
    let mut lower = [[0.0; MOST]; MOST];
    for i in 0..n {
        for j in 0..=i {
            let known: f64 = (0..j).map(|k| lower[i][k] * lower[j][k]).sum();
            let rest = matrix[i][j] - known;
            // leaning keeps the diagonal above zero
            lower[i][j] = if i == j { rest.max(f64::MIN_POSITIVE).sqrt() } else { rest / lower[j][j] };
        }
    }
    let mut x = *right;
    for i in 0..n {
        let known: f64 = (0..i).map(|k| lower[i][k] * x[k]).sum();
        x[i] = (x[i] - known) / lower[i][i];
    }
    for i in (0..n).rev() {
        let known: f64 = (i + 1..n).map(|k| lower[k][i] * x[k]).sum();
        x[i] = (x[i] - known) / lower[i][i];
    }
    x
}
