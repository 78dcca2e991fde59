//! Sun and sky of a photograph's hour.

use glam::Vec3;
use heliodon_image::HdrImage;
use heliodon_light::reference::{DirectSun, LatLongSky};
use heliodon_math::color::luminance;
use heliodon_sky::SkyError;
use heliodon_sky::civil::{Date, TimeOfDay};
use heliodon_sky::mapping::{BelowHorizon, Mapping};
use heliodon_sky::model::ModelSky;
use heliodon_sky::probe::Probe;
use heliodon_sky::solar::{Place, sun_position};
use heliodon_sky::sun::{SunParams, find_sun};
use std::path::Path;

/// The light of an hour before anything stands in its way.
#[derive(Clone, Debug)]
pub struct HourSky {
    /// The sun, where there is one.
    pub sun: Option<DirectSun>,
    /// The sky without it.
    pub sky: LatLongSky,
}

/// How a photograph of the sky is to be looked at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProbeLook {
    /// How its pixels lie on the sphere.
    pub mapping: Mapping,
    /// The compass bearing, clockwise in degrees, of what the mapping calls north.
    pub turn_deg: f64,
    /// What gives light below the horizon.
    pub below_horizon: BelowHorizon,
    /// Irradiance of the sun, in the probe's unit times steradians, where the probe's is clipped.
    pub sun_irradiance: Option<Vec3>,
}

/// A model's sky is smooth: more columns show nothing more.
const MODEL_COLUMNS: u32 = 256;
/// The most columns of a probe that paths look at; the sun, which is finer, is taken out of it.
const PROBE_COLUMNS: u32 = 1024;
/// A sun of a model that is fainter than this is none.
const FAINTEST_KLX: f32 = 1e-5;

impl HourSky {
    /// That of a clear-sky model at a place, a day and a time.
    ///
    /// # Errors
    /// A place off the Earth, a day that no model reaches.
    pub fn of_model(model: &ModelSky, place: &Place, date: Date, time: TimeOfDay) -> Result<Self, SkyError> {
        let middle = sun_position(place, date, f64::from(time.seconds))?.direction(place.north_deg);
        let sun = model.sun(middle).filter(|(irradiance, _)| luminance(*irradiance) > FAINTEST_KLX);
        let sun = sun.map(|(irradiance, direction)| DirectSun { direction, irradiance });
        Ok(Self { sun, sky: sky_of(model.map(middle, MODEL_COLUMNS, MODEL_COLUMNS / 2))? })
    }

    /// That of a photograph of the sky.
    ///
    /// # Errors
    /// A file that cannot be read, or a sun that is clipped and whose strength nobody tells.
    pub fn of_probe(path: &Path, look: &ProbeLook) -> Result<Self, SkyError> {
        let probe = Probe::new(HdrImage::read(path)?, look.mapping, look.turn_deg.to_radians())?;
        let found = find_sun(&probe, &SunParams::default());
        let sunless = found.as_ref().map_or_else(|| probe.clone(), |found| probe.with_pixels(&found.replaced));
        let sun = match found.map(|found| found.sun) {
            Some(sun) if sun.clipped && look.sun_irradiance.is_none() => {
                return Err(SkyError::Probe {
                    name: path.display().to_string(),
                    problem: "shows a sun that is brighter than the file can tell".into(),
                    remedy: "give its irradiance, sun_irradiance = [r, g, b], or a probe that holds it",
                });
            }
            sun => sun,
        };
        let sun = sun.map(|sun| DirectSun {
            direction: Vec3::from_array(sun.direction),
            irradiance: if sun.clipped { look.sun_irradiance } else { None }.unwrap_or(Vec3::from_array(sun.irradiance)),
        });
        let columns = (2 * sunless.image().height).clamp(8, PROBE_COLUMNS) & !1;
        Ok(Self { sun, sky: sky_of(sunless.to_lat_long(columns, columns / 2, look.below_horizon, &sunless))? })
    }
}

fn sky_of(map: HdrImage) -> Result<LatLongSky, SkyError> {
    LatLongSky::new(map.width, map.height, map.pixels)
        .map_err(|error| SkyError::setting("sky", error.to_string(), "give a probe with pixels"))
}
