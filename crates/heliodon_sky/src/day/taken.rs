//! What a day takes from a probe.

use super::{LapseParams, ProbeSeries, SkyRecord};
use crate::error::SkyError;
use crate::fit::ReceiverFit;
use crate::mapping::{Mapping, ProbeGrid};
use crate::probe::Probe;
use crate::sun::find_sun;
use heliodon_image::HdrImage;
use std::path::Path;
use std::sync::Arc;

/// Takes what a day needs from one probe after the other.
pub(super) struct Taker<'a> {
    params: &'a LapseParams,
    series: &'a ProbeSeries,
    receivers: ReceiverFit,
    /// That of the last probe: most series have images of one size.
    grid: Option<Arc<ProbeGrid>>,
}

/// A probe, and what was found in it.
pub(super) struct Taken {
    /// What is kept of it.
    pub record: SkyRecord,
    probe: Probe,
    sunless: Probe,
}

impl<'a> Taker<'a> {
    pub fn new(params: &'a LapseParams, series: &'a ProbeSeries) -> Self {
        let receivers = ReceiverFit::new(params.coefficients as usize, params.surroundings);
        Self { params, series, receivers, grid: None }
    }

    /// Reads a probe.
    pub fn take(&mut self, path: &Path) -> Result<Taken, SkyError> {
        let name = path.display().to_string();
        let (image, repairs) = HdrImage::read_counted(path)?;
        let grid = self.grid_for(&name, image.width, image.height)?;
        let probe = Probe::with_grid(image, grid)?;
        let found = find_sun(&probe, &self.series.sun);
        let given = self.series.sun_irradiance;
        // what is left of a clipped sun says nothing of its strength: without a word of the site it may as well be a lamp
        let (found, dim_spot) = match found {
            Some(found) if found.share <= self.series.sun.min_share && given.is_none() => (None, true),
            found => (found, false),
        };
        let sunless = found.as_ref().map_or_else(|| probe.clone(), |f| probe.with_pixels(&f.replaced));
        let sun = found.map(|found| {
            let mut sun = found.sun;
            if let Some(irradiance) = given.filter(|_| sun.clipped) {
                sun.irradiance = irradiance.to_array();
            }
            sun
        });
        let sky = sunless.coefficients(self.params.coefficients as usize, self.series.below_horizon);
        let fitted = self.receivers.fit(&sunless, self.series.below_horizon, &sky, sun.as_ref());
        let repairs = [repairs.nan, repairs.infinite, repairs.negative];
        let record = SkyRecord { sun, sky: sky.iter().map(|s| s.to_array()).collect(), fitted, repairs, dim_spot };
        Ok(Taken { record, probe, sunless })
    }

    fn grid_for(&mut self, name: &str, width: u32, height: u32) -> Result<Arc<ProbeGrid>, SkyError> {
        let fits = |g: &Arc<ProbeGrid>| (g.geometry().width(), g.geometry().height()) == (width, height);
        let grid = match self.grid.take().filter(fits) {
            Some(grid) => grid,
            None => {
                let turn = (self.series.turn_deg - self.params.north_deg).to_radians();
                let made = ProbeGrid::new(self.series.mapping, width, height, turn).map_err(|e| match e {
                    SkyError::Probe { problem, remedy, .. } => SkyError::Probe { name: name.to_owned(), problem, remedy },
                    other => other,
                })?;
                Arc::new(made)
            }
        };
        Ok(self.grid.insert(grid).clone())
    }

    /// The lat-long map that is drawn: the probe with its sun.
    pub fn drawn_map(&self, taken: &Taken) -> HdrImage {
        self.map(&taken.probe, &taken.sunless)
    }

    /// The same without the sun.
    pub fn sunless_map(&self, taken: &Taken) -> HdrImage {
        self.map(&taken.sunless, &taken.sunless)
    }

    fn map(&self, probe: &Probe, sunless: &Probe) -> HdrImage {
        let (width, height) = (probe.image().width, probe.image().height);
        // as fine as the probe's finest part
        let natural = match self.series.mapping {
            Mapping::LatLong => width,
            Mapping::Angular | Mapping::MirrorBall => 2 * width.min(height),
            Mapping::Fisheye { opening_deg } => (f64::from(width.min(height)) * 360.0 / opening_deg) as u32,
            Mapping::CubeCross => 4 * (width / 3).min(height / 3),
        };
        let width = natural.clamp(8, self.params.map_width) & !1;
        probe.to_lat_long(width, width / 2, self.series.below_horizon, sunless)
    }
}
