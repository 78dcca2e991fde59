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
    let moments = Moments::new(params, day)?;
    let made = Made::new(params, &moments)?;
    let mut entries = Vec::with_capacity(moments.times.len());
    let all: Vec<u32> = (0..moments.times.len() as u32).collect();
    made.each(&all, keeper, |index, record| {
        let sky = record.coefficients().collect();
        let (time, map) = (moments.times[index as usize], map_name(index));
        entries.push(Entry { time, sun: record.sun, sky, fitted: record.fitted, map, sun_in_map: false });
    })?;
    Ok(entries)
}

/// Makes the skies `numbers` that the keeper has not.
pub(super) fn make(
    params: &LapseParams,
    day: &ModelDay,
    numbers: &[u32],
    keeper: &mut dyn SkyKeeper,
) -> Result<(), SkyError> {
    let moments = Moments::new(params, day)?;
    Made::new(params, &moments)?.each(numbers, keeper, |_, _| {})
}

/// The suns of all entries, as [`build`] finds them.
pub(super) fn suns(params: &LapseParams, day: &ModelDay) -> Result<Vec<Option<Sun>>, SkyError> {
    let moments = Moments::new(params, day)?;
    moments.times.iter().map(|&time| Ok(moments.at(time)?.1)).collect()
}

/// The moments of a day, and where the sun is at each.
struct Moments {
    place: Place,
    date: Date,
    times: Vec<TimeOfDay>,
    sky: ModelSky,
}

impl Moments {
    fn new(params: &LapseParams, day: &ModelDay) -> Result<Self, SkyError> {
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
        Ok(Self { place, date: day.date, times, sky: ModelSky::new(&day.model)? })
    }

    /// The middle of the sun, and what stands of it above the horizon, if anything does.
    fn at(&self, time: TimeOfDay) -> Result<(Vec3, Option<Sun>), SkyError> {
        let position = sun_position(&self.place, self.date, f64::from(time.seconds))?;
        let middle = position.direction(self.place.north_deg);
        let sun = self.sky.sun(middle).filter(|(irradiance, _)| luminance(*irradiance) > FAINTEST_KLX);
        let sun = sun.map(|(irradiance, direction): (Vec3, Vec3)| Sun {
            direction: direction.to_array(),
            irradiance: irradiance.to_array(),
            clipped: false,
        });
        Ok((middle, sun))
    }
}

/// What all entries are made of.
struct Made<'a> {
    params: &'a LapseParams,
    moments: &'a Moments,
    grid: Arc<ProbeGrid>,
    receivers: ReceiverFit,
}

impl<'a> Made<'a> {
    fn new(params: &'a LapseParams, moments: &'a Moments) -> Result<Self, SkyError> {
        let width = params.map_width.min(WIDEST_MAP);
        let grid = Arc::new(ProbeGrid::new(Mapping::LatLong, width, width / 2, 0.0)?);
        let receivers = ReceiverFit::new(params.coefficients as usize, params.surroundings);
        Ok(Self { params, moments, grid, receivers })
    }

    /// Takes the skies `numbers` from the keeper or makes them, some at a time.
    fn each(
        &self,
        numbers: &[u32],
        keeper: &mut dyn SkyKeeper,
        mut then: impl FnMut(u32, SkyRecord),
    ) -> Result<(), SkyError> {
        let count = self.moments.times.len() as u32;
        for some in numbers.chunks(AT_ONCE) {
            let kept: Vec<Option<SkyRecord>> = some.iter().map(|&index| keeper.kept(index, Some(index))).collect();
            let made: Vec<Result<(SkyRecord, Option<HdrImage>), SkyError>> = some
                .par_iter()
                .zip(kept)
                .map(|(&index, kept)| match kept {
                    Some(record) => Ok((record, None)),
                    None => self.record(index).map(|(record, image)| (record, Some(image))),
                })
                .collect();
            for (&index, made) in some.iter().zip(made) {
                let (record, image) = made?;
                if let Some(image) = &image {
                    let name = map_name(index);
                    let map = SkyMap { name: &name, image, index, count };
                    let failed = |problem| SkyError::Map { name: name.clone(), problem };
                    keeper.keep(index, &record, Some(map)).map_err(failed)?;
                }
                then(index, record);
            }
        }
        Ok(())
    }

    fn record(&self, index: u32) -> Result<(SkyRecord, HdrImage), SkyError> {
        let (middle, sun) = self.moments.at(self.moments.times[index as usize])?;
        let geometry = self.grid.geometry();
        let image = self.moments.sky.map(middle, geometry.width(), geometry.height());
        let probe = Probe::with_grid(image, self.grid.clone())?;
        let sky = probe.coefficients(self.params.coefficients as usize, BelowHorizon::Keep);
        let fitted = self.receivers.fit(&probe, BelowHorizon::Keep, &sky, sun.as_ref());
        let sky = sky.iter().map(Vec3::to_array).collect();
        Ok((SkyRecord { sun, sky, fitted, repairs: [0; 3], dim_spot: false }, probe.into_image()))
    }
}
