//! A room's bodies from an OpenXR runtime, which may go and come back.

use crate::xr::tracker::{XrTracker, XrTrackerError};
use bevy::prelude::*;
use heliodon_bundle::display::{BodyKind, TrackerEntry};
use heliodon_track::report::Report;

/// How long a runtime that has gone is left alone.
const RETRY_S: f64 = 5.0;

/// A runtime, and the paths of the bodies.
pub(super) struct Runtime {
    paths: Vec<String>,
    tracker: Option<XrTracker>,
    retry_at_s: f64,
}

impl Runtime {
    /// Finds the runtime.
    pub(super) fn open(entry: &TrackerEntry) -> Result<Self, XrTrackerError> {
        let usual = |kind| match kind {
            BodyKind::Head => "/user/head",
            BodyKind::Wand => "/user/hand/right",
            BodyKind::LeftHand => "/user/hand/left",
        };
        let path = |(address, kind): (&Option<String>, BodyKind)| address.clone().unwrap_or_else(|| usual(kind).to_owned());
        let paths: Vec<String> = entry.bodies.iter().map(|body| path((&body.address, body.is))).collect();
        let tracker = Some(XrTracker::open(&paths)?);
        Ok(Self { paths, tracker, retry_at_s: 0.0 })
    }

    /// What it sees. One that breaks off is told, and looked for again every few seconds.
    pub(super) fn reports(&mut self, name: &str, now_s: f64, reports: &mut Vec<Report>) {
        if self.tracker.is_none() && now_s >= self.retry_at_s {
            self.retry_at_s = now_s + RETRY_S;
            self.tracker = XrTracker::open(&self.paths).ok();
            if self.tracker.is_some() {
                info!("tracker `{name}` is back");
            }
        }
        if let Some(tracker) = &mut self.tracker
            && let Err(why) = tracker.reports(now_s, reports)
        {
            warn!("tracker `{name}`: {why}; it is looked for again");
            (self.tracker, self.retry_at_s) = (None, now_s + RETRY_S);
        }
    }
}
