//! The sky of a site's day: from `site.toml` to the lapse and its maps.

use crate::blocks::Share;
use crate::cache::Cache;
use crate::error::BakeError;
use crate::names::SkyNames;
use crate::plan::Plan;
use crate::report::Reporter;
use glam::Vec3;
use heliodon_bundle::site::{self, InputFile, InputKind, ProbeTimes, Role, Site};
use heliodon_sky::SkyError;
use heliodon_sky::civil;
use heliodon_sky::day::{
    self, Between, BuiltLapse, LapseParams, ModelDay, ProbeFile, ProbeSeries, Skies, SkyKeeper, SkyMap, SkyRecord, SkySource,
};
use heliodon_sky::fit::Surroundings;
use heliodon_sky::lapse::Lapse;
use heliodon_sky::mapping::{BelowHorizon, Mapping};
use heliodon_sky::model::{ModelKind, ModelParams};
use serde::{Deserialize, Serialize};

/// The lapse of a site, with its maps in the cache.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BakedSky {
    /// The lapse, without the basis of bounced sunlight.
    pub lapse: Lapse,
    /// Sun steps: as the site says, or 1 where a single probe stands for all times.
    pub sun_steps: u32,
    /// The maps' paths in the bundle.
    pub map_paths: Vec<String>,
    /// What the site's author should know.
    notes: Vec<String>,
    /// What the maps' blocks are called.
    map_stage: String,
}

impl BakedSky {
    /// The bytes of a map.
    ///
    /// # Errors
    /// If it was taken out of the cache meanwhile.
    pub fn map_bytes(&self, cache: &Cache, index: usize) -> Result<Vec<u8>, BakeError> {
        cache.load(&self.map_stage, index).ok_or_else(|| BakeError::Read {
            path: cache.folder().join(&self.map_paths[index]),
            source: std::io::Error::other("a finished sky map has gone while the bake was running; run the bake again"),
        })
    }

    /// Unit directions to the sun, one for each sun step; zero where there is none.
    #[must_use]
    pub fn suns(&self) -> Vec<Vec3> {
        let of_step = |bit: u32| self.lapse.steps.iter().find(|step| step.mask_bit == bit).and_then(|step| step.sun);
        (0..self.sun_steps).map(|bit| of_step(bit).map_or(Vec3::ZERO, |sun| Vec3::from_array(sun.direction))).collect()
    }
}

/// Builds the lapse and keeps its maps, or takes both from an earlier run.
///
/// # Errors
/// A sky that cannot be made, or a cache that cannot be written.
pub fn bake_sky(plan: &Plan, cache: &Cache, reporter: &dyn Reporter) -> Result<BakedSky, BakeError> {
    place_warnings(&plan.site).iter().for_each(|warning| reporter.warning(warning));
    let params = lapse_params(&plan.site, &plan.files)?;
    let names = names_of(plan, &params);
    let count = params.sky_count()?;
    let kept = cache.load(&names.lapse, 0).and_then(|bytes| serde_json::from_slice::<BakedSky>(&bytes).ok());
    if let Some(sky) = kept.filter(|sky| (0..sky.map_paths.len()).all(|index| cache.load(&names.map, index).is_some())) {
        reporter.note("going on: the sky is done");
        cache.taken(SKY, count as usize, count as usize);
        return Ok(told(sky, reporter));
    }
    reporter.stage(SKY, u64::from(count));
    reporter.progress(0);
    let done = (0..count as usize).filter(|&number| cache.has(&names.record, number)).count();
    if done > 0 {
        reporter.note(&format!("going on: {done} of {count} skies are done"));
    }
    let mut keeper = CacheKeeper::new(plan, cache, reporter, &names);
    let built = day::build_keeping(&params, &mut keeper);
    let BuiltLapse { lapse, sun_steps, notes, .. } = keeper.checked(built)?;
    reporter.finished();
    cache.taken(SKY, count as usize - keeper.made.min(count as usize), count as usize);
    let map_paths = (0..keeper.maps).map(day::map_name).collect();
    let notes = notes.iter().map(ToString::to_string).collect();
    let sky = BakedSky { lapse, sun_steps, map_paths, notes, map_stage: names.map.clone() };
    let bytes = serde_json::to_vec(&sky).map_err(std::io::Error::other);
    let bytes = bytes.map_err(|source| BakeError::Read { path: cache.folder().to_owned(), source })?;
    cache.store(&names.lapse, 0, &bytes)?;
    Ok(told(sky, reporter))
}

/// What the stage is called for people.
const SKY: &str = "sky";

/// What the blocks of a plan's sky are called.
///
/// # Errors
/// As [`lapse_params`].
pub fn sky_names(plan: &Plan) -> Result<SkyNames, BakeError> {
    Ok(names_of(plan, &lapse_params(&plan.site, &plan.files)?))
}

fn names_of(plan: &Plan, params: &LapseParams) -> SkyNames {
    SkyNames::new(plan, params.surroundings == Surroundings::Ground)
}

/// A shard's part of the sky.
pub struct SkyShare<'a> {
    plan: &'a Plan,
    skies: Skies,
    names: SkyNames,
    cache: &'a Cache,
    reporter: &'a dyn Reporter,
    share: Share,
}

impl<'a> SkyShare<'a> {
    /// That of a shard; the sky is the first of all stages.
    ///
    /// # Errors
    /// As [`lapse_params`].
    pub fn new(plan: &'a Plan, cache: &'a Cache, reporter: &'a dyn Reporter, share: Share) -> Result<Self, BakeError> {
        let params = lapse_params(&plan.site, &plan.files)?;
        let names = names_of(plan, &params);
        Ok(Self { plan, skies: Skies::new(params)?, names, cache, reporter, share })
    }

    /// The name of its files, and how many blocks it has: one for each sky.
    ///
    /// # Errors
    /// Times of probes that are not known.
    pub fn blocks(&self) -> Result<(&str, usize), BakeError> {
        Ok((&self.names.record, self.skies.params().sky_count()? as usize))
    }

    /// The suns of all steps, as [`BakedSky::suns`] has them. Those of a model are known at once; those of probes are found in them, its own
    /// first, then those that no other shard has looked at meanwhile.
    ///
    /// # Errors
    /// As [`bake_sky`].
    pub fn suns(&self) -> Result<Vec<Vec3>, BakeError> {
        let suns = match self.skies.known_suns()? {
            Some(suns) => suns,
            None => {
                self.make(|_| true)?;
                let mut keeper = CacheKeeper::new(self.plan, self.cache, self.reporter, &self.names);
                let built = day::build_keeping(self.skies.params(), &mut keeper);
                keeper.checked(built)?.suns
            }
        };
        Ok(suns.into_iter().map(|sun| sun.unwrap_or(Vec3::ZERO)).collect())
    }

    /// Makes its own skies; returns how many of them it has made now.
    ///
    /// # Errors
    /// As [`bake_sky`].
    pub fn run_own(&self) -> Result<usize, BakeError> {
        self.make(|number| self.share.takes(number))
    }

    fn make(&self, wanted: impl Fn(usize) -> bool) -> Result<usize, BakeError> {
        let (_, count) = self.blocks()?;
        let numbers = self.share.in_order((0..count).filter(|&number| wanted(number)));
        let numbers: Vec<u32> = numbers.into_iter().map(|number| number as u32).collect();
        self.reporter.stage(SKY, numbers.len() as u64);
        self.reporter.progress(0);
        let mut keeper = CacheKeeper::new(self.plan, self.cache, self.reporter, &self.names);
        let made = self.skies.make(&numbers, &mut keeper);
        keeper.checked(made)?;
        self.reporter.finished();
        Ok(keeper.made)
    }
}

fn told(sky: BakedSky, reporter: &dyn Reporter) -> BakedSky {
    sky.notes.iter().for_each(|note| reporter.warning(note));
    sky
}

/// Keeps each sky as soon as it is made: its map, then what was taken from it, so that a record never stands without its map.
struct CacheKeeper<'a> {
    plan: &'a Plan,
    cache: &'a Cache,
    reporter: &'a dyn Reporter,
    names: &'a SkyNames,
    /// Maps that were asked for.
    maps: u32,
    /// Skies that are done, and
    done: u64,
    /// of these, those that were made now.
    made: usize,
    failed: Option<BakeError>,
}

impl<'a> CacheKeeper<'a> {
    fn new(plan: &'a Plan, cache: &'a Cache, reporter: &'a dyn Reporter, names: &'a SkyNames) -> Self {
        Self { plan, cache, reporter, names, maps: 0, done: 0, made: 0, failed: None }
    }

    /// What was built with it. The keeper's own error says what to do.
    fn checked<T>(&mut self, built: Result<T, SkyError>) -> Result<T, BakeError> {
        match self.failed.take() {
            Some(error) => Err(error),
            None => Ok(built?),
        }
    }

    fn store(&self, number: u32, record: &SkyRecord, map: Option<SkyMap<'_>>) -> Result<(), BakeError> {
        // it is kept under the hashes of the probes
        self.plan.check_unchanged(|kind| kind == InputKind::Probe)?;
        if let Some(map) = map {
            self.cache.store(&self.names.map, map.index as usize, &map.image.to_hdr_bytes())?;
        }
        // plain numbers always have a JSON form; an empty block would only be made again
        let record = serde_json::to_vec(record).unwrap_or_default();
        Ok(self.cache.store(&self.names.record, number as usize, &record)?)
    }

    fn is_done(&mut self) {
        self.done += 1;
        self.reporter.progress(self.done);
    }
}

impl SkyKeeper for CacheKeeper<'_> {
    fn kept(&mut self, number: u32, map: Option<u32>) -> Option<SkyRecord> {
        self.maps = self.maps.max(map.map_or(0, |index| index + 1));
        let bytes = self.cache.load(&self.names.record, number as usize)?;
        let record = serde_json::from_slice(&bytes).ok()?;
        if let Some(index) = map {
            self.cache.load(&self.names.map, index as usize)?;
        }
        self.is_done();
        Some(record)
    }

    fn keep(&mut self, number: u32, record: &SkyRecord, map: Option<SkyMap<'_>>) -> Result<(), String> {
        self.store(number, record, map).map_err(|error| {
            let text = error.to_string();
            self.failed = Some(error);
            text
        })?;
        self.made += 1;
        self.is_done();
        Ok(())
    }
}

/// Hours of the sun's own time that clocks may differ from it before place and offset are more likely wrong; Spain's summer time is 2.6.
const CLOCKS_OFF_HOURS: f64 = 3.0;
/// Hours by which a site that names no offset may lie from Greenwich unsaid.
const NEAR_GREENWICH_HOURS: f64 = 0.5;

/// What is odd about where and by which clock a site's sky is: a wrong sign or a forgotten offset shifts the whole day.
#[must_use]
pub fn place_warnings(site: &Site) -> Vec<String> {
    let (Some(_), Some(longitude)) = (site.sky.model, site.site.longitude_deg) else { return Vec::new() };
    let (sun_hours, clock_hours) = (longitude / 15.0, site.site.utc_offset.hours());
    let off = clock_hours - sun_hours;
    if !site.says("site", "utc_offset") && sun_hours.abs() > NEAR_GREENWICH_HOURS {
        return vec![format!(
            "[site] has no utc_offset, so all times are UTC, from which the sun's own time at longitude {longitude} differs by {:.1} h: \
             write the offset of the site's clocks, utc_offset = \"+02:00\" or the like",
            sun_hours.abs()
        )];
    }
    if off.abs() > CLOCKS_OFF_HOURS {
        let way = if off > 0.0 { "behind" } else { "ahead of" };
        return vec![format!(
            "utc_offset and longitude hardly belong together: at longitude {longitude} the sun runs {:.1} h {way} such clocks; \
             east is positive in both",
            off.abs()
        )];
    }
    Vec::new()
}

/// What `site.toml` says of the day, as the sky's maker takes it.
///
/// # Errors
/// Times that are not one for each probe.
pub fn lapse_params(site: &Site, files: &[InputFile]) -> Result<LapseParams, BakeError> {
    let source = match site.sky.model {
        Some(model) => SkySource::Model(model_day(site, model)),
        None => SkySource::Probes(probe_series(site, files)?),
    };
    let bake = &site.bake;
    let time = |time: site::TimeOfDay| civil::TimeOfDay { seconds: time.seconds() };
    Ok(LapseParams {
        north_deg: site.site.north_deg,
        sun_steps: bake.sun_steps,
        sky_steps: bake.effective_sky_steps(),
        first: bake.first.map(time),
        last: bake.last.map(time),
        coefficients: bake.coefficients(),
        surroundings: surroundings(site),
        ..LapseParams::new(source)
    })
}

/// A site with ground of its own hides what its sky shows below the horizon.
fn surroundings(site: &Site) -> Surroundings {
    if site.parts.iter().any(|part| part.role == Role::Ground) { Surroundings::Ground } else { Surroundings::Open }
}

fn model_day(site: &Site, model: site::SkyModel) -> ModelDay {
    let kind = match model {
        site::SkyModel::Atmosphere => ModelKind::Atmosphere,
        site::SkyModel::HosekWilkie => ModelKind::HosekWilkie,
    };
    let default = ModelParams::default();
    let turbidity = site.sky.turbidity.map_or(default.turbidity, |turbidity| turbidity as f32);
    // a checked site with a model has all three
    let date = site.sky.date.map_or(civil::Date { year: 2000, month: 1, day: 1 }, |date| civil::Date {
        year: date.year,
        month: date.month,
        day: date.day,
    });
    ModelDay {
        model: ModelParams { kind, turbidity, ..default },
        latitude_deg: site.site.latitude_deg.unwrap_or(0.0),
        longitude_deg: site.site.longitude_deg.unwrap_or(0.0),
        utc_offset_hours: site.site.utc_offset.hours(),
        date,
    }
}

fn probe_series(site: &Site, files: &[InputFile]) -> Result<ProbeSeries, BakeError> {
    let sky = &site.sky;
    let probes: Vec<&InputFile> = files.iter().filter(|file| file.kind == InputKind::Probe).collect();
    let times: Vec<Option<civil::TimeOfDay>> = match &sky.times {
        ProbeTimes::InNames => vec![None; probes.len()],
        ProbeTimes::List(times) if times.len() != probes.len() => {
            let message = format!("{} times for {} probes", times.len(), probes.len());
            let remedy = "give one time for each probe, in the order of the sorted file names, or take the key out";
            return Err(site.error_at(&["sky", "times"], message, remedy).into());
        }
        ProbeTimes::List(times) => times.iter().map(|time| Some(civil::TimeOfDay { seconds: time.seconds() })).collect(),
    };
    let files = probes.iter().zip(times).map(|(file, time)| ProbeFile { path: file.path.clone(), time }).collect();
    let mapping = match sky.mapping.unwrap_or(site::Mapping::LatLong) {
        site::Mapping::LatLong => Mapping::LatLong,
        site::Mapping::Angular => Mapping::Angular,
        site::Mapping::MirrorBall => Mapping::MirrorBall,
        site::Mapping::CubeCross => Mapping::CubeCross,
        site::Mapping::Fisheye => Mapping::Fisheye { opening_deg: sky.opening_deg },
    };
    Ok(ProbeSeries {
        turn_deg: sky.turn_deg,
        below_horizon: match sky.below_horizon {
            site::BelowHorizon::Keep => BelowHorizon::Keep,
            site::BelowHorizon::Black => BelowHorizon::Black,
            site::BelowHorizon::Mirror => BelowHorizon::Mirror,
        },
        between: match sky.between {
            site::Between::Nearest => Between::Nearest,
            site::Between::Interpolate => Between::Interpolate,
        },
        sun_irradiance: sky.sun_irradiance.map(|rgb| glam::DVec3::from(rgb).as_vec3()),
        ..ProbeSeries::new(files, mapping)
    })
}
