//! Building the lapse of a day from probes or from a sky model.
//!
//! **Steps.** The lapse has `sky_steps` entries, spread evenly from `first` to `last`, both included. Entry i belongs to the sun step
//! `i * sun_steps / sky_steps`, rounded down; the first entry of a sun step sets its sun, the others repeat it and change the sky only (with twice as many
//! entries as sun steps: even ones change both, odd ones the sky, as in Callieri et al. 2006).
//!
//! **Span.** Probes: from the first to the last. Models: from the sun's rise above to its fall below -6 degrees (civil twilight), or the
//! whole day where it does neither. `sun` is null where nothing of its disc stands above the level horizon.
//!
//! **Probes.** The sun is found in each probe, measured, and taken out before the sky's coefficients are summed; the map that is
//! drawn keeps it. Between two probes either the nearer one holds, or coefficients and suns are interpolated in time (the map is always the nearer one's).
//! Irradiance of a clipped sun is replaced where the site gives one.
//!
//! Maps are handed over one at a time, so that a day of them never lies in memory.

mod exposure;
mod model_day;
mod probe_series;
mod record;
mod schedule;
mod steps;
mod table;
mod taken;

pub use model_day::ModelDay;
pub use probe_series::{Between, ProbeFile, ProbeSeries};
pub use record::{SkyKeeper, SkyRecord};
pub use table::table;

use crate::civil::TimeOfDay;
use crate::error::SkyError;
use crate::fit::Surroundings;
use crate::lapse::{Fitted, Lapse, LapseStep, Sun};
use glam::Vec3;
use heliodon_image::{HdrImage, PixelRepairs};
use std::fmt;

/// What a lapse is made from.
#[derive(Clone, Debug)]
pub struct LapseParams {
    /// The compass bearing, clockwise, of the model's -Z, in degrees.
    pub north_deg: f64,
    /// Sun positions of the day (T): each costs a bit a vertex.
    pub sun_steps: u32,
    /// Entries of the lapse, at least as many: each costs a sky map.
    pub sky_steps: u32,
    /// The first entry's time; the probes' first, or civil dawn.
    pub first: Option<TimeOfDay>,
    /// The last entry's time; the probes' last, or civil dusk.
    pub last: Option<TimeOfDay>,
    /// Sky coefficients: 4, or 9 for sharper shading under uneven skies.
    pub coefficients: u32,
    /// The widest sky map, in pixels (half as high); models make theirs 512 wide at most.
    pub map_width: u32,
    /// What surfaces see below the horizon, for which the light that viewers shade with is fitted.
    pub surroundings: Surroundings,
    /// Where the sky comes from.
    pub source: SkySource,
}

impl LapseParams {
    /// The paper's 92 sun and 184 sky steps, 4 coefficients, maps of at most 1024 x 512.
    #[must_use]
    pub fn new(source: SkySource) -> Self {
        Self {
            north_deg: 0.0,
            sun_steps: 92,
            sky_steps: 184,
            first: None,
            last: None,
            coefficients: 4,
            map_width: 1024,
            surroundings: Surroundings::Open,
            source,
        }
    }

    /// Sun positions of the day: as asked, or 1 where a single probe stands for all times.
    #[must_use]
    pub fn effective_sun_steps(&self) -> u32 {
        match &self.source {
            SkySource::Probes(series) if series.is_single() => 1,
            _ => self.sun_steps,
        }
    }

    /// How many skies the day is made of: probes that are read, or moments of the model.
    ///
    /// # Errors
    /// As [`build`], before it reads a probe.
    pub fn sky_count(&self) -> Result<u32, SkyError> {
        check(self)?;
        match &self.source {
            SkySource::Probes(series) => probe_series::sky_count(self, series),
            SkySource::Model(_) => Ok(self.sky_steps),
        }
    }
}

/// The name of a map in the bundle: `sky/0001.hdr` is the first.
#[must_use]
pub fn map_name(index: u32) -> String {
    format!("sky/{:04}.hdr", index + 1)
}

/// Where a day's sky comes from.
#[derive(Clone, Debug)]
pub enum SkySource {
    /// HDR images.
    Probes(ProbeSeries),
    /// A clear-sky model.
    Model(ModelDay),
}

/// A sky map to keep.
#[derive(Clone, Copy, Debug)]
pub struct SkyMap<'a> {
    /// Its name in the bundle, `sky/0001.hdr`.
    pub name: &'a str,
    /// Lat-long, linear.
    pub image: &'a HdrImage,
    /// How many maps were handed over before.
    pub index: u32,
    /// How many there are.
    pub count: u32,
}

/// The day, and what the maker should be told.
#[derive(Clone, Debug)]
pub struct BuiltLapse {
    /// The lapse, without the basis of bounced sunlight.
    pub lapse: Lapse,
    /// Sun steps: as asked, or 1 where a single probe stands for all times.
    pub sun_steps: u32,
    /// The direction to the sun at each sun step; `None` where there is none.
    pub suns: Vec<Option<Vec3>>,
    /// What the maker should be told.
    pub notes: Vec<LapseNote>,
}

/// The sky at one time, its sun apart.
#[derive(Clone, Debug)]
pub struct SkyAt {
    /// The time that was asked for; of probes, the nearest that lies between the first and the last.
    pub time: TimeOfDay,
    /// Lat-long, linear, without the sun.
    pub map: HdrImage,
    /// The sun, where there is one.
    pub sun: Option<Sun>,
    /// What the maker should be told.
    pub notes: Vec<LapseNote>,
}

/// Something that the maker of a lapse should know.
#[derive(Clone, Debug, PartialEq)]
pub enum LapseNote {
    /// No probe lies near an entry.
    Gap {
        /// From this time.
        from: TimeOfDay,
        /// To this time no probe was taken.
        to: TimeOfDay,
        /// Entries that lie between.
        entries: u32,
    },
    /// Times in names that may be nothing but numbers.
    Numbered {
        /// The first.
        first: TimeOfDay,
        /// The last.
        last: TimeOfDay,
    },
    /// A time at which no probe was taken, nor one before and one after it.
    Outside {
        /// The time.
        asked: TimeOfDay,
        /// The nearest probe's.
        nearest: TimeOfDay,
    },
    /// More probes than entries: some are not used.
    Unused {
        /// How many.
        probes: u32,
    },
    /// A sun that was brighter than its image could hold.
    Clipped {
        /// The probe.
        file: String,
        /// Whether the site's own irradiance took its place.
        replaced: bool,
    },
    /// A clipped spot that may be a sun, of which too little is left.
    ClippedSpot {
        /// The probe.
        file: String,
    },
    /// The site gives the sun's irradiance, and some probes have no use for it.
    IrradianceUnused {
        /// Probes that were read.
        probes: u32,
        /// Of these, without a sun.
        sunless: u32,
        /// Of these, with a sun that is not clipped.
        unclipped: u32,
    },
    /// Components of a probe that were no radiance.
    Repaired {
        /// The probe.
        file: String,
        /// How many.
        repairs: PixelRepairs,
    },
}

impl fmt::Display for LapseNote {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Gap { from, to, entries } => {
                write!(f, "no probe between {from} and {to}: {entries} entries take theirs from the ends of this gap")
            }
            Self::Numbered { first, last } => write!(
                f,
                "the probes' names were read as times, {first} to {last}, one minute apart: where they only count the images, \
                 list the times in sky.times, or put them into the names"
            ),
            Self::Outside { asked, nearest } => {
                let early = if asked < nearest { "early" } else { "late" };
                write!(f, "no probe was taken as {early} as {asked}: that of {nearest} is used")
            }
            Self::Unused { probes } => {
                write!(f, "{probes} probes lie between entries and are not used: raise sky_steps to use them")
            }
            Self::Clipped { file, replaced: true } => {
                write!(f, "{file}: the sun is clipped; the site's sun_irradiance takes its place")
            }
            Self::Clipped { file, replaced: false } => {
                write!(f, "{file}: the sun is clipped, its irradiance is a lower bound: set sky.sun_irradiance")
            }
            Self::ClippedSpot { file } => write!(
                f,
                "{file}: its brightest spot is clipped, and what is left of it is too weak to be taken for a sun: \
                 if it is the sun, set sky.sun_irradiance"
            ),
            Self::IrradianceUnused { probes, sunless, unclipped } => {
                write!(f, "sky.sun_irradiance is used only where a sun is clipped; of {probes} probes, ")?;
                match (sunless, unclipped) {
                    (sunless, 0) => write!(f, "{sunless} show no sun"),
                    (0, unclipped) => write!(f, "{unclipped} have one that is not, which keeps its own"),
                    (sunless, unclipped) => {
                        write!(f, "{sunless} show none, and {unclipped} have one that is not clipped, which keeps its own")
                    }
                }
            }
            Self::Repaired { file, repairs } => write!(
                f,
                "{file}: {} components are NaN, {} infinite and {} negative; they were set to 0, to the largest and to 0",
                repairs.nan, repairs.infinite, repairs.negative
            ),
        }
    }
}

/// An entry before exposure.
struct Entry {
    time: TimeOfDay,
    /// Its own sun; the lapse repeats the sun step's.
    sun: Option<Sun>,
    sky: Vec<Vec3>,
    /// Fitted with its own sun.
    fitted: Option<Fitted>,
    map: String,
    sun_in_map: bool,
}

/// Receives the maps, in order.
type Sink<'a> = &'a mut dyn FnMut(SkyMap<'_>) -> Result<(), String>;

/// Builds the lapse of a day and hands its maps to `sink`, one by one; what the sink answers with ends the work.
///
/// # Errors
/// Where a probe cannot be read or its time is unknown, or a setting has no meaning.
pub fn build(params: &LapseParams, sink: Sink<'_>) -> Result<BuiltLapse, SkyError> {
    build_keeping(params, &mut record::MapsOnly(sink))
}

/// As [`build`], with what an earlier run of the same day has kept.
///
/// # Errors
/// As [`build`], and what the keeper answers with.
pub fn build_keeping(params: &LapseParams, keeper: &mut dyn SkyKeeper) -> Result<BuiltLapse, SkyError> {
    check(params)?;
    let sun_steps = params.effective_sun_steps();
    let (entries, notes) = match &params.source {
        SkySource::Probes(series) => probe_series::build(params, series, keeper)?,
        SkySource::Model(day) => (model_day::build(params, day, keeper)?, Vec::new()),
    };
    let exposures = exposure::stops(&entries);
    let count = entries.len() as u32;
    let mut suns: Vec<Option<Sun>> = Vec::new();
    let mut lapse_steps = Vec::with_capacity(entries.len());
    for (i, (entry, exposure_stops)) in entries.into_iter().zip(exposures).enumerate() {
        let mask_bit = steps::mask_bit(i as u32, count, sun_steps);
        if suns.len() <= mask_bit as usize {
            suns.push(entry.sun);
        }
        let sun = suns[mask_bit as usize];
        let fitted = match (entry.fitted, entry.sun) {
            (Some(fitted), Some(own)) if sun.is_none() => Some(fitted.without_glow(Vec3::from_array(own.direction))),
            (fitted, _) => fitted,
        };
        lapse_steps.push(LapseStep {
            time: entry.time.to_string(),
            sun,
            sky: entry.sky.iter().map(Vec3::to_array).collect(),
            fitted,
            exposure_stops,
            sky_map: entry.map,
            mask_bit,
            sun_in_map: entry.sun_in_map,
        });
    }
    Ok(BuiltLapse {
        lapse: Lapse { steps: lapse_steps, sun_bounce_basis: None },
        sun_steps,
        suns: suns.into_iter().map(|s| s.map(|s| Vec3::from_array(s.direction))).collect(),
        notes,
    })
}

/// The sky at a time, as [`build`] makes it for an entry, but with a map that lies between those of two probes as all else does, and has no sun. A
/// single probe stands for all times.
///
/// # Errors
/// As [`build`].
pub fn sky_at(params: &LapseParams, time: TimeOfDay) -> Result<SkyAt, SkyError> {
    let params = LapseParams { first: Some(time), last: Some(time), sky_steps: 1, sun_steps: 1, ..params.clone() };
    check(&params)?;
    match &params.source {
        SkySource::Probes(series) => probe_series::at(&params, series),
        SkySource::Model(day) => model_day::at(&params, day, time),
    }
}

/// The skies of a day one by one, for machines that share them.
pub struct Skies {
    params: LapseParams,
    /// Of a model.
    moments: Option<model_day::Moments>,
}

impl Skies {
    /// Those of a day.
    ///
    /// # Errors
    /// As [`build`], before anything is read.
    pub fn new(params: LapseParams) -> Result<Self, SkyError> {
        check(&params)?;
        let moments = match &params.source {
            SkySource::Probes(_) => None,
            SkySource::Model(day) => Some(model_day::Moments::new(&params, day)?),
        };
        Ok(Self { params, moments })
    }

    /// What they are made from.
    #[must_use]
    pub fn params(&self) -> &LapseParams {
        &self.params
    }

    /// Makes those of `numbers` (below [`LapseParams::sky_count`]) that the keeper has not: a part of the work of [`build_keeping`].
    ///
    /// # Errors
    /// As [`build_keeping`].
    pub fn make(&self, numbers: &[u32], keeper: &mut dyn SkyKeeper) -> Result<(), SkyError> {
        match (&self.params.source, &self.moments) {
            (SkySource::Probes(series), _) => probe_series::make(&self.params, series, numbers, keeper),
            (SkySource::Model(_), Some(moments)) => moments.each(&self.params, numbers, keeper, |_, _| {}),
            (SkySource::Model(_), None) => Ok(()),
        }
    }

    /// The direction to the sun at each sun step, as [`BuiltLapse::suns`] has them, where no image need be read to know them: those of a model.
    ///
    /// # Errors
    /// As [`build`].
    pub fn known_suns(&self) -> Result<Option<Vec<Option<Vec3>>>, SkyError> {
        let Some(moments) = &self.moments else { return Ok(None) };
        let entries = moments.suns()?;
        let mut suns = Vec::new();
        for (i, sun) in entries.iter().enumerate() {
            if steps::mask_bit(i as u32, entries.len() as u32, self.params.sun_steps) as usize == suns.len() {
                suns.push(sun.map(|sun| Vec3::from_array(sun.direction)));
            }
        }
        Ok(Some(suns))
    }
}

fn check(params: &LapseParams) -> Result<(), SkyError> {
    if params.sun_steps == 0 || params.sun_steps > 1024 {
        return Err(SkyError::setting("sun_steps", format!("is {}", params.sun_steps), "give 1 to 1024"));
    }
    if params.sky_steps < params.sun_steps {
        return Err(SkyError::setting(
            "sky_steps",
            format!("is {}, less than the {} sun steps", params.sky_steps, params.sun_steps),
            "give every sun step an entry of the sky, best two",
        ));
    }
    if params.coefficients != 4 && params.coefficients != 9 {
        return Err(SkyError::setting("coefficients", format!("is {}", params.coefficients), "give 4 or 9"));
    }
    if params.map_width < 8 || params.map_width > 16_384 {
        return Err(SkyError::setting("map width", format!("is {}", params.map_width), "give 8 to 16384"));
    }
    if !params.north_deg.is_finite() {
        return Err(SkyError::setting("north_deg", "is not finite", "give degrees"));
    }
    Ok(())
}
