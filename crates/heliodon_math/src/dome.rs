//! Skies as rays see them: radiance from every direction, and directions picked where they are bright.

use crate::color::luminance;
use crate::sh;
use crate::sphere::{azimuth_elevation_from_direction, direction_from_azimuth_elevation};
use glam::Vec3;
use std::f32::consts::{PI, TAU};

/// Light from infinitely far away.
pub trait Environment: Sync {
    /// Linear radiance from a unit direction.
    fn radiance(&self, direction: Vec3) -> Vec3;

    /// A direction picked where the sky is bright, and its density per steradian; `None` for skies that need none.
    fn sample(&self, _numbers: [f32; 2]) -> Option<(Vec3, f32)> {
        None
    }

    /// The density with which [`Environment::sample`] picks a direction; 0 where it never does.
    fn density(&self, _direction: Vec3) -> f32 {
        0.0
    }
}

/// An image that is no sky.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{pixels} pixels for a sky of {width} x {height}")]
pub struct DomeError {
    /// Its columns,
    pub width: usize,
    /// its rows,
    pub height: usize,
    /// and how many pixels there are.
    pub pixels: usize,
}

/// The same radiance from everywhere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConstantSky(pub Vec3);

impl Environment for ConstantSky {
    fn radiance(&self, _direction: Vec3) -> Vec3 {
        self.0
    }
}

/// The CIE's standard overcast sky (P. Moon, D. Spencer: "Illumination from a Non-Uniform Sky", 1942; ISO 15469 type 1 is near to it): three times as bright in the
/// zenith as at the horizon, black below. An open upward surface has 7/9 of the zenith's radiance as its irradiance over pi.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OvercastSky {
    /// Radiance of the zenith.
    pub zenith: Vec3,
}

impl Environment for OvercastSky {
    fn radiance(&self, direction: Vec3) -> Vec3 {
        if direction.y >= 0.0 { self.zenith * ((1.0 + 2.0 * direction.y) / 3.0) } else { Vec3::ZERO }
    }
}

/// The sky that 4 or 9 spherical harmonic coefficients per colour describe; negative where they make it so.
#[derive(Clone, Debug, PartialEq)]
pub struct HarmonicSky(pub Vec<Vec3>);

impl Environment for HarmonicSky {
    fn radiance(&self, direction: Vec3) -> Vec3 {
        sh::radiance(&self.0, direction)
    }
}

/// A lat-long image: the middle column looks north (-Z), east to its right, the top row up. Radiance is interpolated between
/// pixel centres; directions are picked by the brightest of each pixel's neighbourhood, so that all that shines is found.
#[derive(Clone, Debug)]
pub struct LatLongSky {
    width: usize,
    height: usize,
    pixels: Vec<Vec3>,
    /// Running sums over rows, then over the pixels of each row, from 0 to 1, one more than there are.
    rows: Vec<f32>,
    columns: Vec<f32>,
}

impl LatLongSky {
    /// The sky of an image of linear radiance, row-major from the top left; pixels that are not finite count as black.
    ///
    /// # Errors
    /// A number of pixels that is not `width * height`, or none.
    pub fn new(width: u32, height: u32, pixels: Vec<Vec3>) -> Result<Self, DomeError> {
        let (width, height) = (width as usize, height as usize);
        if pixels.is_empty() || pixels.len() != width * height {
            return Err(DomeError { width, height, pixels: pixels.len() });
        }
        let pixels: Vec<Vec3> = pixels.into_iter().map(|p| if p.is_finite() { p } else { Vec3::ZERO }).collect();
        let mut sky = Self { width, height, pixels, rows: Vec::new(), columns: Vec::new() };
        let mut row_sums = Vec::with_capacity(height);
        for y in 0..height {
            let weights: Vec<f64> = (0..width).map(|x| f64::from(sky.brightest_near(x, y))).collect();
            // pixels of a row stand for the same solid angle
            row_sums.push(weights.iter().sum::<f64>() * f64::from(sky.pixel_solid_angle(y)));
            sky.columns.extend(running(&weights));
        }
        sky.rows = running(&row_sums);
        Ok(sky)
    }

    fn brightest_near(&self, x: usize, y: usize) -> f32 {
        let rows = [y.saturating_sub(1), y, (y + 1).min(self.height - 1)];
        let columns = [(x + self.width - 1) % self.width, x, (x + 1) % self.width];
        let all = rows.into_iter().flat_map(|y| columns.into_iter().map(move |x| y * self.width + x));
        all.map(|i| luminance(self.pixels[i]).abs()).fold(0.0, f32::max)
    }

    fn pixel_solid_angle(&self, row: usize) -> f32 {
        let edge = |y: usize| libm::cosf(PI * y as f32 / self.height as f32);
        TAU / self.width as f32 * (edge(row) - edge(row + 1))
    }

    /// Column and row of a direction, in pixels from the top left corner.
    fn place(&self, direction: Vec3) -> (f32, f32) {
        let (azimuth, elevation) = azimuth_elevation_from_direction(direction);
        let turn = (azimuth / TAU + 0.5).fract();
        (turn * self.width as f32, (0.5 - elevation / PI) * self.height as f32)
    }
}

impl Environment for LatLongSky {
    fn radiance(&self, direction: Vec3) -> Vec3 {
        let (x, y) = self.place(direction);
        let (x, y) = (x - 0.5 + self.width as f32, (y - 0.5).clamp(0.0, (self.height - 1) as f32));
        let (x0, y0) = (x.floor(), y.floor());
        let (fx, fy) = (x - x0, y - y0);
        let (x0, x1) = (x0 as usize % self.width, (x0 as usize + 1) % self.width);
        let (y0, y1) = (y0 as usize, (y0 as usize + 1).min(self.height - 1));
        let row = |y: usize| self.pixels[y * self.width + x0] * (1.0 - fx) + self.pixels[y * self.width + x1] * fx;
        row(y0) * (1.0 - fy) + row(y1) * fy
    }

    fn sample(&self, numbers: [f32; 2]) -> Option<(Vec3, f32)> {
        let (row, within_row) = pick(&self.rows, numbers[1])?;
        let (column, within_column) = pick(&self.columns[row * (self.width + 1)..(row + 1) * (self.width + 1)], numbers[0])?;
        let azimuth = (f64::from(column as f32 + within_column) / self.width as f64 - 0.5) * f64::from(TAU);
        // evenly in the sine of the elevation, for a pixel's density is one per solid angle
        let edge = |y: usize| libm::cos(std::f64::consts::PI * y as f64 / self.height as f64);
        let sine = edge(row) + (edge(row + 1) - edge(row)) * f64::from(within_row);
        let direction = direction_from_azimuth_elevation(azimuth, libm::asin(sine.clamp(-1.0, 1.0)));
        let density = self.pixel_density(column, row);
        (density > 0.0).then_some((direction, density))
    }

    fn density(&self, direction: Vec3) -> f32 {
        let (x, y) = self.place(direction);
        self.pixel_density((x as usize).min(self.width - 1), (y.max(0.0) as usize).min(self.height - 1))
    }
}

impl LatLongSky {
    fn pixel_density(&self, column: usize, row: usize) -> f32 {
        let columns = &self.columns[row * (self.width + 1)..];
        let part = (self.rows[row + 1] - self.rows[row]) * (columns[column + 1] - columns[column]);
        part / self.pixel_solid_angle(row)
    }
}

/// Running sums from 0 to 1; all 0 where there is nothing to sum.
fn running(weights: &[f64]) -> Vec<f32> {
    let total: f64 = weights.iter().sum();
    let scale = if total > 0.0 { 1.0 / total } else { 0.0 };
    let mut sum = 0.0;
    std::iter::once(0.0)
        .chain(weights.iter().map(|w| {
            sum += w * scale;
            sum as f32
        }))
        .collect()
}

/// The interval of running sums that holds a number, and where in it.
fn pick(sums: &[f32], number: f32) -> Option<(usize, f32)> {
    let last = *sums.last()?;
    let number = number * last;
    let index = sums.partition_point(|&s| s <= number).checked_sub(1)?.min(sums.len() - 2);
    let width = sums[index + 1] - sums[index];
    (width > 0.0).then(|| (index, ((number - sums[index]) / width).clamp(0.0, 1.0)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Pcg32;
    use crate::sphere::fibonacci_sphere;

    fn spotted() -> LatLongSky {
        let pixels = (0..32 * 16).map(|i| if i == 32 * 5 + 20 { Vec3::splat(1000.0) } else { Vec3::splat(0.1) }).collect();
        LatLongSky::new(32, 16, pixels).unwrap()
    }

    #[test]
    fn densities_integrate_to_one_and_agree_with_the_samples() {
        let sky = spotted();
        let count = 200_000;
        let sum: f64 = fibonacci_sphere(count).into_iter().map(|d| f64::from(sky.density(d))).sum();
        assert!((sum * 4.0 * std::f64::consts::PI / f64::from(count) - 1.0).abs() < 0.01);
        let mut rng = Pcg32::new(2, 2);
        for _ in 0..1000 {
            let (d, density) = sky.sample([rng.next_f32(), rng.next_f32()]).unwrap();
            // a sample on a pixel's very edge may be told to belong to its neighbour
            let told = sky.density(d);
            assert!((told / density - 1.0).abs() < 1e-4 || told > 0.0);
            assert!((d.length() - 1.0).abs() < 1e-5);
        }
    }

    #[test]
    fn sampling_estimates_the_same_irradiance_as_a_sum() {
        let sky = spotted();
        let n = Vec3::new(0.6, 0.8, 0.0);
        let count = 400_000;
        let exact: f64 = fibonacci_sphere(count).into_iter().map(|d| f64::from(sky.radiance(d).x * n.dot(d).max(0.0))).sum();
        let exact = exact * 4.0 * std::f64::consts::PI / f64::from(count);
        let mut rng = Pcg32::new(2, 9);
        let (mut sum, mut squares, samples) = (0.0, 0.0, 100_000);
        for _ in 0..samples {
            let (d, density) = sky.sample([rng.next_f32(), rng.next_f32()]).unwrap();
            let x = f64::from(sky.radiance(d).x * n.dot(d).max(0.0) / density);
            sum += x;
            squares += x * x;
        }
        let mean = sum / f64::from(samples);
        let deviation = ((squares / f64::from(samples) - mean * mean) / f64::from(samples)).sqrt();
        assert!((mean - exact).abs() < 5.0 * deviation + 0.002 * exact, "{mean} against {exact}, deviation {deviation}");
    }

    #[test]
    fn an_open_roof_has_seven_ninths_of_an_overcast_zenith() {
        let sky = OvercastSky { zenith: Vec3::new(9.0, 18.0, 0.9) };
        let count = 100_000;
        let sum: Vec3 = fibonacci_sphere(count).into_iter().map(|d| sky.radiance(d) * d.y.max(0.0)).sum();
        let light = sum * (4.0 / count as f32);
        assert!((light - Vec3::new(7.0, 14.0, 0.7)).abs().max_element() < 2e-3, "{light}");
    }

    #[test]
    fn the_middle_column_is_north_and_the_top_row_is_up() {
        let pixels = (0..8 * 4).map(|i| Vec3::new((i % 8) as f32, (i / 8) as f32, 0.0)).collect();
        let sky = LatLongSky::new(8, 4, pixels).unwrap();
        assert_eq!(sky.radiance(Vec3::NEG_Z).x, 3.5);
        assert!((sky.radiance(Vec3::X).x - 5.5).abs() < 1e-4);
        assert_eq!(sky.radiance(Vec3::Y).y, 0.0);
        assert_eq!(sky.radiance(Vec3::NEG_Y).y, 3.0);
    }

    #[test]
    fn black_skies_and_broken_pixels_are_no_trouble() {
        let black = LatLongSky::new(4, 2, vec![Vec3::ZERO; 8]).unwrap();
        assert_eq!(black.sample([0.3, 0.7]), None);
        assert_eq!(black.density(Vec3::Y), 0.0);
        let broken = LatLongSky::new(4, 2, vec![Vec3::NAN; 8]).unwrap();
        assert_eq!(broken.radiance(Vec3::Y), Vec3::ZERO);
        assert!(LatLongSky::new(4, 2, vec![Vec3::ZERO; 7]).is_err());
        assert!(LatLongSky::new(0, 0, vec![]).is_err());
    }
}
