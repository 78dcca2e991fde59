//! Where rain and wind come from, as weights of directions.

use super::WeatherError;
use glam::Vec3;
use heliodon_math::sphere::{direction_from_azimuth_elevation, fibonacci_sphere};
use std::f64::consts::TAU;

/// The weather of a place over the years, as far as it shows on stone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Climate {
    /// The azimuth in the model's space (radians, clockwise from -Z seen from above) that wind and driving rain come from; none where no direction prevails.
    pub wind_from_rad: Option<f64>,
    /// Mean speed of the wind at the walls while it rains, m/s, 0 to [`Climate::MAX_WIND_M_PER_S`]. More drives rain against walls and under roofs.
    pub wind_m_per_s: f64,
    /// Directions of the upper half that each place is asked for, 16 to [`Climate::MAX_DIRECTIONS`]. More cost rays in proportion and make the borders of what rain
    /// reaches smoother.
    pub directions: u32,
}

impl Default for Climate {
    fn default() -> Self {
        Self { wind_from_rad: None, wind_m_per_s: 2.0, directions: 512 }
    }
}

/// Tangent of the angle at which rain falls off the vertical, for each m/s of wind: ISO 15927-3:2009, "Calculation of a driving rain index for vertical surfaces from
/// hourly wind and rain data", equation 1 (2/9; as R. E. Lacy: "Driving-rain maps and the onslaught of rain on buildings", 1965, found it). Its rain
/// has the power 8/9 of the hour's; that of 1 mm is taken.
const TANGENT_PER_M_PER_S: f64 = 2.0 / 9.0;

/// How far gusts and sizes of drops scatter the rain about that angle, radians (15 degrees): about a factor of two in the tangent.
const SCATTER_RAD: f64 = TAU / 24.0;

/// Wind blows from below this sine of an elevation (30 degrees); most of it along the ground.
const WIND_BELOW: f32 = 0.5;

/// Directions of the wind whose mean stands for all, where none prevails.
const ALL_AROUND: u32 = 32;

/// Directions of the upper half of the sky, and what comes from each.
pub(super) struct Weights {
    pub directions: Vec<Vec3>,
    /// Of the sky, the rain and the wind; those of sky and rain bring 1 to an open horizontal place.
    pub brought: Vec<[f32; 3]>,
}

impl Climate {
    /// The strongest wind: a hurricane's.
    pub const MAX_WIND_M_PER_S: f64 = 40.0;
    /// The most directions.
    pub const MAX_DIRECTIONS: u32 = 65_536;

    /// A quarter of the usual directions, for a first look.
    #[must_use]
    pub fn preview() -> Self {
        Self { directions: 128, ..Self::default() }
    }

    /// Four times the usual directions.
    #[must_use]
    pub fn archival() -> Self {
        Self { directions: 2048, ..Self::default() }
    }

    /// Whether all numbers are in range.
    ///
    /// # Errors
    /// The first that is not.
    pub fn validate(&self) -> Result<(), WeatherError> {
        let fault = |what, value: f64| Err(WeatherError::Climate { what, value });
        if self.wind_from_rad.is_some_and(|azimuth| !azimuth.is_finite()) {
            return fault("wind_from_rad", self.wind_from_rad.unwrap_or_default());
        }
        if !(0.0..=Self::MAX_WIND_M_PER_S).contains(&self.wind_m_per_s) {
            return fault("wind_m_per_s", self.wind_m_per_s);
        }
        if !(16..=Self::MAX_DIRECTIONS).contains(&self.directions) {
            return fault("directions", f64::from(self.directions));
        }
        Ok(())
    }

    /// Where rain comes from, in the mean, for each direction of the wind that counts.
    fn rain_from(&self) -> Vec<Vec3> {
        let elevation = libm::atan2(1.0, TANGENT_PER_M_PER_S * self.wind_m_per_s);
        let from = |azimuth| direction_from_azimuth_elevation(azimuth, elevation);
        match self.wind_from_rad {
            Some(azimuth) => vec![from(azimuth)],
            None => (0..ALL_AROUND).map(|i| from(TAU * f64::from(i) / f64::from(ALL_AROUND))).collect(),
        }
    }

    /// What comes from each of `directions` directions of the upper half.
    pub(super) fn weights(&self) -> Weights {
        let directions: Vec<Vec3> =
            fibonacci_sphere(2 * self.directions).into_iter().filter(|direction| direction.y > 0.0).collect();
        let means = self.rain_from();
        // von Mises and Fisher's distribution on the sphere
        let near = |a: Vec3, b: Vec3| libm::exp((f64::from(a.dot(b)) - 1.0) / (SCATTER_RAD * SCATTER_RAD));
        let rain: Vec<f64> = directions.iter().map(|&d| means.iter().map(|&mean| near(d, mean)).sum()).collect();
        let on_the_ground =
            |of: &dyn Fn(usize) -> f64| -> f64 { directions.iter().enumerate().map(|(j, d)| of(j) * f64::from(d.y)).sum() };
        let (sky_sum, rain_sum) = (on_the_ground(&|_| 1.0), on_the_ground(&|j| rain[j]));
        let toward = self.wind_from_rad.map(|azimuth| direction_from_azimuth_elevation(azimuth, 0.0));
        let wind = |d: Vec3| {
            let low = (1.0 - d.y / WIND_BELOW).max(0.0);
            // it turns by the hour: from the side half as much as from where it prevails
            low * toward.map_or(1.0, |toward| 0.5 + 0.5 * toward.dot(d))
        };
        let brought = |(j, &d): (usize, &Vec3)| [(1.0 / sky_sum) as f32, (rain[j] / rain_sum) as f32, wind(d)];
        let brought = directions.iter().enumerate().map(brought).collect();
        Weights { directions, brought }
    }
}
