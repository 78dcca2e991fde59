//! A watch on frame times: how they are spread, and what was going on in those that took long.

use crate::sky::SkyMaps;
use crate::stage::{Stage, StageStatus};
use crate::time_lapse::TimeLapse;
use bevy::prelude::*;
use std::fmt;
use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

/// Frames are counted by how long they took, in steps of a millisecond up to this, and all longer ones together.
const MOST_MS: usize = 1000;

/// A log that is longer is begun anew, the old one kept beside it: an installation runs for years.
const MOST_LOG_BYTES: u64 = 4 << 20;

/// Slow frames that are written down one by one in a minute; of the others, the number is.
const LINES_A_MINUTE: u32 = 60;

/// What was going on in a slow frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Slowness {
    /// How long it took, milliseconds.
    pub ms: f64,
    /// Seconds since the program began.
    pub at_s: f64,
    /// Frames since the program began.
    pub frame: u64,
    /// What may have been the cause.
    pub what: String,
}

impl fmt::Display for Slowness {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.1} s, frame {}: {:.1} ms, {}", self.at_s, self.frame, self.ms, self.what)
    }
}

/// How frames went since the program began.
#[derive(Resource, Debug)]
pub struct FrameWatch {
    slow_ms: f64,
    log: Option<PathBuf>,
    file: Option<File>,
    written: u64,
    counts: Vec<u32>,
    frames: u64,
    slow: u64,
    last: Option<Slowness>,
    minute: u64,
    lines: u32,
    left_out: u64,
}

impl FrameWatch {
    /// Frames of more than `slow_ms` are slow, and told in `log`.
    #[must_use]
    pub fn new(slow_ms: f64, log: Option<PathBuf>) -> Self {
        Self {
            slow_ms,
            log,
            file: None,
            written: 0,
            counts: vec![0; MOST_MS + 1],
            frames: 0,
            slow: 0,
            last: None,
            minute: 0,
            lines: 0,
            left_out: 0,
        }
    }

    /// Frames so far, and those of them that were slow.
    #[must_use]
    pub fn frames(&self) -> (u64, u64) {
        (self.frames, self.slow)
    }

    /// The slow frame that was last.
    #[must_use]
    pub fn last(&self) -> Option<&Slowness> {
        self.last.as_ref()
    }

    /// The frame time, in whole milliseconds, that `part` of all frames stayed within.
    #[must_use]
    pub fn within_ms(&self, part: f64) -> usize {
        let wanted = (part.clamp(0.0, 1.0) * self.frames as f64).ceil() as u64;
        let mut seen = 0;
        for (ms, &count) in self.counts.iter().enumerate() {
            seen += u64::from(count);
            if seen >= wanted {
                return ms + 1;
            }
        }
        MOST_MS
    }

    /// A frame took `ms`, and `what` was going on.
    fn count(&mut self, ms: f64, at_s: f64, what: impl FnOnce() -> String) {
        self.frames += 1;
        let slot = &mut self.counts[(ms.max(0.0) as usize).min(MOST_MS)];
        *slot = slot.saturating_add(1);
        if ms <= self.slow_ms {
            return;
        }
        self.slow += 1;
        let slowness = Slowness { ms, at_s, frame: self.frames, what: what() };
        let minute = (at_s / 60.0) as u64;
        if minute != self.minute {
            let left_out = std::mem::take(&mut self.left_out);
            if left_out > 0 {
                self.write(&format!("{left_out} more slow frames in that minute"));
            }
            (self.minute, self.lines) = (minute, 0);
        }
        if self.lines < LINES_A_MINUTE {
            self.lines += 1;
            self.write(&slowness.to_string());
        } else {
            self.left_out += 1;
        }
        self.last = Some(slowness);
    }

    /// A line of the log. What cannot be written is told once, and the show goes on.
    fn write(&mut self, line: &str) {
        let Some(path) = self.log.clone() else { return };
        if self.written > MOST_LOG_BYTES {
            self.file = None;
            self.written = 0;
            std::fs::rename(&path, older(&path)).ok();
        }
        if self.file.is_none() {
            match OpenOptions::new().create(true).append(true).open(&path) {
                Ok(file) => {
                    self.written = file.metadata().map_or(0, |data| data.len());
                    self.file = Some(file);
                }
                Err(why) => {
                    error!("{}: slow frames cannot be written there: {why}", path.display());
                    self.log = None;
                    return;
                }
            }
        }
        if let Some(file) = &mut self.file {
            match writeln!(file, "{line}") {
                Ok(()) => self.written += line.len() as u64 + 1,
                Err(why) => {
                    error!("{}: slow frames cannot be written there any more: {why}", path.display());
                    self.log = None;
                }
            }
        }
    }
}

/// Where a log that is full goes.
fn older(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".old");
    name.into()
}

pub(super) fn watch(
    time: Res<Time<Real>>,
    stage: Res<Stage>,
    lapse: Res<TimeLapse>,
    maps: Res<SkyMaps>,
    mut watch: ResMut<FrameWatch>,
    mut serial: Local<u64>,
) {
    let opened = *serial != stage.serial();
    *serial = stage.serial();
    // The first delta is of no frame.
    if time.delta_secs_f64() == 0.0 {
        return;
    }
    watch.count(time.delta_secs_f64() * 1e3, time.elapsed_secs_f64(), || {
        let mut what = Vec::new();
        match stage.status() {
            StageStatus::Loading { done, total } => what.push(format!("loading {done} of {total}")),
            StageStatus::Failed(why) => what.push(why.clone()),
            StageStatus::Empty | StageStatus::Ready => {}
        }
        if opened {
            what.push("another bundle".to_owned());
        }
        if let Some(why) = maps.missing() {
            what.push(why.to_owned());
        }
        what.push(format!("{} {}", crate::hud::clock_text(lapse.clock_s), if lapse.playing { "passing" } else { "paused" }));
        what.join(", ")
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slow_frames_are_written_down_and_the_log_stays_small() {
        let folder = tempfile::tempdir().unwrap();
        let log = folder.path().join("frames.log");
        let mut watch = FrameWatch::new(50.0, Some(log.clone()));
        for frame in 0..600 {
            let ms = if frame % 2 == 0 { 10.5 } else { 80.0 };
            watch.count(ms, f64::from(frame) * 0.05, || "noon".to_owned());
        }
        assert_eq!((watch.frames(), watch.within_ms(0.5), watch.within_ms(0.99)), ((600, 300), 11, 81));
        let text = std::fs::read_to_string(&log).unwrap();
        assert_eq!(text.lines().count(), LINES_A_MINUTE as usize);
        assert_eq!(text.lines().next(), Some("0.1 s, frame 2: 80.0 ms, noon"));
        watch.count(80.0, 61.0, || "later".to_owned());
        assert!(std::fs::read_to_string(&log).unwrap().contains("240 more slow frames"));
        watch.written = MOST_LOG_BYTES + 1;
        watch.count(80.0, 62.0, || "anew".to_owned());
        assert_eq!(std::fs::read_to_string(&log).unwrap().lines().count(), 1);
        assert!(older(&log).exists());
    }

    #[test]
    fn a_log_that_cannot_be_written_ends_nothing() {
        let mut watch = FrameWatch::new(1.0, Some(PathBuf::from("/nowhere/at/all.log")));
        watch.count(2.0, 0.0, String::new);
        watch.count(2.0, 0.1, String::new);
        assert_eq!(watch.frames(), (2, 2));
    }
}
