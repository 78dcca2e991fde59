//! A day from HDR images.

use super::schedule::{Mix, Schedule};
use super::taken::Taker;
use super::{Entry, LapseNote, LapseParams, SkyAt, SkyKeeper, SkyMap, SkyRecord, map_name};
use crate::civil::TimeOfDay;
use crate::error::SkyError;
use crate::lapse::{Fitted, Sun};
use crate::mapping::{BelowHorizon, Mapping};
use crate::sun::SunParams;
use glam::Vec3;
use heliodon_image::{HdrImage, PixelRepairs};
use std::path::PathBuf;

/// An image of the sky, and when it was taken.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ProbeFile {
    /// The file.
    pub path: PathBuf,
    /// Local time; read from the file's name where absent.
    pub time: Option<TimeOfDay>,
}

/// What holds between two probes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Between {
    /// The nearer one.
    Nearest,
    /// Both, weighted by their distance in time.
    #[default]
    Interpolate,
}

/// Images of the sky through a day, or a single one for all times.
#[derive(Clone, Debug, PartialEq)]
pub struct ProbeSeries {
    /// The images, in any order.
    pub files: Vec<ProbeFile>,
    /// How their pixels lie on the sphere.
    pub mapping: Mapping,
    /// The compass bearing, clockwise in degrees, of what the mapping calls north.
    pub turn_deg: f64,
    /// What gives light below the horizon.
    pub below_horizon: BelowHorizon,
    /// What holds between two of them.
    pub between: Between,
    /// Irradiance of the sun, in the probes' unit times steradians, where a probe's sun is clipped.
    pub sun_irradiance: Option<Vec3>,
    /// When a bright spot is a sun.
    pub sun: SunParams,
}

impl ProbeSeries {
    /// A series with nothing turned, cut or replaced.
    #[must_use]
    pub fn new(files: Vec<ProbeFile>, mapping: Mapping) -> Self {
        Self {
            files,
            mapping,
            turn_deg: 0.0,
            below_horizon: BelowHorizon::Keep,
            between: Between::Interpolate,
            sun_irradiance: None,
            sun: SunParams::default(),
        }
    }

    /// Whether one image stands for all times.
    #[must_use]
    pub fn is_single(&self) -> bool {
        self.files.len() == 1
    }
}

pub(super) fn build(
    params: &LapseParams,
    series: &ProbeSeries,
    keeper: &mut dyn SkyKeeper,
) -> Result<(Vec<Entry>, Vec<LapseNote>), SkyError> {
    let mut probes = Probes::new(params, series)?;
    let mut notes = probes.schedule.notes(series);
    let mut records: Vec<Option<SkyRecord>> = vec![None; probes.schedule.probes.len()];
    for number in 0..probes.schedule.used.len() as u32 {
        let record = probes.record(number, keeper)?;
        let k = probes.schedule.used[number as usize];
        tell_of_probe(&probes.schedule.probes[k].0.display().to_string(), &record, series, &mut notes);
        records[k] = Some(record);
    }
    let Probes { schedule, names, .. } = probes;
    tell_of_irradiance(&records, series, &mut notes);
    let entries = schedule.times.iter().zip(&schedule.mixes).filter_map(|(&time, mix)| {
        let record = mixed(mix, &records)?;
        let sky = record.coefficients().collect();
        let map = names[mix.nearest()].clone();
        Some(Entry { time, sun: record.sun, sky, fitted: record.fitted, map, sun_in_map: true })
    });
    Ok((entries.collect(), notes))
}

/// The sky at the time of the only entry: that between the two probes around it, or the nearer one's.
pub(super) fn at(params: &LapseParams, series: &ProbeSeries) -> Result<SkyAt, SkyError> {
    let schedule = Schedule::new(params, series)?;
    let ([time, ..], [mix, ..]) = (&schedule.times[..], &schedule.mixes[..]) else { return Err(SkyError::no_probes()) };
    let mut notes = schedule.notes(series);
    // one time needs no more of them
    notes.retain(|note| !matches!(note, LapseNote::Unused { .. }));
    let within = (*time).clamp(schedule.probes[0].1, schedule.probes[schedule.probes.len() - 1].1);
    if within != *time {
        notes.retain(|note| !matches!(note, LapseNote::Gap { .. }));
        notes.push(LapseNote::Outside { asked: *time, nearest: within });
    }
    let mut taker = Taker::new(params, series);
    let mut records: Vec<Option<SkyRecord>> = vec![None; schedule.probes.len()];
    let mut map: Option<HdrImage> = None;
    for &k in &schedule.used {
        let path = &schedule.probes[k].0;
        let taken = taker.take(path)?;
        let sunless = taker.sunless_map(&taken);
        map = Some(match map {
            None => sunless,
            Some(first) => first.mixed_lat_long(&sunless, mix.share),
        });
        tell_of_probe(&path.display().to_string(), &taken.record, series, &mut notes);
        records[k] = Some(taken.record);
    }
    tell_of_irradiance(&records, series, &mut notes);
    let (Some(map), Some(record)) = (map, mixed(mix, &records)) else { return Err(SkyError::no_probes()) };
    Ok(SkyAt { time: within, map, sun: record.sun, notes })
}

/// Makes the skies `numbers` that the keeper has not.
pub(super) fn make(
    params: &LapseParams,
    series: &ProbeSeries,
    numbers: &[u32],
    keeper: &mut dyn SkyKeeper,
) -> Result<(), SkyError> {
    let mut probes = Probes::new(params, series)?;
    numbers.iter().try_for_each(|&number| probes.record(number, keeper).map(drop))
}

/// The probes of a day that are read, in their order.
struct Probes<'a> {
    schedule: Schedule,
    taker: Taker<'a>,
    /// The index of the map of each that is shown, by its number.
    map_indices: Vec<Option<u32>>,
    /// The names of the maps of all probes; empty for what is not shown.
    names: Vec<String>,
    maps: u32,
}

impl<'a> Probes<'a> {
    fn new(params: &'a LapseParams, series: &'a ProbeSeries) -> Result<Self, SkyError> {
        let schedule = Schedule::new(params, series)?;
        let mut names = vec![String::new(); schedule.probes.len()];
        let (mut map_indices, mut maps) = (Vec::new(), 0);
        for &k in &schedule.used {
            let index = schedule.is_shown(k).then_some(maps);
            if index.is_some() {
                names[k] = map_name(maps);
                maps += 1;
            }
            map_indices.push(index);
        }
        Ok(Self { schedule, taker: Taker::new(params, series), map_indices, names, maps })
    }

    /// What the keeper has of a probe, or what is found in it now.
    fn record(&mut self, number: u32, keeper: &mut dyn SkyKeeper) -> Result<SkyRecord, SkyError> {
        let map_index = self.map_indices[number as usize];
        if let Some(record) = keeper.kept(number, map_index) {
            return Ok(record);
        }
        let k = self.schedule.used[number as usize];
        let path = &self.schedule.probes[k].0;
        let taken = self.taker.take(path)?;
        let image = map_index.map(|_| self.taker.drawn_map(&taken));
        let record = taken.record;
        let map = image.as_ref().zip(map_index);
        let map = map.map(|(image, index)| SkyMap { name: &self.names[k], image, index, count: self.maps });
        let failed = |problem| SkyError::Map { name: path.display().to_string(), problem };
        keeper.keep(number, &record, map).map_err(failed)?;
        Ok(record)
    }
}

/// How many probes are read.
pub(super) fn sky_count(params: &LapseParams, series: &ProbeSeries) -> Result<u32, SkyError> {
    Ok(Schedule::new(params, series)?.used.len() as u32)
}

fn tell_of_probe(file: &str, record: &SkyRecord, series: &ProbeSeries, notes: &mut Vec<LapseNote>) {
    let file = file.to_owned();
    let [nan, infinite, negative] = record.repairs;
    if record.repairs != [0; 3] {
        notes.push(LapseNote::Repaired { file: file.clone(), repairs: PixelRepairs { nan, infinite, negative } });
    }
    if record.sun.is_some_and(|sun| sun.clipped) {
        notes.push(LapseNote::Clipped { file, replaced: series.sun_irradiance.is_some() });
    } else if record.dim_spot {
        notes.push(LapseNote::ClippedSpot { file });
    }
}

/// Tells where the site's own irradiance is of no use.
fn tell_of_irradiance(records: &[Option<SkyRecord>], series: &ProbeSeries, notes: &mut Vec<LapseNote>) {
    if series.sun_irradiance.is_none() {
        return;
    }
    let used: Vec<&SkyRecord> = records.iter().flatten().collect();
    let count = |is: &dyn Fn(&SkyRecord) -> bool| used.iter().filter(|record| is(record)).count() as u32;
    let sunless = count(&|record| record.sun.is_none());
    let unclipped = count(&|record| record.sun.is_some_and(|sun| !sun.clipped));
    if sunless + unclipped > 0 {
        notes.push(LapseNote::IrradianceUnused { probes: used.len() as u32, sunless, unclipped });
    }
}

fn mixed(mix: &Mix, records: &[Option<SkyRecord>]) -> Option<SkyRecord> {
    let near = records[mix.nearest()].clone()?;
    if mix.share == 0.0 || mix.share == 1.0 {
        return Some(near);
    }
    let (a, b) = (records[mix.a].as_ref()?, records[mix.b].as_ref()?);
    let t = mix.share;
    let sky = a.coefficients().zip(b.coefficients()).map(|(a, b)| a.lerp(b, t).to_array()).collect();
    let sun = match (a.sun, b.sun) {
        (Some(a), Some(b)) => {
            let direction = Vec3::from_array(a.direction).lerp(Vec3::from_array(b.direction), t);
            Some(Sun {
                direction: direction.try_normalize().map_or(a.direction, |d| d.to_array()),
                irradiance: Vec3::from_array(a.irradiance).lerp(Vec3::from_array(b.irradiance), t).to_array(),
                clipped: a.clipped || b.clipped,
            })
        }
        // only one shows the sun: a cloud came or went
        _ => near.sun,
    };
    let fitted = match (&a.fitted, &b.fitted) {
        (None, None) => None,
        _ => Some(mixed_fit(&a.shaded(), &b.shaded(), t)),
    };
    // a glow goes with a sun
    let fitted = match (fitted, sun, a.sun.or(b.sun)) {
        (Some(fitted), None, Some(gone)) => Some(fitted.without_glow(Vec3::from_array(gone.direction))),
        (fitted, ..) => fitted,
    };
    Some(SkyRecord { sun, sky, fitted, ..near })
}

fn mixed_fit(a: &Fitted, b: &Fitted, t: f32) -> Fitted {
    let between = |a: [f32; 3], b: [f32; 3]| Vec3::from_array(a).lerp(Vec3::from_array(b), t).to_array();
    Fitted { glow: between(a.glow, b.glow), sky: a.sky.iter().zip(&b.sky).map(|(&a, &b)| between(a, b)).collect() }
}
