//! Clear skies without photographs.
//!
//! - **atmosphere**: single and multiple scattering in a spherical atmosphere of air, aerosols and ozone at eight wavelengths, after Hillaire (2020);
//!   valid from noon into the night. The sun's light is what comes through the same air, as seen from the ground, mean over its disc; it sets behind the
//!   level horizon. Default.
//! - **hosek-wilkie**: Hosek and Wilkie, "An Analytic Model for Full Spectral Sky-Dome Radiance", ACM TOG 31(4), 2012, by the crate
//!   `hw-skymodel`. It has neither sun nor twilight: the sun is that of the atmosphere model, and from 3 degrees down to the horizon its dome
//!   fades into that of the atmosphere model, which goes on below.
//!
//! Units: radiance in kcd/m2, irradiance in klx, the same through the day. Maps leave the sun's disc out.

mod air;
mod atmosphere;
mod hosek;
mod scatter;
mod spectrum;

use crate::error::SkyError;
use atmosphere::Atmosphere;
use glam::Vec3;
use heliodon_image::HdrImage;
use heliodon_math::sphere::{azimuth_elevation_from_direction, direction_from_azimuth_elevation};

/// Which model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ModelKind {
    /// The physics of the air.
    #[default]
    Atmosphere,
    /// Hosek and Wilkie's fit.
    HosekWilkie,
}

impl ModelKind {
    /// The model of a name in `site.toml`.
    ///
    /// # Errors
    /// Where the name is unknown.
    pub fn from_name(name: &str) -> Result<Self, SkyError> {
        match name {
            "atmosphere" => Ok(Self::Atmosphere),
            "hosek-wilkie" => Ok(Self::HosekWilkie),
            other => Err(SkyError::setting("model", format!("`{other}` is unknown"), "give atmosphere or hosek-wilkie")),
        }
    }
}

/// A clear sky's settings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModelParams {
    /// Which model.
    pub kind: ModelKind,
    /// How hazy: 1 is air alone, 2 very clear, 3 clear, 6 hazy; 1 to 10.
    pub turbidity: f32,
    /// Linear albedo of the ground as far as the horizon; it lights the sky from below, and undersides.
    pub ground_albedo: Vec3,
}

impl Default for ModelParams {
    fn default() -> Self {
        // dry grass, earth and rock
        Self { kind: ModelKind::Atmosphere, turbidity: 2.0, ground_albedo: Vec3::new(0.20, 0.18, 0.13) }
    }
}

/// A model made ready: what does not depend on the sun is computed.
#[derive(Clone, Debug)]
pub struct ModelSky {
    params: ModelParams,
    atmosphere: Atmosphere,
}

impl ModelSky {
    /// Makes a model ready (about a second).
    ///
    /// # Errors
    /// Where the turbidity or the albedo lie outside of their ranges.
    pub fn new(params: &ModelParams) -> Result<Self, SkyError> {
        if !(1.0..=10.0).contains(&params.turbidity) {
            return Err(SkyError::setting(
                "turbidity",
                format!("{} is out of range", params.turbidity),
                "give a number from 1 to 10",
            ));
        }
        if !(params.ground_albedo.min_element() >= 0.0 && params.ground_albedo.max_element() <= 1.0) {
            return Err(SkyError::setting("ground albedo", "is out of range", "give three numbers from 0 to 1"));
        }
        Ok(Self { params: *params, atmosphere: Atmosphere::new(params.turbidity, params.ground_albedo) })
    }

    /// Irradiance of the sun at normal incidence in klx, and the direction to the middle of what is seen of its disc; `None` where
    /// nothing of it stands above the level horizon. `direction` is that to the disc's middle.
    #[must_use]
    pub fn sun(&self, direction: Vec3) -> Option<(Vec3, Vec3)> {
        let (azimuth, elevation) = azimuth_elevation_from_direction(direction);
        let (irradiance, seen) = self.atmosphere.sun(f64::from(elevation))?;
        Some((irradiance, direction_from_azimuth_elevation(f64::from(azimuth), seen)))
    }

    /// The sky and the ground as a lat-long map in kcd/m2, without the sun's disc.
    #[must_use]
    pub fn map(&self, sun: Vec3, width: u32, height: u32) -> HdrImage {
        let (azimuth, elevation) = azimuth_elevation_from_direction(sun);
        let physical = || self.atmosphere.map(f64::from(azimuth), f64::from(elevation), width, height);
        match self.params.kind {
            ModelKind::Atmosphere => physical(),
            ModelKind::HosekWilkie => hosek::map(&self.params, sun, width, height, physical),
        }
    }
}
