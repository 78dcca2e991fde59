//! A clear sky from the physics of the air, from night to noon.

use super::air::{ASYMMETRY, Air, GROUND_KM};
use super::scatter::{Along, Many, march};
use super::spectrum::{self, COUNT, Spectrum};
use glam::Vec3;
use heliodon_image::HdrImage;
use heliodon_math::sphere::direction_from_azimuth_elevation;
use std::f32::consts::PI;

/// How high the eye stands: the horizon lies 0.45 degrees below it.
const EYE_KM: f32 = GROUND_KM + 0.2;
const STEPS: u32 = 40;
const AZIMUTHS: usize = 33;
const ABOVE: usize = 64;
const BELOW: usize = 24;

/// Light of the night sky, in kcd/m2: airglow, starlight, zodiacal light (about 2e-4 cd/m2), a little blue.
const NIGHT: Vec3 = Vec3::new(1.6e-7, 1.9e-7, 2.6e-7);

/// The air with everything that does not depend on the sun's place in the map.
#[derive(Clone, Debug)]
pub(crate) struct Atmosphere {
    air: Air,
    many: Many,
    ground_albedo: Spectrum,
    colors: [Vec3; COUNT],
}

/// The four terms of a direction's light, as colours.
#[derive(Clone, Copy, Default)]
struct Terms {
    rayleigh: Vec3,
    fine: Vec3,
    coarse: Vec3,
    even: Vec3,
}

impl Terms {
    fn mix(nodes: [(Self, f32); 4]) -> Self {
        let mut sum = Self::default();
        for (terms, weight) in nodes {
            sum.rayleigh += terms.rayleigh * weight;
            sum.fine += terms.fine * weight;
            sum.coarse += terms.coarse * weight;
            sum.even += terms.even * weight;
        }
        sum
    }
}

/// Terms over azimuths from the sun (0 to 180 degrees) and heights; rows crowd at the horizon.
struct Dome {
    above: Vec<Terms>,
    below: Vec<Terms>,
    horizon_rad: f32,
}

fn rayleigh_phase(cosine: f32) -> f32 {
    3.0 / (16.0 * PI) * (1.0 + cosine * cosine)
}

/// Cornette and Shanks, "Physically reasonable analytic expression for the single-scattering phase function", Applied Optics 31, 1992.
fn aerosol_phase(g: f32, cosine: f32) -> f32 {
    let g2 = g * g;
    let base = (1.0 + g2 - 2.0 * g * cosine).max(1e-6);
    3.0 / (8.0 * PI) * (1.0 - g2) * (1.0 + cosine * cosine) / ((2.0 + g2) * base * base.sqrt())
}

/// What air, fine and coarse aerosols send to a direction whose angle from the sun has this cosine.
fn phases(cosine: f32) -> [f32; 3] {
    [rayleigh_phase(cosine), aerosol_phase(ASYMMETRY[0], cosine), aerosol_phase(ASYMMETRY[1], cosine)]
}

impl Atmosphere {
    pub(crate) fn new(turbidity: f32, ground_albedo: Vec3) -> Self {
        let air = Air::new(turbidity);
        let ground_albedo = spectrum::from_albedo(ground_albedo);
        let many = Many::new(&air, &ground_albedo);
        Self { air, many, ground_albedo, colors: spectrum::colors() }
    }

    /// Irradiance of the sun at normal incidence, in klx, and the height of the middle of what is seen of it, in radians: the mean over the disc's
    /// height; what lies below the horizon (0 degrees) does not count. `None` where nothing of it is up.
    pub(crate) fn sun(&self, elevation_rad: f64) -> Option<(Vec3, f64)> {
        const RADIUS: f64 = 0.004_65;
        const BANDS: u32 = 16;
        let (mut sum, mut area, mut moment) = (Vec3::ZERO, 0.0, 0.0);
        let mut whole = 0.0;
        for i in 0..BANDS {
            let y = (f64::from(i) + 0.5) / f64::from(BANDS) * 2.0 - 1.0;
            let width = (1.0 - y * y).sqrt();
            whole += width;
            // the band that the horizon cuts counts in part, so that the sun rises smoothly
            let height = elevation_rad + y * RADIUS;
            let band = RADIUS / f64::from(BANDS);
            let part = ((height + band) / (2.0 * band)).clamp(0.0, 1.0);
            if part > 0.0 {
                let seen = height.max(0.0);
                let mu = libm::sin(seen) as f32;
                // from the top of the air to the ground, the horizon's soft edge left out: the bands are the softness
                let through = self.air.through(GROUND_KM, mu.max(0.0095));
                let through = if mu < 0.0095 { self.low_through(mu) } else { through };
                sum += spectrum::to_color(&through, &self.colors) * (width * part) as f32;
                area += width * part;
                moment += width * part * seen;
            }
        }
        (area > 0.0).then(|| ((sum / whole as f32).max(Vec3::ZERO), moment / area))
    }

    /// Transmittance between the horizon and half a degree, where [`Air::through`] softens the horizon for points of the air: the optical depth
    /// carried on from above it.
    fn low_through(&self, mu: f32) -> Spectrum {
        const A: f32 = 0.0095;
        const B: f32 = 0.0195;
        let (a, b) = (self.air.through(GROUND_KM, A), self.air.through(GROUND_KM, B));
        std::array::from_fn(|k| {
            let (la, lb) = (libm::logf(a[k].max(1e-30)), libm::logf(b[k].max(1e-30)));
            libm::expf(la + (la - lb) * (A - mu) / (B - A))
        })
    }

    /// A lat-long map of the sky and the ground, without the sun's disc. `azimuth_rad` is the sun's compass bearing in the map.
    pub(crate) fn map(&self, azimuth_rad: f64, elevation_rad: f64, width: u32, height: u32) -> HdrImage {
        let dome = self.dome(elevation_rad);
        let sun = direction_from_azimuth_elevation(azimuth_rad, elevation_rad);
        let rows: Vec<f32> = (0..height).map(|y| (0.5 - (y as f32 + 0.5) / height as f32) * PI).collect();
        let mut pixels = Vec::with_capacity(width as usize * height as usize);
        let half = 0.5 * PI / height as f32;
        let columns: Vec<(f32, f32, f32)> = (0..width)
            .map(|x| {
                let azimuth = (f64::from(x) + 0.5) / f64::from(width) * std::f64::consts::TAU - std::f64::consts::PI;
                let (s, c) = libm::sincos(azimuth);
                let apart = libm::remainder(azimuth - azimuth_rad, std::f64::consts::TAU);
                (s as f32, c as f32, libm::fabs(apart) as f32)
            })
            .collect();
        for &elevation in &rows {
            let (s, c) = libm::sincosf(elevation);
            // the part of the pixel above the horizon
            let sky = ((elevation + half - dome.horizon_rad) / (2.0 * half)).clamp(0.0, 1.0);
            let above = dome.row(true, elevation.max(dome.horizon_rad));
            let below = dome.row(false, elevation.min(dome.horizon_rad));
            for &(sin_azimuth, cos_azimuth, apart) in &columns {
                let cosine = Vec3::new(c * sin_azimuth, s, -c * cos_azimuth).dot(sun);
                let [rayleigh, fine, coarse] = phases(cosine);
                let shade = |row: &[Terms]| {
                    let terms = across(row, apart);
                    terms.rayleigh * rayleigh + terms.fine * fine + terms.coarse * coarse + terms.even
                };
                let mut color = Vec3::ZERO;
                if sky > 0.0 {
                    color += (shade(&above) + NIGHT) * sky;
                }
                if sky < 1.0 {
                    color += shade(&below) * (1.0 - sky);
                }
                pixels.push(color.max(Vec3::ZERO));
            }
        }
        HdrImage { width, height, pixels }
    }

    fn dome(&self, elevation_rad: f64) -> Dome {
        let sun = direction_from_azimuth_elevation(0.0, elevation_rad);
        let horizon_rad = -libm::acosf(GROUND_KM / EYE_KM);
        let node = |above: bool, row: usize, column: usize| {
            let elevation = Dome::elevation(above, row, horizon_rad);
            let azimuth = column as f32 / (AZIMUTHS - 1) as f32 * PI;
            let direction = direction_from_azimuth_elevation(f64::from(azimuth), f64::from(elevation));
            march(&self.air, Some(&self.many), EYE_KM, direction, sun, STEPS)
        };
        let above: Vec<Along> = (0..ABOVE * AZIMUTHS).map(|i| node(true, i / AZIMUTHS, i % AZIMUTHS)).collect();
        let sky_light = Self::irradiance(&above, horizon_rad, sun);
        let sun_light = self.air.through(GROUND_KM, sun.y);
        let color = |s: &Spectrum| spectrum::to_color(s, &self.colors);
        let terms = |along: &Along, even: &Spectrum, night: Vec3| Terms {
            rayleigh: color(&along.rayleigh),
            fine: color(&along.fine),
            coarse: color(&along.coarse),
            even: color(even) + night,
        };
        let below = (0..BELOW * AZIMUTHS)
            .map(|i| {
                let along = node(false, i / AZIMUTHS, i % AZIMUTHS);
                let lit: Spectrum = std::array::from_fn(|k| {
                    let light = sun_light[k] * sun.y.max(0.0) + sky_light[k];
                    along.many[k] + along.through[k] * self.ground_albedo[k] / PI * light
                });
                // the ground also shows the night sky's light
                let night = NIGHT * color(&self.ground_albedo) / color(&[1.0; COUNT]);
                terms(&along, &lit, night)
            })
            .collect();
        let above = above.iter().map(|a| terms(a, &a.many, Vec3::ZERO)).collect();
        Dome { above, below, horizon_rad }
    }

    /// Irradiance of the dome on level ground.
    fn irradiance(above: &[Along], horizon_rad: f32, sun: Vec3) -> Spectrum {
        let mut sum = [0.0_f32; COUNT];
        for row in 0..ABOVE {
            let edge = |r: f32| horizon_rad + (r / (ABOVE - 1) as f32).clamp(0.0, 1.0).powi(2) * (0.5 * PI - horizon_rad);
            let (low, high) = (edge(row as f32 - 0.5).max(0.0), edge(row as f32 + 0.5).max(0.0));
            let (s0, s1) = (libm::sinf(low), libm::sinf(high));
            // the integral of sine times cosine over the band
            let band = 0.5 * (s1 * s1 - s0 * s0);
            let elevation = 0.5 * (low + high);
            for column in 0..AZIMUTHS {
                // both sides of the sun; the end columns stand for half as much
                let share = if column == 0 || column == AZIMUTHS - 1 { 1.0 } else { 2.0 };
                let weight = band * share * PI / (AZIMUTHS - 1) as f32;
                let azimuth = f64::from(column as u32) / (AZIMUTHS - 1) as f64 * std::f64::consts::PI;
                let cosine = direction_from_azimuth_elevation(azimuth, f64::from(elevation)).dot(sun);
                let [rayleigh, fine, coarse] = phases(cosine);
                let along = &above[row * AZIMUTHS + column];
                for (k, sum) in sum.iter_mut().enumerate() {
                    let once = along.rayleigh[k] * rayleigh + along.fine[k] * fine + along.coarse[k] * coarse;
                    *sum += weight * (once + along.many[k]);
                }
            }
        }
        sum
    }
}

impl Dome {
    fn elevation(above: bool, row: usize, horizon_rad: f32) -> f32 {
        if above {
            let v = row as f32 / (ABOVE - 1) as f32;
            // a hair above, so that the first row never meets the ground
            horizon_rad + 2e-5 + v * v * (0.5 * PI - horizon_rad - 2e-5)
        } else {
            let v = row as f32 / (BELOW - 1) as f32;
            horizon_rad - 2e-5 - v * v * (0.5 * PI + horizon_rad - 2e-5)
        }
    }

    /// A row of nodes at a height, between two of the dome's.
    fn row(&self, above: bool, elevation: f32) -> Vec<Terms> {
        let (table, rows, span) = if above {
            (&self.above, ABOVE, (elevation - self.horizon_rad) / (0.5 * PI - self.horizon_rad))
        } else {
            (&self.below, BELOW, (self.horizon_rad - elevation) / (0.5 * PI + self.horizon_rad))
        };
        let at = span.clamp(0.0, 1.0).sqrt() * (rows - 1) as f32;
        let low = (at as usize).min(rows - 2);
        let f = at - low as f32;
        let row = |k: i64| &table[k.clamp(0, rows as i64 - 1) as usize * AZIMUTHS..];
        let (a, b, c, d) = (row(low as i64 - 1), row(low as i64), row(low as i64 + 1), row(low as i64 + 2));
        let w = cubic(f);
        (0..AZIMUTHS).map(|i| Terms::mix([(a[i], w[0]), (b[i], w[1]), (c[i], w[2]), (d[i], w[3])])).collect()
    }
}

/// Weights of Catmull and Rom's cubic through four nodes.
fn cubic(f: f32) -> [f32; 4] {
    let (f2, f3) = (f * f, f * f * f);
    [0.5 * (2.0 * f2 - f - f3), 0.5 * (3.0 * f3 - 5.0 * f2 + 2.0), 0.5 * (4.0 * f2 - 3.0 * f3 + f), 0.5 * (f3 - f2)]
}

/// The terms at an angle from the sun's bearing; beyond the ends the dome is its own mirror image.
fn across(row: &[Terms], apart_rad: f32) -> Terms {
    let at = (apart_rad / PI).clamp(0.0, 1.0) * (AZIMUTHS - 1) as f32;
    let low = (at as usize).min(AZIMUTHS - 2);
    let w = cubic(at - low as f32);
    let node = |k: i64| {
        let last = AZIMUTHS as i64 - 1;
        let k = if k < 0 {
            -k
        } else if k > last {
            2 * last - k
        } else {
            k
        };
        row[k as usize]
    };
    let low = low as i64;
    Terms::mix([(node(low - 1), w[0]), (node(low), w[1]), (node(low + 1), w[2]), (node(low + 2), w[3])])
}
