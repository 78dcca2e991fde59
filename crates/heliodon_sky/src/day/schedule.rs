//! Which probes of a series make which entries of a day.

use super::{Between, LapseNote, LapseParams, ProbeSeries, steps};
use crate::civil::TimeOfDay;
use crate::error::SkyError;
use std::path::PathBuf;

/// A gap is longer than this many times the usual distance of two probes.
const GAP: f64 = 1.9;

/// So many probes or more, one minute apart by their names, may be numbers in place of times.
const FEWEST_NUMBERED: usize = 3;

/// Which probes an entry is made of.
pub(super) struct Mix {
    pub a: usize,
    pub b: usize,
    /// b's share.
    pub share: f32,
}

impl Mix {
    pub fn nearest(&self) -> usize {
        if self.share < 0.5 { self.a } else { self.b }
    }
}

/// When which probe holds.
pub(super) struct Schedule {
    /// The probes with their times, in the order of time.
    pub probes: Vec<(PathBuf, TimeOfDay)>,
    /// The entries' times.
    pub times: Vec<TimeOfDay>,
    /// What each entry is made of.
    pub mixes: Vec<Mix>,
    /// The probes of which something is needed, in order.
    pub used: Vec<usize>,
}

impl Schedule {
    pub fn new(params: &LapseParams, series: &ProbeSeries) -> Result<Self, SkyError> {
        let probes = timed(series)?;
        let (first, last) = (probes[0].1, probes[probes.len() - 1].1);
        let times = if series.is_single() {
            vec![first]
        } else {
            steps::times(params.first.unwrap_or(first), params.last.unwrap_or(last), params.sky_steps)?
        };
        let mixes: Vec<Mix> = times.iter().map(|&time| mix(&probes, time, series.between)).collect();
        let is_used = |k: usize| mixes.iter().any(|m| (m.a == k && m.share < 1.0) || (m.b == k && m.share > 0.0));
        let used = (0..probes.len()).filter(|&k| is_used(k)).collect();
        Ok(Self { probes, times, mixes, used })
    }

    /// Whether a probe's map is one that is drawn.
    pub fn is_shown(&self, probe: usize) -> bool {
        self.mixes.iter().any(|m| m.nearest() == probe)
    }

    /// What is odd about the times.
    pub fn notes(&self, series: &ProbeSeries) -> Vec<LapseNote> {
        let mut notes = Vec::new();
        if series.files.iter().all(|file| file.time.is_none()) && are_successive_minutes(&self.probes) {
            notes.push(LapseNote::Numbered { first: self.probes[0].1, last: self.probes[self.probes.len() - 1].1 });
        }
        tell_gaps(&self.probes, &self.times, &mut notes);
        if self.used.len() < self.probes.len() {
            notes.push(LapseNote::Unused { probes: (self.probes.len() - self.used.len()) as u32 });
        }
        notes
    }
}

/// Whether times are one minute apart and of one hour, as the numbers that cameras give their images read.
fn are_successive_minutes(probes: &[(PathBuf, TimeOfDay)]) -> bool {
    probes.len() >= FEWEST_NUMBERED
        && probes.windows(2).all(|pair| pair[1].1.seconds == pair[0].1.seconds + 60)
        && probes.iter().all(|probe| probe.1.seconds / 3600 == probes[0].1.seconds / 3600 && probe.1.seconds.is_multiple_of(60))
}

/// The probes with their times, in the order of time.
fn timed(series: &ProbeSeries) -> Result<Vec<(PathBuf, TimeOfDay)>, SkyError> {
    let mut probes = Vec::new();
    for file in &series.files {
        let name = file.path.display().to_string();
        // a single one stands for all times, and a number in its name is more likely a size or a count
        let read = if series.is_single() { TimeOfDay::written_in_file_name } else { TimeOfDay::from_file_name };
        let time = file.time.or_else(|| read(&name));
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
        return Err(SkyError::no_probes());
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
