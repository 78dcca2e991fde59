//! A day from HDR images.

use super::{Entry, LapseNote, LapseParams, Sink, SkyMap, steps};
use crate::civil::TimeOfDay;
use crate::error::SkyError;
use crate::fit::ReceiverFit;
use crate::lapse::{Fitted, Sun};
use crate::mapping::{BelowHorizon, Mapping, ProbeGrid};
use crate::probe::Probe;
use crate::sun::{SunParams, find_sun};
use glam::Vec3;
use heliodon_image::HdrImage;
use std::path::PathBuf;
use std::sync::Arc;

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
}

/// A gap is longer than this many times the usual distance of two probes.
const GAP: f64 = 1.9;

/// What is kept of a probe.
#[derive(Clone)]
struct Taken {
    sun: Option<Sun>,
    sky: Vec<Vec3>,
    fitted: Option<Fitted>,
}

/// Which probes an entry is made of.
struct Mix {
    a: usize,
    b: usize,
    /// b's share.
    share: f32,
}

impl Mix {
    fn nearest(&self) -> usize {
        if self.share < 0.5 { self.a } else { self.b }
    }
}

pub(super) fn build(
    params: &LapseParams,
    series: &ProbeSeries,
    sink: Sink<'_>,
) -> Result<(Vec<Entry>, u32, Vec<LapseNote>), SkyError> {
    let probes = timed(series)?;
    let mut notes = Vec::new();
    let single = probes.len() == 1;
    let (first, last) = (probes[0].1, probes[probes.len() - 1].1);
    let times = if single {
        vec![first]
    } else {
        steps::times(params.first.unwrap_or(first), params.last.unwrap_or(last), params.sky_steps)?
    };
    let sun_steps = if single { 1 } else { params.sun_steps };
    let mixes: Vec<Mix> = times.iter().map(|&time| mix(&probes, time, series.between)).collect();
    let is_used = |k: usize| mixes.iter().any(|m| (m.a == k && m.share < 1.0) || (m.b == k && m.share > 0.0));
    let used: Vec<usize> = (0..probes.len()).filter(|&k| is_used(k)).collect();
    let is_shown = |k: usize| mixes.iter().any(|m| m.nearest() == k);
    let shown = used.iter().filter(|&&k| is_shown(k)).count() as u32;
    tell_gaps(&probes, &times, &mut notes);
    if used.len() < probes.len() {
        notes.push(LapseNote::Unused { probes: (probes.len() - used.len()) as u32 });
    }

    let mut taken: Vec<Option<Taken>> = vec![None; probes.len()];
    let mut names = vec![String::new(); probes.len()];
    let receivers = ReceiverFit::new(params.coefficients as usize, params.surroundings);
    let mut grid: Option<Arc<ProbeGrid>> = None;
    let mut index = 0;
    for &k in &used {
        let (probe, record) = take(params, series, &receivers, &probes[k].0, &mut grid, &mut notes)?;
        if is_shown(k) {
            names[k] = format!("sky/{:04}.hdr", index + 1);
            let image = drawn_map(params, series, &probe.0, &probe.1)?;
            let map = SkyMap { name: &names[k], image: &image, index, count: shown };
            sink(map).map_err(|problem| SkyError::Map { name: names[k].clone(), problem })?;
            index += 1;
        }
        taken[k] = Some(record);
    }
    let entries = times.iter().zip(&mixes).filter_map(|(&time, mix)| {
        let Taken { sun, sky, fitted } = mixed(mix, &taken)?;
        Some(Entry { time, sun, sky, fitted, map: names[mix.nearest()].clone(), sun_in_map: true })
    });
    Ok((entries.collect(), sun_steps, notes))
}

/// The probes with their times, in the order of time.
fn timed(series: &ProbeSeries) -> Result<Vec<(PathBuf, TimeOfDay)>, SkyError> {
    let mut probes = Vec::new();
    for file in &series.files {
        let name = file.path.display().to_string();
        let time = file.time.or_else(|| TimeOfDay::from_file_name(&name));
        let time = match time {
            Some(time) => time,
            None if series.files.len() == 1 => TimeOfDay::NOON,
            None => {
                return Err(SkyError::Probe {
                    name,
                    problem: "its name holds no time of day".into(),
                    remedy: "name it like 0657.hdr or sky_06-57.hdr, or list the times in sky.times",
                });
            }
        };
        probes.push((file.path.clone(), time));
    }
    probes.sort_by(|a, b| a.1.cmp(&b.1).then_with(|| a.0.cmp(&b.0)));
    if let Some(pair) = probes.windows(2).find(|pair| pair[0].1 == pair[1].1) {
        return Err(SkyError::Probe {
            name: pair[1].0.display().to_string(),
            problem: format!("{} is the time of {} too", pair[1].1, pair[0].0.display()),
            remedy: "give every probe a time of its own",
        });
    }
    if probes.is_empty() {
        return Err(SkyError::setting("probes", "there is none", "name at least one .hdr or .exr file"));
    }
    Ok(probes)
}

fn mix(probes: &[(PathBuf, TimeOfDay)], time: TimeOfDay, between: Between) -> Mix {
    let after = probes.partition_point(|p| p.1 < time).min(probes.len() - 1);
    let before = if probes[after].1 <= time { after } else { after.saturating_sub(1) };
    let (start, end) = (probes[before].1.seconds, probes[after].1.seconds);
    let share = if end > start { (time.seconds.clamp(start, end) - start) as f32 / (end - start) as f32 } else { 0.0 };
    match between {
        Between::Nearest => Mix { a: before, b: after, share: if share < 0.5 { 0.0 } else { 1.0 } },
        Between::Interpolate => Mix { a: before, b: after, share },
    }
}

fn tell_gaps(probes: &[(PathBuf, TimeOfDay)], times: &[TimeOfDay], notes: &mut Vec<LapseNote>) {
    let mut distances: Vec<u32> = probes.windows(2).map(|w| w[1].1.seconds - w[0].1.seconds).collect();
    distances.sort_unstable();
    let Some(&usual) = distances.get(distances.len() / 2) else { return };
    let between = |from: TimeOfDay, to: TimeOfDay| times.iter().filter(|&&t| t > from && t < to).count() as u32;
    let mut tell = |from: TimeOfDay, to: TimeOfDay| {
        let entries = between(from, to);
        if entries > 0 && f64::from(to.seconds.saturating_sub(from.seconds)) > GAP * f64::from(usual) {
            notes.push(LapseNote::Gap { from, to, entries });
        }
    };
    if let (Some(first), Some(start)) = (probes.first(), times.first()) {
        tell(TimeOfDay { seconds: start.seconds.saturating_sub(1) }, first.1);
    }
    probes.windows(2).for_each(|w| tell(w[0].1, w[1].1));
    if let (Some(last), Some(end)) = (probes.last(), times.last()) {
        tell(last.1, TimeOfDay { seconds: end.seconds + 1 });
    }
}

/// Reads a probe: as it is, without its sun, and what is kept of it.
fn take(
    params: &LapseParams,
    series: &ProbeSeries,
    receivers: &ReceiverFit,
    path: &std::path::Path,
    grid: &mut Option<Arc<ProbeGrid>>,
    notes: &mut Vec<LapseNote>,
) -> Result<((Probe, Probe), Taken), SkyError> {
    let name = path.display().to_string();
    let (image, repairs) = HdrImage::read_counted(path)?;
    if !repairs.is_none() {
        notes.push(LapseNote::Repaired { file: name.clone(), repairs });
    }
    let fits = |g: &Arc<ProbeGrid>| (g.geometry().width(), g.geometry().height()) == (image.width, image.height);
    let current = match grid.take().filter(fits) {
        Some(current) => current,
        None => {
            let turn = (series.turn_deg - params.north_deg).to_radians();
            let made = ProbeGrid::new(series.mapping, image.width, image.height, turn).map_err(|e| match e {
                SkyError::Probe { problem, remedy, .. } => SkyError::Probe { name: name.clone(), problem, remedy },
                other => other,
            })?;
            Arc::new(made)
        }
    };
    *grid = Some(current.clone());
    let probe = Probe::with_grid(image, current)?;
    let found = find_sun(&probe, &series.sun);
    let sunless = found.as_ref().map_or_else(|| probe.clone(), |f| probe.with_pixels(&f.replaced));
    let sun = found.map(|found| {
        let mut sun = found.sun;
        if sun.clipped {
            notes.push(LapseNote::Clipped { file: name.clone(), replaced: series.sun_irradiance.is_some() });
            if let Some(irradiance) = series.sun_irradiance {
                sun.irradiance = irradiance.to_array();
            }
        }
        sun
    });
    let sky = sunless.coefficients(params.coefficients as usize, series.below_horizon);
    let fitted = receivers.fit(&sunless, series.below_horizon, &sky, sun.as_ref());
    Ok(((probe, sunless), Taken { sun, sky, fitted }))
}

/// The lat-long map that is drawn: the probe with its sun.
fn drawn_map(params: &LapseParams, series: &ProbeSeries, probe: &Probe, sunless: &Probe) -> Result<HdrImage, SkyError> {
    let (width, height) = (probe.image().width, probe.image().height);
    // as fine as the probe's finest part
    let natural = match series.mapping {
        Mapping::LatLong => width,
        Mapping::Angular | Mapping::MirrorBall => 2 * width.min(height),
        Mapping::Fisheye { opening_deg } => (f64::from(width.min(height)) * 360.0 / opening_deg) as u32,
        Mapping::CubeCross => 4 * (width / 3).min(height / 3),
    };
    let width = natural.clamp(8, params.map_width) & !1;
    Ok(probe.to_lat_long(width, width / 2, series.below_horizon, sunless))
}

fn mixed(mix: &Mix, taken: &[Option<Taken>]) -> Option<Taken> {
    let near = taken[mix.nearest()].clone()?;
    if mix.share == 0.0 || mix.share == 1.0 {
        return Some(near);
    }
    let (a, b) = (taken[mix.a].as_ref()?, taken[mix.b].as_ref()?);
    let t = mix.share;
    let sky = a.sky.iter().zip(&b.sky).map(|(&a, &b)| a.lerp(b, t)).collect();
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
    Some(Taken { sun, sky, fitted })
}

impl Taken {
    /// What it is shaded with: fitted or not.
    fn shaded(&self) -> Fitted {
        let projected = || Fitted { glow: [0.0; 3], sky: self.sky.iter().map(Vec3::to_array).collect() };
        self.fitted.clone().unwrap_or_else(projected)
    }
}

fn mixed_fit(a: &Fitted, b: &Fitted, t: f32) -> Fitted {
    let between = |a: [f32; 3], b: [f32; 3]| Vec3::from_array(a).lerp(Vec3::from_array(b), t).to_array();
    Fitted { glow: between(a.glow, b.glow), sky: a.sky.iter().zip(&b.sky).map(|(&a, &b)| between(a, b)).collect() }
}
