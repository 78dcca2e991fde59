//! A day from a clear-sky model.

use super::{Entry, LapseParams, SkyAt, SkyKeeper, SkyMap, SkyRecord, map_name, steps};
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
use std::cell::OnceCell;
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
    let mut entries = Vec::with_capacity(moments.times.len());
    let all: Vec<u32> = (0..moments.times.len() as u32).collect();
    moments.each(params, &all, keeper, |index, record| {
        let sky = record.coefficients().collect();
        let (time, map) = (moments.times[index as usize], map_name(index));
        entries.push(Entry { time, sun: record.sun, sky, fitted: record.fitted, map, sun_in_map: false });
    })?;
    Ok(entries)
}

/// The sky at a time.
pub(super) fn at(params: &LapseParams, day: &ModelDay, time: TimeOfDay) -> Result<SkyAt, SkyError> {
    let moments = Moments::new(params, day)?;
    let (record, map) = Maker::new(params, moments.sky()?)?.record(moments.middle(time)?)?;
    Ok(SkyAt { time, map, sun: record.sun, notes: Vec::new() })
}

/// The moments of a day.
pub(super) struct Moments {
    place: Place,
    date: Date,
    times: Vec<TimeOfDay>,
    model: ModelParams,
    /// Its tables take as long as several maps: made when they are first asked for.
    sky: OnceCell<ModelSky>,
}

impl Moments {
    pub fn new(params: &LapseParams, day: &ModelDay) -> Result<Self, SkyError> {
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
        Ok(Self { place, date: day.date, times, model: day.model, sky: OnceCell::new() })
    }

    fn sky(&self) -> Result<&ModelSky, SkyError> {
        match self.sky.get() {
            Some(sky) => Ok(sky),
            None => {
                let made = ModelSky::new(&self.model)?;
                Ok(self.sky.get_or_init(|| made))
            }
        }
    }

    /// The suns of all entries, as [`build`] finds them.
    pub fn suns(&self) -> Result<Vec<Option<Sun>>, SkyError> {
        let sky = self.sky()?;
        self.times.iter().map(|&time| Ok(sun_at(sky, self.middle(time)?))).collect()
    }

    /// The middle of the sun.
    fn middle(&self, time: TimeOfDay) -> Result<Vec3, SkyError> {
        let position = sun_position(&self.place, self.date, f64::from(time.seconds))?;
        Ok(position.direction(self.place.north_deg))
    }

    /// Takes the skies `numbers` from the keeper or makes them, some at a time.
    pub fn each(
        &self,
        params: &LapseParams,
        numbers: &[u32],
        keeper: &mut dyn SkyKeeper,
        mut then: impl FnMut(u32, SkyRecord),
    ) -> Result<(), SkyError> {
        let count = self.times.len() as u32;
        let mut maker = None;
        for some in numbers.chunks(AT_ONCE) {
            let kept: Vec<Option<SkyRecord>> = some.iter().map(|&index| keeper.kept(index, Some(index))).collect();
            let missing: Vec<(u32, Vec3)> = some
                .iter()
                .zip(&kept)
                .filter(|(_, kept)| kept.is_none())
                .map(|(&index, _)| Ok((index, self.middle(self.times[index as usize])?)))
                .collect::<Result<_, SkyError>>()?;
            if maker.is_none() && !missing.is_empty() {
                maker = Some(Maker::new(params, self.sky()?)?);
            }
            let made: Vec<Result<(SkyRecord, HdrImage), SkyError>> = match &maker {
                Some(maker) => missing.par_iter().map(|&(_, middle)| maker.record(middle)).collect(),
                None => Vec::new(),
            };
            let mut records = kept;
            for ((index, _), made) in missing.into_iter().zip(made) {
                let (record, image) = made?;
                let name = map_name(index);
                let map = SkyMap { name: &name, image: &image, index, count };
                let failed = |problem| SkyError::Map { name: name.clone(), problem };
                keeper.keep(index, &record, Some(map)).map_err(failed)?;
                let place = some.iter().position(|&other| other == index);
                place.into_iter().for_each(|place| records[place] = Some(record.clone()));
            }
            for (&index, record) in some.iter().zip(records) {
                record.into_iter().for_each(|record| then(index, record));
            }
        }
        Ok(())
    }
}

/// What stands of the sun above the horizon, if anything does.
fn sun_at(sky: &ModelSky, middle: Vec3) -> Option<Sun> {
    let sun = sky.sun(middle).filter(|(irradiance, _)| luminance(*irradiance) > FAINTEST_KLX);
    sun.map(|(irradiance, direction): (Vec3, Vec3)| Sun {
        direction: direction.to_array(),
        irradiance: irradiance.to_array(),
        clipped: false,
    })
}

/// What all entries are made with.
struct Maker<'a> {
    params: &'a LapseParams,
    sky: &'a ModelSky,
    grid: Arc<ProbeGrid>,
    receivers: ReceiverFit,
}

impl<'a> Maker<'a> {
    fn new(params: &'a LapseParams, sky: &'a ModelSky) -> Result<Self, SkyError> {
        let width = params.map_width.min(WIDEST_MAP);
        let grid = Arc::new(ProbeGrid::new(Mapping::LatLong, width, width / 2, 0.0)?);
        let receivers = ReceiverFit::new(params.coefficients as usize, params.surroundings);
        Ok(Self { params, sky, grid, receivers })
    }

    fn record(&self, middle: Vec3) -> Result<(SkyRecord, HdrImage), SkyError> {
        let sun = sun_at(self.sky, middle);
        let geometry = self.grid.geometry();
        let image = self.sky.map(middle, geometry.width(), geometry.height());
        let probe = Probe::with_grid(image, self.grid.clone())?;
        let sky = probe.coefficients(self.params.coefficients as usize, BelowHorizon::Keep);
        let fitted = self.receivers.fit(&probe, BelowHorizon::Keep, &sky, sun.as_ref());
        let sky = sky.iter().map(Vec3::to_array).collect();
        Ok((SkyRecord { sun, sky, fitted, repairs: [0; 3], dim_spot: false }, probe.into_image()))
    }
}
