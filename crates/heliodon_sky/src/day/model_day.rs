//! A day from a clear-sky model.

use super::{Entry, LapseParams, SkyKeeper, SkyMap, SkyRecord, map_name, steps};
use crate::civil::{Date, TimeOfDay};
use crate::error::SkyError;
use crate::fit::ReceiverFit;
use crate::lapse::Sun;
use crate::mapping::{BelowHorizon, Mapping, ProbeGrid};
use crate::model::{ModelParams, ModelSky};
use crate::probe::Probe;
use crate::solar::{Place, rise_and_set, sun_position};
use glam::Vec3;
use heliodon_image::HdrImage;
use heliodon_math::color::luminance;
use rayon::prelude::*;
use std::sync::Arc;

/// A clear day at a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModelDay {
    /// The sky.
    pub model: ModelParams,
    /// Degrees north.
    pub latitude_deg: f64,
    /// Degrees east.
    pub longitude_deg: f64,
    /// Hours by which local time is ahead of universal time.
    pub utc_offset_hours: f64,
    /// The day.
    pub date: Date,
}

/// The geometric height of the sun at which a model's day begins and ends: civil twilight.
const DAWN_DEG: f64 = -6.0;

/// Maps of models are smooth: more pixels show nothing more.
const WIDEST_MAP: u32 = 512;

/// Maps in memory at a time.
const AT_ONCE: usize = 8;

/// A sun fainter than this (0.01 lux) is none.
const FAINTEST_KLX: f32 = 1e-5;

pub(super) fn build(params: &LapseParams, day: &ModelDay, keeper: &mut dyn SkyKeeper) -> Result<Vec<Entry>, SkyError> {
    let place = Place {
        latitude_deg: day.latitude_deg,
        longitude_deg: day.longitude_deg,
        utc_offset_hours: day.utc_offset_hours,
        north_deg: params.north_deg,
    };
    let span = rise_and_set(&place, day.date, DAWN_DEG)?;
    let whole = (TimeOfDay { seconds: 0 }, TimeOfDay { seconds: 86_399 });
    let (dawn, dusk) = span.unwrap_or(whole);
    let times = steps::times(params.first.unwrap_or(dawn), params.last.unwrap_or(dusk), params.sky_steps)?;
    let sky = ModelSky::new(&day.model)?;
    let width = params.map_width.min(WIDEST_MAP);
    let grid = Arc::new(ProbeGrid::new(Mapping::LatLong, width, width / 2, 0.0)?);
    let receivers = ReceiverFit::new(params.coefficients as usize, params.surroundings);
    let made_of = Made { params, place, date: day.date, sky, grid, receivers };
    let mut entries = Vec::with_capacity(times.len());
    for (block, some) in times.chunks(AT_ONCE).enumerate() {
        let first = (block * AT_ONCE) as u32;
        let kept: Vec<Option<SkyRecord>> = (first..).zip(some).map(|(index, _)| keeper.kept(index, Some(index))).collect();
        let made: Vec<Result<(SkyRecord, Option<HdrImage>), SkyError>> = some
            .par_iter()
            .zip(kept)
            .map(|(&time, kept)| match kept {
                Some(record) => Ok((record, None)),
                None => made_of.record(time).map(|(record, image)| (record, Some(image))),
            })
            .collect();
        for ((index, &time), made) in (first..).zip(some).zip(made) {
            let (record, image) = made?;
            let name = map_name(index);
            if let Some(image) = &image {
                let map = SkyMap { name: &name, image, index, count: times.len() as u32 };
                let failed = |problem| SkyError::Map { name: name.clone(), problem };
                keeper.keep(index, &record, Some(map)).map_err(failed)?;
            }
            let sky = record.coefficients().collect();
            entries.push(Entry { time, sun: record.sun, sky, fitted: record.fitted, map: name, sun_in_map: false });
        }
    }
    Ok(entries)
}

/// What all entries are made of.
struct Made<'a> {
    params: &'a LapseParams,
    place: Place,
    date: Date,
    sky: ModelSky,
    grid: Arc<ProbeGrid>,
    receivers: ReceiverFit,
}

impl Made<'_> {
    fn record(&self, time: TimeOfDay) -> Result<(SkyRecord, HdrImage), SkyError> {
        let position = sun_position(&self.place, self.date, f64::from(time.seconds))?;
        let middle = position.direction(self.place.north_deg);
        let sun = self.sky.sun(middle).filter(|(irradiance, _)| luminance(*irradiance) > FAINTEST_KLX);
        let sun = sun.map(|(irradiance, direction): (Vec3, Vec3)| Sun {
            direction: direction.to_array(),
            irradiance: irradiance.to_array(),
            clipped: false,
        });
        let geometry = self.grid.geometry();
        let image = self.sky.map(middle, geometry.width(), geometry.height());
        let probe = Probe::with_grid(image, self.grid.clone())?;
        let sky = probe.coefficients(self.params.coefficients as usize, BelowHorizon::Keep);
        let fitted = self.receivers.fit(&probe, BelowHorizon::Keep, &sky, sun.as_ref());
        let sky = sky.iter().map(Vec3::to_array).collect();
        Ok((SkyRecord { sun, sky, fitted, repairs: [0; 3], dim_spot: false }, probe.into_image()))
    }
}
